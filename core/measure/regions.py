"""Area, boundary and middle of a part of the surface that is given by its points."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.spatial import cKDTree
from scipy.special import erfinv, expit

from ..algebra import blocks
from ..arguments import as_array, check_array, check_finite
from ..errors import InvalidPointsError
from ..frozen import Frozen
from ..geometry import FEW, SMOOTH, as_mask, move_apart
from ..linalg import solve
from ..operator import LaplaceBeltrami, mean_spacing
from ..progress import ends_at_one
from ..types import Bools, Floats, Ints, Progress

_SPREAD = 2.0  # spacings over which the step between members and others is smoothed first
_FAR = 10.0  # spacings from the line beyond which that changes nothing, and nothing else asks for the distance
_STRIP = 2.0  # spacings from the line between them within which points tell where it is
_WINDOWS = 4.0, 9.0  # spacings along the line over which a parabola is fitted: at first, and at most
_TURN = 0.7  # radii of the line's curvature within which a parabola is close to it
_SHORTEST = 3.0  # spacings of such a window at least
_BLUR = 0.2  # spacings over which the chance to be a member falls, in the fit
_PRIOR = np.array([1e-3, 0.05, 1.0])  # how much the fit resists an offset, a slope and a curvature
_LARGEST = np.array([1.0, 1.0, 0.5])  # change of each in a step, and in all
_ROUNDS = 8  # of Newton's iteration at most
_DONE = 1e-3  # of the largest change: it ends with smaller ones
_ROUND = 0.5  # of the distance from a line to the middle of its circle, within which that tells distances
_ARCHED = 0.02  # of the length of a line, at most, by which curvature of the surface changes those beside it
_WIDE = 4.0  # spacings on both sides of the line over which areas are summed to its length
_NARROW = 3.0  # spacings from the boundary of the surface over which areas are summed to its length, and twice that
_THIN = 0.7  # of the depth of a thin part that may be taken for that
_DEEP = 8.0  # spacings from the line within which distances are measured, more than those over the last number
_TURNS = 0.1, 0.15  # by which the line turns along a spacing, until plain sums are nearer to the area
_VARIANCE = 1.0 / 7.0  # of the derivative of the step
_MOMENTS = 0.1  # share of an area that may be wrong where trust is a half
_ROUGH = 0.04  # of the height of noise, over the spacing: what it adds to areas
_ROUNDED = 6.0  # of noise times spacing times the squared mean curvature: what smoothing it takes from edges
# Of the spacing: how well it is known where the surface ends, at best and where rows run along its boundary, and by how
# much better for each spacing that points there are off the boundary.
_STRIP_WIDTH = 0.2, 1.1, 2.2
_AREA_OFF = 1.0  # of the area of a square of one spacing: what each such piece of the line leaves open, two deviations
LENGTH_OFF = 0.005, 0.05  # of the length of the line, and of the boundary of the surface
_LENGTH_BENT = 0.3  # of the length, times the squared curvature of the surface over a spacing: what is off more
_LENGTH_DOUBTED = 0.2  # of the length where there is no trust, too
_LENGTH_LOST = 0.4  # of the length of the line next to points where no parabola is found
_UPPER = np.triu_indices(3)  # entries of a symmetric matrix that tell all
_MIRRORED = np.array([0, 1, 2, 1, 3, 4, 2, 4, 5])  # where each entry is among these
_NEAREST = 24  # pieces of the line by which the distance of a point is measured
_PARALLEL = 0.3  # cosine between the directions across the line at two points, at least, if it is one line
_STEEP = 1.5  # length of a chord over that in the tangent plane, at most, on one sheet
_LEAST = 1e-6  # weight of the pieces near a point, relative to that of one beside it
_SURE = 1.0 - 1e-9  # of the smoothed step
_BLOCK = 1 << 11  # windows at one time


@dataclass(frozen=True)
class Region(Frozen):
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


def measures_of(laplacian: LaplaceBeltrami) -> SurfaceMeasures:
    """Return what the measures of all parts have in common, which the operator keeps."""
    alone = replace(laplacian)  # keeps nothing, so that the two do not hold each other
    return laplacian.kept.result("measures", lambda: SurfaceMeasures(alone))


class SurfaceMeasures:
    """What the measures of all parts of a surface have in common, made once and kept for many parts.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.

    Attributes
    ----------
    areas : ndarray, (n,)
        Area elements, zero for points left out [L^2].
    spacing : ndarray, (n,)
        Distance between points [L].
    area_doubts : ndarray, (n,)
        By how much the area of each point may be wrong [L^2].
    boundary_lengths : ndarray, (n,)
        Length of the surface's own boundary next to each point [L].
    boundary_doubts : ndarray, (n,)
        By how much the area along that may be wrong, as it is not known where between points and none the surface ends
        [L^2]; to be added up with their signs.
    """

    def __init__(self, laplacian: LaplaceBeltrami) -> None:
        known = laplacian.component >= 0
        self.laplacian = laplacian
        self.areas = np.where(known, laplacian.areas, 0.0)
        self.spacing = mean_spacing(laplacian)
        self.area_doubts = _area_doubts(laplacian, self.spacing)
        self.boundary_lengths = _boundary_lengths(self.areas, laplacian.boundary_distance, self.spacing)
        self.boundary_doubts = self.boundary_lengths * self.spacing * _strips(laplacian, self.spacing)
        # The heat of a point flows to its neighbors at twice this rate at most.
        self.rates = np.where(known, laplacian.stiffness.diagonal() / laplacian.areas, 0.0)
        self._places = laplacian.surface_points - laplacian.surface_points[known].mean(axis=0)
        self._reach = float(np.sqrt(laplacian.stiffness.nnz / len(known) / np.pi))  # spacings to the furthest neighbor

    def around(self, members: Bools) -> Ints:
        """Return all points within some spacings of the line between members and others, (r,) int."""
        few = members if 2 * np.count_nonzero(members) <= len(members) else ~members
        across = self._neighbors(np.flatnonzero(few)) & ~few
        result = new = across | (self._neighbors(np.flatnonzero(across)) & few)
        for _ in range(int(np.ceil(_FAR / self._reach)) - 1):
            new = self._neighbors(np.flatnonzero(new)) & ~result
            result = result | new
        return np.flatnonzero(result)

    def _neighbors(self, rows: Ints) -> Bools:
        """Return which points the operator couples with some, (n,)."""
        result = np.zeros(len(self.areas), dtype=bool)
        result[self.laplacian.stiffness[rows].indices] = True
        return result

    def smoothed(self, members: Bools, near: Ints) -> tuple[Ints, Floats, Floats]:
        """Smooth the step between members and others by heat flow, near the line between them.

        Return the points so close to the line that they tell where it is, (r,) int; about their distance from it,
        positive at members [L]; and unit tangents towards members, (r, 3).
        """
        pairs, areas = self.laplacian.stiffness[near], self.laplacian.areas[near]
        time = 0.5 * (_SPREAD * float(np.median(self.spacing[near]))) ** 2 if len(near) else 0.0
        steps = int(np.ceil(1.5 * time * self.rates[near].max(initial=0.0)))
        values = np.where(members, 1.0, -1.0)
        for _ in range(steps):
            values[near] -= time / steps * (pairs @ values / areas)
        level = 2.0 * np.sqrt(time) * erfinv(np.clip(values[near], -_SURE, _SURE))
        close = np.abs(level) < _STRIP * self.spacing[near]
        rows, places = near[close], self._places
        own, at = values[rows, None], places[rows]
        products = pairs[close] @ np.column_stack([places, values[:, None] * places, values])
        rise = own * products[:, :3] - products[:, 3:6] + at * products[:, 6:]  # twice the areas too long
        normals = self.laplacian.normals[rows]
        rise -= np.einsum("nc,nc->n", rise, normals)[:, None] * normals
        return rows, level[close], rise / np.maximum(np.linalg.norm(rise, axis=1), 1e-300)[:, None]


@ends_at_one
def measure_region(
    laplacian: LaplaceBeltrami,
    members: ArrayLike,
    *,
    progress: Progress | None = None,
) -> Region:
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
    distance.grow : Finds the points within a distance.

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
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> found = mf.measure.measure_region(mf.build_laplacian(points), points[:, 2] > 0)
    >>> print(round(found.area / np.pi, 1), round(found.boundary_length / np.pi, 1))
    2.0 2.0
    """
    report = progress or (lambda stage, fraction: None)
    share = _shares(laplacian, members)
    whole = measures_of(laplacian)
    report("Line", 0.0)
    near, line = _find_line(whole, share > 0.5, lambda done: report("Line", done))
    report("Areas", 0.9)
    areas, spacing = whole.areas, whole.spacing
    inside, width = _from_line(whole, near, line, share > 0.5)
    ratio = inside[near] / width[near]
    slope, second = _slope(ratio) / width[near], _second(ratio) / width[near] ** 2
    step = np.where(inside > 0.0, 1.0, 0.0)
    step[near] = _step(ratio)
    # Lines beside a geodesic on a sphere are shorter than it, by half the squared distance.
    arched = 0.5 * _VARIANCE * laplacian.gaussian_curvature[near] * width[near] ** 2
    length = float(areas[near] @ (slope * (1.0 + np.clip(arched, -_ARCHED, _ARCHED))))
    turns = float(areas[near] @ second)
    bent = float(areas[near] @ _second(ratio))
    plain, smooth = float(areas @ share), float(areas @ step - 0.5 * _VARIANCE * bent)
    # Where the line turns within a few spacings, the parabolas are off by more than the cells.
    turn = abs(turns) / max(length, 1e-300) * float(np.median(spacing[near])) if len(near) else 0.0
    fine = np.clip((_TURNS[1] - turn) / (_TURNS[1] - _TURNS[0]), 0.0, 1.0) if np.all(share % 1.0 == 0.0) else 0.0
    area = fine * smooth + (1.0 - fine) * plain
    owned = whole.boundary_lengths * step
    own, doubt = float(owned.sum()), float(share @ whole.area_doubts + abs(whole.boundary_doubts @ step))
    weight = areas * (fine * step + (1.0 - fine) * share)
    squared = max(float(areas[near] @ (slope * spacing[near] ** 3)), float(np.sum(line.lost**4)) / (2.0 * _STRIP))
    bend = np.minimum(np.linalg.norm(laplacian.shape_operator[near], axis=(1, 2)) * spacing[near], 1.0)
    off = _LENGTH_BENT * bend**2 + _LENGTH_DOUBTED * (1.0 - laplacian.trust[near])
    off += LENGTH_OFF[0] * (_WIDE * spacing / width).max() ** 2
    lost = _LENGTH_LOST * float(line.lost.sum()) / (2.0 * _STRIP)
    return Region(
        area=float(area),
        boundary_length=length + own,
        centroid=weight @ laplacian.surface_points / max(weight.sum(), 1e-300),
        area_uncertainty=float(np.hypot(_AREA_OFF * np.sqrt(squared), doubt)),
        length_uncertainty=float(areas[near] @ (slope * off)) + lost + LENGTH_OFF[1] * abs(own),
    )


