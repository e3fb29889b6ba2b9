"""Smoothing and enhancement of shapes."""

from typing import Any

import numpy as np

from . import core
from .roughness import check_wavelength
from .settings import Choice, Setting
from .tool import Array, Cloud, Laplacian, MovingTool, Progress, Row

_HEAT, _DETAIL = 9.0, 18.0  # default wavelengths in smoothing lengths: those of details of some points
_FINEST = 8.0  # details finer than the wavelength by this factor count as noise, which is not amplified


class Smooth(MovingTool):
    """The tool."""

    name, label = "smooth", "Smooth Points"
    help = "Smooth the shape of the points: remove noise, soften details, keep a few modes, or strengthen details"
    settings = (
        Setting(
            "method",
            "What is smoothed, and how",
            "EDGES",
            choices=(
                Choice("EDGES", "Keep Edges", "Remove noise along the normals, and keep edges"),
                Choice("NOISE", "Remove Noise", "Remove the noise of single points and keep the shape, by frequency"),
                Choice("HEAT", "Soften", "Attenuate details as heat diffusion does, the finer the more"),
                Choice("MODES", "Keep Modes", "Project the shape onto the lowest vibration modes"),
                Choice("DETAIL", "Scale Details", "Make details stronger or weaker and keep the coarse shape"),
            ),
        ),
        Setting(
            "wavelength",
            "Wavelength that is halved, or the longest one that is scaled; 0 for a default suited to the points",
            0.0,
            0.0,
            form="LENGTH",
            at_zero="Automatic",
        ),
        Setting("modes", "How many modes are kept, the constant one included", 100, 4, high=500),
        Setting("gain", "How much stronger details become", 1.5, 0.0, high=3.0),
        Setting("strength", "Factor of the displacements to the smooth positions", 1.0, 0.0, 1.0, form="SHARE"),
        Setting(
            "group",
            "Smooth the points of this group only, by their weights; empty for all points",
            "",
            label="Vertex Group",
        ),
        Setting(
            "keep",
            "Scale the result so that it keeps its size",
            "NONE",
            choices=(
                Choice("NONE", "Nothing", "Let the shape shrink"),
                Choice("AREA", "Area", "Keep the area of each component"),
                Choice("VOLUME", "Volume", "Keep the volume of each component; for closed surfaces"),
            ),
        ),
        Setting("keep_boundary", "Leave the boundary where it is", True),
    )
    panel, menu = Row("Clean", 2, 1), Row("Object", 4, 1)
    keeps_line = True

    def asks(self, own: Any) -> tuple[str, ...]:
        names = {"EDGES": (), "MODES": ("modes",), "DETAIL": ("wavelength", "gain")}.get(own.method, ("wavelength",))
        return "method", *names, "strength", "group", "keep", "keep_boundary"

    def later(self, own: Any) -> tuple[str, ...]:
        return ("strength",) if own.keep == "NONE" else ()  # to keep a size takes a search

    def title(self, found: Any) -> str:
        return "Smooth"

    def inputs(self, cloud: Cloud, own: Any) -> Any:
        check_wavelength(own.wavelength, cloud.points, cloud.name)
        return cloud.weights("group", own.group) if own.group else None

    def compute(self, laplacian: Laplacian, inputs: Any, own: Any, progress: Progress) -> Any:
        """Return the points at full strength, those that keep their size or None, and the mask."""
        keep = own.keep.lower() if own.keep != "NONE" else None
        dirichlet = own.keep_boundary and bool(laplacian.boundary.any())
        if dirichlet and keep:
            raise core.PointCloudError(
                "There is a boundary, which determines the size already. Set Keep to Nothing, or turn off Keep"
                " Boundary."
            )
        settings = own.method, own.modes, own.wavelength, own.gain, dirichlet
        full = laplacian.kept.result("smoothed", lambda: _filtered(laplacian, own, dirichlet, progress), *settings)
        if keep is None:
            return full, None, inputs
        progress("Size", 0.9)
        blend = core.clean.PointBlend(laplacian, strength=own.strength, mask=inputs, keep=keep, dirichlet=dirichlet)
        return full, blend(full), inputs

    def moved(self, found: Any, laplacian: Laplacian, own: Any) -> Array:
        full, kept, mask = found
        if kept is not None:
            return kept
        dirichlet = own.keep_boundary and bool(laplacian.boundary.any())
        return core.clean.PointBlend(laplacian, strength=own.strength, mask=mask, dirichlet=dirichlet)(full)

    def shape(self, found: Any) -> Array | None:
        return found[0]


def _filtered(laplacian: Laplacian, own: Any, dirichlet: bool, progress: Progress) -> Array:
    """Return the points, (n, 3), by a method at full strength."""
    given: dict[str, Any] = {"dirichlet": dirichlet, "progress": progress}
    if own.method == "EDGES":
        return core.clean.clean_points(laplacian, **given)
    length, wavelength = float(np.median(laplacian.smoothing_lengths)), own.wavelength
    if own.method == "NOISE":
        time = (wavelength / (2.0 * np.pi)) ** 2 if wavelength else None
        return core.clean.fair_points(laplacian, time, **given)
    if own.method == "MODES":
        return core.clean.smooth_points(laplacian, own.modes, **given)
    if own.method == "HEAT":
        squared = ((wavelength or _HEAT * length) / (2.0 * np.pi)) ** 2
        return core.clean.smooth_points(laplacian, core.clean.exponential(np.log(2.0) * squared), **given)
    low = (2.0 * np.pi / (wavelength or _DETAIL * length)) ** 2
    return core.clean.smooth_points(laplacian, core.clean.boost(own.gain, low, _FINEST**2 * low), **given)


TOOL = Smooth()
