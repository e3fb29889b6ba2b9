"""The panel of armatures: weights of bones, and what follows them."""

import bpy

from ..operators.objects.reading import obstacle
from ..operators.rigging.bones import chosen_armature
from .follow import draw_follow
from .notices import draw_figures
from .panel import SidebarPanel, draw_tools
from .wrapping import draw_text


class MESHFREE_PT_rig(SidebarPanel, bpy.types.Panel):
    """Weights of bones: points that follow an armature"""

    bl_label = "Rig"
    bl_parent_id = "MESHFREE_PT_move"

    @classmethod
    def poll(cls, context):
        obj = context.object
        return obj is not None and (obj.type == "ARMATURE" or not obstacle(obj))

    def draw(self, context):
        armature = chosen_armature(context)
        if armature is not None:
            draw_text(self.layout, context, f"Bones of {armature.name}", "OUTLINER_OB_ARMATURE")
        draw_tools(self.layout, self.bl_label)
        draw_follow(self.layout, context, context.object)
        draw_figures(self.layout, context, self.bl_label)


CLASSES = (MESHFREE_PT_rig,)
