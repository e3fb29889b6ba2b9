"""Shows an attribute of the active object as colours, or the object's own material."""

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty

from ..operators.objects.all_or_nothing import all_or_nothing
from ..operators.objects.color_choices import COLOR_CHOICES, color_choice
from ..operators.objects.colors import own_material, replaced_material
from ..operators.objects.notices import withdraw
from ..operators.registration import Registration, Row
from ..operators.running.ready import ReadyOperator, reporting
from ..tools.quantities import quantity
from .display import find_display, is_colored
from .show import look_at, show_attribute, show_in_solid, show_own_material, use_material_preview


class MESHFREE_OT_colormap(ReadyOperator, bpy.types.Operator):
    """Show an attribute as colors on the points: numbers, vectors, or their own colors"""

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
        description="Switch this viewport from Solid, where such points are gray, to Material Preview; Solid may show"
        " colors that points have of their own",
        default=True,
    )

    @classmethod
    def description(cls, context, properties):
        return quantity(properties.attribute).tooltip  # empty without a result: the tooltip of the class

    @reporting
    def execute(self, context):
        obj = context.object
        with all_or_nothing([obj]):
            show_attribute(obj, self.attribute, self.radius)
            for name in COLOR_CHOICES:  # options that are not given keep the object's settings
                if not self.properties.is_property_set(name):
                    setattr(self, name, getattr(obj.meshfree, name))
                elif getattr(self, name) != getattr(obj.meshfree, name):
                    setattr(obj.meshfree, name, getattr(self, name))  # whose update colors the points again
            if self.switch_shading and is_colored(obj):
                show_in_solid(obj)
            elif self.switch_shading:
                look_at([obj])
        return {"FINISHED"}


class MESHFREE_OT_own_material(ReadyOperator, bpy.types.Operator):
    """Show the points in the object's own material, that of its first slot, in place of colors"""

    bl_idname = "meshfree.own_material"
    bl_label = "Own Material"

    @classmethod
    def lack(cls, context, obj):
        if own_material(obj) is None:
            return f'"{obj.name}" has no material in its first slot. Give it one in the Properties editor'
        return "" if find_display(obj) else f'"{obj.name}" is seen in its own material already'

    @reporting
    def execute(self, context):
        with all_or_nothing([context.object]):
            show_own_material(context.object)
            withdraw(context.object, replaced_material(context.object))
            use_material_preview(context)
        return {"FINISHED"}


TOOLS = (
    Registration(MESHFREE_OT_colormap, menu=Row("Object", 1, 6)),
    Registration(MESHFREE_OT_own_material, menu=Row("Object", 1, 7)),
)
