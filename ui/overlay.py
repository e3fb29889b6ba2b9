"""Draws legend, histogram and eigenvalues over the 3D view, of the active object or that of the active handle."""

import zlib
from typing import NamedTuple

import bpy
import numpy as np

from ..command.units import EIGENVALUE_POWER, unit
from ..core import PointCloudError
from ..operators.deform.handles import handled_object
from ..operators.objects.attributes import mode_number
from ..operators.objects.result import read_eigenvalues
from . import canvas, editing, plots
from .display import find_display, is_in_solid, range_node, shown_attribute, shown_values, without_unreached
from .scale import shown_scale
from .value_range import histogram

_GAP = 10.0  # between pictures, and to the border
_GIZMOS = 80.0  # width of the view's own controls, at the right edge above the lowest row
_TEXTS = 110.0  # height of the view's own texts, at the upper left
_CORNER = (1.0, 0.0)  # default position of a legend: in the corner where it covers least of the object
_SAMPLE = 500  # points that tell what it covers
_handlers = []
_counted = {}  # the last histogram, by key
_chosen = {}  # the number of the corner of a legend, by the pointer of the region


def attach():
    """Add the draw handler; there are no views in background mode."""
    if not bpy.app.background:
        _handlers.append(bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_PIXEL"))


def detach():
    """Remove the draw handler, and clear the histogram."""
    while _handlers:
        bpy.types.SpaceView3D.draw_handler_remove(_handlers.pop(), "WINDOW")
    _counted.clear()
    _chosen.clear()


def pictures(obj, scene, colored=True) -> list:
    """Return the pictures of an object, the rightmost first; the legend only if its colors are visible."""
    settings = obj.meshfree
    scale = shown_scale(obj, scene) if colored else None
    found = [plots.legend_picture(scale)] if scale is not None and settings.legend else []
    if scale is not None and settings.histogram and range_node(obj) is not None and obj.mode != "EDIT":
        counted = _histogram(obj, scale)
        if counted is not None:
            found.append(plots.histogram_picture(scale, *counted))
    numbers = read_eigenvalues(obj)
    if settings.plot_eigenvalues and len(numbers):
        symbol, factor = unit(EIGENVALUE_POWER, numbers[-1], scene.unit_settings)
        area = settings.total_area if settings.compare_weyl else 0.0
        found.append(plots.spectrum_picture(numbers, mode_number(shown_attribute(obj)), symbol, factor, area))
    return found


def _histogram(obj, scale):
    """Return the histogram of the displayed values, kept while they and the range are unchanged; None if unreadable."""
    try:
        values = np.ascontiguousarray(without_unreached(shown_attribute(obj), shown_values(obj)))
    except PointCloudError:  # the attribute was removed
        return None
    key = zlib.crc32(values.view(np.uint8)), len(values), scale.bounds, bool(scale.boxes)
    if key not in _counted:
        _counted.clear()
        _counted[key] = histogram(values, scale.bounds, bool(scale.boxes))
    return _counted[key]


def arrange(sizes, left, bottom, right, top, indent=0.0) -> list:
    """Place pictures of some widths and heights from the lower right corner to the left, in rows upwards.

    They are within the room from left to right and bottom to top, upper rows with an indent at the right. Return their
    lower left corners; None for those without room.
    """
    places, x, y, row = [], right, bottom, 0.0
    for width, height in sizes:
        if row and x - width < left:
            x, y, row = right - indent, y + row, 0.0
        if x - width < left or y + height > top:
            places.append(None)
            continue
        x, row = x - width, max(row, height)
        places.append((x, y))
    return places


def _free_room(area, region):
    """Return left, bottom, right, top of a region's part that others do not cover, in its pixels."""
    left, bottom, right, top = 0, 0, region.width, region.height
    for other in area.regions:
        x, y = other.x - region.x, other.y - region.y
        apart = x >= region.width or y >= region.height or x + other.width <= 0 or y + other.height <= 0
        if other.type == "WINDOW" or min(other.width, other.height) <= 1 or apart:
            continue
        if other.alignment == "RIGHT":
            right = min(right, x)
        elif other.alignment == "TOP":
            top = min(top, y)
        elif other.alignment == "BOTTOM":
            bottom = max(bottom, y + other.height)
        else:  # the toolbar, and Adjust Last Operation
            left = max(left, x + other.width)
    return left, bottom, right, top


def shows_colors(obj, shading) -> bool:
    """Whether a view with some shading shows the colors of an object's points."""
    modifier = find_display(obj)
    if modifier is None or not modifier.show_viewport:
        return False
    if obj.mode == "EDIT" and not modifier.show_in_editmode:
        return editing.is_drawn(obj, shading)
    return shading.type in {"MATERIAL", "RENDERED"} or (
        shading.type == "SOLID" and shading.color_type == "VERTEX" and is_in_solid(obj)
    )


def drawn_object(context):
    """Return the object whose pictures are drawn over the view of a context, or None."""
    obj = handled_object(context.object, context.scene)
    seen = obj is not None and context.space_data.overlay.show_overlays and obj.visible_get()
    return obj if seen else None


class Placed(NamedTuple):
    """A legend over a view, in pixels of its region: the available room, and its size, both with a gap."""

    room: tuple  # left, bottom, right, top
    size: tuple

    def corner(self, shares):
        """Return the lower left corner for a relative position in the room, from 0 to 1 along both axes."""
        return tuple(self.room[axis] + share * self._free(axis) for axis, share in enumerate(shares))

    def shares(self, corner):
        """Return the relative position of a lower left corner, from 0 to 1."""
        return [min(max((corner[axis] - self.room[axis]) / self._free(axis), 0.0), 1.0) for axis in (0, 1)]

    def _free(self, axis):
        return max(self.room[axis + 2] - self.room[axis] - self.size[axis], 1.0)


def in_view(context, obj):
    """Return the pictures over a view with their lower left corners, None for no room, and how a legend is placed."""
    found = pictures(obj, context.scene, shows_colors(obj, context.space_data.shading))
    scale = context.preferences.system.ui_scale
    gap = scale * _GAP
    left, bottom, right, top = _free_room(context.area, context.region)
    room = left + gap, bottom + gap, right, top
    sizes = [(scale * picture.width + gap, scale * picture.height + gap) for picture in found]
    placed = Placed(room, sizes[0]) if found and found[0].movable else None
    shares, indent = tuple(obj.meshfree.legend_place), scale * _GIZMOS
    if placed is not None and shares != _CORNER:
        corners = [placed.corner(shares), *arrange(sizes[1:], *room, indent)]
    else:
        corners = arrange(sizes, *room, indent)
        if placed is not None and corners[0] is not None:
            corners[0] = _clear_corner(context, obj, placed, corners[0], scale)
    return list(zip(found, corners, strict=True)), placed


def _clear_corner(context, obj, placed, usual, scale):
    """Return where a legend covers least of an object: at its usual corner, or at one of the others."""
    (width, height), (left, bottom, right, top) = placed.size, placed.room
    free = [(left, bottom), (left, top - scale * _TEXTS - height), (right - scale * _GIZMOS - width, top - height)]
    there = [usual, *(corner for corner in free if corner[0] >= left and corner[1] >= bottom)]
    region = context.region.as_pointer()
    _chosen[region] = least_covering(there, placed.size, seen_places(context, obj), _chosen.get(region, 0))
    return there[_chosen[region]]


def seen_places(context, obj):
    """Return where some points of an object are in the view of a context, (k, 2), in pixels of its region."""
    positions = obj.data.attributes.get("position")
    if obj.mode == "EDIT" or positions is None or not len(positions.data):
        places = np.array(obj.bound_box)
    else:
        rows = np.linspace(0, len(positions.data) - 1, min(_SAMPLE, len(positions.data))).astype(int)
        places = np.array([positions.data[row].vector for row in rows.tolist()])
    matrix = np.array(context.region_data.perspective_matrix @ obj.matrix_world)
    x, y, _, depth = matrix[:, :3] @ places.T + matrix[:, 3:]
    size = context.region.width, context.region.height
    return (0.5 * np.stack([x, y], axis=1) / np.where(depth > 0.0, depth, np.nan)[:, None] + 0.5) * size


def least_covering(corners, size, places, now: int) -> int:
    """Choose where a rectangle covers the fewest places, (k, 2); it stays at its present corner unless another is free.

    Corners are lower left ones; places that are not seen are NaN.
    """
    inside = [((places >= corner) & (places <= np.add(corner, size))).all(axis=1) for corner in corners]
    covered = np.array([np.count_nonzero(each) for each in inside])
    now = min(now, len(corners) - 1)
    return now if covered[now] == 0 or covered.min() > 0 else int(np.argmin(covered))


def _draw():
    context = bpy.context
    obj = drawn_object(context)
    for picture, corner in in_view(context, obj)[0] if obj is not None else ():
        if corner is not None:
            canvas.draw(picture, *corner, context.preferences.system.ui_scale)
