"""The deformation of all points by the pose of an armature: arrays only, in any thread."""

from dataclasses import dataclass

import numpy as np

from ... import core
from ..deform.follower import Moved, carried_along
from ..deform.pose import Pose, State
from ..objects.carried import local_gradients

_STILL = 1e-6  # of the extent of the points, and of a turn: less is a pose at rest


@dataclass(frozen=True)
class BoneBinding:
    """The binding of an object to bones, read from it once.

    Attributes
    ----------
    rest : ndarray, (n, 3) float32
        Points at rest in local space.
    splats : Splats or None
        At rest in local space, if the points are splats.
    bones : ndarray, (n, k) int
        Which bones each point follows.
    weights : ndarray, (n, k)
        How much; their sums are one, or zero where a point follows none.
    count : int
        How many bones there are.
    places : bool
        Whether the points are moved; else another modifier does that, and only what they carry is turned.
    """

    rest: np.ndarray
    splats: "core.Splats | None"
    bones: np.ndarray
    weights: np.ndarray
    count: int
    places: bool


@dataclass(frozen=True)
class BonePose(Pose):
    """A pose of the bones.

    Attributes
    ----------
    changes : ndarray, (b, 3, 4)
        From rest to pose of each bone, in the armature's space.
    relative : ndarray, (4, 4)
        From the space of the points to that of the armature.
    preserve_volume : bool
        Whether dual quaternions are blended.
    """

    changes: np.ndarray
    relative: np.ndarray
    preserve_volume: bool


class BoneFollower:
    """What moves the points of an object that is bound to bones; see `Follower`.

    Attributes
    ----------
    binding : BoneBinding
    last : dict of int to None
        Not needed, since each pose is found from rest.
    is_prepared : bool
    notices : list of str
    """

    is_prepared = True

    def __init__(self, binding: BoneBinding):
        self.binding, self.last, self.notices = binding, {}, []
        self._skinner = core.Skinner(binding.weights, binding.bones, binding.count)

    def prepare(self, progress):
        """Return this."""
        return self

    def move(self, pose: BonePose, discs, state: State, start=None, progress=None) -> Moved:
        """Move all points to a pose, with the discs at rest, (n, 3), or None.

        Harmonics, which take longest, are left out of a result that shall be quick; without them it is settled.
        """
        bound = self.binding
        still = np.zeros(bound.rest.shape)
        needs_gradients = bound.splats is not None or discs is not None
        if _is_at_rest(bound.rest, pose) or not (bound.places or needs_gradients):
            return Moved(None, still, {}, State.SETTLED, True)
        linear, shift = pose.relative[:3, :3], pose.relative[:3, 3]
        points = bound.rest @ linear.T + shift
        found = self._skinner.move(
            points, pose.changes, dual_quaternions=pose.preserve_volume, gradients=needs_gradients
        )
        moved, gradients = found if needs_gradients else (found, None)
        displacement = (moved - points) @ np.linalg.inv(linear).T if bound.places else still
        waits = state is State.QUICK and bound.splats is not None and bound.splats.harmonics.shape[1] > 0
        state = State.QUICK if waits else State.SETTLED
        carried = {}
        if needs_gradients:
            gradients = local_gradients(gradients, linear)
            carried = carried_along(bound.splats, discs, bound.rest + displacement, gradients, state)
        return Moved(None, displacement, carried, state, True)


def _is_at_rest(rest, pose):
    """Whether all bones are where they were at rest."""
    change = np.abs(pose.changes - np.eye(4)[:3])
    size = np.ptp(rest, axis=0).max() * np.linalg.norm(pose.relative[:3, :3], 2)
    return change[:, :, :3].max(initial=0.0) <= _STILL and change[:, :, 3].max(initial=0.0) <= _STILL * size
