"""Points one after another, as many as a header names: rows of text, or records of bytes."""

import os
from collections.abc import Iterator, Sequence
from itertools import accumulate, chain, groupby, islice
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..errors import InvalidPointsError
from ..types import Array, Floats, Ints
from .lines import brief, is_number, read_blocks

_LONG = ("i8", "u8")
_EXACT = 2.0**53  # beyond this, doubles are no longer all whole numbers
_RATIO = 100  # of unpacked to packed bytes; files of points have 1 to 20 ...
_HARMLESS = 64e6  # ... or fewer bytes than this


def read_records(file: BinaryIO, begin: int, record: np.dtype[Any], count: int, path: Path) -> Array:
    """Read so many records, as the header names, that begin at a place in an open file.

    A shorter file is refused before there is memory for them; its name is for the texts of errors.
    """
    return next(record_blocks(file, begin, record, count, path, max(count, 1)), np.empty(0, record))


def record_blocks(
    file: BinaryIO, begin: int, record: np.dtype[Any], count: int, path: Path, size: int
) -> Iterator[Array]:
    """Yield records as of `read_records`, so many at once."""
    found = max(os.fstat(file.fileno()).st_size - begin, 0) // max(record.itemsize, 1)
    if found < count:
        raise too_short(path, found, count)
    file.seek(begin)
    for done in range(0, count, size):
        yield np.fromfile(file, record, min(size, count - done))


def read_rows(
    file: BinaryIO,
    types: Sequence[str | None],
    count: int,
    path: Path,
    skipped: int = 0,
    notices: list[str] | None = None,
) -> list[Array]:
    """Read the columns of the rows of text from here on, each of one line, or of several as librealsense writes them.

    Parameters
    ----------
    file : file object
        Of bytes.
    types : list of str or None
        numpy's code of each column, as the header names it; None for a list of numbers, which is skipped.
    count : int
        How many rows the header names.
    path : pathlib.Path
        The file, for the texts of errors.
    skipped : int
        How many rows stand before them.
    notices : list of str, optional
        Where they are the last ones: gets whether more lines follow.

    Returns
    -------
    list of ndarray, (n,)
        The columns that are no lists.
    """
    begin, codes = file.tell(), [code for code in types if code is not None]
    further: list[str] = []

    def filled() -> Iterator[str]:
        """Yield the lines from the first point on, and those of whatever follows."""
        with open(path, encoding="ascii", errors="replace") as text:
            text.seek(begin)
            yield from islice(filter(str.strip, chain.from_iterable(read_blocks(text, path))), skipped, None)

    width = 1 if None in types else _lines_of_row(filled(), len(types))

    def rows() -> Iterator[str]:
        """Yield a line for each point; there may be fewer than the header names."""
        lines = filled()
        points = islice(lines, count * width)
        if None in types:
            yield from _without_lists(points, types, path)
        else:
            yield from points if width == 1 else map(" ".join, zip(*[points] * width, strict=False))
        further[:] = islice(lines, 1)

    lines = rows()
    line = next(lines, None)
    if line is None:
        values = np.empty((0, len(codes)))
    else:
        try:
            values = np.loadtxt(chain([line], lines), ndmin=2, comments=None)
        except ValueError:
            _refuse_row(rows(), len(codes), path)
            raise
    if values.shape[1] != len(codes):
        _refuse_row(rows(), len(codes), path)
    if len(values) < count:
        raise too_short(path, len(values), count)
    if notices is not None and further:
        notices.append(
            f"{path.name}: left out all lines after those of the {count} points that its header names, from"
            f" {brief(repr(further[0].strip()))} on. If these are points, too, correct their number in the header."
        )
    return [
        _load_whole(rows(), index, code) if _is_long(column, code) else _typed(column, code)
        for index, (column, code) in enumerate(zip(values.T, codes, strict=True))
    ]


def _lines_of_row(lines: Iterator[str], width: int) -> int:
    """Return how many lines hold so many numbers; one where they do not end with a line."""
    ends = accumulate(len(line.split()) for line in lines)
    return next((number if end == width else 1 for number, end in enumerate(ends, start=1) if end >= width), 1)


def _without_lists(lines: Iterator[str], types: Sequence[str | None], path: Path) -> Iterator[str]:
    """Yield lines without their lists: each is a number of numbers, and these."""
    steps = [(len([*run]), is_list) for is_list, run in groupby(code is None for code in types)]
    for number, line in enumerate(lines, start=1):
        words, kept, place = line.split(), [], 0
        for length, is_list in steps:
            if not is_list:
                kept += words[place : place + length]
                place += length
                continue
            for _ in range(length):
                word = words[place] if place < len(words) else ""
                place += 1 + int(word) if word.isdigit() else len(words) + 1
        if place != len(words):
            raise InvalidPointsError(
                f"{path}, point {number}: {len(words)} numbers, which are not those of its properties and lists."
                " Correct the file."
            )
        yield " ".join(kept)


def _is_long(column: Floats, code: str) -> bool:
    """Whether a column has whole numbers of 8 bytes whose last digits doubles would lose."""
    if code not in _LONG or not len(column):
        return False
    limits = np.iinfo(code)
    return float(limits.min) <= column.min() and _EXACT <= np.abs(column).max() < float(limits.max)


def _load_whole(lines: Iterator[str], index: int, code: str) -> Ints:
    """Read a column of whole numbers as such."""
    return np.loadtxt(lines, code, usecols=index, ndmin=1, comments=None)


def _typed(column: Floats, code: str) -> Array:
    """Convert numbers of text to the type that the header names, unless that would lose digits of the text.

    It may hold more digits than the float of the header, and numbers that are not whole, or too large.
    """
    if code[0] != "f" and len(column):
        limits = np.iinfo(code)
        fits = limits.min <= column.min() and column.max() <= limits.max  # neither is NaN
        if fits and (column == np.rint(column)).all():
            return column.astype(code)
    return column.astype("f8")


def unpacks_too_far(unpacked: float, packed: float) -> bool:
    """Whether data would unpack to more bytes than those of points ever do, as in files made to exhaust the memory."""
    return unpacked > max(_RATIO * packed, _HARMLESS)


def too_short(path: Path, found: int, count: int) -> InvalidPointsError:
    """Return the error of a file with fewer points than its header names."""
    return InvalidPointsError(
        f"{path} ends after {found} of the {count} points that its header names. Copy or save it again."
    )


def _refuse_row(lines: Iterator[str], width: int, path: Path) -> None:
    """Report which of some lines does not hold so many numbers."""
    for number, line in enumerate(lines, start=1):
        words = line.split()
        odd = next((word for word in words if not is_number(word)), None)
        if len(words) != width:
            wrong = f"{len(words)} numbers where the header names {width} properties"
        elif odd is not None:
            wrong = f"could not convert string to float: {brief(odd)!r}"
        else:
            continue
        raise InvalidPointsError(f"{path}, point {number}: {wrong}. Correct the file.")
