"""Bound objects follow their handles: what is kept in memory for that, and the handlers that call it.

A quick update, for dragging and playing, takes one step from the last result, on some of the points, which carry the
others. A settled one is exact: it starts from rest and takes all steps on all points, so that it depends on nothing but
where the handles are; what it needs is made when it is first needed. Frames that are rendered or jumped to are settled,
and so is what was dragged once it rests. In a window, what takes long runs in a thread; without one all is settled at
once.
"""

import threading
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from time import perf_counter
from typing import NamedTuple

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ... import core
from ...core import Cancelled
from ..objects.attributes import MOVED_DISC
from ..objects.carried import discs_at_rest, local_gradients, moved_discs, moved_splats
from ..objects.handlers import add_handlers, remove_handlers, tell
from ..objects.options import laplacian_options
from ..objects.reading import boundary_points
from ..objects.splats import has_splats, read_splats
from ..running import cache
from ..running.job import STOPPED, Job, running
from ..running.ready import TROUBLES, told
from . import binding

_IDLE = 0.3  # seconds without a move after which the result is settled
_TICK = 0.05  # seconds between two looks at a thread


@dataclass
class Live:
    """What a bound object follows its handles by.

    Attributes
    ----------
    constraints : binding.Constraints
    rest : ndarray, (n, 3) float32
        Points at rest in local space.
    matrix : ndarray, (3, 3)
        From local space to the lengths of the world when it was bound.
    follower : CoarseDeformer
        For quick updates.
    make_exact : callable
        From a progress callback to the `Deformer` for settled ones.
    exact : Deformer or CoarseDeformer or None
        That, once it was needed; of splats the follower.
    splats : Splats or None
        Those at rest in local space, where the points are splats.
    last : dict of int to ndarray
        The last result by the object's session_uid: copies of an object have one binding.
    """

    constraints: binding.Constraints
    rest: np.ndarray
    matrix: np.ndarray
    follower: "core.CoarseDeformer"
    make_exact: Callable
    exact: "core.Deformer | core.CoarseDeformer | None"
    splats: "core.Splats | None" = None
    last: dict = field(default_factory=dict)

    def prepare(self, progress):
        """Make the factors for settled updates, if there are none, and return this."""
        if self.exact is None:
            self.exact = self.make_exact(progress)
        return self


class Moved(NamedTuple):
    """Where handles have moved a bound object.

    Attributes
    ----------
    points : ndarray, (n, 3)
        As `Live.matrix` places them.
    displacement : ndarray, (n, 3)
        In local space.
    carried : dict of str to ndarray
        What goes along, by the names of its attributes: nothing at rest, and no harmonics if the result is quick.
    """

    points: np.ndarray
    displacement: np.ndarray
    carried: dict


@dataclass
class _Settling:
    """A thread that settles an object, for the timer to look at.

    Attributes
    ----------
    work : Job
    key : tuple
        The `live_key` that it works for.
    pose : ndarray
        The pose that it works for.
    prepares : bool
        Whether it may make factors first.
    """

    work: Job
    key: tuple
    pose: np.ndarray
    prepares: bool


_lives = {}  # by `live_key`
_jobs = {}  # by the object's session_uid, which undo does not change
_troubles = {}  # what went wrong at the last update and at which pose, by session_uid
_due = 0.0  # when to settle what was updated quickly
_lock = threading.Lock()
_owner = None  # the thread that updates


def live_key(obj) -> tuple:
    """What the factors of a bound object that is not stale depend on."""
    settings = obj.meshfree.deform
    return settings.binding_id, binding.solver_settings(settings)


def trouble(obj) -> str:
    """What went wrong when an object was updated last; empty if nothing did."""
    return _troubles.get(obj.session_uid, ("",))[0]


def preparing(obj):
    """Return stage and fraction of the thread that makes the factors of an object, or None."""
    job = _jobs.get(obj.session_uid)
    return (job.work.stage, job.work.fraction) if job is not None and job.prepares else None


def find(obj):
    """Return the factors of a bound object, or None."""
    return _lives.get(live_key(obj))


def is_prepared(obj) -> bool:
    """Whether an object can be settled at once."""
    live = find(obj)
    return live is not None and live.exact is not None


def keep(obj, live):
    """Keep the factors of an object, and drop those that no object needs."""
    used = {live_key(other) for other in binding.bound_objects()}
    for key in _lives.keys() - used:
        del _lives[key]
    _lives[live_key(obj)] = live


