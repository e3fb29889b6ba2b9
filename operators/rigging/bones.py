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
