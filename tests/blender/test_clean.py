"""Stray points in Blender: shown with their number, then selected, hidden, separated or deleted; points left out."""

from dataclasses import replace

import bpy
import numpy as np
import pytest

import core
from tests.blender.clouds import add_group, add_object, attribute, local_points, sphere_points
from tests.blender.conftest import part
from tests.blender.splats import add_splats, bar_splats

SPHERE = sphere_points(600)
STRAY = np.concatenate([1.6 * SPHERE[::60], [[0.0, 0.0, 0.3]]])
POINTS = np.concatenate([SPHERE, STRAY])
IS_STRAY = np.arange(len(POINTS)) >= len(SPHERE)


def clouds(kinds=("MESH", "POINTCLOUD")):
    return [kind for kind in kinds if kind == "MESH" or bpy.app.version >= (4, 5)]


def add_cloud(kind="MESH", points=POINTS):
    obj = add_object(points)
    obj.select_set(True)
    obj.data.attributes.new("number", "INT", "POINT").data.foreach_set("value", np.arange(len(points), dtype=np.int32))
    if kind == "POINTCLOUD":
        bpy.ops.meshfree.convert(target="POINTCLOUD")
    return bpy.context.object


def selected(obj):
    chosen = np.empty(len(obj.data.vertices), dtype=bool)
    obj.data.vertices.foreach_get("select", chosen)
    return chosen


@pytest.mark.parametrize("kind", clouds())
def test_they_are_shown_with_number_and_share_as_core_finds_them(kind):
    obj = add_cloud(kind)
    obj.scale = (2.0, 2.0, 2.0)
    assert bpy.ops.meshfree.stray_points() == {"FINISHED"}
    np.testing.assert_array_equal(attribute(obj, "lb_stray"), core.clean.stray_points(POINTS))
    np.testing.assert_array_equal(attribute(obj, "lb_stray"), IS_STRAY)
    assert [notice.text for notice in obj.meshfree.notices] == [f"{obj.name}: 11 of 611 points are stray (1.80%)"]
    assert any("Display" in modifier.name or modifier.type == "NODES" for modifier in obj.modifiers)
    assert len(obj.data.attributes["position"].data) == 611


def test_settings_reach_core():
    obj = add_cloud(points=np.concatenate([SPHERE, 0.3 * sphere_points(60) + [3.0, 0.0, 0.0], [[0.0, 0.0, 1.25]]]))
    strays = core.clean.Strays(local_points(obj))
    for settings in ({"strictness": 5.0}, {"strictness": 0.2}, {"smallest": 61}, {"smallest_area": 2.0}, {}):
        bpy.ops.meshfree.stray_points(**settings)
        strictness = settings.get("strictness", 1.0)
        sizes = {name: value for name, value in settings.items() if name != "strictness"}
        np.testing.assert_array_equal(attribute(obj, "lb_stray"), strays.chosen(strictness, **sizes))


def test_areas_are_those_of_the_scaled_object():
    obj = add_cloud(points=np.concatenate([SPHERE, 0.3 * sphere_points(60) + [3.0, 0.0, 0.0]]))
    obj.scale = (10.0, 10.0, 10.0)
    bpy.ops.meshfree.stray_points(smallest_area=2.0)
    assert not attribute(obj, "lb_stray").any()
    bpy.ops.meshfree.stray_points(smallest_area=200.0)
    assert attribute(obj, "lb_stray").sum() == 60


@pytest.mark.parametrize("kind", clouds())
def test_they_are_deleted_with_what_they_hold(kind):
    obj = add_cloud(kind)
    assert bpy.ops.meshfree.stray_points(action="DELETE") == {"FINISHED"}
    np.testing.assert_array_equal(attribute(obj, "number"), np.arange(600))
    assert obj.meshfree.notices[0].text.endswith("are stray (1.80%), deleted")


@pytest.mark.parametrize("kind", clouds())
def test_they_are_separated(kind):
    obj = add_cloud(kind)
    assert bpy.ops.meshfree.stray_points(action="SEPARATE") == {"FINISHED"}
    part = bpy.data.objects[f"{obj.name} Stray"]
    np.testing.assert_array_equal(attribute(obj, "number"), np.arange(600))
    np.testing.assert_array_equal(attribute(part, "number"), np.arange(600, 611))
    assert bpy.context.object == obj
    assert f'in "{part.name}"' in obj.meshfree.notices[0].text


