"""The bones of an armature that deform, at rest and in a pose."""

from typing import NamedTuple

import numpy as np

from ... import core
from ...core import PointCloudError
from ...core.linalg import cond


class Bones(NamedTuple):
    """The deforming bones of an armature at rest, in the armature's space."""

    names: list  # of str
    # (b, 3) each
    heads: np.ndarray
    tails: np.ndarray


def deforming_bones(armature) -> Bones:
    """Read the bones of an armature object that deform, in their order; if it has none, raise `PointCloudError`."""
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
    """Return the armature that an object follows: bound to it, by its modifiers, or as its child; None without one."""
    if obj is None:
        return None
    modifiers = [item.object for item in obj.modifiers if item.type == "ARMATURE"]
    found = [obj.meshfree.deform.armature, *modifiers, obj.parent]
    return next((other for other in found if other is not None and other.type == "ARMATURE"), None)


def ends_seen_from(obj, armature, bones):
    """Return heads and tails of bones in the space in which the points of an object are read, (b, 3) each.

    That is world space, moved by the object's location; see `Reading`. An armature that is scaled to nothing along an
    axis raises `PointCloudError`.
    """
    matrix = np.array(armature.matrix_world)
    if not cond(matrix[:3, :3]) < 1e6:
        raise PointCloudError(
            f'"{armature.name}" is scaled to nothing along an axis. Give it a scale above zero along each axis.'
        )
    shift = matrix[:3, 3] - np.array(obj.matrix_world.translation)
    return tuple(ends @ matrix[:3, :3].T + shift for ends in (bones.heads, bones.tails))


class Envelopes(NamedTuple):
    """How bones limit weights, as Blender's Armature modifier does."""

    deforms: np.ndarray  # (b,) bool, whether a bone is followed at all
    multiplies: np.ndarray  # (b,) bool, whether weights are multiplied by its envelope
    ends: np.ndarray  # (2, b, 3), heads and tails at rest in the armature's space
    sizes: np.ndarray  # (3, b), radii there, and distances

    @property
    def text(self) -> bytes:
        """What tells envelopes from others."""
        return b"".join(part.tobytes() for part in self)

    def shares(self, points, bones):
        """Return by how much the weights of points, (k, 3), of a bone each, (k,) int, are multiplied, (k,)."""
        return core.rig.envelope_share(points, *self.ends[:, bones], *self.sizes[:, bones])


def envelopes(armature, names) -> Envelopes:
    """Read how bones limit weights; those that are gone do not deform."""
    bones = [armature.data.bones.get(name) for name in names]
    deforms, multiplies = np.zeros(len(names), bool), np.zeros(len(names), bool)
    ends, sizes = np.zeros((2, len(names), 3)), np.zeros((3, len(names)))
    for number, bone in enumerate(bones):
        if bone is not None:
            deforms[number], multiplies[number] = bone.use_deform, bone.use_deform and bone.use_envelope_multiply
            if multiplies[number]:
                ends[:, number] = bone.head_local, bone.tail_local
                sizes[:, number] = bone.head_radius, bone.tail_radius, bone.envelope_distance
    return Envelopes(deforms, multiplies, ends, sizes)


def bone_matrices(bones, names, attribute: str):
    """Return the matrices of bones, or of bones in a pose, (b, 4, 4); the identity of those that are gone."""
    matrices = np.tile(np.eye(4), (len(names), 1, 1))
    for number, name in enumerate(names):
        bone = bones.get(name)
        if bone is not None:
            matrices[number] = getattr(bone, attribute)
    return matrices
