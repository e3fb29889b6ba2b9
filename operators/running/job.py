"""Long work beside the window: a thread or steps, the objects it is for, and all that ends it."""

from concurrent.futures import Future
from threading import Event, Thread

import bpy
from bpy.app.handlers import persistent

from ...core import Cancelled, PointCloudError
from ..objects.handlers import add_handlers, notify, remove_handlers
from ..objects.options import point_budget, settings_values
from ..objects.reading import find_object, fingerprint, metric, obstacle, read_points
from ..objects.result import same_lengths
from ..registration import Registration, Row
from .ready import ReadyOperator, reporting
from .stages import Stages, StageTimes

STOPPED = "Stopped: nothing was changed"  # by somebody
_FIRST = 0.01  # seconds to the first look, which comes after the first drawing
_TICK = 0.1  # seconds between two looks at the work
_PATIENCE = 1.0  # seconds that Blender waits at its end for the thread to stop by itself
_jobs = []  # the one that runs


def running():
    """Return the job that runs, or None."""
    return _jobs[0] if _jobs else None


def busy() -> str:
    """Say that a job runs, and what to do; empty if none does."""
    job = running()
    if job is None:
        return ""
    return f"{job.label} is running. Wait for it, or press Esc to stop it"


class Snapshot:
    """What an object was like when its points were read, without a reference to it, which undo would make invalid."""

    def __init__(self, context, obj):
        self.uid, self.name = obj.session_uid, obj.name
        self._state, self._metric = _state(context, obj), metric(obj)

    def find(self):
        """Return the object, or None if it is gone, be it with its scene."""
        obj = find_object(self.uid)
        return obj if obj is not None and obj.users_scene else None

    def find_same(self, context, modes):
        """Return the object.

        Raises
        ------
        PointCloudError
            It is gone, was changed since, or cannot be written to in its mode now.
        """
        obj = self.find()
        if obj is None:
            raise PointCloudError(f'"{self.name}" was deleted meanwhile')
        reason = obstacle(obj, modes)
        if reason:
            raise PointCloudError(reason)
        if _state(context, obj) != self._state or not same_lengths(self._metric, metric(obj)):
            raise PointCloudError(f'points, scale or settings of "{obj.name}" were changed meanwhile. Start it again')
        return obj


def _state(context, obj):
    """What of an object decides about results, beside its scale."""
    seen = hash(read_points(context, obj).points.tobytes()) if obj.meshfree.use_modifiers else None
    return fingerprint(obj), repr(settings_values(obj.meshfree)), point_budget(obj.meshfree), seen


class Job(StageTimes):
    """A computation in a thread of its own, so that the window stays alive and everything may end it.

    Parameters
    ----------
    label : str
        What is computed, for people.
    snapshots : list of Snapshot
        The objects that it is for.
    compute : callable
        Called with this as its progress callback; must not touch Blender.
    at_once : bool
        Whether it begins now, and not with `go_on`.

    Attributes
    ----------
    reason : str or ""
        Why it was stopped; empty while nobody did.
    """

    def __init__(self, label, snapshots, compute, at_once=True):
        super().__init__()
        self.label, self.snapshots = label, snapshots
        self.stage, self.reason, self._stop = "Start", "", Event()
        self._timer, self._shown, self._begun = None, "", at_once
        self._future = Future()
        self._prepare(compute, at_once)

    def _prepare(self, compute, at_once):
        # Not of a pool: Blender must not wait for it at its end.
        self._thread = Thread(target=self._run, args=(compute,), name=self.label, daemon=True)
        if at_once:
            self._thread.start()

    def __call__(self, stage, fraction):
        if self._stop.is_set():
            raise Cancelled
        super().__call__(stage, fraction)

    def _run(self, compute):
        try:
            with self:
                result = compute(self)
        except BaseException as error:  # goes to whoever asks for the result
            self._future.set_exception(error)
        else:
            self._future.set_result(result)

    @property
    def ended(self):
        """Whether there is a result or an error, or it was stopped."""
        return bool(self.reason) or self._future.done()

    def go_on(self, context):
        """Let the work begin, if it has not yet: once Blender has drawn that it does, from which it would take time."""
        if self._thread.ident is None:
            self._thread.start()
            context.window_manager.event_timer_remove(self._timer)
            self._timer = context.window_manager.event_timer_add(_TICK, window=context.window)

    def stop(self, reason=STOPPED):
        """End it for everybody; the thread itself ends at its next report of progress, and its result is dropped."""
        self.reason = self.reason or reason
        self._stop.set()

    def result(self):
        """Return what was computed, or raise what went wrong; `Cancelled`, with the reason, if it was stopped."""
        if self.reason:
            raise Cancelled(self.reason)
        return self._future.result()

    def wait(self, seconds):
        """Wait for the thread to end, some seconds at most."""
        if self._thread.ident is not None:
            self._thread.join(seconds)

    def show(self, context):
        """Tell in all windows how far it is."""
        windows = context.window_manager.windows
        text = f"{self.label}: {self.stage}, {self.fraction:.0%}    Esc to stop"
        if text != self._shown:
            self._shown = text
            _set_status([window.workspace for window in windows], text)
            notify("panels_changed")

    def open(self, context):
        """Begin to show it; one that has not begun is looked at again and again in the window that it belongs to."""
        _jobs.append(self)
        if not self._begun:
            self._timer = context.window_manager.event_timer_add(_FIRST, window=context.window)
        self.show(context)

    def close(self, context):
        """Leave nothing of it in any window; may be called again."""
        if self not in _jobs:
            return
        _jobs.remove(self)
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
        if not bpy.app.background:
            # Later: a window that is being closed must not find another context than it had.
            bpy.app.timers.register(_clear_status, persistent=True)
        notify("panels_changed")


