"""Stray points, and fewer points, for the command line and for Blender's tools."""

import numpy as np

from . import core
from .settings import Setting

STRAYS = {
    setting.name: setting
    for setting in (
        Setting(
            "strictness",
            "How near to the surface points may be and still be stray: above 1 more are, below 1 fewer",
            1.0,
            0.01,
            100.0,
        ),
        Setting(
            "smallest",
            "Points of parts with fewer points than this are stray, too; the largest part never is",
            30,
            0,
        ),
        Setting(
            "smallest_area",
            "Points of parts with less area than this are stray, too; the largest part never is",
            0.0,
            0.0,
            form="AREA",
        ),
    )
}


def check_some_stay(found):
    """Refuse stray points, (n,) bool, that are all."""
    if found.all():
        raise core.PointCloudError(f"All {len(found):,} points are stray at this strictness. Lower it.")


def stray_line(found) -> str:
    """Return how many points are stray, of (n,) bool."""
    count = np.count_nonzero(found)
    return f"{count:,} of {len(found):,} points are stray ({count / len(found):.2%})"
