"""Mesh-free discrete Laplace-Beltrami operator on point clouds: numpy and scipy only, usable without Blender."""

from .areas import estimate_areas
from .cloud import estimate_normals
from .curvature import mean_curvature
from .deformation import Deformer
from .descriptors import heat_kernel_signature, signature_energies, signature_times, wave_kernel_signature
from .errors import (
    AreaError,
    Cancelled,
    InvalidPointsError,
    IslandError,
    NotASurfaceError,
    PointCloudError,
    SolverError,
    TooFewPointsError,
    UnresolvedModesError,
)
from .fields import harmonic_field, solve_poisson
from .filters import band, boost, chebyshev_filter, exponential, fairing, spectral_filter
from .geodesics import geodesic_distance
from .laplacian import LaplaceBeltrami, build_laplacian
from .minimal_surface import MinimalSurface, minimal_surface
from .options import LaplacianOptions
from .points import check_points
from .segmentation import modes_needed, nodal_domains, segment
from .selection import grow
from .smoothing import PointBlend, displace_by_mode, fair_points, smooth_points, smoothing_base
from .spectrum import Spectrum
from .stability import Stability, check_stability

__all__ = [
    "AreaError",
    "Cancelled",
    "Deformer",
    "InvalidPointsError",
    "IslandError",
    "LaplaceBeltrami",
    "LaplacianOptions",
    "MinimalSurface",
    "NotASurfaceError",
    "PointBlend",
    "PointCloudError",
    "SolverError",
    "Spectrum",
    "Stability",
    "TooFewPointsError",
    "UnresolvedModesError",
    "band",
    "boost",
    "build_laplacian",
    "chebyshev_filter",
    "check_points",
    "check_stability",
    "displace_by_mode",
    "estimate_areas",
    "estimate_normals",
    "exponential",
    "fair_points",
    "fairing",
    "geodesic_distance",
    "grow",
    "harmonic_field",
    "heat_kernel_signature",
    "mean_curvature",
    "minimal_surface",
    "modes_needed",
    "nodal_domains",
    "segment",
    "signature_energies",
    "signature_times",
    "smooth_points",
    "smoothing_base",
    "solve_poisson",
    "spectral_filter",
    "wave_kernel_signature",
]
