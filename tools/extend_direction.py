"""Directions at some points, extended to the whole surface."""

from typing import Any

import numpy as np

from . import core
from .groups import source_setting, unreached
from .quantities import DIRECTION
from .settings import Setting
from .tool import Cloud, Laplacian, Length, Outcome, Progress, Row, Tool


class ExtendDirection(Tool):
    """The tool."""

    name, label = "extend_direction", "Extend Direction"
    help = "Extend directions at some points to the whole surface by parallel transport"
    settings = (
        source_setting("Vertex group with the points that have the direction"),
        Setting(
            "direction",
            "Direction at these points, along the axes of the world; projected onto the surface",
            (0.0, 0.0, -1.0),
            -1e6,
            1e6,
            form="X,Y,Z",
        ),
    )
    reads = ("sources",)
    panel, menu = Row("Advanced", 2, 5), Row("Object", 7, 4)

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        return cloud.sources(own.group)

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        direction = np.array(own.direction, dtype=np.float64)
        return core.distance.transport(laplacian, inputs, direction, progress=progress)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        notices = unreached(found.any(axis=1), "They have no direction.")
        return Outcome({DIRECTION: found}, f"directions on {len(found):,} points", notices)


TOOL = ExtendDirection()