def _area_doubts(laplacian: LaplaceBeltrami, spacing: Floats) -> Floats:
    """Return by how much the area of each point may be wrong, (n,): by missed moments, noise, and strong curvature.

    A quadric leaves out the fourth power of the spacing over the radius: much of an object of some 50 points.
    """
    missed = _MOMENTS * np.sqrt(1.0 / np.maximum(laplacian.trust, 1e-6) - 1.0)
    noise = np.linalg.norm(laplacian.surface_points - laplacian.points, axis=1)
    bend = 0.5 * np.trace(laplacian.shape_operator, axis1=1, axis2=2)
    rough = noise / spacing * (_ROUGH + _ROUNDED * (spacing * bend) ** 2)
    result: Floats = laplacian.areas * np.minimum(missed + rough + (spacing * bend) ** 4, 1.0)
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


def _from_line(whole: SurfaceMeasures, near: Ints, line: _Line, members: Bools) -> tuple[Floats, Floats]:
    """Return the distance of each point from the line, positive at members, and the width to sum over, (n,) each."""
    far = np.where(members, np.inf, -np.inf)
    if not len(line.feet):
        return far, _WIDE * whole.spacing
    rows, signed, width = line.distances(whole.laplacian, near)
    inside, used = far, whole.spacing.copy()
    inside[rows], used[rows] = signed, width
    deep = np.where(np.isin(whole.laplacian.component, line.component), inside / used, 0.0)
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


