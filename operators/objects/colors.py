"""Colors that points have of their own, such as those of a photograph, beside what results are shown in."""

import bpy
import numpy as np

from ... import core
from .attributes import read_attribute
from .splats import BASE, has_splats

COLOR = "Color"  # the name that imported ones get
COLORS = "BYTE_COLOR", "FLOAT_COLOR"  # types of attributes
_GAMMA = 2.2  # splats are trained in sRGB


def is_color(data, name: str) -> bool:
    """Whether an attribute of a mesh or a point cloud holds colors of its points."""
    attribute = data.attributes.get(name)
    return attribute is not None and attribute.domain == "POINT" and attribute.data_type in COLORS


def own_colors(data) -> str:
    """Return the name of the attribute with the colors of points: the active one, else the first; empty without any.

    Splats have theirs in harmonics, and keep other numbers in attributes of these types.
    """
    names = [] if has_splats(data) else [item.name for item in data.attributes if is_color(data, item.name)]
    active = data.color_attributes.active_color_name if isinstance(data, bpy.types.Mesh) else ""
    return active if active in names else next(iter(names), "")


def splat_colors(data):
    """Return the colors that splats have from all sides alike, linear and opaque, (n, 4)."""
    base = read_attribute(data, BASE)
    base[:, :3] = np.maximum(core.splats.CONSTANT * base[:, :3] + 0.5, 0.0) ** _GAMMA
    base[:, 3] = 1.0
    return base
