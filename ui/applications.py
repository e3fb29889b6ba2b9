"""The panels of applications of the operator."""

import bpy

from ..operators.objects import motion_files
from ..tools.quantities import STRAY
from .measures import draw_measures
from .panel import ReadyPanel, draw_tools
from .wrapping import draw_text


class ToolPanel(ReadyPanel):
    """A panel with the tools whose rows have its label as home."""

    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        draw_tools(self.layout, self.bl_label)


class MESHFREE_PT_measure(ToolPanel, bpy.types.Panel):
    """Quantities at each point: curvature, roughness, distances, fields"""

    bl_label = "Measure"

    def draw(self, context):
        draw_tools(self.layout, self.bl_label)
        draw_measures(self.layout, context)


class MESHFREE_PT_clean(ToolPanel, bpy.types.Panel):
    """Stray points, denoising and other filters of the shape, and the orientation of normals"""

    bl_label = "Clean"

    def draw(self, context):
        if STRAY in context.object.data.attributes:
            _draw_strays(self.layout)
        draw_tools(self.layout, self.bl_label)


def _draw_strays(layout):
    """Draw what can be done with the stray points on show."""
    layout.label(text="Stray Points")
    row = layout.row(align=True)
    for action, text in (("SELECT", "Select"), ("HIDE", "Hide"), ("SEPARATE", "Separate"), ("DELETE", "Delete")):
        button = row.operator("meshfree.stray_points", text=text)
        button.action, button.as_shown = action, True


class MESHFREE_PT_simulate(ToolPanel, bpy.types.Panel):
    """Heat, waves, patterns and fronts along the surface, frame by frame"""

    bl_label = "Simulate"

    def draw(self, context):
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


class MESHFREE_PT_segment(ToolPanel, bpy.types.Panel):
    """Parts of the surface"""

    bl_label = "Segment"


class MESHFREE_PT_surface(ToolPanel, bpy.types.Panel):
    """The surface as a mesh"""

    bl_label = "Mesh"


class MESHFREE_PT_minimal(ToolPanel, bpy.types.Panel):
    """Minimal surfaces"""

    bl_label = "Minimal Surface"
    bl_order = 2  # below what is done every day


CLASSES = (
    MESHFREE_PT_measure,
    MESHFREE_PT_clean,
    MESHFREE_PT_segment,
    MESHFREE_PT_surface,
    MESHFREE_PT_simulate,
    MESHFREE_PT_minimal,
)
