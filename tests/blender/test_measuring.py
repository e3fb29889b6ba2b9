"""Measures of selected points, and paths between two of them."""

import re

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_object, local_points, sphere_points
from tests.blender.operators import refused


@pytest.fixture
def obj():
    return add_object(sphere_points(1000))


def choose(obj, chosen):
    obj.data.vertices.foreach_set("select", chosen)


def told(obj):
    """Return the kept texts about an object, in one."""
    return "\n".join(notice.text for notice in obj.meshfree.notices)


def figure(obj, name):
    return float(re.search(rf"{name} ([\d.]+)", told(obj)).group(1))


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_half_a_sphere(obj, mode):
    choose(obj, local_points(obj)[:, 2] > 0.0)
    obj.select_set(True)
    bpy.ops.object.mode_set(mode=mode)
    assert bpy.ops.meshfree.measure_selection(volume=True) == {"FINISHED"}
    assert obj.mode == mode
    bpy.ops.object.mode_set(mode="OBJECT")
    assert figure(obj, "Area") == pytest.approx(2.0 * np.pi, rel=0.02)
    assert figure(obj, "Boundary") == pytest.approx(2.0 * np.pi, rel=0.02)
    assert figure(obj, "Mean curvature") == pytest.approx(1.0, rel=0.02)
    assert figure(obj, "Volume") == pytest.approx(4.0 * np.pi / 3.0, rel=0.01)
    assert figure(obj, "Over the plane of its rim") == pytest.approx(2.0 * np.pi / 3.0, rel=0.04)


def test_the_figures_follow_the_scale_and_the_last_selection(obj):
    choose(obj, local_points(obj)[:, 2] > 0.5)
    bpy.ops.meshfree.measure_selection()
    obj.scale = (2.0, 2.0, 2.0)
    choose(obj, local_points(obj)[:, 2] > 0.0)
    bpy.ops.meshfree.measure_selection()
    assert figure(obj, "Area") == pytest.approx(8.0 * np.pi, rel=0.02)
    assert told(obj).count("Area") == 1


def test_a_path_between_two_points(obj):
    points = local_points(obj)
    ends = [10, int((points @ points[10]).argmin())]
    choose(obj, np.isin(np.arange(len(points)), ends))
    obj.location, obj.scale = (1.0, 2.0, 3.0), (1.0, 1.0, 1.0)
    assert bpy.ops.meshfree.geodesic_path(thickness=0.01) == {"FINISHED"}
    made = bpy.data.objects[f"{obj.name} Path"]
    places = np.array([point.co[:3] for point in made.data.splines[0].points])
    np.testing.assert_allclose(places[[0, -1]], points[sorted(ends)], atol=1e-6)
    angle = np.arccos(points[ends[0]] @ points[ends[1]])
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).sum() == pytest.approx(angle, rel=2e-3)
    assert tuple(made.matrix_world.translation) == (1.0, 2.0, 3.0)
    assert made.data.bevel_depth == pytest.approx(0.01)
    assert "along the surface" in told(obj)


def test_a_path_takes_two_points(obj):
    choose(obj, np.arange(1000) < 3)
    with refused(obj, "3 points of .* are selected. Select the two"):
        bpy.ops.meshfree.geodesic_path()


def test_nothing_selected_is_said(obj):
    choose(obj, np.zeros(1000, dtype=bool))
    with refused(obj, "No points of .* are selected"):
        bpy.ops.meshfree.measure_selection()


def test_what_has_no_rim_has_no_volume_over_it(obj):
    choose(obj, np.ones(1000, dtype=bool))
    bpy.ops.meshfree.measure_selection(volume=True)
    assert "0 points at its rim" in told(obj)
    assert "Over the plane" not in told(obj)


def test_a_path_of_points_with_columns_of_their_file(obj):
    obj["lb_columns"] = '{"points": 1000, "columns": {}}'
    obj["lb_offset"] = (100.0, 0.0, 0.0)
    choose(obj, np.arange(1000) < 2)
    assert bpy.ops.meshfree.geodesic_path() == {"FINISHED"}
    assert tuple(bpy.data.objects[f"{obj.name} Path"]["lb_offset"]) == (100.0, 0.0, 0.0)
