"""Values on the surface along a path, by the distance along it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..arguments import as_array, as_doubles, check_array, check_positions
from ..errors import InvalidPointsError
from ..geometry import Prolongation
from ..operator import LaplaceBeltrami
from ..types import Array, Floats

_NEAR = 24  # points around each corner that values are taken from
_UNKNOWN = 1e-6  # share of points without a value above which a corner has none


class Profile(NamedTuple):
    """Values along a path.

    Attributes
    ----------
    distance : ndarray, (k,)
        Length of the path from its start to each corner [L].
    values : ndarray, (k,) or (k, m)
        NaN next to points without a value.
    """

    distance: Floats
    values: Array


def profile(laplacian: LaplaceBeltrami, path: ArrayLike, values: ArrayLike) -> Profile:
    """Interpolate a function along a path on the surface.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    path : array_like, (k, 3)
        Corners on or near the surface in their order [L], such as those of `geodesic_path` or of a section.
    values : array_like, (n,) or (n, m)
        The function at the points; those that are not finite are unknown.

    Returns
    -------
    Profile
        Points left out of the operator do not count.

    Raises
    ------
    InvalidPointsError
        Arrays of wrong shapes or types, a path of less than two corners, or one with corners that are not finite.

    See Also
    --------
    geodesic_path : Finds the shortest path between two points.
    cross_section : Finds the curves in a plane.
    values_on_mesh : Interpolates at any places on the surface.

    Examples
    --------
    The height along a way over the unit sphere, from its values at the points:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> laplacian = core.build_laplacian(points)
    >>> path = core.geodesic_path(laplacian, 0, 400)
    >>> found = core.profile(laplacian, path, points[:, 2])
    >>> print(np.abs(found.values - path[:, 2]).max() < 0.02)
    True
    """
    corners = check_positions(path, len(np.atleast_1d(as_array(path, "Corners"))), "corners", "corner")
    if len(corners) < 2:
        raise InvalidPointsError(f"The path has {len(corners)} corners. Give at least two.")
    count = len(laplacian.points)
    advice = f"Give one real number, or a row of them, for each of {count} points."
    given = as_doubles(check_array(values, "Values", [(count,), (count, None)], advice, "iufb"))
    near = _near(laplacian, corners)
    carrying = Prolongation(
        np.concatenate([laplacian.points[near], corners]),
        np.arange(len(near)),
        laplacian.normals[near],
        laplacian.component[near],
    )
    known = np.isfinite(given[near])
    carried = carrying.interpolate(np.where(known, given[near], 0.0))[len(near) :]
    unknown = np.abs(carrying.interpolate(np.where(known, 0.0, 1.0))[len(near) :]) > _UNKNOWN
    sides = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    return Profile(np.concatenate([[0.0], np.cumsum(sides)]), np.where(unknown, np.nan, carried))


def _near(laplacian: LaplaceBeltrami, corners: Floats) -> Array:
    """Return the points of the surface around corners, (m,) int."""
    kept = np.flatnonzero(laplacian.component >= 0)
    tree = cKDTree(laplacian.points[kept])
    found = tree.query(corners, k=np.arange(1, min(_NEAR, len(kept)) + 1), workers=-1)[1]
    return kept[np.unique(found)]
