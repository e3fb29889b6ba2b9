"""The panels of applications of the operator."""

import bpy

from .panel import ReadyPanel, draw_tools


class ToolPanel(ReadyPanel):
    """A panel with the tools whose rows have its label as home."""

    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        draw_tools(self.layout, self.bl_label)


class MESHFREE_PT_measure(ToolPanel, bpy.types.Panel):
    """Quantities at each point: curvature, roughness, distances, fields"""

    bl_label = "Measure"


class MESHFREE_PT_clean(ToolPanel, bpy.types.Panel):
    """Denoising and other filters of the shape, and the orientation of normals"""

    bl_label = "Clean"


class MESHFREE_PT_simulate(ToolPanel, bpy.types.Panel):
    """Heat, waves, patterns and fronts along the surface, frame by frame"""

    bl_label = "Simulate"


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