def plan_factors(obj, rest, matrix, constraints):
    """Read the settings of an object; return a function of a progress callback that makes its `Live`.

    Parameters
    ----------
    obj : bpy.types.Object
    rest : ndarray, (n, 3) float32
        Points at rest in local space.
    matrix : ndarray, (3, 3)
        From local space to the lengths of the world.
    constraints : binding.Constraints or callable
        Or a function of the `LaplaceBeltrami` and a progress callback that finds them.
    """
    settings = obj.meshfree.deform
    softness = settings.weight if settings.soft else None
    options, boundary, aware = laplacian_options(obj.meshfree), boundary_points(obj), settings.rotation_aware
    splats = read_splats(obj.data) if has_splats(obj.data) else None
    judged = splats if obj.meshfree.leave_out_floaters else None

    def operator(progress):
        return cache.build(rest.astype(np.float64) @ matrix.T, options, boundary, progress, splats=judged).laplacian

    def make_by(kind, known, progress):
        return kind(
            operator(progress),
            known.moved,
            known.kept,
            rotation_aware=aware,
            weights=None if softness is None else softness * known.strength,
            progress=progress,
        )

    def make(progress):
        known = constraints(operator(progress), progress) if callable(constraints) else constraints
        follower = make_by(core.CoarseDeformer, known, progress)
        # Splats scatter about their surface: motions of some points that carry the others even that out.
        exact = follower if splats is not None else follower.exact
        return Live(known, rest, matrix, follower, partial(make_by, core.Deformer, known), exact, splats)

    return make


def is_at_rest(live, goal) -> bool:
    """Whether handles in local space, (h, 3), are where they were bound."""
    return np.allclose(goal, live.rest[live.constraints.moved], rtol=0.0, atol=1e-6 * np.ptp(live.rest, axis=0).max())


def displaced(live, goal, discs, steps=None, start=None, progress=None):
    """Solve for handles in local space, (h, 3), with discs at rest, (n, 3), or none; return a `Moved`.

    With a number of steps the result is exact, otherwise it is a quick one.
    """
    rest = live.follower.points
    if is_at_rest(live, goal):
        return Moved(rest, np.zeros_like(rest), {})
    if steps is None:
        solver = live.follower
        points = solver.solve(goal @ live.matrix.T, steps=1, start=start)
    else:
        solver = live.prepare(progress).exact
        points = solver.solve(goal @ live.matrix.T, steps=steps, progress=progress)
    displacement = (points - rest) @ np.linalg.inv(live.matrix).T
    splats = live.splats
    if splats is None and discs is None:
        return Moved(points, displacement, {})
    gradients = local_gradients(solver.gradients(points), live.matrix)
    if splats is None:
        return Moved(points, displacement, {MOVED_DISC: moved_discs(discs, gradients)})
    if steps is None:  # harmonics take longer than all else, and can wait
        splats = replace(splats, harmonics=splats.harmonics[:, :0])
    return Moved(points, displacement, moved_splats(splats.deformed(live.rest + displacement, gradients)))


def plan_prepared(obj):
    """Read a bound object; return a function of a progress callback that makes what settled updates need."""
    known = find(obj)
    if known is not None:
        return known.prepare
    make, _, _ = _plan_bound(obj)
    return lambda progress: make(progress).prepare(progress)


def plan_settled(obj, depsgraph=None, waits=True):
    """Read a bound object and where its handles are.

    Parameters
    ----------
    obj : bpy.types.Object
    depsgraph : bpy.types.Depsgraph, optional
        Where the handles are read; otherwise as the viewport shows them.
    waits : bool
        Take the time to make all that is missing; otherwise, if nothing is there yet, a quick result has to do.

    Returns
    -------
    callable
        From a progress callback to the `Live`, made if there is none, the `Moved`, and whether it is settled.
    ndarray
        The pose.
    """
    known = find(obj)
    if known is None:
        make, rest, constraints = _plan_bound(obj)
    else:
        rest, constraints = known.rest, known.constraints
    goal, steps = binding.goal(obj, constraints, rest, depsgraph), obj.meshfree.deform.steps
    discs = discs_at_rest(obj)

    def compute(progress):
        live = known or make(progress)
        settled = waits or known is not None or live.exact is not None
        return live, displaced(live, goal, discs, steps if settled else None, progress=progress), settled

    return compute, binding.read_pose(obj, depsgraph)


