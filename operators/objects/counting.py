"""Sizes and checksums of groups of points.

Reading a vertex group of 100,000 points takes 0.25 s, too much for a panel. So in a window, larger ones are counted in
small steps, between other events, and the last count is shown until then.
"""

import zlib
from dataclasses import dataclass, field
from time import perf_counter
from typing import NamedTuple

import bpy
import numpy as np
from bpy.app.handlers import persistent

from .attributes import point_count
from .groups import group_weights, has_group
from .handlers import add_handlers, notify, remove_handlers

_AT_ONCE = 5_000  # points of which all groups are read when a panel is drawn
_PATIENCE = 30.0  # a count is used for so many times the seconds that counting took
_STEP = 0.008  # seconds that a step blocks the window
_PAUSE = 0.01  # seconds in between
_CHUNK = 500  # points
_MOST = 50  # objects that are remembered


class Members(NamedTuple):
    """The points of a group, and which of them have a weight above zero."""

    count: int = 0  # number of points, those of weight zero included
    # Checksum of the points with a weight above zero, and one of their weights
    checksum: int = 0
    weighted: int = 0
    bits: bytes = b""  # one for each point, packed: whether its weight is above zero

    @property
    def rows(self):
        """Indices of the points whose weight is above zero."""
        return np.flatnonzero(np.unpackbits(np.frombuffer(self.bits, np.uint8)))


def summarize(weights) -> Members:
    """Summarize a group, given all weights, (n,), NaN for the points outside."""
    inside, count = weights > 0.0, np.count_nonzero(np.isfinite(weights))
    if not inside.any():
        return Members(count)
    return Members(count, zlib.crc32(inside), weighted_checksum(weights), np.packbits(inside).tobytes())


def weighted_checksum(weights) -> int:
    """Checksum of the weights above zero, given all, (n,)."""
    inside = weights > 0.0
    return zlib.crc32(np.where(inside, weights, 0.0).astype(np.float32)) if inside.any() else 0


@dataclass
class _Known:
    """What was counted for an object in a mode, with a number of points."""

    state: tuple
    members: dict = field(default_factory=dict)
    until: dict = field(default_factory=dict)


@dataclass
class _Pass:
    """A pass over the vertices of an object that counts groups; undo does not affect it."""

    names: list
    count: int  # vertices
    parts: list = field(default_factory=list)  # rows of names, vertices, and weights
    place: int = 0
    seconds: float = 0.0

    def go_on(self, obj, count: int):
        """Read the groups of the next so many vertices."""
        began = perf_counter()
        rows = {obj.vertex_groups[name].index: row for row, name in enumerate(self.names)}
        chunk = obj.data.vertices[self.place : self.place + count]
        held = [
            (rows[item.group], index, item.weight)
            for index, vertex in enumerate(chunk, start=self.place)
            for item in vertex.groups
            if item.group in rows
        ]
        self.parts.append(np.array(held, dtype=np.float64).reshape(-1, 3))
        self.place += len(chunk)
        self.seconds += perf_counter() - began

    def end(self, known):
        """Keep what all vertices gave."""
        row, index, weight = np.concatenate(self.parts).T if self.parts else np.empty((3, 0))
        for number, name in enumerate(self.names):
            mine, weights = row == number, np.full(self.count, np.nan, np.float32)
            weights[index[mine].astype(np.int64)] = weight[mine]
            known.members[name] = summarize(weights)
            known.until[name] = perf_counter() + _PATIENCE * self.seconds


_known = {}  # by session_uid
_wanted = {}  # names of groups to count, by session_uid
_passes = {}  # by session_uid


def members(obj, name: str, glance=False, trusting=False) -> Members | None:
    """Summarize one group; see `all_members`."""
    return all_members(obj, [name], glance, trusting)[0]


def all_members(obj, names, glance=False, trusting=False) -> list:
    """Summarize several groups, `Members` each; a missing one has no points.

    At a glance it is quick: a change may be missed for some seconds, and a group is None until its first count. If
    trusting it is quicker: the last count is taken, however old, unless undo or this extension changed the group.
    """
    there = [name for name in names if has_group(obj, name)]
    if obj.type != "MESH":
        found = {name: summarize(group_weights(obj, name, outside=np.nan)) for name in there}
        return [found.get(name, Members()) for name in names]
    known, now = _recall(obj), perf_counter()
    counted = [name for name in there if glance and name in known.members and known.until.get(name)]
    due = [name for name in there if name not in counted or not (trusting or now < known.until[name])]
    if due and glance and not bpy.app.background and point_count(obj.data) > _AT_ONCE:
        _wanted.setdefault(obj.session_uid, set()).update(due)
        if not bpy.app.timers.is_registered(_tick):
            bpy.app.timers.register(_tick, first_interval=_PAUSE)
    elif due:
        work = _Pass(due, point_count(obj.data))
        work.go_on(obj, work.count)
        work.end(known)
    return [known.members.get(name) if name in there else Members() for name in names]


def renew_counts(obj):
    """Count the groups of an object again, since they were changed."""
    _passes.pop(obj.session_uid, None)
    if obj.session_uid in _known:
        _known[obj.session_uid].until.clear()
    notify("panels_changed")


def _recall(obj):
    """Return the counts of an object; those of an earlier state only until they are renewed."""
    state = point_count(obj.data), obj.mode == "EDIT"
    known = _known.get(obj.session_uid)
    if known is None or known.state != state:
        if len(_known) > _MOST:
            _known.clear()
        kept = known.members if known is not None and known.state[0] == state[0] else {}
        known = _known[obj.session_uid] = _Known(state, kept)
    return known


def _tick():
    """Count for a moment; a timer of the window."""
    objects = {obj.session_uid: obj for obj in bpy.data.objects if obj.session_uid in _wanted}
    for uid in [*_wanted]:
        if uid not in objects or objects[uid].type != "MESH":
            _wanted.pop(uid), _passes.pop(uid, None)
    for uid, obj in objects.items():
        if uid in _wanted and _go_on(obj):
            notify("panels_changed")
    return _PAUSE if _wanted else None


def _go_on(obj) -> bool:
    """Count for a moment in an object; return whether all is counted."""
    uid, count = obj.session_uid, point_count(obj.data)
    work = _passes.get(uid)
    if work is None or work.count != count or any(not has_group(obj, name) for name in work.names):
        names = [name for name in _wanted[uid] if has_group(obj, name)]
        work = _passes[uid] = _Pass(names, count)
    began = perf_counter()
    while work.place < count and perf_counter() < began + _STEP:
        work.go_on(obj, _CHUNK)
    if work.place < count:
        return False
    del _passes[uid]
    work.end(_recall(obj))
    _wanted[uid] -= set(work.names)
    _wanted[uid] = {name for name in _wanted[uid] if has_group(obj, name)}
    if not _wanted[uid]:
        del _wanted[uid]
    return True


@persistent
def _undone(*_):
    _passes.clear()
    for known in _known.values():
        known.until.clear()


@persistent
def _forget(*_):
    for kept in (_known, _wanted, _passes):
        kept.clear()


_HANDLERS = {"undo_post": _undone, "redo_post": _undone, "load_pre": _forget}


def attach():
    """Count again after undo, and forget the counts of another file."""
    add_handlers(_HANDLERS)


def detach():
    """Stop counting, and leave no handler and no timer behind."""
    remove_handlers(_HANDLERS)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    _forget()
