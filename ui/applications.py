"""The panels of tools: Clean, Measure, Two Scans, Move and Make."""

import bpy

from ..operators.deform.handles import handled_object
from ..operators.objects import motion_files
from ..operators.objects.reading import TYPES, obstacle
from ..operators.tools.convert import MESHFREE_OT_convert
from ..tools.quantities import DEVIATION, STRAY
from .measures import draw_measures, draw_selection
from .panel import SidebarPanel, ToolPanel, draw_tools
from .wrapping import draw_text


class MESHFREE_PT_clean(ToolPanel, bpy.types.Panel):
    """Stray points, fewer points, smoothing and other filters of the shape, and the orientation of normals"""

    bl_label = "Clean"
    bl_order = 3

    def draw_more(self, layout, context):
        if STRAY not in context.object.data.attributes:
            return
        column = layout.column(align=True)
        column.label(text="Stray Points")
        for actions in ((("SELECT", "Select"), ("HIDE", "Hide")), (("SEPARATE", "Separate"), ("DELETE", "Delete"))):
            row = column.row(align=True)
            for action, text in actions:
                button = row.operator("meshfree.stray_points", text=text)
                button.action, button.as_shown = action, True


class MESHFREE_PT_measure(ToolPanel, bpy.types.Panel):
    """Sizes of selected points and of parts, paths, profiles and sections, curvature and roughness"""

    bl_label = "Measure"
    bl_order = 4

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type in TYPES

    def draw_more(self, layout, context):
        draw_selection(layout, context)
        draw_measures(layout, context)


class MESHFREE_PT_two_scans(ToolPanel, bpy.types.Panel):
    """One cloud beside another: moved onto it, compared with it, or given what it has"""

    bl_label = "Two Scans"
    bl_order = 5

    def draw_more(self, layout, context):
        """Draw what an object was compared with, and the button that exchanges both."""
        obj = context.object
        kept = obj.meshfree
        if kept.compared_with is None or DEVIATION not in obj.data.attributes:
            return
        hidden = ", which is hidden" if kept.compared_with.hide_get() else ""
        column = layout.column(align=True)
        draw_text(column, context, f"{obj.name} compared with {kept.compared_with.name}{hidden}", "INFO")
        swap = column.operator("meshfree.compare_swap", text="Swap")
        swap.greatest, swap.distance = kept.compared_within, "NEAREST" if kept.compared_nearest else "NORMAL"


class MESHFREE_PT_move(SidebarPanel, bpy.types.Panel):
    """Bending by handles, bones, and motions along the surface"""

    bl_label = "Move"
    bl_parent_id = "MESHFREE_PT_main"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 6

    @classmethod
    def poll(cls, context):
        obj = context.object
        bends = not obstacle(handled_object(obj, context.scene), modes=("OBJECT", "EDIT"))
        return bends or (obj is not None and obj.type == "ARMATURE")

    def draw(self, context):
        if not obstacle(context.object):
            draw_tools(self.layout, self.bl_label)
            _draw_frames(self.layout, context)


def _draw_frames(layout, context):
    """Draw what frames take on disk: those on show, and former ones that stay until the file is closed."""
    shown, former = motion_files.frames_of(context.object), motion_files.former()
    column = layout.column(align=True)
    if shown is not None:
        draw_text(column, context, f"Frames on disk: {_megabytes([shown])}")
    if former:
        draw_text(column, context, f"Former ones, for Undo: {_megabytes(former)}, until this file is closed")


def _megabytes(paths):
    return f"{motion_files.size_of(paths) / 2**20:.1f} MB"


class MESHFREE_PT_make(ToolPanel, bpy.types.Panel):
    """The surface as a mesh, parts of it, and texture coordinates"""

    bl_label = "Make"
    bl_order = 7

    def draw_more(self, layout, context):
        if bpy.app.version >= MESHFREE_OT_convert.since:
            to_mesh = context.object.type != "MESH"
            text = "Convert to Mesh" if to_mesh else "Convert to Point Cloud"
            layout.operator("meshfree.convert", text=text).target = "MESH" if to_mesh else "POINTCLOUD"


CLASSES = (
    MESHFREE_PT_clean,
    MESHFREE_PT_measure,
    MESHFREE_PT_two_scans,
    MESHFREE_PT_move,
    MESHFREE_PT_make,
)