def _strips(laplacian: LaplaceBeltrami, spacing: Floats) -> Floats:
    """Return how wide a strip, in spacings, at the boundary of the surface may be missing or too much, (n,).

    Points at random or in rows across the boundary lie off it by chance, which tells where it is. Of rows along it, as
    of pixels, all points at the boundary are as far from it, which nobody knows: the next row may just have been cut
    off.
    """
    least, most, known = _STRIP_WIDTH
    rows = np.flatnonzero(laplacian.boundary & (laplacian.component >= 0))
    if not len(rows):
        return np.full(len(spacing), least)
    off, places = laplacian.boundary_distance[rows] / spacing[rows], laplacian.surface_points
    _, near = cKDTree(places[rows]).query(places[rows], k=range(1, min(FEW, len(rows)) + 1))
    strip = np.clip(most - known * off[near].mean(axis=1), least, most)
    result: Floats = strip[cKDTree(places[rows]).query(places)[1]]
    return result


def _boundary_lengths(areas: Floats, distance: Floats, spacing: Floats) -> Floats:
    """Return the length of the surface's boundary next to each point, (n,), summed over a strip along it.

    It is that of areas within two distances from the boundary, extrapolated to none, so that single ones may be below
    zero.
    """
    narrow, wide = (areas * _edge(distance / width) / width for width in (_NARROW * spacing, 2.0 * _NARROW * spacing))
    result: Floats = 2.0 * narrow - wide
    return result


