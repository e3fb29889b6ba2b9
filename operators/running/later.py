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
    """A job, and the function that takes its result."""

    job: Job
    take: object

    def end(self, obj):
        """Wait for the result and let it be taken, if the object is there."""
        self.job.wait(None)
        if obj is not None:
            self.take(obj, self.job)


_works = {}  # by what they are of, and the session_uid of their object


def later(kind: str, obj, compute, take):
    """Compute in a thread, and call `take` with the object and the job, whose result it asks for, when that is there.

    `compute` is called with a progress callback. Scripts, renders and few points wait for it. Earlier work of this kind
    for the object is dropped; whether what was found is still wanted is for `take` to tell.
    """
    drop(kind, obj)
    work = _Work(Job(kind, [], compute), take)
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
