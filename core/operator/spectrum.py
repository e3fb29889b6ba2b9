"""Eigenpairs of the operator, eq. (12) of the paper."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh
from scipy.spatial import cKDTree

from ..errors import SolverError, TooFewPointsError, UnresolvedModesError
from ..kernel import inverse_symbol, symbol
from ..memory import check_mode_memory

_DEGREE = 6  # of the polynomial that the Lanczos steps work on, at least
_FLAT = 4.0  # the symbol hardly rises beyond


@dataclass(frozen=True)
class Spectrum:
    """The lowest eigenpairs of the negated operator.

    Attributes
    ----------
    eigenvalues : ndarray, (count,)
        Ascending, non-negative [1 / L^2].
    eigenvectors : ndarray, (n, count)
        Orthonormal for the areas: ``phi.T @ (areas * phi)`` is the identity. The entry of largest size is positive.
    """

    eigenvalues: np.ndarray
    eigenvectors: np.ndarray


def solve_spectrum(laplacian, stiffness, count, progress=None):
    """Compute raw eigenpairs; see `LaplaceBeltrami.eigenpairs`."""
    areas = laplacian.areas
    n = len(areas)
    if int(count) != count or count < 1:
        raise TooFewPointsError(f"{count!r} modes were asked for. Ask for a whole number of at least 1.")
    if count > n // 3:
        raise TooFewPointsError(f"{count} modes were asked for, but {n} points carry at most {n // 3}. Ask for fewer.")
    check_mode_memory(n, int(count))
    try:
        values, vectors = lowest_eigenpairs(
            laplacian, stiffness, int(count), progress or (lambda stage, fraction: None)
        )
    except ArpackNoConvergence as error:
        raise SolverError(
            f"The eigenvalue solver found {len(error.eigenvalues)} of {count} modes on {n} points. Ask for fewer modes."
        ) from error
    largest = np.argmax(np.abs(vectors), axis=0)
    vectors *= np.sign(vectors[largest, np.arange(count)])
    return Spectrum(values, vectors)


def symmetric_form(laplacian, stiffness):
    """Return a matrix with the eigenvalues of the negated operator whose eigenvectors are orthonormal.

    Returns
    -------
    order : ndarray, (m,) int
        The points that are not left out, neighbours near in memory, which makes the products faster.
    root : ndarray, (m,)
        ``root * y`` is the function on these points that the vector y stands for.
    matrix : csr_array, (m, m)
        Symmetric positive semi-definite [1 / L^2].
    """
    known = np.flatnonzero(laplacian.component >= 0)
    order = known[cKDTree(laplacian.points[known]).indices]
    root = 1.0 / np.sqrt(laplacian.areas[order])
    scale = sparse.diags_array(root, format="csr")
    return order, root, (scale @ stiffness[order][:, order] @ scale).tocsr()


def lowest_eigenpairs(laplacian, stiffness, count, progress):
    """Solve ``K phi = lambda areas phi`` for the lowest pairs by Lanczos steps on a Chebyshev polynomial.

    The polynomial lifts the eigenvalues below a cut, about twice Weyl's estimate 4 pi count / area of the highest one
    wanted, and keeps all others within [-1, 1]. Lanczos then needs a sixth of the steps for about the same products,
    and the work between products, which would be half of the time, shrinks as much. Where a wanted eigenvalue turns out
    to lie above the cut, the cut is raised.

    Returns
    -------
    values : ndarray, (count,)
        Ascending, not negative.
    vectors : ndarray, (n, count)
        Orthonormal for the areas.
    """
    progress("Spectrum", 0.0)
    order, root, matrix = symmetric_form(laplacian, stiffness)
    n = len(order)
    random = np.random.default_rng(0)
    products = 0

    def multiply(y):
        nonlocal products
        if products % 20 == 0:
            progress("Spectrum", products / (products + 30.0 * count))  # the number of products is not known before
        products += 1
        return matrix @ y.ravel()

    def solve(function, maxiter=500, **settings):
        operator = LinearOperator((n, n), matvec=function, dtype=np.float64)
        return eigsh(operator, which="LA", v0=random.standard_normal(n), maxiter=maxiter, **settings)

    top = 1.02 * solve(multiply, k=1, tol=1e-2, return_eigenvectors=False)[0]
    # What the wide kernel makes of twice Weyl's estimate, where many modes are asked for.
    squared = np.mean(laplacian.smoothing_lengths**2)
    frequency = 8.0 * np.pi * count / laplacian.areas.sum() * squared
    cut = symbol(np.sqrt(min(frequency, _FLAT**2))) / squared
    while True:
        if cut < 0.7 * top:
            degree = max(_DEGREE, round(np.sqrt(top / cut)))
            center, radius = 0.5 * (top + cut), 0.5 * (top - cut)
        else:  # too few points for a polynomial: a shift to [1, 2], right wherever the cut lies
            degree, center, radius = 1, 2.0 * top, top

        def polynomial(y, degree=degree, center=center, radius=radius):
            before, now = y.ravel(), (center * y.ravel() - multiply(y)) / radius
            for _ in range(degree - 1):
                before, now = now, (2.0 / radius) * (center * now - multiply(now)) - before
            return now

        try:
            ncv, restarts = min(n, max(2 * count + 1, 40)), 20 if degree > 1 else 500
            lifted, vectors = solve(polynomial, k=count, ncv=ncv, tol=1e-13, maxiter=restarts)
            if degree == 1 or lifted.min() > 1.0:
                break
        except ArpackNoConvergence:
            if degree == 1:
                raise
        cut *= 4.0

    # Of an eigenvalue that a symmetric cloud has several times, Lanczos steps from one start may miss copies: look for
    # any above the least one found, orthogonal to all found.
    while True:

        def remainder(y, found=vectors):
            return project(found, polynomial(project(found, y.ravel())))

        if solve(remainder, k=1, tol=1e-3, return_eigenvectors=False)[0] <= lifted.min() * (1.0 + 1e-6):
            break
        missed, vector = solve(remainder, k=1, tol=1e-13)
        best = np.argsort(-np.append(lifted, missed))[:count]
        lifted, vectors = np.append(lifted, missed)[best], np.column_stack([vectors, vector])[:, best]
    values = np.einsum("ij,ij->j", vectors, matrix @ vectors)
    ascending = np.argsort(values)
    result = np.zeros((len(laplacian.points), count))
    result[order] = root[:, None] * vectors[:, ascending]
    return np.maximum(values[ascending], 0.0), result


def project(vectors, y):
    """Take the orthonormal vectors out of y."""
    return y - vectors @ (vectors.T @ y)


def correct_eigenvalues(laplacian, values, vectors):
    """Recover k^2 from ``lambda = s(k h) / h^2`` mode by mode, with the h^2 that the mode sees on average.

    A mode's own mean, ``sum areas h^2 phi^2``, is the one by which a slowly varying h enters the eigenvalue to first
    order of h^2.

    Raises
    ------
    UnresolvedModesError
        Some modes lie beyond the resolved range.
    """
    squared = (laplacian.areas * laplacian.kernel_widths**2) @ vectors**2
    corrected = inverse_symbol(values * squared) ** 2 / squared
    if not np.isfinite(corrected).all():
        resolved = int(np.argmin(np.isfinite(corrected)))
        raise UnresolvedModesError(
            f"The {len(values)} modes asked for vary faster than the smoothing length resolves: {resolved} are"
            f" resolved on {len(laplacian.areas)} points. Ask for at most {resolved}, or lower the number of"
            " neighbors.",
            resolved=resolved,
        )
    return corrected
