"""Cross sections of the surface by a plane, as curve objects."""

import bpy
from bpy.props import FloatProperty, StringProperty

from ...command import sections
from ..objects.curves import add_curves
from ..objects.planes import plane_of
from ..objects.result import area_text, length_text
from ..registration import Registration, Row
from ..running.application import ApplicationOperator, Tool, operator_reader
from .mesh import bare_mesh


class CrossSection(Tool):
    """The settings and the work of `meshfree.cross_section`."""

    changes = False
    asks = adjustable = ("plane", "thickness")
    found = None  # what was measured

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
        place, normal, guessed = self.cut(context, obj, reading)
        name = obj.name

        def compute(progress):
            laplacian = operator(progress)
            mesh = bare_mesh(laplacian, 1.0, progress)
            found = sections.cut(laplacian, place, normal, mesh, name, progress)
            lines = [(reading.local(curve.points), curve.closed) for curve in found.curves]
            return found, lines, guessed

        return compute

    def cut(self, context, obj, reading):
        """Return a point and a normal of the plane, as points are read, and a notice of what was guessed or ""."""
        if not self.plane:
            guessed = f"{obj.name} is cut by the horizontal plane through its middle: no Plane is chosen."
            return sections.middle(reading.points), sections.UP, guessed
        return *plane_of(context.scene, self.plane, obj), ""

    def write(self, context, obj, result):
        self.found, lines, guessed = result
        made = add_curves(obj, f"{obj.name} Section", lines, self.thickness)
        line = sections.section_line(self.found, made.name, length_text, area_text)
        return [*filter(None, [guessed]), *self.found.notices, line]


class MESHFREE_OT_cross_section(CrossSection, ApplicationOperator, bpy.types.Operator):
    """Cut the surface by a plane: curves, with their length and the area that they enclose"""

    bl_idname = "meshfree.cross_section"
    bl_label = "Cross Section"
    only_active = keeps_line = True


TOOLS = (Registration(MESHFREE_OT_cross_section, panel=Row("Measure", 6, 2), menu=Row("Object", 7, 5)),)
