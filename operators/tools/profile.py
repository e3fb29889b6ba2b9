"""Profile: the height or an attribute along the shortest path between two points, as a curve and a table."""

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
from .measuring import selected_path
from .select import SelectionOperator

_AXES = "XYZ"


class MESHFREE_OT_profile(SelectionOperator, bpy.types.Operator):
    """Draw the height or an attribute along the shortest path between the two selected points, with a table"""

    bl_idname = "meshfree.profile"
    bl_label = "Profile"
    asks = ("source", "axis")

    source: StringProperty(
        name="Attribute", description="Attribute of one number at each point; without one, the height along the axis"
    )
    axis: EnumProperty(
        name="Height Along",
        description="Axis of the world along which heights are measured",
        items=[(axis, axis, f"Along the {axis} axis of the world") for axis in _AXES],
        default="Z",
    )

    def prepare(self, context, obj):
        given = _values(obj, self.source) if self.source else None
        _, laplacian, _, path = selected_path(context, obj)
        height = (path + np.array(obj.matrix_world.translation))[:, _AXES.index(self.axis)]
        found = core.profile(laplacian, path, np.zeros(len(laplacian.points)) if given is None else given)
        values = height if given is None else found.values
        if np.isfinite(values).sum() < 2:
            raise PointCloudError(f'"{self.source}" has no values along the path. Select other points.')
        name = self.source or f"height along {self.axis}"
        places = path + place_of(obj)

        def add():
            made = plot(obj, f"{obj.name} Profile", found.distance, values)
            table = bpy.data.texts.new(f"{made.name}.csv")
            table.from_string(_table(found.distance, places, height, self.source, values))
            line = (
                f"{length_text(found.distance[-1])} long, {name} from {np.nanmin(values):.4g} to"
                f" {np.nanmax(values):.4g}. The table is the text {table.name}"
            )
            self.begin_notices([obj])
            self.note(f"{obj.name}: {line}", obj)
            missing = np.count_nonzero(~np.isfinite(values))
            if missing:
                self.warn(f"{obj.name}: {missing:,} of {len(values):,} places of the path have no value.", obj)
            return f"{made.name} is {line}"

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


def _table(distance, places, height, source, values):
    """Return a table as text with commas: of heights alone, or with an attribute."""
    columns, names = [distance, *places.T, height], ["distance", "x", "y", "z", "height"]
    if source:
        columns, names = [*columns, values], [*names, source]
    text = io.StringIO()
    header = ",".join(f'"{name}"' if set(name) & set(',"') else name for name in names)
    np.savetxt(text, np.column_stack(columns), "%.12g", ",", header=header, comments="")
    return text.getvalue()


TOOLS = (Registration(MESHFREE_OT_profile, panel=Row("Points and Groups", 2, 3), menu=Row("Points", 2, 3)),)
