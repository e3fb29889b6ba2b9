"""The Laplace-Beltrami operator on a cloud: areas, weights, stiffness, spectrum, solvers and factors."""

from .areas import SOLVERS, AreaSolution, estimate_areas
from .cholesky import factorize
from .connection import connection_laplacian, tangent_frames
from .curvature import PrincipalCurvatures, mean_curvature, principal_curvatures
from .factors import dissect, sparsify
from .hierarchy import Rows
from .implicit import ImplicitSurface
from .laplacian import LaplaceBeltrami, build_laplacian, narrow_laplacian
from .solvers import Iterate, bounded_quadratic, conjugate_gradients, solve_symmetric
from .spectrum import Spectrum, symmetric_form
from .two_grid import TwoGrid
