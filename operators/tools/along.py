"""Along the surface from points or a curve: cells, a map, parallel transport, signed distance."""

import bpy
import numpy as np
from bpy.props import FloatProperty, FloatVectorProperty, StringProperty

from ...command import along
from ...command.quantities import CELL, DIRECTION, SIGNED_DISTANCE, UV
from ...core import PointCloudError
from ..objects.attributes import tag_changed, write_attribute
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ShownOperator, Tool, operator_reader
from .select import read_sources


class NearestSource(Tool):
    """The settings and the work of `meshfree.nearest_source`."""

    writes = (CELL,)
    asks = ("group", "show")

    group: StringProperty(name="Sources", **along.NEAREST["group"].keywords)

    def plan(self, context, obj):
        sources = read_sources(obj, self.group)
        _, operator = operator_reader(context, obj)

        return lambda progress: along.cells(operator(progress), sources, cache, progress)

    def write(self, context, obj, result):
        told = along.told_cells(result, obj.name)
        write_attribute(obj.data, CELL, told.values)
        tag_changed(obj.data)
        return [*told.notices, told.line]


class MESHFREE_OT_nearest_source(NearestSource, ShownOperator, bpy.types.Operator):
    """Divide the surface into geodesic Voronoi cells of the sources"""

    bl_idname = "meshfree.nearest_source"
    bl_label = "Nearest Source"


class Unwrap(Tool):
    """The settings and the work of `meshfree.unwrap`."""

    writes = (UV,)
    asks = ("group", "radius", "angle", "show")
    adjustable = ("radius", "angle", "show")
    at_zero = {"radius": "All Points"}

    group: StringProperty(name="Center", **along.UNWRAP["group"].keywords)
    radius: FloatProperty(name="Radius", subtype="DISTANCE", **along.UNWRAP["radius"].keywords)
    angle: FloatProperty(name="Angle", subtype="ANGLE", **along.UNWRAP["angle"].keywords)

    def plan(self, context, obj):
        if np.isnan(self.radius):
            raise PointCloudError("The radius of the texture is not a number. Use one from 0 on.")
        sources = read_sources(obj, self.group)
        reading, operator = operator_reader(context, obj)
        center = along.center_of(reading.points, sources)
        radius, angle, name = self.radius, self.angle, obj.name
        return lambda progress: along.texture(operator(progress), center, radius, angle, name, cache, progress)

    def write(self, context, obj, result):
        texture, border = result
        write_attribute(obj.data, UV, texture)
        tag_changed(obj.data)
        return [along.texture_line(border, obj.name, length_text)]


class MESHFREE_OT_unwrap(Unwrap, ShownOperator, bpy.types.Operator):
    """Map the surface around a point to texture coordinates, like a decal"""

    bl_idname = "meshfree.unwrap"
    bl_label = "Unwrap Around Point"


class ExtendDirection(Tool):
    """The settings and the work of `meshfree.extend_direction`."""

    writes = (DIRECTION,)
    asks = ("group", "direction", "show")

    group: StringProperty(name="Sources", **along.EXTEND["group"].keywords)
    direction: FloatVectorProperty(
        name="Direction", min=-1e6, max=1e6, subtype="XYZ", **along.EXTEND["direction"].keywords
    )

    def plan(self, context, obj):
        sources = read_sources(obj, self.group)
        reading, operator = operator_reader(context, obj)
        direction = np.array(self.direction, dtype=np.float64)

        def compute(progress):
            found = along.directions(operator(progress), sources, direction, cache, progress)
            return along.unit_directions(found, reading.local)

        return compute

    def write(self, context, obj, result):
        told = along.told_directions(result, obj.name)
        write_attribute(obj.data, DIRECTION, told.values)
        tag_changed(obj.data)
        return [*told.notices, told.line]


class MESHFREE_OT_extend_direction(ExtendDirection, ShownOperator, bpy.types.Operator):
    """Extend directions at some points to the whole surface by parallel transport"""

    bl_idname = "meshfree.extend_direction"
    bl_label = "Extend Direction"


class SignedDistance(Tool):
    """The settings and the work of `meshfree.signed_distance`."""

    writes = (SIGNED_DISTANCE,)
    asks = ("curve", "show")

    curve: StringProperty(
        name="Curve",
        description="Curve object on the surface; each of its points is replaced by the nearest one of the cloud",
    )

    def plan(self, context, obj):
        places, closed = read_curve(context, self.curve)
        places = places - np.array(obj.matrix_world.translation)  # as points are read
        _, operator = operator_reader(context, obj)
        return lambda progress: along.beside_curve(operator(progress), places, closed, cache, progress)

    def write(self, context, obj, result):
        told = along.told_sides(result, obj.name, length_text)
        write_attribute(obj.data, SIGNED_DISTANCE, told.values)
        tag_changed(obj.data)
        return [*told.notices, told.line]


class MESHFREE_OT_signed_distance(SignedDistance, ShownOperator, bpy.types.Operator):
    """Geodesic distance from a curve, positive on its left"""

    bl_idname = "meshfree.signed_distance"
    bl_label = "Signed Distance"


def read_curve(context, name):
    """Read the points of a curve object in the world, (k, 3), and whether its last one is joined with the first."""
    curve = context.scene.objects.get(name)
    if curve is None or curve.type != "CURVE":
        raise PointCloudError(
            f'There is no curve "{name}" in this scene. Choose a curve object that lies on the surface.'
        )
    evaluated = curve.evaluated_get(context.evaluated_depsgraph_get())
    try:
        mesh = evaluated.to_mesh()
        places = np.empty((len(mesh.vertices), 3), np.float32)
        mesh.vertices.foreach_get("co", places.reshape(-1))
        thick = len(mesh.polygons) > 0
    finally:
        evaluated.to_mesh_clear()
    if len(curve.data.splines) != 1 or len(places) < 2 or thick:
        raise PointCloudError(
            f'"{name}" is not one line: it has {len(curve.data.splines)} splines, or a bevel. Take a curve of one'
            " spline, without a bevel or an extrusion."
        )
    matrix = np.array(curve.matrix_world)
    return places @ matrix[:3, :3].T + matrix[:3, 3], curve.data.splines[0].use_cyclic_u


TOOLS = (
    Registration(MESHFREE_OT_nearest_source, panel=Row("Measure", 3, 1), menu=Row("Object", 7, 2)),
    Registration(MESHFREE_OT_unwrap, panel=Row("Measure", 3, 2), menu=Row("Object", 7, 3)),
    Registration(MESHFREE_OT_extend_direction, panel=Row("Measure", 3, 3), menu=Row("Object", 7, 4)),
    Registration(MESHFREE_OT_signed_distance, panel=Row("Measure", 2, 2), menu=Row("Object", 7, 1)),
)
