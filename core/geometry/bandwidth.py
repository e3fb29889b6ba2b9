"""Smoothing lengths: how wide the kernel is at every point."""

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..options import LaplacianOptions
from ..types import Floats, Ints
from .nearest import ROUNDS, Nearest

_WIDTH = 0.18  # h over the radius of the cells, by the root of the neighbours of the options, 100: the narrowest kernel
# at which the weights of random points have their moments
_POWER = 8  # of the mean over the neighbourhood: the widest cells decide
_STEPS = 4  # to the neighbours' neighbours: how far away a point looks for the deepest place
_FURTHEST = 2.5  # spacings that a gap may be wide, as in rows 25 times denser along than across: it is a hole otherwise


def smoothing_lengths(
    nearest: Nearest, radius: Floats, options: LaplacianOptions, component: Ints | None = None
) -> Floats:
    """Choose h for every point.

    Parameters
    ----------
    nearest : Nearest
        Of m points.
    radius : ndarray, (m,)
        Radius of each point's Voronoi cell.
    options : LaplacianOptions
        Its bandwidth, neighbors and bandwidth_factor.
    component : ndarray, (m,) int, optional
        Component of each point; neighbours are counted within one.

    Returns
    -------
    ndarray, (m,)
        Global: the mean distance to the n-th neighbour, everywhere the same. Local: each point's own distance, averaged
        twice over the 40 nearest neighbours so that h varies slowly within a support. Adaptive: 1.8 times the radius of
        the cells around, in the eighth mean. The width of a gap in one direction decides, not the number of points in
        the others: even points have some 45 inside the kernel then, random ones 115.
    """
    if options.bandwidth == "adaptive":
        scale = options.bandwidth_factor * _WIDTH * np.sqrt(options.neighbors)
        return scale * mean_gaps(nearest, radius, _POWER)
    distance = _neighbor_distance(nearest.tree, options.neighbors, component)
    if options.bandwidth == "global":
        return np.full(len(distance), options.bandwidth_factor * distance.mean())
    return options.bandwidth_factor * _repeat(nearest.averaging(), distance, 2)


def mean_gaps(nearest: Nearest, radius: Floats, power: int) -> Floats:
    """Return how wide the gaps around every point are, (m,): the radii of the Voronoi cells, in the mean.

    Parameters
    ----------
    nearest : Nearest
        Of m points.
    radius : ndarray, (m,)
        Of each point's cell.
    power : int
        Of the mean: in the eighth the widest gaps decide.
    """
    radius = np.minimum(radius, _FURTHEST * nearest.spacing)
    return _repeat(nearest.averaging(), radius**power, ROUNDS) ** (1.0 / power)


def depth(nearest: Nearest, inside: Floats) -> Floats:
    """Return how far from a boundary the surface around every point gets, (m,): half the width of a narrow one."""
    deepest = inside[:, 0]
    if np.isfinite(deepest).any():
        counted = nearest.weight > 1e-12  # neither those on other sheets nor the last one; zero but for rounding
        for _ in range(_STEPS):
            deepest = np.max(deepest[nearest.index], axis=1, where=counted, initial=0.0)
    return deepest


def _neighbor_distance(tree: cKDTree, neighbors: int, component: Ints | None) -> Floats:
    # The tree counts a point as its own first neighbour.
    distance: Floats = tree.query(tree.data, k=[min(neighbors + 1, tree.n)], workers=-1)[0][:, 0]
    if component is not None:
        size = np.bincount(component)
        for small in np.flatnonzero(size <= neighbors):
            few = size[small] - 1
            rows = np.flatnonzero(component == small)
            furthest = tree.query(tree.data[rows], k=[few + 1], workers=-1)[0][:, 0]
            distance[rows] = furthest * np.sqrt(neighbors / few)
    return distance


def _repeat(matrix: sparse.csr_array, values: Floats, rounds: int) -> Floats:
    for _ in range(rounds):
        values = matrix @ values
    return values
