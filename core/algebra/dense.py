"""Dense matrices: products by scipy's BLAS, as numpy may be built without a fast one; inverses of many small ones."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.linalg import get_blas_funcs

from ..types import Array, Floats
from .blocks import blocks, on_all_cores

_WORK = 1 << 27  # multiplications in one call: it holds Python's lock for some hundredths of a second
_ALONE = 1 << 18  # up to which OpenBLAS wakes no threads: these then keep a core for some hundredths of a second, awake
_LEAST = 1 << 8  # rows, in calls of that many multiplications, that are worth a call
_BLOCK = 1 << 13  # small matrices


def product(left: Array, right: Array) -> Array:
    """Return ``left @ right`` of two matrices, (m, k) and (k, n), of one precision; fast if they are contiguous.

    Transposes and slices of rows are used as they are; other slices are copied.
    """
    (m, k), n = left.shape, right.shape[1]
    gemm = get_blas_funcs("gemm", (left, right))
    if 0 < m * k * n <= _ALONE:
        return _multiply(gemm, left, right)
    result, longest = np.zeros((m, n), dtype=gemm.dtype), max(m, k)
    for part in blocks(longest if result.size else 0, _rows(m * k * n // max(1, longest))):
        if m >= k:
            _multiply(gemm, left[part], right, c=result[part].T, overwrite_c=True)
        else:
            _multiply(gemm, left[:, part], right[part], c=result.T, beta=1.0, overwrite_c=True)
    return result


def subtract_product(result: Array, left: Array, right: Array) -> None:
    """Compute ``result -= left @ right`` in place, for a contiguous result, (m, n), of the precision of both."""
    gemm, (m, n) = get_blas_funcs("gemm", (left, right)), result.shape
    for part in blocks(m, _rows(left.shape[1] * n)):
        _multiply(gemm, left[part], right, -1.0, beta=1.0, c=result[part].T, overwrite_c=True)


def _rows(width: int) -> int:
    """Return how many rows are multiplied in one call, by the multiplications that each takes."""
    alone = _ALONE // max(1, width)
    return alone if alone >= _LEAST else max(1, _WORK // max(1, width))


def _multiply(gemm: Callable[..., Array], left: Array, right: Array, factor: float = 1.0, **settings: Any) -> Array:
    """Compute the product as the transpose of that of the transposes, since BLAS takes columns, and numpy has rows."""
    (a, flip_a), (b, flip_b) = _in_columns(right), _in_columns(left)
    return gemm(factor, a, b, trans_a=flip_a, trans_b=flip_b, **settings).T


def _in_columns(matrix: Array) -> tuple[Array, bool]:
    """Return a matrix, or its transpose, in the order of columns, and whether BLAS has to transpose it."""
    return (matrix.T, False) if matrix.flags.c_contiguous else (matrix, True)


def inverses(matrices: Floats) -> Floats:
    """Return the inverses of small symmetric positive definite matrices, (n, k, k), by elimination in all at once.

    numpy hands each of them to LAPACK, whose threads may wait for each other longer than they work: where other
    programs run, 100,000 of them then take seconds.
    """
    result = np.empty(matrices.shape)

    def invert(part: slice) -> None:
        rows = np.moveaxis(matrices[part], 0, -1).astype(np.float64, order="C")
        result[part] = np.moveaxis(eliminate(rows), -1, 0)

    on_all_cores(invert, blocks(len(matrices), _BLOCK))
    return result


def eliminate(equations: Floats) -> Floats:
    """Solve k small symmetric positive definite systems at one time, by elimination in place.

    The equations, (c, c + m, k), are the matrices and then m right sides; the array is returned with inverses and
    solutions.
    """
    for pivot, row in enumerate(equations):
        column = equations[:, pivot].copy()
        row[pivot] = 1.0
        row /= column[pivot]
        for other, entries in enumerate(equations):
            if other != pivot:
                entries[pivot] = 0.0
                entries -= column[other] * row
    return equations


def lifted_inverse(matrices: Floats, least: float) -> Floats:
    """Return the inverses of symmetric matrices, (2, 2, m), semi-definite.

    Both eigenvalues are raised alike where the smaller one is below a share of the trace, ``least``.
    """
    (a, b), (_, d) = matrices
    trace = a + d
    smaller = 0.5 * (trace - np.hypot(a - d, 2.0 * b))
    lifted = np.where(trace > 0.0, np.maximum(least * trace - smaller, 0.0), 1.0)
    a, d = a + lifted, d + lifted
    return np.array([[d, -b], [-b, a]]) / (a * d - b * b)
