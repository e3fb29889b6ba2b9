"""Roughness: the signed height of points above the smoothed surface."""

from typing import Any

import numpy as np

from . import core
from .quantities import ROUGHNESS
from .settings import Setting
from .tool import Array, Cloud, Laplacian, Length, Outcome, Progress, Row, Tool

WAVELENGTH = Setting(
    "wavelength",
    "Wavelength of which half counts as roughness; 0 for a default suited to the points",
    0.0,
    0.0,
    form="LENGTH",
    at_zero="Automatic",
)


class Roughness(Tool):
    """The tool."""

    name, label = "roughness", "Roughness"
    help = "Measure the signed height of points above the smoothed surface"
    settings = (WAVELENGTH,)
    panel, menu = Row("Measure", 3, 2), Row("Object", 3, 2)

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        check_wavelength(own.wavelength, cloud.points, cloud.name)

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        return core.clean.roughness(laplacian, own.wavelength or None, progress=progress)

    def finish(self, found: Any, laplacian: Laplacian, own: Any, length: Length) -> Outcome:
        return Outcome({ROUGHNESS: found}, f"roughness {length(np.sqrt(np.mean(found**2)))} on average")


def check_wavelength(wavelength: float, points: Array, name: str) -> None:
    """Refuse a wavelength beyond the size of the cloud of some name with these points, (n, 3)."""
    size = np.linalg.norm(np.ptp(points, axis=0))
    if wavelength > size:
        raise core.PointCloudError(
            f'The wavelength {wavelength:.4g} is longer than "{name}" is large ({size:.4g}). Use a shorter one.'
        )


TOOL = Roughness()
