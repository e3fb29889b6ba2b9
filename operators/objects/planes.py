"""Planes that objects give, such as empties."""

import numpy as np

from ...core import PointCloudError


def object_of(scene, name, meant):
    """Return the object of a name in a scene; an error says what is meant by it."""
    found = scene.objects.get(name)
    if found is None:
        raise PointCloudError(f'There is no object "{name}" in this scene. Choose one {meant}.')
    return found


def plane_of(scene, name, obj):
    """Return the local XY plane of an object of a scene: a point, from the location of another one on, and a normal.

    If there is no such object, or it has no plane, `PointCloudError` is raised.
    """
    found = object_of(scene, name, "whose local XY plane is meant, such as an empty")
    matrix = np.array(found.matrix_world, dtype=np.float64)
    normal = np.cross(matrix[:3, 0], matrix[:3, 1])
    if not normal.any():
        raise PointCloudError(f'"{name}" is scaled to nothing along X or Y, so that it has no plane.')
    return matrix[:3, 3] - np.array(obj.matrix_world.translation), normal
