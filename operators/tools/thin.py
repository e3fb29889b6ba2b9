"""Fewer points of the same surface, with all that they hold."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from ...command.cleaning import THIN_OUT, thin_line, thinner
from ..objects.attributes import tag_changed
from ..objects.deleting import check_deletable, keep_points
from ..objects.reading import read_points
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running.application import ApplicationOperator, Tool


class ThinOut(Tool):
    """The settings and the work of `meshfree.thin_out`."""

    asks = ("by", "spacing", "count", "keep_edges")
    adjustable = asks
    at_zero = {"spacing": "Automatic"}

    by: EnumProperty(
        name="By",
        items=[
            ("SPACING", "Spacing", "No two points are nearer to each other than the spacing"),
            ("NUMBER", "Number", "At most a number of points stays"),
        ],
        **THIN_OUT["by"].keywords,
    )
    spacing: FloatProperty(
        name="Spacing",
        subtype="DISTANCE",
        **THIN_OUT["spacing"].keywords,
    )
    count: IntProperty(
        name="Number",
        soft_max=1_000_000,
        **THIN_OUT["count"].keywords,
    )
    keep_edges: BoolProperty(
        name="Keep Edges",
        **THIN_OUT["keep_edges"].keywords,
    )

    def plan(self, context, obj):
        check_deletable(obj)
        points = read_points(context, obj).points
        return thinner(points, self.by, self.spacing, self.count, self.keep_edges)

    def write(self, context, obj, result):
        kept, spacing = result
        if not kept.all():
            keep_points(context, obj, kept)
        tag_changed(obj.data)
        apart = "" if spacing is None else f", at least {length_text(spacing)} from each other"
        return [f"{obj.name}: {thin_line(kept)}{apart}"]


class MESHFREE_OT_thin_out(ThinOut, ApplicationOperator, bpy.types.Operator):
    """Delete points so that the others are evenly spread, to a spacing or a number; edges and results stay"""

    bl_idname = "meshfree.thin_out"
    bl_label = "Thin Out"
    keeps_line = True


TOOLS = (Registration(MESHFREE_OT_thin_out, panel=Row("Clean", 1, 2), menu=Row("Object", 4, 4)),)
