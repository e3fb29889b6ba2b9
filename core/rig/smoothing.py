"""Smoother weights: heat that flows along the surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..arguments import as_doubles, check_array, check_finite, check_switches, not_negative, whole
from ..errors import InvalidPointsError, PointCloudError
from ..geometry import as_mask
from ..motion import Heat
from ..operator import LaplaceBeltrami
from ..progress import ends_at_one
from ..types import Bools, Floats, Progress
from .bone_weights import strongest
from .inpainting import inpaint
from .touching import apart, outward_normals, without

_ACCURACY = 1e-6  # of weights
_HELD = 1e12  # times as much heat as others hold points whose weights stay


@ends_at_one
def smooth_weights(
    laplacian: LaplaceBeltrami,
    weights: ArrayLike,
    length: float,
    *,
    columns: ArrayLike | None = None,
    locked: ArrayLike | None = None,
    chosen: ArrayLike | None = None,
    edges: ArrayLike | None = None,
    fill: bool = True,
    influences: int | None = None,
    least: float = 0.0,
    progress: Progress | None = None,
) -> Floats:
    """Smooth weights along the surface, fill in those that are missing, and leave out small ones.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    weights : array_like, (n, b)
        Not negative.
    length : float
        How far weights are spread [L]; zero spreads none.
    columns : array_like, (b,) bool or (k,) int, optional
        Columns that are smoothed, all by default. The others share what these and the locked ones leave.
    locked : array_like, (b,) bool or (k,) int, optional
        Columns that stay as they are.
    chosen : array_like, (n,) bool or (k,) int, optional
        Points whose weights change, all by default. Those of the others flow in, and stay.
    edges : array_like, (m, 2) int, optional
        Of a mesh: nothing flows between its loose parts, even where they touch. Points of no edge belong to all parts.
    fill : bool
        Fill points whose weights are all zero from those around first.
    influences : int, optional
        Most weights of a point above zero, locked ones included; all by default. Locked ones, and one other, stay.
    least : float
        Smaller weights become zero; the largest of a point stays.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n, b)
        Not negative. Where rows summed to one, they do; with locked columns, or only some smoothed, all have the sums
        that they had.

    Raises
    ------
    InvalidPointsError
        Weights of another shape, negative, not finite, or all zero; edges between other points.
    PointCloudError
        A length or a least weight that is negative, influences below one.

    See Also
    --------
    bone_weights : Weights from an armature.
    inpaint : Fills in, and lets slopes go on.

    Notes
    -----
    The flow of heat for the time ``length^2 / 4``, within which nothing leaves its range. It does not cross gaps
    between sheets, also of those that touch. Points that are not chosen hold endless heat, so that they keep theirs
    whatever flows.

    Examples
    --------
    A sharp edge of a weight becomes soft:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> hard = np.column_stack([points[:, 2] > 0, points[:, 2] <= 0]).astype(float)
    >>> soft = mf.rig.smooth_weights(mf.build_laplacian(points), hard, 0.5)
    >>> print(soft[[0, 400], 0].round(1), np.allclose(soft.sum(axis=1), 1))
    [1.  0.5] True
    """
    count = len(laplacian.points)
    given = _check_weights(weights, count)
    width = given.shape[1]
    check_switches(fill=fill)
    reach, least = not_negative(length, "length"), not_negative(least, "least weight")
    most = width if influences is None else whole(influences)
    if not most >= 1:
        raise PointCloudError(f"Points keep {influences} weights. Keep at least one.")
    most = int(min(most, width))
    held = as_mask(() if locked is None else locked, width)
    smoothed = (as_mask(columns, width) if columns is not None else np.ones(width, dtype=bool)) & ~held
    some = as_mask(chosen, count) if chosen is not None else np.ones(count, dtype=bool)
    separate = _separated(laplacian, edges)
    result = given
    empty = ~given.any(axis=1)
    if fill and empty.any():
        filled = np.flatnonzero(~empty)
        result = inpaint(separate, filled, given[filled], biharmonic=False, progress=progress)
    total = result.sum(axis=1)
    if reach > 0.0 and smoothed.any():
        holding = replace(separate, areas=np.where(some, separate.areas, _HELD * separate.areas))
        flow = Heat(holding, 0.25 * reach**2, accuracy=_ACCURACY, progress=progress)
        result = result.copy()
        moved = flow.advance(result[:, smoothed], progress=progress)
        left = moved.sum(axis=1)
        sums = flow.advance(result[:, smoothed].sum(axis=1))  # each function is right to the accuracy only
        result[:, smoothed] = moved * (sums / np.where(left > 0.0, left, 1.0))[:, None]
    if not smoothed.all():
        result = _shared(np.where(held, given, result), total, smoothed, held)
    loose = ~held
    if most < width or least > 0.0:
        room = np.maximum(most - np.count_nonzero(result[:, held], axis=1), 1)
        result[:, loose] = strongest(result[:, loose], room, least)
    result[~some] = given[~some]
    return result


def _check_weights(weights: ArrayLike, count: int) -> Floats:
    """Return weights of so many points, (n, b), that are not negative, nor all zero."""
    given = as_doubles(
        check_array(weights, "Weights", [(count, None)], f"Give one row for each of {count} points.", "biuf")
    )
    check_finite(given, "weights", "Replace them.")
    negative = np.count_nonzero((given < 0.0).any(axis=1))
    if negative or not given.any():
        wrong = f"{negative} points have negative weights" if negative else "All weights are zero"
        raise InvalidPointsError(f"{wrong}. Give weights from 0 on, and some above it.")
    return given


def _separated(laplacian: LaplaceBeltrami, edges: ArrayLike | None) -> LaplaceBeltrami:
    """Return the operator without pairs of sheets that touch, or of loose parts of a mesh."""
    stiffness, _ = apart(laplacian.stiffness, outward_normals(laplacian), laplacian.trust)
    if edges is not None:
        count = len(laplacian.points)
        ends = check_array(edges, "Edges", [(None, 2)], "Give two points for each.", "iu").astype(np.int64)
        if ends.size and not 0 <= ends.min() <= ends.max() < count:
            raise InvalidPointsError(f"Edges have points beyond the {count} there are. Give numbers from 0.")
        joined = sparse.coo_array((np.ones(len(ends)), tuple(ends.T)), shape=(count, count))
        part = connected_components(joined, directed=False)[1]
        part[np.bincount(ends.ravel(), minlength=count) == 0] = -1
        first, second = stiffness.tocoo().coords
        stiffness = without(stiffness, (part[first] != part[second]) & (part[first] >= 0) & (part[second] >= 0))
    return replace(laplacian, stiffness=stiffness)


def _shared(weights: Floats, total: Floats, smoothed: Bools, held: Bools) -> Floats:
    """Return weights, (n, b), whose rows have given sums: held ones stay, smoothed ones come before all others."""
    room = np.maximum(total - weights[:, held].sum(axis=1), 0.0)
    rest = ~smoothed & ~held
    first, other = weights[:, smoothed].sum(axis=1), weights[:, rest].sum(axis=1)
    taken = np.where(other > 0.0, np.minimum(first, room), room)
    taken[first == 0.0] = 0.0
    result = weights.copy()
    result[:, smoothed] *= (taken / np.where(first > 0.0, first, 1.0))[:, None]
    result[:, rest] *= ((room - taken) / np.where(other > 0.0, other, 1.0))[:, None]
    return result
