"""Menus of the 3D view, which is where the search (F3) finds operators."""

import bpy

_TOOLS = (
    ("analyze", "spectrum", "colormap"),
    ("smooth", "mode_shape"),
    ("segment", "separate_by_segment", "signature"),
    ("geodesic_distance", "harmonic_field"),
    ("deform_bind", "deform_update"),
    ("minimal_surface",),
    ("stop",),
)
_SELECTING = ("select_grow", "select_component", "select_front", "select_rim")


class MESHFREE_MT_object(bpy.types.Menu):
    """All tools for point clouds"""

    bl_label = "Mesh-Free"

    def draw(self, context):
        for index, names in enumerate(_TOOLS):
            if index:
                self.layout.separator()
            for name in names:
                self.layout.operator(f"meshfree.{name}")


class MESHFREE_MT_points(bpy.types.Menu):
    """Selecting points, and the groups that the tools take"""

    bl_label = "Mesh-Free"

    def draw(self, context):
        for name in _SELECTING:
            self.layout.operator(f"meshfree.{name}")
        self.layout.separator()
        self.layout.operator_menu_enum("meshfree.group_from_selection", "role")


def _draw_object(menu, context):
    menu.layout.separator()
    menu.layout.menu(MESHFREE_MT_object.__name__)


def _draw_points(menu, context):
    menu.layout.separator()
    menu.layout.menu(MESHFREE_MT_points.__name__)


def attach():
    """Add the menus to those of the 3D view."""
    bpy.types.VIEW3D_MT_object.append(_draw_object)
    bpy.types.VIEW3D_MT_edit_mesh.append(_draw_points)


def detach():
    """Take them out again."""
    bpy.types.VIEW3D_MT_edit_mesh.remove(_draw_points)
    bpy.types.VIEW3D_MT_object.remove(_draw_object)


CLASSES = (MESHFREE_MT_object, MESHFREE_MT_points)
