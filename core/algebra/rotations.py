"""Rotations nearest to many 3 x 3 matrices at once."""

import numpy as np
from scipy import sparse

from ..linalg import det, svd
from ..types import Floats, Ints

_STEPS = 12  # of Newton's method; seven reach full precision for singular values within 1 : 20
_TOLERANCE = 1e-10
TRACE = 1e-8  # weight of a rotation known from elsewhere, where the matrix leaves it free, relative to the matrix


def nearest_rotations(matrices: Floats) -> Floats:
    """Find the proper rotations R that maximise trace(R^T S), each of one matrix S.

    Parameters
    ----------
    matrices : ndarray, (3, 3, n)
        The last index counts the matrices. Any units; they may be singular, such as those of flat neighborhoods.

    Returns
    -------
    ndarray, (3, 3, n)
        Orthogonal, of determinant +1. A matrix without any direction gives the identity.

    Notes
    -----
    With S = U diag(s1, s2, s3) V^T, U and V proper, s3 of either sign, the rotation sought is U V^T. The matrix of
    cofactors has the same U and V and the values s2 s3, s1 s3, s1 s2, so S + cof(S) / s1 has the values
    s1 + s2 s3 / s1, s2 + s3 and s3 + s2: no longer singular for flat neighborhoods, and never reflected. Its polar
    factor is then found by scaled Newton steps, X <- (c X + X^-T / c) / 2, in a few dozen vectorised operations
    instead of n singular value decompositions; the few matrices for which they fail are decomposed.

    References
    ----------
    Higham. Computing the polar decomposition - with applications. SIAM J. Sci. Stat. Comput. 7, 1986.
    """
    size = np.sqrt(np.einsum("acn,acn->n", matrices, matrices))
    size[size == 0.0] = 1.0
    unit = matrices / size
    # The Frobenius norm of S^T S bounds s1^2 from above, closely where s1 leads.
    square = np.einsum("abn,acn->bcn", unit, unit)
    largest = np.einsum("bcn,bcn->n", square, square) ** 0.25
    largest[largest == 0.0] = 1.0
    result = unit + _cofactors(unit) / largest
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for _ in range(_STEPS):
            inverse = _cofactors(result)
            inverse /= np.einsum("cn,cn->n", result[0], inverse[0])
            stretch = np.einsum("acn,acn->n", inverse, inverse) / np.einsum("acn,acn->n", result, result)
            stretch = stretch**0.25
            change = (0.5 * stretch - 1.0) * result + (0.5 / stretch) * inverse
            result += change
            if not np.fmax.reduce(np.abs(change), axis=None) > _TOLERANCE:  # the error is now the square of that
                break
        error = np.abs(np.einsum("abn,acn->bcn", result, result) - np.eye(3)[:, :, None]).max(axis=(0, 1))
        failed = np.flatnonzero(~(error < 1e-12) | ~(np.einsum("cn,cn->n", result[0], _cofactors(result)[0]) > 0.0))
    if len(failed):
        result[:, :, failed] = _decompose(np.moveaxis(unit[:, :, failed], 2, 0))
    return result


def rotations_in_groups(matrices: Floats, group: Ints) -> Floats:
    """Find the nearest rotations; where a matrix leaves the angle about an axis free, it is that of its group.

    Matrices and rotations are (3, 3, n), groups, (n,), are numbered from 0 on; the rotation of a group is that of the
    sum of its matrices.
    """
    count = len(group)
    members = sparse.csr_array((np.ones(count), group, np.arange(count + 1)))
    rotation = nearest_rotations((matrices.reshape(9, -1) @ members).reshape(3, 3, -1))
    size = np.sqrt(np.einsum("acn,acn->n", matrices, matrices))
    return nearest_rotations(matrices + TRACE * np.where(size > 0.0, size, 1.0) * rotation[:, :, group])


def _cofactors(x: Floats) -> Floats:
    """Return the matrices of cofactors, whose rows are the cross products of the others, (3, 3, n)."""
    result = np.empty_like(x)
    for a in range(3):
        b, c = x[(a + 1) % 3], x[(a + 2) % 3]
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            np.multiply(b[i], c[j], out=result[a, k])
            result[a, k] -= b[j] * c[i]
    return result


def _decompose(matrices: Floats) -> Floats:
    """Find the same rotations by singular value decompositions; zero matrices count as the identity."""
    # A hint of the identity decides where the rotation about some axis is free.
    left, _, right = svd(matrices + 1e-14 * np.eye(3))
    sign = det(left) * det(right)
    left[:, :, 2] *= np.sign(sign)[:, None]
    return np.moveaxis(left @ right, 0, 2)
