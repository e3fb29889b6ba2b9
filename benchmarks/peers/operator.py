"""The common form of all operators: apply, eigenpairs, and a Poisson solve without fixed points."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigs, eigsh, splu
from scipy.spatial import cKDTree

import core
from core.algebra.solvers import solve_symmetric

_WIDE = 60  # neighbours per point from which factors cost more than Lanczos steps and conjugate gradients
_TOLERANCE = 1e-10  # of the eigenvalue solvers, relative


@dataclass(frozen=True)
class Modes:
    """The lowest eigenpairs of the negated operator.

    Attributes
    ----------
    eigenvalues : ndarray, (count,)
        Ascending; of operators that are not symmetric the real parts.
    eigenvectors : ndarray, (n, count)
        Orthonormal for the mass; of operators that are not symmetric the real parts, of unit length.
    complex, negative : int
        How many of the eigenvalues are not real, and how many have a negative real part.
    """

    eigenvalues: np.ndarray
    eigenvectors: np.ndarray
    complex: int = 0
    negative: int = 0


@dataclass(frozen=True, eq=False, repr=False)
class Operator:
    """A discrete Laplace-Beltrami operator, negative semi-definite: ``-stiffness @ f / mass``.

    Attributes
    ----------
    points : ndarray, (n, 3)
        The caller's [L].
    stiffness : csr_array, (n, n)
        Rows sum to zero.
    mass : ndarray, (n,)
        What the rows of the stiffness are divided by.
    areas : ndarray, (n,), or None
        Area elements [L^2]; None of methods that have none.
    name : str
        The method, a key of `METHODS`.
    seconds : float
        Wall time of the construction.
    """

    points: np.ndarray
    stiffness: sparse.csr_array
    mass: np.ndarray
    areas: np.ndarray | None
    name: str = ""
    seconds: float = np.nan

    symmetric: ClassVar[bool] = True

    def apply(self, values):
        """Return the Laplacian of values (n,), point by point."""
        return -(self.stiffness @ values) / self.mass

    def eigenpairs(self, count):
        """Compute the lowest eigenpairs of ``stiffness phi = lambda mass phi``.

        The fastest way that scipy has for each: shift-invert with a symmetric SuperLU order without pivoting (the
        default order takes far longer), or, where rows are wide, Lanczos steps without factors (at 175 neighbours a
        third of the time of shift-invert).

        Returns
        -------
        Modes
        """
        root = 1.0 / np.sqrt(self.mass)
        scale = sparse.diags_array(root)
        matrix = (scale @ self.stiffness @ scale).tocsr()
        if self.stiffness.nnz > _WIDE * len(root):
            near = cKDTree(self.points).indices  # neighbours near in memory make the products faster
            start = np.random.default_rng(0).standard_normal(len(root))
            ncv = min(len(root), max(2 * count + 1, 40))
            values, found = eigsh(matrix[near][:, near], k=count, which="SA", v0=start, tol=_TOLERANCE, ncv=ncv)
            vectors = np.empty_like(found)
            vectors[near] = found
        else:
            values, vectors = shift_invert(eigsh, matrix, count)
        order = np.argsort(values)
        return Modes(values[order], root[:, None] * vectors[:, order], negative=count_negative(values))

    def eigenvalues(self, count):
        """Return the lowest eigenvalues of the negated operator, (count,)."""
        return self.eigenpairs(count).eigenvalues

    def solve_poisson(self, source):
        """Solve ``-L u = source`` on a closed, connected surface; both are taken without their mean for the mass."""
        load = self.mass * source
        load = load - self.mass * (load.sum() / self.mass.sum())
        if self.stiffness.nnz > _WIDE * len(load):
            solution = solve_symmetric(self.stiffness, load)
        else:
            solution = np.append(0.0, factors(self.stiffness[1:, 1:]).solve(load[1:]))  # any level serves
        return solution - self.mass @ solution / self.mass.sum()


@dataclass(frozen=True, eq=False, repr=False)
class Unsymmetric(Operator):
    """An operator of rows that were fitted one by one: no areas, mass one."""

    symmetric: ClassVar[bool] = False

    def eigenpairs(self, count):
        """Compute the eigenpairs nearest to zero, some of which may be complex; the real parts are given."""
        values, vectors = shift_invert(eigs, self.stiffness.tocsc(), count)
        order = np.argsort(values.real)
        values, vectors = values[order], vectors[:, order].real
        return Modes(
            values.real,
            vectors / np.linalg.norm(vectors, axis=0),
            int(np.count_nonzero(np.abs(values.imag) > 1e-6 * np.abs(values).max())),
            count_negative(values.real),
        )

    def solve_poisson(self, source):
        """Solve ``-L u = source - c`` with the constant c that makes it solvable; u has the mean zero over the points.

        The null space of the transposed matrix, which the source would have to be free of, is not known beforehand.
        """
        solve = factors(self.stiffness[1:, 1:]).solve
        first = self.stiffness[[0], 1:]
        found, lift = solve(source[1:]), solve(np.ones(len(source) - 1))
        level = (source[0] - first @ found) / (1.0 - first @ lift)
        solution = np.append(0.0, found - level * lift)
        return solution - solution.mean()


@dataclass(frozen=True, eq=False, repr=False)
class Ours(Operator):
    """The product's operator: symbol-corrected where its options say so."""

    laplacian: core.LaplaceBeltrami = None

    def apply(self, values):
        """Return the Laplacian of values (n,), point by point."""
        return self.laplacian.apply(values)

    def eigenpairs(self, count):
        """Compute the lowest eigenpairs."""
        spectrum = self.laplacian.eigenpairs(count)
        return Modes(spectrum.eigenvalues, spectrum.eigenvectors)

    def solve_poisson(self, source):
        """Solve ``-L u = source``, both without their mean."""
        return core.distance.solve_poisson(self.laplacian, source - self.areas @ source / self.areas.sum())


def factors(matrix):
    """Factorise in an order for symmetric patterns, without pivoting."""
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def shift_invert(solver, matrix, count):
    """Return the eigenpairs nearest to zero, from factors of the matrix plus a small multiple of the identity."""
    n = matrix.shape[0]
    shift = 1e-5 * np.median(matrix.diagonal())  # of the size of the first eigenvalue on some 10,000 points
    solve = factors(matrix + shift * sparse.eye_array(n)).solve
    inverse = LinearOperator((n, n), matvec=solve, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(n)
    return solver(matrix, k=count, sigma=-shift, OPinv=inverse, v0=start, tol=_TOLERANCE)


def count_negative(values):
    """Count the values below zero by more than rounding."""
    return int(np.count_nonzero(values < -1e-7 * np.abs(values).max()))
