"""Eigenpairs of the operator, eq. (12) of the paper."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import ArpackNoConvergence
from scipy.spatial import cKDTree

from ..algebra import Rows, blocks, coarse_to_fine, lift_lowest, matrix_by_rows, needs_double, on_all_cores, workers
from ..arguments import whole
from ..errors import SolverError, TooFewPointsError, UnresolvedModesError
from ..frozen import Frozen
from ..geometry import order_of
from ..kernel import inverse_ratio, symbol
from ..memory import check_mode_memory
from ..types import Floats, Ints, Progress, Report

TOLERANCE = 2e-7  # eigenvalues are then right to ten digits and more: their errors are quadratic in the residual

_FEW = 0.02  # modes over points up to which multigrid is faster than Lanczos: of scans and of random points
_ALIKE = 1e-4  # relative difference up to which entries count as of one size, as on a symmetric shape
_BLOCK = 1 << 13  # rows of vectors at one time
_FLAT = 4.0  # k h beyond which the symbol is nearly constant


@dataclass(frozen=True)
class Spectrum(Frozen):
    """The lowest eigenpairs of the negated operator.

    Attributes
    ----------
    eigenvalues : ndarray, (count,)
        Ascending, non-negative [1 / L^2].
    eigenvectors : ndarray, (n, count)
        Orthonormal for the areas: ``phi.T @ (areas * phi)`` is the identity. The first of the entries of
        largest size is positive.
    residuals : ndarray, (count,), or None
        ``|A y - lambda y|`` of the raw pairs, y of length one, over the last eigenvalue, or over what Weyl's law makes
        of it, ``4 pi count / area``, where that is more.
    """

    eigenvalues: Floats
    eigenvectors: Floats
    residuals: Floats | None = None

    def lowest(self, count: int) -> "Spectrum":
        """Return the lowest of them alone."""
        if count >= len(self.eigenvalues):
            return self
        residuals = None if self.residuals is None else self.residuals[:count]
        return Spectrum(self.eigenvalues[:count], self.eigenvectors[:, :count], residuals)


def check_count(count: int, points: int) -> None:
    """Refuse a number of modes that a number of points does not carry."""
    if not whole(count) >= 1:
        raise TooFewPointsError(f"{count!r} modes were asked for. Ask for a whole number of at least 1.")
    if count > points // 3:
        raise TooFewPointsError(
            f"{count} modes were asked for, but {points} points carry at most {points // 3}. Ask for fewer."
        )


def solve_spectrum(
    stiffness: sparse.csr_array,
    points: Floats,
    areas: Floats,
    component: Ints,
    lengths: Floats,
    count: int,
    tolerance: float = TOLERANCE,
    progress: Progress | None = None,
) -> Spectrum:
    """Compute raw eigenpairs; see `LaplaceBeltrami.eigenpairs`."""
    n = len(areas)
    check_mode_memory(n, int(count))
    count, done = int(count), 0.0

    def report(fraction: float = 0.0) -> None:
        nonlocal done
        done = max(done, fraction)
        if progress is not None:
            progress("Spectrum", done)

    report()
    order, root, matrix = symmetric_form(stiffness, points, areas, component, report)
    # Scaled by a power of two to eigenvalues near one: solvers take those below an absolute threshold for zero.
    highest = matrix.diagonal().max()
    unit = np.ldexp(1.0, np.frexp(highest)[1])
    matrix.data /= unit
    weyl = 4.0 * np.pi * count / areas.sum() / unit
    few = count <= _FEW * len(order)
    if few and needs_double(highest / unit, weyl):
        check_mode_memory(n, count, double=True)
    pairs = coarse_to_fine(matrix, 1.0 / root, count, tolerance, weyl, report) if few else None
    try:
        values, vectors = pairs or lift_lowest(matrix, count, _cut(areas, lengths, count) / unit, report)
    except ArpackNoConvergence as error:
        raise SolverError(
            f"The eigenvalue solver found {len(error.eigenvalues)} of {count} modes on {n} points. Ask for fewer modes."
        ) from error
    report()
    residuals = _missed(matrix, values, vectors) / max(values[-1], weyl)
    if not residuals.max() <= tolerance:
        raise SolverError(
            f"The eigenvalue solver found {np.sum(residuals <= tolerance)} of {count} modes on {n} points to a residual"
            f" of {tolerance:g}. Ask for fewer modes, or raise the tolerance."
        )
    result, parts = np.zeros((n, count)), blocks(len(order), _BLOCK)

    def largest(rows: slice) -> Floats:
        vectors[rows] *= root[rows, None]
        return np.abs(vectors[rows]).max(axis=0)

    # Signs by the first of the largest entries: among equals, on a symmetric shape, rounding must not choose.
    least = (1.0 - _ALIKE) * np.max(on_all_cores(largest, parts), axis=0)

    def first_large(rows: slice) -> Floats:
        large = np.abs(vectors[rows]) >= least
        return np.sign(vectors[rows][large.argmax(axis=0), np.arange(count)]) * large.any(axis=0)

    signs = np.array(on_all_cores(first_large, parts))
    sign = signs[(signs != 0.0).argmax(axis=0), np.arange(count)]

    def put(rows: slice) -> None:
        result[order[rows]] = vectors[rows] * sign

    on_all_cores(put, parts)
    return Spectrum(unit * np.maximum(values, 0.0), result, residuals)


def _missed(matrix: sparse.csr_array, values: Floats, vectors: Floats) -> Floats:
    """Return the lengths of ``matrix @ vectors - vectors * values``, (count,)."""

    def subtract(rows: slice, image: Floats) -> None:
        image -= vectors[rows] * values

    with workers() as pool:
        missed = Rows(matrix, pool, lambda: None).product(vectors, subtract)
    return np.sqrt(np.einsum("ij,ij->j", missed, missed))


def _cut(areas: Floats, lengths: Floats, count: int) -> float:
    """Return the raw eigenvalue for twice Weyl's estimate 4 pi count / area of the highest one wanted."""
    squared = np.mean(lengths**2)
    frequency = 8.0 * np.pi * count / areas.sum() * squared
    return float(symbol(np.sqrt(min(frequency, _FLAT**2))) / squared)


