"""Background jobs: a thread or steps on the main thread, the objects that they are for, and how they end."""

from concurrent.futures import Future
from threading import Event, Thread
from time import perf_counter

import bpy
from bpy.app.handlers import persistent

from ...command.stages import StageTimes
from ...core import Cancelled, PointCloudError
from ..objects.handlers import add_handlers, notify, remove_handlers
from ..objects.options import point_budget, settings_values
from ..objects.reading import find_object, fingerprint, metric, obstacle, read_points
from ..objects.result import same_lengths
from ..registration import Registration, Row
from .ready import ReadyOperator, reporting
from .stages import Stages

STOPPED = "Stopped: nothing was changed"  # by the user
_FIRST = 0.01  # seconds to the first timer event, after the first redraw
_TICK = 0.1  # seconds between timer events
_PATIENCE = 1.0  # seconds that Blender waits for the thread when it quits
_FORESEEN = 2.0, 0.03  # seconds, and share of the work, after which the time left is told
_jobs = []  # the one that runs


def running():
    """Return the job that runs, or None."""
    return _jobs[0] if _jobs else None


def busy() -> str:
    """Return a text that a job runs, and what to do; empty if none does."""
    job = running()
    if job is None:
        return ""
    return f"{job.label} is running. Wait for it, or press Esc to stop it"


def left_text(spent: float, fraction: float) -> str:
    """Return how long a job will take that has taken some seconds for a share of its work; empty at its begin."""
    if spent < _FORESEEN[0] or fraction < _FORESEEN[1]:
        return ""
    seconds = spent * (1.0 - fraction) / fraction
    if seconds < 10.0:
        return "some seconds left"
    return f"{round(seconds, -1):.0f} s left" if seconds < 95.0 else f"{seconds / 60.0:.0f} min left"


class Snapshot:
    """The state of an object when its points were read, without a reference to it, which undo would invalidate."""

    def __init__(self, context, obj):
        self.uid, self.name = obj.session_uid, obj.name
        self._state, self._metric = _state(context, obj), metric(obj)

    def find(self):
        """Return the object, or None if it or its scene was removed."""
        obj = find_object(self.uid)
        return obj if obj is not None and obj.users_scene else None

    def find_same(self, context, modes):
        """Return the object.

        If it was removed or changed, or cannot be written to in its present mode, `PointCloudError` is raised.
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
    """Return what results depend on, beside the object's scale."""
    seen = hash(read_points(context, obj).points.tobytes()) if obj.meshfree.use_modifiers else None
    return fingerprint(obj), repr(settings_values(obj.meshfree)), point_budget(obj.meshfree), seen


class Job(StageTimes):
    """A computation in a thread of its own, which keeps the window responsive and can be cancelled.

    The label says for display what is computed. `compute` is called with the job as progress callback, and must not
    access Blender. It starts at once, or in `go_on`. The reason is why it was stopped; empty if it was not.
    """

    def __init__(self, label, snapshots, compute, at_once=True):
        super().__init__()
        self.label, self.snapshots = label, snapshots
        self.stage, self.reason, self._stop = "Start", "", Event()
        self._timer, self._shown, self._begun, self._since = None, "", at_once, perf_counter()
        self._future = Future()
        self._prepare(compute, at_once)

    def _prepare(self, compute, at_once):
        # Not of a pool: Blender must not wait for it when it quits.
        self._thread = Thread(target=self._run, args=(compute,), name=self.label, daemon=True)
        if at_once:
            self._thread.start()

    def __call__(self, stage, fraction):
        if self._stop.is_set():
            raise Cancelled
        super().__call__(stage, fraction)

    @property
    def progress(self):
        """How much is done, and how long the rest will take, as a text."""
        left = left_text(perf_counter() - self._since, self.fraction)
        return f"{self.fraction:.0%}{', ' if left else ''}{left}"

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
        """Start the thread, if it has not started: after the first redraw, which it would slow down."""
        if self._thread.ident is None:
            self._thread.start()
            context.window_manager.event_timer_remove(self._timer)
            self._timer = context.window_manager.event_timer_add(_TICK, window=context.window)

    def stop(self, reason=STOPPED):
        """Stop the job; the thread ends at its next report of progress, and its result is dropped."""
        self.reason = self.reason or reason
        self._stop.set()

    def result(self):
        """Return the result, or raise its error; `Cancelled`, with the reason, if it was stopped."""
        if self.reason:
            raise Cancelled(self.reason)
        return self._future.result()

    def wait(self, seconds):
        """Wait for the thread to end, some seconds at most."""
        if self._thread.ident is not None:
            self._thread.join(seconds)

    def show(self, context):
        """Show the progress in the status bars of all windows."""
        windows = context.window_manager.windows
        text = f"{self.label}: {self.stage}, {self.progress}    Esc to stop"
        if text != self._shown:
            self._shown = text
            _set_status([window.workspace for window in windows], text)
            notify("panels_changed")

    def open(self, context):
        """Show the job; one that has not started gets a timer in the window of the context."""
        _jobs.append(self)
        if not self._begun:
            self._timer = context.window_manager.event_timer_add(_FIRST, window=context.window)
        self.show(context)

    def close(self, context):
        """Remove the job from all windows; may be called again."""
        if self not in _jobs:
            return
        _jobs.remove(self)
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
        if not bpy.app.background:
            # Later: the context of a window that is being closed must not change.
            bpy.app.timers.register(_clear_status, persistent=True)
        notify("panels_changed")


class SteppedJob(Job):
    """A computation that accesses Blender, done in steps on the main thread, one at each timer event.

    `compute` is a generator function that returns the result; see `all_steps`.
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
        """Do nothing: no further step is taken."""

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
        with bpy.context.temp_override(workspace=workspace):  # status_text_set needs it in the context
            workspace.status_text_set(text)


class JobOperator(ReadyOperator):
    """An operator whose work runs in the background if it was started in a window.

    *Stop* (Esc), undo, redo, deleting one of its objects and opening another file cancel it. It handles no keys itself,
    since other modal operators, such as a drag, may need them.
    """

    _job = None
    _attended = False  # started in a window

    @classmethod
    def poll(cls, context):
        if busy():
            cls.poll_message_set(busy())
            return False
        return super().poll(context)

    def takes_window(self):
        """Whether to run in the background: once for each start in a window."""
        attended, self._attended = self._attended, False  # Adjust Last Operation executes again, and blocks
        return attended and not bpy.app.background

    def work(self, context, objects, compute):
        """Compute for objects in the background, or at once for scripts; `finish` gets the results."""
        if self.takes_window():
            return self.start(context, objects, compute)
        with Stages(context.window_manager, self.bl_label) as stages:
            results = compute(stages)
        return self.finish(context, objects, results)

    def start(self, context, objects, compute, kind=Job):
        """Start a job for objects."""
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
        """Stop the job, if there is one, when its dialog or window is closed."""
        job = self._job
        if job is not None and job is running():
            job.stop()
            job.close(context)
            self.leave(context)

    def leave(self, context):
        """Restore what the work itself has changed in Blender."""

    @reporting
    def complete(self, context, job):
        """Find the objects again, and call `finish` with the results if they are unchanged."""
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
    """Stop jobs when undo or another file invalidates their objects."""
    add_handlers(_HANDLERS)


def detach():
    """Stop the job, and remove the handlers."""
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
