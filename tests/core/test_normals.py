import numpy as np
import pytest

import core
from benchmarks.samplings import random_sphere, torus_points


def torus_normals(points, major=1.0):
    radius = np.linalg.norm(points[:, :2], axis=1)
    center = np.column_stack([points[:, :2] * (major / radius)[:, None], np.zeros(len(points))])
    normals = points - center
    return normals / np.linalg.norm(normals, axis=1)[:, None]


def angle(found, exact):
    return np.arccos(np.clip(np.abs(np.einsum("ij,ij->i", found, exact)), 0.0, 1.0))


@pytest.mark.parametrize(("method", "bound"), [("quadric", 0.01), ("wpca", 0.06), ("pca", 0.12)])
def test_normals_of_a_torus(method, bound):
    points = torus_points(4000)
    normals = core.estimate_normals(points, core.LaplacianOptions(normals=method))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-12)
    assert np.sqrt(np.mean(angle(normals, torus_normals(points)) ** 2)) < bound


def test_weighted_covariance_beats_the_plain_one_on_uneven_points():
    points = torus_points(4000)
    exact = torus_normals(points)
    errors = {
        method: angle(core.estimate_normals(points, core.LaplacianOptions(normals=method)), exact).mean()
        for method in ("wpca", "pca")
    }
    assert errors["wpca"] < errors["pca"]


@pytest.mark.parametrize("method", ["quadric", "wpca"])
def test_orientation_points_outwards_on_closed_surfaces(method):
    points = torus_points(3000)
    normals = core.estimate_normals(points, core.LaplacianOptions(normals=method, orient=True))
    assert np.all(np.einsum("ij,ij->i", normals, torus_normals(points)) > 0.9)


def test_orientation_of_two_spheres():
    sphere = random_sphere(800)
    points = np.concatenate([sphere, 0.5 * sphere + [4.0, 0.0, 0.0]])
    normals = core.estimate_normals(points, core.LaplacianOptions(orient=True))
    assert np.all(np.einsum("ij,ij->i", normals, np.concatenate([sphere, sphere])) > 0.9)


def test_orientation_of_an_open_sheet_is_consistent():
    rng = np.random.default_rng(0)
    u, v = rng.random((2, 3000))
    normals = core.estimate_normals(np.column_stack([u, v, 0.2 * np.sin(4.0 * u)]), core.LaplacianOptions(orient=True))
    assert np.all(normals[:, 2] > 0.0) or np.all(normals[:, 2] < 0.0)
