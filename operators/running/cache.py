"""A cache of recent results, so that changes of display or strength repeat no computation."""

import hashlib
from collections import OrderedDict
from threading import Lock

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ... import core
from ...command import analysis
from ...command.analysis import Built

LIMIT = 2 << 30  # bytes: the operator of 100,000 points with 100 modes takes 0.4 GB
_NONE = np.arange(0)  # no splats are left out
_kept = OrderedDict()  # values by key, in the order of last use
_lock = Lock()  # computations run in threads


def build(points, options, boundary, progress, orientation=None, splats=None) -> Built:
    """Return the operator of points, (n, 3), options and boundary, built only if it is not kept.

    Boundary points are (n,) bool; None leaves them to the options. The orientation, (n, 3), orients the normals; None
    leaves that to core. The operator itself is not rebuilt for another. Of splats, `floating` ones are left out.
    """

    def compute():
        fitting(len(points), options)
        return analysis.build(points, options, boundary, out, progress)

    out = floating(splats)
    key = content(points, options, boundary, out)
    built = fetch(key, compute)
    if orientation is not None:
        key = content(key, orientation)
        plain = built
        built = fetch(key, lambda: analysis.oriented(plain, orientation))
    return built


def holds(points, options, boundary, splats=None) -> bool:
    """Whether the operator that `build` returns is kept."""
    return _get(content(points, options, boundary, floating(splats))) is not None


def floating(splats):
    """Return the indices of the splats that operators leave out; see `floating_rows`."""
    if splats is None:
        return _NONE
    key = content("floaters", splats.positions, splats.scales, splats.rotations, splats.opacities)
    return fetch(key, lambda: core.splats.floating_rows(splats))


def fitting(count: int, options, modes: int = 0):
    """Return how many points fit into the free memory, None if unknown; see `points_that_fit`.

    If a count does not fit, the cache is cleared first.
    """
    width = options.cloud if isinstance(options, core.PaperOptions) else options
    most = core.points_that_fit(width, modes)
    if most is None or most >= count:
        return most
    clear()
    return core.points_that_fit(width, modes)


def fetch(key, compute):
    """Return the value of a key, computed by a function and kept if there is none."""
    value = _get(key)
    if value is None:
        value = compute()
        _put(key, value)
    return value


def content(*parts):
    """Return a key for `fetch` of hashable parts and arrays, which count by content."""
    return tuple(
        hashlib.blake2b(np.ascontiguousarray(part)).digest() if isinstance(part, np.ndarray) else part for part in parts
    )


def clear():
    """Clear the cache."""
    with _lock:
        _kept.clear()


def attach():
    """Clear the cache when another file is opened."""
    bpy.app.handlers.load_pre.append(_forget)


def detach():
    """Remove the handler and clear the cache."""
    bpy.app.handlers.load_pre.remove(_forget)
    clear()


@persistent
def _forget(*_):
    clear()


def _get(key):
    with _lock:
        if key not in _kept:
            return None
        _kept.move_to_end(key)
        return _kept[key]


def _put(key, value):
    """Keep a value, and drop those of the oldest use beyond the limit; operators grow by what they keep."""
    with _lock:
        _kept.pop(key, None)
        _kept[key] = value
        sizes = {each: memory(held) for each, held in _kept.items()}
        while sum(sizes.values()) > LIMIT and len(_kept) > 1:
            del sizes[_kept.popitem(last=False)[0]]


def memory(value) -> int:
    """Return the bytes of all arrays that a value refers to."""
    total, found, pending = 0, set(), [value]
    while pending:
        item = pending.pop()
        known = item.__array_interface__["data"][0] if isinstance(item, np.ndarray) else id(item)  # views count once
        if known in found:
            continue
        found.add(known)
        if isinstance(item, np.ndarray):
            total += item.nbytes
        elif isinstance(item, dict):
            pending += item.values()
        elif isinstance(item, (list, tuple)):
            pending += item
        else:
            pending += vars(item).values() if hasattr(item, "__dict__") else ()
            pending += [item.__self__] if hasattr(item, "__self__") else ()
    return total
