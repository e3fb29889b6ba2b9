"""Work in blocks that fit the cache, on all cores: numpy and scipy let other threads run while they work on arrays."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from threading import Lock, local
from typing import Any, TypeVar

import numpy as np
from threadpoolctl import OpenBLASController, get_cached_controller

from ..cores import cores
from ..types import Array, Ints, Report

Part = TypeVar("Part")
Result = TypeVar("Result")

_BLOCK = 1 << 13  # rows of a few numbers, or of some dozens
_LOCK = Lock()
_limits: list[Any] = []  # of the threads of BLAS: the same one for each pool that is open
_opened = local()  # how many threads the pool has that a thread has open, and that pool


def blocks(count: int, size: int) -> list[slice]:
    """Return slices that divide a number of rows into blocks of at most a size: 1, 2, 4, or a multiple of 8 of them.

    So many are shared evenly by as many cores as machines have.
    """
    least = -(-count // size)
    return shares(count, min(1 << max(least - 1, 0).bit_length(), -(-least // 8) * 8))


def shares(count: int, parts: int) -> list[slice]:
    """Return slices that divide a number of rows evenly into so many parts."""
    return [slice(count * part // parts, count * (part + 1) // parts) for part in range(parts)]


def runs(start: Ints, count: Ints) -> Ints:
    """Return the numbers of runs, one run after the other: so many from each start on, (count.sum(),)."""
    return np.arange(count.sum()) + np.repeat(start - np.cumsum(count) + count, count)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS start no threads of its own: after each call they are awake for some hundredths of a second.

    Meanwhile they keep cores from ours. They are limited for the whole process, until the last such context ends.
    """
    with _LOCK:
        _limits.append(_limits[0] if _limits else _from_any_thread(_one_thread))
    try:
        yield
    finally:
        with _LOCK:
            limit = _limits.pop()
            if not _limits:
                _from_any_thread(limit.restore_original_limits)


@contextmanager
def workers(most: int | None = None) -> Iterator[ThreadPoolExecutor]:
    """Open a pool of a thread for each core, or of fewer, while BLAS has one: to start threads takes a while.

    Within it, the same thread gets the same pool again. Others, such as those of the pool, open their own.
    """
    count, before = min(cores(), most or cores()), getattr(_opened, "pool", None)
    if before and before[0] == count:
        yield before[1]
        return
    with one_blas_thread(), ThreadPoolExecutor(count) as pool:
        _opened.pool = count, pool
        try:
            yield pool
        finally:
            _opened.pool = before


def _one_thread() -> Any:
    return get_cached_controller().limit(limits=1, user_api="blas")


def _from_any_thread(change: Callable[[], Result]) -> Result:
    """Change how many threads BLAS has, which else only the thread may that did so first."""
    OpenBLASController.clear_controlling_thread(force=True)
    result = change()
    OpenBLASController.clear_controlling_thread(force=True)
    return result


def on_all_cores(
    function: Callable[[Part], Result], parts: Sequence[Part], report: Report = lambda: None, most: int | None = None
) -> list[Result]:
    """Call a function with each of some parts, on all cores.

    Parameters
    ----------
    function : callable
        Writes to other entries for each part, so that results do not depend on the number of cores.
    parts : sequence
    report : callable
        Called before the first part and after each; may raise `Cancelled`, after which no further part is begun.
    most : int, optional
        How many parts are worked on at one time at most, where each takes much memory.

    Returns
    -------
    list
        What the function returned, in the order of the parts.
    """
    report()
    if len(parts) < 2:
        return [function(part) for part in parts]
    results = []
    with workers(most) as pool:
        running = [pool.submit(function, part) for part in parts]
        try:
            for future in running:
                results.append(future.result())
                report()
        finally:
            for future in reversed(running):  # before the others get there
                future.cancel()
            wait(running)
    return results


def by_blocks(function: Callable[[slice], Array], count: int) -> Array:
    """Return the array, (count, ...), of which a function computes the rows of each slice, on all cores."""
    first, lock = list[Array](), Lock()

    def put(rows: slice) -> None:
        values = function(rows)
        with lock:
            if not first:
                first.append(np.empty((count, *values.shape[1:]), dtype=values.dtype))
        first[0][rows] = values

    on_all_cores(put, blocks(count, _BLOCK) or [slice(0)])
    return first[0]
