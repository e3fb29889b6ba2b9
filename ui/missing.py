"""What stands in the sidebar in place of all panels where the bundled scipy does not fit this Blender."""

import sys

import bpy

_LINES = (
    "Mesh-Free Laplacian does nothing here:",
    f"it brings no scipy for Python {sys.version_info.major}.{sys.version_info.minor}.",
    "Get a newer version of it, or use Blender 4.2 to 5.2.",
)


class MESHFREE_PT_missing(bpy.types.Panel):
    """Why there is nothing else"""

    bl_label = "Mesh-Free Laplacian"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Mesh-Free"

    def draw(self, context):
        column = self.layout.column(align=True)
        for line, icon in zip(_LINES, ("ERROR", "BLANK1", "BLANK1"), strict=True):
            column.label(text=line, icon=icon)


CLASSES = (MESHFREE_PT_missing,)


def attach():
    """Say it in the console too."""
    print(*_LINES)
