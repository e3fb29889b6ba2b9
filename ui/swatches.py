"""Small pictures of one color, for the panels."""

import bpy.utils.previews

from ..operators.objects.groups import ROLES
from . import colormaps

_SIZE = 16  # pixels
_EDGE = 2  # empty ones around it
_pictures = []  # the collection of Blender that holds them


def attach():
    """Make the swatches of groups."""
    pictures = bpy.utils.previews.new()
    for role in ROLES:
        picture = pictures.new(role)
        picture.icon_size = (_SIZE, _SIZE)
        inside = range(_EDGE, _SIZE - _EDGE)
        color, nothing = colormaps.to_display(colormaps.group_color(role)), (0.0, 0.0, 0.0, 0.0)
        picture.icon_pixels_float = [
            value
            for row in range(_SIZE)
            for column in range(_SIZE)
            for value in (color if row in inside and column in inside else nothing)
        ]
    _pictures.append(pictures)


def detach():
    """Give the pictures back."""
    while _pictures:
        bpy.utils.previews.remove(_pictures.pop())


def swatch(role: str) -> int:
    """Number of the icon in the color of a group."""
    return _pictures[0][role].icon_id
