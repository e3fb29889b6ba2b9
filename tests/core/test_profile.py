"""Profiles: linear functions as they are, others to second order, by the distance along the path."""

import functools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere, square_random


@functools.cache
def operator_of(sample, *given):
    return core.build_laplacian(sample(*given))


def test_on_a_plane_linear_functions_stay_linear():
    laplacian = core.build_laplacian(square_random(1000))
    path = np.column_stack([np.linspace(0.1, 0.8, 40), np.linspace(0.2, 0.7, 40), np.zeros(40)])
    path += laplacian.points.min(axis=0) * [1.0, 1.0, 0.0]
    found = core.measure.profile(laplacian, path, laplacian.points @ [2.0, -1.0, 0.0] + 0.5)
    np.testing.assert_allclose(found.values, path @ [2.0, -1.0, 0.0] + 0.5, rtol=0.0, atol=5e-4)
    np.testing.assert_allclose(found.distance, np.linspace(0.0, np.hypot(0.7, 0.5), 40), rtol=0.0, atol=1e-12)


def test_on_a_sphere_the_error_is_of_second_order():
    errors = []
    for count in (800, 3200):
        laplacian = core.build_laplacian(fibonacci_sphere(count))
        angle = np.linspace(0.2, 2.9, 60)
        path = np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])
        values = np.column_stack([laplacian.points[:, 2], laplacian.points[:, 0] ** 2])
        found = core.measure.profile(laplacian, path, values)
        exact = np.column_stack([np.cos(angle), np.sin(angle) ** 2])
        errors.append(np.abs(found.values - exact).max())
    assert errors[0] < 0.02
    assert errors[1] < 0.4 * errors[0]


def test_close_sheets_stay_apart():
    points = np.concatenate([fibonacci_sphere(1000), 0.9 * fibonacci_sphere(900)])
    laplacian = core.build_laplacian(points)
    path = core.distance.geodesic_path(laplacian, 100, 700)
    found = core.measure.profile(laplacian, path, np.arange(1900) < 1000)
    np.testing.assert_allclose(found.values, 1.0, rtol=0.0, atol=1e-6)


def test_it_follows_turn_translation_scale_and_order():
    laplacian = operator_of(core.example_sphere)
    points = laplacian.points
    path = core.distance.geodesic_path(laplacian, 3, 500)
    before = core.measure.profile(laplacian, path, points[:, 0])
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    order = np.random.default_rng(1).permutation(len(points))
    moved = core.build_laplacian(50.0 * points[order] @ turn.T + 7.0)
    after = core.measure.profile(moved, 50.0 * path @ turn.T + 7.0, points[order, 0])
    np.testing.assert_allclose(after.distance, 50.0 * before.distance, rtol=1e-9)
    np.testing.assert_allclose(after.values, before.values, rtol=0.0, atol=1e-5)


def test_unknown_values_are_gaps_and_no_others():
    points = fibonacci_sphere(1500)
    angle = np.linspace(0.2, 2.9, 200)
    path = np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])
    found = core.measure.profile(core.build_laplacian(points), path, np.where(points[:, 2] > 0.3, np.nan, 1.0))
    assert np.isnan(found.values[path[:, 2] > 0.35]).all()
    np.testing.assert_allclose(found.values[path[:, 2] < 0.1], 1.0, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.2])
def test_the_uncertainty_holds_nearly_all_errors_and_not_much_more(noise):
    laplacian = operator_of(random_sphere, 2000)
    angle = np.linspace(0.2, 2.9, 300)
    path = np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])
    values = laplacian.points[:, 0] ** 2 + noise * np.random.default_rng(2).standard_normal(2000)
    found = core.measure.profile(laplacian, path, np.column_stack([values, np.full(2000, 3.0)]))
    error = np.abs(found.values[:, 0] - np.sin(angle) ** 2)
    assert np.mean(error <= found.uncertainty[:, 0]) > 0.85
    assert np.sqrt(np.mean(found.uncertainty[:, 0] ** 2)) < 4.0 * np.sqrt(np.mean(error**2))
    np.testing.assert_allclose(found.uncertainty[:, 1], 0.0, atol=1e-5)


def test_the_uncertainty_is_unknown_where_values_are():
    points = fibonacci_sphere(1500)
    angle = np.linspace(0.2, 2.9, 200)
    path = np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])
    found = core.measure.profile(core.build_laplacian(points), path, np.where(points[:, 2] > 0.3, np.nan, points[:, 0]))
    np.testing.assert_array_equal(np.isnan(found.uncertainty), np.isnan(found.values))
    assert 0.0 < np.nanmax(found.uncertainty) < 0.05


@pytest.mark.parametrize(
    ("path", "values", "text"),
    [
        ([[0.0, 0.0, 1.0]], np.zeros(800), "1 corners"),
        ([[0.0, 0.0], [1.0, 0.0]], np.zeros(800), "corner"),
        ([[0.0, 0.0, 1.0], [0.0, 1.0, np.nan]], np.zeros(800), "finite"),
        ([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]], np.zeros(799), "each of 800 points"),
        ([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]], ["a"] * 800, "each of 800 points"),
    ],
)
def test_wrong_arrays_are_refused(path, values, text):
    with pytest.raises(core.InvalidPointsError, match=text):
        core.measure.profile(operator_of(core.example_sphere), path, values)
