"""Whole numbers and times whose digits single precision would lose: minus an offset, or in two columns."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ..types import Array, Floats, Ints

_WHOLE = 2**31  # of a whole number of Blender, 32 bits with a sign
_EXACT = 2**53  # beyond this, doubles are no longer all whole numbers
LARGEST_SINGLE = float(np.finfo(np.float32).max)
SMALLEST_SINGLE = float(np.finfo(np.float32).tiny)
_MOST_DECIMALS = 9  # that are looked for, and ...
_MEANT = 6  # ... that numbers have because they were measured so; more come out of a computation
_SINGLE = 9  # digits with which single precision is written
_FINE = 1e-5  # step of single precision that does not hurt, as a share of the extent ...
_FINEST = 1e-3  # ... and in all: a millisecond, say, unless an offset does not help
_HELPFUL = 0.125  # share of the largest number that a useful offset leaves at most
_FIRST = 1000  # numbers that are tested before all others


class Digits(NamedTuple):
    """How numbers are kept whose digits single precision would lose.

    Attributes
    ----------
    offset : int, float, or list of float
        What was subtracted; of vectors along each axis.
    decimals : int or None
        How many the numbers had, if they are decimals, to which they are rounded when they are put together again.
    part : {"", "high", "rest"}
        What a second part holds: the upper 32 bits of whole numbers, or what single precision left of others.
    unsigned : bool
        Whether whole numbers of 64 bits have no sign.
    step : int
        By what whole numbers less the offset were divided: times in nanoseconds may all be multiples of a microsecond.
    """

    offset: Any  # a number, or a list of them for vectors
    decimals: int | None = None
    part: str = ""
    unsigned: bool = False
    step: int = 1


def split_digits(values: Array, known: Digits | None = None) -> tuple[list[Array], Digits | None]:
    """Split numbers into parts of 32 bits, which `join_digits` combines.

    Parameters
    ----------
    values : ndarray, (n,) or (n, 3)
    known : Digits, optional
        How numbers of that name are kept elsewhere, used if it suits these.

    Returns
    -------
    list of ndarray
        One or two parts, the more significant first; the numbers themselves if single precision keeps them.
    Digits or None
        None if single precision keeps them.
    """
    if values.ndim == 2:
        return _split_vectors(values)
    if values.dtype.kind in "iu":
        return _split_whole(values, known)
    if values.dtype != np.float64 or _is_kept(values):
        return [values], None
    return _split_floats(values, known)


def join_digits(parts: list[Array], digits: Digits) -> Array:
    """Combine the parts of numbers from `split_digits`, which users may have edited."""
    first = parts[0]
    if digits.part == "high" and [part.dtype for part in parts] == [np.int32, np.int32]:
        bits = parts[1].astype(np.int64).view(np.uint64) << np.uint64(32) | first.view(np.uint32).astype(np.uint64)
        return bits if digits.unsigned else bits.view(np.int64)
    if first.dtype.kind == "i":
        return _put_together(first, digits)
    values = first.astype(np.float64) + (parts[1].astype(np.float64) if len(parts) == 2 else 0.0)
    values += digits.offset
    if digits.decimals is None:
        return values
    rounded = np.round(values, digits.decimals)
    error = np.spacing(np.abs(parts[-1])) + np.spacing(np.abs(values))
    return np.where(np.abs(rounded - values) <= error, rounded, values)


def shortest(values: Array) -> Floats:
    """Return numbers of single precision as doubles of so few decimals that they still are these numbers.

    Single precision keeps 0.123 as 0.123000003.
    """
    doubles = values.astype(np.float64)
    for decimals in range(_MOST_DECIMALS + 1):
        for rows in slice(_FIRST), slice(None):  # a few mostly decide it
            rounded = np.round(doubles[rows], decimals)
            if not _same(rounded.astype(np.float32), values[rows]):
                break
        else:
            return rounded
    return doubles


def _split_whole(values: Ints, known: Digits | None) -> tuple[list[Ints], Digits | None]:
    low, high = (int(values.min()), int(values.max())) if len(values) else (0, 0)
    if _fit(low, high):
        return [values.astype(np.int32)], None
    bits = values.astype(np.int64).view(np.uint64) if values.dtype.kind == "i" else values.astype(np.uint64)
    for offset, step in _whole_offsets(bits, low, high, known):
        less = (bits - np.uint64(offset % 2**64)).view(np.int64)
        if _fit((low - offset) // step, (high - offset) // step) and not (less % step).any():
            return [(less // step).astype(np.int32)], Digits(offset, step=step)
    lower = (bits & np.uint64(2**32 - 1)).astype(np.uint32).view(np.int32)
    upper = (bits >> np.uint64(32)).astype(np.uint32).view(np.int32)
    return [lower, upper], Digits(0, part="high", unsigned=high >= 2**63)


def _fit(low: int, high: int) -> bool:
    """Whether Blender has whole numbers of this range."""
    return low >= -_WHOLE and high < _WHOLE


def _whole_offsets(bits: Ints, low: int, high: int, known: Digits | None) -> Iterator[tuple[int, int]]:
    """Yield what may be subtracted from whole numbers, and what divides the rest.

    First those of other numbers, then a round number and the middle, and last the common divisor of all differences.
    """
    if known is not None and isinstance(known.offset, int) and not known.part:
        yield known.offset, known.step
    grid = 10 ** len(str(high - low))
    for offset in (low // grid * grid, low, low + _WHOLE):
        yield offset, 1
    if high - low < 2**63:
        yield low, int(np.gcd.reduce(bits - np.uint64(low % 2**64)))


def _put_together(whole: Ints, digits: Digits) -> Ints:
    """Return whole numbers of 32 bits times a step and plus an offset, of 64 bits; all of them go round at 2**64."""
    bits = whole.astype(np.int64).view(np.uint64) * np.uint64(digits.step) + np.uint64(digits.offset % 2**64)
    return bits if int(whole.max(initial=0)) * digits.step + digits.offset >= 2**63 else bits.view(np.int64)


def _is_kept(values: Floats) -> bool:
    """Whether single precision keeps what numbers say: they are such numbers, or these written with their digits."""
    with np.errstate(over="ignore", invalid="ignore"):  # of numbers that are infinite, or become so
        single = values.astype(np.float32)
        return _same(single.astype(np.float64), values) or _same(_significant(single), values)


def _same(found: Array, values: Array) -> bool:
    return bool(np.array_equal(found, values, equal_nan=True))


def _significant(single: Array) -> Floats:
    """Return numbers of single precision as they are read again that were written with all their digits."""
    sizes = np.abs(single.astype(np.float64))
    with np.errstate(divide="ignore"):
        places = _SINGLE - 1 - np.floor(np.log10(sizes, where=sizes > 0.0, out=np.zeros_like(sizes)))
    power = 10.0 ** np.abs(places)
    scaled = np.where(places >= 0.0, single * power, single / power)
    return np.where(places >= 0.0, np.rint(scaled) / power, np.rint(scaled) * power)


def _split_floats(values: Floats, known: Digits | None) -> tuple[list[Array], Digits | None]:
    finite = values[np.isfinite(values)]
    if len(finite) == 0 or np.abs(finite).max() > LARGEST_SINGLE:
        return [values], None
    decimals = _decimals(finite)
    if decimals == 0 and len(finite) == len(values):
        return _split_whole(values.astype(np.int64), known)
    if _is_plain(finite, decimals):
        return [values.astype(np.float32)], None
    offsets = [known.offset] if known is not None and isinstance(known.offset, float) else []
    for offset in (*offsets, _float_offset(finite)):
        less = values - offset
        if _is_fine(finite, offset, decimals):
            return [less.astype(np.float32)], Digits(offset, decimals) if offset else None
    first = less.astype(np.float32)
    return [first, (less - first).astype(np.float32)], Digits(offset, decimals, "rest")


def _split_vectors(values: Floats) -> tuple[list[Floats], Digits | None]:
    finite = values[np.isfinite(values).all(axis=1)]
    if values.dtype != np.float64 or len(finite) == 0 or np.abs(finite).max() > LARGEST_SINGLE:
        return [values], None
    offsets = [0.0 if _is_kept(axis) or _is_plain(axis) else _float_offset(axis) for axis in finite.T]
    return ([values - offsets], Digits(offsets)) if any(offsets) else ([values], None)


def _decimals(values: Floats) -> int | None:
    """Return how many decimals numbers have at most; None if they are no decimals."""
    largest = np.abs(values).max()
    for decimals in range(_MOST_DECIMALS + 1):
        if largest * 10.0**decimals >= _EXACT:
            break
        if all(_same(np.round(part, decimals), part) for part in (values[:_FIRST], values)):  # a few mostly decide it
            return decimals
    return None


def _float_offset(values: Floats) -> float:
    """Return the middle of numbers, rounded to a power of ten below their extent; zero if that does not help."""
    low, high = float(values.min()), float(values.max())
    if high - low < SMALLEST_SINGLE:
        return low
    offset = float(np.round(0.5 * low + 0.5 * high, -int(np.floor(np.log10(high - low)))))
    left = max(high - offset, offset - low)
    return offset if left < _HELPFUL * max(abs(low), abs(high)) else 0.0


def _is_plain(values: Floats, decimals: int | None = None) -> bool:
    """Whether single precision does not hurt numbers as they are."""
    return _is_fine(values, 0.0, _decimals(values) if decimals is None else decimals, _FINEST)


def _is_fine(values: Floats, offset: float, decimals: int | None, finest: float = np.inf) -> bool:
    """Whether single precision does not hurt numbers less an offset.

    Those that were measured to some decimals have these again when they are rounded. Others keep their differences, in
    steps that are no coarser than the finest.
    """
    less = values - offset
    single = less.astype(np.float32)
    if decimals is not None:
        if _same(np.round(single.astype(np.float64) + offset, decimals), values):
            return True
        if decimals <= _MEANT:
            return False
    step, extent = float(np.spacing(np.abs(single).max())), float(np.ptp(values))
    if extent < SMALLEST_SINGLE:
        return step <= _FINEST
    gaps = np.diff(np.unique(values))
    return step <= min(_FINE * extent, 0.5 * float(np.median(gaps)), finest)
