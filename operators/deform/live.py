"""Bound objects follow their handles or bones: their solvers in memory, and the handlers that update them.

A quick update, for dragging and playback, takes one step from the last result with the coarse solver. A settled one is
exact: it takes all steps on all points from rest, so that it depends on the pose only; its factors are made when first
needed. Rendered frames and single frame changes are settled, as are dragged handles once they rest. In a window, long
work runs in a thread; without one, everything is settled at once.
"""

import threading
from collections import defaultdict
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ...core import Cancelled
from ..objects.carried import discs_at_rest
from ..objects.handlers import add_handlers, notify, remove_handlers
from ..running.job import STOPPED, Job, running
from ..running.ready import TROUBLES, error_text
from .binding import bound_objects, forget_bound, is_bound, stale_reason
from .kinds import kind_of
from .nodes import is_baked
from .pose import Pose, State, shown_state, write_displacement

_IDLE = 0.3  # seconds without a move after which the result is settled
_TICK = 0.05  # seconds between two checks of a thread


@dataclass
class _Thread:
    """A thread that settles an object, for the timer to look at."""

    work: Job
    pose: Pose  # the pose that it works for
    prepares: bool  # whether it may make factors first


@dataclass
class _Followed:
    """What is kept in memory of a bound object."""

    thread: _Thread | None = None
    due: float = 0.0  # when to settle what was updated quickly
    trouble: str = ""  # the error of the last update; empty without one
    troubled: np.ndarray | None = None  # the numbers of the pose that caused it


class _UpdateLock:
    """A lock that lets one thread at a time update, since renders have a thread of their own."""

    def __init__(self):
        self._lock, self._owner = threading.Lock(), None

    @contextmanager
    def held(self):
        """Hold the lock; yield False if this thread holds it already, since updates trigger handlers."""
        if self._owner == threading.get_ident():
            yield False
            return
        with self._lock:
            self._owner = threading.get_ident()
            try:
                yield True
            finally:
                self._owner = None


_followers = {}  # by `Kind.key`
_followed = defaultdict(_Followed)  # by the object's session_uid, which undo does not change
_lock = _UpdateLock()


def state(obj) -> tuple:
    """Return the state of a bound object, by a glance, and a text about it."""
    reason = stale_reason(obj, glance=True)
    if reason:
        return State.BAKED if is_baked(obj) else State.STALE, reason
    followed = _followed[obj.session_uid]
    if followed.trouble:
        return State.STALE, followed.trouble
    if followed.thread is None or not followed.thread.prepares:
        return State.SETTLED, ""
    work, known = followed.thread.work, find(obj)
    return State.PREPARING if known is None else State.QUICK, f"{work.stage}, {work.fraction:.0%}"


def find(obj):
    """Return the follower of a bound object, such as a `Follower`, or None."""
    return _followers.get(kind_of(obj).key(obj))


def is_prepared(follower) -> bool:
    """Whether a follower, or None, can give settled results at once."""
    return follower is not None and follower.is_prepared


def keep(obj, follower):
    """Keep the follower of an object, and drop unused ones."""
    used = {kind_of(other).key(other) for other in bound_objects()}
    for key in _followers.keys() - used:
        del _followers[key]
    _followers[kind_of(obj).key(obj)] = follower


def plan_follower(obj):
    """Read a bound object; return a function of a progress callback that returns its follower, kept or new."""
    known = find(obj)
    return kind_of(obj).plan_follower(obj) if known is None else lambda progress: known


def plan_settled(obj, pose, waits=True):
    """Read a bound object; return a function of a progress callback that returns its follower and the deformation.

    Unless it `waits`, a new follower gives a quick result first.
    """
    make, discs, at_once = plan_follower(obj), discs_at_rest(obj), waits or find(obj) is not None

    def compute(progress):
        follower = make(progress)
        state = State.SETTLED if at_once or is_prepared(follower) else State.QUICK
        return follower, follower.move(pose, discs, state, progress=progress)

    return compute


