"""Gaussian splats: show them in their own colors, and give them the place of their object."""

import bpy
import numpy as np
from mathutils import Matrix

from ...core import PointCloudError
from ..objects.all_or_nothing import all_or_nothing
from ..objects.handlers import tell
from ..objects.modifiers import is_deform
from ..objects.positions import check_movable
from ..objects.reading import sharing_objects
from ..objects.splats import has_splats, read_splats, write_splats
from ..running.ready import ReadyOperator, reporting


class SplatOperator(ReadyOperator):
    """An operator on the splats of the active object."""

    @classmethod
    def obstacle(cls, context):
        reason = super().obstacle(context)
        if reason or has_splats(context.object.data):
            return reason
        return f'"{context.object.name}" holds no Gaussian splats. Import a file of splats'


class MESHFREE_OT_show_splats(SplatOperator, bpy.types.Operator):
    """Draw Gaussian splats as ellipsoids in their own colors"""

    bl_idname = "meshfree.show_splats"
    bl_label = "Show Splats"

    @reporting
    def execute(self, context):
        with all_or_nothing([context.object]):
            tell("splats_found", context.object)
        return {"FINISHED"}


class MESHFREE_OT_apply_to_splats(SplatOperator, bpy.types.Operator):
    """Apply location, rotation and scale of the object to its splats: to their sizes, rotations and harmonics, too"""

    bl_idname = "meshfree.apply_to_splats"
    bl_label = "Apply Transform to Splats"

    @reporting
    def execute(self, context):
        obj = context.object
        check_movable(obj, "IN_PLACE")
        others = sharing_objects(obj)
        if others:
            raise PointCloudError(
                f'"{obj.name}" shares its points with "{others[0].name}". Make it a single user first.'
            )
        if any(map(is_deform, obj.modifiers)):
            raise PointCloudError(f'"{obj.name}" is bound to handles. Unbind it first.')
        matrix = np.array(obj.matrix_basis, dtype=np.float64)
        if not np.linalg.cond(matrix[:3, :3]) < 1e6:
            raise PointCloudError(
                f'"{obj.name}" is scaled to nothing along an axis. Give it a scale above zero along each axis.'
            )
        splats = read_splats(obj.data)
        maps = np.broadcast_to(matrix[:3, :3], (len(splats), 3, 3))
        with all_or_nothing([obj]):
            write_splats(obj.data, splats.deformed(splats.positions @ matrix[:3, :3].T + matrix[:3, 3], maps))
            children = [(child, child.matrix_world.copy()) for child in obj.children]
            obj.matrix_basis = Matrix()
            context.view_layer.update()
            for child, place in children:
                child.matrix_world = place
        self.report({"INFO"}, f"{obj.name}: its place is in its {len(splats):,} splats now")
        return {"FINISHED"}


CLASSES = (MESHFREE_OT_show_splats, MESHFREE_OT_apply_to_splats)
