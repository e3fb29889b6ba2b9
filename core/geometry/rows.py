"""Neighbors across rows: where points crowd along lines, such as the rings of a turning lidar."""

from dataclasses import replace

import numpy as np

from ..algebra import blocks, on_all_cores
from ..types import Bools, Floats, Ints
from .components import label_connected
from .nearest import NEXT, ROW, SMOOTH, Nearest, fading_weights
from .quadrics import eighths, fit_quadrics

_WIDER = 16  # times the 40 neighbors are looked at: the next row may be a hundred times as far as the next point
_BLOCK = 1 << 8  # points looked at at one time


def look_across_rows(nearest: Nearest) -> Nearest:
    """Find the neighbors of points anew whose nearest ones lie along a row, as long as there are other rows.

    They are then the nearest ones in each of eight directions, in turn. Of a curve, which has no rows beside it, the
    points keep the neighbors that they have. Where points nowhere lie along rows the same neighbors are returned.
    """
    if nearest.index.shape[1] <= NEXT:
        return nearest
    rows = np.flatnonzero((nearest.quadrics.roundness < ROW) & ~nearest.in_row)
    rows = rows[nearest.along_row(rows)]
    if not len(rows):
        return nearest
    in_row = nearest.in_row.copy()
    in_row[rows] = True
    label = _label_rows(nearest, in_row)
    index, distance, weight = nearest.index.copy(), nearest.distance.copy(), nearest.weight.copy()
    alone, whole, most = np.zeros(len(rows), dtype=bool), index.shape[1], min(_WIDER * index.shape[1], nearest.tree.n)
    left = np.arange(len(rows))
    for many in (max(whole, most // 4), most):
        settled = np.full(len(left), many == most)

        def find(part: slice, left: Ints = left, many: int = many, settled: Bools = settled) -> None:
            block = rows[left[part]]
            far, other = nearest.tree.query(nearest.points[block], k=many)
            beside = label[other] != label[block, None]
            found = beside.any(axis=1)
            offset = nearest.points[other] - nearest.points[block, None]
            along, every = offset[:, NEXT], np.arange(len(block))
            # Points farther along the row that do not crowd are in no row, but do not lie across it, either.
            turned = np.abs(np.einsum("ikc,ic->ik", offset, along)) < SMOOTH * far * far[:, [NEXT]]
            across = (beside & turned).any(axis=1)
            beside[across] &= turned[across]
            sector = _sectors(offset, along, offset[every, beside.argmax(axis=1)])
            sector[:, 0] = NEXT  # the point itself
            rank = _ranks(sector)
            chosen = np.argsort(rank, axis=1, kind="stable")[:, :whole]
            # Where there are as many in all directions, none further away would take the place of one of them.
            last = rank[every, chosen[:, -1]]
            settled[part] |= across & (np.count_nonzero(rank < last[:, None], axis=1) == NEXT * last + 1)
            chosen.sort(axis=1)
            index[block] = np.take_along_axis(other, chosen, axis=1)
            distance[block] = np.take_along_axis(far, chosen, axis=1)
            alone[left[part]] = ~found

        on_all_cores(find, blocks(len(left), _BLOCK))
        left = left[~settled]
    found = rows[~alone]
    weight[found] = fading_weights(distance[found])
    fitted = fit_quadrics(nearest.points, index[found], weight[found], found)
    rounder = fitted.roundness > nearest.quadrics.roundness[found]  # others may be a narrow strip
    back = np.setdiff1d(rows, found[rounder])
    for values, before in (index, nearest.index), (distance, nearest.distance), (weight, nearest.weight):
        values[back] = before[back]
    in_row[back] = False
    result = replace(nearest, index=index, distance=distance, weight=weight, in_row=in_row)
    return result.with_quadrics(nearest.quadrics.put(found[rounder], fitted.take(np.flatnonzero(rounder))))


def _label_rows(nearest: Nearest, in_row: Bools) -> Ints:
    """Number the rows, chains of points each of which is next to those nearest to it, (m,); other points are alone."""
    next_to = nearest.index[:, : NEXT + 1]
    return label_connected(next_to, in_row[:, None] | in_row[next_to])


def _sectors(offset: Floats, along: Floats, beside: Floats) -> Ints:
    """Return in which of eight directions offsets lie, (k, views), counted from that along the row."""
    along = along / np.linalg.norm(along, axis=1)[:, None]
    across = beside - np.einsum("ic,ic->i", beside, along)[:, None] * along
    across /= np.maximum(np.linalg.norm(across, axis=1), 1e-300)[:, None]
    x, y = np.einsum("ikc,ic->ik", offset, along), np.einsum("ikc,ic->ik", offset, across)
    turn = np.pi / NEXT  # the middle of an eighth lies along the row
    return eighths(np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y)


def _ranks(label: Ints) -> Ints:
    """Return how many before each entry of a line have its label, (k, views)."""
    place = np.arange(label.shape[1], dtype=np.int16)
    order = np.argsort(label, axis=1, kind="stable")
    ordered = np.take_along_axis(label, order, axis=1)
    new = np.diff(ordered, axis=1, prepend=-1) != 0
    rank = np.empty(label.shape, dtype=np.int16)
    np.put_along_axis(rank, order, place - np.maximum.accumulate(np.where(new, place, 0), axis=1), axis=1)
    return rank
