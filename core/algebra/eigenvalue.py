"""The largest eigenvalue of a symmetric matrix, by its products: bounded closely, or estimated."""

from collections.abc import Callable

import numpy as np
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from ..errors import SolverError
from ..types import Floats
from .rows import Rows

_TOLERANCE, _ABOVE = 1e-2, 1.05  # of the Lanczos steps, and the factor that makes their result a bound


def largest_eigenvalue(product: Callable[[Floats], Floats], size: int) -> float:
    """Return a close upper bound of the eigenvalues of a matrix A by a few Lanczos steps, or raise `SolverError`.

    `product` returns A y for y, (size,). A is symmetric positive semi-definite, in any unit.
    """
    start = np.random.default_rng(0).standard_normal(size)
    # Scaled by a power of two to about one: the solver takes eigenvalues below an absolute threshold for zero.
    unit = np.ldexp(1.0, np.frexp(np.abs(product(start)).max())[1])
    operator = LinearOperator((size, size), matvec=lambda y: product(y.ravel()) / unit, dtype=np.float64)
    try:
        found = eigsh(operator, k=1, which="LA", v0=start, tol=_TOLERANCE, return_eigenvectors=False)[0]
    except ArpackNoConvergence as error:
        raise SolverError(f"The highest eigenvalue of {size} points was not found. Use fewer points.") from error
    return float(_ABOVE * unit * found)


def rough_largest_eigenvalue(matrix: Rows, diagonal: Floats) -> float:
    """Estimate the largest eigenvalue of a Hermitian positive semi-definite matrix over its diagonal, (n,).

    Of raw scans it is up to a fifth too low. That is enough for a smoother: a bound from `largest_eigenvalue` would
    take four times as many products, and save no steps of conjugate gradients.
    """
    y = np.random.default_rng(0).standard_normal(len(diagonal))
    for _ in range(10):  # power iterations: the estimate is then within about a tenth, by which it is raised
        y /= np.linalg.norm(y)
        y, before = (matrix @ y[:, None])[:, 0] / diagonal, y
    return float(1.1 * np.linalg.norm(y) / np.linalg.norm(before))
