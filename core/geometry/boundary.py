"""Boundaries of open surfaces: which points lie at one, and how far every point is from it."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.spatial import cKDTree

from ..algebra import blocks, inverses, on_all_cores
from ..cores import cores
from ..kernel import SUPPORT
from ..types import Array, Bools, Floats, Ints
from .components import label_connected
from .distances import arc_squared
from .nearest import AGREEING, COUNT, FEW, GAP, NEXT, ON, POWER, SMOOTH, Nearest, fading_weights
from .noise import LEFT
from .points import FEWEST
from .quadrics import chords, eighths, frames, in_plane
from .sheets import on_sheet

_BLOCK = 1 << 13  # points looked at at one time
_ANGLE = np.radians(100.0)  # widest angle without a neighbor, at least
PROBE, _EMPTY = 8.0, 0.6  # the place 8 gaps outside a boundary point has no point within 0.6 of that distance
HOLE = _EMPTY * PROBE  # gaps: radius from which holes are not due to chance, whatever their shape
_REACH = 20.0  # spacings from a boundary at which no kernel sees it
_PART = 3  # a parabola is fitted to a third of a short boundary at most: more of a square's has two corners
_LEVEL = 1.45  # standard deviations that the boundary lies outside the mean of its candidates
VOID, SURE = 1.3, 1.6  # gaps from a place off the surface to the nearest point: at least, and enough to tell by itself
_KINK = 2.0  # factor by which a fit to one side of a corner must scatter less, to be taken


@dataclass(frozen=True)
class Boundary:
    """Where the surface ends: for every point the nearest boundary and, next to a corner, the second one."""

    at_boundary: Bools  # (m,)
    distance: Floats  # (m, 2), distance to the boundary along the surface; infinite far from any
    # (m, 2), geodesic curvature of the boundary there: 1 / R for a disc of radius R, negative around a hole
    curvature: Floats
    outward: Floats  # (m, 2, 3), unit vector across the boundary; zero where it is not known

    def reached(self, lengths: Floats) -> Bools:
        """Tell from which points a kernel of these smoothing lengths reaches beyond the boundary, (m,) bool."""
        return self.distance[:, 0] < SUPPORT * lengths

    def parting(self, tree: cKDTree, normals: Floats, first: Ints, second: Ints, gaps: Floats) -> Ints:
        """Return which pairs of points the surface ends between, to go on after a gap, such as a slit, (k,) int.

        From either end the other one lies beyond a boundary there, and halfway between both crossings the straight line
        is well beyond both; or some place on the arc between them is near no point. Where neither end sees the other
        beyond a boundary, as in the mouth of a slit, it has to be farther from all points. Pairs are (p,) each,
        normals, (m, 3), of any sign, and `gaps`, (m,), how wide those between points are.
        """
        near = np.isfinite(self.distance[:, 0])
        rows = np.flatnonzero(near[first] | near[second]) if near.any() else np.zeros(0, dtype=int)
        chord = tree.data[second[rows]] - tree.data[first[rows]]
        length = np.linalg.norm(chord, axis=1)
        near = np.minimum(self.distance[first[rows], 0], self.distance[second[rows], 0]) < 0.5 * length
        rows, chord, length = rows[near], chord[near], length[near]
        first, second = first[rows], second[rows]
        wide = 0.5 * (gaps[first] + gaps[second])
        result, leaving = np.zeros((2, len(rows)), dtype=bool)
        for side in (0, 1):
            ahead, inside = np.einsum("ic,ic->i", chord, self.outward[first, side]), self.distance[first, side]
            for other in (0, 1):
                back, beyond = -np.einsum("ic,ic->i", chord, self.outward[second, other]), self.distance[second, other]
                out = (ahead > inside) & (back > beyond)
                leaving |= (ahead > inside) | (back > beyond)
                share = np.where(out, 1.0 - inside / np.where(out, ahead, 1.0) - beyond / np.where(out, back, 1.0), 0.0)
                result |= 0.5 * share * np.minimum(ahead, back) > 2.0 * ON * wide
        wide = wide * np.where(leaving, VOID, SURE)
        for place in (0.5, 0.375, 0.625, 0.25, 0.75):
            left = np.flatnonzero(~result & (min(place, 1.0 - place) * length > wide))
            ends = first[left], second[left]
            rise = [normals[end] * np.einsum("ic,ic->i", chord[left], normals[end])[:, None] for end in ends]
            there = tree.data[ends[0]] + place * chord[left] + 0.5 * place * (1.0 - place) * (rise[1] - rise[0])
            result[left] = tree.query(there, workers=cores())[0] > wide[left]
        return rows[result]

    def with_nearest(self, distance: Floats, spacing: Floats) -> Self:
        """Return the same with given distances to the nearest boundary, (m,), but for measured ones next to corners."""
        measured = self.distance[:, 0]
        # Around a corner that the surface fills, the nearest place is the corner, which mirrors nothing.
        low, high = (measured + side * ON * spacing for side in (-1.0, 1.0))
        same = np.isinf(self.distance[:, 1]) | ((low < distance) & (distance < high))
        return replace(self, distance=np.column_stack([np.where(same, distance, measured), self.distance[:, 1]]))


def no_boundary(count: int) -> Boundary:
    """Return the boundary of a closed surface."""
    return Boundary(
        np.zeros(count, dtype=bool), np.full((count, 2), np.inf), np.zeros((count, 2)), np.zeros((count, 2, 3))
    )


def find_boundary(nearest: Nearest, oriented: Floats, gaps: Floats) -> Bools:
    """Find the points at which the surface ends, (m,) bool.

    Candidates are points around which the directions of the neighbors leave a wide gap, and far into which there is
    nothing. Where neighbors lie off a point's sheet or face elsewhere, the surface does not end but goes on past an
    edge. Candidates that could not surround the empty place before them are dropped, as chance. Signs of the normals,
    (m, 3), agree; no boundary is found around gaps that are not much wider than those between points, (m,).
    """
    points = nearest.points
    result = np.zeros(len(points), dtype=bool)

    def facing_a_gap(part: slice) -> Ints:
        block = np.arange(part.start, part.stop)
        flat = in_plane(chords(points, block, nearest.index[block]), oriented[block])
        known = nearest.weight[block] > 0.0
        known[:, 0] = False
        open_ = np.flatnonzero(~_surrounded(flat, known))
        flat, known = flat[:, open_], known[open_, 1:]
        angle = np.sort(np.where(known, np.arctan2(flat[1, :, 1:], flat[0, :, 1:]), np.nan), axis=1)
        around = np.concatenate([angle, angle[:, :1] + 2.0 * np.pi], axis=1)
        gap = np.fmax.reduce(np.diff(around, axis=1), axis=1)
        # Neighbors left out sort last, as NaN: the gap over the end is counted from the last known angle.
        gap = np.fmax(gap, angle[:, 0] + 2.0 * np.pi - np.fmax.reduce(angle, axis=1))
        return block[open_[gap > _ANGLE]]

    rows = np.concatenate(on_all_cores(facing_a_gap, blocks(len(points), _BLOCK)))
    if not len(rows):
        return result
    rows = rows[~_bends_away(nearest, oriented, rows)]
    ahead = PROBE * gaps[rows]
    probe = points[rows] + ahead[:, None] * outward_directions(nearest, oriented, rows)
    distance, next_one = nearest.tree.query(probe, workers=cores())
    # The nearest points there may be sparser: then the surface continues at their density.
    rows = rows[distance > _EMPTY * np.maximum(ahead, PROBE * gaps[next_one])]
    if len(rows) < FEWEST:
        return result
    label = _label_courses(points[rows], PROBE * gaps[rows])
    length = np.bincount(label, nearest.spacing[rows] / gaps[rows])
    result[rows] = length[label] >= 2.0 * np.pi * HOLE
    return result


def _surrounded(flat: Floats, known: Bools) -> Bools:
    """Tell around which points known ones, (k, views), lie in each eighth of the plane, seen from there, (2, k, views).

    Between them is no gap as wide as `_ANGLE`, which holds an eighth wherever it begins.
    """
    seen = np.bitwise_or.reduce(known << eighths(*flat), axis=1)
    return seen == (1 << NEXT) - 1


def _bends_away(nearest: Nearest, oriented: Floats, rows: Ints) -> Bools:
    """Tell around which points neighbors lie off their sheet or face elsewhere: it goes on there, past an edge."""
    cosine = np.einsum("ikc,ic->ik", oriented[nearest.index[rows]], oriented[rows])
    beside = nearest.apart[rows]
    near = slice(FEW)  # on a coarsely sampled ball neighbors further away lie on its far side
    beside[:, near] |= np.abs(cosine[:, near]) < SMOOTH
    return np.count_nonzero(beside, axis=1) >= AGREEING


def _label_courses(points: Floats, reach: Floats) -> Ints:
    """Number the boundaries that boundary points, (k, 3), lie on; those of one are within reach of each other."""
    distance, other = cKDTree(points).query(points, k=min(NEXT + 1, len(points)), workers=cores())
    return label_connected(other, distance <= reach[:, None])


def outward_directions(nearest: Nearest, normals: Floats, rows: Ints) -> Floats:
    """Return unit vectors in the tangent planes of some points, away from their neighbors, (k, 3)."""
    offset = nearest.points[nearest.index[rows]] - nearest.points[rows, None]
    return _tangents(-np.einsum("ik,ikc->ic", nearest.weight[rows], offset), normals[rows])


def _tangents(directions: Floats, normals: Floats) -> Floats:
    """Return the directions in the tangent planes as unit vectors, (k, 3)."""
    flat = directions - np.einsum("ic,ic->i", directions, normals)[:, None] * normals
    return flat / np.maximum(np.linalg.norm(flat, axis=1), 1e-300)[:, None]


def measure_boundary(nearest: Nearest, normals: Floats, at_boundary: Bools) -> Boundary:
    """Measure how far the points are from the boundary, by unit normals, (m, 3), and the points at it, (m,) bool.

    Around every boundary point the boundary's course is a parabola through the boundary points next to it, on one side
    of a corner, moved outwards by their scatter: at random, points lie up to a spacing inside the boundary; of points
    exactly on it the scatter is zero.
    """
    boundary, reach = no_boundary(len(normals)), _REACH * nearest.spacing
    rows = np.flatnonzero(at_boundary)
    if len(rows) < FEWEST:
        return boundary
    course = _fit_course(nearest, normals, rows)
    tree = cKDTree(nearest.points[rows])
    close = np.flatnonzero(tree.query(nearest.points, workers=cores())[0] < reach)
    span, view = tree.query(nearest.points[close], k=min(COUNT, len(rows)), workers=cores())

    def measure(part: slice) -> None:
        block = close[part]
        seen, near = view[part], span[part]
        spacing, within = nearest.spacing[block], near < reach[block, None]
        # Near candidates are best, and those away from corners of the boundary.
        doubt = (near + GAP * spacing[:, None]) * course.scatter[seen]
        same, cosine = on_sheet(nearest, normals, block, rows[seen], near)
        eligible = within & same & (cosine > 0.0)
        for side in (0, 1):
            best = np.argmin(np.where(eligible, doubt, np.inf), axis=1)
            chosen = seen[np.arange(len(block)), best]
            ahead, some = course.outward[chosen], np.nonzero(eligible)
            eligible[some] = np.einsum("pc,pc->p", course.outward[seen[some]], ahead[some[0]]) > SMOOTH
            some = np.nonzero(eligible)
            trust, distance, curvature = np.zeros((3, *seen.shape))
            trust[some] = (doubt[some] / doubt.min(axis=1)[some[0]]) ** -POWER
            distance[some], curvature[some] = course.measure(nearest.points, normals, block[some[0]], seen[some])
            total = trust.sum(axis=1)
            known = eligible.any(axis=1)
            total[~known] = 1.0
            measured = np.maximum((trust * distance).sum(axis=1) / total, 0.0)
            # Far from the boundary's points its course is a guess, which may lead past a point that it is nowhere near.
            known &= np.where(eligible, near, np.inf).min(axis=1) <= measured + GAP * spacing
            boundary.distance[block, side] = np.where(known, measured, np.inf)
            boundary.curvature[block, side] = (trust * curvature).sum(axis=1) / total
            boundary.outward[block, side] = np.where(known[:, None], ahead, 0.0)
            if side == 0:
                # Around a corner that the surface fills, the second boundary lies inside the first, across it.
                eligible = within & (cosine > SMOOTH)
                some = np.nonzero(eligible)
                apart, expected = course.ahead(nearest.points, chosen[some[0]], seen[some])
                other = np.einsum("pc,pc->p", course.outward[seen[some]], expected) < SMOOTH
                eligible[some] = other & (apart < ON * spacing[some[0]])

    on_all_cores(measure, blocks(len(close), _BLOCK))
    nearer = np.argsort(boundary.distance, axis=1, kind="stable")
    return Boundary(
        at_boundary,
        np.take_along_axis(boundary.distance, nearer, axis=1),
        np.take_along_axis(boundary.curvature, nearer, axis=1),
        np.take_along_axis(boundary.outward, nearer[:, :, None], axis=1),
    )


@dataclass(frozen=True)
class _Course:
    """Parabolas that the boundary follows around each boundary point: e = a + b t + c t^2 along two tangents.

    `scatter` is that of the boundary points about each over the usual one around: above one next to a corner.
    """

    rows: Ints
    along: Array
    across: Array
    outward: Array
    coefficients: Floats
    scatter: Floats

    def ahead(self, points: Floats, chosen: Ints, seen: Ints) -> tuple[Floats, Floats]:
        """Return how far other boundary points lie outside a parabola's tangent, and its direction across there."""
        chord = points[self.rows[seen]] - points[self.rows[chosen]]
        t = np.einsum("pc,pc->p", chord, self.along[chosen])
        _, b, c = self.coefficients[chosen].T
        expected = self.across[chosen] - (b + 2.0 * c * t)[:, None] * self.along[chosen]
        expected /= np.linalg.norm(expected, axis=1)[:, None]
        return np.einsum("pc,pc->p", chord, self.outward[chosen]), expected

    def measure(self, points: Floats, normals: Floats, first: Ints, seen: Ints) -> tuple[Floats, Floats]:
        """Return the distance of points from the parabolas that they see, and the curvature of these, (p,) each."""
        chord = points[first] - points[self.rows[seen]]
        own, other = normals[first], normals[self.rows[seen]]
        left, height = np.einsum("pc,pc->p", chord, own), np.einsum("pc,pc->p", chord, other)
        left *= np.sign(np.einsum("pc,pc->p", own, other))
        squared = np.maximum(np.einsum("pc,pc->p", chord, chord), 1e-300)
        stretch = np.sqrt(arc_squared(squared, left, height) / squared)
        t = np.einsum("pc,pc->p", chord, self.along[seen])
        e = np.einsum("pc,pc->p", chord, self.across[seen])
        e = np.where(e < 0.0, -1.0, 1.0) * np.hypot(e, height) * stretch
        a, b, c = self.coefficients.T
        curvature = -2.0 * c / (1.0 + b**2) ** 1.5
        a, b, c, curvature = (values[seen] for values in (a, b, c, curvature))
        return (a + b * t + c * t * t - e) / np.sqrt(1.0 + (b + 2.0 * c * t) ** 2), curvature


