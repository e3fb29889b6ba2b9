"""From a binding and a pose of its handles to where all points are: arrays in, arrays out, in any thread."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ... import core
from ..objects.attributes import MOVED_DISC
from ..objects.carried import local_gradients, moved_discs, moved_splats
from .binding import Binding
from .pose import Pose, State


class Moved(NamedTuple):
    """Where handles have moved a bound object.

    Attributes
    ----------
    points : ndarray, (n, 3)
        As `Binding.matrix` places them.
    displacement : ndarray, (n, 3)
        In local space.
    carried : dict of str to ndarray
        What goes along, by the names of its attributes: nothing at rest, and no harmonics if the result is quick.
    state : State
        SETTLED or QUICK.
    converged : bool
        Whether the rotations have ended to change.
    """

    points: np.ndarray
    displacement: np.ndarray
    carried: dict
    state: State
    converged: bool


class Follower:
    """What a bound object follows its handles by.

    Attributes
    ----------
    binding : Binding
    quick : CoarseDeformer or Deformer
        For quick results.
    exact : Deformer or CoarseDeformer or None
        For settled ones, once it was needed; of splats the same.
    last : dict of int to ndarray
        The last points by the object's session_uid: copies of an object have one binding.
    """

    def __init__(self, binding: Binding, progress):
        self.binding, self.last = binding, {}
        self.quick = self._bind(core.coarse_deformer, progress)
        # Splats scatter about their surface: motions of some points that carry the others even that out.
        of_all = binding.splats is not None or isinstance(self.quick, core.Deformer)
        self.exact = self.quick if of_all else None

    def _bind(self, make, progress):
        bound, known = self.binding, self.binding.constraints
        return make(
            bound.laplacian(progress),
            known.moved,
            known.kept,
            rotation_aware=bound.rotation_aware,
            weights=None if bound.softness is None else bound.softness * known.strength,
            progress=progress,
        )

    def prepare(self, progress):
        """Make the factors for settled results, if there are none, and return this."""
        if self.exact is None:
            self.exact = self._bind(core.Deformer, progress)
        return self

    def move(self, pose: Pose, state: State, start=None, progress=None) -> Moved:
        """Find where a pose moves all points.

        Parameters
        ----------
        pose : Pose
        state : State
            SETTLED, or QUICK for one step.
        start : ndarray, (n, 3), optional
            The last points, from which that step is taken; otherwise from rest.
        progress : callable, optional
            Needed where factors may have to be made.
        """
        bound, rest, handles = self.binding, self.quick.points, self.binding.handles(pose)
        if _is_at_rest(bound, handles):
            return Moved(rest, np.zeros_like(rest), {}, state, True)
        if state is State.QUICK:
            solver, steps = self.quick, 1
        else:
            solver, steps = self.prepare(progress).exact, pose.steps
        points, _, converged = solver.deform(handles @ bound.matrix.T, steps=steps, start=start, progress=progress)
        displacement, carried = (points - rest) @ np.linalg.inv(bound.matrix).T, {}
        if bound.splats is not None or pose.discs is not None:
            gradients = local_gradients(solver.gradients(points), bound.matrix)
            carried = _carried(bound.splats, pose.discs, bound.rest + displacement, gradients, state)
        return Moved(points, displacement, carried, state, converged)


def _is_at_rest(binding, handles):
    """Whether handles in local space, (h, 3), are where they were bound."""
    rest = binding.rest
    return np.allclose(handles, rest[binding.constraints.moved], rtol=0.0, atol=1e-6 * np.ptp(rest, axis=0).max())


def _carried(splats, discs, positions, gradients, state):
    """Return splats or discs after a deformation with these gradients, (n, 3, 3), by the names of their attributes."""
    if splats is None:
        return {MOVED_DISC: moved_discs(discs, gradients)}
    if state is State.QUICK:  # harmonics take longer than all else, and can wait
        splats = replace(splats, harmonics=splats.harmonics[:, :0])
    return moved_splats(splats.deformed(positions, gradients))
