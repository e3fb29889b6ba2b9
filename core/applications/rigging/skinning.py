"""Points that follow bones: linear blending, and dual quaternions, which keep the volume of bent limbs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from ...algebra import nearest_rotations
from ...arguments import as_doubles, check_array, check_finite, check_positions, check_switches
from ...errors import InvalidPointsError
from ...types import Floats, Ints


def skin(
    points: ArrayLike,
    weights: Any,
    matrices: ArrayLike,
    *,
    dual_quaternions: bool = False,
    gradients: bool = False,
) -> Any:
    """Move points with the bones that they follow.

    Parameters
    ----------
    points : array_like, (n, 3)
        At rest [L].
    weights : array_like or sparse array, (n, b)
        How much each point follows each bone, as of `bone_weights`; a sparse array of few bones a point is faster.
    matrices : array_like, (b, 4, 4) or (b, 3, 4)
        From rest to pose, of each bone: rotation, stretch, and shift [L].
    dual_quaternions : bool
        Blend rotations as screws, so that bent and twisted limbs keep their volume; stretches are blended linearly.
    gradients : bool
        Return the linear part of each point's motion, too.

    Returns
    -------
    moved : ndarray, (n, 3)
        A point that follows one bone alone is moved rigidly with it. Weights that sum to less than one leave the
        rest of a point where it is.
    gradients : ndarray, (n, 3, 3)
        If asked for: how an offset next to each point is turned and stretched, weights taken as constant around it.

    Raises
    ------
    InvalidPointsError
        Weights or matrices of a wrong shape, or not finite.

    See Also
    --------
    bone_weights : Finds weights.
    Splats.deformed : Carries ellipsoids and harmonics by gradients.

    References
    ----------
    Kavan, Collins, Zara, O'Sullivan. Geometric skinning with approximate dual quaternion blending. ACM Trans. Graph.
    27, 2008.

    Examples
    --------
    The upper half of the unit sphere is shifted by its bone, the lower one stays:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> upper = (points[:, 2] > 0).astype(float)[:, None]
    >>> shift = np.column_stack([np.eye(3), [0, 0, 5]])
    >>> moved = core.skin(points, upper, [shift])
    >>> print((moved - points)[[0, 799], 2])
    [5. 0.]
    """
    check_switches(dual_quaternions=dual_quaternions, gradients=gradients)
    advice = "Give a 3 x 4 or 4 x 4 matrix for each bone."
    given = as_doubles(check_array(matrices, "Matrices", [(None, 3, 4), (None, 4, 4)], advice))[:, :3]
    check_finite(given, "matrices", advice)
    count = len(check_array(points, "Points", [(None, 3)], "Give x, y, z for each point."))
    places = check_positions(points, count, "points", "point")
    table = _table(weights, (count, len(given)))
    left = 1.0 - table.sum(axis=1)
    linear, shift = given[:, :, :3], given[:, :, 3]
    if dual_quaternions:
        turn = np.moveaxis(nearest_rotations(np.ascontiguousarray(np.moveaxis(linear, 0, 2))), 2, 0)
        stretch = np.einsum("bji,bjk->bik", turn, linear)
        turns, shifts = _blend_screws(table, turn, shift, left)
        linears = turns @ (_blend(table, stretch) + left[:, None, None] * np.eye(3))
    else:
        shifts = table @ shift
        linears = _blend(table, linear) + left[:, None, None] * np.eye(3)
    moved = np.matmul(linears, places[:, :, None])[:, :, 0] + shifts
    return (moved, linears) if gradients else moved


def _table(weights: Any, shape: tuple[int, int]) -> sparse.csr_array:
    """Return weights as a sparse array of this shape.

    Raises
    ------
    InvalidPointsError
        Another shape, or not finite.
    """
    advice = f"Give one row for each of {shape[0]} points, with a weight for each of {shape[1]} bones."
    if not sparse.issparse(weights):
        weights = sparse.csr_array(as_doubles(check_array(weights, "Weights", [shape], advice, "biuf")))
    if weights.shape != shape or not np.isfinite(weights.data).all():
        raise InvalidPointsError(f"Weights have the shape {weights.shape}, or are not finite. {advice}")
    return sparse.csr_array(weights, dtype=np.float64)


def _blend(table: sparse.csr_array, matrices: Floats) -> Floats:
    return np.asarray(table @ matrices.reshape(len(matrices), 9)).reshape(-1, 3, 3)


def _blend_screws(table: sparse.csr_array, turn: Floats, shift: Floats, left: Floats) -> tuple[Floats, Floats]:
    """Return rotations, (n, 3, 3), and shifts, (n, 3), of blended screws; what is left of a weight does not move."""
    real = _quaternions(turn)
    still = np.zeros(len(shift))
    screw = np.concatenate([real.T, 0.5 * _product((still, *shift.T), real.T)]).T
    # A rotation is that of two opposite quaternions: those on the side of one bone of the point are blended.
    size = np.diff(table.indptr)
    first = np.zeros(len(size), dtype=np.int64)
    first[size > 0] = table.indices[_largest(table)]
    side = np.einsum("pq,pq->p", real[table.indices], np.repeat(real[first], size, axis=0)) < 0.0
    sided = sparse.csr_array((np.where(side, -table.data, table.data), table.indices, table.indptr), shape=table.shape)
    blended = np.asarray(sided @ screw).T
    blended[0] += np.where(real[first, 0] < 0.0, -left, left)
    length = np.sqrt(np.einsum("qn,qn->n", blended[:4], blended[:4]))
    blended = blended / np.where(length > 0.0, length, 1.0)
    back = blended[:4] * np.array([1.0, -1.0, -1.0, -1.0])[:, None]
    return _matrices(blended[:4]), 2.0 * _product(blended[4:], back)[1:].T


def _largest(table: sparse.csr_array) -> Ints:
    """Return which entry is the largest of each row that has any."""
    starts = table.indptr[:-1][np.diff(table.indptr) > 0]
    most = np.maximum.reduceat(table.data, starts) if len(starts) else table.data
    hits = np.flatnonzero(table.data == np.repeat(most, np.diff(np.append(starts, table.nnz))))
    return hits[np.searchsorted(hits, starts)]


def _product(left: Any, right: Any) -> Floats:
    """Return the products of quaternions, (4, n), the real part first."""
    (a, b, c, d), (e, f, g, h) = left, right
    return np.array(
        [
            a * e - b * f - c * g - d * h,
            a * f + b * e + c * h - d * g,
            a * g - b * h + c * e + d * f,
            a * h + b * g - c * f + d * e,
        ]
    )


def _quaternions(turn: Floats) -> Floats:
    """Return the unit quaternions of rotations, (n, 4), by their largest component, so that none loses digits."""
    x, y, z = turn[:, 0, 0], turn[:, 1, 1], turn[:, 2, 2]
    squares = np.stack([1 + x + y + z, 1 + x - y - z, 1 - x + y - z, 1 - x - y + z], axis=1)
    a, b, c = turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]
    d, e, f = turn[:, 1, 0] + turn[:, 0, 1], turn[:, 0, 2] + turn[:, 2, 0], turn[:, 2, 1] + turn[:, 1, 2]
    s, t, u, v = squares.T
    table = np.stack([[s, a, b, c], [a, t, d, e], [b, d, u, f], [c, e, f, v]])
    chosen = table[np.argmax(squares, axis=1), :, np.arange(len(turn))]
    return chosen / np.linalg.norm(chosen, axis=1, keepdims=True)


def _matrices(quaternions: Floats) -> Floats:
    """Return the rotations, (n, 3, 3), of unit quaternions, (4, n)."""
    a, x, y, z = quaternions
    result = np.empty((len(a), 3, 3))
    result[:, 0, 0], result[:, 1, 1], result[:, 2, 2] = (
        1.0 - 2.0 * (u * u + v * v) for u, v in ((y, z), (x, z), (x, y))
    )
    for (i, j), u, v, w in (((0, 1), x, y, z), ((2, 0), z, x, y), ((1, 2), y, z, x)):
        both, turn = 2.0 * u * v, 2.0 * a * w
        result[:, i, j], result[:, j, i] = both - turn, both + turn
    return result
