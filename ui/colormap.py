"""Shows an attribute of the active object as colours."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ..core import PointCloudError
from ..operators.ready import ReadyOperator
from ..operators.translation import translated
from .settings import COLOR_MAPS, RANGE_MODES
from .show import show_attribute, use_material_preview

_SETTINGS = ("color_map", "reverse", "range_mode", "coverage")  # of the object, which keep what they are unless given


class MESHFREE_OT_colormap(ReadyOperator, bpy.types.Operator):
    """Show an attribute as colors on round points"""

    bl_idname = "meshfree.colormap"
    bl_label = "Show as Colors"

    attribute: StringProperty(
        name="Attribute",
        description="Name of the attribute; empty for the one on show, or the mean curvature",
        options={"SKIP_SAVE"},
    )
    color_map: EnumProperty(
        name="Color Map",
        description="Colors from low to high values; those of the object's settings unless given",
        items=COLOR_MAPS,
        options={"SKIP_SAVE"},
    )
    reverse: BoolProperty(
        name="Reverse", description="Turn the colors round, from high to low values", options={"SKIP_SAVE"}
    )
    range_mode: EnumProperty(
        name="Range",
        description="Which values the colors stretch over; those of the object's settings unless given",
        items=RANGE_MODES,
        options={"SKIP_SAVE"},
    )
    coverage: FloatProperty(
        name="Coverage",
        description="Share of the values inside the color range, so that a few outliers do not wash the rest out",
        default=98.0,
        min=50.0,
        max=100.0,
        subtype="PERCENTAGE",
        options={"SKIP_SAVE"},
    )
    radius: FloatProperty(
        name="Point Radius",
        description="Radius of the points in the object's own lengths; 0 leaves it to the setting Point Size",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
        options={"SKIP_SAVE"},
    )
    switch_shading: BoolProperty(
        name="Switch to Material Preview",
        description="Switch this viewport from Solid, where such points are gray, to Material Preview",
        default=True,
    )

    def execute(self, context):
        obj = context.object
        try:
            show_attribute(obj, self.attribute, self.radius)
        except PointCloudError as error:
            self.report({"ERROR"}, translated(error))
            return {"CANCELLED"}
        for name in _SETTINGS:
            if not self.properties.is_property_set(name):
                setattr(self, name, getattr(obj.meshfree, name))
            elif getattr(self, name) != getattr(obj.meshfree, name):
                setattr(obj.meshfree, name, getattr(self, name))  # which colors the points again
        if self.switch_shading:
            use_material_preview(context)
        return {"FINISHED"}


CLASSES = (MESHFREE_OT_colormap,)
