"""Smoothing lengths: how wide the kernel is at every point."""

import numpy as np

_WIDTH = 1.8  # h over the reach of the cells: the narrowest at which weights have their moments on random points
_POWER = 8  # of the mean over the neighbourhood: the longest cells decide
_ROUNDS, _SLOW, _LAST = 4, 40, 2  # of averaging over the 40 nearest neighbours: of what is there, chance away, the rest
_LEAST = 0.95  # of the length that the closer neighbourhood asks for is kept
_USUAL = 100  # neighbours of the options for which the width above holds
_STEPS = 4  # to the neighbours' neighbours: how far away a point looks for the deepest place


def smoothing_lengths(nearest, options, component=None, reach=None):
    """Choose h for every point.

    Parameters
    ----------
    nearest : Nearest
        Of m points.
    options : LaplacianOptions
        Its bandwidth, neighbors and bandwidth_factor.
    component : ndarray, (m,) int, optional
        Component of each point; neighbours are counted within one.
    reach : ndarray, (m,), optional
        How far each point's Voronoi cell reaches; for "adaptive".

    Returns
    -------
    ndarray, (m,)
        Global: the mean distance to the n-th neighbour, everywhere the same. Local: each point's own distance, averaged
        twice over the 40 nearest neighbours so that h varies slowly within a support. Adaptive: 1.8 times the reach of
        the cells around, in the eighth mean. A gap in one direction tells how far the kernel must reach, not how many
        points there are in the others: even points have some 45 inside it then, random ones 115.
    """
    if options.bandwidth == "adaptive":
        scale = _WIDTH * np.sqrt(options.neighbors / _USUAL)
        averaging = nearest.averaging()
        local = np.log(_repeat(averaging, reach**_POWER, _ROUNDS)) / _POWER
        length = np.maximum(_repeat(averaging, local, _SLOW), local + np.log(_LEAST))
        return options.bandwidth_factor * scale * np.exp(_repeat(averaging, length, _LAST))
    distance = _neighbor_distance(nearest.tree, options.neighbors, component)
    if options.bandwidth == "global":
        return np.full(len(distance), options.bandwidth_factor * distance.mean())
    return options.bandwidth_factor * _repeat(nearest.averaging(), distance, 2)


def depth(nearest, inside):
    """Return how far from a boundary the surface around every point gets, (m,): half the width of a narrow one."""
    deepest = inside[:, 0]
    if np.isfinite(deepest).any():
        counted = nearest.weight > 1e-12  # neither those on other sheets nor the last one; zero but for rounding
        for _ in range(_STEPS):
            deepest = np.max(deepest[nearest.index], axis=1, where=counted, initial=0.0)
    return deepest


def _neighbor_distance(tree, neighbors, component):
    # The tree counts a point as its own first neighbour.
    distance = tree.query(tree.data, k=[min(neighbors + 1, tree.n)], workers=-1)[0][:, 0]
    if component is not None:
        size = np.bincount(component)
        for small in np.flatnonzero(size <= neighbors):
            few = size[small] - 1
            rows = np.flatnonzero(component == small)
            reach = tree.query(tree.data[rows], k=[few + 1], workers=-1)[0][:, 0]
            distance[rows] = reach * np.sqrt(neighbors / few)
    return distance


def _repeat(matrix, values, rounds):
    for _ in range(rounds):
        values = matrix @ values
    return values
