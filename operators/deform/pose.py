"""Poses of what bound objects follow, and the displacements for them.

Displacements are the attribute `lb_displacement`, in local space.
"""

from dataclasses import dataclass
from enum import Enum

import bmesh
import bpy
import numpy as np

from ...core import PointCloudError
from ...core.linalg import cond, inv
from ...tools.quantities import DISPLACEMENT
from ..objects.attributes import in_edit_mesh, point_count, tag_changed, write_attribute
from ..objects.carried import write_moved
from .kinds import kind_of

POSE = "lb_pose"  # custom property of the mesh: the pose of the displacements


class State(Enum):
    """How far a bound object follows its handles or bones."""

    BAKED = "baked"  # it shows a baked animation, which nothing changes
    STALE = "stale"  # something has changed since it was bound
    PREPARING = "preparing"  # handles were moved, and factors are missing
    QUICK = "quick"  # one step of the coarse solver from the last result
    SETTLED = "settled"  # all steps on all points, from rest


@dataclass(frozen=True)
class Pose:
    """What displacements depend on while the binding is valid."""

    key: tuple  # what the follower of the object depends on, see `Kind.key`
    numbers: np.ndarray  # its identity, kept in the file: two checksums and all transforms

    def is_same(self, numbers) -> bool:
        """Whether another pose, given by its numbers or None, is the same up to rounding."""
        return (
            numbers is not None
            and numbers.shape == self.numbers.shape
            and (numbers[:2] == self.numbers[:2]).all()
            and np.allclose(numbers[2:], self.numbers[2:], rtol=1e-6, atol=1e-7)
        )


def relative_matrix(obj, other, depsgraph=None):
    """Return the matrix of another object in the space of an object, (4, 4) float64, evaluated by a depsgraph."""
    if depsgraph is not None:
        obj, other = obj.evaluated_get(depsgraph), other.evaluated_get(depsgraph)
    matrix = np.array(obj.matrix_world, dtype=np.float64)
    if not cond(matrix[:3, :3]) < 1e6:
        raise PointCloudError(
            f'"{obj.name}" is scaled to nothing along an axis. Give it a scale above zero along each axis.'
        )
    return inv(matrix) @ np.array(other.matrix_world, dtype=np.float64)


def is_there(obj, scene=None) -> bool:
    """Whether an object, such as the empty of a handle, is still in a scene, or in any."""
    if obj is None:
        return False
    scenes = bpy.data.scenes if scene is None else [scene]
    if any(obj.visible_get(view_layer=layer) for each in scenes for layer in each.view_layers):
        return True
    found = obj.users_scene  # takes 1 ms for 5,000 objects
    return scene in found if scene is not None else bool(found)


def shown_state(obj, pose) -> State:
    """Return the state of an object that is not stale at a pose: settled, quick or preparing."""
    known = obj.data.get(POSE)
    if known is None or not pose.is_same(np.array(known[1:])):
        return State.PREPARING
    return State.SETTLED if known[0] else State.QUICK


def write_displacement(obj, displacement, numbers, state, moved):
    """Write displacements in local space, (n, 3), what deforms with the points, by attribute, and their pose.

    In Edit Mode only displacements can be written. Unless the state is SETTLED, they are computed again.
    """
    data = obj.data
    if in_edit_mesh(obj):
        edited = bmesh.from_edit_mesh(data)
        layer = edited.verts.layers.float_vector[DISPLACEMENT]
        for vertex, step in zip(edited.verts, displacement.tolist(), strict=True):
            vertex[layer] = step
        bmesh.update_edit_mesh(data, loop_triangles=False, destructive=False)
    else:
        write_attribute(data, DISPLACEMENT, displacement)
        write_moved(data, moved)
        tag_changed(data)
    data[POSE] = [float(state is State.SETTLED), *numbers.tolist()]


def write_rest(obj):
    """Write zero displacements for the present pose."""
    write_displacement(
        obj, np.zeros((point_count(obj.data), 3)), kind_of(obj).read_pose(obj).numbers, State.SETTLED, {}
    )
