"""Show as Splats: splats as ellipsoids, also those that another importer has left as plain points with numbers."""

import bpy

from ...core import PointCloudError
from ..objects.all_or_nothing import all_or_nothing
from ..objects.evaluated import POINTCLOUDS_SINCE
from ..objects.handlers import notify
from ..objects.modifiers import is_own
from ..objects.reading import sharing_objects
from ..objects.splats import has_splats, holds_columns
from ..registration import Registration, Row
from ..running.ready import reporting
from ..tools.convert import check_convertible, convert
from ..tools.splats import SplatOperator
from .splats import mark, splats_of_columns, write_in_place


class MESHFREE_OT_show_splats(SplatOperator, bpy.types.Operator):
    """Draw Gaussian splats as ellipsoids in their own colors, also of files that Blender has imported as points"""

    bl_idname = "meshfree.show_splats"
    bl_label = "Show as Splats"

    @staticmethod
    def takes(data):
        return has_splats(data) or holds_columns(data)

    @reporting
    def execute(self, context):
        obj = context.object
        if not has_splats(obj.data):
            self._take_columns(context, obj)
        with all_or_nothing([obj]):
            notify("splats_found", obj)
        return {"FINISHED"}

    def _take_columns(self, context, obj):
        """Let points with the columns of a file of splats be what Import Points makes of that file."""
        check_convertible(obj)
        modifiers = [item.name for item in obj.modifiers if not is_own(item)]
        if modifiers:
            raise PointCloudError(f'"{obj.name}" has modifiers ({", ".join(modifiers)}). Apply or remove them first.')
        splats, kept = splats_of_columns(obj)
        with all_or_nothing([obj]):
            if sharing_objects(obj):  # make_single_user is on, as checked
                obj.data = obj.data.copy()
            write_in_place(context, obj, splats, kept)
        if obj.type == "MESH" and bpy.app.version >= POINTCLOUDS_SINCE:
            convert(context, [obj], "POINTCLOUD")
        mark(obj.data)
        for notice in splats.notices:
            self.warn(notice, obj)
        self.report({"INFO"}, f"{obj.name}: {len(splats):,} Gaussian splats")


TOOLS = (Registration(MESHFREE_OT_show_splats, menu=Row("Object", 1, 2)),)
