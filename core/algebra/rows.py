"""Products of a sparse matrix by parts of its rows, on all cores."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from scipy import sparse

from ..cores import cores
from ..types import Array, Ints, Report
from .blocks import blocks, on_all_cores, workers

PART = 1 << 20  # entries of a matrix that are multiplied at once, at most: some hundredths of a second
_LEAST = 1 << 17  # and at least, unless these are all: fewer are multiplied before another thread has started
_FEW = 4  # columns, up to which products with one at a time are faster, by half

_BLOCK = 1 << 13  # rows that are computed at one time

Result = TypeVar("Result")


class Rows:
    """A sparse matrix, not copied, whose products are taken by parts of its rows, on all cores.

    `report` is called without arguments after each part; it may raise `Cancelled`.
    """

    def __init__(self, matrix: sparse.csr_array, pool: ThreadPoolExecutor, report: Report) -> None:
        self._report, self._count, self._dtype = report, matrix.shape[0], matrix.dtype
        starts = [part.start for part in blocks(max(matrix.nnz, 1), part_size(matrix.nnz))]
        cuts = np.unique(np.append(np.searchsorted(matrix.indptr[:-1], starts), matrix.shape[0]))
        self._slices = [slice(first, last) for first, last in pairwise(cuts)]
        self._parts = []
        for rows in self._slices:
            pointers = matrix.indptr[rows.start : rows.stop + 1]
            entries = slice(pointers[0], pointers[-1])
            values = matrix.data[entries], matrix.indices[entries], pointers - pointers[0]
            self._parts.append(_matrix(*values, matrix.shape[1]))
        self._map: Callable[..., Iterator[Any]] = pool.map if len(self._parts) > 1 else map  # to no other thread

    def __matmul__(self, other: Any) -> Any:
        """Multiply with an array, (m, k), or a sparse one."""
        if sparse.issparse(other):
            return sparse.vstack(list(self.each(lambda rows, part: part @ other)), format="csr")
        return self.product(other, lambda rows, values: None)

    def product(self, other: Array, change: Callable[[slice, Array], None], out: Array | None = None) -> Array:
        """Multiply with an array, (m, k), and change each part of the product, in place, while it is in the cache.

        That with an array of single precision is single: the parts are rounded, which takes less time than the product.
        It is written to an array that is given, of which each part may be read until it is changed.
        """
        rounded = self._dtype == np.float64 and other.dtype == np.float32
        dtype = other.dtype if rounded else np.result_type(self._dtype, other.dtype)
        result = np.empty((self._count, other.shape[1]), dtype=dtype) if out is None else out
        few = 0 < other.shape[1] <= _FEW
        other = np.ascontiguousarray(other.T if few else other)  # once: scipy would do so with all of it for each part

        def fill(rows: slice, part: sparse.csr_array) -> None:
            if rounded:
                part = _matrix(part.data.astype(np.float32), part.indices, part.indptr, part.shape[1])
            values = np.stack([part @ column for column in other], axis=1) if few else part @ other
            change(rows, values)
            result[rows] = values

        list(self.each(fill))
        return result

    def each(self, function: Callable[[slice, sparse.csr_array], Result]) -> Iterator[Result]:
        """Yield the results of a function of each slice of the rows and the part of the matrix there."""
        for result in self._map(function, self._slices, self._parts):
            self._report()
            yield result


def multiply_rows(matrix: sparse.csr_array, values: Array) -> Array:
    """Return the product of a matrix with an array, (m,) or (m, k), on all cores: the same bits on any number."""
    if matrix.nnz <= _LEAST:  # faster than to open a pool
        return matrix @ values
    with workers() as pool:
        product = Rows(matrix, pool, lambda: None) @ (values[:, None] if values.ndim == 1 else values)
    return product[:, 0] if values.ndim == 1 else product


def matrix_by_rows(
    function: Callable[[slice], sparse.csr_array], counts: Ints, width: int, report: Report = lambda: None
) -> sparse.csr_array:
    """Return the matrix, (n, width), of which a function computes the rows of each slice, on all cores.

    Each row has so many entries, (n,). For `report` see `on_all_cores`.
    """
    start: Ints = np.append(0, np.cumsum(counts, dtype=np.int64))
    start = start.astype(np.int32 if start[-1] < 2**31 else np.int64)
    values, columns = np.empty(start[-1]), np.empty(start[-1], dtype=start.dtype)

    def put(rows: slice) -> None:
        part, entries = function(rows), slice(start[rows.start], start[rows.stop])
        values[entries], columns[entries] = part.data, part.indices

    on_all_cores(put, blocks(len(counts), _BLOCK), report)
    return _matrix(values, columns, start, width)


def _matrix(values: Array, columns: Ints, start: Ints, width: int) -> sparse.csr_array:
    """Return a sparse matrix of these arrays themselves: its constructor would copy a small slice of an array."""
    result = sparse.csr_array((len(start) - 1, width), dtype=values.dtype)
    result.data, result.indices, result.indptr = values, columns, start
    return result


def part_size(entries: int) -> int:
    """Return how many of a matrix's entries are multiplied at once."""
    return min(max(entries // cores() + 1, _LEAST), PART)
