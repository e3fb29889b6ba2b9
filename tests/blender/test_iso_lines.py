"""Iso Lines to Curves: the lines on show, as a curve object in the surface."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, everything, sphere_points
from tests.blender.test_smooth_colors import add_values


@pytest.fixture
def obj():
    obj = add_object(sphere_points(2000))
    add_values(obj, "height", attribute(obj, "position")[:, 2])
    obj.meshfree.range_mode, obj.meshfree.range_low, obj.meshfree.range_high = "LOCKED", -1.0, 1.0
    bpy.ops.meshfree.colormap(attribute="height")
    return obj


def run(**settings):
    """Run the operator; return the curve object it made."""
    before = set(bpy.data.objects)
    assert bpy.ops.meshfree.iso_lines_to_curves(**settings) == {"FINISHED"}
    (made,) = set(bpy.data.objects) - before
    return made


def refused(**settings):
    with pytest.raises(RuntimeError) as refusal:
        bpy.ops.meshfree.iso_lines_to_curves(**settings)
    return str(refusal.value)


def lines(made):
    """Return the places of each line, (k, 3)."""
    found = []
    for spline in made.data.splines:
        places = np.empty(4 * len(spline.points), np.float32)
        spline.points.foreach_get("co", places)
        found.append(places.reshape(-1, 4)[:, :3])
    return found


def around(places):
    return np.linalg.norm(places - np.roll(places, 1, axis=0), axis=1).sum()


def test_they_are_circles_of_latitude_at_the_values_that_are_shown(obj):
    obj.meshfree.iso_lines = 8
    before = everything(obj)
    made = run()
    heights = np.array([places[:, 2].mean() for places in lines(made)])
    assert_allclose(heights, -1.0 + (np.arange(8) + 0.5) / 4.0, atol=3e-3)
    for places, height, spline in zip(lines(made), heights, made.data.splines, strict=True):
        assert spline.use_cyclic_u
        assert spline.type == "POLY"
        assert_allclose(around(places), 2.0 * np.pi * np.sqrt(1.0 - height**2), rtol=0.01)
        assert_allclose(np.linalg.norm(places, axis=1), 1.0, atol=5e-3)
    assert {**everything(obj), "blocks": None} == {**before, "blocks": None}
    assert bpy.context.object == obj


def test_they_lie_where_the_object_is(obj):
    obj.location, obj.rotation_euler, obj.scale = (5.0, 6.0, 7.0), (0.3, 0.4, 0.5), (2.0, 2.0, 2.0)
    made = run(count=3)
    assert made.matrix_world == obj.matrix_world
    assert made.dimensions.length > 0.0
    for places in lines(made):
        assert_allclose(np.linalg.norm(places, axis=1), 1.0, atol=5e-3)
    assert set(made.users_collection) == set(obj.users_collection)


def test_on_a_mesh_its_own_faces_are_taken():
    corners = np.array([[x, y, 0.0] for y in (0.0, 1.0) for x in (0.0, 1.0)])
    obj = add_object(corners, faces=[(0, 1, 3, 2)])
    add_values(obj, "along", corners[:, 0])
    obj.meshfree.range_mode, obj.meshfree.range_low, obj.meshfree.range_high = "LOCKED", 0.0, 1.0
    bpy.ops.meshfree.colormap(attribute="along")
    made = run(count=2, thickness=0.01)
    assert not any(spline.use_cyclic_u for spline in made.data.splines)
    assert_allclose([places[:, 0].mean() for places in lines(made)], [0.25, 0.75], atol=1e-6)
    assert made.data.bevel_depth == pytest.approx(0.01)


def test_of_vectors_the_component_is_taken(obj):
    add_values(obj, "vector", attribute(obj, "position"), "FLOAT_VECTOR")
    obj.meshfree.component = "X"
    bpy.ops.meshfree.colormap(attribute="vector")
    (places,) = lines(run(count=1))
    assert_allclose(places[:, 0], 0.0, atol=5e-3)


def test_where_no_source_reaches_there_are_none(obj):
    height = attribute(obj, "height")
    add_values(obj, "lb_distance", np.where(height > 0.5, -1.0, height + 1.0))
    bpy.ops.meshfree.colormap(attribute="lb_distance")
    obj.meshfree.range_low, obj.meshfree.range_high = -1.0, 2.0
    for places in lines(run(count=30)):
        assert places[:, 2].max() < 0.52


def test_whole_numbers_that_are_no_labels_have_lines(obj):
    add_values(obj, "count", np.round(100.0 * attribute(obj, "height")), "INT")
    bpy.ops.meshfree.colormap(attribute="count")
    obj.meshfree.range_low, obj.meshfree.range_high = -100.0, 100.0
    assert len(lines(run(count=4))) >= 4


def test_what_has_no_lines_is_told(obj):
    add_values(obj, "lb_segment", np.arange(2000) % 3, "INT")
    bpy.ops.meshfree.colormap(attribute="lb_segment")
    assert "no numbers that change along the surface" in refused()
    bpy.ops.meshfree.colormap(attribute="height")
    obj.meshfree.range_low, obj.meshfree.range_high = 5.0, 6.0
    assert "Height has no lines at 7 values from 5.07143 to 5.92857" in refused(count=7)
    obj.modifiers.clear()
    assert "shows no numbers" in refused()
    assert [each for each in bpy.data.objects if each.type == "CURVE"] == []


def test_one_undo_takes_them_away(obj):
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.meshfree.iso_lines_to_curves("EXEC_DEFAULT", True)
    assert "Cloud Iso Lines" in bpy.data.objects
    bpy.ops.ed.undo()
    assert "Cloud Iso Lines" not in bpy.data.objects
