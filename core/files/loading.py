"""Columns of numbers of a text: which can be read, in all rows, and their numbers piece by piece."""

from collections.abc import Callable, Iterator
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import InvalidPointsError
from ..types import Array, Bools, Floats, Ints
from .cells import Rows, clean_lines, is_missing, split_row
from .lines import brief, is_number

_ROUNDS = 20  # times that rows are read again without a column that turned out not to be numeric
_EXACT = 2.0**53  # from here on doubles skip whole numbers
_DIGITS = 24  # of a whole number of 64 bits at most, and more


class Loaded(NamedTuple):
    """Columns of numbers that can be read.

    Attributes
    ----------
    rows : Rows
    places, others : list of int
        Indices of x y z, and of the other columns.
    whole : dict of int to type
        The columns of whole numbers that are too large for doubles, and the type of these.
    count : int
        Rows.
    size : int or None
        Rows of a piece at most; None for all in one.
    held : ndarray, (n, 3 + k) float64, or None
        The numbers, if they are one piece.
    notices : list of str
    """

    rows: Rows
    places: list[int]
    others: list[int]
    whole: dict[int, type[np.int64 | np.uint64]]
    count: int  # type: ignore[assignment]  # in place of the method of tuples
    size: int | None
    held: Floats | None
    notices: list[str]

    def pieces(self) -> Iterator[tuple[Floats, dict[int, Array]]]:
        """Yield coordinates, (k, 3), and the other columns by their indices."""
        columns = self.places + self.others
        numbers = _pieces(self.rows, columns, self.size) if self.held is None else iter([self.held])
        texts = [_texts(self.rows, index, columns, self.size) for index in self.whole]
        for values, *words in zip(numbers, *texts, strict=True):
            others: dict[int, Array] = dict(zip(self.others, values[:, 3:].T, strict=True))
            large = zip(self.whole.items(), words, strict=True)
            yield values[:, :3], others | {index: text.astype(kind) for (index, kind), text in large}


def load(
    rows: Rows, places: list[int], others: list[int], name: Callable[[int], str], size: int | None = None
) -> Loaded:
    """Find out which columns can be read as numbers, in all rows.

    A cell without a number becomes NaN, and a column with a cell of text is left out, unless it is a coordinate.

    Parameters
    ----------
    rows : Rows
    places : list of int
        Indices of x y z.
    others : list of int
        Indices of the other columns.
    name : callable
        Returns the name of a column by its index, for the notices.
    size : int, optional
        Rows of a piece at most; all in one if not given.
    """
    notices: list[str] = []
    for left in reversed(range(_ROUNDS + 1)):
        if not left:
            notices = [f"{rows.path.name}: left out all columns but x y z, for many of them hold text in some rows."]
            others = []
        try:
            found = _look(rows, places + others, size)
        except ValueError:
            faults = _find_faults(rows, places, others) if left else {}
            if not faults:
                raise
            _refuse_places(faults, places, rows.path)
            rows.filled = rows.filled or "" in faults.values()
            others = [index for index in others if not faults.get(index)]
            notices += _fault_notices(faults, name, rows.path)
        else:
            break
    kept = _with_numbers(rows, found, [*places, *others], name, notices)
    held = found.held if found.held is None or kept.all() else found.held[:, kept]
    others, large = [index for index, there in zip(others, kept[3:], strict=True) if there], found.large[kept][3:]
    whole = {}
    for index in (index for index, is_large in zip(others, large, strict=True) if is_large):
        kind, lost = _whole_kind(rows, index, places + others, size)
        if kind is not None:
            whole[index] = kind
        if lost:
            notices.append(f"{rows.path.name}: {name(index)} has whole numbers whose last digits are rounded.")
    return Loaded(rows, places, others, whole, found.count, size, held, notices)


class _Found(NamedTuple):
    """What the columns hold that were read."""

    count: int  # type: ignore[assignment]  # in place of the method of tuples
    missing: Ints  # cells without a number
    large: Bools  # whether doubles may lose digits of whole numbers
    held: Floats | None


def _look(rows: Rows, columns: list[int], size: int | None) -> _Found:
    """Read all rows once."""
    count, missing, large = 0, np.zeros(len(columns), dtype=np.int64), np.zeros(len(columns), dtype=bool)
    held = None
    for values in _pieces(rows, columns, size):
        held = None if count else values
        count += len(values)
        missing += np.isnan(values).sum(axis=0)
        large |= (np.abs(values) >= _EXACT).any(axis=0)
    return _Found(count, missing, large, held)


