"""Any number of eigenpairs, by Lanczos steps on a Chebyshev polynomial of the matrix."""

from collections.abc import Callable
from itertools import islice
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from ..types import Floats
from .chebyshev import chebyshev_terms
from .eigenvalue import largest_eigenvalue

_DEGREE = 6  # of the polynomial that the Lanczos steps work on, at least


def lift_lowest(
    matrix: sparse.csr_array, count: int, cut: float, report: Callable[[float], None]
) -> tuple[Floats, Floats]:
    """Return the lowest eigenpairs of a matrix.

    The polynomial lifts the eigenvalues below a cut and keeps all others within [-1, 1]. Lanczos then needs a sixth of
    the steps for about the same products, and the work between products, which would be half of the time, shrinks as
    much. Where a wanted eigenvalue lies above the cut, the cut is raised.

    Parameters
    ----------
    matrix : csr_array, (n, n)
        Symmetric positive semi-definite.
    count : int
    cut : float
        About twice the highest eigenvalue wanted.
    report : callable
        Called with the fraction done; may raise `Cancelled`.

    Returns
    -------
    values, vectors : ndarray, (count,) and (n, count)
        Ascending, orthonormal.

    Raises
    ------
    ArpackNoConvergence, SolverError
    """
    n = matrix.shape[0]
    random = np.random.default_rng(0)
    products = 0

    def multiply(y: Floats) -> Floats:
        nonlocal products
        if products % 20 == 0:
            report(products / (products + 30.0 * count))  # how many products it takes is not known in advance
        products += 1
        return matrix @ y.ravel()

    def solve(function: Callable[[Floats], Floats], maxiter: int = 500, **settings: Any) -> Any:
        operator = LinearOperator((n, n), matvec=function, dtype=np.float64)
        return eigsh(operator, which="LA", v0=random.standard_normal(n), maxiter=maxiter, **settings)

    top = largest_eigenvalue(multiply, n)
    while True:
        if cut < 0.7 * top:
            degree = max(_DEGREE, round(np.sqrt(top / cut)))
            center, radius = 0.5 * (top + cut), 0.5 * (top - cut)
        else:  # too few points for a polynomial: a shift to [1, 2], which needs no cut
            degree, center, radius = 1, 2.0 * top, top

        def polynomial(y: Floats, degree: int = degree, center: float = center, radius: float = radius) -> Floats:
            terms = chebyshev_terms(lambda y: (center * y - multiply(y)) / radius, y.ravel())
            return next(islice(terms, degree, None))

        try:
            ncv, restarts = min(n, max(2 * count + 1, 40)), 20 if degree > 1 else 500
            lifted, vectors = solve(polynomial, k=count, ncv=ncv, tol=1e-13, maxiter=restarts)
            if degree == 1 or lifted.min() > 1.0:
                break
        except ArpackNoConvergence:
            if degree == 1:
                raise
        cut *= 4.0

    # Symmetric clouds have multiple eigenvalues, of which Lanczos steps from one start may miss copies: search the
    # orthogonal complement of the vectors found for any that is lifted above the least of these.
    while True:

        def remainder(y: Floats, found: Floats = vectors) -> Floats:
            return project(found, polynomial(project(found, y.ravel())))

        if solve(remainder, k=1, tol=1e-3, return_eigenvectors=False)[0] <= lifted.min() * (1.0 - 1e-2):
            break
        missed, vector = solve(remainder, k=1, tol=1e-13)
        if missed[0] <= lifted.min() * (1.0 + 1e-9):
            break
        best = np.argsort(-np.append(lifted, missed))[:count]
        lifted, vectors = np.append(lifted, missed)[best], np.column_stack([vectors, vector])[:, best]
    values = np.einsum("ij,ij->j", vectors, matrix @ vectors)
    ascending = np.argsort(values)
    return values[ascending], vectors[:, ascending]


def project(vectors: Floats, y: Floats) -> Floats:
    """Return the component of y orthogonal to orthonormal vectors."""
    return y - vectors @ (vectors.T @ y)
