"""Factors of sparse symmetric equations: Cholesky's, in dense fronts along a dissection."""

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from threading import Lock
from typing import Any, cast

import numpy as np
from scipy import sparse

from ..errors import SolverError
from ..types import Floats, Ints
from .blocks import blocks, on_all_cores, workers
from .dense import invert_factor, multiply, subtract

_BRANCH = 1.0 / 16.0  # of the work: the most that one core does alone, without a word of how far it is
_COLUMNS = 1 << 8  # of a front that are computed at one time
_WIDEST = 512  # unknowns that are eliminated at once, so that no step takes long

_Each = Callable[[Callable[[slice], None], Sequence[slice]], object]  # calls a function with each of some slices


def factorize(
    matrix: sparse.csr_array, starts: Ints, report: Callable[[float], None] = lambda fraction: None
) -> Callable[[Floats], Floats]:
    """Factorise a sparse symmetric positive definite matrix, on all cores.

    Parameters
    ----------
    matrix : csr_array, (m, m)
        Its unknowns in the order that `dissect` gives, or factors become large.
    starts : ndarray, (k,) int
        The first unknown of each part, as `dissect` gives them.
    report : callable
        Called with the share that is done, after some parts; may raise `Cancelled`.

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
    both sides, and in less than half of the memory. Branches of the tree of parts that do not need each other are
    eliminated at the same time, each by one core; then one part of the trunk after the other, each by all cores.
    """
    count = matrix.shape[0]
    bounds = _bounds(starts, count)
    report(0.0)
    coupled, parent = _coupled(matrix, bounds)
    report(0.0)
    widths, sizes = np.diff(bounds)[:, 0], np.array([len(rows) for rows in coupled])
    work = widths * (widths + sizes) ** 2.0
    branches, trunk = _divide(parent, work)
    fronts = _Fronts(matrix, bounds, coupled, parent)

    def eliminate(branch: Ints) -> None:
        for number in branch:
            fronts.eliminate(number, _in_turn)

    def tell() -> None:
        report(float(work @ [part is not None for part in fronts.parts] / work.sum()))

    with workers():
        on_all_cores(eliminate, branches, tell)
        for number in trunk:
            fronts.eliminate(number, on_all_cores)
            tell()
    return Factors(count, [(*ends, *rest) for ends, *rest in zip(bounds, coupled, fronts.parts, strict=True)]).solve


def _in_turn(function: Callable[[slice], None], slices: Sequence[slice]) -> None:
    for part in slices:
        function(part)


class _Fronts:
    """The dense matrices in which parts are eliminated; of what is symmetric, the upper triangle counts."""

    def __init__(
        self, matrix: sparse.csr_array, bounds: list[tuple[int, int]], coupled: list[Ints], parent: Ints
    ) -> None:
        self._matrix, self._bounds, self._coupled = matrix, bounds, coupled
        self._children: list[list[int]] = [[] for _ in bounds]
        for number in np.flatnonzero(parent >= 0):
            self._children[parent[number]].append(int(number))
        self._left: dict[int, Floats] = {}  # by parts whose next one is to come: their Schur complements
        self._space = _Space()
        self.parts: list[Any] = [None] * len(bounds)  # of `Factors`, once they are eliminated

    def eliminate(self, number: int, each: _Each) -> None:
        """Eliminate the unknowns of a part, those before which are eliminated."""
        (start, end), rows, matrix = self._bounds[number], self._coupled[number], self._matrix
        width, unknowns = end - start, np.append(np.arange(start, end), rows)
        part, left = np.zeros((width, len(unknowns))), self._space.take(len(rows), len(rows) + 1)
        left.fill(0.0)  # the last column stays so
        entries = slice(matrix.indptr[start], matrix.indptr[end])
        row, column = np.repeat(np.arange(width), np.diff(matrix.indptr[start : end + 1])), matrix.indices[entries]
        later = column >= start
        part[row[later], np.searchsorted(unknowns, column[later])] = matrix.data[entries][later]
        for child in self._children[number]:
            given = self._left.pop(child)
            _add(part, left, given, np.searchsorted(unknowns, self._coupled[child]), each)
            self._space.give(given)
        if not invert_factor(part[:, :width]):
            raise SolverError(
                f"The equations of {matrix.shape[0]} points have no single solution. Fix some points on every"
                " component."
            )
        inverse, across, below = part[:, :width], part[:, width:], self._space.take(width, len(rows))

        def divide(columns: slice) -> None:
            below[:, columns] = multiply(inverse.T, across[:, columns])
            across[:, columns] = -multiply(inverse, below[:, columns])

        def reduce(columns: slice) -> None:
            subtract(left[columns, columns.start : -1], below[:, columns].T, below[:, columns.start :])

        columns = blocks(len(rows), _COLUMNS)
        each(divide, columns)
        each(reduce, columns)
        self._space.give(below)
        self._left[number], self.parts[number] = left, part


