"""Entries in File > Import and File > Export, and dropping files onto a 3D view."""

import bpy

from ..operators.importing import OWN


def _draw_import(self, _context):
    self.layout.operator("meshfree.import_points", text="Points (.ply/.obj/.xyz/.pts/.csv/.npy)")


def _draw_export(self, _context):
    layout = self.layout
    layout.operator("meshfree.export_points", text="Points with Results (.ply/.xyz/.csv)")
    layout.operator("meshfree.export_operator", text="Laplacian and Modes (.npz)")
    layout.operator("meshfree.export_eigenvalues", text="Eigenvalues (.csv)")


class MESHFREE_FH_points(bpy.types.FileHandler):
    """Import files that are dropped onto a 3D view, of kinds that Blender does not read by itself"""

    bl_idname = "MESHFREE_FH_points"
    bl_label = "Points"
    bl_import_operator = "meshfree.import_points"
    bl_file_extensions = ";".join(OWN)

    @classmethod
    def poll_drop(cls, context):
        return context.area is not None and context.area.type == "VIEW_3D"


CLASSES = (MESHFREE_FH_points,)


def attach():
    """Add the entries to the menus."""
    bpy.types.TOPBAR_MT_file_import.append(_draw_import)
    bpy.types.TOPBAR_MT_file_export.append(_draw_export)


def detach():
    """Take the entries away again."""
    bpy.types.TOPBAR_MT_file_import.remove(_draw_import)
    bpy.types.TOPBAR_MT_file_export.remove(_draw_export)
