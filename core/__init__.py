"""Mesh-free discrete Laplace-Beltrami operator on point clouds: numpy and scipy only, usable without Blender.

`build_laplacian` makes the operator of a cloud, and nearly all else takes that operator. Lengths are in the unit of the
points, [L].

Examples in the docstrings can be copied as they are. All but one begin with the same three lines, for 800 points of the
unit sphere, where answers are known:

>>> import numpy as np
>>> import core
>>> points = core.example_sphere()
"""

import importlib
import threading
from types import ModuleType
from typing import Any

from .errors import BrokenLibraryError

_NAMES = {  # the public ones, by the module or package that is imported when one of them is first asked for
    "applications": (
        "CoarseDeformer",
        "Deformer",
        "Deviation",
        "Geodesics",
        "IsoLine",
        "MatchedModes",
        "MinimalSurface",
        "PointBlend",
        "Slopes",
        "SurfaceMesh",
        "Transport",
        "band",
        "boost",
        "chebyshev_filter",
        "deformation_gradients",
        "displace_by_mode",
        "exponential",
        "fair_points",
        "fairing",
        "front_point",
        "geodesic_distance",
        "grow",
        "harmonic_field",
        "heat_kernel_signature",
        "iso_lines",
        "logarithmic_map",
        "match_modes",
        "mesh_surface",
        "minimal_surface",
        "modes_needed",
        "nearest_source",
        "nodal_domains",
        "opposite_ends",
        "roughness",
        "segment",
        "signature_energies",
        "signature_times",
        "signed_distance",
        "smooth_points",
        "smoothing_base",
        "solve_poisson",
        "spectral_filter",
        "surface_deviation",
        "transport",
        "values_on_mesh",
        "wave_kernel_signature",
    ),
    "errors": (
        "AreaError",
        "BrokenLibraryError",
        "Cancelled",
        "ComponentError",
        "InvalidPointsError",
        "NotASurfaceError",
        "NotEnoughMemoryError",
        "PointCloudError",
        "SolverError",
        "TooFewPointsError",
        "UnresolvedModesError",
    ),
    "example": ("example_sphere",),
    "geometry": (
        "Discs",
        "Prolongation",
        "blue_noise_subset",
        "check_points",
        "estimate_normals",
        "orient_normals",
        "surface_discs",
    ),
    "memory": ("points_that_fit",),
    "operator": (
        "LaplaceBeltrami",
        "PrincipalCurvatures",
        "Spectrum",
        "build_laplacian",
        "estimate_areas",
        "mean_curvature",
        "principal_curvatures",
    ),
    "options": ("LaplacianOptions",),
    "paper": (
        "Stability",
        "check_stability",
    ),
    "splats": (
        "Splats",
        "floaters",
        "read_splats",
        "write_splats",
    ),
}
_HOMES = {name: home for home, names in _NAMES.items() for name in names}
_PACKAGES = (*_NAMES, "files")
_WITH_PAPER = ("operator", "applications")
_lock = threading.RLock()  # scipy imports itself in circles, which two threads at once might enter from two sides

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    """Import what holds a public name, or a package, the first time that one asks for it: scipy takes a second."""
    if name not in _HOMES and name not in _PACKAGES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = _HOMES.get(name, name)
    with _lock:
        if home in _WITH_PAPER:
            _import("paper")  # whose areas become choices of the operator
        module = _import(home)
    found = module if name == home else getattr(module, name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_PACKAGES})


def _import(name: str) -> ModuleType:
    """Import a module or package of core; tell what it means where scipy, or what that asks of numpy, does not load."""
    try:
        return importlib.import_module(f".{name}", __name__)
    except ImportError as error:
        if (error.name or "").startswith(__name__):
            raise
        raise BrokenLibraryError(
            f"The scipy of this Python does not serve: {error}. In Blender, disable the extension that brings another"
            " one, or install this one again; then restart."
        ) from error
