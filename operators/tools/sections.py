"""Cross sections of the surface by a plane, as curve objects."""

import bpy
from bpy.props import FloatProperty, StringProperty

from ...command import sections
from ..objects.curves import add_curves
from ..objects.planes import plane_of
from ..objects.result import area_text, length_text
from ..registration import Registration, Row
from ..running.application import ApplicationOperator, Tool, operator_reader


class CrossSection(Tool):
    """The settings and the work of `meshfree.cross_section`."""

    changes = False
    asks = adjustable = ("plane", "thickness")

    plane: StringProperty(
        name="Plane",
        description="Object, such as an empty, whose local XY plane cuts the surface; without one, the horizontal plane"
        " through the middle of the points",
    )
    thickness: FloatProperty(
        name="Thickness",
        description="Radius of tubes along the curves; with 0 they are seen in viewports only",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )

    def plan(self, context, obj):
        reading, operator = operator_reader(context, obj)
        name, guessed = obj.name, []
        if self.plane:
            place, normal = plane_of(context.scene, self.plane, obj)
        else:
            place, normal = sections.middle(reading.points), sections.UP
            guessed = [f"{name} is cut by the horizontal plane through its middle: no Plane is chosen."]

        def compute(progress):
            laplacian = operator(progress)
            found = sections.cut(laplacian, place, normal, name, progress)
            lines = [(reading.local(curve.points), curve.closed) for curve in found.curves]
            return found, lines, guessed

        return compute

    def write(self, context, obj, result):
        found, lines, guessed = result
        made = add_curves(obj, f"{obj.name} Section", lines, self.thickness)
        line = sections.section_line(found, made.name, length_text, area_text)
        return [*guessed, *found.notices, line]


class MESHFREE_OT_cross_section(CrossSection, ApplicationOperator, bpy.types.Operator):
    """Cut the surface by a plane: curves, with their length and the area that they enclose"""

    bl_idname = "meshfree.cross_section"
    bl_label = "Cross Section"
    only_active = keeps_line = True


TOOLS = (Registration(MESHFREE_OT_cross_section, panel=Row("Measure", 6, 2), menu=Row("Object", 7, 5)),)
