"""Displacement by a vibration mode."""

from typing import Any

import numpy as np

from . import core
from .settings import Setting
from .tool import Array, Cloud, Laplacian, Length, MovingTool, Progress, Row

_READY = 20  # modes computed at least, so that they can be stepped through


class ModeShape(MovingTool):
    """The tool."""

    name, label = "mode_shape", "Deform by Mode"
    help = "Displace the points along their normals by a vibration mode"
    settings = (
        Setting("mode", "Number of the mode; 1 is the constant one", 2, 1, high=100),
        Setting(
            "amplitude",
            "Largest displacement; 0 for a tenth of the object's radius",
            0.0,
            0.0,
            form="LENGTH",
            at_zero="Automatic",
        ),
        Setting(
            "phase", "Angle of the vibration: 0 is full displacement, 180 degrees the opposite one", 0.0, form="DEGREES"
        ),
    )
    panel, menu = Row("Move", 1, 2), Row("Object", 4, 2)
    extended = True

    def inputs(self, cloud: Cloud, own: Any) -> bool:
        return cloud.repeats

    def later(self, own: Any) -> tuple[str, ...]:
        return "amplitude", "phase"

    def title(self, found: Any) -> str:
        return f"Mode {found[0]}"

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        """Return the number of the mode and the mode, (n,): the last that is known where Blender adjusts it."""
        known = laplacian.known_modes
        number = min(own.mode, known) if inputs and known else own.mode
        several = max(number, min(_READY, len(laplacian.points) // 3), known)
        return number, laplacian.eigenpairs(several, raw=True, progress=progress).eigenvectors[:, number - 1]

    def moved(self, found: Any, laplacian: Laplacian, own: Any) -> Array:
        return core.clean.displace_by_mode(laplacian, found[1], own.amplitude or None, phase=own.phase)

    def told(self, found: Any, own: Any) -> list[str]:
        if found[0] == own.mode:
            return []
        return [f"Only {found[0]} modes are computed: this is the last. Start {self.label} again for more."]

    def line(self, found: Any, before: Array, after: Array, length: Length) -> str:
        return f"moved by mode {found[0]}, at most by {length(np.linalg.norm(after - before, axis=1).max())}"


TOOL = ModeShape()
