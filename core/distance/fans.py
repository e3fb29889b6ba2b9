"""Distances as exact as wavefronts are round: over fans of triangles around the points, not along single pairs."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from scipy import sparse

from ..algebra import blocks, on_all_cores, runs
from ..geometry import arc_ahead, dots
from ..operator import LaplaceBeltrami, tangent_frames
from ..types import Array, Bools, Floats, Ints

_DIRECTIONS = 32  # of a fan: the nearest neighbor in each
_OPEN = 0.75 * np.pi  # angle of a triangle at its point, at most
_ASTRAY = 0.5  # angle that a shortest path over pairs leads off the geodesic's direction, at most
_FLAT = 1e-2  # of the sum of squares, by which a front is rather a circle
_SETTLED = 1e-3  # of the length of its sides: a point that comes nearer by less changes no others
_BLOCK = 1 << 15  # pairs worked on at one time, so that they stay in the cache


class Fans:
    """Triangles of every point and two neighbors next to each other in direction, in geodesic polar coordinates.

    Where points lie in rows, neighbors are in few directions, and every path along pairs zigzags. A front that passes a
    triangle comes from one place in its plane, which follows from when it passed two corners; so it is as exact in all
    directions, and exact in the plane. Lengths, (n, n), are those of the arcs between neighbors [L], symmetric.
    `report` is called now and then; it may raise `Cancelled`.
    """

    def __init__(self, laplacian: LaplaceBeltrami, lengths: sparse.csr_array, report: Callable[[], None]) -> None:
        count = len(laplacian.points)
        self._lengths = lengths
        self._frames = tangent_frames(laplacian.normals)
        places = np.ascontiguousarray(laplacian.surface_points.T), np.ascontiguousarray(laplacian.normals.T)
        axes = np.ascontiguousarray(self._frames.real.T), np.ascontiguousarray(self._frames.imag.T)
        size = max(1, _BLOCK * count // max(1, lengths.nnz))
        parts = on_all_cores(lambda rows: _fan(lengths, *places, *axes, rows), blocks(count, size), report)
        many, end, place = (np.concatenate(values) for values in zip(*parts, strict=True))
        self._start = np.concatenate([[0], np.cumsum(many)])
        self._own = np.repeat(np.arange(count, dtype=np.int32), many)
        self._end, self._place = end, place
        after = np.arange(1, len(end) + 1)
        after[self._start[1:][many > 0] - 1] = self._start[:-1][many > 0]
        angle = np.angle(place[after] * place.conj()) % (2.0 * np.pi)
        self._next = np.where(angle < _OPEN, after, np.arange(len(end))).astype(np.int32)
        total = np.add.reduceat(np.append(np.abs(place), 0.0), self._start[:-1]) if count else np.zeros(0)
        self._step = np.where(many > 0, total, 0.0) / np.maximum(many, 1)

    def refine(
        self, distance: Floats, label: Ints, held: Bools | None = None, report: Callable[[], None] = lambda: None
    ) -> tuple[Floats, Ints]:
        """Shorten distances along pairs, (n,), to those of fronts through triangles; return them with their labels.

        Distances [L] are infinite where no path leads; labels, (n,) int, tell where each path comes from. Those of
        points `held`, (n,) bool, are exact. `report` is called now and then; it may raise `Cancelled`.
        """
        known = np.isfinite(distance)
        free = np.flatnonzero(known if held is None else known & ~held)
        distance, label = distance.copy(), label.copy()
        self._pass(distance, label, free, report)
        self._settle(distance, label, free, report)
        return distance, label

    def outward(self, distance: Floats) -> Array:
        """Return the vector from the source to every point, as it arrives there, (n,) complex in its tangent frame.

        By the squared distances of the corners of a fan, which are linear in the plane, next to the source and to a
        boundary, too. On a bent surface fronts are less or more curved than circles, which is found with the vector.
        """
        u, v, far = self._place.real, self._place.imag, np.where(np.isfinite(distance), distance, 0.0)
        rise = 0.5 * (far[self._end] ** 2 - far[self._own] ** 2 - np.abs(self._place) ** 2)

        def fit(bend: Floats) -> Array:
            def total(left: Floats, right: Floats) -> Floats:
                return np.bincount(self._own, left * right, len(distance)).astype(float)

            columns = u, v, rise
            share = 1.0 / np.maximum((1.0 + _FLAT) * total(bend, bend), 1e-300)
            bent = [total(bend, column) for column in columns]
            xx, xy, yy, x, y = (
                total(columns[i], columns[j]) - share * bent[i] * bent[j]
                for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2))
            )
            determinant = xx * yy - xy**2
            found: Array = (yy * x - xy * y + 1j * (xx * y - xy * x)) / np.where(determinant > 0.0, determinant, 1.0)
            return found

        found = fit(np.zeros(len(u)))
        size = np.abs(found)
        found /= np.where(size > 0.0, size, 1.0)
        return fit(_cross(found[self._own], self._place) ** 2)

    def _pass(self, distance: Floats, label: Ints, free: Ints, report: Callable[[], None]) -> None:
        """Let the front pass once, outwards in bands as wide as a step, through the triangles that it comes through."""
        side = np.concatenate([np.zeros(0, dtype=np.int64), *self._over(self._ahead, distance, label, free)])
        side = side[np.argsort(distance[self._own[side]], kind="stable")]
        first, second, third = self._own[side], self._end[side], self._end[self._next[side]]
        far = np.cumsum(np.diff(distance[first], prepend=0.0) / self._step[first]).astype(np.int64)
        changed = np.zeros(len(distance), dtype=bool)
        for begin, stop in pairwise(np.append(np.flatnonzero(np.diff(far, prepend=-1)), len(side))):
            report()
            band = slice(begin, stop)
            asked = np.ones(stop - begin, dtype=bool)
            while asked.any():
                nearer = self._shorten(distance, label, side[band][asked], 0.0)
                changed[nearer] = True
                asked = changed[second[band]] | changed[third[band]]
                changed[nearer] = False

    def _settle(self, distance: Floats, label: Ints, free: Ints, report: Callable[[], None]) -> None:
        """Move where fronts meet, as long as one comes nearer: paths along pairs met elsewhere."""
        allowed = np.zeros(len(distance), dtype=bool)
        allowed[free] = True
        passed = np.concatenate([np.zeros(0, dtype=np.int64), *self._over(self._passed, distance, label, free)])
        asked = np.unique(self._own[passed])
        while len(asked):
            report()
            nearer = self._shorten(distance, label, self._sides(asked), _SETTLED)
            around = np.unique(self._lengths[np.unique(nearer)].indices)
            asked = around[allowed[around]]

    def _over(
        self, function: Callable[[Floats, Ints, Ints], Ints], distance: Floats, label: Ints, rows: Ints
    ) -> list[Ints]:
        """Return what a function chooses of all sides of some fans, by blocks."""
        parts = blocks(len(rows), _BLOCK // _DIRECTIONS)
        return on_all_cores(lambda part: function(distance, label, self._sides(rows[part])), parts)

    def _sides(self, rows: Ints) -> Ints:
        """Return the numbers of the sides of some fans."""
        return runs(self._start[rows], self._start[rows + 1] - self._start[rows])

    def _ahead(self, distance: Floats, label: Ints, side: Ints) -> Ints:
        """Return which of some triangles a front comes through, as far as paths along pairs tell."""
        own = distance[self._own[side]]
        left, right = distance[self._end[side]], distance[self._end[self._next[side]]]
        before = np.flatnonzero((left < own) & (right < own))
        side, left, right = side[before], left[before], right[before]
        one, other = self._place[side], self._place[self._next[side]]
        toward, _, known = _front(one, other, left, right, self._alike(label, side))
        first, last = one * np.exp(-1j * _ASTRAY), other * np.exp(1j * _ASTRAY)
        known &= (_cross(first, toward) >= 0.0) & (_cross(toward, last) >= 0.0)
        return side[known & (_dot(toward, one + other) > 0.0)]

    def _alike(self, label: Ints, side: Ints) -> Bools:
        """Tell at which triangles both corners are reached from the same source."""
        same: Bools = label[self._end[side]] == label[self._end[self._next[side]]]
        return same

    def _passed(self, distance: Floats, label: Ints, side: Ints) -> Ints:
        """Return along which sides of some fans a front comes earlier than their points were reached."""
        own, place = self._own[side], self._place[side]
        late = distance[own] - distance[self._end[side]] - _SETTLED * self._step[own]
        return side[(late > 0.0) & (late**2 > _dot(place, place))]

    def _shorten(self, distance: Floats, label: Ints, side: Ints, least: float) -> Ints:
        """Shorten distances by what comes through some triangles; return the points that became nearer."""
        other = self._next[side]
        one, two, first, second = self._place[side], self._place[other], self._end[side], self._end[other]
        left, right = distance[first], distance[second]
        toward, through, known = _front(one, two, left, right, label[first] == label[second])
        # Within the triangle, and outwards: else a front comes along one of its sides.
        known &= (_cross(one, toward) >= 0.0) & (_cross(toward, two) >= 0.0) & (through > np.maximum(left, right))
        left, right = left + np.abs(one), right + np.abs(two)
        found = np.where(known, through, np.minimum(left, right))
        row = self._own[side]
        nearer = np.flatnonzero(found < distance[row] - np.maximum(least * self._step[row], 1e-12 * distance[row]))
        row, found = row[nearer], found[nearer]
        np.minimum.at(distance, row, found)
        won = found == distance[row]
        label[row[won]] = label[np.where(left < right, first, second)[nearer][won]]
        return row


def _fan(
    lengths: sparse.csr_array, places: Floats, normals: Floats, right: Floats, ahead: Floats, rows: slice
) -> tuple[Ints, Ints, Array]:
    """Return the fans of some points: how many corners, which points these are in their order, and where, complex."""
    start = lengths.indptr[rows.start : rows.stop + 1]
    end, length = lengths.indices[start[0] : start[-1]], lengths.data[start[0] : start[-1]]
    count = len(start) - 1
    own = np.repeat(np.arange(count), np.diff(start))
    chord = places.take(end, axis=1) - places[:, rows].take(own, axis=1)
    here, there = normals[:, rows].take(own, axis=1), normals.take(end, axis=1)
    there *= np.where(dots(here, there) < 0.0, -1.0, 1.0)
    step = chord + arc_ahead(dots(chord, here), dots(chord, there)) * there
    x, y = (dots(step, axis[:, rows].take(own, axis=1)) for axis in (right, ahead))
    size = np.hypot(x, y)
    # Coincident points lie in no direction, and have the same fans themselves.
    length = np.where((size > 0.0) & (length > 1e-300), length, np.inf)
    angle = np.arctan2(y, x)
    nearest = np.full(count, np.inf)
    np.minimum.at(nearest, own, length)
    # Counted from the nearest neighbor, so that they turn with the points.
    zero = np.zeros(count)
    first = length == nearest[own]
    zero[own[first]] = angle[first]
    sector = (
        own * _DIRECTIONS + np.rint((angle - zero[own]) * (0.5 * _DIRECTIONS / np.pi)).astype(np.int64) % _DIRECTIONS
    )
    nearest = np.full(count * _DIRECTIONS, np.inf)
    np.minimum.at(nearest, sector, length)
    chosen = np.full(count * _DIRECTIONS, -1)
    first = np.flatnonzero(np.isfinite(length) & (length == nearest[sector]))
    chosen[sector[first]] = first
    chosen = chosen[chosen >= 0]
    place = length[chosen] * (x[chosen] + 1j * y[chosen]) / size[chosen]
    return np.bincount(own[chosen], minlength=count), end[chosen], place


def _front(one: Array, other: Array, left: Floats, right: Floats, same: Bools) -> tuple[Array, Floats, Bools]:
    """Return the front that passes two corners at these distances: towards where it comes from, how far, if there is.

    From the same source it is a circle around a place behind the corners; from several, a straight line.
    """
    edge = other - one
    squared = _dot(edge, edge)
    squared = np.where((squared > 0.0) & np.isfinite(left) & np.isfinite(right), squared, np.inf)
    with np.errstate(invalid="ignore"):
        along = np.where(same, 0.5 + 0.5 * (left - right) * (left + right) / squared, (left - right) / np.sqrt(squared))
        away = np.where(same, left**2 / squared, 1.0) - along**2
    known = (away > 0.0) & np.isfinite(squared)
    toward = edge * (np.where(known, along, 0.0) - 1j * np.sqrt(np.where(known, away, 0.0)))
    toward = np.where(same, one + toward, toward / np.sqrt(squared))
    return toward, np.where(same, np.abs(toward), left + _dot(toward, one)), known


def _dot(left: Array, right: Array) -> Floats:
    """Return the inner products of vectors in the plane."""
    result: Floats = left.real * right.real + left.imag * right.imag
    return result


def _cross(left: Array, right: Array) -> Floats:
    """Return the cross products of vectors in the plane."""
    result: Floats = left.real * right.imag - left.imag * right.real
    return result
