"""Settings of the Laplacian."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from . import core
from .settings import Choice, Setting, by_name

_DEFAULTS, _PAPER = core.LaplacianOptions(), core.PaperOptions()

LAPLACIAN = by_name(  # in the order of the panel
    (
        Setting(
            "laplacian",
            "How the Laplacian is built",
            "DEFAULT",
            choices=(
                Choice(
                    "DEFAULT", "Default", "For scans: adaptive bandwidths, with corrections for curvature and boundary"
                ),
                Choice("PAPER", "Paper", "As in the paper: one bandwidth for all points, no boundary, no corrections"),
            ),
            label="Method",
        ),
        Setting(
            "bandwidth",
            "How the radius of the kernel is chosen at each point",
            _DEFAULTS.bandwidth.upper(),
            choices=(
                Choice("ADAPTIVE", "Adaptive", "By the widest gaps between the points around it"),
                Choice("LOCAL", "Local", "By the spacing of the points alone"),
                Choice("GLOBAL", "Global", "The same for all points: for even samples"),
            ),
        ),
        Setting(
            "neighbors",
            "With Local and Global, the smoothing length follows the distance to this neighbor; where there"
            " are no more points than that it is extrapolated",
            _DEFAULTS.neighbors,
            6,
            high=200,
        ),
        Setting(
            "bandwidth_factor",
            "Smoothing length as a multiple of the distance to the neighbor above; with Adaptive, as a"
            " multiple of the length that is chosen",
            _DEFAULTS.bandwidth_factor,
            0.05,
            5.0,
            low=0.3,
            high=2.0,
        ),
        Setting(
            "normals",
            "How the normal of a point is estimated from its neighbors",
            _PAPER.normals.upper(),
            choices=(
                Choice("WPCA", "Weighted Plane", "From a plane through the neighbors, near ones counting more"),
                Choice("PCA", "Plain Plane", "From a plane through the neighbors, all counting alike"),
            ),
        ),
        Setting(
            "areas",
            "How the area of each point is computed",
            _PAPER.areas.upper(),
            choices=(
                Choice("REGULARIZED", "Regularized", "Least squares with regularization, equation 7 of the paper"),
                Choice("CONSTRAINED", "Constrained", "The same with positive areas only, equation 8 of the paper"),
                Choice("UNIFORM", "Uniform", "The mean area for every point: only for even samples"),
            ),
        ),
        Setting(
            "regularization",
            "Weight of the regularization of the areas, independent of the object's size",
            _PAPER.regularization,
            1e-9,
            high=1.0,
        ),
        Setting(
            "boundary",
            "Where the boundary of the surface is, if no Boundary Group is named",
            _DEFAULTS.boundary.upper(),
            choices=(
                Choice("AUTO", "Automatic", "Detect the boundary points, and reflect the surface across the boundary"),
                Choice("OFF", "Off (Closed Surface)", "Treat the surface as closed"),
            ),
        ),
        Setting(
            "sheets",
            "Never take points of two close sheets as neighbors, such as the two sides of a thin wall",
            _DEFAULTS.sheets,
            label="Keep Close Sheets Apart",
        ),
        Setting(
            "projection",
            "Whether noise is smoothed within the computation; your points are not moved, but sharp edges count"
            " as rounded",
            _DEFAULTS.projection.upper(),
            choices=(
                Choice("AUTO", "Automatic", "Smooth if the measured noise requires it"),
                Choice("OFF", "Off", "Use the points as they are"),
                Choice("QUADRIC", "Always", "Project each point onto a quadric fitted to its neighbors"),
            ),
            label="Noise",
        ),
        Setting(
            "denoise",
            "Project each point onto a plane through its neighbors first, against noise; your points are not moved",
            _PAPER.denoise,
            label="Tangent Planes",
        ),
        Setting(
            "boundary_group",
            "Vertex group with the points of the boundary, instead of finding them; weights above 0 count",
            "",
        ),
        Setting(
            "leave_out_floaters",
            "Leave Gaussian splats out of the operator that are nearly transparent, huge or isolated; they"
            " follow the others",
            True,
        ),
    )
)


def laplacian_options(values: Mapping[str, Any]) -> core.LaplacianOptions | core.PaperOptions:
    """Return the options of the operator by the values of settings, choices in upper or lower case."""
    kind = core.PaperOptions if values["laplacian"].lower() == "paper" else core.LaplacianOptions
    return _options(kind, values)


def default_options(values: Mapping[str, Any]) -> core.LaplacianOptions:
    """Return the options of the default method, where the paper's operator is not usable."""
    return _options(core.LaplacianOptions, values)


def _options(kind: Any, values: Mapping[str, Any]) -> Any:
    return kind(**{name: _lower(values[name]) for name in kind.__dataclass_fields__})


def _lower(value: Any) -> Any:
    return value.lower() if isinstance(value, str) else value
