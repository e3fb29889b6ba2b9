"""How clouds look in Edit Mode: colors on show, groups, hidden points, and what modifiers move; drawn in a window."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, local_points, sphere_points
from tests.blender.conftest import part
from tests.blender.test_colormaps import oklab

SOLID = SimpleNamespace(type="SOLID", show_xray=False)


@pytest.fixture
def editing():
    return part("ui.editing")


@pytest.fixture
def obj():
    """A sphere shown as a surface, the active and selected object."""
    obj = add_object(sphere_points(800))
    obj.select_set(True)
    bpy.ops.meshfree.show_surface()
    return obj


@pytest.fixture
def look(editing, obj):
    """A function that goes to Edit Mode, and says how the points look there."""

    def ask():
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_mode(type="VERT")
        return editing.look(obj, bpy.context.evaluated_depsgraph_get())

    yield ask
    if bpy.context.object is not None and bpy.context.object.mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")


def color(code):
    return part("ui.colormaps").group_color(code)


@pytest.mark.any_blender
def test_discs_without_colors(look, obj):
    discs, points = attribute(obj, "lb_disc"), local_points(obj)
    seen = look()
    assert_allclose(seen.places, points)
    assert_allclose(seen.discs, discs)
    assert (seen.colors == seen.colors[0]).all()
    assert 0.0 < seen.colors[0, 0] == seen.colors[0, 2] < 1.0


@pytest.mark.any_blender
def test_results_have_the_colors_that_solid_shows(look, obj):
    bpy.ops.meshfree.analyze(modes=4)
    bpy.ops.meshfree.colormap(attribute="lb_eigenvector_002", range_mode="PERCENTILE")
    solid = np.empty((800, 4), np.float32)
    obj.data.attributes[".lb_color"].data.foreach_get("color", solid.reshape(-1))
    assert np.ptp(solid[:, 0]) > 0.3
    assert_allclose(look().colors, solid, atol=1e-6)


def test_own_colors(look, obj):
    own = np.random.default_rng(0).uniform(size=(800, 4)).astype(np.float32)
    layer = obj.data.color_attributes.new("Photo", "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", own.reshape(-1))
    assert_allclose(look().colors[:, :3], own[:, :3])


def test_points_of_groups_have_the_colors_of_these(look, obj):
    add_group(obj, "Handle", [3, 4])
    add_group(obj, "Anchor", [4, 5])
    plain = look().colors[0]
    obj.meshfree.show_groups = True
    colors = look().colors
    assert_allclose(colors[[3, 5]], [color("Handle"), color("Anchor")], rtol=1e-6)
    assert (colors[4] != plain).any()
    assert_allclose(colors[0], plain)


def test_no_group_looks_selected():
    chosen = part("ui.colormaps").to_linear(bpy.context.preferences.themes[0].view_3d.vertex_select)
    for role in part("tools.groups").ROLES:
        difference = np.diff(oklab([color(role), chosen]), axis=0)
        assert np.linalg.norm(difference) > 0.15, role


@pytest.mark.any_blender
def test_hidden_points_and_those_beyond_a_range_that_hides_them_are_not_drawn(look, obj):
    points = local_points(obj)
    layer = obj.data.attributes.new("height", "FLOAT", "POINT")
    layer.data.foreach_set("value", points[:, 2])
    bpy.ops.meshfree.colormap(attribute="height")
    obj.meshfree.outside, obj.meshfree.range_low, obj.meshfree.range_high = "HIDE", -0.5, 2.0
    obj.meshfree.range_mode = "LOCKED"
    obj.data.vertices.foreach_set("select", points[:, 0] > 0.0)
    look()
    bpy.ops.mesh.hide()
    seen = look()
    assert ((seen.colors[:, 3] == 0.0) == ((points[:, 0] > 0.0) | (points[:, 2] < -0.5))).all()


@pytest.mark.any_blender
def test_points_are_where_modifiers_move_them(look, obj):
    for name, sign in (("Handle", 1.0), ("Anchor", -1.0)):
        add_group(obj, name, np.flatnonzero(sign * local_points(obj)[:, 2] > 0.8))
    bpy.ops.meshfree.deform_bind()
    bpy.data.objects["Cloud Handle"].location.x += 1.0
    bpy.context.view_layer.update()
    bpy.ops.meshfree.deform_update()
    expected = local_points(obj) + attribute(obj, "lb_displacement")
    bpy.context.view_layer.objects.active = obj
    seen = look()
    assert np.ptp(seen.places[:, 0]) > 2.2
    assert_allclose(seen.places, expected, atol=1e-5)


def test_modifiers_that_change_the_number_of_points_leave_it_to_blender(look, obj):
    array = obj.modifiers.new("Array", "ARRAY")
    obj.modifiers.move(list(obj.modifiers).index(array), 0)
    assert look() is None


def test_where_points_are_drawn(editing, display, obj):
    modifier = display.find_display(obj)
    assert editing.is_drawn(obj, SOLID)
    assert editing.is_drawn(obj, SimpleNamespace(type="MATERIAL"))
    assert not editing.is_drawn(obj, SimpleNamespace(type="SOLID", show_xray=True))
    assert not editing.is_drawn(obj, SimpleNamespace(type="WIREFRAME", show_xray_wireframe=False))
    modifier.show_in_editmode = True  # by its icon
    assert not editing.is_drawn(obj, SOLID)
    modifier.show_in_editmode = modifier.show_viewport = False
    assert not editing.is_drawn(obj, SOLID)
    assert not editing.is_drawn(add_object(sphere_points(10)), SOLID)


def test_nothing_is_attached_in_background_mode(editing):
    editing.attach()
    assert editing._handlers == []
