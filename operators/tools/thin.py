"""Fewer points of the same surface, with all that they hold."""

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from ... import core
from ..objects.attributes import tag_changed
from ..objects.deleting import check_deletable, keep_points
from ..objects.reading import read_points
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running.application import ApplicationOperator, Tool

_AUTOMATIC = 2.0  # spacings of the points


class ThinOut(Tool):
    """The settings and the work of `meshfree.thin_out`."""

    asks = ("by", "spacing", "count", "keep_edges")
    adjustable = asks
    at_zero = {"spacing": "Automatic"}

    by: EnumProperty(
        name="By",
        description="What says how many points stay",
        items=[
            ("SPACING", "Spacing", "No two points are nearer to each other than the spacing"),
            ("NUMBER", "Number", "At most a number of points stays"),
        ],
        default="SPACING",
    )
    spacing: FloatProperty(
        name="Spacing",
        description="Least distance between points, for Spacing; 0 for twice the present one",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )
    count: IntProperty(
        name="Number",
        description="How many points stay at most, for Number",
        default=10_000,
        min=1,
        soft_max=1_000_000,
    )
    keep_edges: BoolProperty(
        name="Keep Edges", description="Keep points at edges before others, the sharpest first", default=True
    )

    def plan(self, context, obj):
        check_deletable(obj)
        points, keep_edges = read_points(context, obj).points, self.keep_edges
        spacing = (self.spacing or _AUTOMATIC * core.geometry.typical_distance(points)) or None
        size = {"count": self.count} if self.by == "NUMBER" or spacing is None else {"spacing": spacing}

        def compute(progress):
            kept = np.zeros(len(points), dtype=bool)
            kept[core.thin_out(points, keep_edges=keep_edges, progress=progress, **size)] = True
            return kept, size.get("spacing")

        return compute

    def write(self, context, obj, result):
        kept, spacing = result
        if not kept.all():
            keep_points(context, obj, kept)
        tag_changed(obj.data)
        apart = "" if spacing is None else f", at least {length_text(spacing)} from each other"
        return [f"{obj.name}: {np.count_nonzero(kept):,} of {len(kept):,} points are left{apart}"]


class MESHFREE_OT_thin_out(ThinOut, ApplicationOperator, bpy.types.Operator):
    """Delete points so that the others are evenly spread, to a spacing or a number; edges and results stay"""

    bl_idname = "meshfree.thin_out"
    bl_label = "Thin Out"
    keeps_line = True


TOOLS = (Registration(MESHFREE_OT_thin_out, panel=Row("Clean", 1, 2), menu=Row("Object", 4, 4), verb=ThinOut),)
