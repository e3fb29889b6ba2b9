"""Cross sections of the surface by planes of objects, as curve objects."""

import bpy
from bpy.props import FloatProperty, StringProperty

from ...tools import cross_section
from ..objects.curves import add_curves
from ..objects.planes import plane_of
from ..objects.result import length_text
from .declared import registration_of


class SectionCurves:
    """What Blender adds to the tool: an object whose plane cuts, and one of the curves."""

    changes = False
    only_active = True
    last = adjustable = "plane", "thickness"
    asks = last

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

    def inputs(self, cloud, own):
        if not self.plane:
            return super().inputs(cloud, own)
        return *plane_of(bpy.context.scene, self.plane, cloud.obj), (), cloud.name

    def write(self, context, obj, result):
        found, laplacian, own, reading = result
        outcome = self.tool.finish(found, laplacian, own, length_text)
        lines = [(reading.local(curve.points), curve.closed) for curve in outcome.made]
        made = add_curves(obj, f"{obj.name} Section", lines, self.thickness)
        return [*outcome.notices, f"{made.name}: {outcome.line}"]


TOOLS = (registration_of(cross_section.TOOL, SectionCurves),)
