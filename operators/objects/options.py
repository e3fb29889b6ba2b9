"""Convert settings of an object to options of core."""

from dataclasses import fields

import numpy as np

from ...core import LaplacianOptions, PaperOptions
from ...tools import laplacian

DEFAULTS, PAPER_DEFAULTS = LaplacianOptions(), PaperOptions()

# The options of either method that are settings of an object by the same name.
_DEFAULT, _PAPER = (tuple(option.name for option in fields(kind)) for kind in (LaplacianOptions, PaperOptions))
NAMES = ("laplacian", *dict.fromkeys(_DEFAULT + _PAPER))

# Options for kinds of points.
PRESETS = {
    "DEFAULT": DEFAULTS,
    "PAPER": PAPER_DEFAULTS,
    "CLEAN": LaplacianOptions(projection="off"),
    "NOISY": LaplacianOptions(bandwidth_factor=1.7),  # a third of the scatter of curvature, for twice the time
}


def apply_preset(settings, options):
    """Set settings to the values of options, and those of the other method to defaults."""
    settings.laplacian = "PAPER" if isinstance(options, PaperOptions) else "DEFAULT"
    for given in (PAPER_DEFAULTS, DEFAULTS, options):
        for option in fields(given):
            value = getattr(given, option.name)
            setattr(settings, option.name, value.upper() if isinstance(value, str) else value)


def settings_values(settings) -> dict:
    """Return the values of the settings that change results: the method, and its options."""
    return _values(settings, ("laplacian", *_names(settings)))


def laplacian_options(settings) -> LaplacianOptions | PaperOptions:
    """Return the options of the operator, by the method of the settings."""
    return laplacian.laplacian_options(_values(settings, NAMES))


def default_options(settings) -> LaplacianOptions:
    """Return the options of the default method, where the paper's operator is not usable."""
    return laplacian.default_options(_values(settings, NAMES))


def point_budget(settings):
    """Return the maximum number of points of an analysis; 0 for as many as fit into memory, None for all."""
    return {"AUTO": 0, "ALL": None, "NUMBER": settings.most_points}[settings.point_budget]


def _names(settings):
    return _PAPER if settings.laplacian == "PAPER" else _DEFAULT


def _values(settings, names):
    return {name: _value(getattr(settings, name)) for name in names}


def _value(value):
    if isinstance(value, str):
        return value.lower()  # Blender's enumerations are upper case
    if isinstance(value, float):
        return float(str(np.float32(value)))  # Blender keeps float32: 0.001 comes back as 0.0010000000475
    return value