def _plan_bound(obj):
    """Read a bound object; return what makes its `Live`, its points at rest, and its constraints."""
    rest, constraints = binding.read_rest(obj), binding.read_constraints(obj)
    matrix = np.reshape(obj.meshfree.deform.matrix, (3, 3)).astype(np.float64)
    return plan_factors(obj, rest, matrix, constraints), rest, constraints


def write(obj, live, moved, pose, settled=True):
    """Write where an object is moved, and keep what the next result starts from."""
    live.last[obj.session_uid] = moved.points
    binding.write_displacement(obj, moved.displacement, pose, settled, moved.carried)
    _troubles.pop(obj.session_uid, None)


def update(obj, depsgraph=None, quick=False, waits=True):
    """Let a bound object follow its handles, if they have moved and the binding holds.

    Parameters
    ----------
    obj : bpy.types.Object
    depsgraph : bpy.types.Depsgraph, optional
        Where the handles are read; otherwise as the viewport shows them.
    quick : bool
        Take one step only and leave the rest to the timer; if factors have to be made, all of it.
    waits : bool
        If factors have to be made, make them now and do not leave that to the timer.
    """
    if binding.stale_reason(obj, glance=quick or not waits, trusting=quick):
        return
    pose = binding.read_pose(obj, depsgraph)
    written, settled = binding.written_pose(obj)
    if binding.same_pose(written, pose) and (settled or quick):
        if settled:
            _troubles.pop(obj.session_uid, None)  # it was at another pose
        return
    live = find(obj)
    if not quick and (waits or is_prepared(obj)):
        live, moved, _ = plan_settled(obj, depsgraph)[0](lambda stage, fraction: None)
        keep(obj, live)
        write(obj, live, moved, pose)
        return
    if live is not None:
        goal = binding.goal(obj, live.constraints, live.rest, depsgraph)
        start = live.last.get(obj.session_uid)
        write(obj, live, displaced(live, goal, discs_at_rest(obj), start=start), pose, settled=False)
    settle_later(obj)


def update_all(scene, depsgraph, quick, waits=True):
    """Let all bound objects of a scene follow; what goes wrong is for the panel, since nobody called this."""
    with _guarded() as free:
        for obj in _bound_objects(scene) if free else ():
            try:
                update(obj, depsgraph, quick, waits)
            except TROUBLES as error:
                _troubles[obj.session_uid] = told(error), None


def _bound_objects(scene):
    return [obj for obj in binding.bound_objects(scene) if obj.data.is_editable]


@contextmanager
def _guarded():
    """Let one thread at a time update, and say whether this one was not updating already."""
    global _owner
    if _owner == threading.get_ident():
        yield False
        return
    with _lock:
        _owner = threading.get_ident()
        try:
            yield True
        finally:
            _owner = None


def _on_settings(obj):
    """Let an object follow by its new settings of the deformation, in a window; scripts update when they are done."""
    if binding.is_bound(obj):
        settle_later(obj)


def settle_later(obj):
    """Settle an object when its handles have come to rest."""
    global _due
    _due = perf_counter() + _IDLE
    job = _jobs.get(obj.session_uid)
    if job is not None and not job.prepares:
        job.work.stop()  # what it settles is past
    if not bpy.app.background and not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=_TICK)


def _tick():
    """Take what threads have computed, and settle what has come to rest; a timer of the window."""
    if bpy.app.is_job_running("RENDER"):
        return _IDLE
    shown = {}  # each window has a scene of its own
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window):
            depsgraph = bpy.context.evaluated_depsgraph_get()
        shown.update((obj.session_uid, (obj, depsgraph)) for obj in _bound_objects(window.scene))
    for uid in _jobs.keys() - shown.keys():
        _drop(uid)
    with _guarded():
        waiting = [_attend(obj, depsgraph) for obj, depsgraph in shown.values()]
    if any(waiting):
        tell("panels_changed")
    return _TICK if any(waiting) else None


