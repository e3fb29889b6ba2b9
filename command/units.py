"""In which unit the numbers of an attribute are written."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from . import quantities

EIGENVALUE_POWER = -2
_METERS = {
    "KILOMETERS": ("km", 1000.0),
    "METERS": ("m", 1.0),
    "CENTIMETERS": ("cm", 0.01),
    "MILLIMETERS": ("mm", 0.001),
    "MICROMETERS": ("µm", 1e-6),
    "MILES": ("mi", 1609.344),
    "FEET": ("ft", 0.3048),
    "INCHES": ("in", 0.0254),
    "THOU": ("thou", 0.0000254),
}
_ADAPTIVE = {
    "METRIC": ("KILOMETERS", "METERS", "CENTIMETERS", "MILLIMETERS", "MICROMETERS"),
    "IMPERIAL": ("MILES", "FEET", "INCHES", "THOU"),
}
_LEFT_OPEN = ("ADAPTIVE", "METERS", "FEET")  # the latter two are defaults of new scenes
_LEAST = {3: 0.01}  # number in an adaptive unit, if not 1, by the power
NO_UNITS = SimpleNamespace(system="NONE")  # settings of files, whose unit is not known
_RAISED = {1: "", 2: "²", 3: "³"}


def attribute_power(name: str) -> int:
    """Return the power of length in the unit of an attribute: 2 for areas, -1 for curvature, 0 for none."""
    row = quantities.quantity(name)
    return 0 if row.numbered else row.power


def unit(power: int, greatest: float, settings: Any) -> tuple[str, float]:
    """Choose a unit for a power of a length in a scene.

    Parameters
    ----------
    power : int
        As of `attribute_power`.
    greatest : float
        The greatest number to be written, in world lengths: an adaptive unit of lengths and areas is the first one in
        which it reaches 1, as in Blender, and of volumes the first in which it reaches a hundredth, since a cubic meter
        is a million cubic centimeters.
    settings : bpy.types.UnitSettings
        Of the scene; or `NO_UNITS`.

    Returns
    -------
    str
        Such as "mm²" or "1/m"; empty for plain numbers and scenes without units.
    float
        Conversion of world lengths to that unit.
    """
    if power == 0 or settings.system == "NONE":
        return "", 1.0
    if settings.length_unit not in _LEFT_OPEN:
        names: tuple[str, ...] = (settings.length_unit,)
    elif power > 0:
        names = _ADAPTIVE[settings.system]
    else:
        names = _ADAPTIVE[settings.system][1:2]
    factors = {name: (settings.scale_length / _METERS[name][1]) ** power for name in names}
    least = _LEAST.get(power, 1.0)
    name = next((name for name in names if factors[name] * abs(greatest) >= least), names[-1])
    raised = _METERS[name][0] + _RAISED[abs(power)]
    return (raised if power > 0 else f"1/{raised}"), factors[name]
