"""Principal curvatures and their directions, against those of spheres, tori, cylinders and saddles."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import core
from benchmarks.samplings import random_sphere, square_random, torus_points

MAJOR, MINOR = 1.0, 0.4


def shares(found, exact):
    """Root mean square error as a share of the exact values."""
    return np.linalg.norm(found - exact) / np.linalg.norm(exact)


@pytest.fixture(scope="module")
def torus():
    laplacian = core.build_laplacian(torus_points(4200))
    return laplacian, core.measure.principal_curvatures(laplacian)


@pytest.mark.parametrize("radius", [0.01, 3000.0])
def test_sphere_is_a_cap(radius):
    found = core.measure.principal_curvatures(core.build_laplacian(radius * random_sphere(2000)))
    assert_allclose(np.stack([found.first, found.second]), 1.0 / radius, rtol=0.08)
    assert_allclose(found.curvedness, 1.0 / radius, rtol=0.08)
    assert found.shape_index.min() > 0.97


def test_inward_normals_make_a_cup_of_it():
    points = random_sphere(1000)
    found = core.measure.principal_curvatures(core.build_laplacian(points, normals=-points))
    assert found.first.max() < -0.9
    assert found.shape_index.max() < -0.95


def test_torus(torus):
    laplacian, found = torus
    radius = np.linalg.norm(laplacian.points[:, :2], axis=1)
    assert shares(found.first, np.full(len(radius), 1.0 / MINOR)) < 0.025
    assert shares(found.second, (1.0 - MAJOR / radius) / MINOR) < 0.1
    assert_allclose(0.5 * (found.first + found.second), core.measure.mean_curvature(laplacian), rtol=1e-12, atol=1e-12)


def test_first_direction_of_a_torus_goes_around_its_tube(torus):
    laplacian, found = torus
    x, y, _ = laplacian.points.T
    along = np.column_stack([-y, x, np.zeros(len(x))]) / np.hypot(x, y)[:, None]
    assert np.degrees(np.arcsin(np.abs(np.einsum("ij,ij->i", found.direction, along)))).mean() < 2.0
    assert_allclose(np.linalg.norm(found.direction, axis=1), 1.0, rtol=1e-12)
    assert np.abs(np.einsum("ij,ij->i", found.direction, laplacian.normals)).max() < 1e-12


@pytest.mark.parametrize(
    ("bends", "index"), [((2.0, 0.0), 0.5), ((1.0, -1.0), 0.0), ((0.0, -2.0), -0.5), ((0.0, 0.0), 0.0)]
)
def test_shape_index_tells_ridge_saddle_valley_and_plane(bends, index):
    points = square_random(1500) - [0.5, 0.5, 0.0]
    points[:, 2] = -0.5 * points[:, :2] ** 2 @ bends
    normals = np.column_stack([points[:, :2] * bends, np.ones(len(points))])
    laplacian = core.build_laplacian(points, normals=normals)
    middle = np.linalg.norm(points[:, :2], axis=1) < 0.1
    found = core.measure.principal_curvatures(laplacian)
    if any(bends):
        assert_allclose(found.shape_index[middle], index, atol=0.1)
    assert_allclose(found.first[middle].mean(), bends[0], atol=0.1)
    assert_allclose(found.second[middle].mean(), bends[1], atol=0.1)


def test_point_left_out_is_flat():
    points = np.vstack([random_sphere(750), [[9.0, 9.0, 9.0]]])
    found = core.measure.principal_curvatures(core.build_laplacian(points))
    assert found.first[-1] == found.second[-1] == found.curvedness[-1] == found.shape_index[-1] == 0.0
