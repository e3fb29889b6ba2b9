"""Principal curvatures and directions, shape index and curvedness."""

from typing import Any

from . import core
from .quantities import CURVATURE_1, CURVATURE_2, CURVEDNESS, DIRECTION_1, SHAPE_INDEX, quantity, rows_of
from .settings import Choice, Setting
from .tool import Laplacian, Length, Outcome, Progress, Row, Tool

_SHOWN = {
    "SHAPE_INDEX": ("Shape Index", SHAPE_INDEX),
    "CURVEDNESS": ("Curvedness", CURVEDNESS),
    "GREATEST": ("Greatest Curvature", CURVATURE_1),
    "LEAST": ("Least Curvature", CURVATURE_2),
    "DIRECTION": ("Direction", DIRECTION_1),
}


class PrincipalCurvatures(Tool):
    """The tool."""

    name, label = "principal_curvatures", "Principal Curvatures"
    help = "Compute principal curvatures and directions, shape index and curvedness"
    showing = (
        Setting(
            "display",
            "Which of the results is shown as colors",
            "SHAPE_INDEX",
            choices=tuple(Choice(value, label, quantity(name).tooltip) for value, (label, name) in _SHOWN.items()),
        ),
    )
    panel, menu = Row("Measure", 3, 1), Row("Object", 3, 1)

    def shown(self, own: Any) -> str:
        return _SHOWN[own.display][1]

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        progress("Curvature", 0.9)
        return core.measure.principal_curvatures(laplacian)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        values = {row.attribute: row.of(found) for row in rows_of(self.name)}
        line = f"curvatures from {found.second.min():.4g} to {found.first.max():.4g}"
        return Outcome(values, line, found.notices)


TOOL = PrincipalCurvatures()
