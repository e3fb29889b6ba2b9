"""Mesh-free discrete Laplace-Beltrami operator on point clouds: numpy and scipy only, usable without Blender.

`build_laplacian` makes the operator of a cloud, and nearly all else takes that operator. Lengths are in the unit of the
points, [L].

Examples in the docstrings can be copied as they are. All but one begin with the same five lines, which make 800 points
of the unit sphere, where answers are known:

>>> import numpy as np
>>> import core
>>> z = 1 - (np.arange(800) + 0.5) / 400  # 800 points, evenly on the unit sphere
>>> ring = np.sqrt(1 - z**2) * np.exp(2.39996j * np.arange(800))
>>> points = np.column_stack([ring.real, ring.imag, z])
"""

from .applications import (
    CoarseDeformer,
    Deformer,
    Geodesics,
    MatchedModes,
    MinimalSurface,
    PointBlend,
    band,
    boost,
    chebyshev_filter,
    displace_by_mode,
    exponential,
    fair_points,
    fairing,
    geodesic_distance,
    grow,
    harmonic_field,
    heat_kernel_signature,
    match_modes,
    minimal_surface,
    modes_needed,
    nodal_domains,
    roughness,
    segment,
    signature_energies,
    signature_times,
    smooth_points,
    smoothing_base,
    solve_poisson,
    spectral_filter,
    wave_kernel_signature,
)
from .errors import (
    AreaError,
    Cancelled,
    ComponentError,
    InvalidPointsError,
    NotASurfaceError,
    NotEnoughMemoryError,
    PointCloudError,
    SolverError,
    TooFewPointsError,
    UnresolvedModesError,
)
from .geometry import Discs, Prolongation, blue_noise_subset, check_points, estimate_normals, surface_discs
from .memory import points_that_fit
from .operator import (
    LaplaceBeltrami,
    PrincipalCurvatures,
    Spectrum,
    build_laplacian,
    estimate_areas,
    mean_curvature,
    principal_curvatures,
)
from .options import LaplacianOptions
from .paper import Stability, check_stability

__all__ = [
    "AreaError",
    "Cancelled",
    "CoarseDeformer",
    "ComponentError",
    "Deformer",
    "Discs",
    "Geodesics",
    "InvalidPointsError",
    "LaplaceBeltrami",
    "LaplacianOptions",
    "MatchedModes",
    "MinimalSurface",
    "NotASurfaceError",
    "NotEnoughMemoryError",
    "PointBlend",
    "PointCloudError",
    "PrincipalCurvatures",
    "Prolongation",
    "SolverError",
    "Spectrum",
    "Stability",
    "TooFewPointsError",
    "UnresolvedModesError",
    "band",
    "blue_noise_subset",
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
    "match_modes",
    "mean_curvature",
    "minimal_surface",
    "modes_needed",
    "nodal_domains",
    "points_that_fit",
    "principal_curvatures",
    "roughness",
    "segment",
    "signature_energies",
    "signature_times",
    "smooth_points",
    "smoothing_base",
    "solve_poisson",
    "spectral_filter",
    "surface_discs",
    "wave_kernel_signature",
]
