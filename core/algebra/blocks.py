"""Work in blocks that fit the cache, on all cores: numpy and scipy let other threads run while they work on arrays."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np

from ..cores import cores
from ..types import Array, Report

Part = TypeVar("Part")
Result = TypeVar("Result")

_BLOCK = 1 << 13  # rows of a few numbers, or of some dozens


def blocks(count: int, size: int) -> list[slice]:
    """Return the slices that divide a number of rows into blocks of one size."""
    return [slice(start, min(start + size, count)) for start in range(0, count, size)]


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
    with ThreadPoolExecutor(min(cores(), most or len(parts))) as pool:
        for result in pool.map(function, parts):
            results.append(result)
            report()
    return results


def by_blocks(function: Callable[[slice], Array], count: int) -> Array:
    """Return the array, (count, ...), of which a function computes the rows of each slice, on all cores."""
    return np.concatenate(on_all_cores(function, blocks(count, _BLOCK) or [slice(0)]))
