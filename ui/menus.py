"""Menus of the 3D view, where the search (F3) finds operators; File > Import and Export; dropped files."""

import bpy

from ..core.files import SCANS
from ..operators import registration
from ..operators.files.importing import DROPPED
from ..operators.objects.reading import TYPES
from .panel import draw_tasks


class MESHFREE_MT_object(bpy.types.Menu):
    """All tools for point clouds"""

    bl_label = "Mesh-Free"

    def draw(self, context):
        _draw_tools(self.layout, "menu", "Object")
        self.layout.operator_menu_enum("meshfree.convert", "target")


class MESHFREE_MT_points(bpy.types.Menu):
    """Selecting points, and the groups that the tools use"""

    bl_label = "Mesh-Free"

    def draw(self, context):
        _draw_tools(self.layout, "menu", "Points")
        self.layout.separator()
        _draw_assign(self.layout)
        self.layout.operator("meshfree.handle_add")


def _draw_tools(layout, kind, home):
    for index, group in enumerate(registration.groups(kind, home)):
        if index:
            layout.separator()
        for tool in group:
            layout.operator(tool.operator.bl_idname)


def _draw_assign(layout):
    layout.operator_menu_enum("meshfree.group_from_selection", "role").action = "ADD"


def _draw_object(menu, context):
    menu.layout.separator()
    menu.layout.menu(MESHFREE_MT_object.__name__)


def _draw_parent(menu, context):
    menu.layout.separator()
    menu.layout.operator("meshfree.auto_weights", text="With Mesh-Free Weights")


def _draw_points(menu, context):
    menu.layout.separator()
    menu.layout.menu(MESHFREE_MT_points.__name__)


def _draw_object_quick(menu, context):
    """Draw the frequent tools of clouds, and the menu of all tools; for other meshes the menu only."""
    obj, layout = context.object, menu.layout
    if obj is None or obj.type not in TYPES:
        return
    layout.separator()
    if obj.type != "MESH" or not obj.data.polygons:
        layout.operator("meshfree.analyze")
        draw_tasks(layout)
    layout.menu(MESHFREE_MT_object.__name__)


def _draw_points_quick(menu, context):
    layout = menu.layout
    layout.separator()
    if context.object.type != "MESH" or not context.object.data.polygons:
        _draw_tools(layout, "quick", "Points")
        _draw_assign(layout)
    layout.menu(MESHFREE_MT_points.__name__)


def _draw_import(self, _context):
    self.layout.operator(
        "meshfree.import_points", text="Points (.las/.laz/.e57/.ply/.pcd/.obj/.xyz/.pts/.ptx/.csv/.npy/.splat/.spz)"
    )
    self.layout.operator("meshfree.import_tiles", text="Point Tiles (.las/.laz/.copc.laz/.ply)")


def _draw_export(self, _context):
    layout = self.layout
    layout.operator("meshfree.export_points", text="Points with Results (.ply/.xyz/.csv)")
    layout.operator("meshfree.export_splats", text="Gaussian Splats (.ply)")
    layout.operator("meshfree.export_operator", text="Laplacian and Modes (.npz)")
    layout.operator("meshfree.export_eigenvalues", text="Eigenvalues (.csv)")
    layout.operator("meshfree.export_measures", text="Measures (.csv)")
    layout.operator("meshfree.export_profile", text="Profile (.csv/.svg)")


class MESHFREE_FH_points(bpy.types.FileHandler):
    """Import files dropped onto a 3D view; where Blender or Point Tiles read them, too, a menu offers both"""

    bl_idname = "MESHFREE_FH_points"
    bl_label = "Points"
    bl_import_operator = "meshfree.import_points"
    bl_file_extensions = ";".join(DROPPED)

    @classmethod
    def poll_drop(cls, context):
        return context.area is not None and context.area.type == "VIEW_3D"


class MESHFREE_FH_tiles(bpy.types.FileHandler):
    """Offer laser scans dropped onto a 3D view as one object, too, in the menu that Blender shows for two handlers"""

    bl_idname = "MESHFREE_FH_tiles"
    bl_label = "Point Tiles"
    bl_import_operator = "meshfree.import_tiles"
    bl_file_extensions = ";".join(SCANS)
    poll_drop = MESHFREE_FH_points.poll_drop


def _draw_weights(menu, context):
    menu.layout.separator()
    menu.layout.operator("meshfree.smooth_weights", text="Smooth Along Surface")
    menu.layout.operator("meshfree.weights_from_selection")


_EDITING = {
    "VIEW3D_MT_edit_mesh": _draw_points,
    "VIEW3D_MT_edit_pointcloud": _draw_points,
    "VIEW3D_MT_edit_mesh_context_menu": _draw_points_quick,
    "VIEW3D_MT_edit_pointcloud_context_menu": _draw_points_quick,
}


def entries():
    """Yield menus with their additional draw functions; point clouds have an Edit Mode from Blender 4.5 on."""
    yield bpy.types.VIEW3D_MT_object, _draw_object
    yield bpy.types.VIEW3D_MT_object_parent, _draw_parent
    yield bpy.types.VIEW3D_MT_edit_mesh_weights, _draw_weights
    yield bpy.types.VIEW3D_MT_paint_weight, _draw_weights
    yield bpy.types.VIEW3D_MT_object_context_menu, _draw_object_quick
    for menu, draw in _EDITING.items():
        if hasattr(bpy.types, menu):
            yield getattr(bpy.types, menu), draw
    yield bpy.types.TOPBAR_MT_file_import, _draw_import
    yield bpy.types.TOPBAR_MT_file_export, _draw_export


def attach():
    """Add the entries to Blender's menus."""
    for menu, draw in entries():
        menu.append(draw)


def detach():
    """Remove the entries from Blender's menus."""
    for menu, draw in entries():
        menu.remove(draw)


CLASSES = (MESHFREE_MT_object, MESHFREE_MT_points, MESHFREE_FH_points, MESHFREE_FH_tiles)