def _attend(obj, depsgraph) -> bool:
    """Take the result of an object's thread, or start one; say whether there is more to come."""
    uid = obj.session_uid
    job = _jobs.get(uid)
    try:
        if binding.stale_reason(obj, glance=True):
            _drop(uid)
            return False
        key, pose = live_key(obj), binding.read_pose(obj, depsgraph)
        if job is None:
            return _start(obj, key, pose, depsgraph)
        if job.work.ended:
            del _jobs[uid]
            job.work.close(bpy.context)
            _take(obj, job, key, pose)
        elif job.key != key:
            _drop(uid)
        elif job.prepares:
            job.work.show(bpy.context)
    except TROUBLES as error:
        _troubles[uid] = told(error), None if job is None else job.pose
        return job is not None  # else wait for another pose, not to go wrong again at once
    return True


def _drop(uid):
    """End the thread of an object, if there is one."""
    job = _jobs.pop(uid, None)
    if job is not None:
        job.work.stop()
        job.work.close(bpy.context)


def _start(obj, key, pose, depsgraph):
    """Start a thread that settles an object, if it is time for that; say whether there is more to come."""
    if _is_settled(obj, pose):
        return False
    if binding.same_pose(_troubles.get(obj.session_uid, (None, None))[1], pose):
        return False  # it would go wrong again
    # A setting that is dragged must not start a thread for each value. Before the first factors waiting is of no use.
    prepares = not is_prepared(obj)
    if prepares and running() is not None:
        return True
    if perf_counter() >= _due or all(known[0] != key[0] for known in _lives):
        compute, pose = plan_settled(obj, depsgraph, waits=False)
        job = _jobs[obj.session_uid] = _Settling(Job("Bind", [], compute), key, pose, prepares)
        if prepares:  # takes long: it is shown as other work is, and Esc ends it
            with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
                job.work.open(bpy.context)
    return True


def _take(obj, job, key, pose):
    """Write what a thread has computed, unless it is past."""
    try:
        live, moved, settled = job.work.result()
    except Cancelled:
        if job.prepares and job.work.reason == STOPPED:  # by somebody, who does not want it to begin again by itself
            work = "Binding" if find(obj) is None else "The exact result"
            _troubles[obj.session_uid] = f"{work} was stopped. Press Update, or move a handle", pose
        return
    if job.key != key:
        return
    if not is_prepared(obj):  # a render may have been faster
        keep(obj, live)
    if binding.same_pose(job.pose, pose) and (settled or not _is_settled(obj, pose)):
        write(obj, live, moved, pose, settled)


def _is_settled(obj, pose):
    """Whether what an object shows is exact for a pose."""
    written, settled = binding.written_pose(obj)
    return settled and binding.same_pose(written, pose)


def _is_playing():
    """Whether frames run by in a window, so that there is no time to settle each."""
    windows = bpy.context.window_manager.windows
    return any(window.screen.is_animation_playing or window.screen.is_scrubbing for window in windows)


@persistent
def _on_depsgraph_update(scene, depsgraph):
    if any(change.is_updated_transform or change.is_updated_geometry for change in depsgraph.updates):
        update_all(scene, depsgraph, quick=not bpy.app.background)


@persistent
def _on_frame_change(scene, depsgraph):
    rendering = bpy.app.background or depsgraph.mode == "RENDER"
    update_all(scene, depsgraph, quick=not rendering and _is_playing(), waits=rendering)


@persistent
def _on_undo(scene, *_):
    binding.forget_bound()
    update_all(scene, bpy.context.evaluated_depsgraph_get(), quick=not bpy.app.background)


@persistent
def _on_render(scene, *_):
    """Settle what a still picture would show on its way; frames of an animation come with a change of the frame."""
    update_all(scene, None, quick=False)


@persistent
def _forget(*_):
    """Forget everything about a file when another one is opened."""
    for uid in [*_jobs]:
        _drop(uid)
    for known in (_lives, _troubles):
        known.clear()
    binding.forget_bound()


_HANDLERS = {
    "depsgraph_update_post": _on_depsgraph_update,
    "frame_change_post": _on_frame_change,
    "animation_playback_post": _on_frame_change,
    "undo_post": _on_undo,
    "redo_post": _on_undo,
    "render_init": _on_render,
    "load_pre": _forget,
    "deform_changed": _on_settings,
    "bound_changed": binding.forget_bound,
}


def attach():
    """Begin to follow the handles."""
    add_handlers(_HANDLERS)


def detach():
    """Follow no more: leave no handler, no timer and no thread behind, and give the memory back."""
    remove_handlers(_HANDLERS)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    _forget()
