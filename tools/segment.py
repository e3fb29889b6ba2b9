"""Segmentation into parts."""

from typing import Any

from . import core
from .quantities import SEGMENT
from .settings import Choice, Setting
from .tool import Laplacian, Length, Outcome, Progress, Row, Tool


class Segment(Tool):
    """The tool."""

    name, label = "segment", "Segment"
    help = "Divide the points into parts, such as the limbs of a figure, or where a vibration mode has one sign"
    settings = (
        Setting(
            "method",
            "What makes a part",
            "PARTS",
            choices=(
                Choice("PARTS", "Parts", "As many connected parts as requested, divided where the shape is narrow"),
                Choice("NODAL", "Signs of a Mode", "Connected regions in which a vibration mode keeps its sign"),
            ),
        ),
        Setting("parts", "How many parts", 6, 1, high=50),
        Setting("mode", "Number of the mode; 1 is the constant one", 2, 1, high=100),
    )
    panel, menu, quick = Row("Make", 2, 1), Row("Object", 5, 1), Row("Object", 1, 2, "Segment")
    extended = True

    def asks(self, own: Any) -> tuple[str, ...]:
        return "method", "mode" if own.method == "NODAL" else "parts"

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        if own.method == "PARTS":
            return core.spectral.segment(laplacian, own.parts, progress=progress)
        vector = laplacian.eigenpairs(own.mode, progress=progress).eigenvectors[:, own.mode - 1]
        progress("Regions", 0.5)
        return core.spectral.nodal_domains(laplacian, vector)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        count = int(found.max()) + 1
        return Outcome({SEGMENT: found}, f"{count} part{'s' if count > 1 else ''}")


TOOL = Segment()
