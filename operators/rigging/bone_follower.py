"""The deformation of all points by the pose of an armature: arrays only, in any thread."""

from dataclasses import dataclass

import numpy as np

from ... import core
from ...core.linalg import inv
from ..deform.follower import Moved, carried_along
from ..deform.pose import Pose, State
from ..objects.carried import local_gradients

_ROUNDING = 2e-6  # of the lengths of axes, in single precision and through a chain of bones
_STILL = 1e-6  # of the extent of the points, and of a turn: less is a pose at rest


@dataclass(frozen=True)
class BoneBinding:
    """The binding of an object to bones, read from it once."""

    rest: np.ndarray  # (n, 3) float32, points at rest in local space
    splats: "core.splats.Splats | None"  # at rest in local space, if the points are splats
    bones: np.ndarray  # (n, k) int, which bones each point follows
    weights: np.ndarray  # (n, k), how much; their sums are one, or zero where a point follows none
    count: int  # how many bones there are
    places: bool  # whether the points are moved; else another modifier does that, and only what they carry is turned


@dataclass(frozen=True)
class BonePose(Pose):
    """A pose of the bones."""

    changes: np.ndarray  # (b, 3, 4), from rest to pose of each bone, in the armature's space
    relative: np.ndarray  # (4, 4), from the space of the points to that of the armature
    preserve_volume: bool  # whether dual quaternions are blended


class BoneFollower:
    """What moves the points of an object that is bound to bones; see `Follower`.

    `last` is not needed, since each pose is found from rest.
    """

    is_prepared = True

    def __init__(self, binding: BoneBinding):
        self.binding, self.last, self.notices = binding, {}, []
        self._skinner = core.rig.Skinner(binding.weights, binding.bones, binding.count)
        self._rest, self._size = binding.rest.astype(np.float64), np.ptp(binding.rest, axis=0).max()
        self._placed = np.zeros((4, 4)), None  # the last transform to the armature's space, and the points there

    def prepare(self, progress):
        """Return this."""
        return self

    def move(self, pose: BonePose, discs, state: State, start=None, progress=None) -> Moved:
        """Move all points to a pose, with the discs at rest, (n, 3), or None.

        Harmonics, which take longest, are left out of a result that shall be quick; without them it is settled.
        """
        bound = self.binding
        needs_gradients = bound.splats is not None or discs is not None
        if self._is_at_rest(pose) or not (bound.places or needs_gradients):
            return Moved(None, np.zeros(bound.rest.shape), {}, State.SETTLED, True)
        points = self._points(pose.relative)
        found = self._skinner.move(
            points,
            pose.changes,
            dual_quaternions=pose.preserve_volume,
            gradients=needs_gradients,
            rounding=_ROUNDING,
        )
        moved, gradients = found if needs_gradients else (found, None)
        linear = pose.relative[:3, :3]
        if bound.places:
            moved -= points
            displacement = moved @ inv(linear).T
        else:
            displacement = np.zeros(bound.rest.shape)
        waits = state is State.QUICK and bound.splats is not None and bound.splats.harmonics.shape[1] > 0
        state = State.QUICK if waits else State.SETTLED
        carried = {}
        if needs_gradients:
            gradients = local_gradients(gradients, linear)
            carried = carried_along(bound.splats, discs, bound.rest + displacement, gradients, state)
        return Moved(None, displacement, carried, state, True)

    def _points(self, relative):
        """Return the points at rest in the armature's space, which mostly is where it was."""
        known, points = self._placed
        if points is None or not np.array_equal(known, relative):
            points = self._rest @ relative[:3, :3].T + relative[:3, 3]
            self._placed = relative, points
        return points

    def _is_at_rest(self, pose):
        """Whether all bones are where they were at rest."""
        change = np.abs(pose.changes - np.eye(4)[:3])
        size = self._size * np.linalg.norm(pose.relative[:3, :3], 2)
        return change[:, :, :3].max(initial=0.0) <= _STILL and change[:, :, 3].max(initial=0.0) <= _STILL * size
