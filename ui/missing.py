"""The panel in place of all others where no usable scipy is installed."""

import importlib.util
import sys
from pathlib import Path

import bpy

from .. import core
from .wrapping import draw_text

_OURS = "scipy-1.15.*.dist-info"  # of the wheel in the manifest


def scipy_serves():
    """Whether a usable scipy is installed; only one that is not ours is imported, which takes a second."""
    found = importlib.util.find_spec("scipy")
    if found is None:
        return False  # no wheel is for this Python
    if any(Path(found.origin).parents[1].glob(_OURS)):
        return True
    try:
        return hasattr(core, "build_laplacian")
    except core.BrokenLibraryError:
        return False


def _lines():
    """Return what is wrong, and what to do."""
    try:
        import scipy
    except ImportError:
        return (
            "Mesh-Free Laplacian does nothing here:",
            f"it brings no scipy for Python {sys.version_info.major}.{sys.version_info.minor}.",
            "Get a newer version of it, or use Blender 4.2 to 5.2.",
        )
    return (
        "Mesh-Free Laplacian does nothing here:",
        f"scipy {scipy.__version__}, which something else brings, does not serve it.",
        "Disable the extension that brings it, and restart Blender.",
    )


class MESHFREE_PT_missing(bpy.types.Panel):
    """Why there is nothing else"""

    bl_label = "Mesh-Free Laplacian"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Mesh-Free"

    def draw(self, context):
        column = self.layout.column(align=True)
        for line, icon in zip(_lines(), ("ERROR", "BLANK1", "BLANK1"), strict=True):
            draw_text(column, context, line, icon)


CLASSES = (MESHFREE_PT_missing,)


def attach():
    """Print it in the console too."""
    print(*_lines())
