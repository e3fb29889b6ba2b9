"""Distances along the surface."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from ..algebra import blocks, on_all_cores
from ..arguments import check_switches
from ..errors import InvalidPointsError
from ..geometry import as_indices, as_mask, circle_arc, pair_heights
from ..operator import LaplaceBeltrami
from ..progress import ends_at_one
from ..types import Array, Bools, Floats, Ints, Progress
from .fans import Fans

_CURVED = 0.35  # sine of half the angle between two normals, at most, at which an arc is close to the geodesic
_SQUARE = 0.1  # cosine of two normals below which they are nearly perpendicular
_BLOCK = 1 << 16  # pairs worked on at one time, so that they stay in the cache
_WITHIN = (1.5, 6.0, np.inf)  # straight distances within which a path between two points is searched, one by one
_DETOUR = 1.25  # shortest path along pairs over the distance, at most
_FILLED = 1.05  # radii of its cell that a place of the surface is off the nearest point, at most: else it is a gap


@ends_at_one
def geodesic_distance(
    laplacian: LaplaceBeltrami, sources: ArrayLike, *, limit: float = np.inf, progress: Progress | None = None
) -> Floats:
    """Measure the distance along the surface from the nearest of some points.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    sources : array_like, (k,) int or (n,) bool
        Points to measure from, at least one.
    limit : float
        Points that are farther away [L] get infinity, and nothing is computed there.
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
    Lengths of edges are computed once for all that is measured along the surface of an operator, and kept by it.

    The shortest path (Dijkstra, 1959) over all pairs of the operator, each as long as the circular arc through both
    points with their normals, tells in which order a front from the sources reaches the points, and nearly when. The
    front then passes the triangles of every point and two neighbors next to each other in direction, as in fast
    marching (Kimmel, Sethian, 1998); it is a circle there around a source that the distances of both corners tell
    (Novotni, Klein, 2002), or straight where they are reached from different ones. So distances are exact in the plane,
    however much denser points lie in one direction than in another, and off by 0.03 to 0.05 % in the mean on the unit
    sphere with 8,000 points, where the heat method (Crane, Weischedel, Wardetzky, 2013) on the same operator has errors
    of 0.2 to 0.4 % from one source, and of 4 % from five, because it smooths the ridges where paths from two sources
    meet.

    References
    ----------
    Kimmel, Sethian. Computing Geodesic Paths on Manifolds. 1998.
    Novotni, Klein. Computing Geodesic Distances on Triangular Meshes. 2002.

    Examples
    --------
    From the first point, next to a pole, to the one farthest from it, nearly pi away on the unit sphere:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> distance = mf.distance.geodesic_distance(laplacian, [0])
    >>> print(distance.max().round(1), np.arccos((points @ points[0]).min()).round(1))
    3.1 3.1
    """
    _known_sources(laplacian, sources)  # before the lengths, which take longer
    return geodesics_of(laplacian, progress).distance(sources, limit=limit, progress=progress)


def geodesics_of(laplacian: LaplaceBeltrami, progress: Progress | None = None) -> "Geodesics":
    """Return what finds distances along the surface of an operator, which keeps it."""
    alone = replace(laplacian)  # keeps nothing, so that the two do not hold each other
    return laplacian.kept.result("geodesics", lambda: Geodesics(alone, progress=progress))


class Geodesics:
    """Distances along a surface from several sets of points: lengths of edges are computed once."""

    def __init__(self, laplacian: LaplaceBeltrami, *, progress: Progress | None = None) -> None:
        report = progress or (lambda stage, fraction: None)
        self._laplacian = laplacian
        self._graph = _lengths_of_pairs(laplacian, lambda: report("Lengths", 0.0))
        self._fans = Fans(laplacian, self._graph, lambda: report("Lengths", 0.4))

    def distance(self, sources: ArrayLike, *, limit: float = np.inf, progress: Progress | None = None) -> Floats:
        """See `geodesic_distance`."""
        chosen, known = _known_sources(self._laplacian, sources)
        result = self._from(known, limit, progress)[0]
        result[chosen] = 0.0
        return result

    def _from(self, sources: Ints, limit: float = np.inf, progress: Progress | None = None) -> tuple[Floats, Ints]:
        """Return the distance of every point from the nearest source, up to a limit, and which of the points it is."""
        report = progress or (lambda stage, fraction: None)
        report("Distance", 0.5)
        far = _DETOUR * limit
        distance, _, source = dijkstra(self._graph, indices=sources, min_only=True, return_predecessors=True, limit=far)
        distance, source = self._fans.refine(distance, source, report=lambda: report("Distance", 0.5))
        distance[distance > limit] = np.inf
        return distance, source

    def outward(self, distance: Floats) -> Array:
        """Return the vectors from a source to the points, by the distances from it, (n,) complex in their frames."""
        return self._fans.outward(distance)

    def nearest_source(self, sources: ArrayLike, *, progress: Progress | None = None) -> Ints:
        """See `nearest_source`."""
        known = _known_sources(self._laplacian, sources)[1]
        index = as_indices(sources, len(self._laplacian.points), "sources")
        label = np.full(len(self._laplacian.points) + 1, -1)  # one more for points without a path to a source
        label[index] = np.arange(len(index))
        nearest = self._from(known, progress=progress)[1]
        return label[np.where(nearest < 0, -1, nearest)]

    def signed_distance(self, curve: ArrayLike, closed: bool = False, *, progress: Progress | None = None) -> Floats:
        """See `signed_distance`."""
        laplacian = self._laplacian
        count = len(laplacian.points)
        check_switches(closed=closed)
        given = as_indices(curve, count, "points of the curve")
        _check_curve(laplacian, given)
        report = progress or (lambda stage, fraction: None)
        path = self._path(given, closed, lambda done: report("Curve", 0.5 * done))
        report("Distance", 0.5)
        band, away, feet, across = self._beside(path)
        lengths = np.maximum(away, 1e-300)
        pairs = self._graph  # and one more point, from which the paths to the band start
        graph = sparse.csr_array(
            (
                np.concatenate([pairs.data, lengths]),
                np.concatenate([pairs.indices, band.astype(pairs.indices.dtype)]),
                np.append(pairs.indptr, pairs.indptr[-1:] + len(band)),
            ),
            shape=(count + 1, count + 1),
        )
        distance, before = dijkstra(graph, indices=count, return_predecessors=True)
        # The side on which a path leaves the curve is that of all its points. As its first point may lie on the other
        # side, next to the curve, the second one decides of those behind, seen from where the path starts.
        every = np.arange(count + 1)
        further = (before >= 0) & (before < count)  # reached over another point
        second = further & (before[np.where(further, before, count)] == count)
        root = np.where(further & ~second, before, every)
        while np.any(root != root[root]):
            root = root[root]
        at = np.zeros(count + 1, dtype=np.int64)
        at[band] = np.arange(len(band))
        start = at[np.where(second, before, every)[:count]]
        offset = laplacian.surface_points - feet[start]
        left = np.einsum("ij,ij->i", offset, across[start]) >= 0.0
        foot = np.unique(feet, axis=0, return_inverse=True)[1].reshape(-1)[start]  # fronts from one corner are circles
        label = (2 * foot + left)[root[:count]]
        held = np.zeros(count, dtype=bool)
        held[band] = held[path] = True
        distance = distance[:count]
        distance[path] = 0.0
        distance, label = self._fans.refine(distance, label, held, lambda: report("Distance", 0.5))
        return np.where(np.isfinite(distance), np.where(label % 2 == 1, 1.0, -1.0) * distance, np.inf)

    def corners(self, first: int, last: int) -> Ints:
        """Return the points of the shortest path over pairs of points, (m,) int; see `geodesic_path`."""
        row = self._graph.indices[self._graph.indptr[first] : self._graph.indptr[first + 1]]
        if last in row:
            return np.array([first, last])
        # Points farther away than the end do not matter; its distance along the surface is not known yet.
        points = self._laplacian.surface_points
        apart = max(float(np.linalg.norm(points[last] - points[first])), 1e-300)
        for times in _WITHIN:
            distance = self._from(np.array([first]), times * apart)[0]
            if np.isfinite(distance[last]):
                break
        else:
            raise InvalidPointsError(
                f"No path along the surface connects the points {first} and {last}. Leave one out."
            )
        backwards = [last]
        while backwards[-1] != first:
            here = backwards[-1]
            near = slice(self._graph.indptr[here], self._graph.indptr[here + 1])
            row = self._graph.indices[near]
            way = np.where(distance[row] < distance[here], distance[row] + self._graph.data[near], np.inf)
            backwards.append(int(row[way.argmin()]))
        return np.array(backwards[::-1])

    def _path(self, curve: Ints, closed: bool, report: Callable[[float], None]) -> Ints:
        """Join points by shortest paths, and return all points of these in their order, (m,), the first one twice."""
        ends = np.append(curve, curve[0]) if closed else curve
        path = [int(ends[0])]
        for number, (first, last) in enumerate(pairwise(ends)):
            report(number / len(ends))
            path += self.corners(first, last).tolist()[1:]
        return np.array(path)

    def _beside(self, path: Ints) -> tuple[Ints, Floats, Floats, Floats]:
        """Return the points near a polygon, (b,), how far away they are, from where on it, and which way is left there.

        The last two are (b, 3).
        """
        points, normals = self._laplacian.surface_points, self._laplacian.normals
        # Each point of the path ends a segment before it and one after it; at the ends of an open path one of them.
        chord = np.diff(points[path], axis=0)
        left = np.cross(normals[path[:-1]], chord)
        left /= np.maximum(np.linalg.norm(left, axis=1), 1e-300)[:, None]
        corner = np.zeros((len(path), 3))
        corner[:-1] += left
        corner[1:] += left
        if path[0] == path[-1]:
            corner[[0, -1]] = left[0] + left[-1]
        near = self._graph[path].tocoo()
        arc = near.data / np.maximum(np.linalg.norm(points[near.col] - points[path[near.row]], axis=1), 1e-300)
        found = []
        for segment, kept in ((near.row, near.row < len(chord)), (near.row - 1, near.row > 0)):
            segment, point = segment[kept], near.col[kept]
            start = points[path[segment]]
            offset = points[point] - start
            along = np.einsum("ij,ij->i", offset, chord[segment]) / np.einsum("ij,ij->i", *(chord[segment],) * 2)
            foot = start + np.clip(along, 0.0, 1.0)[:, None] * chord[segment]
            across = np.where(
                ((along > 0.0) & (along < 1.0))[:, None], left[segment], corner[segment + (along >= 1.0)]
            )  # at a corner the mean of both normals decides the side (Baerentzen, Aanaes, 2005)
            away = np.linalg.norm(points[point] - foot, axis=1) * arc[kept]
            found.append((point, away, foot, across))
        point, away, feet, left = (np.concatenate(values) for values in zip(*found, strict=True))
        order = np.lexsort((away, point))
        order = order[~np.isin(point[order], path)]
        band, first = np.unique(point[order], return_index=True)
        return band, away[order][first], feet[order][first], left[order][first]


@ends_at_one
def nearest_source(laplacian: LaplaceBeltrami, sources: ArrayLike, *, progress: Progress | None = None) -> Ints:
    """Find the nearest of some points along the surface: geodesic Voronoi cells.

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
    ndarray, (n,) int
        Index of the nearest source among the sources, from 0; -1 on components without one and at points left out.

    Raises
    ------
    InvalidPointsError
        No sources, all of them left out of the operator, named twice, or indices out of range.

    See Also
    --------
    geodesic_distance : The distance to it.

    Examples
    --------
    From both poles of a sphere, each is nearest to one half:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> z = points[:, 2]
    >>> label = mf.distance.nearest_source(mf.build_laplacian(points), [0, 799])
    >>> print(label[z > 0.1].max(), label[z < -0.1].min())
    0 1
    """
    _known_sources(laplacian, sources)
    return geodesics_of(laplacian, progress).nearest_source(sources, progress=progress)


@ends_at_one
def signed_distance(
    laplacian: LaplaceBeltrami, curve: ArrayLike, closed: bool = False, *, progress: Progress | None = None
) -> Floats:
    """Measure the distance along the surface from a curve, positive on its left and negative on its right.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    curve : array_like, (k,) int
        The points of the curve in their order, at least two. Points that are not neighbors are joined by the shortest
        path between them.
    closed : bool
        Whether the last point is joined with the first.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n,)
        Distances [L], zero on the curve; left as seen against the normals. Beyond the ends of an open curve the sign is
        that from its straight continuation near the end. Infinity on other components and at points left out.

    Raises
    ------
    InvalidPointsError
        Fewer than two points, points named twice, left out or out of range, or on several components.

    See Also
    --------
    geodesic_distance : Distances from points, without a sign.

    Notes
    -----
    Within the kernel's radius of the curve, distance and side are those from its segments; beyond, the distance is that
    of the front from there (see `geodesic_distance`), and the side that on which it left the curve.

    Examples
    --------
    From three points around the pole of the unit sphere, the poles are on either side:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> distance = mf.distance.signed_distance(mf.build_laplacian(points), [100, 101, 102], closed=True)
    >>> print(np.sign(distance[0] * distance[799]))
    -1.0
    """
    _check_curve(laplacian, as_indices(curve, len(laplacian.points), "points of the curve"))
    return geodesics_of(laplacian, progress).signed_distance(curve, closed, progress=progress)


def _check_curve(laplacian: LaplaceBeltrami, curve: Ints) -> None:
    """Refuse a curve that does not lie on one component."""
    component = laplacian.component[curve]
    if len(curve) < 2 or component.min() < 0 or component.min() != component.max():
        raise InvalidPointsError(
            f"The curve has {len(curve)} points, {np.count_nonzero(component < 0)} of them left out of the operator, on"
            f" {len(np.unique(component[component >= 0]))} components. Give at least two points of one component."
        )


def _known_sources(laplacian: LaplaceBeltrami, sources: ArrayLike) -> tuple[Bools, Ints]:
    """Return the mask of the sources, (n,) bool, and those of them that the operator does not leave out."""
    chosen = as_mask(sources, len(laplacian.points))
    if not chosen.any():
        raise InvalidPointsError("There are no sources to measure distances from. Choose at least one point.")
    known = np.flatnonzero(chosen & (laplacian.component >= 0))
    if not len(known):
        raise InvalidPointsError(
            f"All {np.count_nonzero(chosen)} sources are points that the operator left out, because they are"
            " outliers. Choose points of the surface."
        )
    return chosen, known


def _lengths_of_pairs(laplacian: LaplaceBeltrami, report: Callable[[], None]) -> sparse.csr_array:
    """Return the symmetric (n, n) CSR matrix of the lengths of all pairs of the operator."""
    points, count = laplacian.surface_points, len(laplacian.points)
    pairs = sparse.triu(laplacian.stiffness, 1, format="csr").tocoo()
    first, second = pairs.row, pairs.col
    arcs = np.empty(len(first))
    kept = np.empty(len(first), dtype=bool)
    known = np.flatnonzero(laplacian.component >= 0)
    tree, radius = cKDTree(points[known]), laplacian.cell_radius[known]
    places, normals = points.T.copy(), laplacian.normals.T.copy()

    def measure(block: slice) -> None:
        i, j = first[block], second[block]
        one, other = (partial(np.take, indices=end, axis=1) for end in (i, j))
        chord, left, right, cosine = pair_heights(one, other, places, normals)
        length = np.linalg.norm(chord, axis=0)
        rise = np.abs(np.where(cosine < 0.0, -right, right) - left)
        # The relative sign of nearly perpendicular normals is arbitrary: assume the more curved arc.
        rise = np.where(np.abs(cosine) < _SQUARE, np.maximum(rise, np.abs(left) + np.abs(right)), rise)
        sine = np.minimum(0.5 * rise / np.maximum(length, 1e-300), 1.0)
        arcs[block] = circle_arc(length, sine)
        short = length < 0.5 * (laplacian.smoothing_lengths[i] + laplacian.smoothing_lengths[j])
        kept[block] = short | (sine < _CURVED)
        # The straight segment between two points near a boundary may cross a hole or a bay.
        doubtful = np.flatnonzero(kept[block] & (laplacian.near_boundary[i] | laplacian.near_boundary[j]) & ~short)
        middle = 0.5 * (points[i[doubtful]] + points[j[doubtful]])
        height = 0.25 * length[doubtful] * sine[doubtful]
        away, nearest = tree.query(middle)
        kept[block.start + doubtful] = away < _FILLED * radius[nearest] + height

    on_all_cores(measure, blocks(len(first), _BLOCK), report)
    arcs = np.maximum(arcs, 1e-300)  # coincident points are neighbors too

    def upper(chosen: slice | Bools) -> sparse.csr_array:
        start = np.concatenate([[0], np.cumsum(np.bincount(first[chosen], minlength=count))])
        return sparse.csr_array((arcs[chosen], second[chosen], start.astype(np.int32)), shape=(count, count))

    report()
    if kept.all():
        half = upper(slice(None))
    else:
        # On few points all arcs from one may be too curved: an inaccurate path is better than none.
        label = connected_components(upper(kept), directed=False)[1]
        kept |= label[first] != label[second]
        half = upper(kept)
    report()
    other = half.T.tocsr()
    report()
    return half + other
