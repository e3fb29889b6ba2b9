"""The deformation of all points by a binding and a pose of its handles: arrays only, in any thread."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ... import core
from ...core.linalg import inv
from ..objects.attributes import MOVED_DISC
from ..objects.carried import local_gradients, moved_discs, moved_splats
from .handles import Binding, HandlePose
from .pose import State


class Moved(NamedTuple):
    """A deformed object."""

    points: np.ndarray  # (n, 3), what the next step starts from
    displacement: np.ndarray  # (n, 3), in local space
    carried: dict  # what deforms with the points, by attribute: empty at rest, without harmonics if the result is quick
    state: State  # SETTLED or QUICK
    converged: bool  # whether the rotations converged


class Follower:
    """The solvers of a bound object: `quick`, and `exact` for settled results, made when first needed.

    Of splats both are the same. The last points are kept by session_uid, since copies of an object share the binding.
    """

    def __init__(self, binding: Binding, progress):
        self.binding, self.last = binding, {}
        self.quick = self._bind(core.deform.coarse_deformer, progress)
        # Splats scatter about their surface, which the coarse solver averages.
        of_all = binding.splats is not None or isinstance(self.quick, core.deform.Deformer)
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

    @property
    def is_prepared(self) -> bool:
        """Whether it has the factors for settled results."""
        return self.exact is not None

    @property
    def notices(self) -> list:
        """What is to be told about the binding."""
        return self.quick.notices

    def prepare(self, progress):
        """Factorize for settled results, if necessary, and return this."""
        if self.exact is None:
            self.exact = self._bind(core.deform.Deformer, progress)
        return self

    def move(self, pose: HandlePose, discs, state: State, start=None, progress=None) -> Moved:
        """Solve for all points in a pose: exactly for the state SETTLED, by one step for QUICK.

        That step starts from the last points, (n, 3), if there are some, or from rest. Discs of the display at rest,
        normals times radii, (n, 3), deform with the points. A progress callback is required where it may have to
        factorize.
        """
        bound, rest, handles = self.binding, self.quick.points, self.binding.handles(pose)
        if _is_at_rest(bound, handles):
            return Moved(rest, np.zeros_like(rest), {}, state, True)
        if state is State.QUICK:
            solver, steps = self.quick, 1
        else:
            solver, steps = self.prepare(progress).exact, pose.steps
        points, _, converged = solver.deform(handles @ bound.matrix.T, steps=steps, start=start, progress=progress)
        displacement, carried = (points - rest) @ inv(bound.matrix).T, {}
        if bound.splats is not None or discs is not None:
            gradients = local_gradients(solver.gradients(points), bound.matrix)
            carried = carried_along(bound.splats, discs, bound.rest + displacement, gradients, state)
        return Moved(points, displacement, carried, state, converged)


def _is_at_rest(binding, handles):
    """Whether handles in local space, (h, 3), are where they were bound."""
    rest = binding.rest
    return np.allclose(handles, rest[binding.constraints.moved], rtol=0.0, atol=1e-6 * np.ptp(rest, axis=0).max())


def carried_along(splats, discs, positions, gradients, state):
    """Return splats, or else discs, after a deformation with these gradients, (n, 3, 3), by attribute."""
    if splats is None:
        return {MOVED_DISC: moved_discs(discs, gradients)}
    if state is State.QUICK:  # harmonics take longest, and can wait
        splats = replace(splats, harmonics=splats.harmonics[:, :0])
    return moved_splats(splats.deformed(positions, gradients))
