"""Smoothing lengths and the neighbour pairs inside the kernel's support."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from .errors import IslandError
from .kernel import SUPPORT
from .points import ScaledPoints, check_points, scale_points

_SMOOTHING_NEIGHBORS = 40
_ISLAND_NEIGHBORS = 8
_ISLAND_GAP = 4.0  # an edge longer than this many reaches to the 8th neighbour is a gap
_BLOCK = 1 << 22  # neighbour candidates held at one time while the pairs are collected


def smoothing_lengths(tree, options):
    """Choose h for every point.

    Parameters
    ----------
    tree : cKDTree
        Of the distinct points.
    options : LaplacianOptions
        Its bandwidth, neighbors and bandwidth_factor.

    Returns
    -------
    ndarray, (n,)
        Global: the mean distance to the n-th neighbour, everywhere the same. Local: each point's own distance, averaged
        twice over the 40 nearest neighbours so that h varies slowly within a support.
    """
    # The tree counts a point as its own first neighbour.
    distance = tree.query(tree.data, k=[options.neighbors + 1], workers=-1)[0][:, 0]
    if options.bandwidth == "global":
        return np.full(tree.n, options.bandwidth_factor * distance.mean())
    reach, near = tree.query(tree.data, k=min(_SMOOTHING_NEIGHBORS, tree.n), workers=-1)
    weight = fading_weights(reach)
    weight /= weight.sum(axis=1, keepdims=True)
    for _ in range(2):
        distance = (weight * distance[near]).sum(axis=1)
    return options.bandwidth_factor * distance


def fading_weights(distance):
    """Return weights that fall from 1 to 0 at the last neighbour, (n, k).

    Which of several neighbours at the same last distance was found then makes no difference.
    """
    return (1.0 - (distance / distance[:, -1:]) ** 2) ** 2


@dataclass(frozen=True)
class Neighborhoods:
    """The distinct points in scaled coordinates, and all pairs nearer than 3 h_ij, each once.

    Attributes
    ----------
    scaled : ScaledPoints
        The distinct points and the way back to the caller's.
    tree : cKDTree
        Of the distinct points.
    lengths : ndarray, (m,)
        Smoothing lengths in scaled coordinates.
    first, second : ndarray, (pairs,) int32
        The two points of each pair, ordered by the first.
    distance : ndarray, (pairs,)
        Their distance in space.
    """

    scaled: ScaledPoints
    tree: cKDTree
    lengths: np.ndarray
    first: np.ndarray
    second: np.ndarray
    distance: np.ndarray

    @property
    def points(self):
        """The distinct points in scaled coordinates, (m, 3)."""
        return self.scaled.points

    def mean(self, values):
        """Return the mean of a point quantity over both ends of every pair."""
        return 0.5 * (values[self.first] + values[self.second])

    def half(self, values):
        """Return a pair quantity as the (m, m) CSR matrix U that holds each pair once; the whole is U + U.T."""
        count = len(self.points)
        start = np.zeros(count + 1, dtype=np.int32 if len(self.first) < 2**31 else np.int64)
        np.cumsum(np.bincount(self.first, minlength=count), out=start[1:])
        return sparse.csr_array((values, self.second, start), shape=(count, count))


def find_neighborhoods(points, options):
    """Go from coordinates to neighbourhoods: check, scale, merge duplicates, choose h, find the pairs.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    options : LaplacianOptions
        Its bandwidth, neighbors and bandwidth_factor.

    Returns
    -------
    Neighborhoods

    Raises
    ------
    PointCloudError
        No sound neighbourhoods: see `check_points`, `scale_points`; or an island of fewer points than they need.
    """
    scaled = scale_points(check_points(points), options.neighbors + 1)
    tree = cKDTree(scaled.points)
    refuse_islands(tree, options.neighbors + 1)
    lengths = smoothing_lengths(tree, options)
    return Neighborhoods(scaled, tree, lengths, *find_pairs(tree, lengths))


def refuse_islands(tree, needed):
    """Raise IslandError where a group of fewer points than needed lies apart from all others.

    Points are joined to their nearest neighbours, except over gaps far wider than the spacing at the nearer end.
    """
    near = min(_ISLAND_NEIGHBORS + 1, tree.n)
    distance, column = tree.query(tree.data, k=near, workers=-1)
    reach = _ISLAND_GAP * distance[:, -1]
    row = np.repeat(np.arange(tree.n), near)
    column, distance = column.ravel(), distance.ravel()
    joined = distance <= np.maximum(np.minimum(reach[row], reach[column]), np.median(reach))
    graph = sparse.csr_array((joined[joined], (row[joined], column[joined])), shape=(tree.n, tree.n))
    part = connected_components(graph, directed=False)[1]
    sizes = np.bincount(part)
    small = sizes[sizes < needed]
    if len(small):
        raise IslandError(
            f"{small.sum()} of {tree.n} points lie apart from the rest, in islands of fewer than {needed} points"
            f" (islands: {len(small)}). Delete them, or lower the number of neighbors."
        )


def find_pairs(tree, lengths):
    """Find all pairs nearer than 3 h_ij, with h_ij = (h_i + h_j) / 2.

    Parameters
    ----------
    tree : cKDTree
        Of n distinct points.
    lengths : ndarray, (n,)
        Smoothing lengths.

    Returns
    -------
    first, second : ndarray, (pairs,) int32
        Each pair once, ordered by the first.
    distance : ndarray, (pairs,)
    """
    n = tree.n
    radii = SUPPORT * lengths
    # The search starts from what an even sample holds; rows that reach further are asked again, for twice as many.
    sample = slice(None, None, max(1, n // 1000))
    spacing = tree.query(tree.data[sample], k=[min(31, n)], workers=-1)[0][:, 0]
    count = int(min(max(40.0 * np.median(radii[sample] / spacing) ** 2, 16), n))
    pending = np.arange(n)
    found = []
    while len(pending):
        unfinished = []
        for rows in np.array_split(pending, len(pending) * count // _BLOCK + 1):
            distance, column = tree.query(tree.data[rows], k=count, workers=-1)
            complete = (distance[:, -1] > radii[rows]) | (count == n)
            unfinished.append(rows[~complete])
            rows, distance, column = rows[complete], distance[complete], column[complete]
            reach, other = radii[rows, None], radii[column]
            # A pair is kept by the end that reaches further, which always sees it.
            kept = (reach > other) | ((reach == other) & (rows[:, None] < column))
            kept &= distance <= 0.5 * (reach + other)
            first = np.repeat(rows.astype(np.int32), np.count_nonzero(kept, axis=1))
            found.append((first, column[kept].astype(np.int32), distance[kept]))
        pending, count = np.concatenate(unfinished), min(2 * count, n)
    rounds = [np.concatenate(part) for part in zip(*found, strict=True)]
    if np.any(np.diff(rounds[0]) < 0):  # later rounds answered for earlier rows
        order = np.argsort(rounds[0], kind="stable")
        rounds = [part[order] for part in rounds]
    return rounds