class _Space:
    """Memory that is used again: the system clears the pages of each new array, which takes as long as to fill it."""

    def __init__(self) -> None:
        self._free, self._lock = list[Floats](), Lock()

    def take(self, rows: int, columns: int) -> Floats:
        """Return an array of any values, of the smallest memory that is free and holds it."""
        size = rows * columns
        with self._lock:
            self._free.sort(key=len)
            fitting = [place for place, memory in enumerate(self._free) if len(memory) >= size]
            known = self._free.pop(fitting[0] if fitting else -1) if self._free else np.empty(0)
        memory = known if len(known) >= size else np.empty(size)  # the largest is given up for a larger one
        return memory[:size].reshape(rows, columns)

    def give(self, array: Floats) -> None:
        """Take the memory of an array back."""
        with self._lock:
            self._free.append(cast(Floats, array.base))


def _add(part: Floats, left: Floats, given: Floats, places: Ints, each: _Each) -> None:
    """Add what a part has left, whose last column is zero, to its places in a front, which ascend."""
    width, count = part.shape
    source = np.full(count, len(places))  # of each column of the front: the zero, or one of those that are given
    source[places] = np.arange(len(places))
    cuts = np.flatnonzero((np.diff(places) != 1) | (places[1:] == width)) + 1

    def add(rows: slice) -> None:
        first, last = places[rows.start], places[rows.stop - 1] + 1
        found = given[rows].take(source[first:], axis=1)
        if first < width:
            part[first:last, first:] += found
        else:
            left[first - width : last - width, first - width : -1] += found

    each(add, [slice(*ends) for ends in pairwise([0, *cuts, len(places)])])


def _divide(parent: Ints, work: Floats) -> tuple[list[Ints], Ints]:
    """Divide the parts into branches that do not need each other, each of a small share of the work, and the trunk."""
    whole = work.copy()  # with that of the parts before
    for number in np.flatnonzero(parent >= 0):
        whole[parent[number]] += whole[number]
    small, last = whole <= _BRANCH * work.sum(), np.arange(len(parent))
    for number in np.flatnonzero(small & (parent >= 0))[::-1]:
        if small[parent[number]]:
            last[number] = last[parent[number]]
    order = np.flatnonzero(small)
    order = order[np.argsort(last[order], kind="stable")]
    return np.split(order, np.flatnonzero(np.diff(last[order])) + 1), np.flatnonzero(~small)


def _bounds(starts: Iterable[int], count: int) -> list[tuple[int, int]]:
    """Return the first unknown of each part and the one after its last, of parts that are not too wide."""
    cuts = [
        np.linspace(start, end, (end - start - 1) // _WIDEST + 2).astype(int)[:-1]
        for start, end in pairwise([*starts, count])
    ]
    return list(pairwise([*np.concatenate(cuts).tolist(), count]))


def _coupled(matrix: sparse.csr_array, bounds: list[tuple[int, int]]) -> tuple[list[Ints], Ints]:
    """Return which later unknowns each part is coupled with once those before are eliminated, and its next part."""
    part = np.repeat(np.arange(len(bounds)), [end - start for start, end in bounds])
    found: list[list[Ints]] = [[] for _ in bounds]
    parent = np.full(len(bounds), -1)
    result = []
    for number, (start, end) in enumerate(bounds):
        rows = np.unique(np.concatenate([matrix.indices[matrix.indptr[start] : matrix.indptr[end]], *found[number]]))
        rows = rows[np.searchsorted(rows, end) :]
        found[number].clear()
        result.append(rows)
        if len(rows):
            parent[number] = part[rows[0]]
            found[parent[number]].append(rows)
    return result, parent


class Factors:
    """The inverse of the upper factor of a matrix of so many unknowns, as a product over dense parts.

    Each has its unknowns from start to end, the later ones that these are coupled with, and a matrix.
    """

    def __init__(self, count: int, parts: list[tuple[int, int, Ints, Floats]]) -> None:
        self._count, self._parts = count, parts

    def solve(self, right: Floats) -> Floats:
        """Solve for a right-hand side, (m,) or (m, k)."""
        values = np.array(np.reshape(right, (self._count, -1)).T, dtype=np.float64, order="C")
        for start, end, rows, part in self._parts:
            found = multiply(values[:, start:end], part)
            values[:, start:end] = found[:, : end - start]
            values[:, rows] += found[:, end - start :]
        for start, end, rows, part in reversed(self._parts):
            values[:, start:end] = multiply(np.concatenate([values[:, start:end], values[:, rows]], axis=1), part.T)
        return values.T.reshape(np.shape(right))
