"""Sets of points: grown by distance along the surface, and around its ends."""

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_doubles, check_array, real
from ..errors import PointCloudError
from ..geometry import as_mask
from ..operator import LaplaceBeltrami
from ..types import Bools, Floats, Ints
from .geodesics import geodesics_of

_OBLIQUE = 3.0  # slope to the ray of a surface whose points are distinguished from those behind it: 72 degrees


def grow(laplacian: LaplaceBeltrami, chosen: ArrayLike, distance: float) -> Bools:
    """Add all points within a distance along the surface to a set of points.

    Distances are those of `geodesic_distance`, so that the set does not extend to other sheets or components nearby.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    chosen : array_like, (k,) int or (n,) bool
        The set, which may be empty.
    distance : float
        Geodesic distance [L], not negative; infinity selects whole components.

    Returns
    -------
    ndarray, (n,) bool
        The points chosen, and those near them. Points left out of the operator are only in it if they were chosen.

    Raises
    ------
    InvalidPointsError
        Neither whole numbers below n nor n truth values.
    PointCloudError
        A distance that is negative or not a number.

    See Also
    --------
    geodesic_distance : The distances themselves.
    spectral.segment : Sets of points found by shape.

    Examples
    --------
    A cap of the unit sphere that ends pi / 3 from its pole is a quarter of it:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> print(mf.distance.grow(laplacian, [0], np.pi / 3).mean().round(2))
    0.25
    """
    mask = as_mask(chosen, len(laplacian.points))
    limit = real(distance)
    if not limit >= 0.0:
        raise PointCloudError(f"The distance to grow by is {distance!r}. Use a number that is not negative.")
    sources = np.flatnonzero(mask & (laplacian.component >= 0))
    if not len(sources):
        return mask.copy()
    return mask | np.isfinite(geodesics_of(laplacian).distance(sources, limit=limit))


def front_point(points: ArrayLike, eye: ArrayLike, direction: ArrayLike, reach: float) -> int:
    """Find the frontmost point along a ray: the nearest to its origin among those around it.

    Of points of one surface it is the one that is nearest to the ray.

    Parameters
    ----------
    points : array_like, (n, 3)
        Some may be infinite or NaN.
    eye, direction : array_like, (3,)
        Origin and direction of the ray.
    reach : float
        Largest distance of points from the ray [L]. Twice their spacing finds one wherever it meets the surface.

    Returns
    -------
    int
        Its index; -1 if there is none around the ray.

    Raises
    ------
    PointCloudError
        A direction of zero length, or a negative reach.

    See Also
    --------
    grow : Adds the points around it.

    Examples
    --------
    From above one sees the upper pole of the unit sphere, not the lower one:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> seen = mf.distance.front_point(points, eye=[0, 0, 5], direction=[0, 0, -1], reach=0.25)
    >>> print(points[seen, 2].round(1))
    1.0
    """
    positions = as_doubles(check_array(points, "Points", [(None, 3)], "Give numbers (n, 3)."))
    eye, direction = (
        as_doubles(check_array(given, "Eye and direction", [(3,)], "Give 3 numbers each."))
        for given in (eye, direction)
    )
    length, radius = np.linalg.norm(direction), real(reach)
    if not 0.0 < length < np.inf:
        raise PointCloudError("The direction of the ray has zero length. Give one that is not zero.")
    if not radius >= 0.0:
        raise PointCloudError(f"The radius around the ray is {reach!r}. It must not be negative.")
    axis = direction / length
    with np.errstate(invalid="ignore", over="ignore"):
        offset = positions - eye
        depth = offset @ axis
        away = np.linalg.norm(offset - depth[:, None] * axis, axis=1)
    near = np.flatnonzero((depth > 0.0) & (away <= radius))
    return int(near[(depth + _OBLIQUE * away)[near].argmin()]) if len(near) else -1


def opposite_ends(laplacian: LaplaceBeltrami, share: float = 0.03) -> tuple[Ints, Ints]:
    """Choose the points around both ends of the longest geodesic path, on the largest component.

    From anywhere the point that is farthest along the surface is such an end, and the one that is farthest from there
    is the other, exactly on trees and nearly on surfaces (the double sweep of graph diameters).

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    share : float
        Area around each end, as a share of that of the component; above 0, up to 1/4. Three points at least.

    Returns
    -------
    ndarray, (k,) int
        Points around one end, in ascending order.
    ndarray, (l,) int
        Points around the other; none is in both.

    Raises
    ------
    PointCloudError
        A share out of these bounds, or too few distinct points.

    See Also
    --------
    grow : Adds points within a distance to a set.
    deform.Deformer : Moves one end while the other stays.

    Examples
    --------
    On the unit sphere opposite ends are caps around opposite points:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> one, other = mf.distance.opposite_ends(laplacian, share=0.05)
    >>> print((points[one].mean(axis=0) @ points[other].mean(axis=0)).round(1))
    -0.9
    """
    if not 0.0 < real(share) <= 0.25:
        raise PointCloudError(f"The share of the area at each end is {share!r}. Use a number above 0, up to 0.25.")
    component, areas = laplacian.component, laplacian.areas
    known = component >= 0
    largest = np.flatnonzero(component == np.bincount(component[known], weights=areas[known]).argmax())
    geodesics = geodesics_of(laplacian)

    def lengths(start: int) -> Floats:
        found = geodesics.distance([start])[largest]
        return np.where(np.isfinite(found), found, 0.0)  # no end where no path leads

    offset = laplacian.points[largest] - laplacian.points[largest].mean(axis=0)
    one = lengths(largest[np.einsum("ij,ij->i", offset, offset).argmax()]).argmax()
    from_one = lengths(largest[one])
    from_other = lengths(largest[from_one.argmax()])
    ends: list[Ints] = []
    for near, far in ((from_one, from_other), (from_other, from_one)):
        order = np.argsort(near, kind="stable")
        order = order[near[order] < far[order]]
        count = np.searchsorted(np.cumsum(areas[largest[order]]), share * areas[largest].sum(), side="right")
        if len(order) < 3:
            raise PointCloudError(
                f"{len(largest)} points of the largest component are too few for two ends. Choose handles yourself."
            )
        ends.append(np.sort(largest[order[: max(count, 3)]]))
    first, second = ends
    return first, second
