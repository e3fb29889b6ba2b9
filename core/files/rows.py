"""Points one after another, as many as a header names: rows of text, or records of bytes."""

import os
from itertools import chain, islice

import numpy as np

from ..errors import InvalidPointsError
from .lines import brief, is_number, read_blocks


def read_records(file, begin, record, count, path):
    """Read records that begin at a place in an open file.

    Parameters
    ----------
    file : file object
    begin : int
    record : numpy.dtype
    count : int
        How many the header names; a shorter file is refused before there is memory for them.
    path : pathlib.Path
        The file, for the texts of errors.
    """
    found = max(os.fstat(file.fileno()).st_size - begin, 0) // max(record.itemsize, 1)
    if found < count:
        raise too_short(path, found, count)
    file.seek(begin)
    return np.fromfile(file, record, count)


def read_rows(file, types, count, path, skipped=0) -> list:
    """Read the columns of the rows of text from here on.

    Parameters
    ----------
    file : file object
        Of bytes.
    types : list of str
        numpy's code of each column, as the header names it.
    count : int
        How many rows the header names.
    path : pathlib.Path
        The file, for the texts of errors.
    skipped : int
        How many rows stand before them.
    """
    begin, width = file.tell(), len(types)

    def rows():
        """Return the lines of the points from the first on; there may be fewer than the header names."""
        file.seek(begin)
        filled = filter(bytes.strip, chain.from_iterable(read_blocks(file, path)))
        return islice(filled, skipped, skipped + count)

    lines = rows()
    line = next(lines, None)
    if line is None:
        values = np.empty((0, width))
    else:
        try:
            values = np.loadtxt(chain([line], lines), ndmin=2, comments=None, encoding="ascii")
        except ValueError:
            _refuse_row(rows(), width, path)
            raise
    if values.shape[1] != width:
        _refuse_row(rows(), width, path)
    if len(values) < count:
        raise too_short(path, len(values), count)
    return [_typed(column, code) for column, code in zip(values.T, types, strict=True)]


def _typed(column, code):
    """Give numbers of text the type that the header names, unless that would lose what the text holds.

    It may hold more digits than the float of the header, and numbers that are no whole ones, or too large.
    """
    if code[0] != "f" and len(column):
        limits = np.iinfo(code)
        if limits.min <= column.min() and column.max() <= limits.max:  # neither is NaN
            return column.astype(code)
    return column.astype("f8")


def too_short(path, found, count):
    """Return the error of a file with fewer points than its header names."""
    return InvalidPointsError(
        f"{path} ends after {found} of the {count} points that its header names. Copy or save it again."
    )


def _refuse_row(lines, width, path):
    """Say which of some lines does not hold so many numbers."""
    for number, line in enumerate(lines, start=1):
        words = line.decode("ascii", errors="replace").split()
        odd = next((word for word in words if not is_number(word)), None)
        if len(words) != width:
            wrong = f"{len(words)} numbers where the header names {width} properties"
        elif odd is not None:
            wrong = f"could not convert string to float: {brief(odd)!r}"
        else:
            continue
        raise InvalidPointsError(f"{path}, point {number}: {wrong}. Correct the file.")