def symmetric_form(
    stiffness: sparse.csr_array, points: Floats, areas: Floats, component: Ints, report: Report = lambda: None
) -> tuple[Ints, Floats, sparse.csr_array]:
    """Return a matrix with the eigenvalues of the negated operator whose eigenvectors are orthonormal.

    Parameters
    ----------
    stiffness : csr_array, (n, n)
        That of the operator, or of Dirichlet's problem.
    points, areas, component : ndarray
        Of the operator.
    report : callable
        Called without arguments between the steps; may raise `Cancelled`.

    Returns
    -------
    order : ndarray, (m,) int
        The points that are not left out, neighbors near in memory, which makes the products faster; the same points
        in whatever order they were given.
    root : ndarray, (m,)
        ``root * y`` is the function on these points that the vector y stands for.
    matrix : csr_array, (m, m)
        Symmetric positive semi-definite [1 / L^2].
    """
    known = np.flatnonzero(component >= 0)
    known = known[order_of(points[known])]
    order = known[cKDTree(points[known]).indices]
    root = 1.0 / np.sqrt(areas[order])
    report()
    place = np.zeros(stiffness.shape[0], dtype=stiffness.indices.dtype)
    place[order] = np.arange(len(order))

    def arrange(rows: slice) -> sparse.csr_array:
        part = stiffness[order[rows]]
        part.indices, part.has_sorted_indices = place[part.indices], False
        part.sort_indices()  # and so the sums of products
        part.data *= np.repeat(root[rows], np.diff(part.indptr)) * root[part.indices]
        return part

    return order, root, matrix_by_rows(arrange, np.diff(stiffness.indptr)[order], len(order), report)


def correct_eigenvalues(areas: Floats, widths: Floats, values: Floats, vectors: Floats) -> Floats:
    """Recover k^2 from ``lambda = s(k h) / h^2`` mode by mode, with the h^2 that the mode sees on average.

    A mode's own mean, ``sum areas h^2 phi^2``, is the one by which a slowly varying h enters the eigenvalue to first
    order of h^2. Modes beyond the resolved range raise `UnresolvedModesError`.
    """
    squared = (areas * widths**2) @ vectors**2
    corrected = values * inverse_ratio(values * squared)
    if not np.isfinite(corrected).all():
        resolved = int(np.argmin(np.isfinite(corrected)))
        raise UnresolvedModesError(
            f"The {len(values)} modes asked for vary faster than the smoothing length resolves: {resolved} are"
            f" resolved on {len(areas)} points. Ask for at most {resolved}, or make the"
            " kernel narrower.",
            resolved=resolved,
        )
    return corrected
