"""Profile: the height or an attribute along the shortest path between two points, as a curve and a table."""

import csv
import io

import bpy
import numpy as np
from bpy.props import EnumProperty, StringProperty

from ... import core
from ...core import PointCloudError
from ..objects.attributes import read_attribute
from ..objects.curves import plot
from ..objects.place import place_of
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running.application import Tool, operator_reader
from ..running.stages import Stages
from .measuring import path_between, selected_ends
from .select import SelectionOperator

_AXES = "XYZ"


class Profile(Tool):
    """The settings and the work of `meshfree.profile`."""

    changes = False
    asks = ("source", "axis")
    table = ""  # what was measured, as text with commas

    source: StringProperty(
        name="Attribute", description="Attribute of one number at each point; without one, the height along the axis"
    )
    axis: EnumProperty(
        name="Height Along",
        description="Axis of the world along which heights are measured",
        items=[(axis, axis, f"Along the {axis} axis of the world") for axis in _AXES],
        default="Z",
    )

    def ends(self, obj):
        """Return the two points between which the path leads, (2,) int."""
        return selected_ends(obj)

    def origin(self, obj):
        """Return where points as read begin, from where heights are measured, (3,)."""
        return np.array(obj.matrix_world.translation)

    def plan(self, context, obj):
        ends = self.ends(obj)
        given = _values(obj, self.source) if self.source else None
        reading, operator = operator_reader(context, obj)
        across, source = _AXES.index(self.axis), self.source
        base, place = self.origin(obj)[across], place_of(obj)

        def compute(progress):
            laplacian = operator(progress)
            path = path_between(laplacian, ends, progress)
            heights = reading.points[:, across]
            columns = [heights] if given is None else [heights, given]
            found = core.profile(laplacian, path, np.column_stack(columns))
            values, off = found.values[:, -1], found.uncertainty
            if given is None:
                values = base + path[:, across]  # on the surface, as between its points
            if np.isfinite(values).sum() < 2:
                raise PointCloudError(f'"{source}" has no values along the path. Select other points.')
            rows = [found.distance, *(path + place).T, base + path[:, across], off[:, 0]]
            return found.distance, values, off[:, -1], rows if given is None else [*rows, values, off[:, 1]]

        return compute

    def write(self, context, obj, result):
        distance, values, off, rows = result
        self.table = _table(rows, self.source)
        made = plot(obj, f"{obj.name} Profile", distance, values)
        text = bpy.data.texts.new(f"{made.name}.csv")
        text.from_string(self.table)
        obj.meshfree.profile = text
        missing = np.count_nonzero(~np.isfinite(values))
        notices = []
        if missing:
            notices.append(f"{obj.name}: {missing:,} of {len(values):,} places of the path have no value.")
        name = self.source or f"height along {self.axis}"
        line = (
            f"{made.name}: {length_text(distance[-1])} long, {name} from {np.nanmin(values):.4g} to"
            f" {np.nanmax(values):.4g}, +- {np.sqrt(np.nanmean(off**2)):.2g}. The table is the text {text.name}"
        )
        return [*notices, line]


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
    if layer.domain != "POINT" or layer.data_type != "FLOAT":
        raise PointCloudError(
            f'The attribute "{name}" of "{obj.name}" is not one number at each point that changes along the surface.'
            " Choose another one."
        )
    return read_attribute(obj.data, name)


def _table(columns, source):
    """Return a table as text with commas: of heights alone, or with an attribute."""
    names = ["distance", "x", "y", "z", "height", "height_uncertainty"]
    if source:
        names += [source, f"{source}_uncertainty"]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(names)
    np.savetxt(text, np.column_stack(columns), "%.12g", ",")
    return text.getvalue()


TOOLS = (
    Registration(MESHFREE_OT_profile, panel=Row("Points and Groups", 2, 3), menu=Row("Points", 2, 3), verb=Profile),
)
