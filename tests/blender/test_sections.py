"""Cross Section: the curves in which an object's plane cuts the surface, beside the points, measured."""

import re

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, everything, sphere_points
from tests.blender.operators import refused


@pytest.fixture
def obj():
    return add_object(sphere_points(1000))


def plane(location=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0)):
    """Add an empty."""
    empty = bpy.data.objects.new("Plane", None)
    empty.location, empty.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(empty)
    return empty


def told(obj):
    return [notice.text for notice in obj.meshfree.notices]


def figures(obj):
    """Return length and enclosed area, as they are told."""
    return [float(found) for found in re.search(r"([\d.]+) m long, enclosed area ([\d.]+) m", told(obj)[-1]).groups()]


def corners(made):
    """Return the corners of a curve object in the world, (k, 3)."""
    matrix = np.array(made.matrix_world)
    local = np.array([point.co[:3] for spline in made.data.splines for point in spline.points])
    return local @ matrix[:3, :3].T + matrix[:3, 3]


def test_an_empty_cuts_a_circle(obj):
    obj.location, obj.rotation_euler, obj.scale = (1.0, 2.0, 3.0), (0.3, 0.4, 0.5), (2.0, 2.0, 2.0)
    empty = plane((1.0, 3.0, 3.0), (np.pi / 2.0, 0.0, 0.0))  # across Y, one above the middle
    before = everything(obj)
    assert bpy.ops.meshfree.cross_section(plane=empty.name, thickness=0.01) == {"FINISHED"}
    made = bpy.data.objects[f"{obj.name} Section"]
    (spline,) = made.data.splines
    assert spline.use_cyclic_u
    assert made.data.bevel_depth == pytest.approx(0.01)
    places = corners(made)
    assert_allclose(places[:, 1], 3.0, atol=1e-5)
    assert_allclose(np.linalg.norm(places - [1.0, 2.0, 3.0], axis=1), 2.0, atol=4e-3)
    assert_allclose(figures(obj), [2.0 * np.pi * np.sqrt(3.0), 3.0 * np.pi], rtol=5e-3)
    assert everything(obj)["attributes"] == before["attributes"]
    assert bpy.context.object == obj


def test_without_an_object_it_is_the_horizontal_plane_through_the_middle(obj):
    assert bpy.ops.meshfree.cross_section() == {"FINISHED"}
    assert_allclose(corners(bpy.data.objects[f"{obj.name} Section"])[:, 2], 0.0, atol=0.01)
    assert "horizontal plane through its middle" in told(obj)[0]
    bpy.ops.meshfree.cross_section(plane=plane().name)
    assert len(told(obj)) == 1


def test_objects_that_share_a_mesh_may_be_cut(obj):
    other = obj.copy()
    other.scale = (3.0, 3.0, 3.0)
    bpy.context.scene.collection.objects.link(other)
    assert bpy.ops.meshfree.cross_section() == {"FINISHED"}
    assert other.data == obj.data


def test_a_plane_beside_the_surface_or_none_is_refused(obj):
    empty = plane((0.0, 0.0, 5.0))
    with refused(obj, "passes beside the surface"):
        bpy.ops.meshfree.cross_section(plane=empty.name)
    empty.scale = (0.0, 1.0, 1.0)
    with refused(obj, "scaled to nothing along X or Y"):
        bpy.ops.meshfree.cross_section(plane=empty.name)
    with refused(obj, 'There is no object "Nobody"'):
        bpy.ops.meshfree.cross_section(plane="Nobody")