class _Line(NamedTuple):
    """Pieces of the line between members and others."""

    feet: Floats  # (m, 3), places on it
    # (m, 3), unit vectors across the surface, and along it to the members
    normals: Floats
    inward: Floats
    bend: Floats  # (m,), curvature of the line in the surface, positive where it bends towards the members
    spacing: Floats  # (m,), of the points
    component: Ints  # (m,)
    lost: Floats  # (r,), spacing of the points next to the line where no piece of it is found

    def distances(self, laplacian: LaplaceBeltrami, rows: Ints) -> tuple[Ints, Floats, Floats]:
        """Measure points near the line, those of some rows that are on its sheet.

        Return their rows, (r,) int, their distances from the line, positive on the side of members, and the spacing
        there.
        """
        places = np.concatenate([laplacian.surface_points[rows], self.feet])
        apart = move_apart(places, np.concatenate([laplacian.component[rows], self.component]))
        tree, reach = cKDTree(apart[len(rows) :]), _DEEP * float(self.spacing.max())
        close = np.isfinite(tree.query(apart[: len(rows)], distance_upper_bound=reach)[0])
        apart, rows = apart[: len(rows)][close], rows[close]
        near = tree.query(apart, k=np.arange(1, min(_NEAREST, len(self.feet)) + 1))[1]
        offset = laplacian.surface_points[rows, None] - self.feet[near]
        across = np.einsum("nkc,nkc->nk", offset, self.inward[near])
        along = np.einsum("nkc,nkc->nk", offset, np.cross(self.normals, self.inward)[near])
        length = np.sqrt(np.einsum("nkc,nkc->nk", offset, offset))
        stretch = length / np.maximum(np.hypot(across, along), 1e-300)
        facing = np.einsum("nkc,nc->nk", self.normals[near], laplacian.normals[rows]) > SMOOTH
        facing &= np.einsum("nkc,nc->nk", self.inward[near], self.inward[near[:, 0]]) > _PARALLEL
        facing &= (stretch < _STEEP) | (length < self.spacing[near])
        weight = np.where(facing, np.exp(-((along / self.spacing[near]) ** 2)), 0.0)
        total = weight.sum(axis=1)
        weight /= np.maximum(total, 1e-300)[:, None]
        across = stretch * across
        # From the circle that the line is nearby, a larger one where its middle is near.
        bend = np.einsum("nk,nk->n", weight, self.bend[near])[:, None]
        limit = _ROUND / np.maximum(np.abs(across), 1e-300)
        bend = np.clip(bend, -limit, limit)
        signed = (2.0 * across - bend * (across**2 + along**2)) / (1.0 + np.hypot(1.0 - bend * across, bend * along))
        mean = np.einsum("nk,nk->n", weight, signed), np.einsum("nk,nk->n", weight, self.spacing[near])
        known = (total > _LEAST) & (np.abs(mean[0]) < _DEEP * mean[1])
        return rows[known], mean[0][known], mean[1][known]