def test_they_are_selected_and_hidden():
    obj = add_cloud()
    bpy.ops.meshfree.stray_points(action="SELECT")
    np.testing.assert_array_equal(selected(obj), IS_STRAY)
    bpy.ops.meshfree.stray_points(action="HIDE")
    hidden = np.empty(len(POINTS), dtype=bool)
    obj.data.vertices.foreach_get("hide", hidden)
    np.testing.assert_array_equal(hidden, IS_STRAY)
    assert not selected(obj).any()


def test_buttons_act_on_what_is_shown():
    """The panel deletes what it shows, though looking again would find less."""
    obj = add_cloud()
    obj.data.attributes.new("lb_stray", "BOOLEAN", "POINT").data.foreach_set("value", np.arange(611) < 50)
    bpy.ops.meshfree.stray_points(action="DELETE", as_shown=True)
    np.testing.assert_array_equal(attribute(obj, "number"), np.arange(50, 611))


def shown(obj):
    """What the display of an object shows."""
    display = part("ui.display")
    modifier = display.find_display(obj)
    material = modifier and part("operators.objects.modifiers").get_input(modifier, "Material")
    return modifier is not None, display.shown_attribute(obj), material and material.name


def show_own(obj):
    obj.data.materials.append(bpy.data.materials.new("Clay"))
    bpy.ops.meshfree.show_surface()


@pytest.mark.parametrize("action", ["DELETE", "SEPARATE"])
@pytest.mark.parametrize(
    "show",
    [
        lambda obj: None,
        lambda obj: bpy.ops.meshfree.show_surface(),
        lambda obj: bpy.ops.meshfree.colormap(attribute="number"),
        show_own,
    ],
)
def test_what_was_shown_before_is_shown_again_when_they_are_gone(show, action):
    obj = add_cloud()
    show(obj)
    before = shown(obj)
    bpy.ops.meshfree.stray_points()
    bpy.ops.meshfree.stray_points()  # again
    assert shown(obj)[1] == "lb_stray"
    bpy.ops.meshfree.stray_points(action="SELECT", as_shown=True)
    assert shown(obj)[1] == "lb_stray"
    bpy.ops.meshfree.stray_points(action=action, as_shown=True)
    for each in bpy.data.objects:
        assert shown(each)[:2] == before[:2]
    if before[2] in {None, "Clay"}:
        assert shown(obj) == before


def test_undo_takes_it_back():
    obj = add_cloud()
    bpy.ops.ed.undo_push()
    bpy.ops.meshfree.stray_points("EXEC_DEFAULT", True, action="DELETE")
    assert len(obj.data.vertices) == 600
    bpy.ops.ed.undo()
    assert len(bpy.context.object.data.vertices) == 611


def test_among_the_selected_points_only():
    obj = add_cloud()
    half = POINTS[:, 0] > 0.0
    obj.data.vertices.foreach_set("select", half)
    bpy.ops.meshfree.stray_points(only_selected=True)
    np.testing.assert_array_equal(attribute(obj, "lb_stray"), IS_STRAY & half)


def test_edit_mode_selects_them():
    obj = add_cloud()
    bpy.ops.object.mode_set(mode="EDIT")
    assert bpy.ops.meshfree.select_strays() == {"FINISHED"}
    assert obj.mode == "EDIT"
    bpy.ops.mesh.delete(type="VERT")
    bpy.ops.object.mode_set(mode="OBJECT")
    np.testing.assert_array_equal(attribute(obj, "number"), np.arange(600))


def test_floaters_are_stray_splats():
    splats = bar_splats(core, degree=0)
    splats = replace(splats, opacities=np.where(np.arange(len(splats)) == 7, 0.01, splats.opacities))
    obj = add_splats(splats)
    bpy.ops.meshfree.stray_points()
    np.testing.assert_array_equal(np.flatnonzero(attribute(obj, "lb_stray")), [7])
    obj.meshfree.leave_out_floaters = False
    bpy.ops.meshfree.stray_points()
    assert not attribute(obj, "lb_stray").any()


