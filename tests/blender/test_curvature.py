"""Principal curvatures and roughness as a user gets them: attributes, what is shown, and lengths of the world."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, sphere_points

RESULTS = ["lb_curvature_1", "lb_curvature_2", "lb_direction_1", "lb_shape_index", "lb_curvedness"]


@pytest.fixture
def ellipsoid():
    """A sphere whose object is scaled to an ellipsoid."""
    obj = add_object(sphere_points(1500))
    obj.scale = 2.0, 1.0, 0.5
    obj.rotation_euler = 0.3, 0.2, 0.1
    bpy.context.view_layer.update()
    return obj


def test_attributes_are_what_core_computes_in_the_world(ellipsoid, core):
    assert bpy.ops.meshfree.principal_curvatures() == {"FINISHED"}
    turn = np.array(ellipsoid.matrix_world)[:3, :3]
    found = core.measure.principal_curvatures(
        core.build_laplacian(attribute(ellipsoid, "position").astype(float) @ turn.T)
    )
    values = found.first, found.second, found.direction, found.shape_index, found.curvedness
    expected = dict(zip(RESULTS, values, strict=True))
    placed = attribute(ellipsoid, "lb_direction_1") @ turn.T
    placed /= np.linalg.norm(placed, axis=1)[:, None]
    assert_allclose(np.abs(np.einsum("ij,ij->i", placed, expected.pop("lb_direction_1"))), 1.0, rtol=1e-4)
    for name, numbers in expected.items():
        assert_allclose(attribute(ellipsoid, name), numbers, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize(
    ("display", "name"),
    [
        ("SHAPE_INDEX", "lb_shape_index"),
        ("CURVEDNESS", "lb_curvedness"),
        ("GREATEST", "lb_curvature_1"),
        ("LEAST", "lb_curvature_2"),
        ("DIRECTION", "lb_direction_1"),
    ],
)
def test_shows_what_is_chosen(ellipsoid, extension, display, name):
    bpy.ops.meshfree.principal_curvatures(display=display)
    assert extension.ui.display.shown_attribute(ellipsoid) == name


def test_roughness_of_details_beyond_the_size():
    add_object(1e-15 * sphere_points(300))
    with pytest.raises(RuntimeError, match='is longer than "Cloud" is large'):
        bpy.ops.meshfree.roughness(wavelength=3e38)


def test_roughness_of_dents_in_a_scaled_sphere():
    points = sphere_points(1500)
    depth = 0.02 * (np.random.default_rng(0).random(1500) < 0.05)
    obj = add_object(points * (1.0 - depth)[:, None])
    obj.scale = 3.0, 3.0, 3.0
    assert bpy.ops.meshfree.roughness(wavelength=2.0) == {"FINISHED"}
    rough = attribute(obj, "lb_roughness")
    assert rough[depth > 0.0].max() < -0.03
    assert np.abs(rough[depth == 0.0]).max() < 0.035
