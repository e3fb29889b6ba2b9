"""Fewer points for the same surface, spread as evenly as the given ones let them."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from ..algebra import blocks
from ..cores import cores
from ..types import Array, Bools, Floats, Ints, Report
from .subset import independent

_STEP = 2.0  # each pass leaves a quarter of the points
NEIGHBORS = 25  # the point itself and more than a pass lets go of
_FILL = 0.49  # points that stay in a square whose side is their least distance, about
_SEED = 0
_BLOCK = 1 << 15


def thin(
    points: Floats,
    areas: Floats,
    spacing: Floats,
    count: int,
    rank: Ints | None = None,
    report: Report = lambda: None,
) -> Ints:
    """Choose some of the points so that no two are close to each other, and none of the others is far from all.

    Parameters
    ----------
    points : ndarray, (n, 3)
        Coordinates [L].
    areas : ndarray, (n,)
        Their area elements [L^2].
    spacing : ndarray, (n,)
        Lengths that are to vary as the distances between chosen points do, of any size.
    count : int
        How many to choose, about.
    rank : ndarray, (n,) int, optional
        Points of a higher rank are chosen before others. Those of different ranks above zero do not displace each
        other.
    report : callable
        Called now and then; may raise `Cancelled`.

    Returns
    -------
    ndarray, (k,) int
        Indices of the chosen points, ascending. They depend on where the points are and not on their order.

    Notes
    -----
    A maximal independent set of the graph of close points, by priorities drawn at random (Luby 1986), in passes of
    which each doubles the distance, so that the work is linear in the number of points.
    """
    n = len(points)
    rank = np.zeros(n, dtype=np.int64) if rank is None else rank
    if count >= n:
        return np.arange(n)
    reach = spacing * np.sqrt(_FILL * np.sum(areas / spacing**2) / count)
    priority = np.empty(n)
    priority[np.lexsort(points.T)] = np.random.default_rng(_SEED).permutation(n)
    priority += n * rank
    passes = max(1, int(np.ceil(np.log(n / count) / np.log(_STEP**2))))
    chosen = np.arange(n)
    for step in range(passes):
        share = reach[chosen] / _STEP ** (passes - 1 - step)
        chosen = chosen[apart(points[chosen], share, -priority[chosen], rank[chosen], report)]
    return chosen


def apart(points: Floats, reach: Floats | float, order: Array, rank: Ints | None, report: Report) -> Bools:
    """Return which points have none before them, in their order, within reach that stays, (m,) bool.

    Among as many neighbors as are looked at; the reach of two points is the mean of theirs, (m,) or one for all [L],
    and those of different ranks above zero, (m,) int, do not displace each other.
    """
    reach = np.broadcast_to(reach, len(points))
    rank = np.zeros(len(points), dtype=np.int64) if rank is None else rank
    pairs = [_close_pairs(*found, reach, rank) for found in nearest_in_blocks(points, points, NEIGHBORS, report)]
    first, second = (np.concatenate(ends) for ends in zip(*pairs, strict=True))
    return independent(first, second, order, report)


def _close_pairs(start: int, distance: Floats, index: Ints, reach: Floats, rank: Ints) -> tuple[Ints, Ints]:
    """Return the pairs of some points and their neighbors of which only one may stay, as two arrays."""
    row = np.repeat(np.arange(start, start + len(index)), index.shape[1])
    other = index.ravel()
    apart = (rank[row] > 0) & (rank[other] > 0) & (rank[row] != rank[other])
    close = (2.0 * distance.ravel() < reach[row] + reach[other]) & (row != other) & ~apart
    return row[close], other[close]


def nearest_in_blocks(
    sources: Floats, points: Floats, count: int, report: Report = lambda: None
) -> Iterator[tuple[int, Floats, Ints]]:
    """Find the nearest sources of points; yield the first row of each block, distances and indices, (b, count)."""
    tree = cKDTree(sources)
    count = min(count, len(sources))
    for rows in blocks(len(points), _BLOCK):
        report()
        distance, index = tree.query(points[rows], k=range(1, count + 1), workers=cores())
        yield rows.start, distance, index
