"""Signed geodesic distances from a curve."""

from typing import Any

import numpy as np

from . import core
from .groups import unreached
from .quantities import SIGNED_DISTANCE
from .tool import Cloud, Laplacian, Length, Outcome, Progress, Row, Tool


class SignedDistance(Tool):
    """The tool."""

    name, label = "signed_distance", "Signed Distance"
    help = "Geodesic distance from a curve, positive on its left"
    reads = ("curve",)
    panel, menu = Row("Advanced", 2, 2), Row("Object", 7, 1)

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        return cloud.curve()

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        places, closed = inputs
        known = np.flatnonzero(laplacian.component >= 0)
        nearest = known[core.geometry.nearest_rows(laplacian.points[known], places)]
        _, first = np.unique(nearest, return_index=True)
        curve = nearest[np.sort(first)]
        if len(curve) < 2:
            raise core.PointCloudError("All of the curve lies at one point of the cloud. Draw it along the surface.")
        return core.distance.signed_distance(laplacian, curve, closed and len(curve) > 2, progress=progress)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        reached = np.isfinite(found)
        low, high = (length(value) for value in (found[reached].min(), found[reached].max()))
        values = {SIGNED_DISTANCE: np.where(reached, found, 0.0)}
        line = f"{low} on the right to {high} on the left"
        return Outcome(values, line, unreached(reached, "Their distance is 0."))


TOOL = SignedDistance()
