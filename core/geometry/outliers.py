"""Outliers: points that do not lie on the surface of their neighbors."""

import numpy as np

from ..algebra import blocks, by_blocks, on_all_cores
from ..types import Bools, Floats, Ints
from .nearest import AGREEING, GAP, ON, Nearest
from .noise import FILLING
from .quadrics import Quadrics, fit_quadrics, heights_over

# Neighbors asked: near ones, and some further away, where the density may be another.
_WITNESSES = np.array([1, 2, 3, 5, 7, 9, 12, 16, 20, 24, 30, 36])
SCATTERS = 3.0  # standard deviations of the witness' own neighbors that are added to the height at which a point is off
_BLOCK = 1 << 13  # points looked at at one time


def find_outliers(nearest: Nearest, usual: float | None = None) -> Bools:
    """Find points that lie off the surfaces of nearly all of their neighbors, (m,) bool.

    Twelve neighbors are the witnesses of a point. Each of them describes the surface by a quadric through its own
    neighbors, without those that turn out to lie off it. The point is on the surface where three of these pass nearer
    than a share of its spacing and the scatter of the witness' own neighbors. (The spacing of a point far off is half
    its distance from the surface, so that the rule holds at any height.) Outliers are no witnesses; nor are, for sparse
    points, those whose neighbors fill a volume. `usual` is the spacing around most points; the median of these if not
    given.
    """
    usual = float(np.median(nearest.spacing)) if usual is None else usual
    surface, result = nearest.quadrics, np.zeros(len(nearest.points), dtype=bool)
    alone, height = Alone(nearest, surface), third_heights(nearest, surface, np.arange(len(result)))
    # The first search finds most outliers, each further one those that they had hidden.
    while (new := _off_surface(nearest, surface, alone, height, result, usual) & ~result).any():
        result |= new
        # The quadrics around them go on without them.
        changed = new[nearest.index].any(axis=1)
        rows = np.flatnonzero(changed)
        nearest = nearest.keep(~result[nearest.index])
        surface = surface.put(rows, fit_quadrics(nearest.points, nearest.index[rows], nearest.weight[rows], rows))
        alone.forget(rows)
        over = np.flatnonzero(changed[nearest.index].any(axis=1))
        height[over] = third_heights(nearest, surface, over)
    return result


class Alone:
    """The quadrics of points without the neighbors off them, fitted where they are asked for, and kept."""

    def __init__(self, nearest: Nearest, surface: Quadrics) -> None:
        count = len(nearest.points)
        self.surface, self.scatter, self._known = surface, np.zeros(count), np.zeros(count, dtype=bool)

    def forget(self, rows: Ints) -> None:
        """Fit those of some points, whose neighbors are others now, anew when they are asked for."""
        self._known[rows] = False

    def fit(self, nearest: Nearest, surface: Quadrics, rows: Ints) -> None:
        """Fit those of some points, (k,) int, that are not known, from quadrics through all their neighbors."""
        rows = rows[~self._known[rows]]
        fitted, self.scatter[rows] = _let_go(nearest, surface, rows)
        self.surface = self.surface.put(rows, fitted)
        self._known[rows] = True


def _off_surface(
    nearest: Nearest, surface: Quadrics, alone: Alone, height: Floats, known: Bools, usual: float
) -> Bools:
    """Tell which points lie off the surface, by `third_heights`, those that are known to among them, (m,) bool."""
    spacing, result = nearest.spacing, known.copy()
    sparse = spacing > GAP * usual  # their witnesses must show a surface that thin
    suspects = np.flatnonzero(~known & ((height > ON * spacing) | (sparse & (surface.misfit > ON * spacing))))
    if not len(suspects):
        return result
    witnesses = witnesses_of(nearest, suspects)
    alone.fit(nearest, surface, np.unique(witnesses))
    scatter = alone.scatter[witnesses]
    height = heights_over_witnesses(nearest, alone.surface, suspects)
    height /= ON * spacing[suspects, None] + SCATTERS * scatter
    height[sparse[suspects, None] & (scatter > FILLING * spacing[witnesses])] = np.inf
    found = -1
    while np.count_nonzero(result) > found:
        found = int(np.count_nonzero(result))
        result[suspects] = third_least(np.where(result[witnesses], np.inf, height)) > 1.0
    return result


def witnesses_of(nearest: Nearest, rows: Ints) -> Ints:
    """Return the witnesses of some points, (k, 12) int."""
    return nearest.index[rows[:, None], np.minimum(_WITNESSES, nearest.index.shape[1] - 1)]


def third_least(values: Floats) -> Floats:
    """Return the third least of each row."""
    return np.partition(values, AGREEING - 1, axis=1)[:, AGREEING - 1]


def third_heights(nearest: Nearest, surface: Quadrics, rows: Ints) -> Floats:
    """Return the third least height of some points over the quadrics of their witnesses, (k,)."""
    heights = heights_over_witnesses(nearest, surface, rows)
    return by_blocks(lambda part: third_least(heights[part]), len(rows))


def heights_over_witnesses(nearest: Nearest, surface: Quadrics, rows: Ints) -> Floats:
    """Return how far some points are off the quadrics of their witnesses, (k, 12)."""
    result = np.empty((len(rows), len(_WITNESSES)))

    def measure(part: slice) -> None:
        block = rows[part]
        witnesses = witnesses_of(nearest, block)
        result[part] = np.abs(heights_over(surface, nearest.points, witnesses, block[:, None]))

    on_all_cores(measure, blocks(len(rows), _BLOCK))
    return result


def _let_go(nearest: Nearest, surface: Quadrics, rows: Ints) -> tuple[Quadrics, Floats]:
    """Fit the quadrics of some points, (k,) int, again without the neighbors off them, and measure how these scatter.

    The scatter, (k,), is the standard deviation of normal values with the same median.
    """
    points, spacing = nearest.points, nearest.spacing
    weight = np.empty((len(rows), nearest.index.shape[1]))

    def weigh(part: slice) -> None:
        block = rows[part]
        height, scatter = _scatter(surface, points, block, nearest.index[block])
        far = height / np.maximum(SCATTERS * scatter, ON * spacing[block])[:, None]
        weight[part] = nearest.weight[block] * np.maximum(1.0 - far**2, 1e-3) ** 2

    parts = blocks(len(rows), _BLOCK)
    on_all_cores(weigh, parts)
    index, result = nearest.index[rows], np.empty(len(rows))
    fitted = fit_quadrics(points, index, weight, rows)
    surface = surface.put(rows, fitted)

    def measure(part: slice) -> None:
        result[part] = _scatter(surface, points, rows[part], index[part])[1]

    on_all_cores(measure, parts)
    return fitted, result


def _scatter(surface: Quadrics, points: Floats, rows: Ints, index: Ints) -> tuple[Floats, Floats]:
    height = np.abs(heights_over(surface, points, rows[:, None], index))
    return height, np.median(height, axis=1) / 0.6745
