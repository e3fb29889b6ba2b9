"""Pairs by blocks that fit the cache: gather from the points at their ends, and scatter to these."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import sparse

from ..algebra import on_all_cores
from ..types import Array, Floats, Ints

_PAIRS = 1 << 16  # of a patch, about: of fewer, and Python's share of the work grows


@dataclass(frozen=True)
class Patch:
    """Some of the pairs, ordered by their first points, and the points at their ends."""

    pairs: slice  # which of all pairs
    rows: Ints  # (k,), the first points, each once
    columns: Ints  # (l,), the second points, each once
    counts: Ints  # (k,), how many pairs each first point has
    ends: sparse.csc_array  # (l, k), which second point each pair leads to; its values are scratch for sums

    def first(self, values: Array) -> Array:
        """Return quantities of points, (..., m), at the first point of each pair, (..., pairs)."""
        return np.repeat(_taken(values, self.rows), self.counts, axis=-1)

    def second(self, values: Array) -> Array:
        """Return quantities of points, (..., m), at the second point of each pair, (..., pairs)."""
        return _taken(_taken(values, self.columns), self.ends.indices)

    def mean(self, values: Floats) -> Floats:
        """Return the mean of a point quantity over both ends of each pair."""
        return 0.5 * (self.first(values) + self.second(values))

    def over_first(self, values: Iterable[Floats]) -> Floats:
        """Return the sums of quantities of pairs, (pairs,) each, over the pairs of each first point, (q, k)."""
        return np.stack([np.add.reduceat(row, self.ends.indptr[:-1]) for row in values])

    def over_second(self, values: Iterable[Floats]) -> Floats:
        """Return the sums of quantities of pairs, (pairs,) each, over the pairs of each second point, (q, l)."""
        ones, none, sums = np.ones(len(self.rows)), self.ends.data, []
        for row in values:
            self.ends.data = row
            sums.append(self.ends @ ones)
        self.ends.data = none
        return np.stack(sums)


def _taken(values: Array, places: Ints) -> Array:
    """Return entries of the last axis at places that are all in range: to check that takes a third of the time."""
    return np.take(values, places, axis=-1, mode="clip")


def divide_pairs(start: Ints, second: Ints) -> list[Patch]:
    """Divide pairs into patches, by where those of each first point start, (m + 1,), and their second points."""
    cuts = np.unique(np.searchsorted(start, np.append(np.arange(0, start[-1], _PAIRS), start[-1])))
    return on_all_cores(lambda cut: _patch(start[cut[0] : cut[1] + 1], second, cut[0]), list(pairwise(cuts)))


def _patch(start: Ints, second: Ints, low: int) -> Patch:
    pairs = slice(start[0], start[-1])
    second = second[pairs]
    known = np.flatnonzero(np.diff(start))
    start = np.append(start[known], start[-1]) - start[0]
    # The place of a point among the columns is read from a table, over the points from the least to the greatest.
    least = second.min()
    column = second - least
    table = np.zeros(column.max() + 1, dtype=np.int32)
    table[column] = 1
    columns = np.flatnonzero(table)
    table[columns] = np.arange(len(columns), dtype=np.int32)
    place = table[column]
    ends = sparse.csc_array((place, place, start), shape=(len(columns), len(known)))
    return Patch(pairs, low + known, least + columns, np.diff(start), ends)
