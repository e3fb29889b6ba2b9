"""Which columns of a text are x y z, and which others are read by which names."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from ..errors import InvalidPointsError
from .cells import Rows, is_numeric, kinds, split_row
from .header import counts, find_names, names_places, unnamed
from .lines import brief, is_number
from .names import Places, find_places, is_other

_SKIPPED, _REST = "-", "..."  # among names that a user gives
_GIVE = "If that is wrong, give the names of all columns by columns"
_MOST_DIGITS = 15  # of a number of points
_UNIT = 1.02  # to which numbers of unit vectors, rounded to a few digits, go


class Layout(NamedTuple):
    """The columns of a text."""

    names: Sequence[str | None]  # None for columns without a name
    places: list[int]  # indices of x y z
    others: list[int]  # indices of other columns that are read
    notices: list[str]
    announced: int | None = None  # how many points the line before them announces
    degrees: bool = False  # whether x and y are angles
    # Names of all columns that have none, unless they hold normals; empty where no such names are known
    usual: Sequence[str] = ()

    def label(self, index: int) -> str:
        """Return the name of a column, or one by its number in the file."""
        return self.names[index] or unnamed(index)


def given_layout(columns: str, rows: Rows) -> Layout:
    """Return the layout that a user gives.

    Parameters
    ----------
    columns : str
        Names in the order of the file, separated by white space or commas; "-" for a column to leave out, "..." at the
        end for all that follow.
    rows : Rows

    Raises
    ------
    InvalidPointsError
        x, y or z is missing, a name comes twice, or the file has another number of columns.
    """
    words = columns.replace(",", " ").split()
    complete = words[-1] != _REST
    names = [None if word == _SKIPPED else word for word in words[: len(words) - (not complete)]]
    lower = [name and name.lower() for name in names]
    missing = [axis for axis in "xyz" if axis not in lower]
    twice = [name for name in lower if name and lower.count(name) > 1]
    if missing or twice:
        problem = f"do not name {' '.join(missing)}" if missing else f"name {twice[0]} more than once"
        raise InvalidPointsError(f"{rows.path}: the columns {brief(columns)!r} {problem}. Name x y z once each.")
    width = len(rows.sample[0])
    if len(names) > width or (len(names) < width and complete):
        raise InvalidPointsError(
            f"{rows.path}: {len(names)} columns are named, but its first point has {width}. Write {_SKIPPED} for a"
            f" column to leave out, and {_REST} at the end for all that follow."
        )
    numeric, textual, empty = kinds(rows)
    places = [lower.index(axis) for axis in "xyz"]
    others = [index for index in (*numeric, *empty) if index < len(names) and names[index] and index not in places]
    texts = [name for index, name in enumerate(names) if name and index in textual and index not in places]
    return Layout(names, places, others, _text_notices(texts, rows.path))


def find_layout(rows: Rows, usual: dict[int, tuple[str, ...]]) -> Layout:
    """Find the layout of a text by its names, or by the values of columns.

    `usual` has names for numbers of columns, where the text has none: colors may be normals instead. Names by which no
    three columns are coordinates raise `InvalidPointsError`.
    """
    numeric, textual, empty = kinds(rows)
    names = find_names(rows, numeric)
    found = find_places(names, numeric) if names else None
    if found and not found.sure:  # a column that counts the points is no coordinate
        found = find_places(names, [index for index in numeric if not counts(rows, index)]) or found
    notices = []
    doubtful: Sequence[str] = ()
    if found:
        places = found.indices
        notices += _place_notices(found, names, rows.path)
    else:
        if names:
            _refuse_others(names, rows.path)
        given = usual.get(rows.width, ())
        doubtful = given if "r" in given and _are_short(rows) else ()
        names = [None] * rows.width if doubtful or not given else [*given]
        places = _first_places(rows, numeric)
    shortest = min(map(len, rows.sample))
    read = [index for index in numeric if index < len(names) and (names[index] or index < shortest)]
    sparse = [index for index in empty if index < len(names) and names[index] not in (None, unnamed(index))]
    others = [index for index in sorted(read + sparse) if index not in places]
    layout = Layout(names, places, others, notices, _announced(rows), bool(found and found.degrees), doubtful)
    notices += _text_notices([layout.label(index) for index in textual if index < len(names)], rows.path)
    if len(read) < len(numeric):
        notices.append(
            f"{rows.path.name}: left out {len(numeric) - len(read)} columns or more at the end, which have no names."
        )
    skipped = [
        line.strip()
        for line in rows.before
        if _is_odd_row(line, rows.delimiter) or (not any(names) and names_places(line, rows.delimiter))
    ]
    if skipped:
        notices.append(f"{rows.path.name}: skipped {brief(repr(skipped[0]))}, before the first point.")
    if rows.sample[0] == [str(index) for index in range(rows.width)] and not any(names):
        notices.append(
            f"{rows.path.name}: its first row, {' '.join(rows.sample[0])}, is read as a point. If it numbers the"
            " columns, delete it from the file."
        )
    return layout


def _is_odd_row(line: str, delimiter: str | None) -> bool:
    """Whether a line before the first point holds numbers, but is neither a point nor their number."""
    words = split_row(line, delimiter)
    return len(words) > 1 and is_numeric(words)


def _place_notices(found: Places, names: Sequence[str | None], path: Path) -> list[str]:
    """Report which columns are x y z, unless those are their names."""
    used = brief(", ".join(names[index] or "" for index in found.indices))
    if not found.sure:
        return [f"{path.name}: no names identify x y z. Used {used}. {_GIVE}."]
    return [] if found.plain else [f"{path.name}: used {used} for x y z."]


def _refuse_others(names: Sequence[str | None], path: Path) -> None:
    """Refuse a file with names of other columns than coordinates; a title has none of them."""
    given = [name for name in names if name]
    if any(map(is_other, given)):
        raise InvalidPointsError(
            f"{path} has no x y z among its columns {brief(', '.join(given))}. Give the names of all columns by"
            " columns, with x y z among them."
        )


def _are_short(rows: Rows) -> bool:
    """Whether the last three numbers of the first rows may be those of a unit vector."""
    words = [word for row in rows.sample for word in row[-3:]]
    return all(abs(float(word)) < _UNIT for word in words if is_number(word))


def _first_places(rows: Rows, numeric: list[int]) -> list[int]:
    """Return the first three columns of numbers, without a first one that counts the points."""
    counted = len(numeric) > 3 and counts(rows, numeric[0]) and not counts(rows, numeric[1])
    return numeric[1:4] if counted else numeric[:3]


def _text_notices(texts: Sequence[str], path: Path) -> list[str]:
    """Report columns of text."""
    return [f"{path.name}: left out {brief(', '.join(texts))}, which holds text."] if texts else []


def _announced(rows: Rows) -> int | None:
    """Return the number of points that the last line before them announces, if it does."""
    word = rows.before[-1].strip().lstrip("#/%! ") if rows.before else ""
    return int(word) if word.isdecimal() and len(word) <= _MOST_DIGITS else None
