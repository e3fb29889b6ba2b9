"""Rows of text to columns of numbers: what separates them, quotes, decimal commas, and cells without a number."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import TypeAlias

import numpy as np

from ..errors import InvalidPointsError
from ..types import Array, Floats, Ints
from .lines import brief, is_number

Blocks: TypeAlias = Callable[[], Iterator[list[str]]]

_DELIMITERS = (";", "\t", "|", None, ",")  # in this order; None is white space
_HEADER = 20  # lines that are no comments before the first point at most
_SAMPLE = 100  # rows by which kinds of columns are decided
_ROUNDS = 20  # times that rows are read again without a column that turned out not to be numeric
_DIGITS = 24  # of a whole number of 64 bits at most, and more
_MISSING = r"(?:n/?a|nan|null|none|nil|no ?data|-|--|\?|\*)"
_IS_MISSING = re.compile(f"{_MISSING}?", re.IGNORECASE)
_COMMENTS = ("#", "//", "%", "!")
_MARKED = re.compile(r"1\.?#(?:(INF)|QNAN|SNAN|IND|NAN)\d*|nan\(\w*\)", re.IGNORECASE)  # as Visual C writes them


@dataclass
class Rows:
    """The rows of a file of text.

    Attributes
    ----------
    blocks : callable
        Returns an iterator of lists of the lines of the file at each call; see `read_blocks`.
    path : pathlib.Path
    first : int
        How many lines precede the first row.
    delimiter : str or None
        None is white space.
    before : list of str
        The last lines before the first row that are not empty.
    sample : list of list of str
        The words of the first rows.
    filled : bool
        Whether cells without a number are read as NaN.
    """

    blocks: Blocks
    path: Path
    first: int
    delimiter: str | None
    before: list[str]
    sample: list[list[str]] = field(default_factory=list)
    filled: bool = False

    @property
    def width(self) -> int:
        """Return the number of columns, of the longest row of the sample."""
        return max(map(len, self.sample))

    def lines(self) -> Iterator[str]:
        """Yield the lines from the first row on."""
        return islice(chain.from_iterable(self.blocks()), self.first, None)


def is_comment(line: str) -> bool:
    """Whether a line is marked as a comment."""
    return line.lstrip().startswith(_COMMENTS)


def find_rows(blocks: Blocks, path: Path) -> Rows:
    """Find the first line with three numbers, and their delimiter.

    Raises
    ------
    InvalidPointsError
        There is none, or too many lines precede it.
    """
    before: list[str] = []
    texts = 0
    lines = chain.from_iterable(blocks())
    for number, line in enumerate(lines):
        if not line.strip():
            continue
        for delimiter in _DELIMITERS:
            words = split_row(line, delimiter)
            if _is_row(words):
                rows = Rows(blocks, path, number, delimiter, before, [words])
                rows.sample += filter(any, (split_row(text, delimiter) for text in islice(lines, _SAMPLE)))
                return rows
        before = [*before[1 - _HEADER :], line]
        texts += not is_comment(line)
        if texts > _HEADER:
            break
    problem = "there are none" if texts <= _HEADER else f"there are none in its first {_HEADER} lines"
    raise InvalidPointsError(f"{path} does not hold columns of numbers x y z: {problem}. Correct the file.")


def _is_row(words: list[str]) -> bool:
    """Whether words are those of a point: three numbers, of which one cell may be empty.

    Not those of columns, as pandas numbers them, with an empty name for that of rows.
    """
    numbers = sum(map(is_number, words))
    numbered = words[:1] == [""] and words[1:] == [str(index) for index in range(len(words) - 1)]
    return not numbered and (numbers >= 3 or (numbers == 2 and "" in words))


def is_numeric(words: list[str]) -> bool:
    """Whether words are numbers, or missing."""
    return any(map(is_number, words)) and all(is_number(word) or _IS_MISSING.fullmatch(word) for word in words)


def split_row(line: str, delimiter: str | None) -> list[str]:
    """Split a line without its comment, with decimal points; no words if the delimiter does not fit."""
    line = _unquoted(_unmarked(line.replace("#N/A", "")), delimiter).split("#")[0].split("//")[0].strip(" ")
    if delimiter is None and re.search(r"\s,|,\s|,$", line):
        return []
    if delimiter != ",":
        line = line.replace(",", ".")
    return [word.strip() for word in line.split(delimiter)]


def _unmarked(text: str) -> str:
    """Return text with NaN and infinity as numpy reads them: in 1.#QNAN stands a # that begins no comment."""
    marked = "#" in text or "(" in text
    return _MARKED.sub(lambda match: "inf" if match[1] else "nan", text) if marked else text


def _unquoted(text: str, delimiter: str | None) -> str:
    """Return text without quotes, and the delimiters inside them replaced: a decimal comma by a point."""
    if '"' not in text:
        return text
    inside = "." if delimiter == "," else "_"
    return re.sub(r'"([^"\n]*)"', lambda match: match[1].replace(delimiter or " ", inside), text)


def kinds(rows: Rows) -> tuple[list[int], list[int], list[int]]:
    """Return the indices of the columns that hold numbers, text, or nothing, in most rows of the sample."""
    numeric: list[int] = []
    textual: list[int] = []
    empty: list[int] = []
    for index in range(rows.width):
        words = [row[index] for row in rows.sample if index < len(row)]
        there = [word for word in words if not _IS_MISSING.fullmatch(word)]
        if 2 * sum(map(is_number, there)) >= len(there) and any(map(is_number, words)):
            numeric.append(index)
        else:
            (textual if there else empty).append(index)
    return numeric, textual, empty


