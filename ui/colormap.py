"""Shows an attribute of the active object as colours."""

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from ..operators.objects.all_or_nothing import all_or_nothing
from ..operators.objects.color_choices import COLOR_CHOICES, color_choice
from ..operators.running.ready import ReadyOperator, reporting
from .show import show_attribute, use_material_preview


class MESHFREE_OT_colormap(ReadyOperator, bpy.types.Operator):
    """Show an attribute as colors on round points"""

    bl_idname = "meshfree.colormap"
    bl_label = "Show as Colors"

    attribute: StringProperty(
        name="Attribute",
        description="Name of the attribute; empty for the one on show, or the mean curvature",
        options={"SKIP_SAVE"},
    )
    color_map: color_choice("color_map", options={"SKIP_SAVE"})
    reverse: color_choice("reverse", options={"SKIP_SAVE"})
    range_mode: color_choice("range_mode", options={"SKIP_SAVE"})
    coverage: color_choice("coverage", options={"SKIP_SAVE"})
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

    @reporting
    def execute(self, context):
        obj = context.object
        with all_or_nothing([obj]):
            show_attribute(obj, self.attribute, self.radius)
            for name in COLOR_CHOICES:  # the settings of the object keep what they are unless given
                if not self.properties.is_property_set(name):
                    setattr(self, name, getattr(obj.meshfree, name))
                elif getattr(self, name) != getattr(obj.meshfree, name):
                    setattr(obj.meshfree, name, getattr(self, name))  # which colors the points again
            if self.switch_shading:
                use_material_preview(context)
        return {"FINISHED"}


CLASSES = (MESHFREE_OT_colormap,)
