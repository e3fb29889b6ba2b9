"""The bones of an armature that deform, at rest and in a pose."""

from typing import NamedTuple

import numpy as np

from ...core import PointCloudError


class Bones(NamedTuple):
    """The deforming bones of an armature at rest, in the armature's space.

    Attributes
    ----------
    names : list of str
    heads, tails : ndarray, (b, 3)
    """

    names: list
    heads: np.ndarray
    tails: np.ndarray


def deforming_bones(armature) -> Bones:
    """Read the bones of an armature object that deform, in their order.

    Raises
    ------
    PointCloudError
        It has none.
    """
    bones = [bone for bone in armature.data.bones if bone.use_deform]
    if not bones:
        raise PointCloudError(
            f'No bone of "{armature.name}" deforms. Turn on Deform in the properties of at least one bone.'
        )
    heads, tails = (np.array([getattr(bone, end) for bone in bones]) for end in ("head_local", "tail_local"))
    return Bones([bone.name for bone in bones], heads, tails)


def chosen_armature(context):
    """Return the active armature, or the only selected one, or that which the active object follows; else None."""
    active = context.object
    if active is not None and active.type == "ARMATURE":
        return active
    selected = [obj for obj in context.selected_objects if obj.type == "ARMATURE"]
    if selected:
        return selected[0] if len(selected) == 1 else None
    return followed_armature(active)


def followed_armature(obj):
    """Return the armature that an object follows, by its modifiers or as its child; None if there is none."""
    if obj is None:
        return None
    found = [item.object for item in obj.modifiers if item.type == "ARMATURE"] + [obj.parent]
    return next((other for other in found if other is not None and other.type == "ARMATURE"), None)


def ends_seen_from(obj, armature, bones):
    """Return heads and tails of bones in the space in which the points of an object are read, (b, 3) each.

    That is world space, moved by the object's location; see `Reading`.

    Raises
    ------
    PointCloudError
        The armature is scaled to nothing along an axis.
    """
    matrix = np.array(armature.matrix_world)
    if not np.linalg.cond(matrix[:3, :3]) < 1e6:
        raise PointCloudError(
            f'"{armature.name}" is scaled to nothing along an axis. Give it a scale above zero along each axis.'
        )
    shift = matrix[:3, 3] - np.array(obj.matrix_world.translation)
    return tuple(ends @ matrix[:3, :3].T + shift for ends in (bones.heads, bones.tails))


def pose_matrices(armature, names):
    """Return how bones have moved since rest, in the armature's space, (b, 4, 4).

    Parameters
    ----------
    armature : bpy.types.Object
        Evaluated by a depsgraph where constraints and drivers count.
    names : sequence of str
        Those of bones that are gone stay.
    """
    changes = np.tile(np.eye(4), (len(names), 1, 1))
    for change, name in zip(changes, names, strict=True):
        bone = armature.pose.bones.get(name)
        if bone is not None:
            change[:] = np.array(bone.matrix) @ np.linalg.inv(np.array(bone.bone.matrix_local))
    return changes
