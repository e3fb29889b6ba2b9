"""The paper's Algorithm 1 for its area elements, to hold the product's solver of eq. (8) against."""

from dataclasses import dataclass

import numpy as np

from core.paper.areas import TAU, Matrix
from core.types import Floats


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

    areas: Floats
    objective: Floats
    steps: int
    residual: float
    converged: bool
    stalled: bool


def algorithm_1(
    matrix: Matrix,
    target: Floats,
    start: Floats,
    rho: float = 1e-3,
    epsilon: float = 1e-3,
    nu: float = 1e-4,
    beta: float = 0.1,
    omega: float = 1e-10,
    steps: int = 100_000,
) -> DescentResult:
    """Minimise eq. (8) by the paper's Algorithm 1: projected gradient steps with an Armijo-like search.

    Parameters
    ----------
    matrix : KernelMatrix or ndarray, (n, n)
        A of eq. (6), in scaled coordinates.
    target : ndarray, (n,)
        b.
    start : ndarray, (n,)
        The solution of eq. (7); entries below tau are set to it.
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

    def evaluate(v: Floats) -> tuple[Floats, float]:
        misfit = matrix @ v - target
        return misfit, float(misfit @ misfit + rho * (v @ v))

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
