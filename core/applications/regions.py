"""Area, boundary and middle of a part of the surface that is given by its points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree
from scipy.special import erfinv, expit

from ..algebra import blocks
from ..arguments import as_array, check_array, check_finite
from ..errors import InvalidPointsError
from ..geometry import SMOOTH, as_mask, move_apart
from ..operator import LaplaceBeltrami
from ..types import Bools, Floats, Ints, Progress
from .graph import mean_spacing

_SPREAD = 2.0  # spacings over which the step between members and others is smoothed first
_STRIP = 2.0  # spacings from the line between them within which points tell where it is
_WINDOWS = 4.0, 9.0  # spacings along the line over which a parabola is fitted: at first, and at most
_TURN = 0.7  # radii of the line's curvature within which a parabola is close to it
_SHORTEST = 3.0  # spacings of such a window at least
_BLUR = 0.2  # spacings over which the chance to be a member falls, in the fit
_PRIOR = np.array([1e-3, 0.05, 1.0])  # how much the fit resists an offset, a slope and a curvature
_LARGEST = np.array([1.0, 1.0, 0.5])  # change of each in a step, and in all
_ROUNDS = 8  # of Newton's iteration
_WIDE = 4.0  # spacings on both sides of the line over which areas are summed to its length
_NARROW = 3.0  # spacings from the boundary of the surface over which areas are summed to its length, and twice that
_THIN = 0.7  # of the depth of a thin part that may be taken for that
_TURNS = 0.06, 0.09  # by which the line turns along a spacing, until plain sums are nearer to the area
_VARIANCE = 1.0 / 7.0  # of the derivative of the step
_MOMENTS = 0.1  # share of an area that may be wrong where trust is a half
_ROUGH = 0.04  # of the height of noise, over the spacing: what it adds to areas
_ROUNDED = 6.0  # of noise times spacing times the squared mean curvature: what smoothing it takes from edges
STRIP = 0.2  # of the spacing, along the boundary of the surface: where that is
_AREA_OFF = 1.0  # of the area of a square of one spacing: what each such piece of the line leaves open, two deviations
LENGTH_OFF = 0.01, 0.05  # of the length of the line, and of the boundary of the surface
_NEAREST = 24  # pieces of the line by which the distance of a point is measured
_PARALLEL = 0.3  # cosine between the directions across the line at two points, at least, if it is one line
_STEEP = 1.5  # length of a chord over that in the tangent plane, at most, on one sheet
_LEAST = 1e-6  # weight of the pieces near a point, relative to that of one beside it
_SURE = 1.0 - 1e-9  # of the smoothed step
_BLOCK = 1 << 11  # windows at one time


@dataclass(frozen=True)
class Region:
    """Measures of a part of the surface.

    Attributes
    ----------
    area : float
        [L^2]
    boundary_length : float
        Length of the line between members and others, and of the surface's own boundary next to members [L].
    centroid : ndarray, (3,)
        Mean of positions by area [L].
    area_uncertainty, length_uncertainty : float
        The true values are expected within these: a point tells only by its spacing where the line is, and areas are
        as good as the trust in them, and noise, allow.
    """

    area: float
    boundary_length: float
    centroid: Floats
    area_uncertainty: float
    length_uncertainty: float


def measure_region(laplacian: LaplaceBeltrami, members: ArrayLike, *, progress: Progress | None = None) -> Region:
    """Measure the area of a part of the surface, the length of its boundary, and its centroid.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    members : array_like, (n,) bool, (k,) int or (n,) float
        The points of the part, or the share of each, from 0 to 1, that belongs to it.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    Region
        Points left out of the operator do not count.

    Raises
    ------
    InvalidPointsError
        Members of another kind, none of them on the surface, or shares beyond 0 and 1.

    See Also
    --------
    enclosed_volume : The volume within a surface.
    grow : Finds the points within a distance.

    Notes
    -----
    The areas of members add up to that of the part but for the ragged edge of their cells: by chance half a percent
    for a cap of 1,000 points. So the line between members and others is found first, as the most likely parabola in a
    window around each point next to it, by logistic regression; the area is then that of all points by a smooth step
    of their distance from the line, and the length that by the derivative of the step (the coarea formula). Where the
    part reaches the boundary of the surface, the length of that is measured in the same way, from the side that there
    is. Corners are rounded by a few spacings.

    Examples
    --------
    A hemisphere of the unit sphere has the area 2 pi, and its boundary is as long:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> found = core.measure_region(core.build_laplacian(points), points[:, 2] > 0)
    >>> print(round(found.area / np.pi, 1), round(found.boundary_length / np.pi, 1))
    2.0 2.0
    """
    report = progress or (lambda stage, fraction: None)
    share = _shares(laplacian, members)
    known, spacing = laplacian.component >= 0, mean_spacing(laplacian)
    report("Line", 0.0)
    line = _find_line(laplacian, share > 0.5, spacing, lambda done: report("Line", done))
    report("Areas", 0.9)
    areas = np.where(known, laplacian.areas, 0.0)
    inside, width = _from_line(laplacian, line, share > 0.5, spacing)
    step, second = _step(inside / width), float(areas @ (_second(inside / width) / width**2))
    length = float(areas @ (_slope(inside / width) / width))
    plain, smooth = float(areas @ share), float(areas @ step - 0.5 * _VARIANCE * (areas @ _second(inside / width)))
    # Where the line turns within a few spacings, the parabolas are off by more than the cells.
    turn = abs(second) / max(length, 1e-300) * float(np.median(spacing))
    fine = np.clip((_TURNS[1] - turn) / (_TURNS[1] - _TURNS[0]), 0.0, 1.0) if np.all(share % 1.0 == 0.0) else 0.0
    area = fine * smooth + (1.0 - fine) * plain
    owned = boundary_lengths(areas * step, laplacian.boundary_distance, spacing)
    own, doubt = float(owned.sum()), float(share @ area_doubts(laplacian, spacing) + STRIP * abs(spacing @ owned))
    weight = areas * (fine * step + (1.0 - fine) * share)
    squared = areas @ (_slope(inside / width) / width * spacing**3)
    return Region(
        area=area,
        boundary_length=length + own,
        centroid=weight @ laplacian.surface_points / max(weight.sum(), 1e-300),
        area_uncertainty=float(np.hypot(_AREA_OFF * np.sqrt(squared), doubt)),
        length_uncertainty=float(np.dot(LENGTH_OFF, (length * (_WIDE * spacing / width).max() ** 1.5, own))),
    )


def area_doubts(laplacian: LaplaceBeltrami, spacing: Floats) -> Floats:
    """Return by how much the area of each point may be wrong, (n,): by missed moments, and by noise."""
    missed = _MOMENTS * np.sqrt(1.0 / np.maximum(laplacian.trust, 1e-6) - 1.0)
    noise = np.linalg.norm(laplacian.surface_points - laplacian.points, axis=1)
    bend = 0.5 * np.trace(laplacian.shape_operator, axis1=1, axis2=2)
    rough = noise / spacing * (_ROUGH + _ROUNDED * (spacing * bend) ** 2)
    result: Floats = laplacian.areas * np.minimum(missed + rough, 1.0)
    return result


def _shares(laplacian: LaplaceBeltrami, members: ArrayLike) -> Floats:
    """Return the share of each point, (n,); zero for points left out."""
    count = len(laplacian.points)
    given = as_array(members, "Members")
    if given.dtype.kind == "f" and given.size:
        share = check_array(given, "Members", [(count,)], f"Give a share from 0 to 1 for each of {count} points.")
        check_finite(share, "members", "Give a share from 0 to 1 for each.")
        if share.min() < 0.0 or share.max() > 1.0:
            raise InvalidPointsError(
                f"The shares of members reach from {share.min():.3g} to {share.max():.3g}. Give numbers from 0 to 1."
            )
    else:
        share = as_mask(members, count)
    result: Floats = np.where(laplacian.component >= 0, share, 0.0).astype(np.float64)
    if not result.any():
        raise InvalidPointsError(
            f"None of the {count} points of the surface is a member, so there is nothing to measure. Choose some."
        )
    return result


def _from_line(laplacian: LaplaceBeltrami, line: _Line, members: Bools, spacing: Floats) -> tuple[Floats, Floats]:
    """Return the distance of each point from the line, positive at members, and the width to sum over, (n,) each."""
    far = np.where(members, np.inf, -np.inf)
    if not len(line.feet):
        return far, _WIDE * spacing
    rows, signed, width = line.distances(laplacian)
    inside, used = far, spacing.copy()
    inside[rows], used[rows] = signed, width
    deep = np.where(np.isin(laplacian.component, line.component), inside / used, 0.0)
    thin = min(float(deep[members].max(initial=0.0)), float(-deep[~members].min(initial=0.0)))
    return inside, used * min(_WIDE, max(_THIN * thin, 1.0))


def _step(x: Floats) -> Floats:
    """Return a smooth step from 0 at -1 to 1 at 1."""
    x = np.clip(x, -1.0, 1.0)
    return 0.5 + x * (15.0 - x**2 * (10.0 - 3.0 * x**2)) / 16.0


def _slope(x: Floats) -> Floats:
    """Return the derivative of the step."""
    return np.where(np.abs(x) < 1.0, 15.0 / 16.0 * (1.0 - np.clip(x, -1.0, 1.0) ** 2) ** 2, 0.0)


def _second(x: Floats) -> Floats:
    """Return the second derivative of the step."""
    x = np.clip(x, -1.0, 1.0)
    return -15.0 / 4.0 * x * (1.0 - x**2)


def _edge(x: Floats) -> Floats:
    """Return a kernel that falls smoothly from 0 to 1, with the integral 1 there."""
    return 2.0 * _slope(np.maximum(x, 0.0))


def boundary_lengths(areas: Floats, distance: Floats, spacing: Floats) -> Floats:
    """Return the length of the surface's boundary next to each point, (n,), summed over a strip along it.

    It is that of areas within two distances from the boundary, extrapolated to none, so that single ones may be below
    zero.
    """
    narrow, wide = (areas * _edge(distance / width) / width for width in (_NARROW * spacing, 2.0 * _NARROW * spacing))
    result: Floats = 2.0 * narrow - wide
    return result


class _Line(NamedTuple):
    """Pieces of the line between members and others.

    Attributes
    ----------
    feet : ndarray, (m, 3)
        Places on it.
    normals, inward : ndarray, (m, 3)
        Unit vectors across the surface, and along it to the members.
    bend : ndarray, (m,)
        Curvature of the line in the surface, positive where it bends towards the members.
    spacing : ndarray, (m,)
        Of the points.
    component : ndarray, (m,) int
    """

    feet: Floats
    normals: Floats
    inward: Floats
    bend: Floats
    spacing: Floats
    component: Ints

    def distances(self, laplacian: LaplaceBeltrami) -> tuple[Ints, Floats, Floats]:
        """Measure the points near the line, on its sheet.

        Returns
        -------
        rows : ndarray, (r,) int
        signed : ndarray, (r,)
            Their distances from the line, positive on the side of members.
        spacing : ndarray, (r,)
            At the line.
        """
        count = len(laplacian.points)
        places = np.concatenate([laplacian.surface_points, self.feet])
        apart = move_apart(places, np.concatenate([laplacian.component, self.component]))
        tree = cKDTree(apart[count:])
        reach = 2.0 * _WIDE * float(self.spacing.max())
        rows = np.flatnonzero(np.isfinite(tree.query(apart[:count], distance_upper_bound=reach, workers=-1)[0]))
        near = tree.query(apart[rows], k=np.arange(1, min(_NEAREST, len(self.feet)) + 1), workers=-1)[1]
        offset = laplacian.surface_points[rows, None] - self.feet[near]
        across = np.einsum("nkc,nkc->nk", offset, self.inward[near])
        along = np.einsum("nkc,nkc->nk", offset, np.cross(self.normals[near], self.inward[near]))
        length = np.linalg.norm(offset, axis=2)
        stretch = length / np.maximum(np.hypot(across, along), 1e-300)
        signed = stretch * across - 0.5 * self.bend[near] * along**2
        facing = np.einsum("nkc,nc->nk", self.normals[near], laplacian.normals[rows]) > SMOOTH
        facing &= np.einsum("nkc,nc->nk", self.inward[near], self.inward[near[:, 0]]) > _PARALLEL
        facing &= (stretch < _STEEP) | (length < self.spacing[near])
        weight = np.where(facing, np.exp(-((along / self.spacing[near]) ** 2)), 0.0)
        total = weight.sum(axis=1)
        weight /= np.maximum(total, 1e-300)[:, None]
        mean = np.einsum("nk,nk->n", weight, signed), np.einsum("nk,nk->n", weight, self.spacing[near])
        known = (total > _LEAST) & (np.abs(mean[0]) < 2.0 * _WIDE * mean[1])
        return rows[known], mean[0][known], mean[1][known]


def _find_line(laplacian: LaplaceBeltrami, members: Bools, spacing: Floats, report: Callable[[float], None]) -> _Line:
    """Find the line between members and others; it has no pieces where there are none of both on a component."""
    level, rise = _smoothed(laplacian, members, float(np.median(spacing)))
    rows = np.flatnonzero((np.abs(level) < _STRIP * spacing) & (laplacian.component >= 0))
    report(0.3)
    strip = _Strip(laplacian, rows, members, level, rise, spacing)
    fit = strip.fitted(np.full(len(rows), _WINDOWS[0]))
    report(0.6)
    window = np.clip(_TURN / np.maximum(np.abs(fit[:, 2]), 1e-12), _SHORTEST, _WINDOWS[1])
    return strip.line(strip.fitted(window))


def _smoothed(laplacian: LaplaceBeltrami, members: Bools, spacing: float) -> tuple[Floats, Floats]:
    """Smooth the step between members and others by heat flow.

    Returns
    -------
    level : ndarray, (n,)
        About the distance from the step, positive at members [L].
    rise : ndarray, (n, 3)
        Unit tangents towards members.
    """
    stiffness, areas = laplacian.stiffness, laplacian.areas
    time = 0.5 * (_SPREAD * spacing) ** 2
    known = laplacian.component >= 0
    fastest = 2.0 * float(np.max(stiffness.diagonal()[known] / areas[known]))
    steps = int(np.ceil(time * fastest * 0.75))
    values = np.where(members, 1.0, -1.0)
    for _ in range(steps):
        values = values - time / steps * np.where(known, stiffness @ values / areas, 0.0)
    places = laplacian.surface_points - laplacian.surface_points[known].mean(axis=0)
    products = stiffness @ np.column_stack([places, values[:, None] * places, values])
    rise = values[:, None] * products[:, :3] - products[:, 3:6] + places * products[:, 6:]  # twice the areas too long
    rise -= np.einsum("nc,nc->n", rise, laplacian.normals)[:, None] * laplacian.normals
    level = 2.0 * np.sqrt(time) * erfinv(np.clip(values, -_SURE, _SURE))
    return level, rise / np.maximum(np.linalg.norm(rise, axis=1), 1e-300)[:, None]


class _Strip:
    """Points next to the line between members and others, and parabolas fitted around each of them.

    In the tangent plane of a point, in its spacing, the distance from the line is ``c0 + c1 t + c2 t^2 / 2 + n``, with
    n across the line to the members and t along it.
    """

    def __init__(
        self, laplacian: LaplaceBeltrami, rows: Ints, members: Bools, level: Floats, rise: Floats, spacing: Floats
    ) -> None:
        self._points, self._normals = laplacian.surface_points[rows], laplacian.normals[rows]
        self._component, self._spacing = laplacian.component[rows], spacing[rows]
        self._sign = np.where(members[rows], 1.0, -1.0)
        self._rise, self._start = rise[rows], level[rows] / spacing[rows]
        self._along = np.cross(self._normals, self._rise)

    def fitted(self, window: Floats) -> Floats:
        """Return the three coefficients of the most likely parabola in a window of each point, (m, 3)."""
        result = np.zeros((len(window), 3))
        if not len(window):
            return result
        apart = move_apart(self._points, self._component)
        tree = cKDTree(apart)
        reach = np.hypot(window, 2.0 * _STRIP) * self._spacing
        for rows in blocks(len(window), _BLOCK):
            found = tree.query_ball_point(apart[rows], reach[rows], return_sorted=False)
            row = np.repeat(np.arange(len(found)), [len(near) for near in found])
            result[rows] = self._fit(rows, row, np.concatenate(found).astype(np.int64), window[rows])
        return result

    def _fit(self, rows: slice, row: Ints, other: Ints, window: Floats) -> Floats:
        """Fit parabolas around some points, by pairs of their number among these and another point."""
        frame = np.stack([self._along[rows], self._rise[rows], self._normals[rows]], axis=1)
        offset = (self._points[other] - self._points[rows][row]) / self._spacing[rows][row, None]
        t, n, _ = np.einsum("pac,pc->ap", frame[row], offset)
        same = np.einsum("pc,pc->p", self._normals[other], frame[row, 2]) > SMOOTH
        same &= np.einsum("pc,pc->p", self._rise[other], frame[row, 1]) > _PARALLEL
        same &= np.abs(t) < window[row]
        row, other, t, n = row[same], other[same], t[same], n[same]
        weight = (1.0 - (t / window[row]) ** 2) ** 2
        terms = np.stack([np.ones_like(t), t, 0.5 * t * t], axis=1)
        found = np.zeros((len(window), 3))
        found[:, 0] = self._start[rows]
        for _ in range(_ROUNDS):
            found = found - _newton(found, row, weight, terms, n, self._sign[other])
        return found

    def line(self, found: Floats) -> _Line:
        """Return the pieces of the line that the parabolas are."""
        steep = np.sqrt(1.0 + found[:, 1] ** 2)
        inward = (self._rise + found[:, 1:2] * self._along) / steep[:, None]
        distance = found[:, 0] / steep
        feet = self._points - (distance * self._spacing)[:, None] * inward
        bend = -found[:, 2] / steep**3 / self._spacing
        sound = (np.abs(distance) < _STRIP) & (np.abs(found[:, 0] - self._start) < _LARGEST[0])
        sound &= (np.abs(found[:, 1:]) < _LARGEST[1:]).all(axis=1)
        pieces = (feet, self._normals, inward, bend, self._spacing, self._component)
        return _Line(*(piece[sound] for piece in pieces))


def _newton(found: Floats, row: Ints, weight: Floats, terms: Floats, across: Floats, sign: Floats) -> Floats:
    """Return a step of Newton's method for logistic regression, (m, 3)."""
    count = len(found)
    miss = expit(-sign * (np.einsum("pa,pa->p", terms, found[row]) + across) / _BLUR)
    slope = -weight * sign * miss / _BLUR
    curve = weight * miss * (1.0 - miss) / _BLUR**2
    first = [np.bincount(row, slope * term, count) for term in terms.T]
    gradient = np.array(first, dtype=np.float64).T + np.append(0.0, _PRIOR[1:]) * found
    second = [[np.bincount(row, curve * a * b, count) for a in terms.T] for b in terms.T]
    hessian = np.moveaxis(np.array(second, dtype=np.float64), 2, 0) + np.diag(_PRIOR)
    step: Floats = np.linalg.solve(hessian, gradient[:, :, None])[:, :, 0]
    result: Floats = step / np.maximum(np.abs(step / _LARGEST).max(axis=1, keepdims=True), 1.0)
    return result
