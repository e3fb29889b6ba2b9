"""Fewer points that stand for many: a blue-noise subset, evenly spread over the surface whatever the density was."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..arguments import check_points, whole
from ..cores import cores
from ..errors import InvalidPointsError
from ..types import Array, Bools, Floats, Ints, Report

_CANDIDATES = 3.0  # voxels for each point wanted: enough to choose from, few enough for their pairs
FINEST = 2**21 - 1  # voxels along each axis: three numbers of 21 bits share one of 64
_DISCS = 0.7  # points a squared radius that discs in random order leave on an area of one
_VOXELS = 1.5  # voxels that a surface of area one meets for each squared edge, on average over its directions
_FEW = 0.9  # of the points wanted, which are enough
_CLOSER = 0.8  # times the radius, at which more points are filled in
_SAMPLE, _AROUND = 20_000, 9  # of candidates, and neighbors of each, that give the area
_TRIALS = 8  # of voxels, or of radii


def blue_noise_subset(points: ArrayLike, count: int, *, progress: Report | None = None) -> Ints:
    """Choose points that are evenly spread over the surface, none close to another: a Poisson-disc subset.

    Of each voxel of a fine grid the point next to its center is a candidate. Of candidates closer than a radius one
    stays, in an order that looks random but follows from the places alone, so that neither the order of the points nor
    the run makes a difference. The radius is found by trial.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    count : int
        How many to choose at most.
    progress : callable, optional
        Called without arguments at each trial; may raise `Cancelled`.

    Returns
    -------
    ndarray, (k,) int
        Indices, ascending; k lies between nine tenths of the count and the count. Where no radius leaves as many, as
        where coordinates are rounded, or far denser in some places, others further apart than a smaller radius fill up.
        Of points at one place one at most. All different places where there are no more than the count.

    Raises
    ------
    InvalidPointsError
        Points of a wrong shape or not finite, or a count below 1.

    See Also
    --------
    clean.Prolongation : Carries what was computed there to all points.

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> print(180 <= len(mf.clean.blue_noise_subset(points, 200)) <= 200)
    True
    """
    report = progress or (lambda: None)
    points = check_points(points)
    if not whole(count) >= 1:
        raise InvalidPointsError(f"A subset of {count!r} points was asked for. Ask for a whole number of at least 1.")
    low = points.min(axis=0)
    extent = float(np.max(points.max(axis=0) - low))
    if extent == 0.0:
        return np.array([0])
    chosen, keys = _candidates(points, low, extent, int(count), report)
    if len(chosen) > count:
        chosen = chosen[_thin(points[chosen], keys, int(count), report)]
    return np.sort(chosen)


def _candidates(points: Floats, low: Floats, extent: float, count: int, report: Report) -> tuple[Ints, Ints]:
    """Return a point of each voxel, and the numbers of these voxels, few more than are needed."""
    finest = extent / FINEST
    wanted = _CANDIDATES * count
    edge = finest if len(points) <= wanted else max(extent * np.sqrt(_VOXELS / wanted), finest)
    for left in reversed(range(_TRIALS)):
        report()
        keys = voxel_numbers(points, low, edge)
        order = np.argsort(keys)
        ordered = keys[order]
        first = np.flatnonzero(np.diff(ordered, prepend=-1))
        ratio = len(first) / wanted
        if edge == finest or 0.8 < ratio < 1.5 or left == 0:
            break
        # Where others are far closer than most, only the finest voxels may hold enough.
        few = left == 1 and len(first) < count
        edge = finest if few else max(edge * np.sqrt(np.clip(ratio, 0.05, 20.0)), finest)
    return _central(points, order, first, low, edge), ordered[first]


def voxel_numbers(points: Floats, low: Floats, edge: float) -> Ints:
    """Return the numbers of the voxels that points lie in, from the lowest corner on; near ones are mostly near."""
    keys = np.zeros(len(points), dtype=np.int64)
    for axis in range(3):
        keys <<= 21
        keys += ((points[:, axis] - low[axis]) / edge).astype(np.int64)
    return keys


def _central(points: Floats, order: Ints, first: Ints, low: Floats, edge: float) -> Ints:
    """Return of each voxel the point next to the center; of several equally near the one with the least coordinates."""
    distance = np.zeros(len(order))
    for axis in range(3):
        place = (points[order, axis] - low[axis]) / edge
        distance += (place - np.floor(place) - 0.5) ** 2
    voxel = np.repeat(np.arange(len(first)), np.diff(first, append=len(order)))
    nearest = np.flatnonzero(distance == np.minimum.reduceat(distance, first)[voxel])
    if len(nearest) > len(first):
        x, y, z = points[order[nearest]].T
        nearest = nearest[np.lexsort((z, y, x, voxel[nearest]))]
    return order[nearest[np.diff(voxel[nearest], prepend=-1) > 0]]


def _thin(points: Floats, keys: Ints, count: int, report: Report) -> Bools:
    """Return which of the candidates stay when discs of one radius must not hold another, at most a count of them."""
    rank = _shuffled(keys)
    tree = cKDTree(points)
    distance = tree.query(points[:: 1 + len(points) // _SAMPLE], k=min(_AROUND, len(points)), workers=cores())[0][:, -1]
    area = len(points) * np.mean(np.pi * distance**2 / _AROUND)
    radius = np.sqrt(_DISCS * area / count)
    below, most, best = 0.0, np.inf, None  # radii that leave too many, and few enough
    for _ in range(_TRIALS):
        report()
        kept = _discs(tree, rank, radius)
        found = np.count_nonzero(kept)
        if found <= count:
            if best is None or found > np.count_nonzero(best):
                best = kept
            most = radius
            if found >= _FEW * count:
                break
        else:
            below = radius
        radius *= np.sqrt(found / (0.96 * count))
        if not below < radius < most:
            radius = 0.5 * (below + most)
    while best is None:  # far denser in some places than in others
        radius *= 1.5
        kept = _discs(tree, rank, radius)
        if np.count_nonzero(kept) <= count:
            best = kept
        else:
            below = radius
    below = below or radius
    while np.count_nonzero(best) < _FEW * count:  # no radius leaves as many, as where coordinates are rounded
        more = np.flatnonzero(_discs(tree, np.where(best, rank - len(rank), rank), below) & ~best)
        best[more[np.argsort(rank[more])[: count - np.count_nonzero(best)]]] = True
        below *= _CLOSER
    return best


def _shuffled(keys: Ints) -> Ints:
    """Return numbers in an order that looks random, for a voxel always the same."""
    rank = np.empty(len(keys), dtype=np.int64)
    rank[np.argsort(mix_bits(keys.astype(np.uint64)))] = np.arange(len(keys))
    return rank


def mix_bits(numbers: Array) -> Array:
    """Return numbers of 64 bits that look random, (n,) uint64, for a number always the same (those of SplitMix64)."""
    mixed = numbers
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        mixed = (mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor)
    return mixed ^ (mixed >> np.uint64(31))


def _discs(tree: cKDTree, rank: Ints, radius: float) -> Bools:
    """Return which points stay, (m,) bool, when each, in the order of their ranks, takes all others within a radius."""
    first, second = tree.query_pairs(radius, output_type="ndarray").T
    return independent(first, second, rank)


def independent(first: Ints, second: Ints, rank: Array, report: Callable[[], None] = lambda: None) -> Bools:
    """Return which points stay, (m,) bool: no two of a pair, and of each left out one that comes before it.

    Of each of p pairs one may stay (Luby 1986). The one of the lower rank, (m,), comes before the other; no two ranks
    are the same. `report` is called at each round; it may raise `Cancelled`.
    """
    count, swap = len(rank), rank[first] > rank[second]
    first, second = np.where(swap, second, first), np.where(swap, first, second)
    kept, gone = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    while True:
        report()
        beaten = gone.copy()
        beaten[second] = True
        kept |= ~beaten  # no candidate that is left comes before them
        taken = kept[first]
        gone[second[taken]] = True
        left = ~(gone[first] | gone[second] | taken)
        if not len(first):
            return kept
        first, second = first[left], second[left]
