"""Products of dense matrices by scipy's BLAS: the numpy of a Blender may be built without a fast one."""

import numpy as np
from scipy.linalg import get_blas_funcs

from .blocks import blocks

_WORK = 1 << 27  # multiplications in one go: some hundredths of a second, in which nothing else in Python can run


def product(left, right):
    """Return ``left @ right`` of two matrices, (m, k) and (k, n), of one precision; quick if they lie whole in memory.

    Parameters
    ----------
    left, right : ndarray, (m, k) and (k, n)
        In single or double precision. Transposed ones and rows of others cost nothing; other parts are copied.

    Returns
    -------
    ndarray, (m, n)
    """
    (m, k), n = left.shape, right.shape[1]
    gemm = get_blas_funcs("gemm", (left, right))
    if 0 < m * k * n <= _WORK:
        return _multiply(gemm, left, right)
    result, longest = np.zeros((m, n), dtype=gemm.dtype), max(m, k)
    for part in blocks(longest if result.size else 0, max(1, _WORK * longest // max(1, m * k * n))):
        if m >= k:
            _multiply(gemm, left[part], right, c=result[part].T, overwrite_c=True)
        else:
            _multiply(gemm, left[:, part], right[part], c=result.T, beta=1.0, overwrite_c=True)
    return result


def _multiply(gemm, left, right, **settings):
    """Compute the product as the transpose of that of the transposes, since BLAS takes columns, and numpy has rows."""
    (a, flip_a), (b, flip_b) = _in_columns(right), _in_columns(left)
    return gemm(1.0, a, b, trans_a=flip_a, trans_b=flip_b, **settings).T


def _in_columns(matrix):
    """Return the transpose of a matrix as it lies in memory, and whether it is to be transposed for that."""
    return (matrix.T, False) if matrix.flags.c_contiguous else (matrix, True)
