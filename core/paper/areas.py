"""Area elements by the paper's least squares, eqs. (6) to (8), and its Algorithm 1."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from scipy.sparse.linalg import LinearOperator

from ..algebra import bounded_quadratic, conjugate_gradients
from ..errors import AreaError
from ..operator import KernelMatrix
from ..types import Array, Floats

Matrix: TypeAlias = KernelMatrix | Floats

_RTOL = 1e-12  # a looser one leaves areas open by as much as themselves: small eigenvalues weigh as little as rho
_START = 1000  # products for a start that need not be exact
TAU = 2.0**-52  # the paper's lower bound of eq. (8), in scaled coordinates


@dataclass(frozen=True)
class AreaSolution:
    """Areas and how they were found.

    Attributes
    ----------
    areas : ndarray, (n,)
        Area elements.
    products : int
        Products with the kernel matrix.
    residual : float
        Relative residual of the equations where the solver did not reach its tolerance, and zero where it did.
    """

    areas: Floats
    products: int
    residual: float = 0.0


def regularized_areas(
    matrix: Matrix, target: Floats, rho: float, products: int = 8000, rtol: float = _RTOL
) -> AreaSolution:
    """Minimise |A v - b|^2 + rho |v|^2, eq. (7), without a bound.

    A is symmetric, so the solution (A^2 + rho)^(-1) A b is the real part of (A + i sqrt(rho))^(-1) b. That system has
    the square root of the other one's condition number; it is solved by conjugate gradients for complex symmetric
    matrices, preconditioned by the density areas.

    Returns
    -------
    AreaSolution
        Areas may be negative where the points are irregular.
    """
    count = len(target)
    density = 1.0 / (matrix @ np.ones(count))

    def multiply(v: Array) -> Array:
        return (matrix @ v.real) + 1j * (matrix @ v.imag) + 1j * np.sqrt(rho) * v

    shifted = LinearOperator((count, count), matvec=multiply, dtype=complex)
    values: Array = np.zeros(count, dtype=complex)
    used, left = 1, np.inf
    # The updated residual loses digits: solve again from the last solution, until the true residual is so small.
    while left > rtol and used + 2 < products:
        found = conjugate_gradients(
            shifted, target.astype(complex), values, density, rtol=rtol, products=(products - used) // 2
        )
        values, used = found.values, used + 2 * found.products + 2
        left = float(np.linalg.norm(target - shifted @ values) / np.linalg.norm(target))
    return AreaSolution(values.real, used, left if left > rtol else 0.0)


def constrained_areas(
    matrix: Matrix, target: Floats, rho: float, products: int = 8000, rtol: float = _RTOL
) -> AreaSolution:
    """Minimise |A v - b|^2 + rho |v|^2 with v >= tau, eq. (8), starting from the solution of eq. (7).

    Returns
    -------
    AreaSolution
    """
    start = regularized_areas(matrix, target, rho, _START, 1e-4)
    if start.areas.min() >= TAU:
        start = regularized_areas(matrix, target, rho)
        if start.areas.min() >= TAU:
            return start
    density = 1.0 / (matrix @ np.ones(len(target)))
    damping = rho * density**2
    u, used, left = bounded_quadratic(
        lambda u: density * (matrix @ (matrix @ (density * u))) + damping * u,
        density * (matrix @ target),
        TAU / density,
        np.maximum(start.areas, TAU) / density,
        1.0,
        products // 2,
        rtol,
    )
    return AreaSolution(np.maximum(density * u, TAU), start.products + 2 * used, left if left > rtol else 0.0)


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


def _positive_areas(matrix: Matrix, target: Floats, rho: float) -> AreaSolution:
    solution = regularized_areas(matrix, target, rho)
    bad = int(np.count_nonzero(solution.areas <= 0.0))
    if bad:
        raise AreaError(
            f"The regularized areas of {bad} of {len(target)} points are not positive. Choose the areas 'constrained',"
            " or raise the regularization."
        )
    return solution


def _uniform_areas(matrix: Matrix, target: Floats, rho: float) -> AreaSolution:
    solution = regularized_areas(matrix, target, rho)
    return replace(solution, areas=np.full(len(target), solution.areas.mean()))


AREAS: dict[str, Callable[[Matrix, Floats, float], AreaSolution]] = {
    "constrained": constrained_areas,
    "regularized": _positive_areas,
    "uniform": _uniform_areas,
}
"""Function of each choice of `PaperOptions.areas`."""
