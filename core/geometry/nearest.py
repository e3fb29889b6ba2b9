"""The nearest neighbors of every point: a fixed number, before any smoothing length is known."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..algebra import blocks, by_blocks, on_all_cores
from ..cores import cores
from ..linalg import eigvalsh
from ..types import Bools, Floats, Ints
from .quadrics import Quadrics, chords, covariance, fit_quadrics, roundness

COUNT = 41  # the point itself and 40 others, so that a component has an operator if its neighborhoods lie within it
NEXT = 8  # nearest of them: as many as there are directions in which a sheet or a row goes on
AGREEING = 3  # neighbors that say the same are believed: there are as many faces at a corner; fewer may be chance
FEW = 12  # neighbors that a spacing, a quadric or a parabola follows from at least
ENOUGH = 24  # neighbors from which five or six numbers follow, with some freedom left
ROUNDS = 9  # of averaging over neighbors, after which values vary with the place and not from point to point
POWER = 8  # of a mean that its greatest values decide
ON = 0.3  # spacings from a surface within which a point lies on it
SMOOTH = 0.7  # cosine between normals of one smooth sheet, or between directions across one boundary, at least
GAP = 2.5  # times the usual that a gap may be wide, as in rows 25 times denser along than across: else it is a hole
ROW = 0.2  # roundness of the nearest points of a row: ten times denser along than across, and of the nearest eight
WIDER = 1.3  # factor from each width of a kernel that is tried to the next
_BLOCK = 1 << 13  # points whose neighbors are searched for at one time
_MEASURED = 100_000  # points whose neighbors are searched for in a tenth of a second


@dataclass(frozen=True)
class Nearest:
    """The 40 nearest neighbors of every point."""

    tree: cKDTree  # of m points; components stand far apart in it
    index: Ints  # (m, 41), neighbors by distance, the point itself first
    distance: Floats  # (m, 41)
    # (m, 41), from 1 at the point to 0 at its last neighbor; 0 too for neighbors on another sheet of the surface
    weight: Floats
    # (m,), points that crowd along a row, so that their neighbors are not simply the nearest: see `look_across_rows`
    in_row: Bools

    @property
    def points(self) -> Floats:
        """Coordinates, (m, 3)."""
        return self.tree.data

    @functools.cached_property
    def spacing(self) -> Floats:
        """Distance between points of an even sample as dense as the nearest twelve neighbors, (m,)."""
        return spacing_of(self.distance)

    @functools.cached_property
    def apart(self) -> Bools:
        """Which neighbors were left out, as they lie on another sheet, (m, 41) bool."""

        def differ(rows: slice) -> Bools:
            return np.asarray((self.weight[rows] == 0.0) & (fading_weights(self.distance[rows]) > 0.0))

        return by_blocks(differ, len(self.weight))

    @functools.cached_property
    def quadrics(self) -> Quadrics:
        """A quadric around every point through its neighbors, fitted once: `Quadrics`."""
        return fit_quadrics(self.points, self.index, self.weight)

    def with_quadrics(self, quadrics: Quadrics) -> Nearest:
        """Return the same neighbors with quadrics that were fitted already."""
        result = replace(self)
        vars(result)["quadrics"] = quadrics
        return result

    def keep(self, kept: Bools) -> Nearest:
        """Return the same neighbors with the weight of those not kept, (m, 41) bool, set to zero.

        A quadric has six coefficients: a point that would keep fewer than a dozen neighbors keeps all of them.
        """

        def weigh(rows: slice) -> Floats:
            few = np.count_nonzero(kept[rows] & (self.weight[rows] > 0.0), axis=1) < FEW
            return np.where(kept[rows] | few[:, None], self.weight[rows], 0.0)

        return replace(self, weight=by_blocks(weigh, len(kept)))

    def along_row(self, rows: Ints) -> Bools:
        """Tell of which of some points, (k,) int, the nearest eight neighbors lie along a row, (k,) bool."""
        index = self.index[rows, : NEXT + 1]
        even = np.full(index.shape, 1.0 / index.shape[1])

        def lined(part: slice) -> Bools:
            spread = covariance(chords(self.points, rows[part], index[part]), even[part])
            return roundness(eigvalsh(spread)) < ROW

        return by_blocks(lined, len(rows))

    @functools.cached_property
    def beside_rows(self) -> Bools:
        """Points whose nearest eight neighbors lie along a row, but the others beside it, (m,) bool; found once."""
        result: Bools = self.quadrics.roundness > ROW
        result[result] = self.along_row(np.flatnonzero(result))
        return result

    def across(self, component: Ints) -> Bools:
        """Tell which points have neighbors of another component than their own, (m,) bool, by those, (m,) int."""
        return (component[self.index] != component[:, None]).any(axis=1)

    def renewed(self, tree: cKDTree, changed: Bools, kept: Bools | None = None) -> Nearest:
        """Return the neighbors of the same points at other places, a tree, searched for only where they may be others.

        Quadrics that are known stay so, and are fitted again there: around points in `changed`, (m,) bool, something
        has moved against them, or is gone. Places are those of all m points, or of those `kept`, (m,) bool.
        """
        points, width = tree.data, self.index.shape[1]
        if len(points) < width:
            return find_nearest(points)
        kept = np.ones(len(self.index), dtype=bool) if kept is None else kept
        rows, row = np.flatnonzero(changed[kept]), (np.cumsum(kept) - 1).astype(np.int32)
        index, distance = row[self.index[kept]], self.distance[kept]
        distance[rows], index[rows] = tree.query(points[rows], k=width, workers=cores())
        result = Nearest(tree, index, distance, fading_weights(distance), self.in_row[kept] & ~changed[kept])
        if "quadrics" not in vars(self):
            return result
        fitted = fit_quadrics(points, index[rows], result.weight[rows], rows)
        return result.with_quadrics(self.quadrics.take(np.flatnonzero(kept)).put(rows, fitted))

    def averaged(self, values: Floats, rounds: int = 1) -> Floats:
        """Return quantities of points, (m, ...), after so many rounds of weighted means over the neighbors."""
        (count, width), total = self.index.shape, self._total

        def mean(rows: slice) -> Floats:
            part = sparse.csr_array((rows.stop - rows.start, count))
            # Set afterwards, for the constructor would copy a slice of an array.
            part.data, part.indices = self.weight[rows].ravel(), self.index[rows].ravel()
            part.indptr = np.arange(0, part.data.size + 1, width, dtype=np.int32)
            result: Floats = ((part @ values).T / total[rows]).T
            return result

        for _ in range(rounds):
            values = by_blocks(mean, count)
        return values

    @functools.cached_property
    def _total(self) -> Floats:
        return by_blocks(lambda rows: self.weight[rows].sum(axis=1), len(self.weight))


def find_nearest(points: Floats) -> Nearest:
    """Find the 40 nearest neighbors of every point, (m, 3)."""
    tree, shape = cKDTree(points), (len(points), min(COUNT, len(points)))
    distance, index = np.empty(shape), np.empty(shape, dtype=np.int32)

    def search(rows: slice) -> None:
        distance[rows], index[rows] = tree.query(points[rows], k=shape[1])

    on_all_cores(search, blocks(len(points), _BLOCK))
    return Nearest(tree, index, distance, fading_weights(distance), np.zeros(len(points), dtype=bool))


def spacing_of(distance: Floats) -> Floats:
    """Return the spacing of an even sample as dense as the nearest twelve neighbors, by their distances (n, k)."""
    last = min(FEW, distance.shape[1] - 1)
    return distance[:, last] * np.sqrt(np.pi / last)


def fading_weights(distance: Floats) -> Floats:
    """Return weights that fall from 1 to 0 at the last neighbor, (n, k).

    Which of several neighbors at the same last distance was found then makes no difference. Only where nearly all of
    them are that far, such as around the pole of circles of latitude, all count alike.
    """

    def weigh(rows: slice) -> Floats:
        weights = distance[rows] / distance[rows, -1:]
        weights *= weights
        np.subtract(1.0, weights, out=weights)
        weights *= weights
        tied = weights[:, 1:].sum(axis=1) < 1.0
        weights[tied] = 1.0
        return weights

    return by_blocks(weigh, len(distance))


def typical_distance(positions: Floats) -> float:
    """Return the typical distance between neighboring points of a surface, (n, 3); 0 if unknown.

    The 8 nearest neighbors of a point at distance d fill a disc of pi d^2, so that each takes pi d^2 / 8. Of very many
    points some are measured, chosen at random, each of which takes as much more as they are fewer.
    """
    positions = positions[np.isfinite(positions).all(axis=1)]
    if len(positions) < 9:
        return 0.0
    few = positions
    if len(positions) > _MEASURED:
        few = positions[np.random.default_rng(0).choice(len(positions), _MEASURED, replace=False)]
    sample = few[:: 1 + len(few) // 10_000]
    distance = np.median(cKDTree(few).query(sample, k=9)[0][:, 8])
    return float(distance * np.sqrt(np.pi / 8.0 * len(few) / len(positions)))


def nearest_rows(points: Floats, places: Floats) -> Ints:
    """Return which of the points, (n, 3), is nearest to each of some places, (k, 3)."""
    rows: Ints = cKDTree(points).query(places)[1]
    return rows
