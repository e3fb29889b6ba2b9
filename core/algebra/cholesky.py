"""Factors of sparse symmetric equations: Cholesky's, in dense fronts along a dissection."""

from collections.abc import Callable, Iterable
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.linalg.lapack import dpotrf, dtrtri

from ..errors import SolverError
from ..types import Floats, Ints
from .blocks import shares
from .dense import multiply

_BANDS = 6  # of columns by which a lower triangle is added: less work than the whole square
_WIDEST = 512  # unknowns that are eliminated at once, so that no step takes long


def factorize(
    matrix: sparse.sparray, starts: Ints, report: Callable[[float], None] = lambda fraction: None
) -> Callable[[Floats], Floats]:
    """Factorise a sparse symmetric positive definite matrix.

    Parameters
    ----------
    matrix : sparse array, (m, m)
        Its unknowns in the order that `dissect` gives, or factors become large.
    starts : ndarray, (k,) int
        The first unknown of each part, as `dissect` gives them.
    report : callable
        Called with the share that is done after each part, which takes a fraction of a second; may raise `Cancelled`.

    Returns
    -------
    callable
        Solves for a right-hand side, (m,) or (m, k).

    Raises
    ------
    SolverError
        The matrix is not positive definite: no point of some component is fixed.

    Notes
    -----
    The multifrontal method (Duff and Reid 1983): the unknowns of a part are eliminated in a dense matrix of themselves
    and of all later ones that they are coupled with, its front, and the Schur complement is added to the front of the
    next part. Nearly all of the work is done by dense products, in half of the time that SuperLU takes for factors of
    both sides, and in less than half of the memory.
    """
    count = matrix.shape[0]
    bounds = _bounds(starts, count)
    lower = sparse.tril(matrix, format="csc")
    report(0.0)
    coupled, parent = _coupled(lower, bounds)
    report(0.0)
    widths, sizes = np.diff(bounds)[:, 0], np.array([len(rows) for rows in coupled])
    work = widths * (widths + sizes) ** 2.0
    done = np.cumsum(work) / work.sum()
    place = np.empty(count, dtype=np.intp)  # of unknowns in the front
    children: list[list[tuple[Ints, Floats]]] = [[] for _ in bounds]
    factors = Factors(count)
    for number, ((start, end), rows) in enumerate(zip(bounds, coupled, strict=True)):
        width = end - start
        place[start:end], place[rows] = np.arange(width), np.arange(width, width + len(rows))
        front = np.zeros((width + len(rows),) * 2, order="F")
        entries = slice(lower.indptr[start], lower.indptr[end])
        column = np.repeat(np.arange(width), np.diff(lower.indptr[start : end + 1]))
        front[place[lower.indices[entries]], column] = lower.data[entries]
        for unknowns, left in children[number]:
            _add(front, place[unknowns], left)
        children[number].clear()
        own, info = dpotrf(front[:width, :width], lower=1, clean=1)
        if info:
            raise SolverError(
                f"The equations of {count} points have no single solution. Fix some points on every component."
            )
        inverse = dtrtri(own, lower=1)[0]
        below = multiply(front[width:, :width], inverse.T)
        factors.append(start, end, rows, inverse, below)
        if len(rows):
            left = front[width:, width:]
            left -= multiply(below, below.T)
            children[parent[number]].append((rows, left))
        report(done[number])
    return factors.solve


def _bounds(starts: Iterable[int], count: int) -> list[tuple[int, int]]:
    """Return the first unknown of each part and the one after its last, of parts that are not too wide."""
    cuts = [
        np.linspace(start, end, (end - start - 1) // _WIDEST + 2).astype(int)[:-1]
        for start, end in pairwise([*starts, count])
    ]
    return list(pairwise([*np.concatenate(cuts).tolist(), count]))


def _coupled(lower: sparse.csc_array, bounds: list[tuple[int, int]]) -> tuple[list[Ints], Ints]:
    """Return which later unknowns each part is coupled with once those before are eliminated, and its next part."""
    part = np.repeat(np.arange(len(bounds)), [end - start for start, end in bounds])
    found: list[list[Ints]] = [[] for _ in bounds]
    parent = np.full(len(bounds), -1)
    result = []
    for number, (start, end) in enumerate(bounds):
        rows = np.unique(np.concatenate([lower.indices[lower.indptr[start] : lower.indptr[end]], *found[number]]))
        rows = rows[np.searchsorted(rows, end) :]
        found[number].clear()
        result.append(rows)
        if len(rows):
            parent[number] = part[rows[0]]
            found[parent[number]].append(rows)
    return result, parent


def _add(front: Floats, place: Ints, left: Floats) -> None:
    """Scatter the lower triangle of an earlier front's Schur complement to its places in this one, which ascend."""
    if place[-1] - place[0] == len(place) - 1:
        front[place[0] : place[-1] + 1, place[0] : place[-1] + 1] += left
        return
    for columns in shares(len(place), min(len(place), _BANDS)):
        rows = slice(columns.start, None)
        front.T[place[columns, None], place[rows]] += left.T[columns, rows]  # along memory


class Factors:
    """The inverse of the lower factor of a matrix of so many unknowns, as a product over dense parts."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._parts: list[tuple[int, int, Ints, Floats]] = []

    def append(self, start: int, end: int, rows: Ints, inverse: Floats, below: Floats) -> None:
        """Add the next part: its unknowns from start to end, the later rows, the inverse factor, and that below it."""
        self._parts.append((start, end, rows, np.concatenate([inverse, -multiply(below, inverse)])))

    def solve(self, right: Floats) -> Floats:
        """Solve for a right-hand side, (m,) or (m, k)."""
        values = np.array(np.reshape(right, (self._count, -1)).T, dtype=np.float64, order="C")
        for start, end, rows, part in self._parts:
            found = multiply(values[:, start:end], part.T)
            values[:, start:end] = found[:, : end - start]
            values[:, rows] += found[:, end - start :]
        for start, end, rows, part in reversed(self._parts):
            values[:, start:end] = multiply(np.concatenate([values[:, start:end], values[:, rows]], axis=1), part)
        return values.T.reshape(np.shape(right))
