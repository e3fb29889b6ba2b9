"""Clouds compared as a user does it: two objects where they stand, results, colors, and what is refused."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, everything, grid_points, sphere_points
from tests.blender.operators import refused
from tests.blender.test_panel import draw

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
    assert {name for name, value in everything(plan).items() if value != before[name]} <= {"blocks", "seen"}


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


def test_nearest_has_no_sign_and_needs_no_normals(spheres, capfd):
    _, scan = spheres
    scan.scale = 0.9, 0.9, 0.9
    bpy.ops.meshfree.compare(distance="NEAREST")
    assert_allclose(attribute(scan, "lb_deviation"), 0.1, atol=5e-3)
    bpy.ops.meshfree.compare_swap(greatest=0.0, distance="NEAREST")
    assert_allclose(attribute(bpy.context.object, "lb_deviation"), 0.1, atol=5e-3)
    bpy.ops.meshfree.compare()
    assert_allclose(attribute(bpy.context.object, "lb_deviation"), 0.1, atol=5e-3)
    assert "sign is in doubt" not in capfd.readouterr().out


def test_the_sign_between_two_walls_is_in_doubt_until_a_side_is_chosen(capfd):
    points, _ = grid_points()
    wall = np.roll(np.asarray(points), 1, axis=1)
    _, scan = add_pair(wall, wall + [0.1, 0.0, 0.0])
    bpy.ops.meshfree.compare()
    assert "sign is in doubt" in capfd.readouterr().out
    bpy.ops.object.empty_add(location=(9.0, 0.0, 0.0))
    viewpoint = bpy.context.object
    bpy.context.view_layer.objects.active = scan
    scan.select_set(True)
    viewpoint.select_set(False)
    bpy.ops.meshfree.orient_normals(method="VIEWPOINT", viewpoint=viewpoint.name)
    bpy.ops.meshfree.compare()
    assert "sign is in doubt" not in capfd.readouterr().out
    known = attribute(scan, "lb_compared")
    assert_allclose(attribute(scan, "lb_deviation")[known], 0.1, atol=1e-3)


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
    with refused(scan, 'No point of "Scan" has the surface of "Plan" above or below it'):
        bpy.ops.meshfree.compare(greatest=0.5)


def test_other_cloud_without_an_answer_is_named():
    _, scan = add_pair(np.random.default_rng(0).random((5, 3)), sphere_points(800))
    with refused(scan, '"Plan"'):
        bpy.ops.meshfree.compare()


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


def test_the_reference_is_hidden_and_both_are_named(spheres):
    plan, scan = spheres
    bpy.ops.meshfree.compare()
    assert (plan.hide_get(), plan.hide_render) == (True, True)
    assert (scan.hide_get(), scan.hide_render) == (False, False)
    drawn = draw()
    assert "Scan compared with Plan, which is hidden" in drawn
    (line,) = [text for text in drawn if text.startswith("Compare Points: ")]
    assert "from Plan on average" in line


def test_the_reference_stays_where_that_is_wanted(spheres):
    plan, _ = spheres
    bpy.ops.meshfree.compare(hide_reference=False)
    assert (plan.hide_get(), plan.hide_render) == (False, False)
    assert "Scan compared with Plan" in draw()


def test_it_can_be_compared_again_although_the_reference_is_hidden(spheres):
    bpy.ops.meshfree.compare()
    spheres[1].scale = 1.1, 1.1, 1.1
    assert bpy.ops.meshfree.compare() == {"FINISHED"}
    assert_allclose(attribute(spheres[1], "lb_deviation"), 0.1, atol=5e-3)


def test_swap_compares_the_other_way_round_and_back(spheres):
    plan, scan = spheres
    scan.scale = 1.1, 1.1, 1.1
    bpy.ops.meshfree.compare(greatest=0.3)
    bpy.ops.meshfree.compare_swap(greatest=scan.meshfree.compared_within)
    assert bpy.context.object == plan
    assert bpy.context.selected_objects == [plan]
    assert [(each.hide_get(), each.hide_render) for each in spheres] == [(False, False), (True, True)]
    assert_allclose(attribute(plan, "lb_deviation"), -0.1, atol=5e-3)
    assert plan.meshfree.compared_within == pytest.approx(0.3)
    assert "Plan compared with Scan, which is hidden" in draw()
    bpy.ops.meshfree.compare_swap()
    assert bpy.context.object == scan
    assert [each.hide_get() for each in spheres] == [True, False]


def test_there_is_nothing_to_swap_before_a_comparison(spheres):
    assert not bpy.ops.meshfree.compare_swap.poll()
    bpy.ops.meshfree.compare()
    assert bpy.ops.meshfree.compare_swap.poll()
    bpy.data.objects.remove(spheres[0])
    assert not bpy.ops.meshfree.compare_swap.poll()
    assert "Swap" not in draw()
