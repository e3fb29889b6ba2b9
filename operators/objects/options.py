"""From the settings of an object to the options of core."""

from dataclasses import fields

import numpy as np

from ...core import LaplacianOptions, PaperOptions

DEFAULTS, PAPER_DEFAULTS = LaplacianOptions(), PaperOptions()

# The options of either method that are settings of an object by the same name.
_DEFAULT, _PAPER = (tuple(option.name for option in fields(kind)) for kind in (LaplacianOptions, PaperOptions))
NAMES = ("laplacian", *dict.fromkeys(_DEFAULT + _PAPER))

# Those, and the settings that say what of the object is read.
ALL_NAMES = (*NAMES, "boundary_group", "use_modifiers", "leave_out_floaters", "point_budget", "most_points")

# Options for kinds of points.
PRESETS = {
    "DEFAULT": DEFAULTS,
    "PAPER": PAPER_DEFAULTS,
    "CLEAN": LaplacianOptions(projection="off"),
    "NOISY": LaplacianOptions(bandwidth_factor=1.5),  # halves the scatter of curvature, at 1 % of the area
}


def apply_preset(settings, options):
    """Give settings the values of options, and the defaults of the other method's."""
    settings.laplacian = "PAPER" if isinstance(options, PaperOptions) else "DEFAULT"
    for given in (PAPER_DEFAULTS, DEFAULTS, options):
        for option in fields(given):
            value = getattr(given, option.name)
            setattr(settings, option.name, value.upper() if isinstance(value, str) else value)


def settings_values(settings) -> dict:
    """Values of the settings that change results, as core writes them: the method, and its own."""
    return _values(settings, ("laplacian", *_names(settings)))


def laplacian_options(settings) -> LaplacianOptions | PaperOptions:
    """Options of the operator, by the method that the settings name."""
    return (PaperOptions if settings.laplacian == "PAPER" else LaplacianOptions)(**_values(settings, _names(settings)))


def default_options(settings) -> LaplacianOptions:
    """Options of the default method, for what the paper's operator does not serve."""
    return LaplacianOptions(**_values(settings, _DEFAULT))


def point_budget(settings):
    """How many points an analysis takes at most; 0 for as many as fit the memory, None for all."""
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
