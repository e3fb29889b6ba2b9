"""Algebraic multigrid: coarse versions of a symmetric matrix, and V-cycles as approximate inverses."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import pinvh
from scipy.sparse.linalg import LinearOperator

from ..types import Array, Floats, Ints, Report
from .blocks import on_all_cores
from .dense import product
from .eigenvalue import rough_largest_eigenvalue
from .rows import Rows

SMALL, LARGE = 300, 900  # unknowns that are solved whole in a hundredth of a second, and in a quarter
STRONG = (3e-3, 1e-2, 3e-2, 0.1)  # coupling over the diagonal from which unknowns may share an aggregate: about 20
# by the first one, fewer by the others
_WEAK = 1e-3  # coupling over the diagonal up to which the smoother leaves it out: two fifths of all, of little energy
_USUAL = 64  # couplings of a row that these shares of the diagonal are for
ROUNDING = 1e-12  # of the largest diagonal entry: smaller ones are rounding error
_SMOOTHED = 0.3  # relative to the largest eigenvalue: the smoother damps errors of eigenvalues above it


@dataclass
class Known:
    """The lowest eigenpairs of one version of the matrix."""

    values: Floats  # (q,)
    # (n, q), the eigenvectors, and their products with the mass
    vectors: Array
    duals: Array


@dataclass
class Level:
    """One version of the matrix."""

    matrix: Rows  # (n, n)
    strong: Rows  # (n, n), the same without weak couplings, in the precision of V-cycles, for the smoother
    mass: Rows | None  # (n, n), inner product of its functions; none stands for the identity
    top: float  # largest eigenvalue, about
    steps: list[
        Array
    ]  # (n, 1) each, in that precision: step lengths of the Chebyshev smoother, divided by the diagonal
    # (n, m) and (m, n), interpolation from the next level to this one, in that precision, and its transpose
    extension: Rows
    restriction: Rows
    known: Known | None = None

    @property
    def precision(self) -> Any:
        """Of V-cycles."""
        return self.steps[0].dtype

    def weighed(self, vectors: Array) -> Any:
        """Return the product of vectors, (n, k), with the mass."""
        return vectors if self.mass is None else self.mass @ vectors


def build_levels(
    matrix: sparse.csr_array,
    slowest: Floats,
    least: int,
    enough: int,
    pool: ThreadPoolExecutor,
    report: Report,
    low: float = 0.0,
    precision: Any = np.float32,
) -> tuple[list[Level], sparse.csr_array, sparse.csr_array]:
    """Build ever smaller versions of a matrix by smoothed aggregation (Vanek, Mandel and Brezina 1996).

    Parameters
    ----------
    matrix : csr_array, (n, n)
        Symmetric positive semi-definite.
    slowest : ndarray, (n,)
        A positive vector near the null space: its product with the matrix is about zero.
    least : int
        Size at which to stop.
    enough : int
        Size that no version should fall below.
    pool, report
        As of `Rows`.
    low : float
        Eigenvalue up to which the last version has to represent all eigenvectors. An unknown whose Rayleigh quotient is
        no larger, such as a part weakly connected to the rest, is one of them: it is not aggregated with others.
    precision : dtype
        Of V-cycles.

    Returns
    -------
    levels : list of Level
        The given matrix first.
    matrix, mass : csr_array
        The last version, which needs no approximate inverse.
    """
    levels: list[Level] = []
    mass = None
    while matrix.shape[0] > least:
        n, diagonal, rows = matrix.shape[0], matrix.diagonal(), Rows(matrix, pool, report)
        highest, own = diagonal.max(), 1.0 if mass is None else mass.diagonal()
        # The diagonal of an unknown that is a whole component is rounding error: it couples with no other. Those below
        # `low` share no aggregate; the smoother takes them as they couple, but does not divide by less than `low`.
        smooth = np.where(diagonal > ROUNDING * highest, np.maximum(diagonal, low * own), np.inf)
        diagonal[diagonal <= np.maximum(ROUNDING * highest, low * own)] = np.inf
        # Couplings are compared as they act on the slowest, whatever the units of the unknowns; of many each is small.
        unit = slowest**2 * np.minimum(1.0, _USUAL / np.diff(matrix.indptr))
        strong = _strong(rows, unit * smooth, slowest)
        few = Rows(strong, pool, report)
        for share in STRONG:
            part = aggregates(few, unit * diagonal, share, report, slowest)[0]
            if part.max() >= enough:
                break
        norm = np.sqrt(np.bincount(part, slowest**2))
        if 2 * len(norm) > n:
            break
        top = rough_largest_eigenvalue(few, diagonal)
        smooth *= np.maximum(_locally_largest(rows, smooth) / top, 1.0)
        plain = sparse.csr_array((slowest / norm[part], part, np.arange(n + 1, dtype=np.int32)), shape=(n, len(norm)))
        prolongation = (plain - sparse.diags_array(4.0 / 3.0 / top / diagonal) @ (few @ plain)).tocsr()
        restriction = prolongation.T.tocsr()
        back = Rows(restriction, pool, report)
        levels.append(
            Level(
                matrix=rows,
                strong=Rows(_rounded(strong, precision), pool, report),
                mass=None if mass is None else Rows(mass, pool, report),
                top=top * highest,
                steps=[step[:, None].astype(precision) for step in smoothing_steps(top, smooth)],
                extension=Rows(_rounded(prolongation, precision), pool, report),
                restriction=Rows(_rounded(restriction, precision), pool, report),
            )
        )
        matrix = back @ (rows @ prolongation)
        matrix.setdiag(matrix.diagonal())  # stored also where a component cancels: products leave out what is zero
        mass = back @ (prolongation if mass is None else mass @ prolongation)
        slowest = norm
    return levels, matrix, mass


def _locally_largest(matrix: Rows, diagonal: Floats) -> Floats:
    """Return about the largest eigenvalue over the diagonal of each unknown with those that it couples with, (n,).

    Of few that hardly couple with others, such as a pair, it is up to two. Among many a random start does not find it,
    and with steps for the estimate of all the smoother would leave the error of these few as it is.
    """
    root = 1.0 / np.sqrt(diagonal)

    def measure(rows: slice, part: sparse.csr_array) -> Floats:
        squares = np.add.reduceat((part.data * root[part.indices]) ** 2, part.indptr[:-1]) * root[rows] ** 2
        return 1.0 + np.sqrt(np.maximum(squares - 1.0, 0.0))

    return np.concatenate(list(matrix.each(measure)))


def _strong(matrix: Rows, size: Floats, slowest: Floats) -> sparse.csr_array:
    """Return a symmetric matrix without weak couplings; its product with the slowest is the same.

    Sizes, (n,), are those of the diagonal, to which couplings are compared, in units of the slowest. What hardly
    couples smooths hardly: errors of high frequency are those of near neighbors.
    """

    def keep(rows: slice, part: sparse.csr_array) -> tuple[Array, Array, Array]:
        row = np.repeat(np.arange(rows.start, rows.stop, dtype=np.int32), np.diff(part.indptr))
        column, itself = part.indices, row == part.indices
        pull = part.data * slowest[column]
        kept = itself | (np.abs(pull) * slowest[row] > _WEAK * np.minimum(size[row], size[column]))
        lost = np.add.reduceat(np.where(kept, 0.0, pull), part.indptr[:-1])
        data = part.data.copy()
        data[itself] += lost / slowest[rows]
        return data[kept], column[kept], np.add.reduceat(kept, part.indptr[:-1], dtype=np.int32)

    data, column, count = on_all_cores(np.concatenate, list(zip(*matrix.each(keep), strict=True)))
    start = np.cumsum(np.append(0, count), dtype=column.dtype)  # indices of two types would become the longer one
    return sparse.csr_array((data, column, start), shape=(len(slowest),) * 2)


def _rounded(matrix: sparse.csr_array, precision: Any) -> sparse.csr_array:
    """Return a matrix in some precision that shares the index arrays: neither may be sorted in place."""
    return sparse.csr_array((matrix.data.astype(precision), matrix.indices, matrix.indptr), shape=matrix.shape)


def aggregates(
    matrix: Rows, size: Floats, share: float, report: Report, slowest: Floats | float = 1.0
) -> tuple[Ints, Ints]:
    """Aggregate the unknowns of a matrix around roots, no two of which couple strongly.

    Every row of the matrix stores its diagonal, zero or not. Couplings are compared to sizes, (n,), such as those of
    the diagonal, in units of the slowest, (n,). Return the number of each unknown's part, (n,), and the root of each
    part, (m,), which couples strongly with all of it.
    """
    slowest = np.broadcast_to(slowest, len(size))

    def strong(rows: slice, part: sparse.csr_array) -> tuple[Array, Array, Array]:
        row = np.repeat(np.arange(rows.start, rows.stop, dtype=np.int32), np.diff(part.indptr))
        itself = row == part.indices
        pull = -part.data * slowest[row] * slowest[part.indices]
        kept = itself | (pull > share * np.minimum(size[row], size[part.indices]))
        return row[kept], part.indices[kept], np.where(itself[kept], np.inf, pull[kept])

    row, column, weight = on_all_cores(np.concatenate, list(zip(*matrix.each(strong), strict=True)))
    n = len(size)
    first = np.searchsorted(row, np.arange(n, dtype=np.int32))
    rank, root = np.random.default_rng(0).permutation(n).astype(np.int32), np.zeros(n, dtype=bool)
    waiting, couples, start = np.arange(n), column, first
    while len(waiting):  # a root comes first around it in a random order, round by round (Luby 1986)
        report()
        root[waiting] = rank[waiting] == np.maximum.reduceat(rank[couples], start)
        done = np.maximum.reduceat(root[couples], start)
        rank[waiting[done]] = -1
        left = np.repeat(~done, np.diff(start, append=len(couples)))
        many = np.diff(start, append=len(couples))[~done]
        waiting, couples, start = waiting[~done], couples[left], np.cumsum(many) - many
    weight = np.where(root[column], weight, 0.0)
    best = np.flatnonzero(weight == np.maximum.reduceat(weight, first)[row])
    chosen = np.empty(n, dtype=np.int32)
    chosen[row[best]] = column[best]
    return (np.cumsum(root, dtype=np.int32) - 1)[chosen], np.flatnonzero(root)


def smoothing_steps(top: float, diagonal: Floats) -> list[Floats]:
    """Return the step lengths of the smoother, two (n,), from the largest eigenvalue over the diagonal."""
    middle, half = 0.5 * top * (1.0 + _SMOOTHED), 0.5 * top * (1.0 - _SMOOTHED) * np.sqrt(0.5)
    return [1.0 / (length * diagonal) for length in (middle - half, middle + half)]


def solve_roughly(levels: list[Level], last: Known, load: Array, shifts: Array, wanted: int) -> Array:
    """Apply an approximate inverse of ``matrix - shift * mass`` by one V-cycle.

    Parameters
    ----------
    levels : list of Level
        From the one that the load is on; none at the last one.
    last : Known
        All eigenpairs of the last version.
    load : ndarray, (n, k)
        In the precision of the levels.
    shifts : ndarray, (k,)
        One for each column. It counts for known eigenvectors only: it is small against the eigenvalues of all others.
    wanted : int
        Lowest eigenvectors for which the shift, which may lie among their eigenvalues, is left out.

    Returns
    -------
    ndarray, (n, k)
    """
    known, solved = levels[0].known if levels else last, None
    if known is not None:
        values = known.values[:, None]
        floor = values[min(wanted, len(values) - 1)]
        shift = shifts * values[wanted - 1]
        distance = np.where(np.arange(len(values))[:, None] < wanted, np.maximum(values, floor), values - shift)
        share = product(known.vectors.T, load)
        solved = product(known.vectors, (share / np.maximum(distance, 0.1 * floor)).astype(load.dtype))
        if not levels:
            return solved
        load = load - product(known.duals, share)
    level = levels[0]
    coarse = solve_roughly(levels[1:], last, level.restriction @ load, shifts, wanted)
    result = smoothed(level, load, level.extension @ coarse, level.steps)  # where no name keeps the first of the steps
    if solved is not None:
        result += solved
    return result


def approximate_inverse(matrix: sparse.csr_array, pool: ThreadPoolExecutor, report: Report) -> LinearOperator | None:
    """Return an approximate inverse that is symmetric, for conjugate gradients; None where coarse versions do not help.

    It is a V-cycle in single precision, of one column or several at once. The matrix is symmetric positive
    semi-definite, with constants about in its null space and no zero on its diagonal. For `pool` and `report` see
    `Rows`.
    """
    levels, last, _ = build_levels(matrix, np.ones(matrix.shape[0]), SMALL, 0, pool, report)
    if not levels or last.shape[0] > LARGE:
        return None
    for level in levels:
        _shorten(level)
    inverse = pinvh(last.toarray())  # constants are its null space where nothing is fixed

    def multiply(load: Floats) -> Floats:
        columns = load.reshape(len(load), -1)
        size = np.linalg.norm(columns, axis=0)  # single precision has no smaller numbers than 1e-38
        size[size == 0.0] = 1.0
        result = _cycle(levels, inverse, (columns / size).astype(np.float32)).astype(np.float64)
        return (size * result).reshape(load.shape)

    return LinearOperator(matrix.shape, matvec=multiply, matmat=multiply, dtype=np.float64)


def _shorten(level: Level) -> None:
    """Shorten the smoother's steps until they amplify no error, which keeps the preconditioner positive definite.

    Two steps amplify none if ``1 / first + 1 / second``, with the diagonal in them, is at least the largest eigenvalue.
    That is estimated and may be too low, so Gershgorin's bound takes its place: the sum of absolute values in a row.
    """
    # A step of length zero amplifies nothing: its bound is infinite.
    steps = np.stack([step[:, 0] for step in level.steps])
    room = np.divide(1.0, steps, out=np.full_like(steps, np.inf), where=steps > 0.0).sum(axis=0)

    def excess(rows: slice, part: sparse.csr_array) -> float:
        return float(np.max(np.add.reduceat(np.abs(part.data), part.indptr[:-1]) / room[rows]))

    share = np.float32(1.0 / max(1.0, *level.strong.each(excess)))
    level.steps = [share * step for step in level.steps]


def _cycle(levels: list[Level], inverse: Floats, load: Array) -> Array:
    """Run a V-cycle, which is symmetric as it smooths as much after the coarse correction as before it."""
    if not levels:
        return (inverse @ load).astype(np.float32)
    level = levels[0]
    result = smoothed(level, load, level.steps[0] * load, level.steps[1:])

    def subtract(rows: slice, values: Array) -> None:
        np.subtract(load[rows], values, out=values)

    rest = level.strong.product(result, subtract)
    result += level.extension @ _cycle(levels[1:], inverse, level.restriction @ rest)
    return smoothed(level, load, result, level.steps)


def smoothed(level: Level, load: Array, result: Array, steps: list[Array]) -> Array:
    """Return an approximate solution after some steps of the smoother: residuals times step lengths.

    The memory of the given one is used.
    """
    spare = None
    for step in steps:

        def improve(rows: slice, values: Array, step: Array = step, before: Array = result) -> None:
            np.subtract(load[rows], values, out=values)
            values *= step[rows]
            values += before[rows]

        result, spare = level.strong.product(result, improve, spare), result
    return result
