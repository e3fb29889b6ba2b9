"""Colour attributes of displayed values for viewports in Solid, which do not use materials."""

import numpy as np

from ..operators.objects.attributes import (
    DISC,
    SLOPE,
    SLOPE_2,
    SOLID,
    TILT,
    in_edit_mesh,
    point_count,
    read_attribute,
    remove_attributes,
    write_attribute,
)
from . import colormaps
from .materials import BEYOND, direction_color
from .value_range import STEPPED


def number_colors(color_map, low, high, settings):
    """Return a function that gives the linear colours of numbers, (n,) to (n, 4), as a material shows them.

    Parameters as in `materials.color_by_number`; values outside the range are not hidden.
    """
    colors = np.array(colormaps.colors(color_map, settings.reverse))
    margin = 0.5 if color_map in STEPPED else 0.0

    def of(values):
        if color_map in STEPPED:
            whole = np.rint(values).astype(int)
            repeated = np.where(whole < 0, 0, 1 + whole % (len(colors) - 1))
            steps = np.clip(whole, 0, 1) if color_map == "TRUTH" else repeated
            result = colors[steps]
        else:
            place = np.clip((values - low) / (high - low), 0.0, 1.0) * (len(colors) - 1)
            result = np.stack([np.interp(place, range(len(colors)), column) for column in colors.T], axis=1)
        beyond = (values < low - margin) | (values > high + margin)
        return np.where(beyond[:, None], BEYOND, result) if settings.outside == "GRAY" else result

    return of


def direction_colors(vectors):
    """Return the linear colours of directions, (n, 3) to (n, 4)."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    red, green, blue, alpha = direction_color((vectors / np.where(length > 0.0, length, 1.0)).T)
    return np.stack([red, green, blue, np.full(len(red), alpha)], axis=1)


def follow(obj, values, colors_of, radius):
    """Write the colours of an object's displayed values, and return the colour attribute that shows them.

    Its name is empty if none is changed. Values are numbers or directions, (n,) or (n, 3), whose colours, (n, 4), a
    function gives; None if Solid cannot show them. The radius of discs is in local lengths.
    """
    data = obj.data
    if obj.type != "MESH" or in_edit_mesh(obj) or not data.is_editable or data.override_library is not None:
        return ""
    if colors_of is None or not np.isfinite(values).all():
        remove_attributes(data, SOLID, TILT)
        return ""
    write_attribute(data, SOLID, colors_of(values), "FLOAT_COLOR")
    if SLOPE in data.attributes and SLOPE_2 not in data.attributes and values.ndim == 1:
        write_attribute(data, TILT, _tilts(data, values, colors_of, radius))
    else:
        remove_attributes(data, TILT)
    if not data.color_attributes.active_color_name:
        data.color_attributes.active_color_name = SOLID
    return data.color_attributes.active_color_name


def _tilts(data, values, colors_of, radius):
    """Return the derivative of colours by the value, (n, 3), averaged across each disc."""
    slope = np.linalg.norm(read_attribute(data, SLOPE).astype(np.float64), axis=1)
    rise = slope * radius * np.linalg.norm(read_attribute(data, DISC), axis=1)
    low, high = values - rise, values + rise
    some = (rise > 1e-6 * max(float(np.ptp(values)), 1e-30)) & (high > low)  # values may differ by rounding alone
    low, high = low[some], high[some]
    tilts = np.zeros((point_count(data), 3))
    tilts[some] = (colors_of(high) - colors_of(low))[:, :3] / (high - low)[:, None]
    return tilts
