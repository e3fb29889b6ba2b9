"""Along the surface from points or a curve: cells, a map, parallel transport, signed distance."""

import bpy
import numpy as np
from bpy.props import FloatProperty, FloatVectorProperty, StringProperty

from ... import core
from ...command.quantities import CELL, DIRECTION, SIGNED_DISTANCE, UV
from ...core import PointCloudError
from ..objects.attributes import tag_changed, write_attribute
from ..objects.groups import SOURCE
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ShownOperator, Tool, operator_reader
from .select import read_sources, unreached

OUTSIDE = -1.0  # texture coordinates of points that the map does not reach


def _transport(laplacian, progress):
    return cache.result(laplacian, "transport", compute=lambda: core.Transport(laplacian, progress=progress))


class NearestSource(Tool):
    """The settings and the work of `meshfree.nearest_source`."""

    writes = (CELL,)
    asks = ("group", "show")

    group: StringProperty(
        name="Sources",
        description="Vertex group with the points that are centers of cells; where there is none of that name, the"
        " points selected in Edit Mode",
        default=SOURCE,
    )

    def plan(self, context, obj):
        sources = read_sources(obj, self.group)
        _, operator = operator_reader(context, obj)

        def compute(progress):
            laplacian = operator(progress)
            return cache.result(
                laplacian,
                "cells",
                sources,
                compute=lambda: cache.geodesics(laplacian, progress).nearest_source(sources, progress=progress),
            )

        return compute

    def write(self, context, obj, result):
        write_attribute(obj.data, CELL, result)
        tag_changed(obj.data)
        count = len(np.unique(result[result >= 0]))
        return [*unreached(obj, result >= 0, "Their cell is -1."), f"{obj.name}: {count:,} cells"]


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

    group: StringProperty(
        name="Center",
        description="Vertex group around the center of the texture, which is the point nearest to the mean of its"
        " points; where there is none of that name, the points selected in Edit Mode",
        default=SOURCE,
    )
    radius: FloatProperty(
        name="Radius",
        description="Distance along the surface from the center of the texture to its border; 0 for all points",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )
    angle: FloatProperty(
        name="Angle", description="Rotation of the texture about its center", default=0.0, subtype="ANGLE"
    )

    def plan(self, context, obj):
        if np.isnan(self.radius):
            raise PointCloudError("The radius of the texture is not a number. Use one from 0 on.")
        sources = np.flatnonzero(read_sources(obj, self.group))
        reading, operator = operator_reader(context, obj)
        points = reading.points[sources]
        center = int(sources[np.linalg.norm(points - points.mean(axis=0), axis=1).argmin()])
        radius, rotation = self.radius, np.exp(1j * self.angle)

        def compute(progress):
            laplacian = operator(progress)
            if laplacian.component[center] < 0:
                raise PointCloudError(
                    f'The center is a point of "{obj.name}" that the operator left out, because it is an outlier.'
                    " Choose a point of the surface."
                )
            place = cache.result(
                laplacian,
                "map",
                center,
                compute=lambda: _transport(laplacian, progress).logarithmic_map(
                    center, geodesics=cache.geodesics(laplacian, progress), progress=progress
                ),
            )
            reached = np.isfinite(place[:, 0])
            place = place @ [1.0, 1.0j]
            border = radius or np.abs(place[reached]).max()
            texture = 0.5 + 0.5j + 0.5 * rotation * place / border
            return np.where(reached[:, None], np.column_stack([texture.real, texture.imag]), OUTSIDE), border

        return compute

    def write(self, context, obj, result):
        texture, border = result
        write_attribute(obj.data, UV, texture)
        tag_changed(obj.data)
        return [f"{obj.name}: texture coordinates up to {length_text(border)} from the center"]


class MESHFREE_OT_unwrap(Unwrap, ShownOperator, bpy.types.Operator):
    """Map the surface around a point to texture coordinates, like a decal"""

    bl_idname = "meshfree.unwrap"
    bl_label = "Unwrap Around Point"


