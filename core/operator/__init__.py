"""The Laplace-Beltrami operator on a cloud: areas, weights, stiffness, spectrum, curvature."""

from .areas import KernelMatrix, estimate_areas, solve_areas
from .connection import connection_laplacian, tangent_frames
from .gradient import divergence_matrix, gradient_matrix
from .graph import NearGraph, coupled_components, followers, mean_spacing, near_graph
from .implicit import Heights, ImplicitSurface
from .laplacian import LaplaceBeltrami, assemble_laplacian, build_laplacian, laplacian_of, narrow_laplacian
from .principal import (
    MeanCurvature,
    PrincipalCurvatures,
    mean_curvature,
    measure_mean_curvature,
    principal_curvatures,
)
from .spectrum import Spectrum, symmetric_form
from .stiffness import Stiffness, stiffness_matrix
