"""Linear algebra without geometry: blocks of rows, small dense systems, rotations, solvers, factors, eigenpairs."""

from .anderson import Anderson
from .blocks import blocks, by_blocks, on_all_cores, runs, shares, workers
from .chebyshev import (
    chebyshev_coefficients,
    chebyshev_nodes,
    chebyshev_steps,
    chebyshev_sum,
    chebyshev_terms,
    degree_needed,
)
from .cholesky import factorize
from .davidson import coarse_to_fine, needs_double
from .dense import eliminate, inverses, lifted_inverse
from .eigenvalue import largest_eigenvalue
from .factors import dissect, sparsify
from .lanczos import lift_lowest
from .rotations import TRACE, nearest_rotations, rotations_in_groups
from .rows import Rows, matrix_by_rows, multiply_rows
from .solvers import Iterate, bounded_quadratic, conjugate_gradients, multigrid, solve_columns, solve_symmetric
from .two_grid import TwoGrid
