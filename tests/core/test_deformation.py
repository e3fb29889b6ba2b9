"""Deformation: rotations, faint pairs, moves whose result is known, and the bent bar."""

import functools

import numpy as np
import pytest
from scipy import sparse

import core
from benchmarks.deformation import LENGTH, bar_ends, section_areas, turns
from benchmarks.samplings import bar, bent_end, fibonacci_sphere, random_sphere, square_grid
from core.algebra.factors import sparsify
from core.algebra.rotations import nearest_rotations
from core.geometry.points import as_indices
from core.operator.laplacian import narrow_laplacian

QUARTER = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
MODES = [
    pytest.param({"rotation_aware": aware, "weights": weights}, id=f"{name}, {kind}")
    for aware, name in ((False, "linear"), (True, "rotation-aware"))
    for weights, kind in ((None, "hard"), (1.0, "soft"))
]


@functools.cache
def small_bar():
    """Points, sections and operator of a coarse bar."""
    points, _, section = bar(10, 36)
    return points, section, core.build_laplacian(points)


def ends():
    """Indices of the three last rows at both ends of the small bar."""
    points = small_bar()[0]
    reach = 2.5 * LENGTH / 36
    return np.flatnonzero(points[:, 0] < reach), np.flatnonzero(points[:, 0] > LENGTH - reach)


@functools.cache
def small_sphere():
    return core.build_laplacian(random_sphere(800))


def caps():
    z = small_sphere().points[:, 2]
    return np.flatnonzero(z > 0.9), np.flatnonzero(z < -0.9)


def proper(count, seed):
    random = np.random.default_rng(seed)
    result = np.linalg.qr(random.standard_normal((count, 3, 3)))[0]
    return result * np.linalg.det(result)[:, None, None]


@pytest.mark.parametrize(
    "values",
    [(1, 1, 1), (3, 2, 1), (1, 0.8, 0), (1, 0.05, 0), (5, 0.3, -0.2), (1, 1, -0.3), (1e-12, 1e-13, 0), (1e9, 1e8, 1e7)],
)
def test_nearest_rotation_of_known_singular_values(values):
    left, right = proper(200, 0), proper(200, 1)
    matrices = left @ (np.array(values, dtype=float)[:, None] * right)
    rotations = np.moveaxis(nearest_rotations(np.moveaxis(matrices, 0, 2)), 2, 0)
    np.testing.assert_allclose(rotations, left @ right, atol=1e-11)
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=1e-12)


