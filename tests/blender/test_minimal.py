"""Minimal surfaces: what core says, as a shape key, and what is reported where there is none."""

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_group, add_object, local_points, sphere_points
from tests.blender.operators import refused
from tests.blender.test_smooth import shown_points


def cylinder(height=1.0, columns=60, rows=14):
    """Points of an open cylinder of radius 1, and which are at its two boundaries."""
    angle, z = (index.ravel() for index in np.meshgrid(np.arange(columns), np.linspace(0.0, height, rows)))
    angle = 2.0 * np.pi * angle / columns
    return np.column_stack([np.cos(angle), np.sin(angle), z]), (z == 0.0) | (z == height)


@pytest.mark.parametrize("grouped", [True, False])
def test_a_cylinder_becomes_a_catenoid(grouped):
    points, boundary = cylinder()
    obj = add_object(points)
    if grouped:
        add_group(obj, "Fixed", boundary)
    assert bpy.ops.meshfree.minimal_surface() == {"FINISHED"}
    after = shown_points(obj)
    np.testing.assert_allclose(after[boundary], points[boundary], atol=1e-5)
    waist = np.hypot(after[:, 0], after[:, 1]).min()
    assert waist == pytest.approx(0.8477, abs=0.01)  # a cosh(h / 2a) = 1 for the height 1
    history = list(obj["lb_area_history"])
    assert history[-1] < 0.97 * 2.0 * np.pi
    assert obj.data.shape_keys.key_blocks.keys() == ["Basis", "Minimal Surface"]


def test_boundaries_too_far_apart_are_reported(capfd):
    points, _ = cylinder(height=2.0, columns=40, rows=16)
    obj = add_object(points)
    assert bpy.ops.meshfree.minimal_surface() == {"FINISHED"}
    assert "pinch" in capfd.readouterr().out
    assert np.isfinite(shown_points(obj)).all()


def test_a_closed_surface_is_refused():
    obj = add_object(sphere_points())
    with refused(obj, "no boundary.*Assign the points that stay"):
        bpy.ops.meshfree.minimal_surface()


def test_an_edge_that_is_not_fixed():
    points, boundary = cylinder()
    obj = add_object(points)
    add_group(obj, "Fixed", boundary & (points[:, 2] == 0.0))
    before = local_points(obj)
    with pytest.raises(RuntimeError, match="ends at"):
        bpy.ops.meshfree.minimal_surface()
    assert (local_points(obj) == before).all()
