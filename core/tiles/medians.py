"""Medians of numbers that need not be in memory at once."""

from collections.abc import Callable, Iterable

import numpy as np

from ..types import Array, Floats

_SHIFT = 44  # bits that are left out of the first look: 256 steps for each doubling of a number


def median(parts: Callable[[], Iterable[Floats]]) -> float:
    """Return the median of numbers that are looked at twice.

    `parts` returns an iterable of arrays of numbers that are not negative, (k,), the same each time. Those around the
    median, about a hundredth of all, are held in memory.
    """
    total = np.zeros(1 << (64 - _SHIFT), dtype=np.int64)
    for part in parts():
        total += np.bincount(_keys(part), minlength=len(total))
    ends = np.cumsum(total)
    count = int(ends[-1])
    low, high = np.searchsorted(ends, [(count - 1) // 2, count // 2], side="right")
    near = [part[(_keys(part) >= low) & (_keys(part) <= high)] for part in parts()]
    values = np.sort(np.concatenate(near))
    begin = int(ends[low] - total[low])
    return float(0.5 * (values[(count - 1) // 2 - begin] + values[count // 2 - begin]))


def _keys(values: Floats) -> Array:
    """Return the first bits of numbers, which ascend with these."""
    return (np.ascontiguousarray(values, dtype=np.float64).view(np.uint64) >> np.uint64(_SHIFT)).astype(np.int64)
