"""Discs for drawing: they cover the surface, are no larger than its gaps ask, and lie in the tangent planes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import core
from benchmarks.samplings import random_sphere, torus_points, uneven_sphere

SHAPES = {
    "sphere": (random_sphere, 4.0 * np.pi),
    "uneven sphere": (uneven_sphere, 4.0 * np.pi),
    "torus": (torus_points, 1.6 * np.pi**2),
}


def covered(points, radii, places):
    """Share of places that lie on the disc of one of the points near them."""
    distance, index = cKDTree(points).query(places, k=30)
    return np.mean((distance <= radii[index]).any(axis=1))


@pytest.mark.parametrize("name", SHAPES)
def test_they_cover_the_surface_and_not_much_more(name):
    sample, area = SHAPES[name]
    points = sample(4000)
    discs = core.surface.surface_discs(points)
    assert covered(points, 1.03 * discs.radii, sample(20_000, seed=7)) > 0.999
    assert covered(points, 0.8 * discs.radii, sample(20_000, seed=7)) < 0.99
    assert np.pi * np.sum(discs.radii**2) < 4.0 * area


def test_normals_point_outwards():
    points = random_sphere(1000)
    assert np.einsum("ij,ij->i", core.surface.surface_discs(points).normals, points).min() > 0.99


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_they_grow_with_the_points(scale):
    points = random_sphere(500)
    discs, others = core.surface.surface_discs(points), core.surface.surface_discs(scale * points)
    assert_allclose(others.radii, scale * discs.radii, rtol=1e-9)
    assert_allclose(others.normals, discs.normals, atol=1e-9)


def test_a_linear_map_takes_them_to_those_of_the_mapped_surface():
    linear = np.array([[1.3, 0.2, 0.0], [0.0, 0.8, 0.3], [0.1, 0.0, 1.1]])
    rng = np.random.default_rng(4)
    normals = rng.standard_normal((300, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    moved = core.surface.Discs(normals, rng.uniform(0.5, 2.0, 300)).deformed(np.tile(linear, (300, 1, 1)))
    wanted = normals @ np.linalg.inv(linear)
    assert_allclose(moved.normals, wanted / np.linalg.norm(wanted, axis=1)[:, None], atol=1e-12)
    # The largest stretch of all directions in the tangent plane.
    angle = np.linspace(0.0, np.pi, 2000)[:, None]
    for row in range(5):
        one = np.cross(normals[row], [0.3, 0.5, -0.8])
        one /= np.linalg.norm(one)
        ways = np.cos(angle) * one + np.sin(angle) * np.cross(normals[row], one)
        most = np.linalg.norm(ways @ linear.T, axis=1).max()
        given = core.surface.Discs(normals[row : row + 1], np.ones(1)).deformed(linear[None])
        assert_allclose(given.radii, most, rtol=1e-5)


def test_turns_and_scales_keep_them_and_lost_planes_keep_their_normals():
    normals, radii = random_sphere(50), np.ones(50)
    turn = Rotation.from_rotvec([0.5, 1.0, -2.0]).as_matrix()
    moved = core.surface.Discs(normals, radii).deformed(np.tile(3.0 * turn, (50, 1, 1)))
    assert_allclose(moved.normals, normals @ turn.T, atol=1e-12)
    assert_allclose(moved.radii, 3.0)
    lost = core.surface.Discs(normals, radii).deformed(np.zeros((50, 3, 3)))
    assert_allclose(lost.normals, normals)
    assert_allclose(lost.radii, 0.0)


def test_a_point_off_the_surface_gets_a_disc_like_the_others():
    points = np.vstack([random_sphere(800), [[9.0, 0.0, 0.0]]])
    discs = core.surface.surface_discs(points)
    assert_allclose(discs.normals[-1], [0.0, 0.0, 1.0])
    assert discs.radii[-1] == np.median(discs.radii[:-1])


def test_few_points_are_enough():
    assert np.isfinite(core.surface.surface_discs(random_sphere(7)).radii).all()
    with pytest.raises(core.TooFewPointsError):
        core.surface.surface_discs(random_sphere(6))
