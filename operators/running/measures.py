"""What the operator tells of each point of an object: built on all of them, or on a subset and carried to all."""

from typing import NamedTuple

import numpy as np

from ... import core
from . import cache

_ALL = np.arange(0)  # stands for all points
_STEPS = (1, 2, 5)  # times a power of ten: sizes of subsets, so that a little more free memory makes no difference


class Measures(NamedTuple):
    """Values at each point, as of `LaplaceBeltrami`."""

    areas: np.ndarray
    normals: np.ndarray
    mean_curvature: np.ndarray
    gaussian_curvature: np.ndarray
    boundary: np.ndarray
    component: np.ndarray
    trust: np.ndarray


class Measured(NamedTuple):
    """The operator of an object's points, or of a subset of them.

    Attributes
    ----------
    laplacian : LaplaceBeltrami
    subset : ndarray, (k,) int
        Rows of the points that it is built on; none for all.
    measures : Measures
        Of all points.
    prolongation : Prolongation or None
        From the subset to all.
    left_out : ndarray, (m,) int
        Splats that take no part.
    """

    laplacian: "core.LaplaceBeltrami"
    subset: np.ndarray
    measures: Measures
    prolongation: "core.Prolongation | None"
    left_out: np.ndarray

    def carried(self, vectors):
        """Return functions on the points of the operator, (k, m), as such on all points, (n, m)."""
        return vectors if self.prolongation is None else self.prolongation.interpolate(vectors)

    @property
    def notices(self) -> list:
        """What a user should know of the operator, and of how many points it was built on."""
        if self.prolongation is None:
            return self.laplacian.notices
        told = (
            f"Analyzed {len(self.subset):,} of {len(self.prolongation.nearest):,} points, evenly spread over the"
            " surface, and carried the results to all. The setting Point Budget decides how many."
        )
        return [told, *cache.floating_notices(self.left_out), *self.laplacian.notices]


def measure(points, options, boundary, budget, modes, progress, orientation=None, splats=None) -> Measured:
    """Measure the surface at each point.

    Parameters
    ----------
    points, options, boundary, progress, orientation, splats
        See `cache.build`.
    budget : int or None
        How many points to build the operator on at most; 0 for as many as fit the memory, None for all.
    modes : int
        How many modes will be computed.
    """
    out = cache.floating(splats)
    subset = _subset(points, options, boundary, splats, budget, modes, progress)
    if not len(subset):
        laplacian, curvature = cache.build(points, options, boundary, progress, orientation, splats)
        return Measured(laplacian, subset, _measures(laplacian, curvature), None, out)
    chosen = points[subset]
    at_boundary, sides = (None if given is None else given[subset] for given in (boundary, orientation))
    laplacian, curvature = cache.build(chosen, options, at_boundary, progress, sides)

    def prolong():
        report = _within(progress, "All Points")
        return core.Prolongation(points, subset, laplacian.normals, laplacian.component, progress=report)

    progress("All Points", 0.9)
    prolongation = cache.result(laplacian, "prolongation", points, compute=prolong)
    carried = _carry(prolongation, _measures(laplacian, curvature), out)
    return Measured(laplacian, subset, carried, prolongation, out)


def _within(progress, stage):
    """Return a callback without arguments that may end a stage."""
    return lambda: progress(stage, 0.9)


def _measures(laplacian, curvature):
    return Measures(
        laplacian.areas,
        laplacian.normals,
        curvature,
        laplacian.gaussian_curvature,
        laplacian.boundary,
        laplacian.component,
        laplacian.trust,
    )


def _carry(prolongation, known, out):
    """Carry what is known of a subset to all points but those that take no part."""
    smooth = np.column_stack([known.normals, known.mean_curvature, known.gaussian_curvature, known.trust])
    smooth = prolongation.interpolate(smooth)
    normals = smooth[:, :3]
    length = np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, None]
    component, trust = prolongation.labels(known.component), np.clip(smooth[:, 5], 0.0, 1.0)
    component[out], trust[out] = -1, 0.0
    return Measures(
        areas=prolongation.shares(known.areas, out),
        normals=np.divide(normals, length, out=prolongation.labels(known.normals), where=length > 0.5),
        mean_curvature=smooth[:, 3],
        gaussian_curvature=smooth[:, 4],
        boundary=prolongation.labels(known.boundary),
        component=component,
        trust=trust,
    )


def _subset(points, options, boundary, splats, budget, modes, progress):
    """Return the rows of the points to build the operator on; none for all. The same ones as long as they are kept."""
    count = len(points)
    if budget is None or 0 < count <= budget or (not budget and cache.holds(points, options, boundary, splats)):
        return _ALL

    def choose():
        most = budget or _automatic(count, options, modes)
        if most >= count:
            return _ALL
        progress("Subset", 0.0)
        kept = np.delete(np.arange(count), cache.floating(splats))
        return kept[core.blue_noise_subset(points[kept], most, progress=_within(progress, "Subset"))]

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
