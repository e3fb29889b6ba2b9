"""Bind to Armature: objects that have weights of bones follow them."""

import bpy

from ...core import PointCloudError
from ..deform.binding import WRITES
from ..objects.attributes import point_count
from ..objects.reading import TYPES, find_object, obstacle
from ..registration import Registration, Row
from ..running.application import ApplicationOperator
from .bones import chosen_armature
from .follow import add_modifier, plan_bound, set_parent, write_bound


class ArmatureOperator(ApplicationOperator):
    """An operator that lets the selected points follow the bones of an armature."""

    @classmethod
    def subject(cls, context):
        """Return the first object whose points shall follow."""
        found = [obj for obj in (context.object, *context.selected_objects) if obj is not None and obj.type in TYPES]
        return next((obj for obj in found if not obstacle(obj, cls.works_in)), found[0] if found else context.object)

    @classmethod
    def obstacle(cls, context):
        armature = chosen_armature(context)
        if armature is None:
            return "No armature is chosen. Select the points, then an armature, which becomes the active object"
        if armature.mode == "EDIT":
            return f'"{armature.name}" is in Edit Mode. Switch to Object Mode first'
        if cls.subject(context) == armature:
            return f'"{armature.name}" is selected alone. Select the points too that shall follow its bones'
        return super().obstacle(context)


class MESHFREE_OT_bind_armature(ArmatureOperator, bpy.types.Operator):
    """Let selected points and splats follow the bones of an armature by the weights that they have"""

    bl_idname = "meshfree.bind_armature"
    bl_label = "Bind to Armature"
    writes = WRITES

    def plan(self, context, obj):
        armature = chosen_armature(context)
        bound = plan_bound(context, obj, armature)
        return lambda progress: (armature.session_uid, bound)

    def write(self, context, obj, result):
        uid, bound = result
        armature = find_object(uid)
        if armature is None or len(bound.rest) != point_count(obj.data):
            raise PointCloudError(f'"{obj.name}" or its armature was changed meanwhile. Start it again.')
        add_modifier(obj, armature)
        set_parent(obj, armature)
        notices = write_bound(obj, armature, bound)
        return [*notices, f"{obj.name}: {len(bound.rest):,} points follow {len(bound.names)} bones of {armature.name}"]


TOOLS = (Registration(MESHFREE_OT_bind_armature, menu=Row("Object", 8, 12)),)
