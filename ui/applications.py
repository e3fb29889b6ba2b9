"""The panels of what the operator is for."""

import bpy

from .panel import ReadyPanel


class MESHFREE_PT_measure(ReadyPanel, bpy.types.Panel):
    """What can be told of each point: how the surface bends, how rough it is, how far it is to others"""

    bl_label = "Measure"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.layout.column(align=True)
        column.operator("meshfree.principal_curvatures", text="Principal Curvatures...")
        column.operator("meshfree.roughness", text="Roughness...")
        column = self.layout.column(align=True)
        column.operator("meshfree.geodesic_distance", text="Geodesic Distance...")
        column.operator("meshfree.signed_distance", text="Signed Distance...")
        column.operator("meshfree.harmonic_field", text="Harmonic Field...")
        column = self.layout.column(align=True)
        column.operator("meshfree.nearest_source", text="Nearest Source...")
        column.operator("meshfree.unwrap", text="Unwrap Around Point...")
        column.operator("meshfree.extend_direction", text="Extend Direction...")
        self.layout.operator("meshfree.signature", text="Signatures...")
        self.layout.operator("meshfree.compare", text="Compare Points...")


class MESHFREE_PT_clean(ReadyPanel, bpy.types.Panel):
    """Removing noise and other filters of the shape, and which side normals point to"""

    bl_label = "Clean"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.layout.column(align=True)
        column.operator("meshfree.smooth", text="Smooth Points...")
        column.operator("meshfree.orient_normals", text="Orient Normals...")


class MESHFREE_PT_segment(ReadyPanel, bpy.types.Panel):
    """Parts of the surface"""

    bl_label = "Segment"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.layout.column(align=True)
        column.operator("meshfree.segment", text="Segment...")
        column.operator("meshfree.separate_by_segment")


class MESHFREE_PT_surface(ReadyPanel, bpy.types.Panel):
    """The surface as a mesh"""

    bl_label = "Mesh"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        self.layout.operator("meshfree.mesh_surface", text="Surface from Points...")


class MESHFREE_PT_minimal(ReadyPanel, bpy.types.Panel):
    """Minimal surfaces"""

    bl_label = "Minimal Surface"
    bl_options = {"DEFAULT_CLOSED"}
    bl_order = 2  # below what is done every day

    def draw(self, context):
        self.layout.operator("meshfree.minimal_surface", text="Minimal Surface...")


CLASSES = (MESHFREE_PT_measure, MESHFREE_PT_clean, MESHFREE_PT_segment, MESHFREE_PT_surface, MESHFREE_PT_minimal)
