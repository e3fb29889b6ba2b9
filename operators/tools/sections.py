"""Cross sections of the surface by a plane, as curve objects."""

import bpy
import numpy as np
from bpy.props import FloatProperty, StringProperty

from ... import core
from ...core import PointCloudError
from ..objects.curves import add_curves
from ..objects.planes import plane_of
from ..objects.result import area_text, length_text
from ..registration import Registration, Row
from ..running.application import ApplicationOperator, Tool, operator_reader
from .mesh import bare_mesh

_UP = np.array([0.0, 0.0, 1.0])


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
            found = core.cross_section(laplacian, place, normal, mesh=mesh, progress=progress)
            if not found.curves:
                raise PointCloudError(
                    f'The plane passes beside the surface of "{name}", or only touches it. Move it to where it cuts.'
                )
            lines = [(reading.local(curve.points), curve.closed) for curve in found.curves]
            return found, lines, guessed

        return compute

    def cut(self, context, obj, reading):
        """Return a point and a normal of the plane, as points are read, and a notice of what was guessed or ""."""
        if not self.plane:
            middle = 0.5 * (reading.points.min(axis=0) + reading.points.max(axis=0))
            return middle, _UP, f"{obj.name} is cut by the horizontal plane through its middle: no Plane is chosen."
        return *plane_of(context.scene, self.plane, obj), ""

    def write(self, context, obj, result):
        self.found, lines, guessed = result
        made = add_curves(obj, f"{obj.name} Section", lines, self.thickness)
        count = len(lines)
        curves = "1 curve" if count == 1 else f"{count:,} curves"
        line = (
            f"{made.name}: {curves}, {length_text(self.found.length)} long, enclosed area"
            f" {area_text(self.found.enclosed_area)}"
        )
        return [*filter(None, [guessed]), *self.found.notices, line]


class MESHFREE_OT_cross_section(CrossSection, ApplicationOperator, bpy.types.Operator):
    """Cut the surface by a plane: curves, with their length and the area that they enclose"""

    bl_idname = "meshfree.cross_section"
    bl_label = "Cross Section"
    only_active = keeps_line = True


TOOLS = (
    Registration(MESHFREE_OT_cross_section, panel=Row("Measure", 6, 2), menu=Row("Object", 7, 5), verb=CrossSection),
)
