"""What is known of columns before they are written, piece by piece: types, ranges, and how many numbers there are."""

from collections.abc import Callable, Iterable
from typing import NamedTuple, TypeAlias

import numpy as np

from ..errors import InvalidPointsError
from ..types import Array

Columns: TypeAlias = dict[str, Array]  # (n,) each, by the names of files
ColumnPieces: TypeAlias = Callable[[], Iterable[Columns]]  # the same each time: files need two looks at them


class Range(NamedTuple):
    """The numbers of a column in all pieces."""

    dtype: np.dtype[np.generic]  # a type that holds all
    # The least and the greatest; zero without any
    low: float
    high: float
    whole: bool  # whether all are whole numbers


def ranges_of(pieces: ColumnPieces) -> tuple[int, dict[str, Range]]:
    """Return how many rows pieces have together, and the range of each column.

    Pieces of different columns raise `InvalidPointsError`.
    """
    count, found = 0, dict[str, Range]()
    for columns in pieces():
        own = {name: _range(values) for name, values in columns.items()}
        if found and found.keys() != own.keys():
            raise InvalidPointsError(
                f"Pieces of different columns cannot be one file: {', '.join(sorted(found.keys() ^ own.keys()))} are"
                " in some only. Give all the same."
            )
        rows = len(next(iter(columns.values())))
        if rows and count:
            own = {name: _joined(first, own[name]) for name, first in found.items()}
        found = own if rows or not count else found
        count += rows
    return count, found


def _range(values: Array) -> Range:
    if not len(values):
        return Range(values.dtype, 0, 0, True)
    whole = values.dtype.kind in "biu" or bool(np.all(values == np.rint(values)))
    return Range(values.dtype, values.min().item(), values.max().item(), whole)


def _joined(first: Range, second: Range) -> Range:
    low = second.low if second.low < first.low or second.low != second.low else first.low  # NaN, if there is one
    high = second.high if second.high > first.high or second.high != second.high else first.high
    return Range(np.promote_types(first.dtype, second.dtype), low, high, first.whole and second.whole)
