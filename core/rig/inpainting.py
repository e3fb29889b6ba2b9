"""Weights, or any functions, where only some points have them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components, dijkstra

from ..algebra import dissect, factorize, sparsify
from ..arguments import as_doubles, check_array, check_finite, check_switches
from ..errors import PointCloudError
from ..geometry import Prolongation, as_indices, blue_noise_subset, move_apart, nearest_rows
from ..operator import LaplaceBeltrami, followers, narrow_laplacian
from ..progress import ends_at_one
from ..types import Array, Bools, Floats, Ints, Progress
from .touching import apart, outward_normals

_MOST = 10_000  # points that are solved on within two seconds; of more unknown ones, so many of all are


@ends_at_one
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
        Components without a known point, and points that are left out, take the value of the nearest known one. Sheets
        that touch, as a hand and a hip, are filled each on its own.

    Raises
    ------
    InvalidPointsError
        Values of another number than the points, or not finite.
    PointCloudError
        No known point on the surface.

    See Also
    --------
    distance.harmonic_field : Fixed values in any thin sets, at full accuracy.
    smooth_weights : Also fills points without weights.

    Notes
    -----
    Minimises ``f K M^-1 K f``, the square of the Laplacian, with the stiffness K and the areas M, or ``f K f``. Where
    more than 10,000 points are unknown, so many of all points are solved on.

    References
    ----------
    Abdrashitov, Raichstat, Monsen, Hill. Robust skin weights transfer via weight inpainting. SIGGRAPH Asia 2023.

    Examples
    --------
    The height over the unit sphere, known on two caps, is about the same between them:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> z = points[:, 2]
    >>> known = np.abs(z) > 0.4
    >>> found = mf.rig.inpaint(mf.build_laplacian(points), known, z[known])
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
    _check_on_surface(laplacian, known)
    report("Fill", 0.0)
    columns = given.reshape(len(known), -1)
    every = np.full((count, columns.shape[1]), np.nan)
    every[known] = columns
    surface = _surface(laplacian)
    free = np.isnan(every[surface.rows, 0])
    if np.count_nonzero(free) > _MOST:
        surface = _thinned(laplacian, lambda stage, fraction: report("Fill", 0.3 * fraction))
        free = np.isnan(every[surface.rows, 0])
    found = every[surface.rows]
    _fill(surface, free, found, biharmonic, report)
    cold = np.flatnonzero(np.isnan(found[:, 0]))
    found[cold] = columns[_nearest_known(laplacian, known, surface.rows[cold])]
    result = surface.carry(found)
    result[known] = columns
    return result.reshape(count, *given.shape[1:])


def inpaint_labels(laplacian: LaplaceBeltrami, known: ArrayLike, labels: ArrayLike) -> Array:
    """Fill in labels, which cannot be averaged, where they are not known: from the nearest point along the surface.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    known : array_like, (k,) int or (n,) bool
        Points with labels; at least one on the surface.
    labels : array_like, (k,) or (k, m)
        Whole numbers, truth values, or rows of anything that is taken as it is.

    Returns
    -------
    ndarray, (n,) or (n, m)
        Of the type of the labels. Components without a known point, and points that are left out, take the label of the
        nearest known one.

    Raises
    ------
    InvalidPointsError
        Labels of another number than the points.
    PointCloudError
        No known point on the surface.

    See Also
    --------
    inpaint : Numbers.

    Examples
    --------
    Two caps of the unit sphere grow until they meet:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> known = np.abs(points[:, 2]) > 0.8
    >>> found = mf.rig.inpaint_labels(mf.build_laplacian(points), known, points[known, 2] > 0)
    >>> print((found == (points[:, 2] > 0)).mean() > 0.97)
    True
    """
    count = len(laplacian.points)
    known = as_indices(known, count, "known points")
    shapes: list[tuple[int | None, ...]] = [(len(known),), (len(known), None)]
    given = check_array(labels, "Labels", shapes, f"Give one label for each of {len(known)} known points.", "biuf")
    _check_on_surface(laplacian, known)
    surface = _surface(laplacian)
    place = np.full(count, -1)
    place[surface.rows] = np.arange(len(surface.rows))
    held = known[place[known] >= 0]
    first, second = surface.stiffness.nonzero()
    steps = np.linalg.norm(surface.points[first] - surface.points[second], axis=1)
    beside = first != second
    # Coincident points are joined, too: csgraph reads a zero length as no edge.
    lengths = sparse.csr_array(
        (np.maximum(steps, np.finfo(float).tiny)[beside], (first[beside], second[beside])),
        shape=surface.stiffness.shape,
    )
    origin = dijkstra(lengths, indices=place[held], min_only=True, return_predecessors=True)[2]
    owner = np.where(origin >= 0, surface.rows[np.maximum(origin, 0)], -1)
    cold = np.flatnonzero(owner < 0)
    owner[cold] = known[_nearest_known(laplacian, known, surface.rows[cold])]
    every = surface.carry(owner[:, None].astype(float))[:, 0].astype(np.int64)
    row = np.empty(count, dtype=np.int64)
    row[known] = np.arange(len(known))
    every[known] = known
    return given[row[every]]


def _check_on_surface(laplacian: LaplaceBeltrami, known: Ints) -> None:
    if not (laplacian.component[known] >= 0).any():
        raise PointCloudError("No known point lies on the surface. Give values of at least one point that does.")


def _fill(surface: _Surface, free: Bools, found: Floats, biharmonic: bool, report: Progress) -> None:
    """Fill in functions, (m, k), at free points, (m,) bool, of every component that has others."""
    component = connected_components(surface.stiffness, directed=False)[1]
    free = free & (np.bincount(component, ~free) > 0.0)[component]
    if not free.any():
        return
    held = free
    for _ in range(2 if biharmonic else 1):  # neighbors, and their neighbors, are all that the equations hold
        held = held | (surface.stiffness.astype(bool) @ held)
    near = np.flatnonzero(held)
    stiffness, points = surface.stiffness[near][:, near], surface.points[near]
    energy = (
        (stiffness @ sparse.diags_array(1.0 / surface.areas[near]) @ stiffness).tocsr() if biharmonic else stiffness
    )
    open_ = np.flatnonzero(free[near])
    report("Fill", 0.4)
    order, starts = dissect(energy[open_][:, open_], points[open_], lambda: report("Fill", 0.4))
    open_ = open_[order]
    rows = energy[open_]
    solve = factorize(rows[:, open_].tocsr(), starts, lambda share: report("Fill", 0.4 + 0.5 * share))
    # From the nearest known value on, so that a constant stays one to the last digit.
    fixed = np.flatnonzero(~np.isnan(found[:, 0]))
    found[near[open_]] = found[fixed][nearest_rows(surface.points[fixed], points[open_])]
    found[near[open_]] -= solve(np.asarray(rows @ np.nan_to_num(found[near])))


def _nearest_known(laplacian: LaplaceBeltrami, known: Ints, rows: Ints) -> Ints:
    """Return which known point is the nearest to each row: of its own component, where that has any."""
    component, result = laplacian.component, np.empty(len(rows), dtype=np.int64)
    own = np.isin(component[rows], component[known])
    for some, points in ((own, move_apart(laplacian.points, component)), (~own, laplacian.points)):
        if some.any():
            result[some] = nearest_rows(points[known], points[rows[some]])
    return result


@dataclass(frozen=True)
class _Surface:
    """Points of a surface to solve on: all that the operator keeps, or some of many with an operator of their own."""

    rows: Ints  # (m,), which points
    points: Floats  # (m, 3), on the surface [L]
    stiffness: sparse.csr_array  # (m, m), of sheets that touch, each on its own
    areas: Floats  # (m,)
    # From values (m, k) to those of all points, (n, k); points that are left out have those of the nearest one
    carry: Callable[[Floats], Floats]


def _surface(laplacian: LaplaceBeltrami) -> _Surface:
    """Take all points that the operator keeps."""
    kept = np.flatnonzero(laplacian.component >= 0)
    stiffness, _ = apart(
        sparsify(laplacian.stiffness[kept][:, kept]), outward_normals(laplacian)[kept], laplacian.trust[kept]
    )
    return _Surface(
        kept,
        laplacian.surface_points[kept],
        stiffness,
        laplacian.areas[kept],
        lambda values: _completed(laplacian, kept, values),
    )


def _thinned(laplacian: LaplaceBeltrami, report: Progress) -> _Surface:
    """Choose some of many points, from which values are carried to all."""
    kept = np.flatnonzero(laplacian.component >= 0)
    points = laplacian.surface_points[kept]
    report("Points", 0.0)
    some = kept[blue_noise_subset(points, _MOST)]
    few = narrow_laplacian(laplacian, rows=some, progress=lambda stage, share: report("Points", share))
    on = few.component >= 0
    rows, surface = some[on], few.surface_points[on]
    normals = outward_normals(few)[on]
    every = Prolongation(points, np.searchsorted(kept, rows), normals, laplacian.component[rows])

    def carry(values: Floats) -> Floats:
        """Interpolate without leaving the range of the values."""
        low, high = values.min(axis=0), values.max(axis=0)
        return _completed(laplacian, kept, np.clip(every.interpolate(values), low, high))

    stiffness, _ = apart(few.stiffness[on][:, on], normals, few.trust[on])
    return _Surface(rows, surface, stiffness, few.areas[on], carry)


def _completed(laplacian: LaplaceBeltrami, kept: Ints, values: Floats) -> Floats:
    """Give points that the operator leaves out the values, (m, k), of the nearest one that is kept."""
    lone, leader = followers(laplacian.points, laplacian.component)
    result = np.empty((len(laplacian.points), *values.shape[1:]))
    result[kept] = values
    result[lone] = result[leader]
    return result
