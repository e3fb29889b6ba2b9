"""Fewer points of a cloud that comes in pieces and may be larger than the memory: blue noise again, in one pass."""

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

import numpy as np

from ..arguments import as_doubles, check_array, check_finite, whole
from ..errors import InvalidPointsError
from ..geometry import FINEST, blue_noise_subset, mix_bits
from ..types import Array, Floats, Ints, Report

Piece: TypeAlias = tuple[Floats, dict[str, Array]]

_CANDIDATES = 8  # for each point wanted at most: cells twice as wide are an eighth as many at least, hence enough
_WAITING = 4  # further ones that come before the cells are looked at again, so that each is sorted a few times only
_ADVICE = "Give pairs of coordinates, x, y, z for each point, and a dict of other numbers of each."
_HALVES = 22  # of the extent, from which on there are 8 cells


def thin_pieces(pieces: Iterable[Piece], count: int, *, progress: Report | None = None) -> list[Piece]:
    """Choose points of a cloud in pieces, evenly spread over the surface: blue noise, none close to another.

    Of each cell of a grid one point is a candidate, and of these a `blue_noise_subset` is chosen. The cells are as fine
    as lets eight candidates for each point wanted; they double as the cloud grows, and nest, so that neither the cut
    into pieces nor their order makes a difference. Memory is that of the candidates, of half as many more points that
    wait, and of a piece.

    Parameters
    ----------
    pieces : iterable of (array_like, dict of str to ndarray)
        Coordinates, (k, 3) [L], and other numbers by name, (k,) or (k, m), as of `mf.files.chunks`.
    count : int
        How many points to choose at most.
    progress : callable, optional
        Called without arguments now and then; may raise `Cancelled`.

    Returns
    -------
    list of (ndarray, dict of str to ndarray)
        The chosen points of each piece that has some. As many as `blue_noise_subset` chooses; all points, copies
        included, where there are no more than the count.

    Raises
    ------
    InvalidPointsError
        Pieces of another form, coordinates that are not finite, or a count below 1.

    See Also
    --------
    thin_out : Of points in memory, to a spacing or a number, edges first.

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> pieces = [(piece, {}) for piece in np.split(points, [300])]
    >>> few = mf.clean.thin_pieces(pieces, 100)
    >>> print(90 <= sum(len(chosen) for chosen, numbers in few) <= 100)
    True
    """
    report = progress or (lambda: None)
    if not whole(count) >= 1:
        raise InvalidPointsError(f"A choice of {count!r} points was asked for. Ask for a whole number of at least 1.")
    kept: list[Piece] = []
    grid = _Grid(_CANDIDATES * count, report)
    for points, numbers in _checked(pieces):
        report()
        if not len(points):
            continue
        grid.extend(points)
        kept += [(points, numbers)] if grid.power is None else _taken([(points, numbers)], grid.choose(points))
        if _size(kept) > (_CANDIDATES + _WAITING) * count:
            kept = _taken(kept, grid.coarsen(_all_points(kept)))
    if grid.power is not None or _size(kept) > _CANDIDATES * count:
        kept = _taken(kept, grid.coarsen(_all_points(kept)))
    if _size(kept) <= count:
        return kept
    return _taken(kept, blue_noise_subset(_all_points(kept), count, progress=report))


def _checked(pieces: Iterable[Piece]) -> Iterator[Piece]:
    """Yield the pieces with their points in double precision; refuse what is none."""
    if not isinstance(pieces, Iterable) or isinstance(pieces, np.ndarray):
        raise InvalidPointsError(f"Pieces are of type {type(pieces).__name__}. {_ADVICE}")
    for piece in pieces:
        if not (isinstance(piece, tuple) and len(piece) == 2 and isinstance(piece[1], dict)):
            raise InvalidPointsError(f"A piece is of type {type(piece).__name__}. {_ADVICE}")
        points = as_doubles(check_array(piece[0], "Points of a piece", [(None, 3)], _ADVICE), copy=False)
        check_finite(points, "points of a piece", "Leave these out.")
        yield (
            points,
            {
                str(name): check_array(
                    values, f"Numbers {name!r}", [(len(points),), (len(points), None)], _ADVICE, "biufc"
                )
                for name, values in piece[1].items()
            },
        )


def _size(pieces: Sequence[Piece]) -> int:
    return sum(len(points) for points, _ in pieces)


def _all_points(pieces: Sequence[Piece]) -> Floats:
    return np.concatenate([points for points, _ in pieces])


def _taken(pieces: Sequence[Piece], chosen: Ints) -> list[Piece]:
    """Return the chosen points of pieces, by their numbers in all of them, ascending."""
    if not pieces:
        return []
    ends = np.cumsum([len(points) for points, _ in pieces])
    parts = np.split(chosen, np.searchsorted(chosen, ends[:-1]))
    result = []
    for (points, numbers), rows, end in zip(pieces, parts, ends, strict=True):
        if len(rows):
            rows = rows - (end - len(points))
            result.append((points[rows], {name: values[rows] for name, values in numbers.items()}))
    return result


class _Grid:
    """Cells whose edges are a power of two, the finest of which no more than some number have points.

    The power is None before `coarsen`. `report` is called at each trial.
    """

    def __init__(self, most: int, report: Report) -> None:
        self._most, self._report = most, report
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)
        self.power: int | None = None

    def extend(self, points: Floats) -> None:
        """Extend the box of all points; cells become coarser where their numbers would not fit an integer."""
        self._low = np.minimum(self._low, points.min(axis=0))
        self._high = np.maximum(self._high, points.max(axis=0))
        if self.power is not None:
            self.power = max(self.power, self._finest())

    def _finest(self) -> int:
        extent = np.max(self._high - self._low)
        digit = np.spacing(np.maximum(np.abs(self._low), np.abs(self._high)).max())  # nothing is finer
        return int(np.ceil(np.log2(max(extent / (FINEST - 1), digit))))

    def coarsen(self, points: Floats) -> Ints:
        """Choose the finest cells of which few enough have points, and return a point of each as `choose` does."""
        if self.power is None:
            finest = self._finest()
            self.power = finest + bisect_left(range(_HALVES), True, key=lambda step: self._fits(points, finest + step))
        while not self._fits(points, self.power):
            self.power += 1
        return self.choose(points)

    def _fits(self, points: Floats, power: int) -> bool:
        self._report()
        return len(np.unique(self._keys(points, power))) <= self._most

    def choose(self, points: Floats) -> Ints:
        """Return a point of each cell, (k,) int ascending: the first in an order that follows from the places alone."""
        keys = self._keys(points, self.power or 0)
        chance = np.zeros(len(points), np.uint64)
        for bits in np.ascontiguousarray(points.T + 0.0).view(np.uint64):  # zero has no sign then
            chance = mix_bits(chance ^ bits)
        order = np.lexsort((chance, keys))
        return np.sort(order[np.diff(keys[order], prepend=-1) > 0])

    def _keys(self, points: Floats, power: int) -> Ints:
        """Return the numbers of the cells of points, (n,) int."""
        edge = 2.0**power
        first, keys = np.floor(self._low / edge), np.zeros(len(points), dtype=np.int64)
        for axis in range(3):
            keys <<= 21
            keys += (np.floor(points[:, axis] / edge) - first[axis]).astype(np.int64)
        return keys
