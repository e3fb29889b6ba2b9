"""Clouds aligned as a user does it: two objects, the active one is moved, its residuals, and what is refused."""

from contextlib import suppress

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, everything, grid_points, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import refused
from tests.blender.test_compare import add_pair

OFF = Matrix.Translation((0.08, -0.05, 0.06)) @ Matrix.Rotation(0.15, 4, (0.6, 0.0, 0.8))


def body(count, seed=0):
    """Points of an ellipsoid with a dent, which no motion maps onto itself."""
    points = sphere_points(count, seed)
    return (
        points * [1.0, 0.8, 0.6] * (1.0 - 0.2 * np.exp(-6.0 * ((points - [0.6, 0.6, 0.5]) ** 2).sum(axis=1)))[:, None]
    )


@pytest.fixture
def pair():
    """Two samples of one shape, the second one off, and active."""
    plan, scan = add_pair(body(900), body(800, seed=5))
    scan.matrix_world = OFF
    bpy.context.view_layer.update()
    return plan, scan


def off(scan):
    """The largest difference of an object's matrix from that of the other one, which stands at the origin."""
    return np.abs(np.array(scan.matrix_world) - np.eye(4)).max()


def test_the_active_object_is_moved_onto_the_other(pair, extension):
    plan, scan = pair
    before, points = everything(plan), attribute(scan, "position").copy()
    assert bpy.ops.meshfree.align_points() == {"FINISHED"}
    assert off(scan) < 5e-3
    assert_allclose(attribute(scan, "position"), points)
    assert np.median(attribute(scan, "lb_residual")) < 2e-3
    assert {name for name, value in everything(plan).items() if value != before[name]} <= {"blocks"}
    assert extension.ui.display.shown_attribute(scan) == "lb_residual"
    assert [notice.level for notice in scan.meshfree.notices] == ["INFO"]
    assert "of the points lie on Plan" in scan.meshfree.notices[0].text


def test_parents_and_scales_are_respected(pair):
    plan, scan = pair
    place = Matrix.Translation((30.0, 2.0, -4.0)) @ Matrix.Rotation(1.0, 4, "Y") @ Matrix.Scale(2.5, 4)
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.location, parent.rotation_euler, parent.scale = (4.0, 5.0, 6.0), (0.3, 0.2, 0.1), (3.0, 3.0, 3.0)
    bpy.context.view_layer.update()
    scan.parent, scan.rotation_mode = parent, "QUATERNION"
    plan.matrix_world, scan.matrix_world = place, place @ OFF
    bpy.context.view_layer.update()
    kept = parent.matrix_world.copy()
    bpy.ops.meshfree.align_points()
    assert_allclose(np.array(scan.matrix_world), np.array(place), atol=2e-2)
    assert parent.matrix_world == kept
    assert np.median(attribute(scan, "lb_residual")) < 5e-3  # in world lengths


