"""Stray points, and fewer points, for the command line and for Blender's tools."""

import numpy as np

from . import core
from .settings import Setting

_SPACINGS = 2.0  # of the points, between those that stay, where none is given

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

THIN_OUT = {
    setting.name: setting
    for setting in (
        Setting("by", "What says how many points stay", "SPACING", choices=("SPACING", "NUMBER")),
        Setting(
            "spacing",
            "Least distance between points, for Spacing; 0 for twice the present one",
            0.0,
            0.0,
            form="LENGTH",
        ),
        Setting("count", "How many points stay at most, for Number", 10_000, 1),
        Setting("keep_edges", "Keep points at edges before others, the sharpest first", True),
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


def thinner(points, by, spacing, count, keep_edges):
    """Return a function of a progress callback that chooses fewer points of the same surface.

    Parameters
    ----------
    points : ndarray, (n, 3)
    by, spacing, count, keep_edges
        Values of the settings in `THIN_OUT`.

    Returns
    -------
    callable
        Returns which points stay, (n,) bool, and the least distance between them, or None if that is not known.
    """

    def compute(progress):
        least = (spacing or _SPACINGS * core.geometry.typical_distance(points)) or None
        size = {"count": count} if by == "NUMBER" or least is None else {"spacing": least}
        kept = np.zeros(len(points), dtype=bool)
        kept[core.clean.thin_out(points, keep_edges=keep_edges, progress=progress, **size)] = True
        return kept, size.get("spacing")

    return compute


def thin_line(kept) -> str:
    """Return how many points stay, of (n,) bool."""
    return f"{np.count_nonzero(kept):,} of {len(kept):,} points are left"