def test_nearest_rotation_is_proper_and_best_for_any_matrix():
    random = np.random.default_rng(2)
    matrices = random.standard_normal((2000, 3, 3))
    matrices[0] = 0.0
    matrices[1] = np.outer([1.0, 2.0, 3.0], [0.0, 1.0, -1.0])
    matrices[2] = -np.eye(3)
    rotations = np.moveaxis(nearest_rotations(np.moveaxis(matrices, 0, 2)), 2, 0)
    np.testing.assert_allclose(np.swapaxes(rotations, 1, 2) @ rotations, np.tile(np.eye(3), (2000, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=1e-12)
    singular = np.linalg.svd(matrices, compute_uv=False)
    singular[:, 2] *= np.where(np.linalg.det(matrices) < 0.0, -1.0, 1.0)
    np.testing.assert_allclose(np.einsum("nij,nij->n", rotations, matrices), singular.sum(axis=1), atol=1e-7)
    np.testing.assert_allclose(rotations[0], np.eye(3), atol=1e-12)


def test_indices_keep_their_order():
    np.testing.assert_array_equal(as_indices([5, -1, 0], 8, "handles"), [5, 7, 0])
    np.testing.assert_array_equal(as_indices(np.arange(8) > 5, 8, "handles"), [6, 7])
    assert len(as_indices([], 8, "handles")) == 0
    with pytest.raises(core.InvalidPointsError, match="1 of the 3 handles are named more than once"):
        as_indices([1, 2, -7], 8, "handles")


def test_without_faint_pairs_the_stiffness_stays_a_stiffness():
    full = narrow_laplacian(small_sphere(), 60).stiffness
    thin = sparsify(full)
    assert thin.nnz < 0.6 * full.nnz
    assert abs(thin - thin.T).max() < 1e-12
    assert np.abs(thin.sum(axis=1)).max() < 1e-11
    assert (thin - sparse.diags_array(thin.diagonal())).max() <= 0.0
    assert 0.95 < thin.diagonal().sum() / full.diagonal().sum() < 1.0


def test_faint_pairs_stay_where_they_alone_hold_parts_together():
    weights = sparse.coo_array(([1.0, 1e-4, 1.0], ([0, 1, 2], [1, 2, 3])), shape=(4, 4))
    weights = (weights + weights.T).tocsr()
    stiffness = (sparse.diags_array(weights.sum(axis=1)) - weights).tocsr()
    assert sparsify(stiffness) is stiffness


@pytest.mark.parametrize("mode", MODES)
def test_nothing_moves_where_nothing_is_moved(mode):
    points, _, laplacian = small_bar()
    first, last = ends()
    deformer = core.deform.Deformer(laplacian, last, first, **mode)
    found = deformer.deform(points[last])
    assert np.abs(found.points - points).max() < 1e-8 * LENGTH
    assert found.converged
    assert deformer.notices == []


@pytest.mark.parametrize("mode", MODES)
def test_all_moves_along_with_the_constrained_points(mode):
    points, _, laplacian = small_bar()
    deformer = core.deform.Deformer(laplacian, np.concatenate(ends()), **mode)
    result = deformer.solve(points[deformer.handles] + (10.0, -20.0, 30.0))
    assert np.abs(result - points - (10.0, -20.0, 30.0)).max() < 1e-6 * LENGTH


@pytest.mark.parametrize("weights", [None, 1.0])
def test_all_turns_with_the_constrained_points(weights):
    points, _, laplacian = small_bar()
    deformer = core.deform.Deformer(laplacian, np.concatenate(ends()), weights=weights)
    found = deformer.deform(points[deformer.handles] @ QUARTER.T + 2.0)
    assert np.abs(found.points - points @ QUARTER.T - 2.0).max() < 1e-3 * LENGTH
    assert found.converged


def test_turning_is_found_from_the_surface_too():
    # The first guess from the constrained points is no help where the start names another one.
    points, _, laplacian = small_bar()
    deformer = core.deform.Deformer(laplacian, np.concatenate(ends()))
    target = points[deformer.handles] @ QUARTER.T
    linear = core.deform.Deformer(laplacian, deformer.handles, rotation_aware=False).solve(target)
    assert np.abs(linear - points @ QUARTER.T).max() > 0.02 * LENGTH
    result, steps, _ = deformer.deform(target, start=linear)
    assert steps > 2
    assert np.abs(result - points @ QUARTER.T).max() < 1e-3 * LENGTH


def test_linear_mode_bends_a_sheet_to_the_cubic_of_a_clamped_beam():
    points = square_grid(28)
    x = points[:, 0]
    low, high = x < 0.2, x > 0.8
    laplacian = core.build_laplacian(points)
    deformer = core.deform.Deformer(laplacian, high, low, rotation_aware=False)
    result = deformer.solve(points[high] + (0.0, 0.0, 1.0))
    t = np.clip((x - x[low].max()) / (x[high].min() - x[low].max()), 0.0, 1.0)
    assert np.abs(result[:, 2] - (3.0 * t**2 - 2.0 * t**3)).max() < 0.03
    assert np.abs(result[:, :2] - points[:, :2]).max() < 1e-10


def test_linear_mode_is_linear():
    laplacian = small_sphere()
    points, (top, bottom) = laplacian.points, caps()
    deformer = core.deform.Deformer(laplacian, top, bottom, rotation_aware=False)
    one, other = np.random.default_rng(0).standard_normal((2, len(top), 3))
    moved = [deformer.solve(points[top] + move) - points for move in (one, other, 2.0 * one - other)]
    np.testing.assert_allclose(moved[2], 2.0 * moved[0] - moved[1], atol=1e-9)
    assert np.abs(moved[0]).max() > 0.1


def test_bar_bends_smoothly_and_keeps_its_section():
    points, section, laplacian = small_bar()
    first, last = ends()
    target = bent_end(points[last], 0.5 * np.pi)
    deformer = core.deform.Deformer(laplacian, last, first)
    result, steps, converged = deformer.deform(target)
    assert converged
    assert steps < 15
    assert np.abs(section_areas(result, section) - 1.0).max() < 0.12
    angles = turns(result, section)
    assert angles.max() < 1.4 * angles.mean()
    assert abs(angles.mean() - 0.5 * np.pi / 36) < 0.05 * angles.mean()
    linear = core.deform.Deformer(laplacian, last, first, rotation_aware=False).solve(target)
    assert np.abs(section_areas(linear, section) - 1.0).max() > 0.25


def test_bend_does_not_depend_on_the_sampling():
    regular, section, laplacian = small_bar()
    first, last = ends()
    shifted = regular.copy()
    inside = np.setdiff1d(section.ravel(), np.concatenate([first, last]))
    shifted[inside, 0] += np.random.default_rng(0).uniform(-0.3, 0.3, len(inside)) * LENGTH / 36
    one, other = (
        core.deform.Deformer(operator, last, first).solve(bent_end(regular[last], 1.0))[section].mean(axis=1)
        for operator in (laplacian, core.build_laplacian(shifted))
    )
    assert np.abs(one - other).max() < 0.01 * LENGTH


def test_constrained_points_are_where_they_should_be():
    laplacian, (top, bottom) = small_sphere(), caps()
    top = top[::-1]
    target = laplacian.points[top] + np.random.default_rng(0).normal(0.0, 0.2, (len(top), 3))
    deformer = core.deform.Deformer(laplacian, top, bottom)
    result = deformer.solve(target, steps=3)
    np.testing.assert_allclose(result[top], target, atol=1e-13)
    np.testing.assert_allclose(result[bottom], laplacian.points[bottom], atol=1e-13)
    by_mask = np.zeros(len(result), dtype=bool)
    by_mask[top] = True
    again = core.deform.Deformer(laplacian, by_mask, bottom).solve(target[np.argsort(top)], steps=3)
    np.testing.assert_allclose(again, result, atol=1e-11)


def test_soft_constraints_give_way_as_their_weights_fall():
    laplacian, (top, bottom) = small_sphere(), caps()
    target = laplacian.points[top] + (0.0, 0.0, 1.0)
    hard = core.deform.Deformer(laplacian, top, bottom, rotation_aware=False).solve(target)
    away = []
    for weight in (1e-3, 1.0, 1e6):
        result = core.deform.Deformer(laplacian, top, bottom, rotation_aware=False, weights=weight).solve(target)
        away.append(np.abs(result - hard).max())
    assert away[0] > 1e-2
    assert 10.0 * away[1] < away[0]
    assert away[2] < 1e-5


def test_weights_are_those_of_handles_then_of_anchors():
    laplacian, (top, bottom) = small_sphere(), caps()
    target = laplacian.points[top] + (0.5, 0.0, 1.0)
    weights = np.concatenate([np.full(len(top), np.inf), np.zeros(len(bottom))])
    weights[-10:] = np.inf
    result = core.deform.Deformer(laplacian, top, bottom, weights=weights).solve(target)
    np.testing.assert_allclose(result[top], target, atol=1e-12)
    np.testing.assert_allclose(result, core.deform.Deformer(laplacian, top, bottom[-10:]).solve(target), atol=1e-10)
    assert np.abs(result[bottom[:-10]] - laplacian.points[bottom[:-10]]).max() > 1e-3


def test_parts_that_nothing_holds_stay():
    one, other = fibonacci_sphere(500), fibonacci_sphere(600) + (5.0, 0.0, 0.0)
    stray = np.array([[2.5, 3.0, 0.0], [2.5, -3.0, 0.0]])
    points = np.concatenate([one, other, stray])
    laplacian = core.build_laplacian(points, options=core.LaplacianOptions(neighbors=40))
    assert list(laplacian.component[-2:]) == [-1, -1]
    handles = np.array([0, len(points) - 1])
    deformer = core.deform.Deformer(laplacian, handles, [400])
    result = deformer.solve(points[handles] + (0.0, 0.0, 0.5))
    np.testing.assert_array_equal(result[500:1101], points[500:1101])
    np.testing.assert_array_equal(result[handles[1]], points[handles[1]] + (0.0, 0.0, 0.5))
    assert np.isfinite(result).all()
    assert np.linalg.norm(result[:400] - points[:400], axis=1).min() > 0.0
    assert len(deformer.notices) == 2
    assert deformer.notices[0].startswith("2 points are on no surface")
    assert deformer.notices[1].startswith("1 components with 600 points")
    lone = core.deform.Deformer(laplacian, [1101]).solve([[9.0, 9.0, 9.0]])
    np.testing.assert_array_equal(lone[:1101], points[:1101])
    np.testing.assert_array_equal(lone[1101], [9.0, 9.0, 9.0])


def test_every_part_turns_by_itself():
    one, other = fibonacci_sphere(500), fibonacci_sphere(600) + (5.0, 0.0, 0.0)
    points = np.concatenate([one, other])
    laplacian = core.build_laplacian(points, options=core.LaplacianOptions(neighbors=40))
    handles = np.concatenate([np.arange(0, 500, 50), np.arange(500, 1100, 50)])
    goal = np.concatenate([one @ QUARTER.T, other + 1.0])
    result = core.deform.Deformer(laplacian, handles).solve(goal[handles])
    np.testing.assert_allclose(result, goal, atol=1e-8)


def test_one_handle_alone_carries_the_surface_along():
    laplacian = small_sphere()
    result = core.deform.Deformer(laplacian, [7]).solve(laplacian.points[[7]] + (1.0, 2.0, 3.0))
    np.testing.assert_allclose(result, laplacian.points + (1.0, 2.0, 3.0), atol=1e-8)


def test_all_points_may_be_constrained():
    laplacian = small_sphere()
    target = 2.0 * laplacian.points
    result = core.deform.Deformer(laplacian, np.arange(len(target))).solve(target)
    np.testing.assert_allclose(result, target, atol=1e-12)


def test_solves_do_not_depend_on_those_before_unless_told_so():
    points, _, laplacian = small_bar()
    first, last = ends()
    deformer = core.deform.Deformer(laplacian, last, first)
    target = bent_end(points[last], 1.2)
    result = deformer.solve(target)
    deformer.solve(points[last])
    np.testing.assert_array_equal(deformer.solve(target), result)
    assert deformer.deform(target, steps=1)[1:] == (1, False)
    assert deformer.deform(target, start=deformer.solve(target, rtol=1e-7), rtol=1e-5)[1:] == (1, True)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"handles": []}, "no handles"),
        ({"handles": [0, 1], "anchors": [1, 2]}, "1 points are handles and anchors at once"),
        ({"handles": [800]}, "whole numbers below 800"),
        ({"handles": [0.5]}, "whole numbers"),
        ({"handles": [3, 3]}, "named more than once"),
        ({"handles": [0], "anchors": [[1, 2]]}, "whole numbers"),
        ({"handles": [0], "anchors": [1, 2], "weights": [1.0, 2.0]}, "one per handle"),
        ({"handles": [0], "anchors": [1], "weights": [1.0, -2.0]}, "1 weights are negative or NaN"),
        ({"handles": [0], "anchors": [1], "weights": np.nan}, "1 weights are negative or NaN"),
        ({"handles": [0], "anchors": [1], "weights": 0.0}, "All weights are zero"),
        ({"handles": [0], "weights": "much"}, "Weights have"),
    ],
)
def test_bad_sets_and_weights_are_refused(arguments, text):
    with pytest.raises(core.PointCloudError, match=text):
        core.deform.Deformer(small_sphere(), **arguments)


