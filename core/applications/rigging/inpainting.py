"""Weights, or any functions, where only some points have them, and smoother ones along the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ...algebra import dissect, factorize, sparsify
from ...arguments import as_doubles, check_array, check_finite, check_switches, not_negative
from ...errors import InvalidPointsError, PointCloudError
from ...geometry import Prolongation, as_indices, as_mask, blue_noise_subset, nearest_rows
from ...operator import LaplaceBeltrami, narrow_laplacian
from ...types import Floats, Ints, Progress
from ..graph import followers
from ..motion.motion import Heat

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


def smooth_weights(
    laplacian: LaplaceBeltrami,
    weights: ArrayLike,
    length: float,
    *,
    locked: ArrayLike | None = None,
    progress: Progress | None = None,
) -> Floats:
    """Smooth weights along the surface.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    weights : array_like, (n, b)
        Not negative. Points whose weights are all zero are filled from those around first.
    length : float
        How far weights are spread [L]; zero fills only.
    locked : array_like, (b,) bool or (k,) int, optional
        Columns that stay as they are.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n, b)
        Not negative. Where rows summed to one, they do. With locked columns the others share what these leave.

    Raises
    ------
    InvalidPointsError
        Weights of another shape, negative, not finite, or all zero.
    PointCloudError
        A length that is negative.

    See Also
    --------
    bone_weights : Weights from an armature.

    Notes
    -----
    The flow of heat for the time ``length^2 / 4``, within which nothing leaves its range, or flows across gaps between
    sheets.

    Examples
    --------
    A sharp edge of a weight becomes soft:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> hard = np.column_stack([points[:, 2] > 0, points[:, 2] <= 0]).astype(float)
    >>> soft = core.smooth_weights(core.build_laplacian(points), hard, 0.5)
    >>> print(soft[[0, 400], 0].round(1), np.allclose(soft.sum(axis=1), 1))
    [1.  0.5] True
    """
    count = len(laplacian.points)
    given = as_doubles(
        check_array(weights, "Weights", [(count, None)], f"Give one row for each of {count} points.", "biuf")
    )
    check_finite(given, "weights", "Replace them.")
    negative = np.count_nonzero((given < 0.0).any(axis=1))
    total = given.sum(axis=1)
    if negative or not total.any():
        wrong = f"{negative} points have negative weights" if negative else "All weights are zero"
        raise InvalidPointsError(f"{wrong}. Give weights from 0 on, and some above it.")
    reach = not_negative(length, "length")
    held = as_mask(() if locked is None else locked, given.shape[1])
    result = given
    empty = total == 0.0
    if empty.any():
        filled = np.flatnonzero(~empty)
        result = inpaint(laplacian, filled, given[filled], biharmonic=False, progress=progress)
        total = result.sum(axis=1)
    if reach > 0.0 and not held.all():
        result = Heat(laplacian, 0.25 * reach**2, progress=progress).advance(result, progress=progress)
    if not held.any():
        return result
    # The others share what the locked ones leave.
    kept, moving = given[:, held].sum(axis=1), result[:, ~held].sum(axis=1)
    scale = np.maximum(total - kept, 0.0) / np.where(moving > 0.0, moving, 1.0)
    return np.where(held, given, result * scale[:, None])


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
