"""Eigenpairs of the operator, eq. (12) of the paper."""

from dataclasses import dataclass, field

import numpy as np
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from .errors import SolverError, TooFewPointsError, UnresolvedModesError
from .kernel import inverse_symbol


@dataclass(frozen=True)
class Spectrum:
    """The lowest eigenpairs of the negated operator.

    Attributes
    ----------
    eigenvalues : ndarray, (count,)
        Ascending, non-negative [1 / L^2].
    eigenvectors : ndarray, (n, count)
        Orthonormal for the areas: ``phi.T @ (areas * phi)`` is the identity. The entry of largest size is positive.
    notices : list of str
        What a user should know.
    """

    eigenvalues: np.ndarray
    eigenvectors: np.ndarray
    notices: list = field(default_factory=list)


def solve_spectrum(laplacian, count, raw, progress=None):
    """Compute eigenpairs; see `LaplaceBeltrami.eigenpairs`."""
    areas = laplacian.areas
    n = len(areas)
    if int(count) != count or count < 1:
        raise TooFewPointsError(f"{count!r} modes were asked for. Ask for a whole number of at least 1.")
    if count > n // 3:
        raise TooFewPointsError(f"{count} modes were asked for, but {n} points carry at most {n // 3}. Ask for fewer.")
    root = 1.0 / np.sqrt(areas)
    products = 0

    def product(y):
        nonlocal products
        if progress is not None and products % 20 == 0:
            progress("Spectrum", products / (products + 500.0))  # the number of products is not known beforehand
        products += 1
        return root * (laplacian.stiffness @ (root * y.ravel()))

    start = np.random.default_rng(0).standard_normal(n)
    try:
        values, vectors = eigsh(
            LinearOperator((n, n), matvec=product, dtype=np.float64),
            k=count,
            which="SA",
            v0=start,
            ncv=min(n, max(2 * count + 1, 40)),
            tol=1e-8,
        )
    except ArpackNoConvergence as error:
        raise SolverError(
            f"The eigenvalue solver found {len(error.eigenvalues)} of {count} modes on {n} points. Ask for fewer modes."
        ) from error
    order = np.argsort(values)
    values = np.maximum(values[order], 0.0)
    vectors = root[:, None] * vectors[:, order]
    largest = np.argmax(np.abs(vectors), axis=0)
    vectors *= np.sign(vectors[largest, np.arange(count)])
    if not raw:
        values = correct_eigenvalues(laplacian, values, vectors)
    return Spectrum(values, vectors)


def correct_eigenvalues(laplacian, values, vectors):
    """Recover k^2 from ``lambda = s(k h) / h^2`` mode by mode, with the h^2 that the mode sees on average.

    A mode's own mean, ``sum areas h^2 phi^2``, is the one by which a slowly varying h enters the eigenvalue to first
    order of h^2.

    Raises
    ------
    UnresolvedModesError
        Some modes lie beyond the resolved range.
    """
    squared = (laplacian.areas * laplacian.smoothing_lengths**2) @ vectors**2
    corrected = inverse_symbol(values * squared) ** 2 / squared
    if not np.isfinite(corrected).all():
        resolved = int(np.argmin(np.isfinite(corrected)))
        raise UnresolvedModesError(
            f"The {len(values)} modes asked for vary faster than the smoothing length resolves: {resolved} are resolved"
            f" on {len(laplacian.areas)} points. Ask for at most {resolved}, or lower the number of neighbors."
        )
    return corrected
