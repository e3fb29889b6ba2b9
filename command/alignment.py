"""Alignment of two clouds, for the command line and for Blender's tool."""

import numpy as np

from . import core
from .settings import Setting

ALIGN = {
    setting.name: setting
    for setting in (
        Setting(
            "overlap",
            "Share of the points that have a counterpart in the other cloud, at most",
            1.0,
            0.05,
            1.0,
        ),
        Setting("scale", "Change the size, too, by one factor", False),
    )
}


def check_found(found, name, other, advice=""):
    """Refuse an alignment that failed, of clouds of these names."""
    if not found.fits:
        text = f'"{name}" could not be aligned with "{other}": {found.reason} {advice}'
        raise core.PointCloudError(text.strip())


def doubts(found) -> list:
    """Return notices of an alignment that was made."""
    return [*([] if found.converged else [f"Not aligned in every direction. {found.reason}"]), *found.notices]


def middle(found) -> float:
    """Return the median distance of the points that have a counterpart."""
    return float(np.quantile(found.residual, 0.5 * found.overlap))


def figures(found, place) -> dict:
    """Return what the command line prints of an alignment between points less a place, (3,), of the file."""
    there, back = np.eye(4), np.eye(4)
    there[:3, 3], back[:3, 3] = place, -place
    return {
        "converged": found.converged,
        "overlap": found.overlap,
        "median_residual": middle(found),
        "matrix": (there @ found.matrix @ back).tolist(),
    }
