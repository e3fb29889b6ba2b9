"""The box that an object spans: the cube of an empty, or the bounding box of anything else."""

from typing import NamedTuple

import bpy
import numpy as np

from ...core import PointCloudError
from ...core.linalg import det, inv


class Box(NamedTuple):
    """A box, possibly turned."""

    center: np.ndarray  # (3,)
    edges: np.ndarray  # (3, 3), columns from the center to the middles of three faces

    @property
    def bounds(self):
        """Return the lowest and the highest corner of the box along the axes around it, (2, 3)."""
        reach = np.abs(self.edges).sum(axis=1)
        return np.stack([self.center - reach, self.center + reach])

    def holds(self, points):
        """Return which points, (n, 3), lie inside, (n,) bool."""
        return (np.abs((points - self.center) @ inv(self.edges).T) <= 1.0).all(axis=1)


def box_of(context, name, offset) -> Box:
    """Return the box of an object, shifted by an offset, (3,), from world coordinates to others.

    If there is no such object, or it has no volume, `PointCloudError` is raised.
    """
    context.view_layer.update()  # a script may just have moved it
    obj = bpy.data.objects.get(name)
    if obj is None:
        raise PointCloudError(f'There is no object "{name}" for the box. Choose another one, or none')
    if obj.type == "EMPTY":
        corners = obj.empty_display_size * np.array([[-1.0] * 3, [1.0] * 3])
    else:
        corners = np.array(obj.bound_box)
    low, high = corners.min(axis=0), corners.max(axis=0)
    matrix = np.array(obj.matrix_world)
    edges = matrix[:3, :3] * (0.5 * (high - low))
    lengths = np.linalg.norm(edges, axis=0)
    if not abs(det(edges)) > 1e-9 * np.prod(lengths) > 0.0:
        raise PointCloudError(f'"{name}" is flat, so nothing is inside its box. Scale it, or choose another object')
    return Box(matrix[:3, :3] @ (0.5 * (low + high)) + matrix[:3, 3] + offset, edges)
