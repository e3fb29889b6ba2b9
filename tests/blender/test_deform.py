"""Deformation: bound once, updated for every move of a controller or of the handles themselves."""

import importlib

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, everything, grid_points, local_points
from tests.blender.test_smooth import key_points, shown_points


@pytest.fixture
def strip():
    """Add a flat strip along x, held at one end, with handles at the other."""
    points, _ = grid_points(columns=60, rows=12, step=0.1, jitter=0.0)
    obj = add_object(points)
    add_group(obj, "Anchor", points[:, 0] < 0.25)
    add_group(obj, "Handle", points[:, 0] > 5.65)
    return obj


def test_nothing_moves_without_a_move(strip):
    before = local_points(strip)
    assert bpy.ops.meshfree.deform_bind() == {"FINISHED"}
    assert bpy.ops.meshfree.deform_update() == {"FINISHED"}
    assert_allclose(shown_points(strip), before, atol=1e-5)
    assert attribute(strip, "lb_displacement").max() < 1e-5


def test_the_controller_moves_the_handles(core, strip):
    before = local_points(strip)
    strip.location, strip.rotation_euler, strip.scale = (5.0, 1.0, 2.0), (0.4, 0.0, 0.3), (1.0, 1.0, 2.0)
    bpy.ops.meshfree.deform_bind()
    empty = bpy.data.objects["Cloud Handle"]
    empty.location += strip.matrix_world.to_3x3() @ Matrix.Identity(3).col[2]
    bpy.ops.meshfree.deform_update()
    after = shown_points(strip)
    handles, anchors = before[:, 0] > 5.65, before[:, 0] < 0.25
    assert_allclose(after[handles] - before[handles], np.tile([0.0, 0.0, 1.0], (handles.sum(), 1)), atol=1e-4)
    assert_allclose(after[anchors], before[anchors], atol=1e-5)
    height = after[:, 2][np.argsort(before[:, 0], kind="stable")].reshape(60, 12).mean(axis=1)
    assert (np.diff(height) > -1e-3).all()
    assert attribute(strip, "lb_displacement")[handles] == pytest.approx(2.0, rel=0.01)  # in the world


def test_the_same_as_core(core, strip):
    bpy.ops.meshfree.deform_bind(controller=False, target="IN_PLACE")
    before = local_points(strip)
    handles, anchors = before[:, 0] > 5.65, before[:, 0] < 0.25
    moved = before.copy()
    moved[handles] += [-0.5, 0.0, 1.0]
    strip.data.attributes["position"].data.foreach_set("vector", moved.astype(np.float32).reshape(-1))
    bpy.ops.meshfree.deform_update()
    laplacian = core.build_laplacian(before, options=core.LaplacianOptions(orient=True))
    expected = core.Deformer(laplacian, np.flatnonzero(handles), np.flatnonzero(anchors)).solve(moved[handles])
    assert_allclose(local_points(strip), expected, atol=1e-4)


def test_updating_twice_is_updating_once(strip):
    bpy.ops.meshfree.deform_bind()
    bpy.data.objects["Cloud Handle"].location.z += 1.0
    bpy.ops.meshfree.deform_update()
    once = key_points(strip, "Deform")
    bpy.ops.meshfree.deform_update()
    assert_allclose(key_points(strip, "Deform"), once, atol=1e-6)
    bpy.data.objects["Cloud Handle"].location.z -= 1.0
    bpy.ops.meshfree.deform_update()
    assert_allclose(key_points(strip, "Deform"), key_points(strip, "Basis"), atol=1e-5)


def test_handles_moved_in_their_shape_key(strip):
    bpy.ops.meshfree.deform_bind(controller=False)
    points = key_points(strip, "Deform")
    handles = points[:, 0] > 5.65
    points[handles, 2] += 0.7
    strip.data.shape_keys.key_blocks["Deform"].points.foreach_set("co", points.astype(np.float32).reshape(-1))
    bpy.ops.meshfree.deform_update()
    after = key_points(strip, "Deform")
    assert_allclose(after[handles, 2], 0.7, atol=1e-5)
    assert 0.0 < after[~handles, 2].max() < 0.75


def test_soft_handles_give_way(strip):
    bpy.ops.meshfree.deform_bind(soft=True, weight=0.01)
    bpy.data.objects["Cloud Handle"].location.z += 1.0
    bpy.ops.meshfree.deform_update()
    heights = shown_points(strip)[local_points(strip)[:, 0] > 5.65, 2]
    assert np.abs(heights - 1.0).max() > 1e-3


