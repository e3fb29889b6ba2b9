"""Results at the points other than those of an analysis, for the command line and for Blender's tools."""

from typing import NamedTuple

import numpy as np

from . import core
from .settings import Setting

ROUGHNESS = {
    setting.name: setting
    for setting in (
        Setting(
            "wavelength",
            "Wavelength of which half counts as roughness; 0 for a default suited to the points",
            0.0,
            0.0,
            form="LENGTH",
        ),
    )
}


class Told(NamedTuple):
    """A result at the points as it is written, with notices, and a line on it."""

    values: object
    notices: list
    line: str


def number_text(value) -> str:
    """Write a length or an area of a file, whose unit is not known."""
    return f"{value:.4g}"


def check_wavelength(wavelength, points, name):
    """Refuse a wavelength beyond the size of the cloud of some name with these points, (n, 3)."""
    size = np.linalg.norm(np.ptp(points, axis=0))
    if wavelength > size:
        raise core.PointCloudError(
            f'The wavelength {wavelength:.4g} is longer than "{name}" is large ({size:.4g}). Use a shorter one.'
        )


def curvature_line(found) -> str:
    """Return the range of principal curvatures as a text."""
    return f"curvatures from {found.second.min():.4g} to {found.first.max():.4g}"


def variation_line(found) -> str:
    """Return the range of the surface variation, (n,), as a text."""
    return f"surface variation {np.median(found):.3g} (median), up to {found.max():.3g}"


def roughness_line(found, length_text) -> str:
    """Return the size of the roughness, (n,), as a text, with lengths written by a function."""
    return f"roughness {length_text(np.sqrt(np.mean(found**2)))} on average"