def _refuse_places(faults: dict[int, str], places: list[int], path: Path) -> None:
    """Refuse a file in which a coordinate is text, or missing."""
    fatal = next((text for index, text in faults.items() if index in places and text), "")
    if fatal:
        raise InvalidPointsError(f"{path} does not hold columns of numbers x y z: {fatal}. Correct the file.") from None


def _fault_notices(faults: dict[int, str], name: Callable[[int], str], path: Path) -> list[str]:
    """Report which columns are left out, and why."""
    wrong = [name(index) for index, text in faults.items() if text]
    why = next(filter(None, faults.values()), "")
    return [f"{path.name}: left out {brief(', '.join(wrong))}, for {why}."] if wrong else []


def _whole_kind(
    rows: Rows, index: int, columns: list[int], size: int | None
) -> tuple[type[np.int64 | np.uint64] | None, bool]:
    """Return the type of a column of whole numbers that are too large for doubles.

    Returns
    -------
    type or None
        None if they are not whole numbers, or too large for 64 bits.
    bool
        Whether they are whole numbers but for missing ones, so that doubles lose digits.
    """
    kinds: list[type[np.int64 | np.uint64]] = [np.int64, np.uint64]
    decimal = True
    for texts in _texts(rows, index, columns, size):
        kinds = [kind for kind in kinds if _fits(texts, kind)]
        decimal = decimal and bool(np.char.isdecimal(np.char.lstrip(texts[texts != "nan"], "+-")).all())
    return (kinds[0], False) if kinds else (None, decimal)


def _fits(texts: Array, kind: type[np.int64 | np.uint64]) -> bool:
    """Whether all texts are whole numbers of a type."""
    try:
        texts.astype(kind)
    except (ValueError, OverflowError):
        return False
    return True


def _texts(rows: Rows, index: int, columns: list[int], size: int | None) -> Iterator[Array]:
    """Yield the texts of one of some columns, (k,), in the pieces in which its numbers are read with the others."""
    place = columns.index(index)
    return (texts[:, 0] for texts in _pieces(rows, columns, size, f"U{_DIGITS}", slice(place, place + 1)))


def _pieces(
    rows: Rows, columns: list[int], size: int | None, dtype: str = "f8", used: slice = slice(None)
) -> Iterator[Array]:
    """Load columns by numpy, so many rows at once; or of these only some, from the same rows."""
    lines = clean_lines(rows, columns)
    filled = (line for line in lines if line and not line.isspace() and not line.lstrip().startswith("#"))
    while (first := next(filled, None)) is not None:
        piece = chain([first], lines if size is None else islice(filled, size - 1))
        yield np.loadtxt(piece, dtype=dtype, delimiter=rows.delimiter, usecols=columns[used], ndmin=2)


def _find_faults(rows: Rows, places: list[int], others: list[int]) -> dict[int, str]:
    """Return the faults of the first row that lacks numbers: a text by column, empty for an empty cell."""
    for number, line in enumerate(rows.lines(), start=rows.first + 1):
        words = split_row(line, rows.delimiter) if line.strip() else []
        if not any(words):
            if len(words) > 1 and not rows.filled:
                return dict.fromkeys(places, "")
            continue
        faults = {}
        for index in places + others:
            word = words[index] if index < len(words) else ""
            if index >= len(words) and (index in places or rows.delimiter is None):
                faults[index] = f"line {number} has {len(words)} columns only"
            elif not is_missing(word):
                if not is_number(word):
                    faults[index] = f"line {number} has {brief(word)!r} where a number should be"
            elif not rows.filled and not is_number(word):
                faults[index] = ""
        if faults:
            return faults
    return {}


def _with_numbers(
    rows: Rows, found: _Found, columns: list[int], name: Callable[[int], str], notices: list[str]
) -> Bools:
    """Return which columns are kept: not those without any number; and report how many cells of which have none."""
    kept = np.ones(len(columns), dtype=bool)
    if not rows.filled:
        return kept
    kept[3:] = found.missing[3:] < found.count
    names = list(map(name, columns))
    empty = [label for label, there in zip(names, kept, strict=True) if not there]
    gaps = [f"{n} of {label}" for label, n, there in zip(names, found.missing, kept, strict=True) if n and there]
    if empty:
        notices.append(f"{rows.path.name}: left out {brief(', '.join(empty))}, which has no numbers.")
    if gaps:
        notices.append(f"{rows.path.name}: cells without a number are NaN: {brief(', '.join(gaps))}.")
    return kept
