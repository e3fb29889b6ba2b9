"""A cache of recent results, so that changes of display or strength repeat no computation."""

import hashlib
from collections import OrderedDict
from threading import Lock
from weakref import WeakKeyDictionary

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ... import core
from ...command import analysis
from ...command.analysis import Built

LIMIT = 2 << 30  # bytes: the operator of 100,000 points with 100 modes takes 0.4 GB
_NONE = np.arange(0)  # no splats are left out
_kept = OrderedDict()  # value and bytes by key, in the order of last use
_sources = WeakKeyDictionary()  # key of each operator
_lock = Lock()  # computations run in threads


def build(points, options, boundary, progress, orientation=None, splats=None) -> Built:
    """Return the operator of these points, options and boundary, built only if it is not kept.

    Parameters
    ----------
    points : ndarray, (n, 3)
    options : LaplacianOptions or PaperOptions
    boundary : ndarray, (n,) bool, or None
        The boundary points; None leaves it to the options.
    progress : callable
        Called as ``progress(stage, fraction)``.
    orientation : ndarray, (n, 3), or None
        Vectors that orient the normals; None leaves it to core. The operator itself is not rebuilt for others.
    splats : Splats or None
        The splats of the points: `floating` ones are left out.
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
    with _lock:
        _sources[built.laplacian] = key
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


def lowest_modes(laplacian, count: int, progress, dirichlet=False, raw=False) -> "core.Spectrum":
    """Return the lowest modes of an operator, computed only if fewer are kept.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        From `build`.
    count : int
    progress : callable
        Called as ``progress(stage, fraction)``.
    dirichlet, raw : bool
        As of `LaplaceBeltrami.eigenpairs`.
    """
    progress("Spectrum", 0.0)
    key = _modes_key(laplacian, dirichlet)
    known = _get(key)
    if known is None or len(known.eigenvalues) < count:
        known = laplacian.eigenpairs(count, raw=True, dirichlet=dirichlet, progress=progress)
        _put(key, known)
    lowest = core.Spectrum(known.eigenvalues[:count], known.eigenvectors[:, :count])
    return lowest if raw else laplacian.corrected(lowest)


def known_modes(laplacian) -> int:
    """Return how many modes of an operator are kept."""
    known = _get(_modes_key(laplacian, False))
    return 0 if known is None else len(known.eigenvalues)


def result(laplacian, *settings, compute):
    """Return the result of a function without arguments that uses an operator, called only if it is not kept.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        From `build`.
    *settings : hashable or ndarray
        A name, and everything else that the result depends on.
    compute : callable
    """
    return fetch(content(_sources[laplacian], *settings), compute, laplacian)


def fetch(key, compute, laplacian=None):
    """Return the value of a key, computed by a function and kept if there is none.

    The bytes of an operator that the value refers to are not counted again.
    """
    value = _get(key)
    if value is None:
        value = compute()
        _put(key, value, laplacian)
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


def _modes_key(laplacian, dirichlet):
    return content(_sources[laplacian], "modes", dirichlet)


def _get(key):
    with _lock:
        if key not in _kept:
            return None
        _kept.move_to_end(key)
        return _kept[key][0]


def _put(key, value, laplacian=None):
    """Keep a value, and drop those of the oldest use beyond the limit."""
    size = memory(value, laplacian)
    with _lock:
        _kept.pop(key, None)
        _kept[key] = value, size
        source = _sources.get(laplacian) if laplacian is not None else None
        if source in _kept:  # its results are useless without the operator, and hold its memory
            _kept.move_to_end(source)
        total = sum(size for _, size in _kept.values())
        while total > LIMIT and len(_kept) > 1:
            total -= _kept.popitem(last=False)[1][1]


def memory(value, known=None) -> int:
    """Return the bytes of all arrays that a value refers to, without those of a known object."""
    total, found, pending = 0, {id(known)}, [value]
    while pending:
        item = pending.pop()
        if id(item) in found:
            continue
        found.add(id(item))
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
