"""Orientation of the normals, for this and all later analyses."""

from dataclasses import replace

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ...command import orienting
from ...command.analysis import WRITE_LIMIT
from ...core import PointCloudError
from ...tools.quantities import AREA, NORMAL, ORIENTATION, RESULTS
from ..objects.attributes import read_attribute
from ..objects.reading import read_points
from ..objects.result import write_result
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ShownOperator, Tool
from .analyze import plan_analysis


class OrientNormals(Tool):
    """The settings and the work of `meshfree.orient_normals`."""

    writes = (*RESULTS, ORIENTATION)
    shown = NORMAL
    asks = ("method", "viewpoint", "source", "holds", "flip", "show")
    adjustable = ("flip", "show")

    method: EnumProperty(
        name="Method",
        items=[
            ("WINDING", "Winding Number", "By the generalized winding number, through gaps and in noise"),
            (
                "OUTSIDE",
                "Outside",
                "Consistent with neighbors, away from the center of each component, terrain up: the default of Analyze"
                " Points",
            ),
            ("VIEWPOINT", "Viewpoint", "Towards an object, such as the camera"),
            ("ATTRIBUTE", "Attribute", "By a vector of each point, such as the scanner position"),
            ("KEEP", "As They Are", "Keep the present side, to flip it"),
        ],
        **orienting.ORIENT["method"].keywords,
    )
    viewpoint: StringProperty(
        name="Viewpoint", description="Object that saw the points, for Viewpoint; empty for the scene's camera"
    )
    source: StringProperty(name="Attribute", **orienting.ORIENT["source"].keywords)
    holds: EnumProperty(
        name="Attribute Holds",
        items=[
            ("POSITIONS", "Positions", "Positions in local coordinates from which the points were seen"),
            ("DIRECTIONS", "Directions", "Directions to the outer side, such as normals from a file"),
        ],
        **orienting.ORIENT["holds"].keywords,
    )
    flip: BoolProperty(name="Flip", **orienting.ORIENT["flip"].keywords)

    def plan(self, context, obj):
        reading = read_points(context, obj)
        method, flip = self.method, self.flip
        viewpoint, notices = self._viewpoints(context, obj, reading)

        def orient(measured, progress):
            laplacian, normals, areas = measured.built.laplacian, measured.measures[NORMAL], measured.measures[AREA]
            progress("Orientation", 0.9)

            def keep(name, viewpoint, compute):
                return cache.result(laplacian, "sides", reading.points, name, viewpoint, compute=compute)

            return orienting.outward(reading.points, normals, areas, method, viewpoint, flip, keep)

        analyze = plan_analysis(context, obj, orient=orient)

        def compute(progress):
            result = analyze(progress)
            return replace(result, notices=[*notices, *result.notices])

        return compute

    def _viewpoints(self, context, obj, reading):
        """Return the positions from which points, as read, were seen, (3,) or (n, 3), or None, and notices of them."""
        if self.method == "VIEWPOINT":
            return _place(context, obj, self.viewpoint), []
        if self.method != "ATTRIBUTE":
            return None, []
        vectors = _vectors(obj, self.source) @ reading.matrix.T
        return orienting.seen_from(vectors, reading.points, self.holds, self.source, obj.name)

    def write(self, context, obj, result):
        before = obj.data.attributes.get(NORMAL)
        earlier = None if before is None else read_attribute(obj.data, NORMAL)
        write_result(obj, result, WRITE_LIMIT, oriented=True)
        return [*result.notices, orienting.reversed_line(earlier, result.local_normals, obj.name)]


class MESHFREE_OT_orient_normals(OrientNormals, ShownOperator, bpy.types.Operator):
    """Choose the sign of the normals, for this object's results and all that is computed from it later"""

    bl_idname = "meshfree.orient_normals"
    bl_label = "Orient Normals"


def _place(context, obj, name):
    """Read the position of the named object, or of the scene's camera, in the coordinates of points as read."""
    found = context.scene.objects.get(name) if name else context.scene.camera
    if found is None:
        missing = f'The scene has no object "{name}"' if name else "The scene has no camera"
        raise PointCloudError(f"{missing} to orient normals to. Choose an object as Viewpoint.")
    return np.array(found.matrix_world.translation - obj.matrix_world.translation, dtype=np.float64)


def _vectors(obj, name):
    """Read a vector attribute, (n, 3)."""
    if not name:
        raise PointCloudError("No attribute is chosen to orient normals by. Choose one with a vector for each point.")
    vectors = read_attribute(obj.data, name).astype(np.float64)
    orienting.check_vectors(vectors, name, f'"{obj.name}"')
    return vectors


TOOLS = (Registration(MESHFREE_OT_orient_normals, panel=Row("Clean", 2, 2), menu=Row("Object", 3, 3)),)