def test_one_undo_step(pair):
    before = everything(pair[1])
    bpy.ops.ed.undo_push(message="Before")
    assert bpy.ops.meshfree.align_points("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.ops.ed.undo()
    assert everything(bpy.data.objects["Scan"]) == before


def test_one_scale_factor(pair):
    _, scan = pair
    scan.matrix_world = OFF @ Matrix.Scale(1.15, 4)
    bpy.ops.meshfree.align_points(scale=True)
    assert off(scan) < 1e-2
    assert "scaled by 0.8" in scan.meshfree.notices[0].text


def pick(obj, rows):
    obj.data.vertices.foreach_set("select", np.isin(np.arange(len(obj.data.vertices)), rows))


def test_from_selected_points(pair):
    plan, scan = pair
    far = Matrix.Translation((5.0, 1.0, 2.0)) @ Matrix.Rotation(np.pi, 4, "X") @ Matrix.Rotation(2.0, 4, "Z")
    scan.matrix_world = far
    with suppress(RuntimeError):  # it may be refused, or find another position
        bpy.ops.meshfree.align_points()
    assert off(scan) > 0.1
    scan.matrix_world = far
    first, second = attribute(plan, "position"), attribute(scan, "position")
    places = np.array([[1.0, 0.0, 0.0], [0.0, 0.8, 0.0], [0.0, 0.0, -0.6], [-0.8, 0.2, 0.3]])
    for obj, points in ((plan, first), (scan, second)):
        pick(obj, [np.argmin(((points - place) ** 2).sum(axis=1)) for place in places])
    bpy.ops.meshfree.align_points(from_selected=True)
    assert off(scan) < 5e-3


def test_selections_that_are_no_pairs(pair):
    plan, scan = pair
    pick(plan, [1, 2, 3])
    pick(scan, [1, 2])
    with refused(scan, '2 points of "Scan" are selected. Select three to five'):
        bpy.ops.meshfree.align_points(from_selected=True)
    pick(scan, [1, 2, 3, 4])
    with refused(scan, "4 places are given on the points and 3 on the target"):
        bpy.ops.meshfree.align_points(from_selected=True)


def test_a_plane_that_slides_is_moved_and_told():
    points, _ = grid_points()
    _, scan = add_pair(points, points[::2])
    scan.location.z = 0.2
    bpy.ops.meshfree.align_points()
    assert scan.matrix_world.translation.z == pytest.approx(0.0, abs=1e-3)
    warning, line = scan.meshfree.notices
    assert (warning.level, line.level) == ("WARNING", "INFO")
    assert warning.text.startswith("Scan: Not aligned in every direction. The surface can slide")


def test_another_shape_is_refused_and_stays():
    _, scan = add_pair(grid_points(16, 12)[0], 0.3 * body(150))
    with refused(scan, '"Scan" could not be aligned with "Plan": .* From Selected Points'):
        bpy.ops.meshfree.align_points()


def test_what_moves_the_object_is_told(pair):
    _, scan = pair
    scan.keyframe_insert("location", frame=1)
    with refused(scan, "moved by its keyframes"):
        bpy.ops.meshfree.align_points()
    scan.animation_data_clear()
    scan.driver_add("location", 0)
    with refused(scan, "moved by its drivers"):
        bpy.ops.meshfree.align_points()
    scan.driver_remove("location", 0)
    scan.constraints.new("LIMIT_LOCATION")
    with refused(scan, "moved by its constraints"):
        bpy.ops.meshfree.align_points()
    scan.constraints[0].mute = True
    assert bpy.ops.meshfree.align_points() == {"FINISHED"}


def test_an_object_that_takes_the_other_along_is_refused(pair):
    plan, scan = pair
    plan.parent = scan
    plan.matrix_parent_inverse = scan.matrix_world.inverted()
    operator = bpy.types.MESHFREE_OT_align_points
    assert '"Plan" moves with "Scan"' in operator.obstacle(bpy.context)


def test_a_parent_that_would_shear_is_refused(pair):
    _, scan = pair
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.scale = 1.0, 2.0, 1.0
    bpy.context.view_layer.update()
    scan.matrix_basis = Matrix.Identity(4)
    scan.parent, scan.location, scan.scale = parent, (0.05, 0.0, 0.0), (1.0, 0.5, 1.0)
    plan = pair[0]
    plan.rotation_euler = 0.0, 0.0, 0.15
    bpy.context.view_layer.update()
    with refused(scan, "would shear it"):
        bpy.ops.meshfree.align_points()


def test_the_other_one_must_stay_meanwhile(pair):
    plan, scan = pair
    motion = part("operators.tools.align").Motion(scan, plan)
    plan.location.x = 1.0
    bpy.context.view_layer.update()
    with pytest.raises(ValueError, match='"Plan" was moved meanwhile'):
        motion.apply(scan, np.eye(4))


def test_needs_one_other_cloud(pair):
    plan, scan = pair
    operator = bpy.types.MESHFREE_OT_align_points
    assert operator.obstacle(bpy.context) == ""
    plan.select_set(False)
    assert "no other is selected" in operator.obstacle(bpy.context)
    plan.select_set(True)
    add_object(sphere_points(100), "Third").select_set(True)
    bpy.context.view_layer.objects.active = scan
    assert "2 others are selected" in operator.obstacle(bpy.context)


def test_a_comparison_can_begin_with_it(pair):
    _, scan = pair
    bpy.ops.meshfree.compare(align_first=True)
    assert off(scan) < 5e-3
    assert np.abs(attribute(scan, "lb_deviation")).mean() < 3e-3
    assert any("Scan: It was moved" in notice.text for notice in scan.meshfree.notices)


def test_a_comparison_of_what_cannot_be_aligned_changes_nothing():
    _, scan = add_pair(grid_points(16, 12)[0], 0.3 * body(150))
    with refused(scan, "could not be aligned"):
        bpy.ops.meshfree.compare(align_first=True)
