"""Geodesic Voronoi cells of points."""

from typing import Any

import numpy as np

from . import core
from .groups import source_setting, unreached
from .quantities import CELL
from .tool import Cloud, Laplacian, Length, Outcome, Progress, Row, Tool


class NearestSource(Tool):
    """The tool."""

    name, label = "nearest_source", "Nearest Source"
    help = "Divide the surface into geodesic Voronoi cells of the sources"
    settings = (source_setting("Vertex group with the points that are centers of cells"),)
    reads = ("sources",)
    panel, menu = Row("Advanced", 2, 4), Row("Object", 7, 2)

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        return cloud.sources(own.group)

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        return core.distance.nearest_source(laplacian, inputs, progress=progress)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        count = len(np.unique(found[found >= 0]))
        return Outcome({CELL: found}, f"{count:,} cells", unreached(found >= 0, "Their cell is -1."))


TOOL = NearestSource()
