"""The shortest path along the surface between two points, as a polygon on the surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_banded

from ..arguments import as_doubles, check_array, check_finite, whole
from ..errors import ComponentError, InvalidPointsError
from ..operator import ImplicitSurface, LaplaceBeltrami
from ..progress import ends_at_one
from ..types import Bools, Floats, Ints, Progress
from .geodesics import geodesics_of

_STEP = 0.5  # length of the sides of the polygon, in spacings
_ROUNDS = 60  # of straightening, at most
_STRAIGHT = 1e-7  # relative change of the length in three rounds, at which the path is straight
_ONTO = 2  # projections onto the surface in each round
_FARTHEST = 1.0  # spacings that a point of the path moves in one round, at most
_MOST = 20_000  # sides of the polygon


@ends_at_one
def geodesic_path(
    laplacian: LaplaceBeltrami,
    start: int,
    end: int,
    *,
    progress: Progress | None = None,
) -> Floats:
    """Find the shortest path along the surface from a point to another.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    start, end : int
        Two of them.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (k, 3)
        Corners of a polygon on the surface [L], about half a spacing apart: the first is the point it starts at, the
        last the one it ends at, even where noise was smoothed between them.

    Raises
    ------
    ComponentError
        The points lie on different components.
    InvalidPointsError
        Points that do not exist, or that the operator left out.

    See Also
    --------
    geodesic_distance : Distances of all points, without paths.
    polygon_length : The length of the path.

    Notes
    -----
    The shortest path over pairs of points, as of `geodesic_distance`, is straightened on the surface, round by round:
    of a displacement across the path, the second derivative is the geodesic curvature that it takes away. Where it
    meets a boundary it runs along it. Of two paths of nearly equal length around both sides of something, it may be the
    one that is longer by 0.2 %.

    Examples
    --------
    From one pole of the unit sphere to the point that is farthest from it, nearly pi away:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> path = mf.distance.geodesic_path(mf.build_laplacian(points), 0, 799)
    >>> print((mf.distance.polygon_length(path) / np.arccos(points[0] @ points[799])).round(2))
    1.0
    """
    report = progress or (lambda stage, fraction: None)
    first, last = _checked(laplacian, start, end)
    ends = laplacian.points[[first, last]]
    if first == last:
        return ends
    corners = geodesics_of(laplacian, progress).corners(first, last)
    report("Path", 0.5)
    path = _Path(laplacian, corners)
    path.straighten(lambda share: report("Path", 0.5 + 0.5 * share))
    return np.concatenate([ends[:1], path.places()[1:-1], ends[1:]])


def polygon_length(corners: ArrayLike) -> float:
    """Return the length of a polygon.

    Parameters
    ----------
    corners : array_like, (k, 3)
        In their order [L].

    Returns
    -------
    float
        [L]

    Raises
    ------
    InvalidPointsError
        Corners of a wrong shape, or not finite.

    See Also
    --------
    geodesic_path : Finds one on the surface.

    Examples
    --------
    From one pole of the unit sphere straight to the other:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> print(round(mf.distance.polygon_length(points[[0, 799]]), 1))
    2.0
    """
    advice = "Give x, y, z of each corner."
    places = as_doubles(check_array(corners, "Corners", [(None, 3)], advice))
    check_finite(places, "corners", advice)
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def _checked(laplacian: LaplaceBeltrami, start: Any, end: Any) -> tuple[int, int]:
    """Return the two points, or say what is wrong with them."""
    count = len(laplacian.points)
    found = [whole(number) for number in (start, end)]
    if not all(0 <= number < count for number in found):
        raise InvalidPointsError(
            f"The path is to lead from {start!r} to {end!r}. Give two whole numbers from 0 to {count - 1}."
        )
    first, last = map(int, found)
    one, other = laplacian.component[first], laplacian.component[last]
    if min(one, other) < 0:
        raise InvalidPointsError(
            f"{int(one < 0) + int(other < 0)} of the 2 ends of the path are points that the operator left out, because"
            " they are outliers. Choose points of the surface."
        )
    if one != other:
        raise ComponentError(
            f"The points {first} and {last} lie on two components, {one} and {other}, so that no path along the surface"
            " connects them. Choose points of one component."
        )
    return first, last


class _Path:
    """A polygon on the surface with fixed ends, which is straightened: through points of a path nearly the shortest."""

    def __init__(self, laplacian: LaplaceBeltrami, corners: Ints) -> None:
        given = laplacian.surface_points[corners]
        unit = polygon_length(given) / (len(given) - 1)
        self._surface = ImplicitSurface(laplacian, unit)
        given = self._surface.scaled(given)
        spacing = self._surface.spacing[self._surface.nearest(given)]
        sides = np.linalg.norm(np.diff(given, axis=0), axis=1) / (0.5 * (spacing[1:] + spacing[:-1]))
        self._count = int(np.clip(np.ceil(sides.sum() / _STEP), 2, _MOST)) + 1
        self._points = self._onto(_resampled(given, self._count))

    def places(self) -> Floats:
        """Return the corners, (k, 3) [L]."""
        return self._surface.placed(self._points)

    def straighten(self, report: Any) -> None:
        """Shorten the path until it does not become shorter any more."""
        best, shortest, history = self._points, polygon_length(self._points), [np.inf] * 3
        for number in range(_ROUNDS):
            report(number / _ROUNDS)
            self._points = self._onto(_resampled(self._points + self._displacement(), self._count))
            length = polygon_length(self._points)
            if length < shortest:
                best, shortest = self._points, length
            history.append(shortest)
            if history[-4] - shortest < _STRAIGHT * shortest:
                break
        self._points = best

    def _displacement(self) -> Floats:
        """Return the displacement across the path that takes its geodesic curvature away, (k, 3), to first order."""
        points = self._points
        there = self._surface.heights(points)
        along = points[2:] - points[:-2]
        across = np.cross(there.normal[1:-1], along)
        across /= np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None]
        bend = np.einsum("kc,kc->k", points[2:] - 2.0 * points[1:-1] + points[:-2], across)
        outward = np.einsum("kc,kc->k", there.outward[1:-1], across) * bend
        shift = _smooth_shift(bend, (there.beyond[1:-1] > -1e-6) & (outward > 0.0))
        limit = _FARTHEST * there.spacing[1:-1]
        shift *= min(1.0, float(np.min(limit / np.maximum(np.abs(shift), 1e-300))))
        result = np.zeros_like(points)
        result[1:-1] = shift[:, None] * across
        return result

    def _onto(self, points: Floats) -> Floats:
        """Return places projected onto the surface, those beyond its boundary onto that; the ends stay."""
        inner = points[1:-1].copy()
        for _ in range(_ONTO):
            there = self._surface.heights(inner)
            inner -= np.clip(there.height, -there.spacing, there.spacing)[:, None] * there.normal
            inner -= np.clip(there.beyond, 0.0, there.spacing)[:, None] * there.outward
        return np.concatenate([points[:1], inner, points[-1:]])


def _smooth_shift(bend: Floats, held: Bools) -> Floats:
    """Return shifts, (k,), of which the negated second differences are the given ones; zero where held."""
    bands = np.ones((3, len(bend))) * np.array([[-1.0], [2.0], [-1.0]])
    bands[1, held] = 1.0
    bands[0, 1:][held[:-1]] = 0.0
    bands[2, :-1][held[1:]] = 0.0
    result: Floats = solve_banded((1, 1), bands, np.where(held, 0.0, bend))
    return result


def _resampled(corners: Floats, count: int) -> Floats:
    """Return so many corners of equal distance along a polygon."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    places = np.linspace(0.0, length[-1], count)
    return np.column_stack([np.interp(places, length, column) for column in corners.T])
