"""Voronoi cells of the points within the surface: what area is nearest to each, and how far the cell reaches."""

from dataclasses import dataclass

import numpy as np

from .distances import arc_squared
from .quadrics import frames
from .sheets import on_sheet

_DIRECTIONS = 64  # in which a cell's edge is looked for; two edges that meet between them are cut exactly
_BLOCK = 1 << 10
_WIDER = 1, 4, 16  # times the 40 neighbours are looked at where a cell is open: a jump of density has them on one side
_TURN = 0.15  # most that the turn of two normals counts for an arc's sixth order, as in `distances.arc_length`
_BENT = (-0.5, 3.0)  # bounds of the Gaussian curvature times the squared reach, where the fit is poor
_AT_BOUNDARY = 1e-3  # spacings that a boundary lies off a point, at least


@dataclass(frozen=True)
class Cells:
    """Voronoi cells.

    Attributes
    ----------
    areas : ndarray, (m,)
        Their areas, all positive.
    reach : ndarray, (m,)
        Distance of the furthest corner: the radius of the largest empty disc that touches the point. Half an even
        spacing or a little more; larger where points are irregular, or sparser in one direction than in the other.
    """

    areas: np.ndarray
    reach: np.ndarray


def measure_cells(nearest, normals, gaussian_curvature, boundary):
    """Measure the cell of every point in geodesic polar coordinates around it.

    A neighbour at the distance d cuts the plane at d / 2; of all cuts the nearest counts in each direction. Next to a
    boundary the cell ends there. On a surface of Gaussian curvature K the cut is a geodesic: in gnomonic coordinates,
    ``tan(sqrt(K) r) / sqrt(K)``, it is a straight line, and an area is 2 (1 - (1 + K R^2)^(-1/2)) / (K R^2) of what it
    is in the plane.

    Parameters
    ----------
    nearest : Nearest
        Of m points. Neighbours on other sheets cut nothing. Where the nearest ones leave a cell open, more of them are
        looked at; cells end halfway to the last one.
    normals : ndarray, (m, 3)
        Unit normals of any sign.
    gaussian_curvature : ndarray, (m,)
    boundary : Boundary

    Returns
    -------
    Cells
    """
    count = len(normals)
    cells = Cells(np.empty(count), np.empty(count))
    rows = np.arange(count)
    whole = (nearest.weight[:, :-1] > 0.0).all(axis=1)  # no neighbour was left out: more of them can close a cell
    for wider in _WIDER:
        neighbors = min(wider * nearest.index.shape[1], count)
        open_ended = np.zeros(count, dtype=bool)
        for start in range(0, len(rows), max(1, _BLOCK // wider)):
            block = rows[start : start + max(1, _BLOCK // wider)]
            if wider == 1:
                seen = nearest.index[block], nearest.distance[block], nearest.weight[block] > 0.0
            else:
                distance, index = nearest.tree.query(nearest.points[block], k=neighbors, workers=-1)
                seen = index, distance, on_sheet(nearest, normals, block, index, distance)[0]
            frame = frames(normals[block])[:, :, 1:]
            curvature = gaussian_curvature[block, None]
            cuts, furthest = _cuts_of_neighbors(nearest.points, normals, block, frame, curvature, *seen)
            outward = np.einsum("iac,ick->iak", boundary.outward[block], frame)
            inside = np.maximum(boundary.distance[block], _AT_BOUNDARY * nearest.spacing[block, None])
            cuts = np.concatenate([cuts, outward / inside[:, :, None]], axis=1)
            triangles, squared = _corners(cuts, 2.0 / furthest)
            bent = np.clip(curvature * squared, *_BENT) + 1e-12
            shrunk = 2.0 * (1.0 - 1.0 / np.sqrt(1.0 + bent)) / bent
            areas, reach = (triangles * 0.5 * (shrunk + np.roll(shrunk, -1, axis=1))).sum(axis=1), squared.max(axis=1)
            closed = reach < (0.499 * furthest) ** 2
            better = closed if wider > 1 else np.full(len(block), True)
            cells.areas[block[better]], cells.reach[block[better]] = areas[better], np.sqrt(reach[better])
            open_ended[block] = ~closed & whole[block]
        rows = np.flatnonzero(open_ended)
        if not len(rows) or neighbors == count:
            break
    return cells


def _cuts_of_neighbors(points, normals, rows, frame, curvature, index, distance, counted):
    """Return cuts as vectors that point across them, as long as one over their distance, (k, views, 2); and the last.

    All but the first of the neighbours, which is the point itself, cut; those that do not count at no distance.
    """
    index, counted = index[:, 1:], counted[:, 1:]
    chord = points[index] - points[rows, None]
    own, other = normals[rows], normals[index]
    cosine = np.einsum("ikc,ic->ik", other, own)
    other = np.where(cosine < 0.0, -1.0, 1.0)[:, :, None] * other
    turn = np.einsum("ikc,ikc->ik", chord, other) - np.einsum("ikc,ic->ik", chord, own)
    squared = arc_squared(distance[:, 1:] ** 2, turn, np.minimum(1.0 - np.abs(cosine), _TURN))
    # The arc leaves the point along the chord, bent away from it by a third of the turn.
    way = (chord + (turn / 6.0)[:, :, None] * other) @ frame
    arc = np.sqrt(squared)
    length = 0.5 * arc * (1.0 + np.clip(curvature * squared / 12.0, -0.25, 0.25))
    size = np.maximum(np.linalg.norm(way, axis=2), 1e-300)
    return way * (counted / (size * length))[:, :, None], arc[:, -1]


def _corners(cuts, least):
    """Return the triangles between the point and a cell's edge, in each direction, and its squared distance there.

    One over the edge's distance is the largest product of a cut with the direction, and at least ``least``.
    """
    angle = np.arange(_DIRECTIONS) * (2.0 * np.pi / _DIRECTIONS)
    step = 2.0 * np.pi / _DIRECTIONS
    ray = np.stack([np.cos(angle), np.sin(angle)])
    product = np.swapaxes(cuts, 1, 2).astype(np.float32)
    product = product[:, :1] * ray[0, :, None].astype(np.float32) + product[:, 1:] * ray[1, :, None].astype(np.float32)
    nearest = product.argmax(axis=2)
    here = np.take_along_axis(cuts, nearest[:, :, None], axis=1)
    there = np.roll(here, -1, axis=1)
    # Where another cut takes over, the corner lies in the direction in which both are as far.
    between = np.arctan2(here[:, :, 0] - there[:, :, 0], there[:, :, 1] - here[:, :, 1])
    between = np.clip(np.mod(between - angle + 0.5 * np.pi, np.pi) - 0.5 * np.pi, 0.0, step)
    between = np.where(nearest == np.roll(nearest, -1, axis=1), step, between)

    def far(cut, turned):
        direction = angle + turned
        return np.maximum(cut[:, :, 0] * np.cos(direction) + cut[:, :, 1] * np.sin(direction), least[:, None])

    first, corner, last = far(here, 0.0), far(here, between), far(there, step)
    triangles = 0.5 * np.sin(between) / (first * corner) + 0.5 * np.sin(step - between) / (corner * last)
    return triangles, 1.0 / np.minimum(first, corner) ** 2
