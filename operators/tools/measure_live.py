"""Measures that follow the selection in Edit Mode, in the panel: nothing is written to the object.

A change of the selection is read from Blender's edit mesh, and measured in a thread when it has rested for a moment.
The volume of a closed surface, which does not depend on it, is measured once, after the first selection. Positions are
read only where Blender tells that they may have changed.
"""

import zlib
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from time import perf_counter

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ... import core
from ...core import Cancelled, PointCloudError
from ..objects.attributes import positions_now
from ..objects.handlers import add_handlers, notify, remove_handlers
from ..objects.options import settings_values
from ..objects.reading import find_object, metric
from ..objects.result import same_lengths
from ..registration import Registration, Row
from ..running.job import Job
from ..running.ready import TROUBLES, error_text
from .measuring import Figure, left_out, measured, volume_base
from .select import SelectionOperator, analyzed, selected_now

_REST = 0.2  # seconds without a change after which the selection is measured
_TICK = 0.05  # seconds between two looks at the thread
_CHANGED = "The points, their scale or the settings were changed. Turn Measure Live off and on to analyze them again"
_NOTHING = "No points are selected"


@dataclass
class _Followed:
    """The object whose selection is measured, without a reference to it, which undo would invalidate."""

    uid: int  # of the object
    laplacian: "core.LaplaceBeltrami"
    state: tuple  # what the Laplacian depends on: number and checksum of points, scale, settings
    seen: tuple | None = None  # the selection and the plane that the figures are of, or will be
    # The thread that measures them, or the volume of the surface; its result is what to do with that
    work: Job | None = None
    due: float = 0.0  # when to look at the selection; infinite if nothing has changed
    moved: bool = True  # whether points may have been moved since they were looked at
    figures: list = field(default_factory=list)  # of Figure
    notices: list = field(default_factory=list)  # of str
    whole: tuple | None = None  # of the surface as a whole: empty if it is open, None until it is measured


_followed = []  # at most one
_reading = []  # not empty while positions are read, which Blender takes for a change


def followed(obj):
    """Return what is known of the selection of an object that is followed: figures and notices; or None."""
    return _followed[0] if _followed and obj is not None and _followed[0].uid == obj.session_uid else None


class MESHFREE_OT_measure_live(SelectionOperator, bpy.types.Operator):
    """Measure the selected points again whenever the selection has changed, until Edit Mode is left"""

    bl_idname = "meshfree.measure_live"
    bl_label = "Measure Live"
    bl_options = {"REGISTER"}  # the scene is not changed
    needs_selection = False
    _laplacian = None

    @classmethod
    def lack(cls, context, obj):
        elsewhere = f'"{obj.name}" is not in Edit Mode. Switch to Edit Mode first, where points are selected'
        return "" if obj.mode == "EDIT" else elsewhere

    def invoke(self, context, event):
        return self.execute(context) if followed(context.object) else super().invoke(context, event)

    def execute(self, context):
        if followed(context.object):
            stop()
            return {"FINISHED"}
        return self.follow(context.object, super().execute(context))

    def complete(self, context, job):
        done = super().complete(context, job)
        return self.follow(job.snapshots[0].find(), done)

    def with_points(self, objects):
        return objects[:1]

    def prepare(self, context, obj):
        _, self._laplacian = analyzed(context, obj)
        return lambda: "the measures follow the selection"

    def follow(self, obj, done):
        """Begin to follow an object, back in Edit Mode: with shape keys it has other positions there."""
        if done == {"FINISHED"}:
            stop()
            whole = ([], []) if self._laplacian.boundary.any() else None
            _followed.append(_Followed(obj.session_uid, self._laplacian, _state(obj), whole=whole))
            _soon()
        return done


def stop():
    """Follow no selection any more, and forget the figures."""
    for known in _followed:
        _halt(known)
    _followed.clear()
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    notify("panels_changed")


def _state(obj):
    """Return what the Laplacian of an object depends on."""
    with _quietly():
        positions = positions_now(obj)
    return len(positions), zlib.crc32(positions), *_settings(obj)


def _settings(obj):
    return metric(obj), repr(settings_values(obj.meshfree))


@contextmanager
def _quietly():
    """Let no handler of this module hear what is done, not even when the window is drawn next."""
    _reading.append(True)
    try:
        yield
        if not bpy.app.background:
            with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
                bpy.context.view_layer.update()
    finally:
        _reading.pop()


def _soon(moved=True):
    """Look at the selection when it has rested; without a window, at once."""
    known = _followed[0]
    known.moved |= moved
    known.due = 0.0 if bpy.app.background else perf_counter() + _REST
    if not bpy.app.background:
        if not bpy.app.timers.is_registered(_tick):
            bpy.app.timers.register(_tick, first_interval=_REST)
        return
    while _tick() is not None:
        known.work.wait(None)


