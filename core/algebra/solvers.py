"""Conjugate gradients: for symmetric equations, and for symmetric quadratics with lower bounds."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator

from ..errors import SolverError
from ..types import Array, Floats, Progress
from .blocks import workers
from .hierarchy import approximate_inverse
from .rows import Rows, part_size

_STEPS = 20_000  # of `solve_symmetric`, at most
_FEW = 20_000  # unknowns up to which multigrid, whose set-up costs 120 to 150 steps, does not pay
_PLAIN = 30  # steps before multigrid is set up: enough where fixed points lie everywhere


@dataclass(frozen=True)
class Iterate:
    """Where conjugate gradients ended."""

    values: Array  # (m,)
    products: int  # products with the matrix
    converged: bool  # the residual fell to the tolerance
    residual: float  # its size over that of the load, or of the residual of the first guess where that is larger
    # No direction was found along which the matrix is not positive; with one the values are those before it
    definite: bool = True


def conjugate_gradients(
    matrix: Any,
    load: Array,
    start: Array | None = None,
    scaling: Any = 1.0,
    rtol: float = 1e-9,
    products: int = _STEPS,
    report: Callable[[int, float], None] = lambda step, left: None,
) -> Iterate:
    """Solve ``matrix @ x = load``, of several loads each by itself.

    Parameters
    ----------
    matrix : sparse array or LinearOperator, (m, m)
        Symmetric. A complex one is symmetric too, not Hermitian: products of vectors are taken without conjugation
        (COCG; van der Vorst and Melissen 1990), which for real ones is the usual method.
    load : ndarray, (m,) or (m, k)
        In the range of the matrix.
    start : ndarray of that shape, optional
        First guess.
    scaling : float, ndarray, (m,) or (m, 1), or LinearOperator, (m, m)
        Preconditioner, such as the inverse of the diagonal.
    rtol : float
        Of the residual against the load, or against that of the first guess where it is larger.
    products : int
        Most products with the matrix.
    report : callable
        Called with the number of each step and the residual; may raise `Cancelled`.

    Returns
    -------
    Iterate
        Of several loads the greatest residual. Whether the matrix is definite is not judged.
    """
    single = load.ndim == 1
    product: Callable[[Array, Array], Any] = partial(np.einsum, "i,i" if single else "ij,ij->j")

    def size(vectors: Array) -> Any:
        return np.sqrt(product(vectors, vectors.conj()).real)

    values = np.zeros_like(load) if start is None else start.copy()
    residual = load.copy() if start is None else load - matrix @ values
    unit = np.maximum(size(load), size(residual))
    unit += unit == 0.0
    direction: Any = None
    moment: Any = None
    for step in range(products):
        left = float(np.max(size(residual) / unit, initial=0.0))
        if left <= rtol:
            return Iterate(values, step, True, left)
        report(step, left)
        scaled = scaling * residual
        moment, previous = product(residual, scaled), moment
        direction = scaled if step == 0 else scaled + _ratio(moment, previous) * direction
        image = matrix @ direction
        curvature = product(direction, image)
        if single and np.isrealobj(curvature) and curvature <= 0.0:
            return Iterate(values, step + 1, False, left, definite=False)
        length = _ratio(moment, curvature)
        values += length * direction
        residual -= length * image
    left = float(np.max(size(residual) / unit, initial=0.0))
    return Iterate(values, products, left <= rtol, left)


@contextmanager
def multigrid(matrix: sparse.csr_array) -> Iterator[LinearOperator | None]:
    """Take an approximate inverse of a positive semi-definite matrix, (m, m), for solutions within this context.

    None where unknowns are so few that the diagonal alone is faster, or where coarse versions do not help.
    """
    with workers() as pool:
        yield approximate_inverse(matrix, pool, lambda: None) if matrix.shape[0] >= _FEW else None


def solve_symmetric(
    matrix: sparse.csr_array, load: Floats, start: Floats | None = None, progress: Progress | None = None
) -> Floats:
    """Solve positive semi-definite equations to nine digits.

    Conjugate gradients, preconditioned by the diagonal first, whose steps grow with the root of the number of points,
    and where this takes long by multigrid, with which about ten steps are enough for any number.

    Parameters
    ----------
    matrix : csr_array, (m, m)
        Symmetric positive semi-definite, constants about in its null space. No diagonal entry is zero.
    load : ndarray, (m,) or (m, k)
        In the range of the matrix.
    start : ndarray, (m,) or (m, k), optional
        First guess.
    progress : callable, optional
        Called as ``progress("Solve", fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (m,) or (m, k)

    Raises
    ------
    SolverError
        No convergence.
    """
    done = 0.0

    def count(products: float) -> None:
        nonlocal done
        if progress is not None:
            progress("Solve", done / (done + 200.0))
        done += products

    def report(step: int, left: float) -> None:
        if step % 20 == 0:
            count(20.0)

    part = min(1.0, part_size(matrix.nnz) / max(matrix.nnz, 1))  # of a product, after which there is a report
    columns = np.atleast_2d(load.T)
    values = np.zeros_like(columns) if start is None else np.atleast_2d(start.T).copy()
    scaling, products = 1.0 / matrix.diagonal(), _STEPS if len(load) < _FEW else _PLAIN
    with workers() as pool:
        for number, column in enumerate(columns):
            # Squares of loads in tiny or huge units would underflow or overflow; a power of two rounds nothing.
            unit = np.ldexp(1.0, np.frexp(np.abs(column).max(initial=0.0))[1])
            column, values[number] = column / unit, values[number] / unit
            found = conjugate_gradients(matrix, column, values[number], scaling, products=products, report=report)
            if products == _PLAIN and found.definite and not found.converged:
                scaling = approximate_inverse(matrix, pool, lambda: count(part)) or scaling
                products = _STEPS
                found = conjugate_gradients(matrix, column, found.values, scaling, products=products, report=report)
            if not found.converged:
                raise SolverError(
                    f"The equations of {len(load)} points were not solved in {found.products} steps: a share of"
                    f" {found.residual:.1g} is left. Fix more points, or widen the kernel."
                )
            values[number] = found.values * unit
    return values.T.reshape(load.shape)


def solve_columns(matrix: sparse.csr_array, loads: Floats, rtol: float, report: Callable[[float], None]) -> Floats:
    """Solve positive definite equations for many right-hand sides, (m, k), at once, by conjugate gradients of each.

    The residual of each column falls to a share `rtol` of its load, or `SolverError` is raised. `report` is called with
    the share of the work that is done; it may raise `Cancelled`.
    """
    with workers() as pool:
        rows = Rows(matrix, pool, lambda: report(0.0))
        inverse = approximate_inverse(matrix, pool, lambda: report(0.0))
        found = conjugate_gradients(
            rows,
            loads,
            scaling=inverse or 1.0 / matrix.diagonal()[:, None],
            rtol=rtol,
            report=lambda step, left: report(min(np.log(left) / np.log(rtol), 1.0) if left < 1.0 else 0.0),
        )
    if not found.converged:
        raise SolverError(f"{len(loads)} equations were not solved: a share of {found.residual:.1g} is left.")
    return found.values


def _ratio(numbers: Any, others: Any) -> Any:
    """Return quotients; zero where both are zero, as in columns that are solved."""
    return np.divide(numbers, others, out=np.zeros_like(numbers), where=others != 0.0)


def bounded_quadratic(
    product: Callable[[Floats], Floats],
    right: Floats,
    lower: Floats,
    start: Floats,
    norm: float,
    products: int,
    rtol: float,
) -> tuple[Floats, int, float]:
    """Minimise ``x.Hx / 2 - x.right`` over x >= lower by proportioned conjugate gradients.

    Conjugate gradients on the free unknowns, a projected step where one meets its bound, and a release of held ones
    when their gradient outweighs that of the free (MPRGP; Dostal and Schoeberl 2005).

    Parameters
    ----------
    product : callable
        x -> H x, H symmetric positive definite.
    right, lower, start : ndarray, (n,)
        Right-hand side, bounds, feasible start.
    norm : float
        Upper bound of the largest eigenvalue of H.
    products : int
        Most products with H.
    rtol : float
        Tolerance on the projected gradient, relative to the right-hand side.

    Returns
    -------
    x : ndarray, (n,)
    used : int
        Products spent.
    residual : float
        The projected gradient over the right-hand side.
    """
    step = 1.9 / norm
    x = start.copy()
    gradient = product(x) - right
    used, exact = 1, True
    unit = np.linalg.norm(right)

    def split(gradient: Floats, x: Floats) -> tuple[Floats, Floats]:
        held = x <= lower
        return np.where(held, 0.0, gradient), np.where(held, np.minimum(gradient, 0.0), 0.0)

    free, chopped = split(gradient, x)
    direction = free
    while used < products:
        if np.sqrt(free @ free + chopped @ chopped) <= rtol * unit:
            if exact:
                break
            gradient, exact = product(x) - right, True  # updates step by step have lost digits
            used += 1
            free, chopped = split(gradient, x)
            direction = free
            continue
        exact = False
        reduced = np.minimum(free, (x - lower) / step)
        if chopped @ chopped <= reduced @ free:
            image = product(direction)
            used += 1
            curvature = direction @ image
            length = (gradient @ direction) / curvature
            falling = direction > 0.0
            room = np.min((x[falling] - lower[falling]) / direction[falling], initial=np.inf)
            if length <= room:
                x = np.maximum(x - length * direction, lower)
                gradient = gradient - length * image
                free, chopped = split(gradient, x)
                direction = free - ((free @ image) / curvature) * direction
                continue
            half = x - room * direction
            free = split(gradient - room * image, half)[0]
            x = np.maximum(half - step * free, lower)
            gradient = product(x) - right
            used += 1
        else:
            image = product(chopped)
            used += 1
            length = (gradient @ chopped) / (chopped @ image)
            x = x - length * chopped
            gradient = gradient - length * image
        free, chopped = split(gradient, x)
        direction = free
    return x, used, float(np.sqrt(free @ free + chopped @ chopped) / unit)
