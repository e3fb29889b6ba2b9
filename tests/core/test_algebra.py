"""Polynomials of matrices, their largest eigenvalue, equations by residuals, small systems, against what is known."""

import itertools

import numpy as np
import pytest
from scipy.sparse.linalg import ArpackNoConvergence

from core.algebra import Anderson, chebyshev_steps, chebyshev_terms, eigenvalue, eliminate, largest_eigenvalue
from core.errors import SolverError


def chain(count):
    """Product with the Laplacian of a chain of points, whose eigenvalues are 2 - 2 cos(k pi / count)."""

    def product(y):
        steps = np.diff(y, prepend=y[:1], append=y[-1:])
        return -np.diff(steps)

    return product


def test_chebyshev_terms_are_cosines_of_multiples():
    angle = np.linspace(0.0, np.pi, 50)
    terms = chebyshev_terms(lambda y: np.cos(angle)[:, None] * y, np.ones((50, 2)))
    for degree, term in zip(range(40), terms, strict=False):
        np.testing.assert_allclose(term, np.cos(degree * angle)[:, None] * np.ones((50, 2)), atol=1e-12)


def test_chebyshev_terms_take_one_product_each_and_leave_the_start():
    products, start = [], np.full(3, 0.5)
    terms = chebyshev_terms(lambda y: products.append(y) or 0.5 * y, start)
    for degree in range(5):
        next(terms)
        assert len(products) == degree
    np.testing.assert_array_equal(start, 0.5)


@pytest.mark.parametrize("unit", [1e-40, 1.0, 1e40])
@pytest.mark.parametrize("count", [50, 2000])
def test_largest_eigenvalue_of_a_chain_is_bounded_closely(unit, count):
    exact = unit * (2.0 + 2.0 * np.cos(np.pi / count))
    product = chain(count)
    assert exact <= largest_eigenvalue(lambda y: unit * product(y), count) <= 1.06 * exact


def test_a_largest_eigenvalue_that_is_not_found_is_reported(monkeypatch):
    def fail(*_, **__):
        raise ArpackNoConvergence("none", [], [])

    monkeypatch.setattr(eigenvalue, "eigsh", fail)
    with pytest.raises(SolverError, match="of 2000 points was not found"):
        largest_eigenvalue(chain(2000), 2000)


def test_anderson_finds_the_fixed_point_of_a_linear_map_in_as_many_steps_as_it_has_eigenvalues():
    factors = np.array([0.99, 0.9, -0.5, 0.2])  # alone, the first would take thousands of steps
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((4, 4)))[0]
    matrix, fixed = turn @ np.diag(factors) @ turn.T, np.arange(4.0)
    acceleration, place = Anderson(1e-14), np.zeros(4)
    for _ in range(6):
        place = acceleration.extrapolate(place, fixed + matrix @ (place - fixed))
    np.testing.assert_allclose(place, fixed, atol=1e-7)


def test_anderson_takes_the_first_step_as_it_is_and_stays_where_nothing_changes():
    acceleration, after = Anderson(1e-10), np.ones((3, 2))
    np.testing.assert_array_equal(acceleration.extrapolate(np.zeros((3, 2)), after), after)
    for _ in range(8):
        np.testing.assert_array_equal(acceleration.extrapolate(after - 1.0, after), after)


def test_chebyshev_steps_solve_equations_as_fast_as_any_polynomial_of_their_residuals_can():
    least, largest = 0.1, 2.0
    eigenvalues, right = np.linspace(least, largest, 200), np.ones(200)
    place, step = np.zeros(200), 0.0
    for number, (kept, rate) in enumerate(itertools.islice(chebyshev_steps(least, largest), 12)):
        residual = right - eigenvalues * place
        bound = 1.0 / np.cosh(number * np.arccosh((largest + least) / (largest - least)))
        np.testing.assert_allclose(np.abs(residual).max(), bound, rtol=1e-9)
        step = kept * step + rate * residual
        place = place + step


@pytest.mark.parametrize("size", [1, 2, 5])
def test_elimination_gives_inverses_and_solutions(size):
    """Of I + v v^T, whose inverse is I - v v^T / (1 + |v|^2)."""
    v = np.random.default_rng(0).standard_normal((size, 30))
    outer, identity = v[:, None] * v, np.eye(size)[:, :, None]
    right = np.stack([np.ones((size, 30)), v], axis=1)
    found = eliminate(np.concatenate([identity + outer, right], axis=1))
    inverse = identity - outer / (1.0 + np.sum(v**2, axis=0))
    np.testing.assert_allclose(found[:, :size], inverse, atol=1e-12)
    np.testing.assert_allclose(found[:, size], inverse.sum(axis=1), atol=1e-12)
    np.testing.assert_allclose(found[:, size + 1], v / (1.0 + np.sum(v**2, axis=0)), atol=1e-12)