class ExtendDirection(Tool):
    """The settings and the work of `meshfree.extend_direction`."""

    writes = (DIRECTION,)
    asks = ("group", "direction", "show")

    group: StringProperty(
        name="Sources",
        description="Vertex group with the points that have the direction; where there is none of that name, the points"
        " selected in Edit Mode",
        default=SOURCE,
    )
    direction: FloatVectorProperty(
        name="Direction",
        description="Direction at these points, along the axes of the world; projected onto the surface",
        default=(0.0, 0.0, -1.0),
        min=-1e6,
        max=1e6,
        subtype="XYZ",
    )

    def plan(self, context, obj):
        sources = read_sources(obj, self.group)
        reading, operator = operator_reader(context, obj)
        direction = np.array(self.direction, dtype=np.float64)

        def compute(progress):
            laplacian = operator(progress)
            found = cache.result(
                laplacian,
                "directions",
                sources,
                direction,
                compute=lambda: _transport(laplacian, progress).extend(sources, direction, progress=progress),
            )
            reached = found.any(axis=1)
            result = np.zeros_like(found)
            result[reached] = reading.local_directions(found[reached])
            return result

        return compute

    def write(self, context, obj, result):
        write_attribute(obj.data, DIRECTION, result)
        tag_changed(obj.data)
        notices = unreached(obj, result.any(axis=1), "They have no direction.")
        return [*notices, f"{obj.name}: directions on {len(result):,} points"]


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
        places, closed = self.read_curve(context, obj)
        reading, operator = operator_reader(context, obj)

        def compute(progress):
            laplacian = operator(progress)
            known = np.flatnonzero(laplacian.component >= 0)
            nearest = known[core.geometry.nearest_rows(reading.points[known], places)]
            _, first = np.unique(nearest, return_index=True)
            curve = nearest[np.sort(first)]
            if len(curve) < 2:
                raise PointCloudError("All of the curve lies at one point of the cloud. Draw it along the surface.")
            return cache.result(
                laplacian,
                "sides of a curve",
                curve,
                closed,
                compute=lambda: cache.geodesics(laplacian, progress).signed_distance(
                    curve, closed and len(curve) > 2, progress=progress
                ),
            )

        return compute

    def read_curve(self, context, obj):
        """Return the points of the curve, (k, 3), relative to the object's location, and whether it is closed."""
        places, closed = _read_curve(context, self.curve)
        return places - np.array(obj.matrix_world.translation), closed  # as points are read

    def write(self, context, obj, result):
        reached = np.isfinite(result)
        write_attribute(obj.data, SIGNED_DISTANCE, np.where(reached, result, 0.0))
        tag_changed(obj.data)
        low, high = (length_text(value) for value in (result[reached].min(), result[reached].max()))
        notices = unreached(obj, reached, "Their distance is 0.")
        return [*notices, f"{obj.name}: {low} on the right to {high} on the left"]


class MESHFREE_OT_signed_distance(SignedDistance, ShownOperator, bpy.types.Operator):
    """Geodesic distance from a curve, positive on its left"""

    bl_idname = "meshfree.signed_distance"
    bl_label = "Signed Distance"


def _read_curve(context, name):
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
    Registration(MESHFREE_OT_nearest_source, panel=Row("Measure", 3, 1), menu=Row("Object", 7, 2), verb=NearestSource),
    Registration(MESHFREE_OT_unwrap, panel=Row("Measure", 3, 2), menu=Row("Object", 7, 3), verb=Unwrap),
    Registration(
        MESHFREE_OT_extend_direction, panel=Row("Measure", 3, 3), menu=Row("Object", 7, 4), verb=ExtendDirection
    ),
    Registration(
        MESHFREE_OT_signed_distance, panel=Row("Measure", 2, 2), menu=Row("Object", 7, 1), verb=SignedDistance
    ),
)