def _find_line(whole: SurfaceMeasures, members: Bools, report: Callable[[float], None]) -> tuple[Ints, _Line]:
    """Find all points near the line between members and others, (r,) int, and the line.

    It has no pieces where there are none of both on a component.
    """
    near = whole.around(members)
    rows, level, rise = whole.smoothed(members, near)
    report(0.3)
    strip = _Strip(whole, rows, members, level, rise)
    return near, strip.line(strip.fitted())


class _Strip:
    """Points next to the line between members and others, and parabolas fitted around each of them.

    In the tangent plane of a point, in its spacing, the distance from the line is ``c0 + c1 t + c2 t^2 / 2 + n``, with
    n across the line to the members and t along it.
    """

    def __init__(self, whole: SurfaceMeasures, rows: Ints, members: Bools, level: Floats, rise: Floats) -> None:
        laplacian, spacing = whole.laplacian, whole.spacing[rows]
        self._points, self._normals = laplacian.surface_points[rows], laplacian.normals[rows]
        self._component, self._spacing = laplacian.component[rows], spacing
        self._sign = np.where(members[rows], 1.0, -1.0)
        self._rise, self._start = rise, level / spacing
        self._along = np.cross(self._normals, self._rise)

    def fitted(self) -> Floats:
        """Return the three coefficients of the most likely parabola around each point, (m, 3).

        The window is as long as a parabola is close to the line, by first ones in short windows. Their curvature is
        averaged, since a parabola that bends by chance would get a short window, and keep its chance there.
        """
        first, result = np.zeros((2, len(self._start), 3))
        short, longest = _WINDOWS
        for rows, row, other, t, n in self._pairs(short):
            first[rows] = self._fit(rows, row, other, t, n, np.full(rows.stop - rows.start, short))
        bend = first[:, 2] / (1.0 + first[:, 1] ** 2) ** 1.5
        for rows, row, other, t, n in self._pairs(longest):
            weight = np.maximum(1.0 - (t / short) ** 2, 0.0)
            count = rows.stop - rows.start
            mean = np.bincount(row, weight * bend[other], count) / np.bincount(row, weight, count)
            window = np.clip(_TURN / np.maximum(np.abs(mean), 1e-12), _SHORTEST, longest)
            result[rows] = self._fit(rows, row, other, t, n, window)
        return result

    def _pairs(self, window: float) -> Iterator[tuple[slice, Ints, Ints, Floats, Floats]]:
        """Yield blocks of points, and their pairs with the points on the same line in a window.

        A pair is the number of one point within its block, ascending, that of the other, and its place along the line
        and across it.
        """
        if not len(self._start):
            return
        apart = move_apart(self._points, self._component)
        tree = cKDTree(apart)
        reach = np.hypot(window, 2.0 * _STRIP) * self._spacing
        for rows in blocks(len(apart), _BLOCK):
            found = tree.query_ball_point(apart[rows], reach[rows], return_sorted=False)
            row = np.repeat(np.arange(len(found)), [len(near) for near in found])
            other = np.concatenate(found).astype(np.int64)
            frame = np.stack([self._along[rows], self._rise[rows], self._normals[rows]], axis=1)
            offset = (self._points[other] - self._points[rows][row]) / self._spacing[rows][row, None]
            t, n, _ = np.einsum("pac,pc->ap", frame[row], offset)
            same = np.einsum("pc,pc->p", self._normals[other], frame[row, 2]) > SMOOTH
            same &= np.einsum("pc,pc->p", self._rise[other], frame[row, 1]) > _PARALLEL
            yield rows, row[same], other[same], t[same], n[same]

    def _fit(self, rows: slice, row: Ints, other: Ints, t: Floats, n: Floats, window: Floats) -> Floats:
        """Fit parabolas around a block of points by pairs within a window around each, (r,)."""
        kept = np.abs(t) < window[row]
        row, t = row[kept], t[kept]
        weight = (1.0 - (t / window[row]) ** 2) ** 2
        likelihood = _Likelihood(row, len(window), weight, t, n[kept], self._sign[other[kept]])
        return likelihood.largest(np.column_stack([self._start[rows], np.zeros((len(window), 2))]))

    def line(self, found: Floats) -> _Line:
        """Return the pieces of the line that the parabolas are."""
        steep = np.sqrt(1.0 + found[:, 1] ** 2)
        inward = (self._rise + found[:, 1:2] * self._along) / steep[:, None]
        distance = found[:, 0] / steep
        feet = self._points - (distance * self._spacing)[:, None] * inward
        bend = -found[:, 2] / steep**3 / self._spacing
        sound = (np.abs(distance) < _STRIP) & (np.abs(found[:, 0] - self._start) < _LARGEST[0])
        sound &= (np.abs(found[:, 1:]) < _LARGEST[1:]).all(axis=1)
        at = self._normals[sound], inward[sound], bend[sound], self._spacing[sound], self._component[sound]
        return _Line(feet[sound], *at, self._spacing[~sound])


