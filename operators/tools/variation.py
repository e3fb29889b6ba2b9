"""How far the neighborhoods of points are from planes."""

import bpy

from ... import core
from ...command.quantities import SURFACE_VARIATION
from ...command.results import variation_line
from ..objects.attributes import tag_changed, write_attribute
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ShownOperator, Tool, operator_reader


class SurfaceVariation(Tool):
    """The work of `meshfree.surface_variation`."""

    writes = (SURFACE_VARIATION,)

    def plan(self, context, obj):
        _, operator = operator_reader(context, obj)

        def compute(progress):
            laplacian = operator(progress)
            return cache.result(laplacian, "variation", compute=lambda: core.measure.surface_variation(laplacian))

        return compute

    def write(self, context, obj, result):
        write_attribute(obj.data, SURFACE_VARIATION, result)
        tag_changed(obj.data)
        return [f"{obj.name}: {variation_line(result)}"]


class MESHFREE_OT_surface_variation(SurfaceVariation, ShownOperator, bpy.types.Operator):
    """Measure how far the neighborhood of each point is from a plane: edges, corners and noise are large"""

    bl_idname = "meshfree.surface_variation"
    bl_label = "Surface Variation"


TOOLS = (Registration(MESHFREE_OT_surface_variation, panel=Row("Measure", 1, 3), menu=Row("Object", 3, 4)),)