@pytest.mark.parametrize(
    ("group", "text"), [("Nowhere", 'no vertex group named "Nowhere"'), ("", "no Handles chosen.*Edit Mode")]
)
def test_binding_without_handles(strip, group, text):
    before = everything(strip)
    with pytest.raises(RuntimeError, match=text):
        bpy.ops.meshfree.deform_bind(handles=group)
    assert everything(strip) == before


def test_points_in_both_groups(strip):
    before = everything(strip)
    with pytest.raises(RuntimeError, match="handles and anchors|both"):
        bpy.ops.meshfree.deform_bind(anchors="Handle")
    assert everything(strip) == before


def test_updating_what_is_not_bound(strip):
    before = everything(strip)
    with pytest.raises(RuntimeError, match="not bound.*Bind it"):
        bpy.ops.meshfree.deform_update()
    assert everything(strip) == before


def test_a_controller_that_was_deleted(strip):
    bpy.ops.meshfree.deform_bind()
    bpy.data.objects.remove(bpy.data.objects["Cloud Handle"])
    before = everything(strip)
    with pytest.raises(RuntimeError, match="is gone. Bind"):
        bpy.ops.meshfree.deform_update()
    assert everything(strip) == before


def test_the_value_of_the_key_does_not_count_for_handles_moved_in_it(strip):
    bpy.ops.meshfree.deform_bind(controller=False)
    key = strip.data.shape_keys.key_blocks["Deform"]
    points = key_points(strip, "Deform")
    handles = points[:, 0] > 5.65
    points[handles, 2] += 0.7
    key.points.foreach_set("co", points.astype(np.float32).reshape(-1))
    key.value = 0.5
    other = strip.shape_key_add(name="Other", from_mix=False)
    other.points.foreach_set("co", (2.0 * local_points(strip)).astype(np.float32).reshape(-1))
    other.value = 1.0
    for _ in range(2):
        bpy.ops.meshfree.deform_update()
        assert_allclose(key_points(strip, "Deform")[handles], points[handles], atol=1e-5)


@pytest.mark.parametrize("target", ["SHAPE_KEY", "IN_PLACE"])
@pytest.mark.parametrize("controller", [True, False])
def test_an_object_that_is_scaled_and_moved_after_binding(strip, target, controller):
    bpy.ops.meshfree.deform_bind(controller=controller, target=target)
    before = local_points(strip)
    strip.scale, strip.location = (-1.0, 2.0, 0.5), (3.0, 0.0, 0.0)
    if controller:
        empty = bpy.data.objects["Cloud Handle"]
        empty.matrix_world = Matrix.LocRotScale(strip.location, None, strip.scale) @ empty.matrix_world
    bpy.ops.meshfree.deform_update()
    assert_allclose(shown_points(strip), before, atol=1e-5)


def test_new_names_and_undo_do_not_loosen_the_controller(strip):
    bpy.ops.meshfree.deform_bind()
    bpy.data.objects["Cloud Handle"].name = "Lever"
    strip.name = "Strip"
    bpy.ops.ed.undo_push(message="Renamed")
    bpy.data.objects["Lever"].location.z += 1.0
    bpy.ops.meshfree.deform_update("EXEC_DEFAULT", True)
    bpy.ops.ed.undo()
    bpy.data.objects["Lever"].location.z += 0.5
    bpy.ops.meshfree.deform_update()
    strip = bpy.data.objects["Strip"]
    handles = local_points(strip)[:, 0] > 5.65
    assert_allclose(key_points(strip, "Deform")[handles, 2], 0.5, atol=1e-5)


def test_bindings_end_with_their_object_and_with_the_file(extension, strip):
    deform = importlib.import_module(f"{extension.__name__}.operators.deform")
    bpy.ops.meshfree.deform_bind()
    other = add_object(local_points(strip), "Other")
    add_group(other, "Handle", range(20))
    bpy.data.objects.remove(strip)
    bpy.ops.meshfree.deform_bind()
    assert list(deform._bindings) == [other.session_uid]
    bpy.ops.wm.read_homefile(use_empty=True)
    assert not deform._bindings


def test_an_object_scaled_to_nothing(strip):
    bpy.ops.meshfree.deform_bind()
    strip.scale.x = 0.0
    bpy.context.view_layer.update()
    before = everything(strip)
    with pytest.raises(RuntimeError, match="scaled to nothing along an axis"):
        bpy.ops.meshfree.deform_update()
    assert everything(strip) == before


def test_shape_keys_that_came_after_binding_in_place(strip):
    bpy.ops.meshfree.deform_bind(target="IN_PLACE")
    strip.shape_key_add(name="Basis")
    before = everything(strip)
    with pytest.raises(RuntimeError, match="has shape keys"):
        bpy.ops.meshfree.deform_update()
    assert everything(strip) == before
