"""Values on the surface along a path, by the distance along it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..arguments import as_array, as_doubles, check_array, check_positions
from ..cores import cores
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
    uncertainty : ndarray, (k,) or (k, m)
        Within which the true values are expected; NaN where there is none.
    """

    distance: Floats
    values: Array
    uncertainty: Array


def profile(laplacian: LaplaceBeltrami, path: ArrayLike, values: ArrayLike) -> Profile:
    """Interpolate a function along a path on the surface.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    path : array_like, (k, 3)
        Corners on or near the surface in their order [L], such as those of `distance.geodesic_path` or of a section.
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
    distance.geodesic_path : Finds the shortest path between two points.
    cross_section : Finds the curves in a plane.
    surface.values_on_mesh : Interpolates at any places on the surface.

    Notes
    -----
    The uncertainty is measured: the quadratic mean, over the points around each corner, of how far off the values are
    that each half of the points gives at the others. It holds both noise and what the spacing of the points misses, and
    is about twice the error, since half of the points are farther apart than all.

    Examples
    --------
    The height along a way over the unit sphere, from its values at the points:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> path = mf.distance.geodesic_path(laplacian, 0, 400)
    >>> found = mf.measure.profile(laplacian, path, points[:, 2])
    >>> print(np.abs(found.values - path[:, 2]).max() < 0.02)
    True
    """
    corners = check_positions(path, len(np.atleast_1d(as_array(path, "Corners"))), "corners", "corner")
    if len(corners) < 2:
        raise InvalidPointsError(f"The path has {len(corners)} corners. Give at least two.")
    count = len(laplacian.points)
    advice = f"Give one real number, or a row of them, for each of {count} points."
    given = as_doubles(check_array(values, "Values", [(count,), (count, None)], advice, "iufb"))
    around = _around(laplacian, corners)
    near, place = np.unique(around, return_inverse=True)
    own = given[near]
    values = _interpolated(laplacian, near, np.arange(len(near)), own, corners)[len(near) :]
    off = _missed(laplacian, near, own)[place.reshape(around.shape)]
    known = np.isfinite(off)
    squares = np.sum(np.where(known, off, 0.0) ** 2, axis=1)
    uncertainty = np.sqrt(squares / np.maximum(np.count_nonzero(known, axis=1), 1))
    uncertain = known.any(axis=1) & np.isfinite(values)
    sides = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    return Profile(np.concatenate([[0.0], np.cumsum(sides)]), values, np.where(uncertain, uncertainty, np.nan))


def _around(laplacian: LaplaceBeltrami, corners: Floats) -> Array:
    """Return the points of the surface around each corner, (k, w) int."""
    kept = np.flatnonzero(laplacian.component >= 0)
    tree = cKDTree(laplacian.points[kept])
    found = tree.query(corners, k=np.arange(1, min(_NEAR, len(kept)) + 1), workers=cores())[1]
    return kept[found]


def _interpolated(laplacian: LaplaceBeltrami, near: Array, chosen: Array, values: Array, more: Floats) -> Array:
    """Interpolate values at some points of the surface, from some of these, to all of them and to more places."""
    carrying = Prolongation(
        np.concatenate([laplacian.points[near], more]),
        chosen,
        laplacian.normals[near[chosen]],
        laplacian.component[near[chosen]],
    )
    known = np.isfinite(values[chosen])
    carried = carrying.interpolate(np.where(known, values[chosen], 0.0))
    unknown = np.abs(carrying.interpolate(np.where(known, 0.0, 1.0))) > _UNKNOWN
    return np.where(unknown, np.nan, carried)


def _missed(laplacian: LaplaceBeltrami, near: Array, values: Array) -> Array:
    """Return how far off the values are that each half of some points gives at the others, NaN where unknown."""
    half = np.zeros(len(near), dtype=bool)  # at random, but whatever the order of the points
    half[np.lexsort(laplacian.points[near].T)] = np.random.default_rng(0).permutation(len(near)) % 2 == 0
    missed = np.full(values.shape, np.nan)
    for chosen in (half, ~half):
        if chosen.any():
            found = _interpolated(laplacian, near, np.flatnonzero(chosen), values, np.empty((0, 3)))
            missed[~chosen] = (found - values)[~chosen]
    return missed
