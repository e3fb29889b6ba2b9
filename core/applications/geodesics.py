"""Distances along the surface."""

from functools import partial

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from ..blocks import blocks, on_all_cores
from ..errors import InvalidPointsError
from ..geometry import as_mask, circle_arc, pair_heights
from .graph import mean_spacing

_BEND = 0.35  # sine of half the angle between two normals, at most, at which an arc is a good guess of the way
_SQUARE = 0.1  # cosine of two normals below which they stand at a right angle
_BLOCK = 1 << 16  # pairs worked on at one time, so that they stay in the cache
_GAP = 0.9  # spacings between the middle of a pair next to a boundary and the nearest point: the surface is there


def geodesic_distance(laplacian, sources, *, progress=None):
    """Measure the distance along the surface from the nearest of some points.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    sources : array_like, (k,) int or (n,) bool
        Points to measure from, at least one.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n,)
        Distances [L], zero at the sources; infinity on components without a source and at points left out.

    Raises
    ------
    InvalidPointsError
        No sources, all of them left out of the operator, or indices out of range.

    See Also
    --------
    grow : All points within a distance.
    harmonic_field : Values between given ones.

    Notes
    -----
    The shortest path (Dijkstra, 1959) over all pairs of the operator, each as long as the circular arc through both
    points with their normals. A path may choose among the 40 to 120 neighbours within the kernel, which do not
    couple different sheets, so that it is hardly longer than the true one: by 0.06 to 0.2 % on the unit sphere with
    8,000 points, where the heat method (Crane, Weischedel, Wardetzky, 2013) on the same operator is off by 0.2 to
    0.4 % from one source, and by 4 % from five, because it smooths the ridges where the ways from two sources meet.

    Examples
    --------
    From the first point, next to a pole, to the one farthest from it, nearly pi away on the unit sphere:

    >>> import numpy as np
    >>> import core
    >>> z = 1 - (np.arange(800) + 0.5) / 400  # 800 points, evenly on the unit sphere
    >>> ring = np.sqrt(1 - z**2) * np.exp(2.39996j * np.arange(800))
    >>> points = np.column_stack([ring.real, ring.imag, z])
    >>> laplacian = core.build_laplacian(points)
    >>> distance = core.geodesic_distance(laplacian, [0])
    >>> print(distance.max().round(2), np.arccos((points @ points[0]).min()).round(2))
    3.07 3.07
    """
    _known_sources(laplacian, sources)  # before the lengths, which take longer
    return Geodesics(laplacian, progress=progress).distance(sources, progress=progress)


class Geodesics:
    """Distances along a surface from several sets of points, each of which then takes a few tenths of the time.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    See Also
    --------
    geodesic_distance : Distances from one set of points.

    Examples
    --------
    From both ends of the polar axis of the unit sphere to a point of the equator, a quarter of the way around:

    >>> import numpy as np
    >>> import core
    >>> z = 1 - (np.arange(800) + 0.5) / 400  # 800 points, evenly on the unit sphere
    >>> ring = np.sqrt(1 - z**2) * np.exp(2.39996j * np.arange(800))
    >>> points = np.column_stack([ring.real, ring.imag, z])
    >>> geodesics = core.Geodesics(core.build_laplacian(points))
    >>> print(*(geodesics.distance([pole])[400].round(1) for pole in (0, 799)))
    1.6 1.6
    """

    def __init__(self, laplacian, *, progress=None):
        report = progress or (lambda stage, fraction: None)
        self._laplacian = laplacian
        self._graph = _lengths_of_pairs(laplacian, lambda: report("Lengths", 0.0))

    def distance(self, sources, *, progress=None):
        """Measure the distance from the nearest of some points; see `geodesic_distance`.

        Parameters
        ----------
        sources : array_like, (k,) int or (n,) bool
            Points to measure from, at least one.
        progress : callable, optional
            Called as ``progress(stage, fraction)``; may raise `Cancelled`.

        Returns
        -------
        ndarray, (n,)
            Distances [L], zero at the sources; infinity on components without a source and at points left out.

        Raises
        ------
        InvalidPointsError
            No sources, all of them left out of the operator, or indices out of range.
        """
        chosen, known = _known_sources(self._laplacian, sources)
        if progress is not None:
            progress("Distance", 0.5)
        result = dijkstra(self._graph, indices=known, min_only=True)
        result[chosen] = 0.0
        return result


def _known_sources(laplacian, sources):
    """Return the mask of the sources, (n,) bool, and those of them that the operator has."""
    chosen = as_mask(sources, len(laplacian.points))
    if not chosen.any():
        raise InvalidPointsError("There are no sources to measure distances from. Choose at least one point.")
    known = np.flatnonzero(chosen & (laplacian.component >= 0))
    if not len(known):
        raise InvalidPointsError(
            f"All {np.count_nonzero(chosen)} sources are points that the operator left out, because they lie"
            " apart from the surface. Choose points of the surface."
        )
    return chosen, known


def _lengths_of_pairs(laplacian, report):
    """Return the symmetric (n, n) CSR matrix of the lengths of all pairs of the operator."""
    stiffness, points = laplacian.stiffness, laplacian.surface_points
    count = len(points)
    first = np.repeat(np.arange(count, dtype=np.int32), np.diff(stiffness.indptr))
    once = first < stiffness.indices
    first, second = first[once], stiffness.indices[once]
    spacing = mean_spacing(laplacian)
    arcs = np.empty(len(first))
    kept = np.empty(len(first), dtype=bool)
    tree = cKDTree(points[laplacian.component >= 0])
    places, normals = points.T.copy(), laplacian.normals.T.copy()

    def measure(block):
        i, j = first[block], second[block]
        ends = (partial(np.take, indices=end, axis=1) for end in (i, j))
        chord, left, right, cosine = pair_heights(*ends, places, normals)
        length = np.linalg.norm(chord, axis=0)
        turn = np.abs(np.where(cosine < 0.0, -right, right) - left)
        # Which way normals face each other across a right angle is chance: it bends, either way.
        turn = np.where(np.abs(cosine) < _SQUARE, np.maximum(turn, np.abs(left) + np.abs(right)), turn)
        bend = np.minimum(0.5 * turn / np.maximum(length, 1e-300), 1.0)
        arcs[block] = circle_arc(length, bend)
        short = length < 0.5 * (laplacian.smoothing_lengths[i] + laplacian.smoothing_lengths[j])
        kept[block] = short | (bend < _BEND)
        # The straight way between two points near a boundary may lead through a hole or past a bay.
        doubtful = np.flatnonzero(kept[block] & laplacian.near_boundary[i] & laplacian.near_boundary[j] & ~short)
        middle = 0.5 * (points[i[doubtful]] + points[j[doubtful]])
        height = 0.25 * length[doubtful] * bend[doubtful]
        reach = _GAP * 0.5 * (spacing[i[doubtful]] + spacing[j[doubtful]]) + height
        kept[block.start + doubtful] = tree.query(middle)[0] < reach

    on_all_cores(measure, blocks(len(first), _BLOCK), report)
    arcs = np.maximum(arcs, 1e-300)  # points at one place are neighbours too

    def upper(chosen):
        start = np.concatenate([[0], np.cumsum(np.bincount(first[chosen], minlength=count))])
        return sparse.csr_array((arcs[chosen], second[chosen], start.astype(np.int32)), shape=(count, count))

    # On few points all the ways from one may bend too much: a poor way is better than none.
    label = connected_components(upper(kept), directed=False)[1]
    kept |= label[first] != label[second]
    half = upper(kept)
    return half + half.T.tocsr()
