"""Mesh-free discrete Laplace-Beltrami operator on point clouds: numpy and scipy only, usable without Blender."""

from .areas import estimate_areas
from .cloud import estimate_normals
from .curvature import mean_curvature
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
from .laplacian import LaplaceBeltrami, build_laplacian
from .minimal_surface import MinimalSurface, minimal_surface
from .options import LaplacianOptions
from .points import check_points
from .spectrum import Spectrum
from .stability import Stability, check_stability

__all__ = [
    "AreaError",
    "Cancelled",
    "InvalidPointsError",
    "IslandError",
    "LaplaceBeltrami",
    "LaplacianOptions",
    "MinimalSurface",
    "NotASurfaceError",
    "PointCloudError",
    "SolverError",
    "Spectrum",
    "Stability",
    "TooFewPointsError",
    "UnresolvedModesError",
    "build_laplacian",
    "check_points",
    "check_stability",
    "estimate_areas",
    "estimate_normals",
    "mean_curvature",
    "minimal_surface",
]
