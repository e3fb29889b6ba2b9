"""How far the neighborhoods of points are from planes."""

from typing import Any

import numpy as np

from . import core
from .quantities import SURFACE_VARIATION
from .tool import Laplacian, Length, Outcome, Progress, Row, Tool


class SurfaceVariation(Tool):
    """The tool."""

    name, label = "surface_variation", "Surface Variation"
    help = "Measure how far the neighborhood of each point is from a plane: edges, corners and noise are large"
    panel, menu = Row("Advanced", 3, 2), Row("Object", 3, 4)

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        return core.measure.surface_variation(laplacian)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        line = f"surface variation {np.median(found):.3g} (median), up to {found.max():.3g}"
        return Outcome({SURFACE_VARIATION: found}, line)


TOOL = SurfaceVariation()
