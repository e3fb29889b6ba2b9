"""Deformation on some of the points that carry the others: which points, how they carry, and how close it comes."""

import functools

import numpy as np
import pytest

import core
from benchmarks.samplings import bar, bent_end, fibonacci_sphere, random_sphere, strip_points
from core.deform.coarse_deformation import _linear_weights
from core.geometry.thinning import thin

COUNT = 1000
TURN = np.linalg.qr(np.random.default_rng(5).standard_normal((3, 3)))[0]
TURN *= np.linalg.det(TURN)
MODES = [
    pytest.param({"rotation_aware": aware, "weights": weights}, id=f"{name}, {kind}")
    for aware, name in ((False, "linear"), (True, "rotation-aware"))
    for weights, kind in ((None, "hard"), (1.0, "soft"))
]


@functools.cache
def sphere():
    return core.build_laplacian(random_sphere(4000))  # of fewer it is not as close


@functools.cache
def long_bar():
    return core.build_laplacian(bar(12, 48)[0])


@functools.cache
def strip():
    return core.build_laplacian(strip_points(2400))


def caps():
    z = sphere().points[:, 2]
    return z > 0.9, z < -0.9


def both(laplacian, handles, anchors, count=COUNT, **settings):
    """The coarse deformer of some handles and anchors, and the one of all points."""
    coarse = core.deform.coarse_deformer(laplacian, handles, anchors, count=count, **settings)
    assert isinstance(coarse, core.deform.CoarseDeformer)
    return coarse, core.deform.Deformer(laplacian, handles, anchors, **settings)


def off(result, expected, laplacian):
    """Greatest distance between two results, as a share of the greatest displacement."""
    moved = np.linalg.norm(expected - laplacian.points, axis=1).max()
    return np.linalg.norm(result - expected, axis=1).max() / moved


class TestThinning:
    """Fewer points, as evenly spread."""

    def test_none_are_close_and_none_far(self):
        points = random_sphere(10_000)
        rows = thin(points, np.full(10_000, 4.0 * np.pi / 10_000), np.ones(10_000), 1000)
        assert 800 < len(rows) < 1200
        assert (np.diff(rows) > 0).all()
        apart = np.linalg.norm(points[rows, None] - points[None, rows], axis=2) + 9.0 * np.eye(len(rows))
        reach = np.sqrt(0.49 * 4.0 * np.pi / 1000)
        assert apart.min() > 0.99 * reach
        assert apart.min(axis=1).max() < 2.0 * reach

    def test_it_does_not_depend_on_the_order(self):
        points = random_sphere(2000)
        order = np.random.default_rng(1).permutation(2000)
        areas, spacing = np.ones(2000), 1.0 + points[:, 0] ** 2
        one = thin(points, areas, spacing, 500)
        other = thin(points[order], areas, spacing[order], 500)
        np.testing.assert_array_equal(np.sort(order[other]), one)

    def test_the_higher_rank_is_chosen_and_ranks_do_not_displace_each_other(self):
        points = random_sphere(4000)
        rank = np.zeros(4000, dtype=int)
        rank[[5, 17]] = 1
        rank[3000] = 2
        points[3000] = points[17] + 1e-6
        rows = thin(points, np.full(4000, np.pi / 1000), np.ones(4000), 200, rank)
        assert np.isin([5, 17, 3000], rows).all()

    def test_few_points_all_stay(self):
        np.testing.assert_array_equal(thin(random_sphere(50), np.ones(50), np.ones(50), 50), np.arange(50))


def test_weights_carry_linear_functions_along_the_surface():
    points = np.random.default_rng(0).uniform(size=(3000, 3)) * (1.0, 1.0, 0.0)
    inside = (np.abs(points - 0.5) < 0.4)[:, :2].all(axis=1)
    rows = thin(points, np.full(3000, 1.0 / 3000.0), np.ones(3000), 300)
    weights = _linear_weights(points[rows], points, lambda share: None)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    assert np.abs(weights @ points[rows] - points)[inside].max() < 0.003
    np.testing.assert_allclose((weights @ points[rows])[rows], points[rows], atol=1e-8)


@pytest.mark.parametrize("mode", MODES)
def test_what_is_moved_along_moves_along(mode):
    points, (top, bottom) = sphere().points, caps()
    deformer = core.deform.CoarseDeformer(sphere(), top | bottom, count=COUNT, **mode)
    assert np.abs(deformer.solve(points[deformer.handles]) - points).max() < 1e-9
    shift = np.array([10.0, -20.0, 30.0])
    assert np.abs(deformer.solve(points[deformer.handles] + shift) - points - shift).max() < 1e-9


@pytest.mark.parametrize("weights", [None, 1.0])
def test_what_is_turned_turns(weights):
    points, (top, bottom) = sphere().points, caps()
    deformer = core.deform.CoarseDeformer(sphere(), top | bottom, count=COUNT, weights=weights)
    result = deformer.solve(points[deformer.handles] @ TURN.T + 2.0)
    assert np.abs(result - points @ TURN.T - 2.0).max() < 1e-9


@pytest.mark.parametrize("mode", MODES)
def test_a_lifted_cap_is_close_to_the_exact_one(mode):
    top, bottom = caps()
    coarse, exact = both(sphere(), top, bottom, 2600, **mode)
    target = sphere().points[top] + (0.5, 0.0, 0.5)
    assert off(coarse.solve(target), exact.solve(target), sphere()) < 0.02


def test_a_bent_bar_is_close_to_the_exact_one():
    points = long_bar().points
    handles, anchors = points[:, 0] > 3.75, points[:, 0] < 0.25
    coarse, exact = both(long_bar(), handles, anchors)
    target = bent_end(points[handles], 0.5 * np.pi)
    found = coarse.deform(target)
    assert off(found.points, exact.solve(target), long_bar()) < 0.02
    assert found.converged


