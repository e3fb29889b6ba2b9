"""What a window does not wait for: threads that compute for the display of objects, which then take what was found."""

from typing import NamedTuple

import bpy
from bpy.app.handlers import persistent

from ..objects.attributes import point_count
from ..objects.handlers import add_handlers, remove_handlers
from ..objects.reading import find_object
from .job import Job

_AT_ONCE = 20_000  # points that a window waits for
_TICK = 0.1  # seconds between two looks at threads


class _Work(NamedTuple):
    """What is wanted, the job that finds it, and the function that takes its result."""

    wanted: str
    job: Job
    take: object

    def end(self, obj):
        """Wait for the result and let it be taken, if the object is there."""
        self.job.wait(None)
        if obj is not None:
            self.take(obj, self.wanted, self.job)


_works = {}  # by what they are of, and the session_uid of their object


def later(kind: str, obj, wanted: str, compute, take):
    """Compute in a thread; then call `take` with the object, what was wanted and the job, which it asks for the result.

    `compute` is called with a progress callback. Scripts, renders and few points wait for it. Earlier work of this kind
    for the object goes on if the same is wanted, as while a setting is dragged, or is dropped; whether what was found
    still fits the object is for `take` to tell.
    """
    under_way = _works.get((kind, obj.session_uid))
    if under_way is not None and under_way.wanted == wanted:
        return
    drop(kind, obj)
    work = _Work(wanted, Job(kind, [], compute), take)
    if bpy.app.background or bpy.app.is_job_running("RENDER") or point_count(obj.data) <= _AT_ONCE:
        work.end(obj)
        return
    _works[kind, obj.session_uid] = work
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=_TICK)


def drop(kind: str, obj):
    """Drop work for an object: its result is no longer wanted."""
    work = _works.pop((kind, obj.session_uid), None)
    if work is not None:
        work.job.stop()


def _tick():
    """Take what threads have found; a timer of the window."""
    _end([key for key, work in _works.items() if work.job.ended])
    return _TICK if _works else None


@persistent
def _end_all(*_):
    """Wait for all threads: a file is saved with what is shown."""
    _end([*_works])


def _end(keys):
    for kind, uid in keys:
        _works.pop((kind, uid)).end(find_object(uid))


@persistent
def _forget(*_):
    while _works:
        _works.popitem()[1].job.stop()


def attach():
    """Drop what threads find when another file is opened."""
    add_handlers({"load_pre": _forget, "save_pre": _end_all})


def detach():
    """Stop threads and timer."""
    remove_handlers({"load_pre": _forget, "save_pre": _end_all})
    _forget()
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
