"""Slopes of values along the surface: exact for linear functions, none where nothing is known, and never too steep."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import core
from benchmarks.samplings import random_sphere, square_random


def flat_discs(count, radius):
    return core.surface.Discs(np.tile([0.0, 0.0, 1.0], (count, 1)), np.full(count, radius))


@pytest.fixture(scope="module")
def sphere():
    points = random_sphere(4000)
    return points, core.surface.surface_discs(points)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_linear_functions_are_exact_to_the_very_boundary(scale):
    points = scale * np.column_stack([square_random(2000)[:, :2], np.zeros(2000)])
    slopes = core.measure.Slopes(points, core.surface.surface_discs(points))
    assert_allclose(slopes.of(points @ [3.0, -2.0, 7.0] + 5.0), np.tile([3.0, -2.0, 0.0], (2000, 1)), atol=1e-6)


def test_points_in_single_precision():
    """As Blender keeps them: numpy 2 warns of a bound that single precision does not reach."""
    points = np.column_stack([square_random(500)[:, :2], np.zeros(500)]).astype(np.float32)
    slopes = core.measure.Slopes(points, core.surface.surface_discs(points)).of(points[:, 0])
    assert_allclose(slopes, np.tile([1.0, 0.0, 0.0], (500, 1)), atol=1e-5)


def test_on_a_curved_surface_they_are_close_and_lie_in_the_tangent_planes(sphere):
    points, discs = sphere
    found = core.measure.Slopes(points, discs).of(points[:, 2])
    assert np.abs(np.einsum("ij,ij->i", found, discs.normals)).max() < 1e-12
    wrong = np.linalg.norm(found - ([0.0, 0.0, 1.0] - points * points[:, 2:]), axis=1)
    assert np.median(wrong) < 0.02
    assert np.percentile(wrong, 95) < 0.06


def test_jumps_between_discs_become_a_fortieth(sphere):
    points, discs = sphere
    values = points[:, 0] * points[:, 1]
    slopes = core.measure.Slopes(points, discs).of(values)
    first, second = np.array([(row, near) for row, near in enumerate(core.geometry.find_nearest(points).index[:, 1])]).T
    middle = 0.5 * (points[first] + points[second])
    flat = np.abs(values[first] - values[second])
    at_first = values[first] + np.einsum("ij,ij->i", slopes[first], middle - points[first])
    at_second = values[second] + np.einsum("ij,ij->i", slopes[second], middle - points[second])
    assert np.mean(np.abs(at_first - at_second)) < 0.025 * flat.mean()


@pytest.mark.parametrize("kind", ["noise", "a jump", "a spike"])
def test_discs_stay_within_the_range_of_the_values(sphere, kind):
    points, discs = sphere
    values = {
        "noise": np.random.default_rng(1).standard_normal(len(points)),
        "a jump": np.where(points[:, 2] > 0.0, 1.0, -1.0),
        "a spike": (np.arange(len(points)) == 17).astype(float),
    }[kind]
    rise = np.linalg.norm(core.measure.Slopes(points, discs).of(values), axis=1) * discs.radii
    near = values[core.geometry.find_nearest(points).index[:, :13]]
    beyond = (values + rise > near.max(axis=1) + 1e-9) | (values - rise < near.min(axis=1) - 1e-9)
    assert np.mean(beyond) < 0.01


def test_constant_values_have_no_slopes(sphere):
    assert not core.measure.Slopes(*sphere).of(np.full(4000, 1e30)).any()


def test_the_other_side_of_a_thin_wall_does_not_count():
    side = square_random(2000)[:, :2]
    points = np.vstack([np.column_stack([side, np.full(2000, height)]) for height in (0.0, 0.022)])
    values = np.where(points[:, 2] > 0.0, 100.0, 0.0) + points[:, 0]
    found = core.measure.Slopes(points, flat_discs(4000, 0.02)).of(values)
    assert np.mean(np.abs(found - [1.0, 0.0, 0.0]).max(axis=1) < 1e-6) > 0.99


def test_unknown_values_and_unknown_discs_have_none_and_spoil_no_others(sphere):
    points, discs = sphere
    hole, lost = points[:, 0] > 0.8, points[:, 0] < -0.8
    radii = np.where(lost, 0.0, discs.radii)
    found = core.measure.Slopes(points, core.surface.Discs(discs.normals, radii)).of(
        np.where(hole, np.nan, points[:, 2])
    )
    assert not found[hole | lost].any()
    other = ~(hole | lost)
    assert np.isfinite(found).all()
    wrong = found - ([0.0, 0.0, 1.0] - points * points[:, 2:])
    assert np.median(np.linalg.norm(wrong[other], axis=1)) < 0.02


@pytest.mark.parametrize(
    "points",
    [np.zeros((0, 3)), np.zeros((1, 3)), np.zeros((40, 3)), np.linspace(0.0, 1.0, 40)[:, None] * [1.0, 0.0, 0.0]],
    ids=["none", "one", "all at one place", "a line"],
)
def test_points_that_are_no_surface_have_finite_slopes(points):
    found = core.measure.Slopes(points, flat_discs(len(points), 0.1)).of(np.arange(len(points)))
    assert found.shape == points.shape
    assert np.isfinite(found).all()


@pytest.mark.parametrize("values", [np.zeros(3), np.zeros((4000, 2)), ["a"] * 4000], ids=["few", "pairs", "texts"])
def test_values_of_another_shape_are_refused(sphere, values):
    with pytest.raises(core.InvalidPointsError, match="each of 4000 points"):
        core.measure.Slopes(*sphere).of(values)
