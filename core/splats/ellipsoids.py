"""Ellipsoids R S^2 R^T: unit quaternions R, half axes S, and their images under linear maps."""

import numpy as np

from ..algebra import blocks, nearest_rotations, on_all_cores
from ..types import Floats, Ints

_BLOCK = 1 << 13  # ellipsoids worked on at one time
_SWEEPS = 12  # of Jacobi's method; six reach full precision even for axes of a millionth
_TOLERANCE = 1e-14  # of the cosine between two axes, below which they are not rotated
_LOST = 1e-14  # of the longest axis
_OTHERS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])  # components of a quaternion beside one


def matrices_of(quaternions: Floats) -> Floats:
    """Return the rotations of unit quaternions w x y z, (n, 4), as matrices, (3, 3, n)."""
    w, x, y, z = np.asarray(quaternions, dtype=np.float64).T
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def quaternions_of(matrices: Floats) -> Floats:
    """Return the unit quaternions w x y z, (n, 4), of rotations, (3, 3, n)."""
    (a, b, c), (d, e, f), (g, h, i) = matrices
    # Four times the products of the quaternion's components: each row is a multiple of it, the longest most accurate.
    products = np.array(
        [
            [1.0 + a + e + i, h - f, c - g, d - b],
            [h - f, 1.0 + a - e - i, b + d, c + g],
            [c - g, b + d, 1.0 - a + e - i, f + h],
            [d - b, c + g, f + h, 1.0 - a - e + i],
        ]
    )
    longest = np.argmax(np.einsum("kkn->kn", products), axis=0)
    rows = products[longest, :, np.arange(len(longest))]
    return rows / np.sqrt(np.einsum("nk,nk->n", rows, rows))[:, None]


def completed_quaternions(missing: Ints, others: Floats) -> Floats:
    """Return unit quaternions, (n, 4), of three components, (n, 3), and the index of the missing positive one, (n,)."""
    left = 1.0 - np.einsum("nk,nk->n", others, others)
    result = np.empty((len(others), 4))
    rows = np.arange(len(others))
    result[rows[:, None], _OTHERS[missing]] = others
    result[rows, missing] = np.sqrt(np.maximum(left, 0.0))
    return result


def mapped(scales: Floats, rotations: Floats, gradients: Floats) -> tuple[Floats, Floats]:
    """Map ellipsoids linearly: F R S^2 R^T F^T, split into half axes and rotations again.

    Parameters
    ----------
    scales : ndarray, (n, 3)
        Half axes.
    rotations : ndarray, (n, 4)
        Unit quaternions w x y z.
    gradients : ndarray, (n, 3, 3)
        The maps F.

    Returns
    -------
    ndarray, (n, 3)
    ndarray, (n, 4)
        Each on the same side as the quaternion before, so that interpolation between them is the short one.

    Notes
    -----
    One-sided Jacobi: pairs of columns of F R S are rotated until all are orthogonal. It keeps their order, as long as
    no rotation of 45 degrees is needed, and the digits of axes that are far shorter than others.

    References
    ----------
    Demmel, Veselic. Jacobi's method is more accurate than QR. SIAM J. Matrix Anal. Appl. 13, 1992.
    """
    lengths, quaternions = np.empty(scales.shape), np.empty(rotations.shape)

    def split(rows: slice) -> None:
        lengths[rows], quaternions[rows] = _split(scales[rows], rotations[rows], gradients[rows])

    on_all_cores(split, blocks(len(scales), _BLOCK))
    return lengths, quaternions


def _split(scales: Floats, rotations: Floats, gradients: Floats) -> tuple[Floats, Floats]:
    """Return half axes and rotations of a block of mapped ellipsoids, as accurate as the type of the given ones."""
    maps = np.ascontiguousarray(np.moveaxis(gradients, 0, 2), dtype=np.float64)  # a tenth of the time of strided ones
    axes = np.einsum("abn,bcn->acn", maps, matrices_of(rotations)) * np.asarray(scales, dtype=np.float64).T
    size = np.sqrt(np.einsum("acn,acn->n", axes, axes))
    axes = axes / np.where(size > 0.0, size, 1.0)
    last = np.sqrt(np.finfo(np.result_type(scales, rotations)).eps)  # leaves about its square
    rows, left = np.arange(len(scales)), axes
    for _ in range(_SWEEPS):
        slant = np.max([_orthogonalize(left, p, q) for p, q in ((0, 1), (0, 2), (1, 2))], axis=0)
        going = slant > last
        if going.all():
            continue
        if left is not axes:
            axes[:, :, rows] = left
        rows, left = rows[going], left[:, :, going]
        if not len(rows):
            break
    else:
        axes[:, :, rows] = left
    lengths = np.sqrt(np.einsum("acn,acn->cn", axes, axes))
    lost = lengths <= _LOST * lengths.max(axis=0)  # rounding leaves no direction
    unit = axes / np.where(lost, np.inf, lengths)
    # A column is reversed where the map mirrors; those without a direction complete the others.
    mirrored = np.einsum("an,an->n", unit[:, 0], np.cross(unit[:, 1], unit[:, 2], axis=0)) < 0.0
    unit[:, 2] *= np.where(mirrored, -1.0, 1.0)
    flat = np.flatnonzero(lost.any(axis=0))
    if len(flat):
        unit[:, :, flat] = nearest_rotations(unit[:, :, flat])
    quaternions = quaternions_of(unit)
    sides = np.where(np.einsum("nk,nk->n", quaternions, rotations) < 0.0, -1.0, 1.0)
    return (lengths * size).T, quaternions * sides[:, None]


def _orthogonalize(axes: Floats, p: int, q: int) -> Floats:
    """Rotate two columns of each matrix to be orthogonal; return the cosines between them before, (n,)."""
    one, other = axes[:, p], axes[:, q]
    product = np.einsum("an,an->n", one, other)
    squares = np.einsum("an,an->n", one, one), np.einsum("an,an->n", other, other)
    bound = np.sqrt(squares[0] * squares[1])
    slant = np.abs(product)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        half = (squares[1] - squares[0]) / (2.0 * product)
        tangent = np.copysign(1.0, half) / (np.abs(half) + np.sqrt(half * half + 1.0))
    tangent[~(slant > _TOLERANCE * bound)] = 0.0
    cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
    sine = cosine * tangent
    axes[:, p], axes[:, q] = cosine * one - sine * other, sine * one + cosine * other
    return np.divide(slant, bound, out=slant, where=bound > 0.0)
