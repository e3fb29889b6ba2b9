"""Alignment of one cloud with another."""

from typing import Any

import numpy as np

from . import core
from .quantities import RESIDUAL
from .settings import Setting
from .tool import Array, Cloud, Length, Outcome, PointTool, Progress, Row

_BY_HAND = " In Blender: move it by hand, or align it From Selected Points, three to five on each."


class AlignPoints(PointTool):
    """The tool."""

    name, verb, label = "align_points", "align", "Align Points"
    help = "Move the points onto the surface of those of another cloud, from nearby"
    reference = "point cloud that the points are moved onto"
    settings = (
        Setting(
            "overlap",
            "Share of the points that have a counterpart in the other cloud, at most",
            1.0,
            0.05,
            1.0,
            form="SHARE",
        ),
        Setting("scale", "Change the size, too, by one factor", False),
    )
    panel, menu = Row("Two Scans", 1, 1), Row("Object", 2, 3)
    bytes_a_point = 500
    keeps_line = extended = True

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        """Return both clouds, the offset between them, and in both the places that are to meet; None for none."""
        return cloud, *cloud.reference(), None

    def compute(self, points: Array, inputs: Any, own: Any, progress: Progress) -> Any:
        cloud, other, shift, pairs = inputs
        given = {"overlap": own.overlap, "scale": own.scale, "pairs": pairs}
        found = core.measure.align(points + shift, other.points, **given, progress=progress)
        check_found(found, cloud, other)
        return found, other

    def finish(self, found: Any, points: Array, own: Any, length: Length) -> Outcome:
        found, other = found
        middle = float(np.quantile(found.residual, 0.5 * found.overlap))  # of the points that have a counterpart
        size = f", scaled by {np.linalg.norm(found.matrix[0, :3]):.4g}" if own.scale else ""
        half = f"half of them within {length(middle)}"
        line = f"{found.overlap:.0%} of the points lie on {other.name}, {half}{size}"
        there, back = np.eye(4), np.eye(4)
        there[:3, 3], back[:3, 3] = other.place, -other.place
        figures = {
            "converged": found.converged,
            "overlap": found.overlap,
            "median_residual": middle,
            "matrix": (there @ found.matrix @ back).tolist(),
        }
        return Outcome({RESIDUAL: found.residual}, line, doubts(found), figures=figures, matrix=found.matrix)


def check_found(found: "core.measure.Alignment", cloud: Cloud, other: Cloud) -> None:
    """Refuse an alignment of two clouds that failed."""
    if not found.fits:
        advice = _BY_HAND if cloud.in_blender else ""
        raise core.PointCloudError(f'"{cloud.name}" could not be aligned with "{other.name}": {found.reason}{advice}')


def doubts(found: "core.measure.Alignment") -> list[str]:
    """Return notices of an alignment that was made."""
    return [*([] if found.converged else [f"Not aligned in every direction. {found.reason}"]), *found.notices]


TOOL = AlignPoints()
