"""Which points of a surface are seen from a view, and which lie behind it."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_doubles, check_array
from ..errors import PointCloudError
from ..geometry import as_mask, frames
from ..types import Bools, Floats, Ints

_OBLIQUE = 3.0  # slope to the ray of a surface without normals that is told from what lies behind it: 72 degrees
_OFF = 0.5  # radii that a point is off the plane of a disc at least, to lie behind it
_FARTHEST = 2.0**30  # cells, beyond which all points share the last one


def seen_points(
    points: ArrayLike,
    radii: ArrayLike,
    direction: ArrayLike,
    eye: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    among: ArrayLike | None = None,
) -> Bools:
    """Find the points that are seen: no disc of another one lies between them and the eye.

    Discs are looked up in the image, in cells of their size, the frontmost of each cell.

    Parameters
    ----------
    points : array_like, (n, 3)
        Rows that are not finite are neither seen nor hide others.
    radii : array_like, (n,) or a number
        Of the discs [L], as large as that they leave no holes.
    direction : array_like, (3,)
        Direction of view.
    eye : array_like, (3,), optional
        The center of a perspective view, in which what lies behind it is not seen; without it rays are parallel.
    normals : array_like, (n, 3), optional
        Of the surface, to either side, of any length. They tell points of a surface that is seen from the side from
        such behind it; without them, or where they are zero, its slope does.
    among : array_like, (n,) bool or (k,) int, optional
        Points that are asked for; the others hide them, and count as not seen.

    Returns
    -------
    ndarray, (n,) bool

    Raises
    ------
    PointCloudError
        A direction of zero length, or what does not fit the points.

    See Also
    --------
    front_point : The frontmost point along one ray.

    Examples
    --------
    From above one sees the upper half of the unit sphere:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> seen = mf.distance.seen_points(points, 0.12, direction=[0, 0, -1], normals=points)
    >>> print(points[seen, 2].min() > -0.2, points[~seen, 2].max() < 0.2)
    True True
    """
    places = as_doubles(check_array(points, "Points", [(None, 3)], "Give numbers (n, 3)."))
    count = len(places)
    advice = f"Give one number, or one for each of {count} points."
    radius = np.broadcast_to(as_doubles(check_array(radii, "Radii", [(), (count,)], advice)), count)
    axis = as_doubles(check_array(direction, "Directions of view", [(3,)], "Give 3 numbers."))
    length = np.linalg.norm(axis)
    if not 0.0 < length < np.inf:
        raise PointCloudError("The direction of view has zero length. Give one that is not zero.")
    axis = axis / length
    offset = places if eye is None else places - as_doubles(check_array(eye, "Eyes", [(3,)], "Give 3 numbers."))
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        depth = offset @ axis
        far = np.ones(count) if eye is None else depth
        rays = np.tile(axis, (count, 1)) if eye is None else offset / depth[:, None]
        image, reach = offset @ frames(axis[None])[0, :, 1:] / far[:, None], radius / far
        shown = np.isfinite(image).all(axis=1) & np.isfinite(reach) & (reach > 0.0) & (far > 0.0)
    advice = f"Give {count} vectors."
    given = np.zeros((count, 3)) if normals is None else check_array(normals, "Normals", [(count, 3)], advice)
    facing = np.nan_to_num(as_doubles(given), posinf=0.0, neginf=0.0)
    size = np.linalg.norm(facing, axis=1, keepdims=True)
    facing = np.divide(facing, size, out=np.zeros_like(facing), where=size > 0.0)
    seen = shown.copy() if among is None else shown & as_mask(among, count)
    if not shown.any():
        return seen
    least = reach[shown].min()
    level = np.full(count, -1)
    level[shown] = np.floor(np.log2(reach[shown] / least))
    for number in np.unique(level[shown]):
        cell, hiding = least * 2.0**number, np.flatnonzero(level == number)
        for asked, other in _pairs(image / cell, depth, hiding, np.flatnonzero(seen)):
            known = seen[asked]
            asked, other = asked[known], other[known]
            behind = _is_behind(places, radius, rays, facing, axis, asked, other)
            seen[asked[behind]] = False
    return seen


def _pairs(image: Floats, depth: Floats, hiding: Ints, asked: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Yield points that are asked for with the frontmost hiding one of a cell of the image around them, (k,) each."""
    with np.errstate(invalid="ignore"):
        cells = np.clip(np.floor(image), -_FARTHEST, _FARTHEST)
    keys = np.zeros(len(image), dtype=np.int64)
    used = np.union1d(hiding, asked)
    keys[used] = cells[used, 0].astype(np.int64) * np.int64(2 * _FARTHEST + 8) + cells[used, 1].astype(np.int64)
    order = hiding[np.lexsort((depth[hiding], keys[hiding]))]
    held, first = np.unique(keys[order], return_index=True)
    front = order[first]
    for right in range(-2, 3):
        for up in range(-2, 3):
            wanted = keys[asked] + right * np.int64(2 * _FARTHEST + 8) + up
            place = np.minimum(np.searchsorted(held, wanted), len(held) - 1)
            found = held[place] == wanted
            yield asked[found], front[place[found]]


def _is_behind(
    places: Floats, radius: Floats, rays: Floats, facing: Floats, axis: Floats, asked: Ints, other: Ints
) -> Bools:
    """Return whether another point, as a disc that faces the viewer, is before each one that is asked for, (k,) bool.

    The next points of a surface that is seen from the side are before each other, too, but in the plane of their discs.
    """
    step, normal, size = places[asked] - places[other], facing[other], radius[other]
    back = step @ axis
    away = np.linalg.norm(step - back[:, None] * rays[asked], axis=1)
    off = np.abs(np.einsum("ij,ij->i", step, normal)) > _OFF * size
    behind = np.where(normal.any(axis=1), off, back > size + _OBLIQUE * away)
    return (away <= size) & (back > size) & behind
