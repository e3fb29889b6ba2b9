"""Area elements by the paper's least squares, eqs. (6) to (8)."""

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
    """Areas and how they were found."""

    areas: Floats  # (n,), area elements
    products: int  # products with the kernel matrix
    # Relative residual of the equations where the solver did not reach its tolerance, and zero where it did
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
