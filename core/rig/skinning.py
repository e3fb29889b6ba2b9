"""Points that follow bones: linear blending, and dual quaternions, which keep the volume of bent limbs."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from ..algebra import blocks, nearest_rotations, on_all_cores
from ..arguments import as_doubles, check_array, check_finite, check_positions, check_switches, not_negative
from ..errors import InvalidPointsError
from ..types import Bools, Floats, Ints

_BLOCK = 1 << 13  # points worked on at one time, which stay in the cache of the processor
_STRETCHED = 1e-12  # share of a stretch that is no error of rounding


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
    splats.Splats.deformed : Carries ellipsoids and harmonics by gradients.

    References
    ----------
    Kavan, Collins, Zara, O'Sullivan. Geometric skinning with approximate dual quaternion blending. ACM Trans. Graph.
    27, 2008.

    Examples
    --------
    The upper half of the unit sphere is shifted by its bone, the lower one stays:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> upper = (points[:, 2] > 0).astype(float)[:, None]
    >>> shift = np.column_stack([np.eye(3), [0, 0, 5]])
    >>> moved = mf.rig.skin(points, upper, [shift])
    >>> print((moved - points)[[0, 799], 2])
    [5. 0.]
    """
    count = len(check_array(points, "Points", [(None, 3)], "Give x, y, z for each point."))
    places = check_positions(points, count, "points", "point")
    given = _check_matrices(matrices)
    skinner = Skinner(_check_table(weights, (count, len(given))))
    return skinner.move(places, given, dual_quaternions=dual_quaternions, gradients=gradients)


class Skinner:
    """Weights of bones, prepared to move the same points in many poses.

    Parameters
    ----------
    weights : array_like or sparse array, (n, b), or array_like, (n, k)
        As of `skin`, or of those bones of each point that are named.
    bones : array_like of int, (n, k), optional
        Of which bone each weight is.
    count : int, optional
        How many bones there are, if they are named; by default so many that all names fit.

    Raises
    ------
    InvalidPointsError
        Weights that are no table, or not finite, or of bones that there are not.

    See Also
    --------
    skin : The same for one pose.

    Examples
    --------
    The unit sphere, moved twice:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> skinner = mf.rig.Skinner(np.ones((len(points), 1)))
    >>> for shift in (1, 2):
    ...     moved = skinner.move(points, [np.column_stack([np.eye(3), [0, 0, shift]])])
    ...     print((moved - points)[0])
    [0. 0. 1.]
    [0. 0. 2.]
    """

    def __init__(self, weights: Any, bones: ArrayLike | None = None, count: int | None = None) -> None:
        table = _check_table(weights, (None, None)) if bones is None else _named_table(weights, bones, count)
        self._shape = table.shape
        self._blocks = [_Block(rows, table[rows]) for rows in blocks(table.shape[0], _BLOCK)]

    def move(
        self,
        points: ArrayLike,
        matrices: ArrayLike,
        *,
        dual_quaternions: bool = False,
        gradients: bool = False,
        rounding: float = 0.0,
    ) -> Any:
        """Move points with the bones; see `skin`.

        Parameters
        ----------
        points : array_like, (n, 3)
        matrices : array_like, (b, 4, 4) or (b, 3, 4)
        dual_quaternions, gradients : bool
        rounding : float
            What in matrices counts as an error of rounding: dual quaternions leave out stretches by such shares, which
            is faster.

        Returns
        -------
        moved : ndarray, (n, 3)
        gradients : ndarray, (n, 3, 3)
            If asked for.

        Raises
        ------
        InvalidPointsError
            Points or matrices of another number than the weights, or not finite.
        PointCloudError
            A rounding below zero.
        """
        check_switches(dual_quaternions=dual_quaternions, gradients=gradients)
        count, bones = self._shape
        places = check_positions(points, count, "points", "point")
        given = _check_matrices(matrices)
        if len(given) != bones:
            raise InvalidPointsError(
                f"There are weights of {bones} bones, and matrices of {len(given)}. Give one of each."
            )
        least = max(not_negative(rounding, "rounding"), _STRETCHED)
        bend = _Screws(given, least).blended if dual_quaternions else partial(_blended_matrices, given)
        moved, linears = np.empty((count, 3)), np.empty((count, 3, 3) if gradients else 0)

        def work(block: _Block) -> None:
            linear, shift = bend(block)
            np.einsum("nij,nj->ni", linear, places[block.rows], out=moved[block.rows])
            moved[block.rows] += shift
            if gradients:
                linears[block.rows] = linear

        on_all_cores(work, self._blocks)
        return (moved, linears) if gradients else moved