def test_what_cannot_be_done_is_told():
    obj = add_cloud(points=SPHERE)
    with pytest.raises(RuntimeError, match="No stray points of .* were found yet. Press Stray Points first"):
        bpy.ops.meshfree.stray_points(action="DELETE", as_shown=True)
    with pytest.raises(RuntimeError, match="No points of .* are stray. Raise Strictness to find more"):
        bpy.ops.meshfree.select_strays()
    obj.data.vertices.foreach_set("select", np.zeros(600, dtype=bool))
    with pytest.raises(RuntimeError, match="are selected. Select some, or turn off Among Selected"):
        bpy.ops.meshfree.stray_points(only_selected=True)
    obj.data.attributes.new("lb_stray", "BOOLEAN", "POINT").data.foreach_set("value", np.ones(600, dtype=bool))
    with pytest.raises(RuntimeError, match="All 600 points are stray"):
        bpy.ops.meshfree.stray_points(action="DELETE", as_shown=True)
    assert len(obj.data.vertices) == 600


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="meshes become point clouds from Blender 4.5 on")
def test_point_clouds_hide_nothing():
    add_cloud("POINTCLOUD")
    with pytest.raises(RuntimeError, match="cannot be hidden. Separate them instead"):
        bpy.ops.meshfree.stray_points(action="HIDE")


def test_points_left_out_are_selected():
    obj = add_cloud()
    with pytest.raises(RuntimeError, match="is not analyzed"):
        bpy.ops.meshfree.select_left_out()
    bpy.ops.meshfree.analyze()
    assert obj.meshfree.left_out_count > 0
    bpy.ops.meshfree.select_left_out()
    np.testing.assert_array_equal(selected(obj), attribute(obj, "lb_component") == -1)
    assert selected(obj).sum() == obj.meshfree.left_out_count
    assert bpy.ops.meshfree.select_left_out(edit_mode=True) == {"FINISHED"}
    assert obj.mode == "EDIT"
    assert bpy.ops.meshfree.select_left_out() == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    obj.data.vertices[0].co.x += 0.1
    with pytest.raises(RuntimeError, match="are stale"):
        bpy.ops.meshfree.select_left_out()


@pytest.mark.parametrize("kind", clouds())
def test_thinned_points_are_those_of_core_with_what_they_hold(kind):
    obj = add_cloud(kind, SPHERE)
    obj.scale = (2.0, 2.0, 2.0)
    assert bpy.ops.meshfree.thin_out(spacing=0.6) == {"FINISHED"}
    np.testing.assert_array_equal(attribute(obj, "number"), core.clean.thin_out(SPHERE, spacing=0.3))
    count = len(attribute(obj, "number"))
    assert obj.meshfree.notices[0].text == f"{obj.name}: {count} of 600 points are left, at least 60 cm from each other"


def test_thinning_to_a_number_keeps_groups_and_results_and_can_be_undone():
    obj = add_cloud(points=SPHERE)
    add_group(obj, "Source", SPHERE[:, 2] > 0.5)
    bpy.ops.meshfree.analyze()
    areas = attribute(obj, "lb_area")
    bpy.ops.ed.undo_push()
    bpy.ops.meshfree.thin_out("EXEC_DEFAULT", True, by="NUMBER", count=100)
    kept = attribute(obj, "number")
    assert 95 <= len(kept) <= 100
    np.testing.assert_array_equal(attribute(obj, "lb_area"), areas[kept])
    members = [vertex.index for vertex in obj.data.vertices if len(vertex.groups)]
    np.testing.assert_array_equal(members, np.flatnonzero(SPHERE[kept, 2] > 0.5))
    bpy.ops.ed.undo()
    assert len(bpy.context.object.data.vertices) == 600


def test_thinning_by_itself_doubles_the_spacing():
    obj = add_cloud(points=SPHERE)
    bpy.ops.meshfree.thin_out()
    assert 600 / 8 < len(obj.data.vertices) < 600 / 3


def test_thinning_by_itself_leaves_a_quarter():
    obj = add_cloud(points=SPHERE)
    bpy.ops.meshfree.thin_out(by="NUMBER")
    assert len(obj.data.vertices) == 150