def write(obj, follower, moved, pose):
    """Write the deformation of an object, and keep it as the start of the next one."""
    follower.last[obj.session_uid] = moved.points
    write_displacement(obj, moved.displacement, pose.numbers, moved.state, moved.carried)
    _followed[obj.session_uid].trouble = ""


def update(obj, depsgraph=None, wanted=State.SETTLED):
    """Let a bound object follow, if what it follows has moved and the binding holds.

    That is read where a depsgraph has it, otherwise as the viewport shows it. The wanted state is SETTLED at any cost;
    PREPARING to leave missing factors to the timer; QUICK for one step only, with the rest left to the timer.
    """
    if stale_reason(obj, glance=wanted is not State.SETTLED, trusting=wanted is State.QUICK):
        return
    kind = kind_of(obj)
    pose = kind.read_pose(obj, depsgraph)
    shown, follower = shown_state(obj, pose), _followers.get(pose.key)
    if shown is State.SETTLED:
        _followed[obj.session_uid].trouble = ""  # of another pose
    elif wanted is State.SETTLED or (wanted is State.PREPARING and is_prepared(follower)):
        follower, moved = plan_settled(obj, pose)(lambda stage, fraction: None)
        keep(obj, follower)
        write(obj, follower, moved, pose)
    elif State.PREPARING in (shown, wanted):
        if follower is None and kind.at_once:
            follower = kind.plan_follower(obj)(lambda stage, fraction: None)
            keep(obj, follower)
        if follower is not None:
            start = follower.last.get(obj.session_uid)
            write(obj, follower, follower.move(pose, discs_at_rest(obj), State.QUICK, start), pose)
        settle_later(obj)


def update_all(scene, depsgraph, wanted):
    """Update all bound objects of a scene; errors are kept for the panel."""
    with _lock.held() as free:
        for obj in _editable(scene) if free else ():
            try:
                update(obj, depsgraph, wanted)
            except TROUBLES as error:
                _note(obj, error_text(error))


def _note(obj, trouble, pose=None):
    """Record an object's error, which the panel shows, and the pose that caused it: that pose is not tried again."""
    followed = _followed[obj.session_uid]
    followed.trouble, followed.troubled = trouble, None if pose is None else pose.numbers


def _editable(scene):
    return [obj for obj in bound_objects(scene) if obj.data.is_editable]


def _on_settings(obj):
    """Update an object after a change of its settings, in a window; scripts call Update themselves."""
    if is_bound(obj):
        settle_later(obj)


def settle_later(obj):
    """Settle an object when its handles have come to rest."""
    followed = _followed[obj.session_uid]
    followed.due = perf_counter() + _IDLE
    if followed.thread is not None and not followed.thread.prepares:
        followed.thread.work.stop()  # its pose is outdated
    if not bpy.app.background and not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=_TICK)


def _tick():
    """Write results of threads, and settle resting poses; a timer of the window."""
    if bpy.app.is_job_running("RENDER"):
        return _IDLE
    shown = {}  # each window has a scene of its own
    for window in bpy.context.window_manager.windows:
        with bpy.context.temp_override(window=window):
            depsgraph = bpy.context.evaluated_depsgraph_get()
        shown.update((obj.session_uid, (obj, depsgraph)) for obj in _editable(window.scene))
    for uid in _followed.keys() - shown.keys():
        _drop(_followed[uid])
    with _lock.held():
        waiting = [_attend(obj, depsgraph) for obj, depsgraph in shown.values()]
    if any(waiting):
        notify("panels_changed")
    return _TICK if any(waiting) else None


def _attend(obj, depsgraph) -> bool:
    """Write the result of an object's thread, or start one; return whether work is left."""
    followed = _followed[obj.session_uid]
    thread = followed.thread
    try:
        if stale_reason(obj, glance=True):
            _drop(followed)
            return False
        pose = kind_of(obj).read_pose(obj, depsgraph)
        if thread is None:
            return _start(obj, pose)
        if thread.work.ended:
            followed.thread = None
            thread.work.close(bpy.context)
            _take(obj, thread, pose)
        elif thread.pose.key != pose.key:
            _drop(followed)
        elif thread.prepares:
            thread.work.show(bpy.context)
    except TROUBLES as error:
        _note(obj, error_text(error), thread and thread.pose)
        return thread is not None  # else wait for another pose
    return True