class _Likelihood:
    """How likely parabolas are, by pairs of a parabola, in ascending order, and a point that is a member or not.

    Of each pair, (p,), `row` is the parabola, t and n are where the point is, along the line and across it, and the
    sign is 1 for members, -1 for others.
    """

    def __init__(self, row: Ints, count: int, weight: Floats, t: Floats, n: Floats, sign: Floats) -> None:
        self._pairs = row, weight, t, n, sign
        self._terms = np.stack([np.ones_like(t), t, 0.5 * t * t], axis=1)
        self._first = weight[:, None] * self._terms
        self._second = self._first[:, _UPPER[0]] * self._terms[:, _UPPER[1]]
        ends = np.searchsorted(row, np.arange(count + 1))
        self._sums = sparse.csr_array((sign, np.arange(len(row)), ends), shape=(count, len(row)))

    def largest(self, found: Floats) -> Floats:
        """Return the coefficients of the most likely parabolas, (m, 3), by Newton's method from others."""
        found, part, rows = found.copy(), self, np.arange(len(found))
        for _ in range(_ROUNDS):
            step = part._newton(found[rows])
            found[rows] -= step
            left = np.abs(step / _LARGEST).max(axis=1) > _DONE
            if not left.any():
                break
            if 2 * np.count_nonzero(left) <= len(left):
                part, rows = part._of(left), rows[left]
        return found

    def _of(self, chosen: Bools) -> _Likelihood:
        """Return the same of some parabolas only."""
        row, *others = self._pairs
        kept = chosen[row]
        number = np.cumsum(chosen) - 1
        return _Likelihood(number[row[kept]], int(np.count_nonzero(chosen)), *(values[kept] for values in others))

    def _newton(self, found: Floats) -> Floats:
        row, _, _, n, sign = self._pairs
        value = n + np.einsum("pa,pa->p", self._terms, found[row])
        miss = expit(-sign * value / _BLUR)
        self._sums.data = sign * miss / _BLUR
        gradient = np.append(0.0, _PRIOR[1:]) * found - self._sums @ self._first
        self._sums.data = miss * (1.0 - miss) / _BLUR**2
        hessian = (self._sums @ self._second)[:, _MIRRORED].reshape(-1, 3, 3) + np.diag(_PRIOR)
        step: Floats = solve(hessian, gradient[:, :, None])[:, :, 0]
        result: Floats = step / np.maximum(np.abs(step / _LARGEST).max(axis=1, keepdims=True), 1.0)
        return result
