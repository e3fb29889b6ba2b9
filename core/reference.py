"""The paper taken literally, for comparison and tests: Algorithm 1 and the unsymmetrised operator of eq. (5)."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from .areas import TAU
from .kernel import pair_kernel


@dataclass(frozen=True)
class DescentResult:
    """The course of Algorithm 1.

    Attributes
    ----------
    areas : ndarray, (n,)
        The last iterate.
    objective : ndarray, (steps + 1,)
        F^rho before the first and after every step.
    steps : int
        Updates of the areas.
    residual : float
        The stopping quantity, ``max|v_k - v_(k-1)| / mu``, of the last step.
    converged : bool
        The stopping quantity fell to epsilon.
    stalled : bool
        The guard ended the Armijo search: no step changed F by more than its rounding.
    """

    areas: np.ndarray
    objective: np.ndarray
    steps: int
    residual: float
    converged: bool
    stalled: bool


def algorithm_1(matrix, target, start, rho=1e-3, epsilon=1e-3, nu=1e-4, beta=0.1, omega=1e-10, steps=100_000):
    """Minimise eq. (8) by the paper's Algorithm 1: projected gradient steps with an Armijo-like search.

    Parameters
    ----------
    matrix : KernelMatrix or ndarray, (n, n)
        A of eq. (6), in scaled coordinates.
    target : ndarray, (n,)
        b.
    start : ndarray, (n,)
        The solution of eq. (7); entries below tau are put on it.
    rho, epsilon, nu, beta, omega : float
        As in the paper.
    steps : int
        Most updates.

    Returns
    -------
    DescentResult

    Notes
    -----
    Each step begins with the longest one that keeps all decreasing areas feasible and divides it by ten until F falls
    enough. Where F is flat to rounding that never happens; the search then ends once the step cannot change F by more
    than a few units in its last place, and the result says that it stalled.
    """

    def evaluate(v):
        misfit = matrix @ v - target
        return misfit, misfit @ misfit + rho * (v @ v)

    v = np.maximum(start, TAU)
    misfit, value = evaluate(v)
    objective, residual, stalled = [value], np.inf, False
    while len(objective) <= steps and residual > epsilon and not stalled:
        gradient = 2.0 * (matrix @ misfit + rho * v)
        limited = (v > TAU) & (gradient > 0.0)
        mu = max(omega, np.min((v[limited] - TAU) / gradient[limited])) if limited.any() else 1.0
        while True:
            trial = np.maximum(v - mu * gradient, TAU)
            change = v - trial
            trial_misfit, trial_value = evaluate(trial)
            if value - trial_value > nu / mu * (change @ change):
                break
            mu *= beta
            if abs(gradient @ change) * beta <= 4.0 * np.finfo(float).eps * value:
                stalled = True
                break
        if not stalled:
            residual = np.abs(change).max() / mu
            v, misfit, value = trial, trial_misfit, trial_value
            objective.append(value)
    return DescentResult(v, np.array(objective), len(objective) - 1, residual, residual <= epsilon, stalled)


def unsymmetrized_operator(neighborhoods, normals, areas):
    """Assemble the operator of eq. (5): each row projects its neighbours on its own tangent plane.

    Parameters
    ----------
    neighborhoods : Neighborhoods
        Of m distinct points.
    normals : ndarray, (m, 3)
        Unit normals.
    areas : ndarray, (m,)
        Area elements in scaled coordinates.

    Returns
    -------
    csr_array, (m, m)
        L in scaled coordinates: rows sum to zero, not symmetric for any inner product in general.
    """
    row = np.concatenate([neighborhoods.first, neighborhoods.second])
    column = np.concatenate([neighborhoods.second, neighborhoods.first])
    distance, lengths = np.tile(neighborhoods.distance, 2), np.tile(neighborhoods.mean(neighborhoods.lengths), 2)
    difference = neighborhoods.points[row] - neighborhoods.points[column]
    height = np.einsum("ij,ij->i", difference, normals[row])
    projected = np.sqrt(np.maximum(distance**2 - height**2, 0.0))
    weights = pair_kernel(projected / lengths) / lengths**4 * areas[column]
    count = len(areas)
    matrix = sparse.csr_array((weights, (row, column)), shape=(count, count))
    return (matrix - sparse.diags_array(matrix.sum(axis=1), format="csr")).tocsr()
