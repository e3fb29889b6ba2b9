"""Profiles as curves and texts."""

import bpy

from ...tools import profile
from ..objects.curves import plot
from ..objects.result import length_text
from ..running.stages import Stages
from .declared import registration_of


class ProfileCurve:
    """What Blender adds to the tool: it is drawn as a curve, and its table is a text."""

    bl_description = (
        "Draw the height or an attribute along the shortest path between the two selected points, with a table"
    )
    changes = False

    def prepare(self, context, obj):
        compute = self.plan(context, obj)
        with Stages(context.window_manager, "Points") as stages:
            found, laplacian, own, _ = compute(stages)

        def add():
            outcome = self.tool.finish(found, laplacian, own, length_text)
            made = plot(obj, f"{obj.name} Profile", found.distance, found.values)
            obj.meshfree.profile = text = bpy.data.texts.new(f"{made.name}.csv")
            text.from_string(outcome.made[1])
            line = f"{made.name}: {outcome.line}. The table is the text {text.name}"
            self.begin_notices([obj])
            self.note(line, obj)
            for notice in outcome.notices:
                self.warn(f"{obj.name}: {notice}", obj)
            return line

        return add


TOOLS = (registration_of(profile.TOOL, ProfileCurve),)
