"""Clouds compared as a user does it: two objects where they stand, results, colors, and what is refused."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, everything, grid_points, sphere_points

NAMES = {"lb_deviation", "lb_compared"}


def add_pair(first, second):
    """Add two selected objects, the second one active."""
    pair = add_object(first, "Plan"), add_object(second, "Scan")
    for obj in pair:
        obj.select_set(True)
    bpy.context.view_layer.objects.active = pair[1]
    return pair


@pytest.fixture
def spheres():
    """Two samples of the unit sphere."""
    return add_pair(sphere_points(1500), sphere_points(1000, seed=5))


def test_samples_of_one_surface_have_no_distance(spheres):
    plan, scan = spheres
    before = everything(plan)
    assert bpy.ops.meshfree.compare() == {"FINISHED"}
    assert attribute(scan, "lb_compared").all()
    assert_allclose(attribute(scan, "lb_deviation"), 0.0, atol=1e-3)
    assert not NAMES & set(plan.data.attributes.keys())
    assert {name for name, value in everything(plan).items() if value != before[name]} <= {"blocks"}


def test_objects_are_taken_where_they_stand(spheres):
    plan, scan = spheres
    plan.scale, plan.location, plan.rotation_euler = (2.0, 2.0, 2.0), (5.0, 1.0, 0.0), (0.3, 0.2, 0.1)
    scan.scale, scan.location = (2.2, 2.2, 2.2), (5.0, 1.0, 0.0)
    bpy.ops.meshfree.compare()
    assert_allclose(attribute(scan, "lb_deviation"), 0.2, atol=5e-3)
    scan.scale = 1.9, 1.9, 1.9
    bpy.ops.meshfree.compare()
    assert_allclose(attribute(scan, "lb_deviation"), -0.1, atol=5e-3)


def test_points_beside_are_told_of(capfd):
    points, _ = grid_points()
    _, scan = add_pair(points, points + [1.0, 0.0, 0.05])
    bpy.ops.meshfree.compare()
    known = attribute(scan, "lb_compared")
    assert 0 < np.count_nonzero(~known) < len(known) / 2
    assert_allclose(np.abs(attribute(scan, "lb_deviation"))[known], 0.05, atol=1e-3)
    assert not attribute(scan, "lb_deviation")[~known].any()
    assert f"{np.count_nonzero(~known):,} of 1,200 points lie beside the surface of Plan" in capfd.readouterr().out


def test_colors_are_about_zero(spheres, extension):
    spheres[1].scale = 1.1, 1.1, 1.1
    bpy.ops.meshfree.compare()
    assert extension.ui.display.shown_attribute(spheres[1]) == "lb_deviation"
    low, high = extension.ui.display.shown_range(spheres[1])
    assert low == -high
    assert high == pytest.approx(0.1, abs=0.01)


def test_one_undo_step(spheres):
    before = everything(spheres[1])
    bpy.ops.ed.undo_push(message="Before")
    assert bpy.ops.meshfree.compare("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.ops.ed.undo()
    assert everything(bpy.data.objects["Scan"]) == before


def test_surfaces_too_far_apart_leave_all_as_it_was(spheres):
    plan, scan = spheres
    plan.location.x = 10.0
    before = everything(scan)
    with pytest.raises(RuntimeError, match='No point of "Scan" has the surface of "Plan" above or below it'):
        bpy.ops.meshfree.compare(greatest=0.5)
    assert everything(scan) == before


def test_other_cloud_without_an_answer_is_named():
    _, scan = add_pair(np.random.default_rng(0).random((5, 3)), sphere_points(800))
    before = everything(scan)
    with pytest.raises(RuntimeError, match='"Plan"'):
        bpy.ops.meshfree.compare()
    assert everything(scan) == before


def test_needs_one_other_cloud(spheres):
    plan, scan = spheres
    operator = bpy.types.MESHFREE_OT_compare
    assert operator.obstacle(bpy.context) == ""
    plan.select_set(False)
    assert "no other is selected" in operator.obstacle(bpy.context)
    plan.select_set(True)
    third = add_object(sphere_points(100), "Third")
    third.select_set(True)
    bpy.context.view_layer.objects.active = scan
    assert "2 others are selected" in operator.obstacle(bpy.context)
    with pytest.raises(RuntimeError, match="poll"):
        bpy.ops.meshfree.compare()