@pytest.mark.parametrize(
    ("positions", "text"),
    [
        (np.zeros((3, 3)), r"shape \(3, 3\)"),
        (np.zeros(3), r"shape \(3,\)"),
        ([[0.0, np.nan, 0.0], [0.0, 0.0, 0.0]], "1 of 2 handle positions are not finite"),
        ([[0.0, np.inf, 0.0], [0.0, 1e200, 0.0]], "2 of 2 handle positions are not finite"),
        ([["a", "b", "c"], ["d", "e", "f"]], "real numbers"),
        ([[0.0, 0.0, 0.0], [0.0, 0.0]], "Handle positions must be an array"),
    ],
)
def test_bad_positions_are_refused(positions, text):
    deformer = bound_to_two()
    with pytest.raises(core.InvalidPointsError, match=text):
        deformer.solve(positions)
    with pytest.raises(core.InvalidPointsError, match="[Ss]tarting points"):
        deformer.solve(np.zeros((2, 3)), start=np.zeros((2, 3)))


@functools.cache
def bound_to_two():
    return core.deform.Deformer(small_sphere(), [0, 1], [2])


def test_stages_and_steps_are_reported():
    seen = []
    core.deform.Deformer(small_sphere(), [0], [1], progress=lambda *report: seen.append(report))
    assert list(dict.fromkeys(stage for stage, _ in seen)) == ["Operator", "Equations", "Factors"]
    seen.clear()
    target = small_sphere().points[:2] + 0.1
    found = bound_to_two().deform(target, progress=lambda *report: seen.append(report))
    fractions = [fraction for _, fraction in seen]
    assert len(fractions) == found.steps + 2  # with the end
    assert fractions == sorted(fractions)
    assert 0.0 <= fractions[0] < fractions[-1] == 1.0


def test_ends_of_the_benchmarks_bar_are_whole_rows():
    points = bar()[0]
    first, last = bar_ends(points)
    assert len(points) == 4052
    assert len(first) == len(last) == 3 * 60 + 14 * 14
