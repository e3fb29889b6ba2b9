"""Cross sections of the surface by a plane."""

from typing import Any

import numpy as np

from . import core
from .tool import Cloud, Laplacian, Length, Outcome, Progress, Row, Tool

UP = np.array([0.0, 0.0, 1.0])


class CrossSection(Tool):
    """The tool."""

    name, verb, label = "cross_section", "section", "Cross Section"
    help = "Cut the surface by a plane: curves, with their length and the area that they enclose"
    panel, menu = Row("Measure", 2, 1), Row("Object", 7, 5)
    keeps_line = extended = True

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        """Return a point of the plane and its normal where nothing gives one, notices, and the name of the cloud."""
        middle = 0.5 * (cloud.points.min(axis=0) + cloud.points.max(axis=0))
        kind, plane = ("the horizontal", "Plane") if cloud.in_blender else ("a", "--plane")
        notice = f"It is cut by {kind} plane through its middle: no {plane} is given."
        return middle, UP, (notice,), cloud.name

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        position, normal, notices, name = inputs
        found = core.measure.cross_section(laplacian, position, normal, progress=progress)
        if not found.curves:
            raise core.PointCloudError(
                f'The plane passes beside the surface of "{name}", or only touches it. Move it to where it cuts.'
            )
        return found, notices

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        found, notices = found
        count = len(found.curves)
        curves = "1 curve" if count == 1 else f"{count:,} curves"
        line = f"{curves}, {length(found.length)} long, enclosed area {length(found.enclosed_area, 2)}"
        figures = {
            "curves": count,
            "open_curves": sum(not curve.closed for curve in found.curves),
            "length": found.length,
            "enclosed_area": found.enclosed_area,
        }
        return Outcome({}, line, [*notices, *found.notices], figures=figures, made=found.curves)


def records(curves: Any) -> list[dict[str, float]]:
    """Return the measures of each curve by name, in world lengths; of a hole the area that it takes away."""
    return [
        {
            "curve": number,
            "length": curve.length,
            "enclosed_area": abs(curve.enclosed_area),
            "closed": int(curve.closed),
            "hole": int(curve.enclosed_area < 0.0),
        }
        for number, curve in enumerate(curves, 1)
    ]


TOOL = CrossSection()
