"""Rows of text to columns of numbers: what separates them, quotes, decimal commas, and cells without a number."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import TypeAlias

from ..errors import InvalidPointsError
from .lines import is_number

Blocks: TypeAlias = Callable[[], Iterator[list[str]]]

_DELIMITERS = (";", "\t", "|", None, ",")  # in this order; None is white space
_HEADER = 20  # lines that are no comments before the first point at most
_SAMPLE = 100  # rows by which kinds of columns are decided
_MISSING = r"(?:n/?a|nan|null|none|nil|no ?data|-|--|\?|\*)"
_IS_MISSING = re.compile(f"{_MISSING}?", re.IGNORECASE)
_COMMENTS = ("#", "//", "%", "!")


@dataclass
class Rows:
    """The rows of a file of text."""

    blocks: Blocks  # returns an iterator of lists of the lines of the file at each call; see `read_blocks`
    path: Path
    first: int  # how many lines precede the first row
    delimiter: str | None  # None is white space
    before: list[str]  # the last lines before the first row that are not empty
    sample: list[list[str]] = field(default_factory=list)  # the words of the first rows
    filled: bool = False  # whether cells without a number are read as NaN

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

    Where there is none, or too many lines precede it, `InvalidPointsError` is raised.
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
    return any(map(is_number, words)) and all(is_number(word) or is_missing(word) for word in words)


def split_row(line: str, delimiter: str | None) -> list[str]:
    """Split a line without its comment, with decimal points; no words if the delimiter does not fit."""
    line = _unquoted(line.replace("#N/A", ""), delimiter).split("#")[0].split("//")[0].strip(" ")
    if delimiter is None and re.search(r"\s,|,\s|,$", line):
        return []
    if delimiter != ",":
        line = line.replace(",", ".")
    return [word.strip() for word in line.split(delimiter)]


def _unquoted(text: str, delimiter: str | None) -> str:
    """Return text without quotes, and the delimiters inside them replaced: a decimal comma by a point."""
    if '"' not in text:
        return text
    inside = "." if delimiter == "," else "_"
    return re.sub(r'"([^"\n]*)"', lambda match: match[1].replace(delimiter or " ", inside), text)


def is_missing(word: str) -> bool:
    """Whether a word stands for no number."""
    return bool(_IS_MISSING.fullmatch(word))


def kinds(rows: Rows) -> tuple[list[int], list[int], list[int]]:
    """Return the indices of the columns that hold numbers, text, or nothing, in most rows of the sample."""
    numeric: list[int] = []
    textual: list[int] = []
    empty: list[int] = []
    for index in range(rows.width):
        words = [row[index] for row in rows.sample if index < len(row)]
        there = [word for word in words if not is_missing(word)]
        if 2 * sum(map(is_number, there)) >= len(there) and any(map(is_number, words)):
            numeric.append(index)
        else:
            (textual if there else empty).append(index)
    return numeric, textual, empty


def clean_lines(rows: Rows, columns: list[int]) -> Iterator[str]:
    """Yield the lines from the first row on as numpy reads them, for some columns; empty ones and comments among them.

    Where cells without a number are read as NaN, they are that.
    """
    clean = partial(_filled, columns=columns) if rows.filled else _plain
    return chain.from_iterable(clean(block, rows.delimiter) for block in _blocks(rows))


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
    text = "\n".join(lines)
    slashes, commas, quotes = "//" in text, delimiter != "," and "," in text, '"' in text
    if not (slashes or commas or quotes):
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
