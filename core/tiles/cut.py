"""Tiles of a cloud: boxes of about as many points each, and a halo around them."""

import numpy as np
from scipy.spatial import cKDTree

from ..cores import cores
from ..geometry import FEW, spacing_of
from ..memory import ADAPTIVE, points_in_kernel
from ..options import LaplacianOptions
from ..types import Floats, Ints

HALO = 48.0  # spacings, at which all results of a tile are those of the whole cloud to 1e-6, see docs/tiles.md

_ROUNDS = 2  # in which spacings are averaged
_DEVIATIONS = 3.0  # by which counts of a sample may be off
NARROWEST = 3.0  # halos that a tile is wide at least: below, most of the work is in the halos
_NARROW = (NARROWEST / (NARROWEST + 2.0)) ** 2  # share of the points of a tile and its halo that are its own then


def halo_of(options: LaplacianOptions) -> float:
    """Return how wide halos are, in spacings: `HALO`, and wider in proportion for kernels wider than by default."""
    return HALO * max(1.0, points_in_kernel(options) / ADAPTIVE) ** 0.5


class Room:
    """What a tile may have with its halo, in spacings, judged by a sample of the cloud, (k, 3).

    Each of these stands for a share of points of the cloud, of which a tile and its halo have so many at most.
    """

    def __init__(self, sample: Floats, share: float, halo: float, most: int) -> None:
        self._sample, self._halo, self._most = sample, halo, most / share
        self._between = 0.5 * np.sqrt(share)  # how much farther the next point of the sample is than that of the cloud
        self._spacing = spacing_around(sample) / np.sqrt(share)

    def around(self, own: Ints, others: Ints) -> Ints:
        """Return those of some other points of the sample that would be in the halo of some, by their rows."""
        tree, usual = cKDTree(self._sample[own]), float(np.median(self._spacing[own]))
        reach = self._halo + self._between
        return others[spacings_away(tree, usual, self._sample[others], self._spacing[others], reach)[0]]

    def is_full(self, own: int, around: int) -> bool:
        """Whether so many points of the sample may be too many."""
        return (own + around) * (1.0 + _DEVIATIONS / np.sqrt(own)) > self._most

    def gap(self, own: Ints) -> tuple[int, float] | None:
        """Return the axis and the level at which points fall apart farther than halos reach; None if they do not."""
        points = np.sort(self._sample[own], axis=0)
        widths = np.diff(points, axis=0)
        if not len(widths) or widths.max() <= self._halo * np.median(self._spacing[own]):
            return None
        row, axis = np.unravel_index(widths.argmax(), widths.shape)
        return int(axis), float(points[row : row + 2, axis].mean())  # beyond points that are not in the sample


class Plan:
    """Planes that divide a cloud into tiles, at medians of a sample, each across the longest side.

    Of points at few places there may be fewer tiles than were asked for; `split` is how often a tile was divided once
    more for want of room.
    """

    def __init__(self, sample: Floats, tiles: int, room: Room | None = None) -> None:
        self._nodes: list[tuple[int, float, int, int]] = []  # axis, level, and the nodes below and above; ~ of tiles
        self.tiles, self.split = 0, 0
        self._sample, self._room = sample, room
        self._root = self._divide(np.arange(len(sample)), np.arange(0), tiles)

    def _divide(self, own: Ints, others: Ints, tiles: int) -> int:
        gap = None
        if self._room is not None and len(own):
            others = self._room.around(own, others)
            if tiles == 1 and self._room.is_full(len(own), len(others)):
                gap = self._room.gap(own)
                # Where most would be in the halo of whatever part, as where points fill a volume, parts do not help.
                if gap is None and len(own) > _NARROW * (len(own) + len(others)):
                    self.split += 1
                    tiles = 2
        if gap is not None:
            axis, level = gap
            parts = 1, 1
        elif tiles > 1 and len(own) > 1:
            points = self._sample[own]
            axis = int(np.ptp(points, axis=0).argmax())
            place = tiles // 2 * len(own) // tiles
            level = float(np.partition(points[:, axis], place)[place])
            parts = tiles // 2, tiles - tiles // 2
        else:
            return self._leaf()
        below = self._sample[own, axis] < level
        if not below.any():
            return self._leaf()
        node = len(self._nodes)
        self._nodes.append((axis, level, 0, 0))
        low, high = own[below], own[~below]
        left = self._divide(low, np.concatenate([others, high]), parts[0])
        right = self._divide(high, np.concatenate([others, low]), parts[1])
        self._nodes[node] = axis, level, left, right
        return node

    def _leaf(self) -> int:
        self.tiles += 1
        return ~(self.tiles - 1)

    def tile(self, points: Floats) -> Ints:
        """Return the tile of each point, (k,)."""
        result = np.empty(len(points), dtype=np.int64)
        waiting = [(self._root, np.arange(len(points)))]
        while waiting:
            node, rows = waiting.pop()
            if node < 0:
                result[rows] = ~node
                continue
            axis, level, left, right = self._nodes[node]
            below = points[rows, axis] < level
            waiting += [(left, rows[below]), (right, rows[~below])]
        return result


def spacing_around(points: Floats) -> Floats:
    """Return the spacing of the points around each, (k,): of random points, one's own says little."""
    count = min(FEW + 1, len(points))
    if count < 2:
        return np.zeros(len(points))
    distance, index = cKDTree(points).query(points, k=count, workers=cores())
    spacing = spacing_of(distance)
    for _ in range(_ROUNDS):
        spacing = spacing[index].mean(axis=1)
    return spacing


def outside(points: Floats, low: Floats, high: Floats) -> Floats:
    """Return how far points, (k, 3), are outside a box, (k,)."""
    distance: Floats = np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=1)
    return distance


def spacings_away(tree: cKDTree, usual: float, points: Floats, spacing: Floats, halo: float) -> tuple[Ints, Floats]:
    """Find which points are in the halo of others, ascending, and how far from these.

    The tree is of the others, with the spacing `usual`; spacings around points are (k,). Distances are in these, or in
    the usual one where that is wider; the halo is in spacings.
    """
    unit = np.maximum(np.maximum(spacing, usual), np.finfo(float).tiny)
    near = np.flatnonzero(outside(points, tree.mins, tree.maxes) / unit <= halo)  # no farther than from their box
    away = tree.query(points[near], workers=cores())[0] / unit[near]
    within = away <= halo
    return near[within], away[within]
