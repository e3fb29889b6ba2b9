"""Components of a cloud: gaps, lone points, and sheets that nowhere meet."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..algebra import blocks, by_blocks, on_all_cores
from ..types import Bools, Floats, Ints
from .nearest import COUNT, NEXT, Nearest

_GAP = 2.0  # an edge over this many distances to the 8th neighbor is a gap; a larger factor joins clumps of outliers
_BLOCK = 1 << 13  # points whose neighbors are looked at at one time


def even_reach(nearest: Nearest) -> Floats:
    """Return the length from which an edge is a gap, (m,), by the density of points whatever the direction."""
    reach: Floats = _GAP * np.sqrt(NEXT / np.pi) * nearest.spacing
    return reach


def gap_reach(nearest: Nearest) -> Floats:
    """Return the length from which an edge is a gap, (m,): by the 8th neighbor, or in rows by `even_reach`.

    Where the nearest eight lie along a row, but the neighbors do not, none of these lies across a gap.
    """
    reach = _GAP * nearest.distance[:, 1 : NEXT + 1][:, -1]  # of eight points there are seven neighbors
    rows = nearest.beside_rows
    reach[rows] = np.maximum(reach[rows], nearest.distance[rows, -1])
    return np.where(nearest.in_row, even_reach(nearest), reach)


def label_components(nearest: Nearest, usual: float | None = None) -> Ints:
    """Number the components of the cloud, which gaps separate, (m,) int.

    Points are joined to their forty neighbors, as points may crowd along lines, except over gaps far wider than the
    spacing at the nearer end; components of some size are joined over gaps that are no wider than the spacing of the
    sparser one would let expect. `usual` is the median of `gap_reach`, if these are not all the points. The largest
    component is 0. Those of fewer points than a neighborhood has, 41, which get no operator, are -1.
    """
    index = nearest.index[:, 1:]
    usual = float(np.median(gap_reach(nearest))) if usual is None else usual
    strict, loose = find_gaps(nearest, usual)
    label = label_connected(index, strict)
    large = number_by_size(label, COUNT) >= 0
    if not large.all():
        loose &= large[:, None] & large[index]
    return number_large(label_connected(index, loose, label), large)


def find_gaps(nearest: Nearest, usual: float) -> tuple[Bools, Bools]:
    """Tell which edges to neighbors, (m, 40) bool, are no gaps, and which are none between components of some size."""
    index, distance, reach = nearest.index[:, 1:], nearest.distance[:, 1:], gap_reach(nearest)

    def measure(rows: slice) -> Bools:
        here, there = reach[rows, None], reach[index[rows]]
        strict = distance[rows] <= np.maximum(np.minimum(here, there), usual)
        return np.stack([strict, distance[rows] <= np.maximum(here, there)], axis=1)

    strict, loose = np.moveaxis(by_blocks(measure, len(index)), 1, 0)
    return strict, loose


def number_large(label: Ints, large: Bools) -> Ints:
    """Number components of points, the largest 0; those not among the large ones, or in a small component, are -1."""
    result = np.full(len(label), -1)
    result[large] = number_by_size(label[large], COUNT)
    return result


def label_connected(index: Ints, joined: Bools, label: Ints | None = None) -> Ints:
    """Number the components of points whose neighbors, (m, k) int, are joined to them, (m, k) bool.

    Points with one label, (m,) int, if these are given, belong together anyway.
    """
    label = np.arange(len(index), dtype=np.int32) if label is None else label
    # By the nearest neighbors first, for speed: hardly any other edge still joins two components then.
    for some in (slice(0, 3), slice(3, NEXT), slice(NEXT, None)):
        if label.max() == 0:
            break

        def across(rows: slice, some: slice = some, label: Ints = label) -> Ints:
            other = label[index[rows, some]]
            row, column = np.nonzero(joined[rows, some] & (other != label[rows, None]))
            return np.stack([label[rows][row], other[row, column]], axis=1)

        ends = tuple(np.concatenate(on_all_cores(across, blocks(len(index), _BLOCK))).T)
        graph = sparse.csr_array((np.ones(len(ends[0]), dtype=bool), ends), shape=(label.max() + 1,) * 2)
        label = connected_components(graph, directed=False)[1][label]
    return label


def number_by_size(label: Ints, smallest: int) -> Ints:
    """Number labels by how many points have them, the most frequent 0; rarer ones than the smallest size are -1."""
    _, label, size = np.unique(label, return_inverse=True, return_counts=True)
    return number_sizes(size, smallest)[label]


def number_sizes(size: Ints, smallest: int) -> Ints:
    """Number sizes, (k,) int, the greatest 0; those below the smallest one are -1, but for the greatest."""
    order = np.argsort(-size, kind="stable")
    number = np.empty_like(order)
    number[order] = np.where((size[order] >= smallest) | (np.arange(len(order)) == 0), np.arange(len(order)), -1)
    return number


def move_apart(points: Floats, component: Ints) -> Floats:
    """Move components so far from each other that no search finds neighbors in another one; nothing else changes."""
    if component.max() == 0:
        return points
    moved = points.copy()
    moved[:, 0] += 4.0 * np.ptp(points, axis=0).max() * component
    return moved
