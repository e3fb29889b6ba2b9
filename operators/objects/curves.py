"""Curve objects: lines on the surface of an object's points, and plots."""

import bpy
import numpy as np

from ...core import PointCloudError
from .place import OFFSET, link_beside


def add_curves(obj, name, lines, thickness=0.0):
    """Add a curve object beside an object, with the same place, and return it.

    Lines are corners in the object's local space, (k, 3), each with whether its last one is joined to the first; the
    thickness is the radius of tubes along them.
    """
    made = bpy.data.objects.new(name, _curve(name, lines, thickness))
    link_beside(made, obj)
    made.matrix_world = obj.matrix_world
    if OFFSET in obj:
        made[OFFSET] = obj[OFFSET]
    return made


def plot(obj, name, across, values):
    """Add a curve object beside an object, upright in the world: numbers along X, values along Z, from zero; return it.

    Where a value is not finite, there is a gap.
    """
    known = np.isfinite(values)
    places = np.column_stack([across, values, np.zeros(len(values))])
    runs = np.split(np.arange(len(values)), np.flatnonzero(np.diff(known)) + 1)
    lines = [(places[run], False) for run in runs if known[run[0]] and len(run) > 1]
    made = bpy.data.objects.new(name, _curve(name, lines, 0.0))
    link_beside(made, obj)
    made.rotation_euler.x = 0.5 * np.pi
    made.location.xy = obj.matrix_world.translation.xy
    return made


def _curve(name, lines, thickness):
    """Return a curve of polygons, as of `add_curves`."""
    curve = bpy.data.curves.new(name, "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", thickness
    for points, closed in lines:
        spline = curve.splines.new("POLY")
        spline.points.add(len(points) - 1)
        places = np.column_stack([points, np.ones(len(points))])
        spline.points.foreach_set("co", places.astype(np.float32).reshape(-1))
        spline.use_cyclic_u = closed
    return curve


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
