"""Show points as discs tangent to the surface, without an analysis."""

import bpy

from ... import core
from ..objects.attributes import DISC, tag_changed
from ..objects.carried import write_discs
from ..objects.handlers import notify
from ..objects.reading import chosen_sides, discs, read_points
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ApplicationOperator


class MESHFREE_OT_show_surface(ApplicationOperator, bpy.types.Operator):
    """Draw each point as a disc tangent to the surface, sized by its Voronoi cell"""

    bl_idname = "meshfree.show_surface"
    bl_label = "Show as Surface"
    writes = (DISC,)

    def plan(self, context, obj):
        reading = read_points(context, obj)
        local = reading.local(reading.points)
        sides = chosen_sides(obj)

        def compute(progress):
            found = cache.fetch(
                cache.content("discs", local), lambda: core.surface.surface_discs(local, progress=progress)
            )
            normals = found.normals if sides is None else core.geometry.toward(found.normals, sides)
            return discs(normals, found.radii, local)

        return compute

    def write(self, context, obj, result):
        write_discs(obj, result)
        obj.meshfree.point_shape = "DISCS"
        tag_changed(obj.data)
        return [f"{obj.name}: {len(result):,} points are shown as discs"]

    def conclude(self, context, objects):
        for obj in objects:
            notify("surface_found", obj)


TOOLS = (Registration(MESHFREE_OT_show_surface, menu=Row("Object", 1, 1)),)
