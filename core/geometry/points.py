"""Checks and preparation of the input coordinates."""

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..arguments import Shape, as_array, as_doubles, check_array, check_finite
from ..cores import cores
from ..errors import InvalidPointsError, NotASurfaceError, TooFewPointsError
from ..linalg import eigvalsh
from ..types import Bools, Floats, Ints
from .agreed import Decisions
from .scaled import ScaledPoints

FEWEST = 5  # points of a boundary that is given
FEWEST_OF_SURFACE = 7  # different points: each has as many others as a quadric has coefficients
_SAME = 1e-9  # of the scale: closer points count as one, as areas between them would drown in rounding


def scale_points(points: Floats, decisions: Decisions | None = None) -> ScaledPoints:
    """Center, scale and merge duplicates, so that all that follows is free of units.

    Points, (n, 3), are from `check_points`; decisions are of the center and the scale. Fewer distinct points than a
    surface needs raise `TooFewPointsError`, points on one line `NotASurfaceError`.
    """
    decisions = decisions or Decisions()
    # Means over sorted numbers, so that rounding, and all that hangs on it, is the same in any order of the points.
    center = decisions.settle("center", lambda: np.sort(np.ascontiguousarray(points.T)).mean(axis=1))
    centered = np.subtract(points, center, order="C")
    scale = decisions.settle("scale", lambda: float(np.sqrt(np.mean(np.sort(np.sum(centered**2, axis=1))))))
    if scale > 0.0:
        centered /= scale
    distinct, first, inverse, order = _merge(centered)
    copies = np.bincount(inverse)
    if len(distinct) < FEWEST_OF_SURFACE:
        among = f" among {len(points)}" if len(distinct) < len(points) else ""
        raise TooFewPointsError(
            f"A surface needs at least {FEWEST_OF_SURFACE} different points, and there are {len(distinct)}{among}."
            " Add points."
        )
    spread = eigvalsh(distinct.T @ distinct / len(distinct))
    if spread[1] < 1e-10 * spread[2]:
        raise NotASurfaceError(
            f"All {len(points)} points lie on a straight line, so they have no area. Use points of a surface."
        )
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return ScaledPoints(distinct[order], scale, rank[inverse], copies[order], first[order])


def order_of(points: Floats) -> Ints:
    """Return the order of points, (n, 3), by x, those of one x by y, and then by z: the same however they are given."""
    order = np.argsort(points[:, 0])
    if (np.diff(points[order, 0]) > 0.0).all():
        return order
    return np.lexsort(points.T[::-1])


def _merge(points: Floats) -> tuple[Floats, Ints, Ints, Ints]:
    """Take points at one place, in scaled coordinates, as one.

    Return the m distinct ones, the first point at each of their places, (m,) int, the place of each point, (n,) int,
    and an order in which places follow each other that are near, (m,) int.
    """
    order = order_of(points)
    ordered = points[order]
    new = np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))
    distinct, first, inverse = ordered[new], order[new], np.empty_like(order)
    inverse[order] = np.cumsum(new) - 1
    while True:
        tree = cKDTree(distinct)
        distance, near = tree.query(distinct, k=2, distance_upper_bound=_SAME, workers=cores())
        close = np.flatnonzero(np.isfinite(distance[:, 1]))
        if not len(close):
            break
        # Every one of them is joined to its nearest, so that each round leaves at most half of them.
        joined = sparse.csr_array(
            (np.ones(len(close), dtype=bool), (close, near[close, 1])), shape=(len(distinct),) * 2
        )
        _, kept, place = np.unique(
            connected_components(joined, directed=False)[1], return_index=True, return_inverse=True
        )
        distinct, first, inverse = distinct[kept], first[kept], place[inverse]
    return distinct, first, inverse, tree.indices


def as_mask(chosen: ArrayLike, count: int) -> Bools:
    """Return a set of points, an index, (k,) indices or an (n,) bool mask, as a mask.

    Neither whole numbers below n nor truth values raise `InvalidPointsError`.
    """
    given = as_array(chosen, "Sets of points")
    if given.dtype == bool and given.shape == (count,):
        return given
    mask = np.zeros(count, dtype=bool)
    if given.size == 0:
        return mask
    if given.ndim > 1 or given.dtype.kind not in "iu" or given.min() < -count or given.max() >= count:
        raise InvalidPointsError(
            f"A set of points has the shape {given.shape} and type {given.dtype}. Give whole numbers below"
            f" {count}, or {count} truth values."
        )
    mask[given] = True
    return mask


def as_indices(chosen: ArrayLike, count: int, name: str) -> Ints:
    """Return a set of points, an index, (k,) indices or an (n,) bool mask, as indices in the order given.

    Other numbers, or some points named several times, raise `InvalidPointsError`.
    """
    mask = as_mask(chosen, count)
    given = np.atleast_1d(chosen)
    if given.dtype == bool or given.size == 0:
        return np.flatnonzero(mask)
    index = given.astype(np.int64) % count
    twice = len(index) - int(np.count_nonzero(mask))
    if twice:
        raise InvalidPointsError(
            f"{twice} of the {len(index)} {name} are named more than once. Name every point a single time."
        )
    return index


def check_boundary(chosen: ArrayLike, count: int, first: Ints) -> Bools:
    """Check a set of points at the boundary, (k,) indices or a (count,) mask, and return the mask of some, (m,).

    What is no set of points, or has too few different ones, raises `InvalidPointsError`.
    """
    mask = as_mask(chosen, count)[first]
    found = np.count_nonzero(mask)
    if 0 < found < FEWEST:
        raise InvalidPointsError(f"The boundary is given by {found} different points. Give at least {FEWEST}, or none.")
    return mask


def check_distances(distances: ArrayLike, count: int) -> Floats:
    """Check distances to a boundary, (count,), infinite where there is none near.

    Another shape, negative numbers, or NaN raise `InvalidPointsError`.
    """
    advice = f"Give {count} numbers that are not negative, infinity where there is no boundary near."
    given = check_array(distances, "Distances to the boundary", [(count,)], advice)
    bad = int(np.count_nonzero(~(given >= 0.0)))
    if bad:
        raise InvalidPointsError(f"{bad} of {count} distances to the boundary are negative or NaN. {advice}")
    return as_doubles(given)


def check_values(values: ArrayLike, count: int, columns: bool = True) -> Floats:
    """Check functions on the points and return them, (count,) or with columns (count, k), in double precision.

    Another shape, other than real numbers, or those that are not finite raise `InvalidPointsError`.
    """
    shapes: list[Shape] = [(count,), (count, None)] if columns else [(count,)]
    row = "row of real numbers" if columns else "real number"
    given = as_doubles(check_array(values, "Values", shapes, f"Give one {row} for each of {count} points.", "iufb"))
    check_finite(given, "values", "Replace them.")
    return given
