"""Quantities at each point of an object, by an operator on all of them, or on a subset and transferred to all."""

from typing import NamedTuple

import numpy as np

from ... import core
from ...command.analysis import Built, floating_notices
from ...tools.quantities import rows_of
from . import cache

_ROWS = rows_of("analyze")
_ALL = np.arange(0)  # stands for all points
_STEPS = (1, 2, 5)  # times a power of ten: sizes of subsets, so that a little more free memory makes no difference


class Measured(NamedTuple):
    """The operator of an object's points, or of a subset of them."""

    built: Built
    subset: np.ndarray  # (k,) int, rows of the points that it is built on; none for all
    measures: dict  # values at all points, in lengths and axes of the world, by the names of attributes
    prolongation: "core.clean.Prolongation | None"  # from the subset to all
    left_out: np.ndarray  # (m,) int, splats that are left out

    def carried(self, vectors):
        """Transfer functions from the points of the operator, (k, m), to all points, (n, m)."""
        return vectors if self.prolongation is None else self.prolongation.interpolate(vectors)

    @property
    def notices(self) -> list:
        """Notices about the operator, and about the number of points that it was built on."""
        if self.prolongation is None:
            return self.built.notices
        notice = (
            f"Analyzed {len(self.subset):,} of {len(self.prolongation.nearest):,} points, evenly spread over the"
            " surface, and transferred the results to all. The setting Point Budget decides how many."
        )
        return [notice, *floating_notices(self.left_out), *self.built.notices]


def measure(points, options, boundary, budget, modes, progress, orientation=None, splats=None) -> Measured:
    """Measure the surface at each point; see `cache.build` for most arguments.

    The operator is built on as many points as the budget says at most; on as many as fit the memory for 0, on all for
    None. `modes` is how many will be computed.
    """
    out = cache.floating(splats)
    subset = _subset(points, options, boundary, splats, budget, modes, progress)
    if not len(subset):
        built = cache.build(points, options, boundary, progress, orientation, splats)
        return Measured(built, subset, built.measures, None, out)
    chosen = points[subset]
    at_boundary, sides = (None if given is None else given[subset] for given in (boundary, orientation))
    built = cache.build(chosen, options, at_boundary, progress, sides)
    laplacian = built.laplacian

    def prolong():
        report = _within(progress, "All Points")
        return core.clean.Prolongation(points, subset, laplacian.normals, laplacian.component, progress=report)

    progress("All Points", 0.9)
    prolongation = laplacian.kept.result("prolongation", prolong, points)
    carried = {row.attribute: _carry(prolongation, row, row.of(built), out) for row in _ROWS}
    return Measured(built, subset, carried, prolongation, out)


def _within(progress, stage):
    """Return a callback without arguments, which may cancel."""
    return lambda: progress(stage, 0.9)


def _carry(prolongation, row, values, out):
    """Transfer values of a quantity to all points, some of which are left out."""
    if row.carried == "share":
        return prolongation.shares(values, out)
    carried = carry(prolongation, row.carried, values)
    if row.bounds is not None:
        carried = np.clip(carried, *row.bounds)
    if row.left_out is not None:
        carried[out] = row.left_out
    return carried


def carry(prolongation, kind, values):
    """Transfer values to all points of a `Prolongation`, by a value of `Quantity.carried` other than "share"."""
    if kind == "label":
        return prolongation.labels(values)
    smooth = prolongation.interpolate(values)
    if kind == "smooth":
        return smooth
    length = np.sqrt(np.einsum("ij,ij->i", smooth, smooth))[:, None]
    return np.divide(smooth, length, out=prolongation.labels(values), where=length > 0.5)


def _subset(points, options, boundary, splats, budget, modes, progress):
    """Return the rows of the points to build the operator on, an empty array for all; kept ones again."""
    count = len(points)
    if budget is None or 0 < count <= budget or (not budget and cache.holds(points, options, boundary, splats)):
        return _ALL

    def choose():
        most = budget or _automatic(count, options, modes)
        if most >= count:
            return _ALL
        progress("Subset", 0.0)
        kept = np.delete(np.arange(count), cache.floating(splats))
        return kept[core.clean.blue_noise_subset(points[kept], most, progress=_within(progress, "Subset"))]

    return cache.fetch(cache.content(points, options, boundary, cache.floating(splats), "subset", budget), choose)


def _automatic(count, options, modes):
    """Return how many points to build the operator on: all that fit, else a round number that leaves half the memory.

    The other half is for the results at all points, and for what else is open.
    """
    most = cache.fitting(count, options, modes)
    if most is None or most >= count:
        return count
    half = max(most // 2, 1)
    unit = 10 ** (len(str(half)) - 1)
    return unit * max(step for step in _STEPS if step * unit <= half)
