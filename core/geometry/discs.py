"""Radii of discs to be drawn: those of Voronoi cells, no further out than the surface goes."""

import numpy as np
from scipy.spatial import cKDTree

from ..algebra import by_blocks
from ..cores import cores
from ..types import Bools, Floats, Ints
from .cells import Cells
from .nearest import ENOUGH, FEW, Nearest, spacing_of
from .quadrics import frames
from .scaled import ScaledPoints

_WIDEST = 3.0  # spacings: the radius of a disc at most; of a million random points one in ten has an empty disc of 2
_AT_EDGE = 0.8  # spacings, where nothing is on the other side: half the diagonal of a square, and some more
_NEAR = 0.5  # radii: a point this near to the far end of an empty disc's diameter closes it; else more are examined
_OTHERS = 4  # points examined beyond an empty disc, one of which covers what the widest disc leaves open


def disc_radii(nearest: Nearest, normals: Floats, cells: Cells) -> Floats:
    """Return how large the discs of points are drawn, so that they cover the surface and go no further, (m,).

    A cell reaches into the empty disc around its furthest corner. Where no point is on the other side of that, the
    surface ends, and the cell is cut off. What a cell loses that is wider than three spacings, such as between dense
    points and sparse ones, the disc of a sparse point covers. No disc is larger than three times the spacing around it.
    Normals, (m, 3), are those that the cells were measured with.
    """
    around, radii = nearest.index[:, : FEW + 1], cells.radius.copy()
    usual = by_blocks(lambda rows: np.median(nearest.spacing[around[rows]], axis=1), len(around))
    spacing = np.maximum(usual, nearest.spacing)  # of a sparse point beside dense ones its own
    rows = np.flatnonzero(radii > _AT_EDGE * usual)
    axes = frames(normals[rows])[:, :, 1:]
    way = np.einsum("ick,ik->ic", axes, cells.corner[rows])
    across = nearest.points[rows] + 2.0 * way
    apart, other = nearest.tree.query(across, k=range(1, min(_OTHERS, len(radii)) + 1), workers=cores())
    outside = apart[:, 0] > _NEAR * radii[rows]
    doubt = np.flatnonzero(outside)
    outside[doubt] = _on_one_side(nearest, nearest.points[rows[doubt]] + way[doubt], axes[doubt])
    limit = np.where(outside, _AT_EDGE * usual[rows], _WIDEST * spacing[rows])
    lost = np.flatnonzero(~outside & (radii[rows] > limit))
    kept = limit[lost] / radii[rows[lost]]
    radii[rows] = np.minimum(radii[rows], limit)
    _take_over(radii, spacing, nearest.points, nearest.points[rows[lost]] + kept[:, None] * way[lost], other[lost])
    return radii


def scatter_radii(radii: Floats, scaled: ScaledPoints, points: Floats) -> Floats:
    """Return radii of m points in scaled coordinates, (m,), for the caller's points, (n, 3), in their units, (n,).

    Points left out get the median one, where that is at most three times their spacing.
    """
    result: Floats = scaled.scatter(radii * scaled.scale, float(np.median(radii)) * scaled.scale)
    rows = np.flatnonzero(scaled.inverse < 0)
    if len(rows):
        distance = cKDTree(points).query(points[rows], k=range(1, min(FEW + 1, len(points)) + 1), workers=cores())[0]
        spacing = spacing_of(distance)
        result[rows] = np.where(spacing > 0.0, np.minimum(result[rows], _WIDEST * spacing), result[rows])
    return result


def _on_one_side(nearest: Nearest, places: Floats, axes: Floats) -> Bools:
    """Tell of which places, (k, 3), in planes by their axes, (k, 3, 2), all points near by lie on one side, (k,)."""
    some = range(1, min(ENOUGH, len(nearest.points)) + 1)
    index = nearest.tree.query(places, k=some, workers=cores())[1]

    def on_one_side(rows: slice) -> Bools:
        x, y = np.einsum("ikc,ica->aik", nearest.points[index[rows]] - places[rows, None], axes[rows])
        angle = np.sort(np.arctan2(y, x), axis=1)
        gaps = np.diff(np.concatenate([angle, angle[:, :1] + 2.0 * np.pi], axis=1), axis=1)
        return np.asarray(gaps.max(axis=1) > np.pi)

    return by_blocks(on_one_side, len(places))


def _take_over(radii: Floats, spacing: Floats, points: Floats, places: Floats, other: Ints) -> None:
    """Enlarge radii, (m,), so that of other points, (k, c), that of the largest spacing covers each place, (k, 3)."""
    asked = np.linalg.norm(points[other] - places[:, None], axis=2)
    best = np.argmin(asked / spacing[other], axis=1)[:, None]
    chosen, asked = (np.take_along_axis(values, best, axis=1)[:, 0] for values in (other, asked))
    possible = asked <= _WIDEST * spacing[chosen]
    np.maximum.at(radii, chosen[possible], asked[possible])
