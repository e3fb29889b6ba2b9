"""Profile: the height or an attribute along the shortest path between two points, as a curve and a table."""

from types import SimpleNamespace

import bpy
import numpy as np
from bpy.props import EnumProperty, StringProperty

from ...command import profiles
from ...core import PointCloudError
from ..objects.attributes import read_attribute
from ..objects.curves import plot
from ..objects.place import place_of
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running import cache
from ..running.application import Tool, operator_reader
from ..running.stages import Stages
from .measuring import selected_ends
from .select import SelectionOperator


class Profile(Tool):
    """The settings and the work of `meshfree.profile`."""

    changes = False
    asks = ("source", "axis")

    source: StringProperty(name="Attribute", **profiles.PROFILE["source"].keywords)
    axis: EnumProperty(
        name="Height Along",
        items=[(axis, axis, f"Along the {axis} axis of the world") for axis in profiles.AXES],
        **profiles.PROFILE["axis"].keywords,
    )

    def plan(self, context, obj):
        ends = selected_ends(obj)
        given = _values(obj, self.source) if self.source else None
        _, operator = operator_reader(context, obj)
        own = SimpleNamespace(source=self.source, axis=self.axis)
        base, place = np.array(obj.matrix_world.translation), place_of(obj)

        def compute(progress):
            laplacian = operator(progress)
            path = profiles.path_between(laplacian, ends, cache, progress)
            return profiles.measured(laplacian, path, given, own, base, place)

        return compute

    def write(self, context, obj, result):
        made = plot(obj, f"{obj.name} Profile", result.distance, result.values)
        text = bpy.data.texts.new(f"{made.name}.csv")
        text.from_string(profiles.table(result.columns, self.source))
        obj.meshfree.profile = text
        line = profiles.profile_line(result, self, made.name, length_text)
        return [*profiles.missing(result, obj.name), f"{line}. The table is the text {text.name}"]


class MESHFREE_OT_profile(Profile, SelectionOperator, bpy.types.Operator):
    """Draw the height or an attribute along the shortest path between the two selected points, with a table"""

    bl_idname = "meshfree.profile"
    bl_label = "Profile"

    def prepare(self, context, obj):
        compute = self.plan(context, obj)
        with Stages(context.window_manager, "Points") as stages:
            result = compute(stages)

        def add():
            *notices, line = self.write(context, obj, result)
            self.begin_notices([obj])
            self.note(line, obj)
            for notice in notices:
                self.warn(notice, obj)
            return line

        return add


def _values(obj, name):
    """Read an attribute of one number at each point, (n,)."""
    if name not in obj.data.attributes:
        raise PointCloudError(f'"{obj.name}" has no attribute "{name}". Choose one of its attributes.')
    layer = obj.data.attributes[name]
    profiles.check_varying(layer.domain == "POINT" and layer.data_type == "FLOAT", name, f'"{obj.name}"')
    return read_attribute(obj.data, name)


TOOLS = (Registration(MESHFREE_OT_profile, panel=Row("Points and Groups", 2, 3), menu=Row("Points", 2, 3)),)