def _drop(followed):
    """Stop the thread of an object, if there is one."""
    thread, followed.thread = followed.thread, None
    if thread is not None:
        thread.work.stop()
        thread.work.close(bpy.context)


def _start(obj, pose):
    """Start a thread that settles an object, if it is due; return whether work is left."""
    followed = _followed[obj.session_uid]
    if shown_state(obj, pose) is State.SETTLED or (followed.trouble and pose.is_same(followed.troubled)):
        return False  # the error would recur
    # A dragged setting must not start a thread for each value; the first factors need not wait.
    prepares = not is_prepared(find(obj))
    if prepares and running() is not None:
        return True
    if perf_counter() >= followed.due or all(known[0] != pose.key[0] for known in _followers):
        work = Job("Bind", [], plan_settled(obj, pose, waits=False))
        followed.thread = _Thread(work, pose, prepares)
        if prepares:  # takes long: shown like other jobs, with Esc to stop
            with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
                work.open(bpy.context)
    return True


def _take(obj, thread, pose):
    """Write the result of a thread, unless it is outdated."""
    try:
        follower, moved = thread.work.result()
    except Cancelled:
        if thread.prepares and thread.work.reason == STOPPED:  # by the user: do not start again
            work = "Binding" if find(obj) is None else "The exact result"
            _note(obj, f"{work} was stopped. Press Update, or move a handle", pose)
        return
    if thread.pose.key != pose.key:
        return
    if not is_prepared(find(obj)):  # a render may have been faster
        keep(obj, follower)
    shown = shown_state(obj, pose)
    if pose.is_same(thread.pose.numbers) and (moved.state is State.SETTLED or shown is not State.SETTLED):
        write(obj, follower, moved, pose)


def _is_playing():
    """Whether an animation plays in a window, so that there is no time to settle each frame."""
    windows = bpy.context.window_manager.windows
    return any(window.screen.is_animation_playing or window.screen.is_scrubbing for window in windows)


def _soon():
    """Return the state to update to while handles may be dragged, which needs a window."""
    return State.SETTLED if bpy.app.background else State.QUICK


@persistent
def _on_depsgraph_update(scene, depsgraph):
    if any(change.is_updated_transform or change.is_updated_geometry for change in depsgraph.updates):
        update_all(scene, depsgraph, _soon())


@persistent
def _on_frame_change(scene, depsgraph):
    if bpy.app.background or depsgraph.mode == "RENDER":
        wanted = State.SETTLED
    else:
        wanted = State.QUICK if _is_playing() else State.PREPARING
    update_all(scene, depsgraph, wanted)


@persistent
def _on_undo(scene, *_):
    forget_bound()
    if _editable(scene):  # else leave evaluating to Blender, after its step
        update_all(scene, bpy.context.evaluated_depsgraph_get(), _soon())


@persistent
def _on_render(scene, *_):
    """Settle the frame of a still; frames of an animation come with a frame change."""
    update_all(scene, None, State.SETTLED)


@persistent
def _forget(*_):
    """Clear everything about a file when another one is opened."""
    for followed in [*_followed.values()]:
        _drop(followed)
    for known in (_followers, _followed):
        known.clear()
    forget_bound()


_HANDLERS = {
    "depsgraph_update_post": _on_depsgraph_update,
    "frame_change_post": _on_frame_change,
    "animation_playback_post": _on_frame_change,
    "undo_post": _on_undo,
    "redo_post": _on_undo,
    "render_init": _on_render,
    "load_pre": _forget,
    "deform_changed": _on_settings,
    "bound_changed": forget_bound,
}


def attach():
    """Add the handlers."""
    add_handlers(_HANDLERS)


def detach():
    """Remove handlers, timer and threads, and free the memory."""
    remove_handlers(_HANDLERS)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    _forget()