def load(
    rows: Rows, places: list[int], others: list[int], name: Callable[[int], str]
) -> tuple[list[int], Floats, list[str]]:
    """Read columns of numbers.

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

    Returns
    -------
    list of int
        Which of the others were read.
    ndarray, (n, 3 + k) float64
    list of str
        Notices.
    """
    notices: list[str] = []
    for _ in range(_ROUNDS):
        try:
            values = _load(rows, places + others)
        except ValueError:
            faults = _find_faults(rows, places, others)
            if not faults:
                raise
            _refuse_places(faults, places, rows.path)
            rows.filled = rows.filled or "" in faults.values()
            others = [index for index in others if not faults.get(index)]
            notices += _fault_notices(faults, name, rows.path)
        else:
            return _without_empty(rows, values, places, others, name, notices)
    notices = [f"{rows.path.name}: left out all columns but x y z, for many of them hold text in some rows."]
    return [], _load(rows, places), notices


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


def load_whole(rows: Rows, index: int) -> tuple[Ints | None, bool]:
    """Read a column of whole numbers that are too large for doubles.

    Returns
    -------
    ndarray, (n,), or None
        None if they are not whole numbers, or too large for 64 bits.
    bool
        Whether they are whole numbers but for missing ones, so that doubles lose digits.
    """
    texts = _load(rows, [index], f"U{_DIGITS}")[:, 0]
    for kind in (np.int64, np.uint64):
        try:
            return texts.astype(kind), False
        except (ValueError, OverflowError):
            continue
    return None, bool(np.char.isdecimal(np.char.lstrip(texts[texts != "nan"], "+-")).all())


def _load(rows: Rows, columns: list[int], dtype: str = "f8") -> Array:
    """Load columns by numpy."""
    clean = partial(_filled, columns=columns) if rows.filled else _plain
    lines = chain.from_iterable(clean(block, rows.delimiter) for block in _blocks(rows))
    return np.loadtxt(lines, dtype=dtype, delimiter=rows.delimiter, usecols=columns, ndmin=2)


def _blocks(rows: Rows) -> Iterator[list[str]]:
    """Yield the blocks of lines from the first row on."""
    left = rows.first
    for lines in rows.blocks():
        if left < len(lines):
            yield lines[left:] if left else lines
        left = max(left - len(lines), 0)


def _plain(lines: list[str], delimiter: str | None) -> list[str]:
    """Return lines as numpy reads them: comments by # only, decimal points, and no quotes."""
    if delimiter is not None and any(map(str.isspace, lines)):
        lines = ["" if line.isspace() else line for line in lines]
    given = "\n".join(lines)
    text = _unmarked(given)
    slashes, commas, quotes = "//" in text, delimiter != "," and "," in text, '"' in text
    if not (slashes or commas or quotes) and text is given:
        return lines
    text = _unquoted(text, delimiter)
    if slashes:
        text = re.sub("//.*", "", text)
    return (text.replace(",", ".") if commas else text).split("\n")


def _filled(lines: list[str], delimiter: str | None, columns: list[int]) -> list[str]:
    """Return lines as numpy reads them, with NaN for cells without a number."""
    text = "\n".join(_plain([line.replace("#N/A", "") for line in lines], delimiter))
    text = re.sub("#.*", "", text)
    if delimiter is None:
        return re.sub(rf"(?i)(?<!\S){_MISSING}(?!\S)", "nan", text).split("\n")
    last, least = max(columns), max(columns[:3])  # rows may end after the coordinates
    lines = [
        line + delimiter * (last - line.count(delimiter)) if line.count(delimiter) >= least else line
        for line in text.split("\n")
        if line.strip(delimiter + " ")
    ]
    mark = re.escape(delimiter)
    gap = rf"(?im)(^|{mark}) *{_MISSING}? *(?={mark}|$)"
    return re.sub(gap, r"\1nan", "\n".join(lines)).split("\n") if lines else []


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
            elif not _IS_MISSING.fullmatch(word):
                if not is_number(word):
                    faults[index] = f"line {number} has {brief(word)!r} where a number should be"
            elif not rows.filled and not is_number(word):
                faults[index] = ""
        if faults:
            return faults
    return {}


def _without_empty(
    rows: Rows, values: Floats, places: list[int], others: list[int], name: Callable[[int], str], notices: list[str]
) -> tuple[list[int], Floats, list[str]]:
    """Leave out columns without any number, and report how many cells of which others have none."""
    if not rows.filled:
        return others, values, notices
    missing = np.isnan(values).sum(axis=0)
    kept = (missing < len(values)) | (np.arange(len(missing)) < len(places))
    names = list(map(name, [*places, *others]))
    empty = [label for label, there in zip(names, kept, strict=True) if not there]
    gaps = [f"{n} of {label}" for label, n, there in zip(names, missing, kept, strict=True) if n and there]
    if empty:
        notices.append(f"{rows.path.name}: left out {brief(', '.join(empty))}, which has no numbers.")
    if gaps:
        notices.append(f"{rows.path.name}: cells without a number are NaN: {brief(', '.join(gaps))}.")
    return [index for index, there in zip(others, kept[len(places) :], strict=True) if there], values[:, kept], notices
