"""Round numbers along an axis, and how they are written."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


def round_ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Choose at most so many numbers from low to high that are multiples of 1, 2 or 5 times a power of ten."""
    if not low < high:
        return [low]
    step = _round_step((high - low) / (most + 1))
    while True:
        first, last = math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6)
        if last - first < most:
            break
        step = _round_step(1.01 * step)
    return [index * step for index in range(first, last + 1)]


def _round_step(least: float) -> float:
    """Return the smallest 1, 2 or 5 times a power of ten that is not below a number, up to rounding."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= (1.0 - 1e-9) * least)


def tick_texts(ticks: Sequence[float]) -> list[str]:
    """Write evenly spaced numbers with as many digits as distinguish them."""
    greatest = max(map(abs, ticks), default=0.0)
    step = ticks[1] - ticks[0] if len(ticks) > 1 else greatest
    if greatest == 0.0 or step == 0.0:
        return ["0"] * len(ticks)
    digits = -math.floor(math.log10(abs(step)) + 1e-6)  # after the point
    if len(ticks) == 1:
        return [f"{ticks[0]:.3g}"]
    if 1e-3 <= greatest < 1e6:
        return [f"{_plain(tick, step):,.{max(digits, 0)}f}" for tick in ticks]
    exponent = math.floor(math.log10(greatest) + 1e-6)
    return [_scientific(_plain(tick, step), max(exponent + digits, 0)) for tick in ticks]


def _plain(tick: float, step: float) -> float:
    return 0.0 if abs(tick) < 1e-6 * abs(step) else tick


def _scientific(value: float, digits: int) -> str:
    return f"{value:.{digits}e}" if value else "0"
