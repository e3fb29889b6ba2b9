"""Conjugate gradients on systems whose solutions are known."""

import numpy as np
import pytest
from scipy import sparse

import core
from core.algebra.solvers import conjugate_gradients, solve_symmetric


def chain(diagonal):
    return sparse.diags_array([[diagonal] * 50, [-1.0] * 49, [-1.0] * 49], offsets=[0, 1, -1]).tocsr()


EXACT = np.sin(np.arange(50.0))


@pytest.mark.parametrize("scaling", [1.0, np.linspace(0.5, 2.0, 50)])
@pytest.mark.parametrize("start", [None, np.ones(50)])
def test_a_known_solution(scaling, start):
    found = conjugate_gradients(chain(2.0), chain(2.0) @ EXACT, start, scaling, rtol=1e-12)
    assert found.converged
    assert found.definite
    np.testing.assert_allclose(found.values, EXACT, atol=1e-9)


def test_a_start_is_left_alone():
    start = np.ones(50)
    conjugate_gradients(chain(2.0), chain(2.0) @ EXACT, start)
    np.testing.assert_array_equal(start, 1.0)


def test_a_complex_symmetric_matrix():
    matrix = chain(2.0) + 0.3j * sparse.eye_array(50)
    found = conjugate_gradients(matrix.tocsr(), matrix @ (EXACT + 1j), rtol=1e-12)
    assert found.converged
    np.testing.assert_allclose(found.values, EXACT + 1j, atol=1e-9)


@pytest.mark.parametrize("matrix", [chain(1.0), -chain(2.0)])
def test_an_indefinite_matrix(matrix):
    assert not conjugate_gradients(matrix, np.ones(50)).definite


def test_too_few_products():
    found = conjugate_gradients(chain(2.0), np.ones(50), products=3)
    assert not found.converged
    assert found.products == 3


def test_no_convergence_is_an_error():
    with pytest.raises(core.SolverError, match="50 points were not solved"):
        solve_symmetric(chain(1.0), np.ones(50))


def test_progress_is_told_and_may_stop():
    seen = []
    solve_symmetric(chain(2.0), np.ones(50), progress=lambda stage, fraction: seen.append((stage, fraction)))
    assert seen[0] == ("Solve", 0.0)

    def stop(stage, fraction):
        raise core.Cancelled

    with pytest.raises(core.Cancelled):
        solve_symmetric(chain(2.0), np.ones(50), progress=stop)
