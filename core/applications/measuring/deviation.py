"""How far the points of one cloud are from the surface of another."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...arguments import real
from ...errors import PointCloudError
from ...geometry import check_points, unit_normals
from ...operator import ImplicitSurface, LaplaceBeltrami
from ...types import Bools, Floats, Progress

_ROUNDS = 20  # of Newton's method along a normal; a few are needed
_MET = 1e-3  # spacings off the surface at which it is met
_STEEP = 0.2  # least cosine between the normal and that of the surface where it meets it: others graze it


class Deviation(NamedTuple):
    """Distances of points from a surface.

    Attributes
    ----------
    distance : ndarray, (n,)
        Along the normals [L], positive where a point lies on the side that its normal points to; 0 where there is none.
    known : ndarray, (n,) bool
        Which points have one: the surface is there, and near enough.
    """

    distance: Floats
    known: Bools


def surface_deviation(
    points: ArrayLike,
    normals: ArrayLike,
    laplacian: LaplaceBeltrami,
    greatest: float | None = None,
    *,
    progress: Progress | None = None,
) -> Deviation:
    """Measure how far points are from the surface of another cloud, along their normals.

    Each normal is followed in both directions to where it meets the surface through the other points, also between
    these: two samples of one surface have no distance, wherever their points lie.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    normals : array_like, (n, 3)
        Normals of any length; their signs decide those of the distances.
    laplacian : LaplaceBeltrami
        Of the other cloud, in the same coordinates.
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
    mesh_surface : Makes a mesh of that surface.

    References
    ----------
    Lague, Brodu, Leroux, Accurate 3D comparison of complex topography with terrestrial laser scanner (M3C2), 2013.

    Examples
    --------
    A sphere of 300 points and radius 1.1 is 0.1 outside of the unit sphere of 800 points:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> deviation = core.surface_deviation(1.1 * points[::2], points[::2], core.build_laplacian(points))
    >>> print(np.allclose(deviation.distance, 0.1, atol=1e-3), deviation.known.all())
    True True
    """
    points = check_points(points)
    directions: Floats = unit_normals(normals, len(points))
    limit = np.inf if greatest is None else real(greatest)
    if not limit > 0.0:
        raise PointCloudError(f"The greatest distance is {greatest!r}. Use a number above zero.")
    report = progress or (lambda stage, fraction: None)
    report("Deviation", 0.7)
    unit = np.sqrt(np.median(laplacian.areas[laplacian.component >= 0]))
    surface = ImplicitSurface(laplacian, unit)
    places = surface.scaled(points)
    nearest = surface.nearest(places)
    distance = np.einsum("ij,ij->i", surface.points[nearest] - places, directions)
    # Beyond this no surface is met: far off it, where slopes are extrapolated, steps would grow without bound.
    farthest = np.linalg.norm(places, axis=1) + 2.0 * np.linalg.norm(surface.points, axis=1).max()
    known, rows = np.zeros(len(points), dtype=bool), np.arange(len(points))
    for _ in range(_ROUNDS):
        there = surface.heights(
            places[rows] + distance[rows, None] * directions[rows], lambda: report("Deviation", 0.8)
        )
        cosine = np.einsum("ij,ij->i", there.normal, directions[rows])
        steep = np.abs(cosine) > _STEEP
        met = steep & (np.abs(there.height) < _MET)
        step = np.where(steep, -there.height / np.where(steep, cosine, 1.0), 0.0)
        distance[rows] = np.clip(distance[rows] + step, -farthest[rows], farthest[rows])
        known[rows] = met & there.belongs
        rows = rows[steep & ~met]
        if not len(rows):
            break
    distance *= unit
    known &= np.abs(distance) <= limit
    return Deviation(np.where(known, -distance, 0.0), known)
