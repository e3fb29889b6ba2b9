"""Curve objects of lines that lie on the surface of an object's points."""

import bpy
import numpy as np

from .place import OFFSET


def add_curves(obj, name, lines, thickness=0.0):
    """Add a curve object beside an object, with the same place.

    Parameters
    ----------
    obj : bpy.types.Object
    name : str
    lines : iterable of ((k, 3) ndarray, bool)
        Corners in the object's local space, and whether the last one is joined to the first.
    thickness : float
        Radius of tubes along the lines.

    Returns
    -------
    bpy.types.Object
    """
    curve = bpy.data.curves.new(name, "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", thickness
    for points, closed in lines:
        spline = curve.splines.new("POLY")
        spline.points.add(len(points) - 1)
        places = np.column_stack([points, np.ones(len(points))])
        spline.points.foreach_set("co", places.astype(np.float32).reshape(-1))
        spline.use_cyclic_u = closed
    made = bpy.data.objects.new(name, curve)
    for collection in obj.users_collection:
        collection.objects.link(made)
    made.matrix_world = obj.matrix_world
    if OFFSET in obj:
        made[OFFSET] = obj[OFFSET]
    return made
