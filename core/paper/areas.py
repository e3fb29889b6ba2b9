"""Area elements by the paper's least squares, eqs. (6) to (8), and its Algorithm 1."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.linalg import LinearOperator

from ..algebra import bounded_quadratic, conjugate_gradients
from ..errors import AreaError

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
        What is left of the equations, as a share, where the solver did not reach its tolerance, and zero where it did.
    """

    areas: np.ndarray
    products: int
    residual: float = 0.0


def regularized_areas(matrix, target, rho, products=8000, rtol=_RTOL):
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

    def multiply(v):
        return (matrix @ v.real) + 1j * (matrix @ v.imag) + 1j * np.sqrt(rho) * v

    shifted = LinearOperator((count, count), matvec=multiply, dtype=complex)
    values, used, left = None, 1, np.inf
    # Sums from step to step lose digits: again from where they led, until what is left is known to be so little.
    while left > rtol and used + 2 < products:
        found = conjugate_gradients(
            shifted, target.astype(complex), values, density, rtol=rtol, products=(products - used) // 2
        )
        values, used = found.values, used + 2 * found.products + 2
        left = float(np.linalg.norm(target - shifted @ values) / np.linalg.norm(target))
    return AreaSolution(values.real, used, left if left > rtol else 0.0)


def constrained_areas(matrix, target, rho, products=8000, rtol=_RTOL):
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


def _positive_areas(matrix, target, rho):
    solution = regularized_areas(matrix, target, rho)
    bad = int(np.count_nonzero(solution.areas <= 0.0))
    if bad:
        raise AreaError(
            f"The regularized areas of {bad} of {len(target)} points are not positive. Choose the areas 'constrained',"
            " or raise the regularization."
        )
    return solution


def _uniform_areas(matrix, target, rho):
    solution = regularized_areas(matrix, target, rho)
    return replace(solution, areas=np.full(len(target), solution.areas.mean()))


AREAS = {"constrained": constrained_areas, "regularized": _positive_areas, "uniform": _uniform_areas}
"""Function of each choice of `PaperOptions.areas`."""
