"""Sets of points: grown by distance along the surface, and around its ends."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import dijkstra

from ..arguments import as_doubles, check_array, real
from ..errors import PointCloudError
from ..geometry import as_mask
from ..operator import LaplaceBeltrami
from ..types import Bools, Floats, Ints
from .geodesics import Geodesics
from .graph import near_graph

_OBLIQUE = 3.0  # slope to the ray of a surface whose points are told from those behind it: 72 degrees
_NEIGHBORS = 20  # so many directions make paths at most 2 % longer than the way along the surface


def grow(laplacian: LaplaceBeltrami, chosen: ArrayLike, distance: float) -> Bools:
    """Add all points within a distance along the surface to a set of points.

    Distances are those of `geodesic_distance`, so that the set does not jump to another sheet, or another component,
    that passes nearby.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    chosen : array_like, (k,) int or (n,) bool
        The set, which may be empty.
    distance : float
        How far to grow [L], not negative; infinity selects whole components.

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
    segment : Sets of points found by shape.

    Examples
    --------
    A cap of the unit sphere that ends pi / 3 from its pole is a quarter of it:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> laplacian = core.build_laplacian(points)
    >>> print(core.grow(laplacian, [0], np.pi / 3).mean().round(2))
    0.25
    """
    mask = as_mask(chosen, len(laplacian.points))
    reach = real(distance)
    if not reach >= 0.0:
        raise PointCloudError(f"The distance to grow by is {distance!r}. Use a number that is not negative.")
    sources = np.flatnonzero(mask & (laplacian.component >= 0))
    if not len(sources):
        return mask.copy()
    return mask | np.isfinite(Geodesics(laplacian).distance(sources, limit=reach))


def front_point(points: ArrayLike, eye: ArrayLike, direction: ArrayLike, reach: float) -> int:
    """Find the point that one sees along a ray: the nearest to the eye among those around it.

    Of points of one surface it is the one that is nearest to the ray.

    Parameters
    ----------
    points : array_like, (n, 3)
        Some may be infinite or no numbers.
    eye, direction : array_like, (3,)
        Where the ray begins and where it goes.
    reach : float
        How far from the ray the points may be [L]. Twice their spacing finds one wherever it meets the surface.

    Returns
    -------
    int
        Its number; -1 if there is none around the ray.

    Raises
    ------
    PointCloudError
        A direction of no length.

    See Also
    --------
    grow : Takes the points around it in.

    Examples
    --------
    From above one sees the upper pole of the unit sphere, not the lower one:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> seen = core.front_point(points, eye=[0, 0, 5], direction=[0, 0, -1], reach=0.25)
    >>> print(points[seen, 2].round(1))
    1.0
    """
    places, eye, direction = _vectors(points, "points", 2), _vectors(eye, "eye", 1), _vectors(direction, "direction", 1)
    length, reach = np.linalg.norm(direction), real(reach)
    if not 0.0 < length < np.inf:
        raise PointCloudError("The direction of the ray has no length. Give one that is not zero.")
    if not reach >= 0.0:
        raise PointCloudError(f"The reach around the ray is {reach!r}. Use a number that is not negative.")
    axis = direction / length
    with np.errstate(invalid="ignore", over="ignore"):
        offset = places - eye
        depth = offset @ axis
        away = np.linalg.norm(offset - depth[:, None] * axis, axis=1)
    near = np.flatnonzero((depth > 0.0) & (away <= reach))
    return int(near[(depth + _OBLIQUE * away)[near].argmin()]) if len(near) else -1


def _vectors(given: Any, name: str, dimensions: int) -> Floats:
    """Return one vector, (3,), or several, (n, 3), in double precision; their numbers may be infinite or none."""
    shape, text = ((None, 3), "(n, 3)") if dimensions == 2 else ((3,), "(3,)")
    return as_doubles(check_array(given, name.capitalize(), [shape], f"Give numbers {text}."))


def opposite_ends(laplacian: LaplaceBeltrami, share: float = 0.03) -> tuple[Ints, Ints]:
    """Choose the points around both ends of the longest way along the surface, on its largest component.

    From anywhere the point that is farthest along the surface is such an end, and the one that is farthest from there
    is the other; so it is exactly on trees, and nearly on surfaces (the double sweep of graph diameters).

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
        A share out of these bounds, or too few points at different places.

    See Also
    --------
    grow : Adds points within a distance to a set.
    Deformer : Moves one end while the other stays.

    Examples
    --------
    On the unit sphere opposite ends are caps around opposite points:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> laplacian = core.build_laplacian(points)
    >>> one, other = core.opposite_ends(laplacian, share=0.05)
    >>> print((points[one].mean(axis=0) @ points[other].mean(axis=0)).round(1))
    -0.9
    """
    if not 0.0 < real(share) <= 0.25:
        raise PointCloudError(f"The share of the area at each end is {share!r}. Use a number above 0, up to 0.25.")
    component, areas = laplacian.component, laplacian.areas
    known = component >= 0
    largest = np.flatnonzero(component == np.bincount(component[known], weights=areas[known]).argmax())
    graph = near_graph(laplacian, _NEIGHBORS)

    def ways(start: int) -> Floats:
        return dijkstra(graph.lengths, directed=False, indices=graph.place[start])[graph.place[largest]]

    offset = laplacian.points[largest] - laplacian.points[largest].mean(axis=0)
    one = ways(largest[np.einsum("ij,ij->i", offset, offset).argmax()]).argmax()
    from_one = ways(largest[one])
    from_other = ways(largest[from_one.argmax()])
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