def _tick():
    """Look at the selection or at the thread; a timer of the window."""
    known = _followed[0] if _followed else None
    obj = find_object(known.uid) if known is not None else None
    if obj is None or obj.mode != "EDIT":
        stop()
        return None
    if known.work is not None and known.work.ended:
        _take(known)
    if perf_counter() >= known.due:
        if _is_moving():
            return _REST
        known.due = np.inf
        _look(known, obj)
    return _TICK if known.work is not None or known.due < np.inf else None


def _is_moving():
    """Whether points are being moved in a window, so that they will change again."""
    windows = bpy.context.window_manager.windows
    names = [item.bl_idname for window in windows for item in getattr(window, "modal_operators", ())]
    return any(name.startswith("TRANSFORM_OT") for name in names)


def _look(known, obj):
    """Begin to measure the selection of an object, unless the figures are of it."""
    try:
        _check_unchanged(known, obj)
        chosen, kept = selected_now(obj), obj.meshfree
        with _quietly() if kept.volume_over == "POINTS" else nullcontext():  # which reads another object
            base = volume_base(bpy.context, obj)
        seen = zlib.crc32(chosen), kept.volume_over, kept.volume_plane, repr(base and base._replace(ground=None))
        if seen == known.seen:
            return
        if not chosen.any():
            raise PointCloudError(_NOTHING)
    except TROUBLES as error:
        _halt(known)
        _show(known, [], [error_text(error)])
        return
    laplacian, notices = known.laplacian, left_out(known.laplacian, chosen)

    def compute(progress):
        found = measured(laplacian, chosen, base, progress)
        return lambda: _show(known, found.figures, [*notices, *found.notices])

    _halt(known)
    known.seen, known.work = seen, Job("Measure Live", [], compute)


def _enclose(known):
    """Begin to measure the volume of a closed surface."""
    laplacian = known.laplacian

    def compute(progress):
        try:
            found = core.measure.enclosed_volume(laplacian, progress=progress)
        except PointCloudError as error:
            text = f"The volume of the surface was not measured: {error}"
            return lambda: _enclosed(known, [], [text])
        return lambda: _enclosed(known, [Figure("Volume", (found.volume,), found.uncertainty, 3)], found.notices)

    known.work = Job("Measure Live", [], compute)


def _check_unchanged(known, obj):
    """Refuse an object that the Laplacian is no longer of."""
    count, checksum, *settings = known.state
    if known.moved:
        count, checksum, *settings = _state(obj)
        known.moved = False
    else:
        settings = _settings(obj)
    if (count, checksum, settings[1]) != (*known.state[:2], known.state[3]) or not same_lengths(
        settings[0], known.state[2]
    ):
        known.moved = True  # until it is as it was
        raise PointCloudError(_CHANGED)


def _halt(known):
    """Stop the thread, if there is one, and forget what the figures are of."""
    if known.work is not None:
        known.work.stop()
    known.work = known.seen = None


def _take(known):
    """Show the result of the thread, and measure the surface as a whole if that is left."""
    work, known.work = known.work, None
    try:
        work.result()()
    except Cancelled:
        return
    except TROUBLES as error:
        _show(known, [], [error_text(error)])
    if known.figures and known.whole is None:
        _enclose(known)


def _enclosed(known, figures, notices):
    """Show the volume of the surface beside the figures of the selection, from now on."""
    known.whole = figures, notices
    _show(known, known.figures, known.notices)


def _show(known, figures, notices):
    """Show figures of the selection, and where there are some those of the whole surface."""
    whole = known.whole if figures and known.whole is not None else ([], [])
    known.figures, known.notices = [*figures, *whole[0]], [*notices, *whole[1]]
    notify("panels_changed")


def _again():
    """Measure over another plane."""
    if _followed:
        _soon(moved=False)


@persistent
def _on_update(scene, depsgraph):
    if not _followed or _reading:
        return
    uid = _followed[0].uid
    changes = [change for change in depsgraph.updates if change.id.original.session_uid == uid]
    _soon(moved=any(change.is_updated_geometry or change.is_updated_transform for change in changes))


@persistent
def _on_undo(*_):
    if _followed:
        _soon()


@persistent
def _forget(*_):
    stop()


_HANDLERS = {
    "depsgraph_update_post": _on_update,
    "undo_post": _on_undo,
    "redo_post": _on_undo,
    "load_pre": _forget,
    "measuring_changed": _again,
}


def attach():
    """Add the handlers."""
    add_handlers(_HANDLERS)


def detach():
    """Remove handlers, timer and thread."""
    remove_handlers(_HANDLERS)
    stop()


TOOLS = (Registration(MESHFREE_OT_measure_live, menu=Row("Points", 2, 4)),)
