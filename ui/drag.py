"""Dragging the legend over the 3D view, whose position is a setting of the object."""

import bpy

from .overlay import drawn_object, in_view


class MESHFREE_GT_legend(bpy.types.Gizmo):
    """The legend, for the mouse that drags it"""

    bl_idname = "MESHFREE_GT_legend"

    def draw(self, context):
        """Draw nothing: the legend is drawn with the other pictures."""

    def _found(self, context):
        """Return the object, its legend's lower left corner, None where there is none, and how that is placed."""
        obj = drawn_object(context)
        if obj is None:
            return None, None, None
        found, placed = in_view(context, obj)
        return obj, (found[0][1] if placed is not None else None), placed

    def test_select(self, context, location):
        _, corner, placed = self._found(context)
        if corner is None:
            return -1
        inside = all(0.0 <= location[axis] - corner[axis] <= placed.size[axis] for axis in (0, 1))
        return 0 if inside else -1

    def invoke(self, context, event):
        self._obj, corner, _ = self._found(context)
        self._before = tuple(self._obj.meshfree.legend_place)
        self._held = corner[0] - event.mouse_region_x, corner[1] - event.mouse_region_y
        return {"RUNNING_MODAL"}

    def modal(self, context, event, tweak):
        obj, _, placed = self._found(context)
        if obj == self._obj and placed is not None:
            corner = event.mouse_region_x + self._held[0], event.mouse_region_y + self._held[1]
            obj.meshfree.legend_place = placed.shares(corner)
        return {"RUNNING_MODAL"}

    def exit(self, context, cancel):
        if cancel:
            self._obj.meshfree.legend_place = self._before
        else:
            bpy.ops.ed.undo_push(message="Move Legend")


class MESHFREE_GGT_legend(bpy.types.GizmoGroup):
    """Dragging the legend"""

    bl_idname = "MESHFREE_GGT_legend"
    bl_label = "Legend"
    bl_space_type = "VIEW_3D"
    bl_region_type = "WINDOW"
    bl_options = {"PERSISTENT"}

    @classmethod
    def poll(cls, context):
        return drawn_object(context) is not None

    def setup(self, context):
        self.gizmos.new(MESHFREE_GT_legend.bl_idname)


CLASSES = (MESHFREE_GT_legend, MESHFREE_GGT_legend)
