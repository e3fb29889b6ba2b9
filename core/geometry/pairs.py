"""The neighbor pairs inside the kernel's support."""

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self, TypeAlias

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..algebra import blocks, on_all_cores
from ..cores import cores
from ..kernel import SUPPORT
from ..types import Array, Bools, Floats, Ints, Report
from .nearest import Nearest
from .patches import Patch, divide_pairs

Ends: TypeAlias = Sequence[Sequence[Floats]] | Floats  # quantities of pairs at their first and second points

_BLOCK = 1 << 19  # neighbor candidates that a core looks at at one time while the pairs are collected
_NEAR = 1 << 13  # points whose known neighbors are looked at at one time
_GROUPS = 4  # groups of points by their number of candidates, for each doubling of it


@dataclass(frozen=True)
class Pairs:
    """Points and all pairs nearer than 3 h_ij, each once."""

    points: Floats  # (m, 3), in scaled coordinates; components stand far apart
    lengths: Floats  # (m,), smoothing lengths h; h_ij is the mean of both ends
    # (pairs,) int32, the two points of each pair, ordered by the first
    first: Ints
    second: Ints
    distance: Floats  # (pairs,), their distance in space

    def keep(self, kept: Bools) -> Self:
        """Return the same points with some of the pairs, (pairs,) bool."""
        return replace(self, first=self.first[kept], second=self.second[kept], distance=self.distance[kept])

    def mean(self, values: Floats) -> Floats:
        """Return the mean of a point quantity over both ends of every pair."""
        return 0.5 * (values[self.first] + values[self.second])

    def half(self, values: Floats) -> sparse.csr_array:
        """Return a pair quantity as the (m, m) CSR matrix U that holds each pair once; the whole is U + U.T."""
        return sparse.csr_array((values, self.second, self.start), shape=(len(self.points),) * 2)

    def over_ends(self, values: Callable[[Patch], Ends], count: int, report: Report = lambda: None) -> Floats:
        """Return the sums over the pairs of each point of their quantities at that end, (count, m).

        `values` returns of a patch the quantities, (pairs,) each, that its pairs have at their first points, and as
        many that they have at their second points. `report` is called after each patch; it may raise `Cancelled`.
        """

        def sums(patch: Patch) -> tuple[Floats, Floats]:
            first, second = values(patch)
            return patch.over_first(*first), patch.over_second(*second)

        total = np.zeros((count, len(self.points)))
        for patch, (first, second) in zip(self.patches, on_all_cores(sums, self.patches, report), strict=True):
            for row, own, other in zip(total, first, second, strict=True):  # both axes at once take three times as long
                row[patch.rows] += own
                row[patch.columns] += other
        return total

    @functools.cached_property
    def patches(self) -> list[Patch]:
        """The pairs by blocks that fit the cache: a list of `Patch`."""
        return divide_pairs(self.start, self.second)

    @functools.cached_property
    def start(self) -> Ints:
        """Where the pairs of each first point start, (m + 1,)."""
        start: Ints = np.zeros(len(self.points) + 1, dtype=np.int32 if len(self.first) < 2**31 else np.int64)
        np.cumsum(np.bincount(self.first, minlength=len(self.points)), out=start[1:])
        return start


def find_pairs(
    tree: cKDTree, lengths: Floats, report: Report = lambda: None, nearest: Nearest | None = None
) -> list[Array]:
    """Find all pairs nearer than 3 h_ij, with h_ij = (h_i + h_j) / 2, for smoothing lengths h, (n,).

    Return their first and second points, (pairs,) int32, each pair once and ordered by the first, and their distances.
    Points are distinct. Where their nearest ones reach further than the kernel, no others are searched for. `report` is
    called before each block of points; it may raise `Cancelled`.
    """
    radii = SUPPORT * lengths
    many, found = np.zeros(tree.n, dtype=np.int64), []

    def keep(rows: Ints, distance: Floats, column: Ints) -> None:
        reach, other = radii[rows, None], radii[column]
        # Each pair is stored at the end with the larger radius, whose search always finds it.
        kept = (reach > other) | ((reach == other) & (rows[:, None] < column))
        kept &= distance <= 0.5 * (reach + other)
        many[rows] = np.count_nonzero(kept, axis=1)
        found.append((rows, column[kept].astype(np.int32), distance[kept]))

    open_ = np.arange(tree.n)
    if nearest is not None:
        known = (radii < nearest.distance[:, -1]) & ~nearest.in_row
        open_ = np.flatnonzero(~known)
        rows = np.flatnonzero(known)
        near = [rows[part] for part in blocks(len(rows), _NEAR)]
        on_all_cores(lambda rows: keep(rows, nearest.distance[rows], nearest.index[rows]), near, report)
    # Counting is cheap. Points with about as many candidates are then queried together, for hardly more than they have.
    count = tree.query_ball_point(tree.data[open_], radii[open_], workers=cores(), return_length=True)
    group = np.ceil(np.log2(count) * _GROUPS).astype(np.int16)
    order = np.argsort(group, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(group[order])) + 1) if len(order) else []

    def search(part: tuple[Ints, int]) -> None:
        rows, most = part
        keep(rows, *tree.query(tree.data[rows], k=np.arange(1, most + 1)))

    parts = []
    for members in groups:
        most = int(count[members].max())
        parts += [(rows, most) for rows in np.array_split(open_[members], len(members) * most // _BLOCK + 1)]
    on_all_cores(search, parts, report)
    start = np.cumsum(many) - many
    first = np.repeat(np.arange(tree.n, dtype=np.int32), many)
    second, distance = np.empty(len(first), dtype=np.int32), np.empty(len(first))

    def put(part: tuple[Ints, Ints, Floats]) -> None:
        owner, column, length = part
        place = np.arange(len(column)) + np.repeat(start[owner] - np.cumsum(many[owner]) + many[owner], many[owner])
        second[place], distance[place] = column, length

    on_all_cores(put, found)
    return [first, second, distance]
