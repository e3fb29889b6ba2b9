"""The extension's preferences: a link to its manual."""

from pathlib import Path

import bpy

_ROOT = __package__.rpartition(".")[0]
MANUAL = Path(__file__).parents[1] / "manual" / "manual.html"  # beside the code in the zip


class MESHFREE_AP_preferences(bpy.types.AddonPreferences):
    """The manual"""

    bl_idname = _ROOT

    def draw(self, context):
        self.layout.operator("wm.url_open", text="Open the Manual", icon="HELP").url = MANUAL.as_uri()


CLASSES = (MESHFREE_AP_preferences,)