class SteppedJob(Job):
    """A computation that needs Blender itself, so that it is done in steps on its main thread, one at each look.

    `compute` is a generator function, whose result is what it returns; see `all_steps`.
    """

    def _prepare(self, compute, at_once):
        self._steps = compute(self)

    def go_on(self, context):
        """Take a step."""
        try:
            next(self._steps)
        except StopIteration as end:
            self._future.set_result(end.value)
        except BaseException as error:  # goes to whoever asks for the result
            self._future.set_exception(error)

    def wait(self, seconds):
        """Wait for nothing: no step is taken any more."""

    def close(self, context):
        super().close(context)
        self._steps.close()


def all_steps(steps):
    """Take all steps of a generator at once, and return its result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def _clear_status():
    if running() is None:
        _set_status(bpy.data.workspaces, None)  # others may be open now than when it was shown


def _set_status(workspaces, text):
    """Set the text in the status bar of workspaces, or clear it by None."""
    for workspace in workspaces:
        with bpy.context.temp_override(workspace=workspace):  # which is the one that Blender writes to
            workspace.status_text_set(text)


class JobOperator(ReadyOperator):
    """An operator whose work runs beside the window when somebody there has started it.

    The work ends early by *Stop*, which is Esc, by undo and redo, when an object of it is deleted, and when another
    file is opened. It takes no keys itself, which what runs beside it, such as a drag, may need.
    """

    _job = None
    _attended = False  # somebody at the window waits for it

    @classmethod
    def poll(cls, context):
        if busy():
            cls.poll_message_set(busy())
            return False
        return super().poll(context)

    def takes_window(self):
        """Tell whether to work beside the window, once for each time that somebody started it there."""
        attended, self._attended = self._attended, False  # Adjust Last Operation comes again, and waits
        return attended and not bpy.app.background

    def work(self, context, objects, compute):
        """Compute for some objects beside the window, or at once for scripts, and let `finish` use the results."""
        if self.takes_window():
            return self.start(context, objects, compute)
        with Stages(context.window_manager, self.bl_label) as stages:
            results = compute(stages)
        return self.finish(context, objects, results)

    def start(self, context, objects, compute, kind=Job):
        """Begin to work for some objects."""
        if busy():  # since a file browser opened
            raise PointCloudError(f"{busy()}.")
        self._job = kind(self.bl_label, [Snapshot(context, obj) for obj in objects], compute, at_once=False)
        self._job.open(context)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        job = self._job
        for snapshot in job.snapshots:
            if snapshot.find() is None:
                job.stop(f'Stopped because "{snapshot.name}" was deleted: nothing was changed')
        if job.ended:
            job.close(context)
            self.leave(context)
            return self.complete(context, job)
        job.go_on(context)
        job.show(context)
        return {"PASS_THROUGH"}

    def cancel(self, context):
        """End the work, if it has begun, with its dialog or the window that shows it."""
        job = self._job
        if job is not None and job is running():
            job.stop()
            job.close(context)
            self.leave(context)

    def leave(self, context):
        """Put back what the work itself has changed in Blender: nothing."""

    @reporting
    def complete(self, context, job):
        """Find the objects again, and let `finish` use what was computed for them, if they are as they were."""
        try:
            results = job.result()
        except Cancelled:
            self.report({"INFO"}, job.reason)
            return {"CANCELLED"}
        try:
            objects = [snapshot.find_same(context, self.works_in) for snapshot in job.snapshots]
        except PointCloudError as change:
            there = [snapshot.find() for snapshot in job.snapshots]
            self.warn(f"{job.label} wrote nothing: {change}", *filter(None, there))
            return {"CANCELLED"}
        return self.finish(context, objects, results)


class MESHFREE_OT_stop(bpy.types.Operator):
    """Stop the computation that is running; nothing is changed"""

    bl_idname = "meshfree.stop"
    bl_label = "Stop"

    @classmethod
    def poll(cls, context):
        if running() is None:
            cls.poll_message_set("Nothing is running")
        return running() is not None

    def execute(self, context):
        running().stop()
        return {"FINISHED"}


def attach():
    """End the work when its objects become others, by undo or another file."""
    add_handlers(_HANDLERS)


def detach():
    """End the work, and leave no handler behind."""
    remove_handlers(_HANDLERS)
    job = running()
    if job is not None:
        _abandon()
        job.wait(_PATIENCE)


@persistent
def _undone(*_):
    job = running()
    if job is not None:
        job.stop("Stopped by undo: nothing was changed")


@persistent
def _abandon(*_):
    job = running()
    if job is not None:
        job.stop()
        job.close(bpy.context)


_HANDLERS = {"undo_post": _undone, "redo_post": _undone, "load_pre": _abandon}
TOOLS = (Registration(MESHFREE_OT_stop, menu=Row("Object", 12, 2)),)
