"""Dense matrices: products by scipy's BLAS, as numpy may be built without a fast one; factors; many small inverses."""

from ctypes import CFUNCTYPE, PYFUNCTYPE, byref, c_char_p, c_double, c_float, c_int64, c_void_p, py_object, pythonapi
from typing import Any

import numpy as np
from scipy.linalg import cython_blas, cython_lapack

from ..types import Array, Floats
from .blocks import blocks, on_all_cores

_WORK = 1 << 24  # multiplications that a core does at one time: in some thousandths of a second
_BLOCK = 1 << 13  # small matrices


def product(left: Array, right: Array) -> Array:
    """Return ``left @ right`` of two matrices, (m, k) and (k, n), one of which is long, on all cores.

    The result has the lower precision of the two. Fast if one axis of each is contiguous; others are copied.
    """
    (m, k), n, dtype = left.shape, right.shape[1], _lower(left, right)
    size = max(1, _WORK // max(1, min(m, k) * n))
    if max(m, k) <= size:
        return multiply(left, right)
    if m >= k:
        result = np.empty((m, n), dtype=dtype)
        on_all_cores(lambda rows: np.copyto(result[rows], multiply(left[rows], right)), blocks(m, size))
        return result
    sums = on_all_cores(lambda part: multiply(left[:, part], right[part]), blocks(k, size))
    return sum(sums, np.zeros((m, n), dtype=dtype))


def subtract_product(result: Array, left: Array, right: Array) -> None:
    """Compute ``result -= left @ right`` in place, (m, n), on all cores; see `subtract`."""

    def reduce(rows: slice) -> None:
        subtract(result[rows], left[rows], right)

    on_all_cores(reduce, blocks(len(left), max(1, _WORK // max(1, right.size))))


def subtract(result: Array, left: Array, right: Array) -> None:
    """Compute ``result -= left @ right`` in place, (m, n), by one call of BLAS; the rows of the result are contiguous.

    Products have the precision of the result.
    """
    (m, n), (row, column) = result.shape, result.strides
    if (n > 1 and column != result.itemsize) or (m > 1 and row < n * result.itemsize):  # BLAS would write elsewhere
        raise ValueError("The rows of a matrix to subtract from are not contiguous.")
    _multiply(left, right, result, -1.0, 1.0)


def multiply(left: Array, right: Array) -> Array:
    """Return ``left @ right`` of two matrices, (m, k) and (k, n), by one call of BLAS.

    The result has the lower precision of the two.
    """
    result = np.zeros((len(left), right.shape[1]), dtype=_lower(left, right))
    _multiply(left, right, result, 1.0, 0.0)
    return result


def _multiply(left: Array, right: Array, result: Array, factor: float, kept: float) -> None:
    """Compute ``result = factor left @ right + kept result`` in place.

    BLAS takes columns, and numpy has rows: it computes the transpose, as the product of the transposes.
    """
    (m, k), (rows, n), dtype = left.shape, right.shape, result.dtype
    if rows != k or result.shape != (m, n):  # BLAS would read, or write, what is beyond
        shapes = f"{left.shape} and {right.shape} have no product of the shape {result.shape}"
        raise ValueError(f"Matrices of the shapes {shapes}.")
    if m * k * n:
        gemm, number = _GEMM[dtype.char]
        (right, flip_a, step_a), (left, flip_b, step_b) = (
            _in_columns(part.astype(dtype, copy=False)) for part in (right, left)
        )
        sizes, (one, other) = [byref(c_int64(size)) for size in (n, m, k)], (byref(number(x)) for x in (factor, kept))
        a, b, c = (array.ctypes.data for array in (right, left, result))
        step = byref(c_int64(max(result.strides[0] // result.itemsize, n)))  # anything for a single row
        gemm(flip_a, flip_b, *sizes, one, a, step_a, b, step_b, other, c, step)


def _lower(left: Array, right: Array) -> Any:
    """Return the type of numbers that has the lower precision."""
    return min(left.dtype, right.dtype, key=lambda dtype: dtype.itemsize)


def _in_columns(matrix: Array) -> tuple[Array, bytes, Any]:
    """Return a matrix, whether BLAS is to transpose it, and the step from one of its columns to the next."""
    (rows, columns), size, steps = matrix.shape, matrix.itemsize, matrix.strides
    if steps[0] == size and steps[1] >= size * rows:
        return matrix, b"T", byref(c_int64(steps[1] // size))
    if not (steps[1] == size and steps[0] >= size * columns):
        matrix = np.array(matrix, order="C")
    return matrix, b"N", byref(c_int64(matrix.strides[0] // matrix.itemsize))


def invert_factor(matrix: Floats) -> bool:
    """Replace a symmetric matrix, (k, k), by the inverse of its upper Cholesky factor, in place.

    Only its upper triangle is read; its rows are contiguous. The result is upper, with zeros below: it times its
    transpose is the inverse of the matrix. False is returned, with no sound result, if that is not positive definite.
    """
    size, step, failed = c_int64(len(matrix)), c_int64(matrix.strides[0] // matrix.itemsize), c_int64(0)
    for routine, words in ((_POTRF, (b"L",)), (_TRTRI, (b"L", b"N"))):  # of columns, which the rows are to LAPACK
        routine(*words, byref(size), matrix.ctypes.data, byref(step), byref(failed))
        if failed.value:
            return False
    matrix[np.tri(len(matrix), k=-1, dtype=bool)] = 0.0
    return True


def _routine(library: Any, name: str, arguments: int) -> Any:
    """Return a routine of scipy's BLAS or LAPACK that lets other threads run: others of scipy hold Python's lock.

    Its whole numbers have 32 bits, or 64: of small positive ones the former are the first half of the latter.
    """
    capsule = library.__pyx_capi__[name]
    signature = PYFUNCTYPE(c_char_p, py_object)(("PyCapsule_GetName", pythonapi))(capsule)
    address = PYFUNCTYPE(c_void_p, py_object, c_char_p)(("PyCapsule_GetPointer", pythonapi))(capsule, signature)
    return CFUNCTYPE(None, *[c_void_p] * arguments)(address)


_GEMM = {"f": (_routine(cython_blas, "sgemm", 13), c_float), "d": (_routine(cython_blas, "dgemm", 13), c_double)}
_POTRF, _TRTRI = _routine(cython_lapack, "dpotrf", 5), _routine(cython_lapack, "dtrtri", 6)


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
