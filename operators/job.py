"""Long work beside the window: a thread, the objects it is for, and all that ends it."""

from concurrent.futures import Future
from threading import Event, Thread

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ..core import Cancelled, PointCloudError
from .options import settings_values
from .reading import find_object, fingerprint, metric, obstacle, read_points
from .ready import ReadyOperator
from .result import same_lengths
from .stages import StageTimes, redraw_panels

_FIRST = 0.01  # seconds to the first look, which comes after the first drawing
_TICK = 0.1  # seconds between two looks at the work
_PATIENCE = 1.0  # seconds that Blender waits at its end for the thread to stop by itself
_jobs = []  # the one that runs


def running():
    """Return the job that runs, or None."""
    return _jobs[0] if _jobs else None


class Snapshot:
    """What an object was like when its points were read, without a reference to it, which undo would make invalid."""

    def __init__(self, context, obj):
        self.uid, self.name = obj.session_uid, obj.name
        self._state, self._metric = _state(context, obj), metric(obj)

    def find(self):
        """Return the object, or None if it is gone."""
        return find_object(self.uid)

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
    return fingerprint(obj), repr(settings_values(obj.meshfree)), seen


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
        Whether it begins now, and not with `begin`.

    Attributes
    ----------
    reason : str
        Why it was stopped; empty while nobody did.
    """

    def __init__(self, label, snapshots, compute, at_once=True):
        super().__init__()
        self.label, self.snapshots = label, snapshots
        self.stage, self.reason, self._stop = "Start", "", Event()
        self._timer, self._shown = None, ""
        self._future = Future()
        # Not of a pool: Blender must not wait for it at its end.
        self._thread = Thread(target=self._run, args=(compute,), name=label, daemon=True)
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

    def stop(self, reason="Stopped: nothing was changed"):
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
        """Tell in the status bar how far it is, and let the panel do so too."""
        text = iface_("{}: {}, {:.0%}    Esc to stop").format(iface_(self.label), iface_(self.stage), self.fraction)
        if text != self._shown:
            self._shown = text
            context.workspace.status_text_set(text)
            redraw_panels(context.window_manager)

    def open(self, context):
        """Begin to show it in the window and to look at it there again and again."""
        _jobs.append(self)
        self._timer = context.window_manager.event_timer_add(_FIRST, window=context.window)
        self.show(context)

    def begin(self, context):
        """Let the work begin, if it has not yet: once Blender has drawn that it does, from which it would take time."""
        if self._thread.ident is not None:
            return
        self._thread.start()
        context.window_manager.event_timer_remove(self._timer)
        self._timer = context.window_manager.event_timer_add(_TICK, window=context.window)

    def close(self, context):
        """Leave nothing of it in the window; may be called again."""
        if self not in _jobs:
            return
        _jobs.remove(self)
        context.window_manager.event_timer_remove(self._timer)
        for workspace in bpy.data.workspaces:  # another one may be open now than when it was shown
            workspace.status_text_set(None)
        redraw_panels(context.window_manager)


def _busy():
    return f"{running().label} is running. Wait for it, or press Esc to stop it"


class JobOperator(ReadyOperator):
    """An operator whose work runs beside the window when somebody there has started it.

    The work ends early by Esc, by undo and redo, when an object of it is deleted, and when another file is opened. All
    other keys go to Blender.
    """

    _job = None

    @classmethod
    def poll(cls, context):
        if running() is not None:
            cls.poll_message_set(_busy())
            return False
        return super().poll(context)

    def start(self, context, objects, compute):
        """Begin to work for some objects."""
        if running() is not None:  # since a file browser opened
            raise PointCloudError(f"{_busy()}.")
        self._job = Job(self.bl_label, [Snapshot(context, obj) for obj in objects], compute, at_once=False)
        self._job.open(context)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        job = self._job
        if event.type == "ESC" and event.value == "PRESS":
            job.stop()
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        for snapshot in job.snapshots:
            if snapshot.find() is None:
                job.stop(f'Stopped because "{snapshot.name}" was deleted: nothing was changed')
        if job.ended:
            job.close(context)
            return self.complete(context, job)
        job.begin(context)
        job.show(context)
        return {"PASS_THROUGH"}

    def cancel(self, context):
        """End the work, if it has begun, with its dialog or the window that shows it."""
        if self._job is not None:
            self._job.stop()
            self._job.close(context)

    def complete(self, context, job):
        """Find the objects again, and let `finish` use what was computed for them, if they are as they were."""
        try:
            results = job.result()
        except Cancelled as stop:
            self.report({"INFO"}, str(stop))
            return {"CANCELLED"}
        except PointCloudError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        try:
            objects = [snapshot.find_same(context, self.works_in) for snapshot in job.snapshots]
        except PointCloudError as change:
            self.report({"WARNING"}, rpt_("{} wrote nothing: {}").format(iface_(job.label), change))
            return {"CANCELLED"}
        return self.finish(context, objects, results, job.seconds)


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
    for event, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, event).append(handler)


def detach():
    """End the work, and leave no handler behind."""
    for event, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, event).remove(handler)
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
CLASSES = (MESHFREE_OT_stop,)
