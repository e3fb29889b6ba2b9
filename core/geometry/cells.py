"""Voronoi cells of the points within the surface: their areas and radii."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..algebra import blocks, on_all_cores
from ..cores import cores
from ..types import Bools, Floats, Ints, Report
from .boundary import Boundary
from .distances import arc_ahead, arc_squared, bent_ways, heights_of_ends
from .edges import Sides
from .nearest import COUNT, Nearest
from .quadrics import CURVED, along, chords, components, frames, lengthened
from .sheets import on_sheet

_BLOCK = 1 << 13  # points whose cells are cut at one time
_SAME = 1e-9  # relative tolerance: cuts that differ by less of the longest one, or of their product, are the same
_AT_BOUNDARY = 1e-3  # spacings that a boundary lies off a point, at least
_CLOSEST = 1e-6  # spacings to the nearest cut, at least: its inverse is so long that `_SAME` would hide other cuts


@dataclass(frozen=True)
class Cells:
    """Voronoi cells."""

    areas: Floats  # (m,), their areas, all positive
    # (m,), distance of the furthest corner: the radius of the largest empty disc that touches the point. Half an even
    # spacing or a little more; larger where points are irregular, or sparser in one direction than in the other
    radius: Floats
    corner: Floats  # (m, 2), the way to it, where that disc has its center, along the tangents of `frames`


def measure_cells(
    nearest: Nearest,
    normals: Floats,
    gaussian_curvature: Floats,
    boundary: Boundary,
    component: Ints | None = None,
    report: Report = lambda: None,
    before: Cells | None = None,
    sides: Sides | None = None,
) -> Cells:
    """Measure the cell of every point in geodesic polar coordinates around it.

    A neighbor at the distance d cuts the plane at d / 2; next to a boundary the cell ends there. On a surface of
    Gaussian curvature K the cut is a geodesic: in gnomonic coordinates, ``tan(sqrt(K) r) / sqrt(K)``, it is a straight
    line, and an area is 2 (1 - (1 + K R^2)^(-1/2)) / (K R^2) of what it is in the plane.

    Parameters
    ----------
    nearest : Nearest
        Of m points. Neighbors on other sheets cut nothing. Where the nearest ones leave a cell open, more of them are
        looked at; cells that stay open end a spacing away.
    normals : ndarray, (m, 3)
        Unit normals of any sign.
    gaussian_curvature : ndarray, (m,)
    boundary : Boundary
    component : ndarray, (m,) int, optional
        Component of each point; those of others cut nothing.
    report : callable
        Called now and then; may raise `Cancelled`.
    before : Cells, optional
        Of the same points without the boundary: only those near it are measured again.
    sides : Sides, optional
        Of the points, with the same normals, for ways over edges; without them all ways are arcs.

    Returns
    -------
    Cells
    """
    count = len(normals)
    component = np.zeros(count, dtype=int) if component is None else component
    if before is None:
        cells, rows = Cells(np.empty(count), np.empty(count), np.empty((count, 2))), np.arange(count)
    else:
        cells = Cells(before.areas.copy(), before.radius.copy(), before.corner.copy())
        rows = np.flatnonzero(boundary.distance[:, 0] < np.maximum(nearest.distance[:, -1], before.radius))
    whole = ~np.any(nearest.apart, axis=1)  # no neighbor was left out: more of them can close a cell
    spacing = nearest.spacing
    # Few points close most cells; more are looked at while one is open, as a jump of density has them on one side.
    for many in (COUNT // 2 + 1, COUNT, 4 * COUNT, 16 * COUNT):
        still_open = np.zeros(count, dtype=bool)

        def measure(part: slice, rows: Ints = rows, many: int = many, still_open: Bools = still_open) -> None:
            block = rows[part]
            cuts, furthest = _cuts(nearest, normals, gaussian_curvature, boundary, component, block, many, sides)
            areas, corner, closed = _intersect(cuts, gaussian_curvature[block], 0.5 * furthest)
            known = np.flatnonzero(closed)
            if many == COUNT and not closed.all():
                # Where a cell has no neighbor it ends one spacing off, as far as those of random points.
                gaps = np.flatnonzero(~closed)
                capped = np.concatenate([cuts[gaps], _caps(cuts[gaps], 1.0 / spacing[block[gaps]])], axis=1)
                areas[gaps], corner[gaps], _ = _intersect(capped, gaussian_curvature[block[gaps]], np.inf)
                known = np.arange(len(block))
            cells.areas[block[known]], cells.radius[block[known]] = areas[known], np.linalg.norm(corner[known], axis=1)
            cells.corner[block[known]] = corner[known]
            still_open[block] = ~closed & (whole[block] | (many < COUNT))

        on_all_cores(measure, blocks(len(rows), _BLOCK * COUNT // max(many, COUNT)), report)
        rows = np.flatnonzero(still_open)
    return cells


def _cuts(
    nearest: Nearest,
    normals: Floats,
    gaussian_curvature: Floats,
    boundary: Boundary,
    component: Ints,
    rows: Ints,
    many: int,
    sides: Sides | None,
) -> tuple[Floats, Floats]:
    """Return the cuts of some points by so many neighbors, (k, cuts, 2), and how far away the last of these is.

    A cut is the vector across it, as long as one over its distance; one that does not count is zero.
    """
    if many <= COUNT:
        known = rows, slice(many)
        index, distance, counted = nearest.index[known], nearest.distance[known], nearest.weight[known] > 0.0
        joined = np.ones(index.shape, dtype=bool)
    else:
        many = min(many, len(normals))
        distance, index = nearest.tree.query(nearest.points[rows], k=many, workers=cores())
        counted = on_sheet(nearest, normals, rows, index, distance)[0]
        joined = component[index] == component[rows, None]
        counted &= joined
    index, distance, counted, joined = index[:, 1:], distance[:, 1:], counted[:, 1:], joined[:, 1:]
    around = normals if sides is None else sides.around
    chord, frame = chords(nearest.points, rows, index), frames(normals[rows])[:, :, 1:]
    cosine, left, right = heights_of_ends(chord, normals, rows, index)
    turned = (
        cosine
        if around is normals
        else sum(own[:, None] * part for own, part in zip(around[rows].T, components(around, index), strict=True))
    )
    side = np.where(turned < 0.0, -1.0, 1.0)
    cosine, right = side * cosine, side * right
    squared, ahead = arc_squared(distance**2, left, right, cosine), arc_ahead(left, right)
    if sides is not None:
        sure = np.maximum(sides.sharp[rows, None], sides.sharp[index])
        edged = np.nonzero(sure)
        turn = sides.turn(rows[edged[0]], index[edged], chord[:, edged[0], edged[1]], side[edged])
        heights = left[edged], right[edged], cosine[edged]
        squared[edged], ahead[edged] = bent_ways(distance[edged] ** 2, *heights, turn, sure[edged])
    for step, normal in zip(chord, components(normals, index), strict=True):
        step += side * ahead * normal
    x, y = (along(chord, axis) for axis in frame.transpose(2, 1, 0))
    length = 0.5 * np.sqrt(squared) * (1.0 + np.clip(gaussian_curvature[rows, None] * squared / 12.0, -CURVED, CURVED))
    length = np.maximum(length, _CLOSEST * nearest.spacing[rows, None])
    cuts = np.stack(lengthened(x, y, counted / length), axis=2)
    inside = np.maximum(boundary.distance[rows], _AT_BOUNDARY * nearest.spacing[rows, None])
    outward = np.einsum("iac,ick->iak", boundary.outward[rows], frame) / inside[:, :, None]
    cuts = np.concatenate([cuts, outward], axis=1)
    # Of a small component all points are seen, and nothing is known of what lies further away than they do.
    return cuts, np.sqrt(np.max(squared, axis=1, where=joined, initial=0.0))


def _caps(cuts: Floats, size: Floats) -> Floats:
    """Return cuts of one size opposite to all others, and to the sides of the nearest one: they close any cell."""
    length = np.linalg.norm(cuts, axis=2)
    unit = cuts / np.maximum(length, 1e-300)[:, :, None]
    first = unit[np.arange(len(cuts)), length.argmax(axis=1)]
    side = np.stack([-first[:, 1], first[:, 0]], axis=1)[:, None]
    return size[:, None, None] * np.concatenate([-unit, side, -side], axis=1)


def _intersect(cuts: Floats, gaussian_curvature: Floats, furthest: Floats | float) -> tuple[Floats, Floats, Bools]:
    """Return the area inside all cuts, (k,), its furthest corner, (k, 2), and whether it is closed and no larger, (k,).

    Its corners are dual to the edges of the convex hull of the cuts, which is found by gift wrapping around the origin
    from the longest cut on; an edge that ends in the origin is open.
    """
    count = len(cuts)
    x, y = (np.append(cuts[:, :, axis], np.zeros((count, 1)), axis=1) for axis in range(2))
    rows = np.arange(count)
    longest = np.argmax(x * x + y * y, axis=1)
    here = np.stack([x[rows, longest], y[rows, longest]])
    first, same = here, _SAME * np.hypot(*here)
    ahead = np.stack([-here[1], here[0]])
    areas, closed = np.zeros(count), np.zeros(count, dtype=bool)
    radius, farthest = np.zeros(count), np.zeros((count, 2))
    start = corner = np.zeros((2, 0))
    for _ in range(x.shape[1] + 1):
        step_x, step_y = x - here[0, :, None], y - here[1, :, None]
        length = np.sqrt(step_x * step_x + step_y * step_y)
        other = length > same[:, None]
        along = step_x * ahead[0, :, None] + step_y * ahead[1, :, None]
        along /= np.where(other, length, 1.0)
        chosen = np.where(other, along, -np.inf).argmax(axis=1)
        every = np.arange(len(rows))
        there = np.stack([x[every, chosen], y[every, chosen]])
        ahead = np.stack([step_x[every, chosen], step_y[every, chosen]]) / np.maximum(length[every, chosen], 1e-300)
        across = here[0] * there[1] - here[1] * there[0]
        out = across <= _SAME * np.hypot(*here) * np.hypot(*there)
        before = corner
        corner = np.stack([there[1] - here[1], here[0] - there[0]]) / np.where(out, 1.0, across)
        away = np.where(out, 0.0, np.hypot(*corner))
        further = away > radius[rows]
        radius[rows[further]], farthest[rows[further]] = away[further], corner.T[further]
        if not before.size:
            start = corner
        else:
            areas[rows] += _triangles(before, corner, gaussian_curvature[rows])
        done = ~out & (np.hypot(*(there - first)) <= same)
        closed[rows[done]] = True
        areas[rows[done]] += _triangles(corner[:, done], start[:, done], gaussian_curvature[rows[done]])
        left = ~out & ~done
        here = there
        if not left.all():
            x, y, rows, same = x[left], y[left], rows[left], same[left]
            here, ahead, corner, start, first = (values[:, left] for values in (here, ahead, corner, start, first))
        if not len(rows):
            break
    return areas, farthest, closed & (radius < furthest)


def _triangles(corner: Floats, other: Floats, gaussian_curvature: Floats) -> Floats:
    """Return the areas of triangles of the point and two corners, (2, k) each, on a surface of that curvature."""
    plane = 0.5 * (corner[0] * other[1] - corner[1] * other[0])
    squared = np.sum(corner * corner + other * (corner + other), axis=0)
    # Of the mean squared distance along the edge.
    curved = np.maximum(gaussian_curvature * squared / 3.0, -CURVED) + 1e-12
    return plane * 2.0 * (1.0 - 1.0 / np.sqrt(1.0 + curved)) / curved
