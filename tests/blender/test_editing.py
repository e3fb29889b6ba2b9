"""How clouds look in Edit Mode: colors on show, groups, hidden points, and what modifiers move; drawn in a window."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Matrix
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


def test_files_of_earlier_versions(editing, display, obj):
    display.find_display(obj).show_in_editmode = True
    meshed = add_object(sphere_points(40), faces=[(0, 1, 2)])
    part("ui.show").show_surface(meshed)
    editing.on_load()
    assert not display.find_display(obj).show_in_editmode
    assert display.find_display(meshed).show_in_editmode


def test_nothing_is_attached_in_background_mode(editing):
    editing.attach()
    assert editing._handlers == []


class TestDrawing:
    """Pictures of the points as a view gets them, drawn without a window, which Blender can from 5.1 on."""

    SIDE = 200

    @pytest.fixture
    def draw(self, editing, obj):
        """A function that goes to Edit Mode, and draws the object from above, (side, side, 4), linear."""
        gpu = pytest.importorskip("gpu")
        if not hasattr(gpu, "init"):
            pytest.skip("this Blender draws in windows only")
        try:
            gpu.init()
        except SystemError as error:
            pytest.skip(f"nothing can be drawn here: {error}")

        def ask(clip=False):
            if obj.mode != "EDIT":
                bpy.ops.object.mode_set(mode="EDIT")
                bpy.ops.mesh.select_mode(type="VERT")
            screen = Matrix.Diagonal((0.8, 0.8, -0.1, 1.0))
            planes = [(1.0, 0.0, 0.0, 0.0) if clip else (0.0, 0.0, 0.0, 1.0), *[(0.0, 0.0, 0.0, 1.0)] * 5]
            view = {"view_matrix": Matrix(), "window_matrix": screen, "is_perspective": False, "view_distance": 5.0}
            context = SimpleNamespace(
                region_data=SimpleNamespace(**view, use_clip_planes=clip, clip_planes=planes),
                region=SimpleNamespace(height=self.SIDE),
                preferences=bpy.context.preferences,
                view_layer=bpy.context.view_layer,
            )
            editing._kept.clear()
            target = gpu.types.GPUOffScreen(self.SIDE, self.SIDE, format="RGBA32F")
            with target.bind():
                buffer = gpu.state.active_framebuffer_get()
                buffer.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
                editing._draw_object(context, obj)
                pixels = buffer.read_color(0, 0, self.SIDE, self.SIDE, 4, 0, "FLOAT")
            return np.array(pixels.to_list())

        yield ask
        editing._kept.clear()
        editing._shaders.clear()
        if obj.mode == "EDIT":
            bpy.ops.object.mode_set(mode="OBJECT")

    @pytest.mark.any_blender
    def test_colors_selection_and_clipping(self, draw, obj):
        colors = np.tile(np.float32([0.1, 0.6, 0.2, 1.0]), (800, 1))
        obj.data.color_attributes.new("Photo", "FLOAT_COLOR", "POINT").data.foreach_set("color", colors.reshape(-1))
        points = local_points(obj)
        obj.data.vertices.foreach_set("select", points[:, 0] > 0.0)
        seen = draw()
        inside = np.hypot(*np.mgrid[-1.25 : 1.25 : 1j * self.SIDE, -1.25 : 1.25 : 1j * self.SIDE]) < 0.95
        assert (seen[inside, 3] == 1.0).mean() > 0.99
        assert (seen[np.roll(inside, 100, axis=0) & ~inside, 3] == 1.0).mean() < 0.3
        left, right = seen[60:140, 50:90], seen[60:140, 110:150]
        ratio = left[..., :3] / left[..., 1:2]
        assert_allclose(np.median(ratio, axis=(0, 1)), [1.0 / 6.0, 1.0, 1.0 / 3.0], rtol=0.02)
        chosen = np.array(part("ui.colormaps").to_linear(bpy.context.preferences.themes[0].view_3d.vertex_select))
        assert_allclose(np.median(right[..., 1] / right[..., 0]), chosen[1] / chosen[0], rtol=0.02)
        assert 0.7 < left[..., 1].max() / 0.6 <= 1.0  # lit from the eye
        clipped = draw(clip=True)
        assert clipped[60:140, 50:75, 3].max() == 0.0
        assert_allclose(clipped[60:140, 125:150], right[:, 15:], atol=1e-6)
