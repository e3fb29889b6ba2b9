"""From the settings of an object to the options of core."""

from dataclasses import fields

import numpy as np

from ...core import LaplacianOptions

DEFAULTS = LaplacianOptions()

# The options that are settings of an object by the same name; normals are always oriented.
NAMES = tuple(option.name for option in fields(LaplacianOptions) if option.name != "orient")

# Those, and the settings that say what of the object is read.
ALL_NAMES = (*NAMES, "boundary_group", "use_modifiers", "leave_out_floaters", "point_budget", "most_points")

# Options for kinds of points.
PRESETS = {
    "DEFAULT": DEFAULTS,
    "PAPER": LaplacianOptions.paper(),
    "CLEAN": LaplacianOptions(projection="off"),
    "NOISY": LaplacianOptions(bandwidth_factor=1.5),  # halves the scatter of curvature, at 1 % of the area
}


def apply_preset(settings, options):
    """Give settings the values of options."""
    for name in NAMES:
        value = getattr(options, name)
        setattr(settings, name, value.upper() if isinstance(value, str) else value)


def settings_values(settings) -> dict:
    """Values of the settings that change results, as core writes them."""
    return {name: _value(getattr(settings, name)) for name in NAMES}


def laplacian_options(settings) -> LaplacianOptions:
    """Options of the operator, with oriented normals, which the sign of the mean curvature needs."""
    return LaplacianOptions(orient=True, **settings_values(settings))


def point_budget(settings):
    """How many points an analysis takes at most; 0 for as many as fit the memory, None for all."""
    return {"AUTO": 0, "ALL": None, "NUMBER": settings.most_points}[settings.point_budget]


def _value(value):
    if isinstance(value, str):
        return value.lower()  # Blender's enumerations are upper case
    if isinstance(value, float):
        return float(str(np.float32(value)))  # Blender keeps float32: 0.001 comes back as 0.0010000000475
    return value
