"""The neighbor pairs inside the kernel's support."""

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Self, TypeAlias

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..algebra import on_all_cores, runs
from ..kernel import SUPPORT
from ..types import Array, Bools, Floats, Ints, Report
from .patches import Patch, divide_pairs

Ends: TypeAlias = Sequence[Iterable[Floats]] | Floats  # quantities of pairs at their first and second points

_ROWS = 1 << 12  # points whose pairs are searched for at one time, at most
_CANDIDATES = 1 << 20  # neighbors that a core looks at at one time meanwhile, about
_SAMPLED = 16  # every which of some points is asked how many neighbors it has
_GROUPS = 4  # groups of points by their radii, for each doubling of it


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
            return patch.over_first(first), patch.over_second(second)

        total = np.zeros((count, len(self.points)))
        if not self.patches:
            return total
        joined = self._joined
        found = [part for parts in on_all_cores(sums, self.patches, report) for part in parts]

        def join(row: int) -> None:
            total[row] = joined @ np.concatenate([part[row] for part in found])

        on_all_cores(join, range(count))
        return total

    @functools.cached_property
    def patches(self) -> list[Patch]:
        """The pairs by blocks that fit the cache: a list of `Patch`."""
        return divide_pairs(self.start, self.second)

    @functools.cached_property
    def _joined(self) -> sparse.csr_array:
        """The matrix, (m, sums), that adds at each point what patches summed over first, and over second, points."""
        place = np.concatenate([end.astype(np.int32) for patch in self.patches for end in (patch.rows, patch.columns)])
        start = np.arange(len(place) + 1, dtype=np.int32)
        return sparse.csc_array((np.ones(len(place)), place, start), shape=(len(self.points), len(place))).tocsr()

    @functools.cached_property
    def start(self) -> Ints:
        """Where the pairs of each first point start, (m + 1,)."""
        start: Ints = np.searchsorted(self.first, np.arange(len(self.points) + 1, dtype=self.first.dtype))
        return start.astype(np.int32 if len(self.first) < 2**31 else np.int64)


def find_pairs(tree: cKDTree, lengths: Floats, report: Report = lambda: None) -> list[Array]:
    """Find all pairs nearer than 3 h_ij, with h_ij = (h_i + h_j) / 2, for smoothing lengths h, (n,).

    Return their first and second points, (pairs,) int32, each pair once and ordered by the first, and their distances.
    Points are distinct. `report` is called before each block of points; it may raise `Cancelled`.
    """
    radii = SUPPORT * lengths
    many, found = np.zeros(tree.n, dtype=np.int64), []

    def search(rows: Ints) -> None:
        here, some = radii[rows], cKDTree(tree.data[rows], balanced_tree=False, compact_nodes=False)
        few = cKDTree(tree.data[rows[::_SAMPLED]])
        if len(rows) > 1 and _SAMPLED * few.count_neighbors(tree, here.max()) > _CANDIDATES:
            for half in np.array_split(rows, 2):
                search(half)
            return
        near = some.sparse_distance_matrix(tree, here.max(), output_type="ndarray")
        first, second, distance = near["i"], near["j"], near["v"]
        own, other = here[first], radii[second]
        # Each pair is stored at the end with the larger radius, whose search always finds it.
        kept = (own > other) | ((own == other) & (rows[first] < second))
        kept &= distance <= 0.5 * (own + other)
        first = first[kept].astype(np.uint16)  # which is sorted by counting
        order = np.argsort(first, kind="stable")
        many[rows] = np.bincount(first, minlength=len(rows))
        found.append((rows, second[kept][order].astype(np.int32), distance[kept][order]))

    # Points that lie near each other and have about one radius are searched around together: the trees are compared by
    # whole branches, in half the time of a search around each point.
    size = np.floor(np.log2(radii[tree.indices]) * _GROUPS).astype(np.int16)
    order = np.argsort(size, kind="stable")
    groups = np.split(tree.indices[order], np.flatnonzero(np.diff(size[order])) + 1)
    on_all_cores(search, [part for group in groups for part in np.array_split(group, len(group) // _ROWS + 1)], report)
    start = np.cumsum(many) - many
    first = np.repeat(np.arange(tree.n, dtype=np.int32), many)
    second, distance = np.empty(len(first), dtype=np.int32), np.empty(len(first))

    def put(part: tuple[Ints, Ints, Floats]) -> None:
        owner, column, length = part
        place = runs(start[owner], many[owner])
        second[place], distance[place] = column, length

    on_all_cores(put, found)
    return [first, second, distance]
