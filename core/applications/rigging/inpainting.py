"""Weights, or any functions, where only some points have them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ...algebra import dissect, factorize, sparsify
from ...arguments import as_doubles, check_array, check_finite, check_switches
from ...errors import PointCloudError
from ...geometry import Prolongation, as_indices, blue_noise_subset, nearest_rows
from ...operator import LaplaceBeltrami, narrow_laplacian
from ...types import Floats, Ints, Progress
from ..graph import followers

_MOST = 10_000  # points, which are solved on within two seconds; of more, so many are


def inpaint(
    laplacian: LaplaceBeltrami,
    known: ArrayLike,
    values: ArrayLike,
    *,
    biharmonic: bool = True,
    progress: Progress | None = None,
) -> Floats:
    """Fill in functions where they are not known, as smoothly as those that are let them.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    known : array_like, (k,) int or (n,) bool
        Points with values; at least one.
    values : array_like, (k,) or (k, m)
        Their values, in the order of the indices: weights, colors, any numbers.
    biharmonic : bool
        Slopes go on as well, so that values may leave the range of the known ones; without, they stay within.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n,) or (n, m)
        Known points keep their values exactly. What is the same constant there is so everywhere, as the sum of weights.
        Components without a known point, and points that are left out, take the value of the nearest known one.

    Raises
    ------
    InvalidPointsError
        Values of another number than the points, or not finite.
    PointCloudError
        No known point on the surface.

    See Also
    --------
    harmonic_field : Fixed values in any thin sets, at full accuracy.
    smooth_weights : Also fills points without weights.

    Notes
    -----
    Minimises ``f K M^-1 K f``, the square of the Laplacian, with the stiffness K and the areas M, or ``f K f``.

    References
    ----------
    Abdrashitov, Raichstat, Monsen, Hill. Robust skin weights transfer via weight inpainting. SIGGRAPH Asia 2023.

    Examples
    --------
    The height over the unit sphere, known on two caps, is about the same between them:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> z = points[:, 2]
    >>> known = np.abs(z) > 0.4
    >>> found = core.inpaint(core.build_laplacian(points), known, z[known])
    >>> print(np.abs(found - z).max() < 0.02, np.array_equal(found[known], z[known]))
    True True
    """
    count = len(laplacian.points)
    report = progress or (lambda stage, fraction: None)
    known = as_indices(known, count, "known points")
    shapes: list[tuple[int | None, ...]] = [(len(known),), (len(known), None)]
    given = check_array(values, "Known values", shapes, f"Give one row for each of {len(known)} known points.")
    given = as_doubles(given)
    check_finite(given, "known values", "Replace them, or leave their points out.")
    check_switches(biharmonic=biharmonic)
    if not (laplacian.component[known] >= 0).any():
        raise PointCloudError("No known point lies on the surface. Give values of at least one point that does.")
    few = _solved(laplacian, lambda stage, fraction: report("Fill", 0.3 * fraction))
    columns = given.reshape(len(known), -1)
    every = np.full((count, columns.shape[1]), np.nan)
    every[known] = columns
    found = every[few.rows]
    energy = few.stiffness
    if biharmonic:
        energy = (energy @ sparse.diags_array(1.0 / few.areas) @ energy).tocsr()
    component = connected_components(few.stiffness, directed=False)[1]
    fixed = ~np.isnan(found[:, 0])
    led = np.bincount(component, fixed)[component] > 0.0
    free, held = np.flatnonzero(led & ~fixed), np.flatnonzero(fixed)
    if len(free):
        report("Fill", 0.4)
        order, starts = dissect(energy[free][:, free], few.points[free], lambda: report("Fill", 0.4))
        free = free[order]
        rows = energy[free]
        solve = factorize(rows[:, free].tocsr(), starts, lambda share: report("Fill", 0.4 + 0.5 * share))
        # From the nearest known value on, so that a constant stays one to the last digit.
        found[free] = found[held][nearest_rows(few.points[held], few.points[free])]
        found[free] -= solve(np.asarray(rows @ np.nan_to_num(found)))
    cold = np.flatnonzero(~led)
    if len(cold):
        found[cold] = columns[nearest_rows(laplacian.points[known], few.points[cold])]
    result = few.carry(found)
    result[known] = columns
    return result.reshape(count, *given.shape[1:])


@dataclass(frozen=True)
class _Solved:
    """Some of the points of a surface, with an operator of their own whose factors are small.

    Attributes
    ----------
    rows : ndarray, (m,) int
        Which points.
    points : ndarray, (m, 3)
        On the surface [L].
    stiffness : csr_array, (m, m)
    areas : ndarray, (m,)
    carry : callable
        From values (m, k) to those of all points, (n, k); points that are left out have those of the nearest one.
    """

    rows: Ints
    points: Floats
    stiffness: sparse.csr_array
    areas: Floats
    carry: Callable[[Floats], Floats]


def _solved(laplacian: LaplaceBeltrami, report: Progress) -> _Solved:
    """Choose the points to solve on: all, or some of many, from which values are carried to all."""
    kept = np.flatnonzero(laplacian.component >= 0)
    points = laplacian.surface_points[kept]
    lone, leader = followers(laplacian.points, laplacian.component)

    def complete(values: Floats) -> Floats:
        result = np.empty((len(laplacian.points), *values.shape[1:]))
        result[kept] = values
        result[lone] = result[leader]
        return result

    if len(kept) <= _MOST:
        stiffness = sparsify(laplacian.stiffness[kept][:, kept])
        return _Solved(kept, points, stiffness, laplacian.areas[kept], complete)
    report("Points", 0.0)
    some = kept[blue_noise_subset(points, _MOST)]
    few = narrow_laplacian(laplacian, rows=some, progress=lambda stage, share: report("Points", share))
    on = few.component >= 0
    rows, surface = some[on], few.surface_points[on]
    every = Prolongation(points, np.searchsorted(kept, rows), few.normals[on], laplacian.component[rows])

    def carry(values: Floats) -> Floats:
        """Interpolate without leaving the range of the values."""
        low, high = values.min(axis=0), values.max(axis=0)
        return complete(np.clip(every.interpolate(values), low, high))

    return _Solved(rows, surface, few.stiffness[on][:, on], few.areas[on], carry)
