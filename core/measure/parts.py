"""A table of measures: points, area and boundary of every part of the surface, each with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import check_array
from ..errors import InvalidPointsError
from ..frozen import Frozen
from ..operator import LaplaceBeltrami
from ..progress import ends_at_one
from ..types import Bools, Floats, Ints, Progress
from .regions import LENGTH_OFF, measure_region, measures_of


@dataclass(frozen=True)
class Parts(Frozen):
    """Measures of the parts of a surface, by the labels of their points in ascending order.

    Attributes
    ----------
    labels : ndarray, (p,) int
    points : ndarray, (p,) int
        How many each part has, without those that the operator left out.
    areas, area_uncertainties : ndarray, (p,)
        The true area is expected within the uncertainty [L^2].
    boundary_lengths, length_uncertainties : ndarray, (p,)
        Of the line between a part and the others, and of the surface's own boundary next to it [L].
    """

    labels: Ints
    points: Ints
    areas: Floats
    area_uncertainties: Floats
    boundary_lengths: Floats
    length_uncertainties: Floats


@ends_at_one
def measure_parts(
    laplacian: LaplaceBeltrami, labels: ArrayLike | None = None, *, progress: Progress | None = None
) -> Parts:
    """Measure the area of all parts of the surface, and the lengths of their boundaries.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    labels : array_like, (n,) int, optional
        The part of each point, such as those of `spectral.segment`; below zero for none. Without them the parts are the
        components.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    Parts
        Points left out of the operator do not count.

    Raises
    ------
    InvalidPointsError
        Labels of another kind, or no point of the surface in any part.

    See Also
    --------
    measure_region : The same of one part.
    part_means : Mean of a quantity over every part.
    enclosed_volume : The volume within every component.

    Notes
    -----
    The area of whole components is the sum of their area elements; of other parts it is that of `measure_region`. Its
    uncertainty adds up what the missed moments of the kernel leave, by the trust in each point, what noise that was
    smoothed leaves, by its height and the curvature, and in which strip the boundary of the surface is: where rows of
    points run along it, such as pixels, up to where the next row would be. The line between parts counts as of
    `measure_region`, by its square. The weights were fitted to random points on spheres,
    tori, discs, cylinders and boxes with noise of up to 0.3 spacings.

    Examples
    --------
    Both halves of the unit sphere have the area 2 pi:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> found = mf.measure.measure_parts(mf.build_laplacian(points), (points[:, 2] > 0).astype(int))
    >>> print((found.areas / np.pi).round(1), found.points)
    [2. 2.] [400 400]
    """
    report = progress or (lambda stage, fraction: None)
    parts = _Labelled(laplacian, labels)
    whole = measures_of(laplacian)
    areas, lengths = parts.sums(whole.areas), parts.sums(whole.boundary_lengths)
    doubt = parts.sums(whole.area_doubts) + np.abs(parts.sums(whole.boundary_doubts))
    doubt_of_lengths = LENGTH_OFF[1] * np.abs(lengths)
    divided = np.flatnonzero(parts.divided())
    for done, part in enumerate(divided):
        report("Parts", done / len(divided))
        region = measure_region(laplacian, parts.members(part))
        areas[part], lengths[part] = region.area, region.boundary_length
        doubt[part] = region.area_uncertainty
        doubt_of_lengths[part] = region.length_uncertainty
    return Parts(parts.labels, parts.counts(), areas, doubt, np.maximum(lengths, 0.0), doubt_of_lengths)


def part_means(laplacian: LaplaceBeltrami, values: ArrayLike, labels: ArrayLike | None = None) -> tuple[Floats, Floats]:
    """Return the mean of a quantity by area over all parts of the surface, and its root mean square.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    values : array_like, (n,)
        Points without a number, NaN or infinite, do not count.
    labels : array_like, (n,) int, optional
        As of `measure_parts`.

    Returns
    -------
    means, root_mean_squares : ndarray, (p,)
        In the units of the values; NaN for parts without any.

    Raises
    ------
    InvalidPointsError
        Labels or values of another kind, or no point of the surface in any part.

    See Also
    --------
    measure_parts : Areas and boundaries of the same parts.

    Examples
    --------
    The squared height over the unit sphere is 1 / 3 on average:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> print(mf.measure.part_means(mf.build_laplacian(points), points[:, 2] ** 2)[0].round(2))
    [0.33]
    """
    count = len(laplacian.points)
    given = check_array(values, "Values", [(count,)], f"Give a number for each of {count} points.", "iufb")
    parts = _Labelled(laplacian, labels)
    known = np.isfinite(given)
    numbers, weight = np.where(known, given, 0.0).astype(np.float64), np.where(known, laplacian.areas, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        total = parts.sums(weight)
        return parts.sums(weight * numbers) / total, np.sqrt(parts.sums(weight * numbers**2) / total)


class _Labelled:
    """The parts of a surface by their labels, (p,), in ascending order."""

    def __init__(self, laplacian: LaplaceBeltrami, labels: ArrayLike | None) -> None:
        component = laplacian.component
        given = component if labels is None else _checked(labels, len(component))
        self._known = (component >= 0) & (given >= 0)
        if not self._known.any():
            raise InvalidPointsError(
                f"None of the {len(component)} points of the surface is in a part, so there is nothing to measure."
                " Label some by whole numbers from zero."
            )
        self.labels, self._part = np.unique(given[self._known], return_inverse=True)
        self._component, self._sizes = component, np.bincount(component[component >= 0])

    def sums(self, values: Floats) -> Floats:
        """Add up values of points, (n,), over parts, (p,)."""
        return np.bincount(self._part, values[self._known], len(self.labels)).astype(np.float64)

    def counts(self) -> Ints:
        """Return the number of points of parts, (p,)."""
        return np.bincount(self._part, minlength=len(self.labels))

    def members(self, part: int) -> Bools:
        """Return which points are in a part, (n,)."""
        result = np.zeros(len(self._known), dtype=bool)
        result[np.flatnonzero(self._known)[self._part == part]] = True
        return result

    def divided(self) -> Bools:
        """Return which parts hold some, but not all, points of a component, (p,)."""
        pairs, counts = np.unique(np.stack([self._part, self._component[self._known]]), axis=1, return_counts=True)
        result = np.zeros(len(self.labels), dtype=bool)
        result[pairs[0, counts < self._sizes[pairs[1]]]] = True
        return result


def _checked(labels: ArrayLike, count: int) -> Ints:
    """Return the labels of points."""
    return check_array(labels, "Labels", [(count,)], f"Give a whole number for each of {count} points.", "iu")
