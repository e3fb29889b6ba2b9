"""Local quadrics: normals, curvatures, and distances to the surface."""

import numpy as np
import pytest

import core
from benchmarks.samplings import (
    fibonacci_sphere,
    open_cylinder,
    random_sphere,
    square_random,
    torus_low_discrepancy,
    torus_points,
)
from core.geometry.nearest import find_nearest
from core.geometry.quadrics import fit_quadrics, frames


def fit(points):
    return find_nearest(points).quadrics


def largest_curvature(surface):
    """The larger of the two principal curvatures, without its sign."""
    return np.abs(np.linalg.eigvalsh(surface.shape_operator)).max(axis=1)


def degrees_off(found, exact):
    cosine = np.abs(np.einsum("ij,ij->i", found, exact))
    return np.degrees(np.arccos(np.minimum(cosine, 1.0)))


def torus_facts(points, minor=0.4):
    """Exact normals, Gaussian curvatures and larger principal curvatures."""
    radius = np.linalg.norm(points[:, :2], axis=1)
    cosine = (radius - 1.0) / minor
    normals = np.column_stack([points[:, :2] * (cosine / radius)[:, None], points[:, 2] / minor])
    return normals, cosine / (minor * radius), np.maximum(1.0 / minor, np.abs(cosine / radius))


@pytest.mark.parametrize("sphere", [fibonacci_sphere, random_sphere])
@pytest.mark.parametrize("radius", [1.0, 50.0])
def test_sphere(sphere, radius):
    points = sphere(2000)
    surface = fit(radius * points)
    assert degrees_off(surface.normals, points).max() < 0.1
    np.testing.assert_allclose(surface.gaussian_curvature, 1.0 / radius**2, rtol=0.06)
    np.testing.assert_allclose(largest_curvature(surface), 1.0 / radius, rtol=0.06)
    assert surface.misfit.max() < 2e-3 * radius * np.sqrt(4.0 * np.pi / 2000)
    assert np.linalg.norm(surface.height, axis=1).max() < 3e-4 * radius


@pytest.mark.parametrize("sample", [torus_low_discrepancy, torus_points])
def test_torus(sample):
    points = sample(4000)
    normals, gaussian, largest = torus_facts(points)
    surface = fit(points)
    off = degrees_off(surface.normals, normals)
    assert np.sqrt(np.mean(off**2)) < 0.7
    assert off.max() < 3.0
    assert np.sqrt(np.mean((surface.gaussian_curvature - gaussian) ** 2)) < 0.1 * np.abs(gaussian).max()
    np.testing.assert_allclose(largest_curvature(surface), largest, rtol=0.15)


def test_cylinder():
    points = open_cylinder()
    surface = fit(points)
    assert degrees_off(surface.normals, points * [0.5, 0.5, 0.0]).max() < 1e-3
    assert np.abs(surface.gaussian_curvature).max() < 1e-3
    np.testing.assert_allclose(largest_curvature(surface), 0.5, rtol=0.01)


def test_plane():
    surface = fit(square_random(500))
    np.testing.assert_allclose(np.abs(surface.normals[:, 2]), 1.0, atol=1e-12)
    for values in (surface.gaussian_curvature, surface.shape_operator, surface.misfit, surface.height):
        np.testing.assert_allclose(values, 0.0, atol=1e-9)


def test_a_quadric_is_met_exactly():
    u, v = np.random.default_rng(0).random((2, 1500)) - 0.5
    points = np.column_stack([u, v, 0.8 * u * u - 0.5 * u * v + 0.3 * v * v + 0.1 * u])
    nearest = find_nearest(points)
    surface = fit_quadrics(points, nearest.index, nearest.weight, normals=np.tile([0.0, 0.0, 1.0], (1500, 1)))
    slope = np.column_stack([-(1.6 * u - 0.5 * v + 0.1), -(-0.5 * u + 0.6 * v), np.ones(1500)])
    squared = np.einsum("ij,ij->i", slope, slope)
    assert degrees_off(surface.normals, slope / np.sqrt(squared)[:, None]).max() < 1e-3
    np.testing.assert_allclose(surface.gaussian_curvature, (1.6 * 0.6 - 0.25) / squared**2, rtol=1e-4)
    assert surface.misfit.max() < 1e-6
    assert np.abs(surface.height).max() < 1e-6


def test_some_rows_only():
    points = torus_points(750)
    nearest, rows = find_nearest(points), np.arange(0, 750, 7)
    every = fit(points)
    some = fit_quadrics(points, nearest.index[rows], nearest.weight[rows], rows)
    np.testing.assert_allclose(some.gaussian_curvature, every.gaussian_curvature[rows], rtol=1e-9)
    np.testing.assert_allclose(np.abs(np.einsum("ij,ij->i", some.normals, every.normals[rows])), 1.0, rtol=1e-9)


def test_height_leads_to_the_quadric():
    points = fibonacci_sphere(1500)
    spacing = np.sqrt(4.0 * np.pi / 1500)
    moved = points.copy()
    moved[::50] *= 1.0 + 0.5 * spacing
    surface = fit(moved)
    corrected = np.linalg.norm(moved + surface.height, axis=1) - 1.0
    assert np.abs(corrected[::50]).max() < 0.3 * spacing


def test_frames_are_orthonormal():
    normals = np.concatenate([random_sphere(200), np.eye(3), -np.eye(3)])
    found = frames(normals)
    np.testing.assert_allclose(np.swapaxes(found, 1, 2) @ found, np.tile(np.eye(3), (206, 1, 1)), atol=1e-12)
    np.testing.assert_array_equal(found[:, :, 0], normals)


class TestGaussianCurvature:
    def test_total_curvature_of_closed_surfaces(self):
        for points, expected in ((random_sphere(1500), 4.0 * np.pi), (torus_points(3000), 0.0)):
            laplacian = core.build_laplacian(points)
            assert laplacian.areas @ laplacian.gaussian_curvature == pytest.approx(expected, abs=0.5)
