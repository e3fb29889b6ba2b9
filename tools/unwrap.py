"""Texture coordinates around a point, like a decal."""

from typing import Any

import numpy as np

from . import core
from .groups import source_setting
from .quantities import UV
from .settings import Setting
from .tool import Cloud, Laplacian, Length, Outcome, Progress, Row, Tool

OUTSIDE = -1.0  # texture coordinates of points that the map does not reach


class Unwrap(Tool):
    """The tool."""

    name, label = "unwrap", "Unwrap Around Point"
    help = "Map the surface around a point to texture coordinates, like a decal"
    settings = (
        source_setting(
            "Vertex group around the center of the texture, which is the point nearest to the mean of its points",
            label="Center",
        ),
        Setting(
            "radius",
            "Distance along the surface from the center of the texture to its border; 0 for all points",
            0.0,
            0.0,
            form="LENGTH",
            at_zero="All Points",
        ),
        Setting("angle", "Rotation of the texture about its center", 0.0, form="DEGREES"),
    )
    reads = ("sources",)
    panel, menu = Row("Make", 2, 3), Row("Object", 7, 3)

    def later(self, own: Any) -> tuple[str, ...]:
        return "radius", "angle"

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        if np.isnan(own.radius):
            raise core.PointCloudError("The radius of the texture is not a number. Use one from 0 on.")
        rows = np.flatnonzero(cloud.sources(own.group))
        places = cloud.points[rows]
        return rows[np.linalg.norm(places - places.mean(axis=0), axis=1).argmin()]

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        if laplacian.component[inputs] < 0:
            raise core.PointCloudError(
                "The center is a point that the operator left out, because it is an outlier. Choose a point of the"
                " surface."
            )
        return core.distance.logarithmic_map(laplacian, inputs, progress=progress)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        reached = np.isfinite(found[:, 0])
        place = found @ [1.0, 1.0j]
        border = own.radius or np.abs(place[reached]).max()
        placed = 0.5 + 0.5j + 0.5 * np.exp(1j * own.angle) * place / border
        texture = np.where(reached[:, None], np.column_stack([placed.real, placed.imag]), OUTSIDE)
        return Outcome({UV: texture}, f"texture coordinates up to {length(border)} from the center")


TOOL = Unwrap()
