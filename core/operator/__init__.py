"""The Laplace-Beltrami operator on a cloud: areas, weights, stiffness, spectrum, solvers and factors."""

from .areas import SOLVERS, AreaSolution, estimate_areas
from .curvature import mean_curvature
from .factors import dissection_order, factorize, sparsify
from .laplacian import LaplaceBeltrami, build_laplacian, narrow_laplacian
from .solvers import Iterate, bounded_quadratic, conjugate_gradients, solve_symmetric
from .spectrum import Spectrum, symmetric_form

__all__ = [
    "SOLVERS",
    "AreaSolution",
    "Iterate",
    "LaplaceBeltrami",
    "Spectrum",
    "bounded_quadratic",
    "build_laplacian",
    "conjugate_gradients",
    "dissection_order",
    "estimate_areas",
    "factorize",
    "mean_curvature",
    "narrow_laplacian",
    "solve_symmetric",
    "sparsify",
    "symmetric_form",
]
