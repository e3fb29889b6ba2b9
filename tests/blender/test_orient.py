"""The side that normals point to: chosen by each method, kept for what runs later, undone, refused."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.blender.clouds import add_object, attribute, local_points, sphere_points
from tests.blender.operators import refused


@pytest.fixture
def obj():
    return add_object(sphere_points(600))


def outwards(obj, name="lb_normal"):
    return np.einsum("ij,ij->i", attribute(obj, name), local_points(obj)) > 0.0


def add_vectors(obj, vectors, name="seen"):
    layer = obj.data.attributes.new(name, "FLOAT_VECTOR", "POINT")
    layer.data.foreach_set("vector", np.ascontiguousarray(vectors, np.float32).reshape(-1))


@pytest.mark.parametrize("method", ["WINDING", "OUTSIDE", "KEEP"])
def test_a_sphere_points_outwards_and_flipped_inwards(obj, method):
    assert bpy.ops.meshfree.orient_normals(method=method) == {"FINISHED"}
    assert outwards(obj).all()
    assert bpy.ops.meshfree.orient_normals(method=method, flip=True) == {"FINISHED"}
    assert not outwards(obj).any()
    assert (attribute(obj, "lb_mean_curvature") < 0.0).all()


def test_as_they_are_keeps_what_was_flipped_and_flips_it_back(obj):
    bpy.ops.meshfree.orient_normals(flip=True)
    bpy.ops.meshfree.orient_normals(method="KEEP")
    assert not outwards(obj).any()
    bpy.ops.meshfree.orient_normals(method="KEEP", flip=True)
    assert outwards(obj).all()


def test_all_that_runs_later_keeps_the_side(obj):
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.roughness()
    rough, area, curvature = (attribute(obj, f"lb_{name}") for name in ("roughness", "area", "mean_curvature"))
    bpy.ops.meshfree.orient_normals(flip=True)
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.roughness()
    bpy.ops.meshfree.principal_curvatures()
    bpy.ops.meshfree.show_surface()
    assert not outwards(obj).any()
    assert not outwards(obj, "lb_disc").any()
    assert (attribute(obj, "lb_curvature_1") < 0.0).all()
    assert_array_equal(attribute(obj, "lb_roughness"), -rough)
    assert_array_equal(attribute(obj, "lb_area"), area)
    assert_array_equal(attribute(obj, "lb_mean_curvature"), -curvature)


def test_a_subset_keeps_the_side(obj):
    obj.meshfree.point_budget, obj.meshfree.most_points = "NUMBER", 400
    bpy.ops.meshfree.orient_normals(flip=True)
    bpy.ops.meshfree.analyze()
    assert not outwards(obj).any()


def test_results_are_stale_once_the_sides_are_gone(result, obj):

    bpy.ops.meshfree.orient_normals(flip=True)
    assert not result.is_stale(obj)
    obj.data.attributes.remove(obj.data.attributes["lb_orientation"])
    assert result.is_stale(obj)
    bpy.ops.meshfree.analyze()
    assert outwards(obj).all()


def test_modes_stay(obj):
    bpy.ops.meshfree.spectrum(count=5)
    before = attribute(obj, "lb_eigenvector_003")
    bpy.ops.meshfree.orient_normals(flip=True)
    assert_array_equal(attribute(obj, "lb_eigenvector_003"), before)


def test_the_camera_or_a_named_object_is_the_viewpoint(obj):
    obj.location, obj.scale = (5.0, 0.0, 0.0), (1.0, 1.0, 2.0)
    camera = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    empty = bpy.data.objects.new("Far", None)
    for new, place in ((camera, (5.1, 0.0, 0.0)), (empty, (50.0, 0.0, 0.0))):
        bpy.context.collection.objects.link(new)
        new.location = place
    bpy.context.scene.camera = camera
    assert bpy.ops.meshfree.orient_normals(method="VIEWPOINT") == {"FINISHED"}
    assert not outwards(obj).any()  # seen from within
    assert bpy.ops.meshfree.orient_normals(method="VIEWPOINT", viewpoint="Far") == {"FINISHED"}
    assert outwards(obj).all()


@pytest.mark.parametrize(("holds", "factor"), [("POSITIONS", 3.0), ("DIRECTIONS", 1.0)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_attribute_tells_the_side(obj, holds, factor, side):
    points = local_points(obj)
    add_vectors(obj, side * factor * points if holds == "DIRECTIONS" else points * (1.0 + side * 0.5))
    assert bpy.ops.meshfree.orient_normals(method="ATTRIBUTE", source="seen", holds=holds) == {"FINISHED"}
    assert_array_equal(outwards(obj), np.full(len(points), side > 0.0))


def test_a_mirrored_and_turned_object_keeps_its_sides(obj):
    obj.scale, obj.rotation_euler = (-1.0, 2.0, 1.0), (0.4, 0.0, 1.0)
    bpy.ops.meshfree.orient_normals(flip=True)
    bpy.ops.meshfree.analyze()
    assert not outwards(obj).any()
    obj.scale, obj.rotation_euler = (1.0, 1.0, 1.0), (0.0, 2.0, 0.0)
    bpy.ops.meshfree.analyze()
    assert not outwards(obj).any()
    assert_allclose(np.linalg.norm(attribute(obj, "lb_orientation"), axis=1), 1.0, rtol=1e-5)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"method": "VIEWPOINT"}, "no camera"),
        ({"method": "VIEWPOINT", "viewpoint": "Nowhere"}, 'no object "Nowhere"'),
        ({"method": "ATTRIBUTE"}, "No attribute is chosen"),
        ({"method": "ATTRIBUTE", "source": "missing"}, "no attribute missing"),
        ({"method": "ATTRIBUTE", "source": "lb_area"}, "holds no vectors"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_changes(obj, settings, text):
    bpy.ops.meshfree.analyze()
    with refused(obj, text):
        bpy.ops.meshfree.orient_normals(**settings)


@pytest.mark.parametrize(("holds", "factor"), [("POSITIONS", 1.5), ("DIRECTIONS", 1.0)])
def test_points_without_a_vector_take_the_side_of_the_others(obj, capfd, holds, factor):
    points = factor * local_points(obj)
    points[3:20] = np.nan
    add_vectors(obj, points)
    assert bpy.ops.meshfree.orient_normals(method="ATTRIBUTE", source="seen", holds=holds) == {"FINISHED"}
    assert outwards(obj).all()
    assert f'17 of {len(points):,} points have no "seen" (NaN)' in capfd.readouterr().out


def test_vectors_that_are_no_numbers_are_refused(obj):
    add_vectors(obj, np.full_like(local_points(obj), np.nan))
    with pytest.raises(RuntimeError, match="is NaN at all"):
        bpy.ops.meshfree.orient_normals(method="ATTRIBUTE", source="seen")
    assert "lb_orientation" not in obj.data.attributes
