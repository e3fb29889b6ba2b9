"""How far the points of one cloud are from the surface of another."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..arguments import check_points, real
from ..cores import cores
from ..errors import PointCloudError
from ..geometry import Doubt, check_values, side_sums, sides_by_sums, unit_normals
from ..operator import ImplicitSurface, LaplaceBeltrami
from ..progress import ends_at_one
from ..types import Bools, Floats, Progress, Report

_ROUNDS = 20  # of Newton's method along a normal; a few are needed
_FEET = 40  # rounds of the search for the nearest place of a surface, most of which a few end
_MET = 1e-3  # spacings off the surface at which it is met
_STEEP = 0.2  # least cosine between the normal and that of the surface where it meets it: others graze it


class Deviation(NamedTuple):
    """Distances of points from a surface.

    Attributes
    ----------
    distance : ndarray, (n,)
        Along the normals [L], positive where a point lies on the side that its normal points to, or to the nearest
        place without a sign; 0 where there is none.
    known : ndarray, (n,) bool
        Which points have one: the surface is there, and near enough.
    """

    distance: Floats
    known: Bools


@ends_at_one
def surface_deviation(
    laplacian: LaplaceBeltrami,
    points: ArrayLike,
    normals: ArrayLike | None,
    greatest: float | None = None,
    *,
    progress: Progress | None = None,
) -> Deviation:
    """Measure how far points are from the surface of another cloud, along their normals or to its nearest place.

    Each normal is followed in both directions to where it meets the surface through the other points, also between
    these: two samples of one surface have no distance, wherever their points lie. Without normals the distance is that
    of the nearest place of the surface, and has no sign; beyond its boundary, that of the nearest point.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of the other cloud.
    points : array_like, (n, 3)
        Coordinates [L], the same as its own.
    normals : array_like, (n, 3), or None
        Normals of any length; their signs decide those of the distances. None for distances without signs.
    greatest : float, optional
        Distance [L] beyond which points are not compared; any if not given.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    Deviation

    Raises
    ------
    InvalidPointsError
        Points or normals of a wrong shape, not finite, or normals of zero length.
    PointCloudError
        A greatest distance that is not above zero.

    See Also
    --------
    outer_sides : Tells where signs of normals are known.
    surface.mesh_surface : Makes a mesh of that surface.

    References
    ----------
    Lague, Brodu, Leroux, Accurate 3D comparison of complex topography with terrestrial laser scanner (M3C2), 2013.

    Examples
    --------
    A sphere of 300 points and radius 1.1 is 0.1 outside of the unit sphere of 800 points:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> deviation = mf.measure.surface_deviation(mf.build_laplacian(points), 1.1 * points[::2], points[::2])
    >>> print(np.allclose(deviation.distance, 0.1, atol=1e-3), deviation.known.all())
    True True
    >>> inside = mf.measure.surface_deviation(mf.build_laplacian(points), 0.9 * points[::2], None)
    >>> print(np.allclose(inside.distance, 0.1, atol=1e-3))
    True
    """
    points = check_points(points)
    directions = None if normals is None else unit_normals(normals, len(points))
    limit = np.inf if greatest is None else real(greatest)
    if not limit > 0.0:
        raise PointCloudError(f"The greatest distance is {greatest!r}. Use a number above zero.")
    report = progress or (lambda stage, fraction: None)
    report("Deviation", 0.7)
    unit = float(np.sqrt(np.median(laplacian.areas[laplacian.component >= 0])))
    surface = ImplicitSurface(laplacian, unit)
    places = surface.scaled(points)
    if directions is None:
        distance = unit * _to_feet(surface, places, lambda: report("Deviation", 0.8))
        known = distance <= limit
        return Deviation(np.where(known, distance, 0.0), known)
    distance, known = _along(surface, places, directions, lambda: report("Deviation", 0.8))
    distance *= unit
    known &= np.abs(distance) <= limit
    return Deviation(np.where(known, -distance, 0.0), known)


def outer_sides(laplacian: LaplaceBeltrami) -> Floats:
    """Tell which side of the surface is the outer one, as the points themselves tell it.

    A component that encloses something, or bulges as what a scanner sees of a body, has its outer side away from its
    middle. A sheet with little overhang, such as terrain, faces up. Others, such as a facade, have none, nor have
    points that fill a volume.

    Parameters
    ----------
    laplacian : LaplaceBeltrami

    Returns
    -------
    ndarray, (n,)
        1 where normals point to the outer side, -1 where to the inner one, and 0 where nothing tells.

    See Also
    --------
    orient_normals : Chooses the signs of normals, by a viewpoint for instance.

    Examples
    --------
    Normals of a sphere point outwards; of a wall nothing tells where that is:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> print(mf.measure.outer_sides(mf.build_laplacian(points)).min())
    1.0
    >>> wall = np.zeros((400, 3))
    >>> wall[:, ::2] = np.random.default_rng(0).random((400, 2))
    >>> print(np.abs(mf.measure.outer_sides(mf.build_laplacian(wall))).max())
    0.0
    """
    kept = np.flatnonzero(laplacian.component >= 0)
    part, weight = laplacian.component[kept], laplacian.areas[kept]
    points = laplacian.surface_points[kept]
    size = np.bincount(part, weight)
    center = np.column_stack([np.bincount(part, weight * values) / size for values in points.T])
    sides = np.zeros(len(laplacian.points))
    sides[kept] = sides_by_sums(side_sums(points - center[part], laplacian.normals[kept], part, weight))[part]
    return np.where(laplacian.doubt == Doubt.VOLUME, 0.0, sides)


def sides_beside(laplacian: LaplaceBeltrami, sides: ArrayLike, points: ArrayLike, normals: ArrayLike) -> Floats:
    """Tell which signs turn normals beside a surface to the outer side of it.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    sides : array_like, (m,)
        Of its points from `outer_sides`.
    points, normals : array_like, (n, 3)
        Coordinates [L], and unit vectors.

    Returns
    -------
    ndarray, (n,)
        1 or -1, by the nearest point of the surface, and 0 where its outer side is not known.

    See Also
    --------
    surface_deviation : Whose signs are those of the normals.

    Examples
    --------
    Above and below a sphere, normals upwards point out of it and into it:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> sides = mf.measure.outer_sides(laplacian)
    >>> print(mf.measure.sides_beside(laplacian, sides, [[0, 0, 1.5], [0, 0, -1.5]], np.tile([0, 0, 1], (2, 1))))
    [ 1. -1.]
    """
    points = check_points(points)
    kept = np.flatnonzero(laplacian.component >= 0)
    near = kept[cKDTree(laplacian.points[kept]).query(points, workers=cores())[1]]
    signs = np.sign(np.einsum("ij,ij->i", unit_normals(normals, len(points)), laplacian.normals[near]))
    return check_values(sides, len(laplacian.points))[near] * signs


def _along(surface: ImplicitSurface, places: Floats, directions: Floats, report: Report) -> tuple[Floats, Bools]:
    """Return how far along unit vectors places meet a surface, (n,), in its units, and where they do, (n,) bool."""
    nearest = surface.nearest(places)
    distance = np.einsum("ij,ij->i", surface.points[nearest] - places, directions)
    # Beyond this no surface is met: far off it, where slopes are extrapolated, steps would grow without bound.
    farthest = np.linalg.norm(places, axis=1) + 2.0 * np.linalg.norm(surface.points, axis=1).max()
    known, rows = np.zeros(len(places), dtype=bool), np.arange(len(places))
    for _ in range(_ROUNDS):
        there = surface.heights(places[rows] + distance[rows, None] * directions[rows], report)
        cosine = np.einsum("ij,ij->i", there.normal, directions[rows])
        steep = np.abs(cosine) > _STEEP
        met = steep & (np.abs(there.height) < _MET)
        step = np.where(steep, -there.height / np.where(steep, cosine, 1.0), 0.0)
        distance[rows] = np.clip(distance[rows] + step, -farthest[rows], farthest[rows])
        known[rows] = met & there.belongs
        rows = rows[steep & ~met]
        if not len(rows):
            break
    return distance, known


def _to_feet(surface: ImplicitSurface, places: Floats, report: Report) -> Floats:
    """Return distances of places from the nearest ones of a surface, (n,), in its units; of points where it ends.

    From the nearest point on, tangential steps lead to the foot of the perpendicular, shorter ones the more the surface
    bends on the way: so none goes too far.
    """
    nearest = surface.nearest(places)
    feet = surface.points[nearest]
    best: Floats = np.linalg.norm(places - feet, axis=1)
    rows = np.arange(len(places))
    for _ in range(_FEET):
        there = surface.heights(feet[rows], report)
        offset = places[rows] - feet[rows]
        ahead = np.einsum("ij,ij->i", offset, there.normal)
        step = offset - ahead[:, None] * there.normal
        step /= (1.0 + 2.0 * surface.half_curvature(there.nearest) * np.abs(ahead))[:, None]
        met = np.abs(there.height) < _MET
        best[rows] = np.where(met & there.belongs, np.minimum(best[rows], np.linalg.norm(offset, axis=1)), best[rows])
        step -= there.height[:, None] * there.normal
        length = np.linalg.norm(step, axis=1)
        step *= np.minimum(there.spacing / np.maximum(length, 1e-300), 1.0)[:, None]
        feet[rows] += step
        rows = rows[~(met & (length < _MET)) & (there.beyond <= there.spacing)]
        if not len(rows):
            break
    return best
