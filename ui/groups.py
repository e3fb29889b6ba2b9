"""Groups of points that tools use, drawn with these tools, and the panel for selecting points."""

import bpy.utils.previews

from ..operators.objects.counting import members
from ..operators.objects.groups import has_group
from ..operators.objects.reading import TYPES
from ..tools.groups import ANCHOR, BOUNDARY_GROUP, FIXED, HANDLE, HIGH, LOW, ROLES, SOURCE, VALUE
from . import colormaps
from .panel import SidebarPanel, draw_tools

_TITLES = {
    HANDLE: "Handles",
    ANCHOR: "Anchors",
    FIXED: "Fixed",
    SOURCE: "Sources",
    LOW: "Low",
    HIGH: "High",
    VALUE: "Values",
    BOUNDARY_GROUP: "Boundary",
}
_SIZE, _EDGE = 16, 2  # pixels of a swatch, the picture of a group's color, and empty ones around it
_swatches = []  # the collection of Blender that holds them


class MESHFREE_PT_select(SidebarPanel, bpy.types.Panel):
    """Selecting points, where Blender's own tools need faces"""

    bl_label = "Select"
    bl_parent_id = "MESHFREE_PT_main"

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type in TYPES and context.object.mode == "EDIT"

    def draw(self, context):
        draw_tools(self.layout, self.bl_label)
        _draw_clip(self.layout)


def draw_groups(layout, obj, *roles):
    """Draw the buttons that assign points to groups, select their points, and remove points from them."""
    column = layout.column(align=True)
    for role in roles:
        _draw_group(column.split(factor=0.6, align=True), obj, role, _TITLES[role])


def _draw_clip(layout):
    """Draw the button of Blender's clipping region, which keeps what lies in a box that one drags."""
    row = layout.row()
    row.operator_context = "INVOKE_REGION_WIN"
    row.operator("view3d.clip_border", text="Clip to Box")


def _draw_group(row, obj, role, title):
    icon = {"icon_value": _swatches[0][role].icon_id} if obj.meshfree.show_groups else {}
    assign = row.operator("meshfree.group_from_selection", text=f"Assign to {title}", **icon)
    assign.role, assign.action = role.upper(), "ADD"
    found = members(obj, role, glance=True)
    held = row.row(align=True)
    held.enabled = has_group(obj, role)
    text = "..." if found is None else f"{found.count:,}"
    held.operator("meshfree.select_group", text=text, icon="RESTRICT_SELECT_OFF").name = role
    remove = held.operator("meshfree.group_from_selection", text="", icon="REMOVE")
    remove.role, remove.action = role.upper(), "REMOVE"


def attach():
    """Make the color icons of groups."""
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
    _swatches.append(pictures)


def detach():
    """Free the color icons."""
    while _swatches:
        bpy.utils.previews.remove(_swatches.pop())


CLASSES = (MESHFREE_PT_select,)