def test_a_lifted_strip_is_close_to_the_exact_one():
    points = strip().points
    handles, anchors = points[:, 0] > 2.75, points[:, 0] < 0.25
    coarse, exact = both(strip(), handles, anchors)
    target = points[handles] + (-0.2, 0.0, 0.6)
    assert off(coarse.solve(target), exact.solve(target), strip()) < 0.02


def test_handles_and_anchors_are_where_they_should_be():
    points, (top, bottom) = sphere().points, caps()
    handles = np.flatnonzero(top)[::-1]
    target = points[handles] + np.random.default_rng(0).normal(0.0, 0.1, (len(handles), 3))
    result = core.deform.CoarseDeformer(sphere(), handles, bottom, count=COUNT).solve(target, steps=1)
    np.testing.assert_array_equal(result[handles], target)
    np.testing.assert_array_equal(result[bottom], points[bottom])


def test_it_does_not_depend_on_the_order_of_the_points():
    points = random_sphere(2000, 3)
    order = np.random.default_rng(1).permutation(2000)
    results = []
    for rows in (np.arange(2000), order):
        given = points[rows]
        top = np.flatnonzero(given[:, 2] > 0.8)
        deformer = core.deform.CoarseDeformer(core.build_laplacian(given), top, given[:, 2] < -0.8, count=800)
        results.append(deformer.solve(given[top] + (0.3, 0.0, 0.3), rtol=1e-9))
    np.testing.assert_allclose(results[1], results[0][order], atol=1e-6)


def test_components_move_by_themselves_and_small_ones_are_not_lost():
    one, other, free = fibonacci_sphere(3000), 0.2 * fibonacci_sphere(400) + (3.0, 0.0, 0.0), fibonacci_sphere(500)
    points = np.concatenate([one, other, free - (3.0, 0.0, 0.0), [[0.0, 9.0, 0.0]]])
    laplacian = core.build_laplacian(points, options=core.LaplacianOptions(neighbors=40))
    label = np.repeat([0, 1, 2, 3], [3000, 400, 500, 1])
    handles = np.concatenate([np.arange(0, 3000, 50), np.arange(3000, 3400, 20), [3900]])
    goal = points.copy()
    goal[label == 0] = one @ TURN.T
    goal[label == 1] += 1.0
    goal[label == 3] += 5.0
    deformer = core.deform.CoarseDeformer(laplacian, handles, count=COUNT)
    np.testing.assert_allclose(deformer.solve(goal[handles]), goal, atol=1e-9)
    assert deformer.notices == core.deform.Deformer(laplacian, handles).notices
    lone = core.deform.CoarseDeformer(laplacian, [3900], count=COUNT).solve([[1.0, 2.0, 3.0]])
    np.testing.assert_array_equal(lone[:3900], points[:3900])
    np.testing.assert_array_equal(lone[3900], [1.0, 2.0, 3.0])


def test_weights_of_zero_hold_nothing():
    top, bottom = caps()
    weights = np.concatenate([np.full(top.sum(), np.inf), np.zeros(bottom.sum())])
    target = sphere().points[top] + (1.0, 2.0, 3.0)
    result = core.deform.CoarseDeformer(sphere(), top, bottom, weights=weights, count=COUNT).solve(target)
    np.testing.assert_allclose(result, sphere().points + (1.0, 2.0, 3.0), atol=1e-9)


def test_it_goes_on_from_the_last_result():
    top, bottom = caps()
    deformer = core.deform.CoarseDeformer(sphere(), top, bottom, count=COUNT)
    target = sphere().points[top] + (0.5, 0.0, 0.5)
    settled = deformer.solve(target, rtol=1e-7)
    again, *told = deformer.deform(target, steps=1, start=settled)
    assert told == [1, True]
    np.testing.assert_allclose(again, settled, atol=1e-4)


def test_few_points_are_all_solved_on():
    laplacian = core.build_laplacian(random_sphere(750))
    z = laplacian.points[:, 2]
    deformer = core.deform.coarse_deformer(laplacian, z > 0.9, z < -0.9, neighbors=40)
    assert isinstance(deformer, core.deform.Deformer)
    target = laplacian.points[deformer.handles] + (0.5, 0.0, 0.5)
    expected = core.deform.Deformer(laplacian, z > 0.9, z < -0.9, neighbors=40).solve(target)
    np.testing.assert_array_equal(deformer.solve(target), expected)


def test_bad_input_is_refused_as_by_all_points():
    with pytest.raises(core.PointCloudError, match="no handles"):
        core.deform.CoarseDeformer(sphere(), [], count=COUNT)
    deformer = core.deform.CoarseDeformer(sphere(), [0, 1], [2], count=COUNT)
    with pytest.raises(core.InvalidPointsError, match="Handle positions"):
        deformer.solve(np.zeros((3, 3)))
    with pytest.raises(core.InvalidPointsError, match="[Ss]tarting points"):
        deformer.solve(np.zeros((2, 3)), start=np.zeros((2, 3)))
    for make in (core.deform.CoarseDeformer, core.deform.coarse_deformer):
        with pytest.raises(core.PointCloudError, match="points to solve on is 0"):
            make(sphere(), [0], count=0)


def test_stages_are_reported():
    seen = []
    core.deform.CoarseDeformer(sphere(), [0], [1], count=COUNT, progress=lambda *report: seen.append(report))
    assert list(dict.fromkeys(stage for stage, _ in seen)) == ["Points", "Operator", "Equations", "Factors"]
    shares = [share for _, share in seen]
    assert shares == sorted(shares)
