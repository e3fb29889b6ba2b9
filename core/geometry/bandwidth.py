"""Smoothing lengths: how wide the kernel is at every point."""

import numpy as np

from ..kernel import SUPPORT

# Irregularity of the spacing, and h / d100: the widest that it needs, the narrowest that it bears.
_IRREGULARITY = (0.03, 0.12, 0.24, 0.30)
_WIDEST = (0.37, 0.50, 0.55, 0.58)
_NARROWEST = (0.30, 0.30, 0.30, 0.38)
_ROOM = 0.76  # h / d100 up to which it is widened before a place where it is larger
_BEND = 0.33  # h times the principal curvature: how far the kernel may reach around a bend
_AROUND = np.pi / SUPPORT  # the same, at most: beyond half a turn the kernel would reach what is on the other side
_ACROSS = 0.4  # h over the depth of the surface, at most: images know of two boundaries, not of those on the other side
_TIGHTEST = 1.2  # spacings that h keeps even there
_STEPS = 4  # to the neighbours' neighbours: how far away a point looks for the deepest place
_SLOPE = 0.02  # most that h grows along the surface, by its length, where there is room for a wider kernel
_EVEN = 0.12  # changes of log d100 over the cloud for which one h serves as well
_NOISE = 0.10  # changes of log d100 that may be chance
_SLOW, _FAST, _SMOOTH, _LAST = 160, 10, 12, 2  # rounds of averaging over the 40 nearest neighbours


def smoothing_lengths(nearest, options, component=None, max_abs_curvature=None, inside=None, deepest=None):
    """Choose h for every point.

    Parameters
    ----------
    nearest : Nearest
        Of m points.
    options : LaplacianOptions
        Its bandwidth, neighbors and bandwidth_factor.
    component : ndarray, (m,) int, optional
        Component of each point; neighbours are counted within one.
    max_abs_curvature : ndarray, (m,), optional
        The larger principal curvature of every point; for "adaptive".
    inside : ndarray, (m, 2), optional
        Distances to boundaries; a neighbourhood that it cuts counts as whole.
    deepest : ndarray, (m,), optional
        The `depth` of the surface; h stays small where it is narrow.

    Returns
    -------
    ndarray, (m,)
        Global: the mean distance to the n-th neighbour, everywhere the same. Local: each point's own distance, averaged
        twice over the 40 nearest neighbours so that h varies slowly within a support. Adaptive: the same distance
        without what may be chance, and without changes over the component that one h serves as well, times a factor
        between 0.3 and 0.58 that is as large as the irregularity of the spacing demands and the curvature permits.
        Where the surface bends most, as on a bead of few points, the kernel reaches no further than half a turn; where
        it is narrow h stays below 0.4 of the depth, the distance of its middle from the boundary; but not below 1.2
        spacings. Where there is room, up to 0.76 of the distance, it is widened so that it grows by no more than 0.02
        of the way along the surface, and smoothed.
    """
    distance = _neighbor_distance(nearest.tree, options.neighbors, component)
    if options.bandwidth == "global":
        return np.full(len(distance), options.bandwidth_factor * distance.mean())
    averaging = nearest.averaging()
    if options.bandwidth == "local":
        return options.bandwidth_factor * _repeat(averaging, distance, 2)
    counted = _counted(nearest)
    own = np.log(distance) - 0.5 * np.log(counted.sum(axis=1) / (counted.shape[1] - 1))
    if inside is not None:
        own = own + 0.5 * np.log(_share_inside(inside / distance[:, None])).sum(axis=1)
    fast = _repeat(averaging, own, _FAST)
    slow = _repeat(averaging, fast, _SLOW)
    typical = _typical(slow, component)
    reach = typical + _all_beyond(slow - typical, _EVEN) + _beyond(fast - slow, _NOISE)
    irregular = irregularity(nearest, averaging)
    least, most = (np.log(np.interp(irregular, _IRREGULARITY, factors)) for factors in (_NARROWEST, _WIDEST))
    curved = np.log(_BEND / np.maximum(max_abs_curvature, 1e-30))
    floor = least + np.maximum(reach, own)
    length = np.maximum(np.clip(curved, least + reach, most + reach), floor)
    tight = np.exp(_repeat(averaging, curved, _LAST)) * (_AROUND / _BEND)
    if deepest is not None:
        tight = np.minimum(tight, _ACROSS * deepest)
    tight = np.log(np.maximum(tight, _TIGHTEST * nearest.spacing))
    length, floor = np.minimum(length, tight), np.minimum(floor, tight)
    length = np.maximum(_repeat(averaging, length, _LAST), floor)
    widest = np.minimum(np.minimum(curved, tight), np.log(_ROOM) + reach)
    widest = np.maximum(widest, length)
    length = np.log(_lipschitz_limit(nearest, np.exp(length), np.exp(widest)))
    length = np.clip(_repeat(averaging, length, _SMOOTH), floor, widest)
    return options.bandwidth_factor * np.exp(_repeat(averaging, length, _LAST))


def _lipschitz_limit(nearest, length, widest):
    """Widen h before a place where it is larger, so that it grows gently along the surface, up to the widest, (m,).

    Where h changes within a support neither the areas nor the weights are those of one kernel: the errors of both grow
    with its slope.
    """
    fall = np.where(_counted(nearest), _SLOPE * nearest.distance, np.inf)
    while True:
        wider = np.minimum((length[nearest.index] - fall).max(axis=1), widest)
        if not np.any(wider > 1.001 * length):
            return length
        length = np.maximum(length, wider)


def _typical(values, component):
    """Return the median of the component that a point belongs to, (m,)."""
    if component is None:
        return np.median(values)
    order = np.lexsort((values, component))
    size = np.bincount(component)
    first = np.cumsum(size) - size
    return values[order[first + size // 2]][component]


def _beyond(values, least):
    """Return by how much values exceed the least on either side of zero."""
    return np.sign(values) * np.maximum(np.abs(values) - least, 0.0)


def _all_beyond(values, least):
    """Return values that are twice the least on either side of zero, or more, and less and less of smaller ones."""
    return np.sign(values) * np.clip(2.0 * (np.abs(values) - least), 0.0, np.abs(values))


def depth(nearest, inside):
    """Return how far from a boundary the surface around every point gets, (m,): half the width of a narrow one."""
    deepest = inside[:, 0]
    if np.isfinite(deepest).any():
        counted = _counted(nearest)
        for _ in range(_STEPS):
            deepest = np.max(deepest[nearest.index], axis=1, where=counted, initial=0.0)
    return deepest


def _counted(nearest):
    """Tell which neighbours count: not those on other sheets, nor those as far as the last one, of no weight."""
    return nearest.weight > 1e-12  # zero but for rounding


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


def irregularity(nearest, averaging):
    """Measure how irregular the spacing is: 0 on a lattice, about 0.3 where points are random.

    Robust standard deviation of the logarithm of (d6 / d24)^2 about its local mean.
    """
    ratio = 2.0 * np.log(nearest.distance[:, 6] / nearest.distance[:, 24])
    return float(np.median(np.abs(ratio - averaging @ ratio)) / 0.6745)


def _repeat(matrix, values, rounds):
    for _ in range(rounds):
        values = matrix @ values
    return values


def _share_inside(ratio):
    """Share of a disc's area on this side of a straight boundary, at ``ratio`` radii from its centre."""
    ratio = np.clip(ratio, 0.0, 1.0)
    return 1.0 - (np.arccos(ratio) - ratio * np.sqrt(1.0 - ratio**2)) / np.pi
