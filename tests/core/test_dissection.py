"""Sparse equations: an order that keeps factors small, whatever the points are like, and Cholesky's factors."""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

import core
from core.algebra.cholesky import factorize
from core.algebra.factors import dissect


def near_matrix(points, reach):
    """A positive definite matrix that couples all points nearer than a distance."""
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    count = len(points)
    weights = sparse.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    weights = weights + weights.T
    return (sparse.diags_array(weights.sum(axis=1) + 1.0) - weights).tocsr()


def square(count, seed=0):
    return np.random.default_rng(seed).uniform(size=(count, 3)) * (1.0, 1.0, 0.0)


def fill(matrix, order):
    ordered = matrix[order][:, order].tocsc()
    return splu(ordered, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True}).nnz


def test_factors_are_hardly_larger_than_those_of_minimum_degree():
    points = square(1500)
    matrix = near_matrix(points, 0.1306)  # 76 entries in a row, as the equations of a deformation have
    order = dissect(matrix, points)[0]
    assert np.array_equal(np.sort(order), np.arange(1500))
    least = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}).nnz
    assert fill(matrix, order) < 1.17 * least
    assert fill(matrix, np.random.default_rng(0).permutation(1500)) > 3.0 * least


@pytest.mark.parametrize(
    ("points", "reach"),
    [
        (np.zeros((0, 3)), 1.0),
        (np.zeros((1, 3)), 1.0),
        (np.zeros((300, 3)), 1.0),
        (square(400), 2.0),
        (square(1000) * (1.0, 0.0, 0.0), 0.01),
        (np.concatenate([square(500), square(500, 1) + 100.0]), 0.1),
        (square(500), 1e-9),
    ],
    ids=["none", "one", "one place", "all coupled", "line", "two components", "none coupled"],
)
def test_any_points_are_ordered(points, reach):
    order = dissect(near_matrix(points, reach), points)[0]
    assert np.array_equal(np.sort(order), np.arange(len(points)))


def test_it_may_be_stopped():
    def stop():
        raise core.Cancelled

    points = square(500)
    with pytest.raises(core.Cancelled):
        dissect(near_matrix(points, 0.1), points, stop)


@pytest.mark.parametrize(
    ("points", "reach"),
    [
        (np.zeros((1, 3)), 1.0),
        (square(400), 2.0),
        (square(1500), 0.13),
        (square(1000) * (1.0, 0.0, 0.0), 0.01),
        (np.concatenate([square(500), square(500, 1) + 100.0]), 0.1),
        (square(500), 1e-9),
    ],
    ids=["one", "all coupled", "sheet", "line", "two components", "none coupled"],
)
@pytest.mark.parametrize("shape", [(), (1,), (3,)])
def test_factors_solve_the_equations(points, reach, shape, monkeypatch):
    monkeypatch.setattr("core.algebra.cholesky._WIDEST", 50)  # so that parts are cut
    matrix = near_matrix(points, reach)
    order, starts = dissect(matrix, points)
    ordered = matrix[order][:, order]
    right = np.random.default_rng(0).standard_normal((len(points), *shape))
    given = right.copy()
    found = factorize(ordered, starts)(right)
    assert found.shape == right.shape
    np.testing.assert_allclose(ordered @ found, right, atol=1e-10)
    np.testing.assert_array_equal(right, given)


def test_factors_are_the_same_on_any_number_of_cores(monkeypatch):
    points = square(2000)
    matrix = near_matrix(points, 0.07)
    order, starts = dissect(matrix, points)
    found = []
    for count in (1, 2):
        monkeypatch.setenv("MESHFREE_CORES", str(count))
        found.append(factorize(matrix[order][:, order], starts)(points))
    np.testing.assert_array_equal(*found)


def test_points_of_a_part_follow_each_other_along_its_longest_axis():
    points = square(1500)
    order, starts = dissect(near_matrix(points, 0.13), points)
    parts = [part for part in np.split(points[order], starts[1:]) if len(part) > 1]
    for part in parts:
        offset = part - part.mean(axis=0)
        steps = np.diff(offset @ np.linalg.eigh(offset.T @ offset)[1][:, -1])
        assert (steps > 0.0).all() or (steps < 0.0).all()
    assert len(parts) > 10


def test_equations_without_a_single_solution_are_refused():
    points = square(300)
    matrix = near_matrix(points, 0.2) - sparse.diags_array(np.full(300, 1.0 + 1e-6))
    order, starts = dissect(matrix, points)
    with pytest.raises(core.SolverError, match="equations of 300 points have no single solution"):
        factorize(matrix[order][:, order], starts)


def test_factors_tell_how_far_they_are_and_may_be_stopped():
    points = square(3000)
    matrix = near_matrix(points, 0.05)
    order, starts = dissect(matrix, points)
    shares = []
    factorize(matrix[order][:, order], starts, shares.append)
    assert len(shares) > 10
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)

    def stop(share):
        raise core.Cancelled

    with pytest.raises(core.Cancelled):
        factorize(matrix[order][:, order], starts, stop)
