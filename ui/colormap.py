"""Shows an attribute of the active object as colours."""

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from ..core import PointCloudError
from ..operators.ready import ReadyOperator
from .display import show_attribute


class MESHFREE_OT_colormap(ReadyOperator, bpy.types.Operator):
    """Show an attribute as colors on round points"""

    bl_idname = "meshfree.colormap"
    bl_label = "Show as Colors"

    attribute: StringProperty(
        name="Attribute", description="Name of the attribute; empty for the one on show, or the mean curvature"
    )
    radius: FloatProperty(
        name="Point Radius",
        description="Radius of the points in the object's own lengths; 0 keeps it, or takes it from their spacing",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )
    switch_shading: BoolProperty(
        name="Switch to Material Preview",
        description="Switch this viewport from Solid, where such points are gray, to Material Preview",
        default=True,
    )

    def execute(self, context):
        try:
            show_attribute(context.object, self.attribute, self.radius)
        except PointCloudError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        space = context.space_data
        if self.switch_shading and space is not None and space.type == "VIEW_3D" and space.shading.type == "SOLID":
            space.shading.type = "MATERIAL"
        return {"FINISHED"}


CLASSES = (MESHFREE_OT_colormap,)
