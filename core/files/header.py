"""The names of the columns of a text, from the lines before its rows."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence

from .cells import Rows, is_comment
from .lines import is_number
from .names import find_places, is_known, is_other, is_place

_MARKS = "#/%! "
_MOST_DIGITS = 15  # of a number of a point


def find_names(rows: Rows, numeric: list[int]) -> list[str | None]:
    """Find the names of the columns in the lines before the first row.

    Parameters
    ----------
    rows : Rows
    numeric : list of int
        Indices of the columns that hold numbers.

    Returns
    -------
    list of str or None
        None for those without a name; fewer than there are columns if a list of any length follows; empty if no line
        names them.
    """
    usual: list[str | None] = []
    for line in reversed(rows.before):
        for words in _split(line, rows.delimiter):
            names = _fit(words, is_comment(line), rows, numeric)
            found = find_places(names, numeric) if names else None
            if found and found.sure:
                return names
            usual = usual or names
    return usual


def _split(line: str, delimiter: str | None, least: int = 3) -> Iterator[list[str]]:
    """Yield the words of a line that may be names, so many at least, by all possible delimiters."""
    body = _unmarked(line.strip(" \r\n").lstrip(_MARKS) if is_comment(line) else line.strip(" \r\n"))
    bodies = [body.partition(":")[2], body] if is_comment(line) and ":" in body else [body]
    for text in bodies:
        for separator in dict.fromkeys((delimiter or ",", ",", ";", "\t", "|", None)):
            parts = text.split(separator) if separator else _closed(text).split()
            names = [name.strip().strip("\"'").strip() for name in parts]
            if len(names) >= least:
                yield names


def _unmarked(text: str) -> str:
    """Return text without a mark of comments before it: any that does not occur again, as delimiters do."""
    mark = re.match(r"(rem\s|[^\w\s\"',|]+)\s*", text, re.IGNORECASE)
    return text[mark.end() :] if mark and text.count(mark[1]) == 1 else text


def names_places(line: str, delimiter: str | None) -> bool:
    """Whether a line names two coordinates or more."""
    return any(sum(map(is_place, names)) > 1 for names in _split(line, delimiter, least=2))


def _closed(text: str) -> str:
    """Return text with brackets joined to the words before them, so that white space separates names only."""
    return re.sub(r"\s*([\[(])([^\])]*)", lambda match: match[1] + "_".join(match[2].split()), text)


def _fit(names: list[str], marked: bool, rows: Rows, numeric: list[int]) -> list[str | None]:
    """Return names of columns if they can be those of the rows; otherwise none."""
    if any(map(is_number, names)):
        return []
    width, full = rows.width, len(names)
    lists = next((index for index, name in enumerate(names) if "[]" in name), None)  # of any length, at the end
    names = names[:lists]
    while len(names) > width and not names[-1]:
        names, full = names[:-1], full - 1
    known = [name for name in names if name and is_known(name)]
    if full == width and lists is None:
        return _distinct(names) if known or not marked else []
    if marked and lists is None and len(known) < len(names):
        return []
    nameless = len(names) == width - 1 and not is_other(names[0])
    fitted: list[str | None] = [*names]
    if nameless and (0 not in numeric or counts(rows)):  # R gives no name to those of rows
        fitted = [None, *names]
    if lists is None:
        fitted = [*fitted[:width], *[None] * (width - len(fitted))]
    found = find_places(fitted, numeric)
    return _distinct(fitted) if found and found.sure else []


def counts(rows: Rows, index: int = 0) -> bool:
    """Whether a column counts the rows."""
    words = [row[index] for row in rows.sample if index < len(row)]
    if len(words) < 3 or not all(word.isdecimal() and word.isascii() and len(word) <= _MOST_DIGITS for word in words):
        return False
    first = int(words[0])
    return [int(word) for word in words] == [*range(first, first + len(words))]


def unnamed(index: int) -> str:
    """Return the name of a column without one, by its number in the file."""
    return f"column_{index + 1}"


def _distinct(names: Sequence[str | None]) -> list[str | None]:
    """Number repeated names."""
    seen: Counter[str | None] = Counter()
    result: list[str | None] = []
    for index, name in enumerate(names):
        name = unnamed(index) if name == "" else name
        seen[name] += 1
        result.append(f"{name}_{seen[name]}" if name and seen[name] > 1 else name)
    return result
