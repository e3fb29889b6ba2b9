"""The panels of what the operator is for."""

import bpy

from .panel import ReadyPanel


class MESHFREE_PT_curvature(ReadyPanel, bpy.types.Panel):
    """How the surface bends, and how rough it is"""

    bl_label = "Curvature"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.layout.column(align=True)
        column.operator("meshfree.principal_curvatures", text="Principal Curvatures...")
        column.operator("meshfree.roughness", text="Roughness...")


class MESHFREE_PT_shape(ReadyPanel, bpy.types.Panel):
    """Shapes by frequency"""

    bl_label = "Smooth"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.layout.column(align=True)
        column.operator("meshfree.smooth", text="Smooth Points...")
        column.operator("meshfree.mode_shape", text="Deform by Mode...")


class MESHFREE_PT_segment(ReadyPanel, bpy.types.Panel):
    """Parts and signatures"""

    bl_label = "Segment"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.layout.column(align=True)
        column.operator("meshfree.segment", text="Segment...")
        column.operator("meshfree.separate_by_segment")
        self.layout.operator("meshfree.signature", text="Signatures...")


class MESHFREE_PT_fields(ReadyPanel, bpy.types.Panel):
    """Fields and distances"""

    bl_label = "Fields"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.layout.column(align=True)
        column.operator("meshfree.geodesic_distance", text="Geodesic Distance...")
        column.operator("meshfree.harmonic_field", text="Harmonic Field...")
        column = self.layout.column(align=True)
        column.operator("meshfree.nearest_source", text="Nearest Source...")
        column.operator("meshfree.unwrap", text="Unwrap Around Point...")
        column.operator("meshfree.extend_direction", text="Extend Direction...")


class MESHFREE_PT_minimal(ReadyPanel, bpy.types.Panel):
    """Minimal surfaces"""

    bl_label = "Minimal Surface"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        self.layout.operator("meshfree.minimal_surface", text="Minimal Surface...")


CLASSES = (
    MESHFREE_PT_curvature,
    MESHFREE_PT_shape,
    MESHFREE_PT_segment,
    MESHFREE_PT_fields,
    MESHFREE_PT_minimal,
)
