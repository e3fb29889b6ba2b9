"""Geodesic distances from points."""

from typing import Any

import numpy as np

from . import core
from .groups import source_setting, unreached
from .quantities import DISTANCE
from .tool import Cloud, Laplacian, Length, Outcome, Progress, Row, Tool

UNREACHED = -1.0  # distance of points that no source reaches


class GeodesicDistance(Tool):
    """The tool."""

    name, label = "geodesic_distance", "Geodesic Distance"
    help = "Geodesic distance from a group of points, or from the selected ones"
    settings = (source_setting("Vertex group of the sources"),)
    reads = ("sources",)
    panel, menu = Row("Advanced", 2, 1), Row("Object", 6, 1)

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        sources = cloud.sources(own.group)
        if sources.all():
            raise core.PointCloudError(
                f'All points of "{cloud.name}" are sources, so that all distances are 0. Select fewer of them, or'
                " choose a smaller group."
            )
        return sources

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        return core.distance.geodesic_distance(laplacian, inputs, progress=progress)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        reached = np.isfinite(found)
        notices = unreached(reached, f"Their distance is {UNREACHED:g}.")
        line = f"distances up to {length(found[reached].max())}"
        return Outcome({DISTANCE: np.where(reached, found, UNREACHED)}, line, notices)


TOOL = GeodesicDistance()