def _fit_course(nearest: Nearest, normals: Floats, rows: Ints) -> _Course:
    points = nearest.points
    distance, other = cKDTree(points[rows]).query(points[rows], k=min(COUNT, len(rows)), workers=cores())
    # A boundary that is given may be sparse, so that its courses are found without a reach.
    label = _label_courses(points[rows], np.full(len(rows), np.inf))
    fitted = np.clip(np.bincount(label)[label] // _PART, FEW, COUNT - 1)[:, None]
    across = outward_directions(nearest, normals, rows)
    near = other[:, : NEXT + 1]
    side = np.where(np.einsum("ikc,ic->ik", normals[rows[near]], normals[rows]) > 0.0, 1.0, 0.0)
    across = _tangents(np.einsum("ik,ikc->ic", side, across[near]), normals[rows])
    along = np.cross(normals[rows], across)

    unit = np.take_along_axis(distance, np.minimum(fitted, distance.shape[1] - 1), axis=1)
    offset = (points[rows[other]] - points[rows, None]) / unit[:, :, None]
    t, e = np.einsum("ikc,ic->ik", offset, along), np.einsum("ikc,ic->ik", offset, across)
    # The boundary on the other side of a ribbon or a slit faces the other way.
    facing = np.einsum("ikc,ic->ik", across[other], across) > 0.0
    facing &= _on_sheet(nearest, normals, rows, rows[other], distance)
    weight = np.where(facing, fading_weights(np.minimum(distance, unit)), 0.0)
    fit, scatter = _parabola(t, e, weight)
    spacing = nearest.spacing[rows] / unit[:, 0]
    for half in (t < ON * spacing[:, None], t > -ON * spacing[:, None]):
        enough = np.count_nonzero(half & (weight > 0.0), axis=1) >= FEWEST
        other_fit, other_scatter = _parabola(t, e, np.where(half | ~enough[:, None], weight, 0.0))
        better = enough & (scatter > _KINK * other_scatter + LEFT * spacing)
        fit[better], scatter[better] = other_fit[better], other_scatter[better]
    close = np.where(np.arange(other.shape[1]) < fitted // 2, scatter[other] * unit[other, 0], np.nan)
    usual = np.nanmedian(close, axis=1) / unit[:, 0]
    relative = np.maximum((scatter + LEFT * spacing) / (usual + LEFT * spacing), 1.0)
    fit[:, 0] += _LEVEL * usual
    fit *= np.concatenate([unit, np.ones_like(unit), 1.0 / unit], axis=1)
    outward = across - fit[:, 1:2] * along
    return _Course(rows, along, across, outward / np.linalg.norm(outward, axis=1)[:, None], fit, relative)


def _on_sheet(nearest: Nearest, normals: Floats, rows: Ints, other: Ints, distance: Floats) -> Bools:
    """Return which of other points lie on the sheet of some points, and face the same way, (k, views) each."""
    same, cosine = on_sheet(nearest, normals, rows, other, distance)
    return same & (cosine > 0.0)


def _parabola(t: Floats, e: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Fit e = a + b t + c t^2, with c shrunk as far as chance may have made it; return it and the scatter about it."""
    basis = np.stack([np.ones_like(t), t, t * t], axis=2)
    weighted = np.swapaxes(basis * weight[:, :, None], 1, 2)
    inverse = inverses(weighted @ basis + 1e-9 * np.eye(3))
    fit = (inverse @ weighted @ e[:, :, None])[:, :, 0]
    residual = e - np.einsum("ikb,ib->ik", basis, fit)
    total = weight.sum(axis=1)
    freedom = np.maximum(1.0 - 3.0 * (weight**2).sum(axis=1) / total**2, 0.2)
    scatter = np.sqrt((weight * residual**2).sum(axis=1) / (total * freedom))
    spread = inverse[:, 2:] @ weighted
    chance = scatter**2 * (spread**2).sum(axis=(1, 2))
    kept = np.maximum(1.0 - chance / np.maximum(fit[:, 2] ** 2, 1e-300), 0.0)
    fit += (inverse[:, :, 2] / inverse[:, 2:, 2]) * ((kept - 1.0) * fit[:, 2])[:, None]
    return fit, scatter


def given_boundary(nearest: Nearest, normals: Floats, distance: Floats) -> Boundary:
    """Take distances to the boundary as they are, and find the boundary's direction and curvature from them.

    Distances, (m,), are along the surface, and infinite far from any boundary; normals, (m, 3), are unit vectors.
    """
    boundary = no_boundary(len(distance))
    boundary.distance[:, 0] = distance
    known = np.isfinite(distance)
    rows = np.flatnonzero(known & known[nearest.index].all(axis=1))

    def measure(part: slice) -> None:
        block = rows[part]
        index = nearest.index[block]
        unit = nearest.distance[block, -1]
        offset = (nearest.points[index] - nearest.points[block, None]) / unit[:, None, None]
        tangents = frames(normals[block])[:, :, 1:]
        u, v = np.moveaxis(offset @ tangents, 2, 0)
        basis = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=2)
        weighted = np.swapaxes(basis * nearest.weight[block][:, :, None], 1, 2)
        fit = (inverses(weighted @ basis + 1e-9 * np.eye(6)) @ (weighted @ distance[index][:, :, None]))[:, :, 0]
        # The curvature of the level line through the point, and from it that of the boundary, a parallel curve.
        level = -2.0 * (fit[:, 3] + fit[:, 5]) / unit**2
        boundary.curvature[block, 0] = level / np.maximum(1.0 + level * distance[block], 0.5)
        boundary.outward[block, 0] = _tangents(-np.einsum("ick,ik->ic", tangents, fit[:, 1:3]), normals[block])

    on_all_cores(measure, blocks(len(rows), _BLOCK))
    return replace(boundary, at_boundary=distance < 0.5 * nearest.spacing)
