"""Where another object is, frame by frame, to find the points that it touches."""

import bpy
import numpy as np

from ...core import PointCloudError
from ...core.linalg import pinv


def places_of(context, obj, name: str, frames) -> list:
    """Return where the vertices of another object are at frames of the scene, (k, 3) each, or its place if it has none.

    They are beside the points of the object as these are read at the frame on show, to which the scene is put back,
    wherever it moves. If there is no other object of that name, `PointCloudError` is raised.
    """
    scene, other = context.scene, context.scene.objects.get(name)
    if other is None or other == obj:
        what = "is the object itself" if other == obj else "is not in the scene"
        raise PointCloudError(f'The Touching Object "{name}" {what}. Choose another one, or clear it to use a group.')
    axes, shown = np.array(obj.matrix_world)[:3, :3], (scene.frame_current, scene.frame_subframe)
    found = []
    try:
        for frame in frames:
            scene.frame_set(frame)
            depsgraph = context.evaluated_depsgraph_get()
            places = _places(other.evaluated_get(depsgraph))
            inverse = pinv(np.array(obj.evaluated_get(depsgraph).matrix_world))
            local = places @ inverse[:3, :3].T + inverse[:3, 3]
            found.append(local @ axes.T)
    finally:
        scene.frame_set(shown[0], subframe=shown[1])
    return found


def _places(evaluated):
    """Return the vertices of an evaluated object in the world, (k, 3), or its place."""
    matrix, places = np.array(evaluated.matrix_world), np.zeros((1, 3), np.float32)
    data = evaluated.data
    if isinstance(data, bpy.types.Mesh) and len(data.vertices):
        places = np.empty((len(data.vertices), 3), np.float32)
        data.vertices.foreach_get("co", places.reshape(-1))
    return places @ matrix[:3, :3].T + matrix[:3, 3]
