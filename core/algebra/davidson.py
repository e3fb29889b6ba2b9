"""Few eigenpairs of many unknowns: on coarse versions of the matrix first, then by Davidson's method in a block."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.csgraph import connected_components

from ..types import Array, Floats, Ints
from .blocks import blocks, by_blocks, on_all_cores, shares, workers
from .chebyshev import chebyshev_steps
from .dense import multiply, product, subtract_product
from .hierarchy import LARGE, ROUNDING, SMALL, Known, Level, build_levels, smoothed, solve_roughly

_DENSE = 4000  # in ten seconds; where the coarsest version has more, another solver is faster
_BEYOND = 0.1  # relative margin above the last eigenvalue wanted, up to which the block holds eigenvectors
_GUARDS = 4  # further vectors in the block, at least: the last ones of a block converge slowly
_WIDE = 32  # multiplicity of the last eigenvalue up to which the block holds its whole eigenspace
_RANDOM = 4  # random start vectors, which converge to the eigenvectors that the coarse levels miss
_FILTERED = 3  # V-cycles applied to these first, which damp their high-frequency components
_GUARDED = 0.1  # residual to which the vectors beyond those wanted converge, so that none below is missed
_COARSE = 1e-2  # residual on coarse levels: a smaller one would not improve the start on the next level
_CYCLES = 4  # V-cycles in a Davidson step, at most
_FALL = 3.5  # factor by which a V-cycle reduces the residual, about
_CYCLED = 0.4, 1.2  # eigenvalues of the matrix times a V-cycle, nearly all: the smoother overshoots by .17
_STEPS, _COARSE_STEPS = 48, 8  # at most; two to six are usual on the points, two on coarse levels
_COLUMNS = 40  # in a V-cycle at one time, at least: with 20, products take a quarter more time; with 72, an eighth less
_ENTRIES = 1 << 24  # of these columns, up to which there may be more: of 200,000 points all of 50 modes
_BLOCK = 1 << 11  # rows of vectors worked on at one time
_PART = 1 << 18  # entries of vectors that are scaled and added at one time
_PATIENCE = 12  # steps after which the block of vectors is widened, where it stalls
_STALLED = 4  # steps in which residuals fall to no half


def coarse_to_fine(
    matrix: sparse.csr_array,
    slowest: Floats,
    count: int,
    tolerance: float,
    scale: float,
    report: Callable[..., None],
) -> tuple[Floats, Floats] | None:
    """Return the lowest eigenpairs, or None where coarse versions do not help.

    Parameters
    ----------
    matrix : csr_array, (n, n)
        Symmetric positive semi-definite.
    slowest : ndarray, (n,)
        A positive vector near the null space: its product with the matrix is about zero.
    count : int
    tolerance : float
        Largest residual, over the last eigenvalue wanted.
    scale : float
        Estimate of that eigenvalue, by which residuals are divided where it is larger, and by which the precision of
        V-cycles is chosen; 0 where there is none, and the precision single.
    report : callable
        Called with the fraction done; may raise `Cancelled`.

    Returns
    -------
    values, vectors : ndarray, (count,) and (n, count), or None
        Ascending, orthonormal.
    """
    highest = matrix.diagonal().max()
    precision = np.dtype(np.float64 if needs_double(highest, scale) else np.float32)
    with workers() as pool:
        least = max(SMALL, min(20 * count, LARGE), 5 * count)
        levels, last, mass = build_levels(matrix, slowest, least, 3 * count, pool, report, scale, precision)
        if not levels or last.shape[0] > max(least, _DENSE):
            return None
        values, vectors = eigh(last.toarray(), mass.toarray())
        coarsest = _known(values, vectors, mass @ vectors, precision)
        flat = np.searchsorted(values, 1e-9 * values[-1])  # dimension of the null space: one for each component
        for number in reversed(range(len(levels))):
            level, finest = levels[number], number == 0
            beyond = np.searchsorted(values, (1.0 + _BEYOND) * values[min(count, len(values)) - 1])
            size = min(max(min(max(beyond, count), 2 * count + _WIDE), flat) + _GUARDS, len(values))
            vectors = level.extension @ vectors[:, : size if finest else 2 * size].astype(precision)
            vectors = smoothed(level, np.zeros((len(vectors), 1), dtype=precision), vectors, level.steps)
            guards = _random(len(vectors), max(_RANDOM, count + _RANDOM - vectors.shape[1])).astype(precision)
            for _ in range(_FILTERED):
                guards = solve_roughly(levels[number:], coarsest, guards, np.zeros(guards.shape[1], precision), size)
                _normalize(guards)
            exact = _null_vectors(matrix, slowest, ROUNDING * highest)[:, :flat] if finest else vectors[:, :0]
            vectors = _beside(exact, vectors[:, exact.shape[1] :], guards)
            wanted, goal, limit = (count, tolerance, _STEPS) if finest else (size, _COARSE, _COARSE_STEPS)
            values, vectors, right = refine(
                levels[number:], coarsest, vectors, size, wanted, goal, scale, limit, report, finest
            )
            if not finest:
                level.known = _known(values, vectors, level.weighed(vectors), precision)
    return (values[:count], vectors[:, :count]) if right else None


def needs_double(highest: float, scale: float) -> bool:
    """Tell whether single precision is too low for V-cycles, by the largest diagonal entry; see `coarse_to_fine`."""
    rounding = np.finfo(np.float32).eps * highest  # below which no residual falls in it
    return bool(rounding > 0.5 * _GUARDED * scale > 0.0)


def _known(values: Floats, vectors: Floats, duals: Floats, precision: Any) -> Known:
    return Known(values, vectors.astype(precision), duals.astype(precision))


def refine(
    levels: list[Level],
    coarsest: Known,
    vectors: Floats,
    size: int,
    wanted: int,
    tolerance: float,
    scale: float,
    limit: int,
    report: Callable[..., None],
    final: bool,
) -> tuple[Floats, Floats, bool]:
    """Improve approximate eigenvectors by Davidson's method in a block.

    Parameters
    ----------
    levels : list of Level
        The eigenvectors of the first are sought.
    coarsest : Known
        All eigenpairs of the version after the last level.
    vectors : ndarray, (n, m)
        Approximate ones, and random ones, which converge to those that are missing; overwritten.
    size : int
        How many the coarse versions gave.
    wanted : int
        How many residuals are to fall to the tolerance; the others to a larger one, up to `_GUARDED`.
    tolerance, scale : float
        See `coarse_to_fine`.
    limit : int
        Most steps.
    report : callable
        Called with the fraction done; may raise `Cancelled`.
    final : bool
        Report fractions: this is the last level.

    Returns
    -------
    values, vectors : ndarray, (m,) and (n, m)
        The best after these steps.
    right : bool
        All residuals reached their goals, those beyond the wanted ones in their own norm or in that of the inverse.
    """
    level, count, worst = levels[0], vectors.shape[1], 0.0
    history: list[float] = []  # of the residual over its goal, at the worst
    drift = np.inf  # bound on the rounding error of `residual`, updated step by step; 0 for an exact product
    for step in range(limit + 1):
        stalls = len(history) > _STALLED and history[-1] > max(1.0, 0.5 * history[-1 - _STALLED])
        if final and step % _PATIENCE == _PATIENCE - 1 and stalls:
            # The block may cut an eigenspace in two. Widen it.
            vectors = np.column_stack([vectors, _random(len(vectors), _RANDOM + count // 8, step)])
            drift, count = np.inf, vectors.shape[1]
        while True:
            if drift == np.inf:
                drift, (values, dual, residual, norms) = 0.0, _exactly(level, vectors)
            report()
            measure = max(values[wanted - 1], scale)
            residuals = norms / measure
            goals = _goals(values / measure, wanted, tolerance)
            excess = float(np.max(residuals / goals))
            active = np.flatnonzero(residuals > 0.5 * goals)
            right = excess + drift / tolerance <= 1.0
            if drift == 0.0 or right or (excess > 1.0 and drift <= 0.1 * residuals[active].min()):
                break
            drift = np.inf  # it may be no smaller than what is left: again with an exact product
        history.append(excess)
        if final:
            worst = worst or 10.0 * excess
            report(1.0 - max(np.log(10.0 * excess), 0.1) / np.log(10.0 * worst) if 1.0 < excess < worst else 0.0)
        if right or step == limit:
            break
        # The rest is in the precision of V-cycles: corrections of a few digits suffice.
        cycles = max(np.ceil(np.log(excess) / np.log(_FALL)), 1.0)  # spread evenly over the fewest steps
        cycles = int(np.ceil(cycles / np.ceil(cycles / _CYCLES)))
        change, lengths = _corrections(levels, coarsest, vectors, dual, residual, values, active, size, cycles)
        coupling = product(residual.T, change)
        report()
        # Some eigenvalue is as near to each value as the residual in the norm of the inverse, times its square root.
        # What is of high frequency counts for little in that: it is enough for the last of a block, which fall slowly.
        energy = values[wanted - 1] * norms[active] * lengths * np.abs(coupling[active, np.arange(len(active))])
        others = active >= wanted
        right = bool(np.all(np.sqrt(energy[others]) <= goals[active[others]] * measure))
        right &= bool(np.all(residuals[:wanted] + drift <= tolerance))
        if right:
            break
        # Rayleigh-Ritz on the vectors and an orthonormal basis of their corrections.
        weighed = level.weighed(change)
        lengths, basis = eigh(product(change.T, weighed).astype(np.float64))
        kept = lengths > 1e-5 * lengths[-1]  # the others are rounding error
        basis = basis[:, kept] / np.sqrt(lengths[kept])
        coupling = coupling @ basis
        changed = level.matrix @ change
        own = basis.T @ product(change.T, changed) @ basis
        ritz, parts = eigh(np.block([[np.diag(values), coupling], [coupling.T, own]]))
        ritz, parts, share = ritz[:count], parts[:count, :count], basis @ parts[count:, :count]
        share = share.astype(level.precision)
        report()
        norms = _renew(vectors, dual, residual, (values, ritz), parts, (change, weighed, changed), share)
        values = ritz
        del change, weighed, changed
        lost = np.linalg.norm(share[:, :wanted], axis=0).max()
        drift += np.finfo(level.precision).eps * level.top * lost / measure
    return values, vectors, right


def _exactly(level: Level, vectors: Floats) -> tuple[Floats, Any, Array, Floats]:
    """Turn vectors to the best of their span, in place, by products in double precision.

    Return their values, their products with the mass, and their residuals, in the precision of V-cycles, with lengths.
    """
    image = level.matrix @ vectors
    values, basis = eigh(product(vectors.T, image), product(vectors.T, level.weighed(vectors)))
    _turn(vectors, basis)
    _turn(image, basis)
    dual = level.weighed(vectors)
    return values, dual, *_residual(image, dual, values, level.precision)


def _goals(values: Floats, wanted: int, tolerance: float) -> Floats:
    """Return the residuals that vectors of ascending values, (m,), in its units, are to fall to, (m,).

    Vectors just beyond the wanted ones must converge, too, or these stall, or a lower eigenvalue is missed. There is
    one as near to each value as its residual: for those far beyond half the way to the wanted is enough.
    """
    last = values[wanted - 1]
    if last <= tolerance:  # none is lower than zero, as of many components
        return np.where(np.arange(len(values)) < wanted, tolerance, np.inf)
    ahead = np.maximum(values / last - 1.0, 0.0)
    most = np.maximum(last * np.maximum(_GUARDED, 0.5 * ahead), tolerance)
    return tolerance * (most / tolerance) ** np.minimum(ahead / (0.5 * _BEYOND), 1.0)


def _corrections(
    levels: list[Level],
    coarsest: Known,
    vectors: Floats,
    dual: Floats,
    residual: Array,
    values: Floats,
    active: Ints,
    size: int,
    cycles: int,
) -> tuple[Array, Floats]:
    """Return corrections of the active vectors by V-cycles, accelerated, of length one and orthogonal to all vectors.

    Return as well by what they were divided: those of residuals of length one.
    They are computed for some of them at a time, as a V-cycle takes several times their memory.
    """
    level, result = levels[0], np.empty((len(vectors), len(active)), dtype=residual.dtype)
    turns = -(-len(active) // max(_COLUMNS, _ENTRIES // len(vectors)))
    for part in shares(len(active), turns):
        load, shifts = _columns(residual, active[part]), values[active[part]].astype(residual.dtype)
        _normalize(load)
        relative = shifts / residual.dtype.type(values[size - 1])
        rates, change = chebyshev_steps(*_CYCLED), None
        for left in reversed(range(cycles)):
            cycle = solve_roughly(levels, coarsest, load, relative, size)
            subtract_product(cycle, vectors, product(dual.T, cycle))
            change = _advance(change, cycle, *next(rates), result[:, part])
            if left:
                load = _rest(level, load, change, shifts)
    return result, _normalize(result)


def _advance(change: Array | None, cycle: Array, kept: float, rate: float, result: Array) -> Array:
    """Return ``kept * change + rate * cycle``, in the memory of the cycle, and add it to the result."""

    def advance(rows: slice) -> None:
        cycle[rows] *= rate
        if change is None:
            result[rows] = cycle[rows]
        else:
            change[rows] *= kept
            cycle[rows] += change[rows]
            result[rows] += cycle[rows]

    on_all_cores(advance, _few_parts(cycle))
    return cycle


def _columns(vectors: Array, columns: Ints) -> Array:
    """Return some columns, (k,), of vectors, contiguous."""
    return by_blocks(lambda rows: np.take(vectors[rows], columns, axis=1), len(vectors))


def _beside(*vectors: Array) -> Floats:
    """Return the columns of all in double precision."""
    return by_blocks(
        lambda rows: np.concatenate([some[rows] for some in vectors], axis=1, dtype=np.float64), len(vectors[0])
    )


def _null_vectors(matrix: sparse.csr_array, slowest: Floats, rounding: float) -> Floats:
    """Return the slowest vector on each component where the matrix takes it to no more than rounding, (n, k).

    They have length one.
    Of some components the coarse versions, in single precision, give them with errors that take steps to remove.
    """
    part = connected_components(matrix, connection="strong")[1]  # which takes a third of the time of weak ones
    length = np.sqrt(np.bincount(part, slowest**2))
    missed = np.sqrt(np.bincount(part, (matrix @ slowest) ** 2))
    null = missed <= rounding * length
    column = np.cumsum(null) - 1
    rows = np.flatnonzero(null[part])
    result = np.zeros((len(part), np.count_nonzero(null)))
    result[rows, column[part[rows]]] = slowest[rows] / length[part[rows]]
    return result


def _turn(vectors: Floats, basis: Floats) -> None:
    """Compute ``vectors @ basis`` in place."""

    def turn(rows: slice) -> None:
        vectors[rows] = multiply(vectors[rows], basis)

    on_all_cores(turn, blocks(len(vectors), _BLOCK))


def _residual(image: Floats, dual: Floats, values: Floats, precision: Any) -> tuple[Array, Floats]:
    """Return ``image - dual * values`` in some precision, and the lengths of its columns, never zero."""
    result = np.empty(image.shape, dtype=precision)

    def subtract(rows: slice) -> Floats:
        missed = image[rows] - dual[rows] * values
        result[rows] = missed
        return np.einsum("ij,ij->j", missed, missed)

    return result, _roots(on_all_cores(subtract, blocks(len(image), _BLOCK)))


def _renew(
    vectors: Floats,
    dual: Floats,
    residual: Array,
    values: tuple[Floats, Floats],
    parts: Floats,
    added: tuple[Array, Array, Array],
    share: Array,
) -> Floats:
    """Turn vectors to ``vectors @ parts + change @ share``, with their products and residuals, all in place.

    Values are those before and after; the change is added with its products with the mass and with the matrix. Return
    the lengths of the residuals, never zero.
    """
    change, weighed, changed = added
    before, after = values

    def renew(rows: slice) -> Floats:
        image = multiply(dual[rows] * before + residual[rows], parts) + multiply(changed[rows], share)
        if dual is not vectors:
            dual[rows] = multiply(dual[rows], parts) + multiply(weighed[rows], share)
        vectors[rows] = multiply(vectors[rows], parts) + multiply(change[rows], share)
        image -= dual[rows] * after
        residual[rows] = image
        return np.einsum("ij,ij->j", image, image)

    return _roots(on_all_cores(renew, blocks(len(vectors), _BLOCK)))


def _rest(level: Level, load: Array, change: Array, shifts: Array) -> Array:
    """Return ``load - (matrix - shifts * mass) change`` in its precision, in the memory of the load."""
    weighed = level.weighed(change)

    def subtract(rows: slice, values: Array) -> None:
        np.subtract(load[rows], values, out=values)
        values += weighed[rows] * shifts

    return level.matrix.product(change, subtract, load)


def _normalize(vectors: Array) -> Floats:
    """Divide columns by their lengths, in place, and return these; one of zeros stays so."""
    parts = _few_parts(vectors)
    lengths = _roots(on_all_cores(lambda rows: np.einsum("ij,ij->j", vectors[rows], vectors[rows]), parts))
    on_all_cores(lambda rows: np.divide(vectors[rows], lengths, out=vectors[rows]), parts)
    return lengths


def _few_parts(vectors: Array) -> list[slice]:
    """Divide the rows of vectors into parts, of which fewer entries would not be worth another thread."""
    return blocks(len(vectors), max(1, _PART // vectors.shape[1]))


def _roots(squares: list[Array]) -> Array:
    """Return lengths, never zero, by the sums of squares of parts."""
    return np.sqrt(np.maximum(sum(squares), np.finfo(np.float32).tiny))


def _random(count: int, columns: int, seed: int = 0) -> Floats:
    """Return random columns, about orthonormal."""
    return np.random.default_rng(seed).standard_normal((count, columns)) / np.sqrt(count)
