"""Selects points by the values that are shown as colors."""

import bpy
from bpy.props import BoolProperty, FloatProperty

from ..core import PointCloudError
from ..operators.registration import Registration, Row
from ..operators.tools.select import SelectionOperator, select, selection
from .display import label, shown_attribute, shown_range, shown_values


class MESHFREE_OT_select_by_range(SelectionOperator, bpy.types.Operator):
    """Select the points whose displayed values lie in a range"""

    bl_idname = "meshfree.select_by_range"
    bl_label = "Select by Range"

    low: FloatProperty(
        name="From",
        description="Least value that is selected; the first of the colors unless given",
        precision=4,
        options={"SKIP_SAVE"},
    )
    high: FloatProperty(
        name="To",
        description="Greatest value that is selected; the last of the colors unless given",
        precision=4,
        options={"SKIP_SAVE"},
    )
    invert: BoolProperty(
        name="Outside", description="Select the points outside the range instead", options={"SKIP_SAVE"}
    )
    extend: BoolProperty(
        name="Extend", description="Keep what is selected already", default=False, options={"SKIP_SAVE"}
    )

    surface = False
    needs_selection = False

    def prepare(self, context, obj):
        bounds = shown_range(obj)
        if bounds is None:
            raise PointCloudError(
                f'"{obj.name}" shows no numbers as colors. Show an attribute, or one component of a vector,'
                " under Show first."
            )
        for name, bound in zip(("low", "high"), bounds, strict=True):
            if not self.properties.is_property_set(name):
                setattr(self, name, bound)
        values = shown_values(obj)
        chosen = (values >= self.low) & (values <= self.high)
        if self.invert:
            chosen = ~chosen
        if self.extend:
            chosen |= selection(obj)
        if not chosen.any():
            bounds = f"{'outside' if self.invert else 'from'} {self.low:g} to {self.high:g}"
            raise PointCloudError(f"No value of {label(shown_attribute(obj))} lies {bounds}. Widen the range.")
        return lambda: select(context, obj, chosen)


TOOLS = (Registration(MESHFREE_OT_select_by_range, menu=Row("Points", 1, 5)),)