class _Block:
    """The weights of some of the points, rows of a table, (m, b).

    Of each point, `left` is what the weights leave to one, which does not move, and `first` the bone that it follows
    most; the first one where it follows none. `pairs` is for each weight the number of that bone and of its own one, as
    of an entry of a table (b, b).
    """

    def __init__(self, rows: slice, table: sparse.csr_array) -> None:
        self.rows, self.table = rows, table
        self.left = 1.0 - np.asarray(table.sum(axis=1))
        size = np.diff(table.indptr)
        self.first = np.zeros(len(size), dtype=np.int64)
        self.first[size > 0] = table.indices[_largest(table)]
        self.pairs = np.repeat(self.first, size) * table.shape[1] + table.indices

    def sums(self, values: Floats) -> Floats:
        """Return the weighted sums of values of the bones, (b, k), as (m, k)."""
        return np.asarray(self.table @ values)

    def sided_sums(self, values: Floats, opposite: Bools) -> Floats:
        """Return such sums of values that count negative beside bones to which they are opposite, (b, b)."""
        turned = opposite.ravel()[self.pairs]
        if not turned.any():
            return self.sums(values)
        data = np.where(turned, -self.table.data, self.table.data)
        return np.asarray(
            sparse.csr_array((data, self.table.indices, self.table.indptr), shape=self.table.shape) @ values
        )


def _blended_matrices(given: Floats, block: _Block) -> tuple[Floats, Floats]:
    """Return the linear parts, (m, 3, 3), and the shifts, (m, 3), of matrices blended by the weights of a block."""
    blended = block.sums(given.reshape(-1, 12)).reshape(-1, 3, 4)
    linear = blended[:, :, :3]
    for axis in range(3):
        linear[:, axis, axis] += block.left
    return linear, blended[:, :, 3]


class _Screws:
    """The motions of bones as dual quaternions.

    A bone that stretches shifts each point by its stretch there before it turns, so that its screw depends on the
    place. That is linear, and so is the blend.
    """

    def __init__(self, given: Floats, rounding: float) -> None:
        linear = given[:, :, :3]
        turn = np.moveaxis(nearest_rotations(np.ascontiguousarray(np.moveaxis(linear, 0, 2))), 2, 0)
        self._real = _quaternions(turn)
        stretch, none = linear - turn, np.zeros(len(given))
        self._stretched = bool(np.abs(stretch).max(initial=0.0) > rounding)
        columns = [given[:, :, 3], *(np.moveaxis(stretch, 2, 0) if self._stretched else ())]
        duals = [0.5 * _product((none, *column.T), self._real.T).T for column in columns]
        self._values = np.concatenate([self._real, *duals], axis=1)
        self._opposite = self._real @ self._real.T < 0.0

    def blended(self, block: _Block) -> tuple[Floats, Floats]:
        """Return the linear parts, (m, 3, 3), and the shifts, (m, 3), of screws blended by the weights of a block."""
        mixed = np.ascontiguousarray(block.sided_sums(self._values, self._opposite).T)
        mixed[0] += np.where(self._real[block.first, 0] < 0.0, -block.left, block.left)
        length = np.sqrt(np.einsum("qn,qn->n", mixed[:4], mixed[:4]))
        mixed /= np.where(length > 0.0, length, 1.0)
        back = mixed[:4] * np.array([1.0, -1.0, -1.0, -1.0])[:, None]
        linear = _matrices(mixed[:4])
        shift, *stretch = (2.0 * _product(dual, back)[1:] for dual in mixed[4:].reshape(-1, 4, mixed.shape[1]))
        for axis, column in enumerate(stretch):
            linear[:, :, axis] += column.T
        return linear, shift.T


def _check_matrices(matrices: ArrayLike) -> Floats:
    """Return matrices of bones, (b, 3, 4)."""
    advice = "Give a 3 x 4 or 4 x 4 matrix for each bone."
    given = as_doubles(check_array(matrices, "Matrices", [(None, 3, 4), (None, 4, 4)], advice))[:, :3]
    check_finite(given, "matrices", advice)
    return given


def _check_table(weights: Any, shape: tuple[int | None, int | None]) -> sparse.csr_array:
    """Return weights as a sparse array of this shape; another, or numbers not finite, raise `InvalidPointsError`."""
    advice = "Give one row for each point, with a weight for each bone."
    if not sparse.issparse(weights):
        weights = sparse.csr_array(as_doubles(check_array(weights, "Weights", [shape], advice, "biuf")))
    fits = all(wanted in (None, size) for wanted, size in zip(shape, weights.shape, strict=True))
    if not fits or not np.isfinite(weights.data).all():
        raise InvalidPointsError(f"Weights have the shape {weights.shape}, or are not finite. {advice}")
    table = sparse.csr_array(weights, dtype=np.float64, copy=True)  # sums are taken in place
    table.sum_duplicates()
    return table


def _named_table(weights: ArrayLike, bones: ArrayLike, count: int | None) -> sparse.csr_array:
    """Return the weights of named bones, (n, k) both, as a sparse array, (n, count)."""
    named = check_array(bones, "Bones", [(None, None)], "Give the numbers of the bones of each point.", "iu")
    most = int(named.max(initial=-1)) + 1 if count is None else count
    if named.size and not 0 <= named.min() <= named.max() < most:
        raise InvalidPointsError(f"There are {most} bones, and others are named. Give numbers from 0 to {most - 1}.")
    advice = "Give a weight for each bone that is named."
    values = as_doubles(check_array(weights, "Weights", [named.shape], advice, "biuf"))
    ends = named.shape[1] * np.arange(len(named) + 1)
    table = sparse.csr_array((values.flatten(), named.flatten(), ends), shape=(len(named), most))  # copies of them
    table.eliminate_zeros()
    return _check_table(table, table.shape)


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
