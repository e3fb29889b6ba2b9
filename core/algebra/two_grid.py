"""Equations on tangent vectors, solved as exactly where the solution is faint as where it is strong."""

from functools import partial

import numpy as np
from scipy import sparse

from ..errors import SolverError
from ..types import Array, Bools, Floats, Progress
from .blocks import workers
from .cholesky import factorize
from .eigenvalue import rough_largest_eigenvalue
from .factors import dissect
from .hierarchy import STRONG, aggregates, smoothing_steps
from .rows import Rows

_FAINT = 1e-200  # relative to the largest value: the convergence of smaller ones is not checked
_ACCURACY = 1e-3  # largest change in the last step, relative to the value of each point
_STEPS = 100


class TwoGrid:
    """Solves a step of heat flow by the connection Laplacian: by smoothing, and by a coarse version that is factored.

    Heat falls off by many powers of ten, and its direction is wanted where it is faintest, too. Conjugate gradients
    reduce the sum of all errors, in which these do not count. A coarse version that is solved directly falls off nearly
    as the fine one does, so that each step reduces the error relative to the value of each point.

    The coarse unknowns are aggregates of a few tens of points, each with the direction of its root, rotated as the
    matrix rotates it from there to the others, and smoothed once (Vanek, Mandel and Brezina 1996).

    The matrix, a mass, (n,), and the connection Laplacian by a factor, is Hermitian; if it is not positive definite,
    `SolverError` is raised. Unknowns are at `points`, (n, 3). `report` may raise `Cancelled`.
    """

    def __init__(self, matrix: sparse.csr_array, mass: Floats, points: Floats, report: Progress) -> None:
        self._matrix, diagonal = matrix, matrix.diagonal().real
        count = len(mass)
        with workers() as pool:

            def rows(values: sparse.csr_array, fraction: float) -> Rows:
                return Rows(values, pool, lambda: report("Equations", fraction))

            weights = sparse.csr_array((-np.abs(matrix.data), matrix.indices, matrix.indptr), shape=matrix.shape)
            part, roots = aggregates(rows(weights, 0.3), diagonal, STRONG[0], lambda: report("Equations", 0.3))
            fine = rows(matrix, 0.4)
            top = rough_largest_eigenvalue(fine, diagonal)
            # The rotation from the root is that of the entry which couples both.
            root = roots[part]
            rotation = -matrix.data[matrix.indices == np.repeat(root, np.diff(matrix.indptr))]
            rotation[roots] = 1.0
            plain = sparse.csr_array(
                (rotation / np.abs(rotation), part, np.arange(count + 1)), shape=(count, len(roots))
            )
            # Without the mass: a point that is coupled with no other keeps its value.
            change = fine @ plain - sparse.diags_array(mass) @ plain
            self._prolongation = (plain - sparse.diags_array(4.0 / 3.0 / top / diagonal) @ change).tocsr()
            self._restriction = self._prolongation.conj().T.tocsr()
            coarse = rows(self._restriction, 0.6) @ (rows(matrix, 0.5) @ self._prolongation)
        self._steps = smoothing_steps(top, diagonal)
        self._order, starts = dissect(coarse, points[roots], lambda: report("Equations", 0.7))
        coarse = coarse[self._order][:, self._order]
        # Complex numbers as pairs of real ones.
        real = sparse.kron(coarse.real, np.eye(2)) + sparse.kron(coarse.imag, [[0.0, -1.0], [1.0, 0.0]])
        self._factors = factorize(real.tocsr(), 2 * starts, lambda share: report("Factors", 0.8 + 0.2 * share))

    def solve(self, load: Array, joined: Bools, report: Progress) -> Array:
        """Solve for a complex load, (n,), until no value changes by more than a thousandth of itself.

        Values are compared with the largest one among the unknowns that belong to the same surface, (n,) bool; they are
        zero on components without load. Without convergence `SolverError` is raised; `report` may raise `Cancelled`.
        """
        result = self._coarse(load)
        with workers() as pool:
            for step in range(_STEPS):
                matrix = Rows(self._matrix, pool, partial(report, "Directions", step / (step + 10.0)))
                before = result
                if step:
                    result = before + self._coarse(load - _product(matrix, before))
                for length in self._steps:
                    result = result + length * (load - _product(matrix, result))
                size = np.abs(result)
                seen = size > _FAINT * np.max(size, where=joined, initial=0.0)
                if np.all(np.abs(result - before)[seen] < _ACCURACY * size[seen]):
                    return result
        raise SolverError(
            f"Directions were not found in {_STEPS} steps of refinement. The points may be too uneven: analyze fewer"
            " of them, or clean them."
        )

    def _coarse(self, load: Array) -> Array:
        """Solve the coarse version for a load."""
        right = self._restriction @ load
        values = np.empty_like(right)
        values[self._order] = self._factors(right[self._order].view(float)).view(complex)
        return self._prolongation @ values


def _product(matrix: Rows, values: Array) -> Array:
    return (matrix @ values[:, None])[:, 0]
