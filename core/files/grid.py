"""Grids of heights as text, ESRI ASCII and DSAA of Surfer: each height is a point at the place of its cell."""

from collections.abc import Iterator
from functools import partial
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..errors import InvalidPointsError
from ..types import Array, Floats
from .lines import brief, is_number
from .table import FARTHEST, PointTable

_HEAD = 20  # lines that may come before the heights
_LONGEST = 1000  # characters of these, and of a height
_BLOCK = 2**16  # characters that are read at once
_USUAL = -9999.0  # height of cells without data, where an ESRI grid does not name it
_BINARY = {b"DSBB": "Surfer", b"DSRB": "Surfer", b"CDF\x01": "NetCDF", b"CDF\x02": "NetCDF", b"\x89HDF": "NetCDF"}


class Grid(NamedTuple):
    """What the header of a grid states."""

    columns: int
    rows: int
    # The place x y of the first height, and from there to that of the next column and row
    start: tuple[float, float]
    step: tuple[float, float]
    missing: float  # the height of cells without data
    head: int  # how many lines come before the heights
    where: str  # what the places are, in words


def find_grid(path: Path) -> Grid | None:
    """Return what the header of a grid states; None for other files.

    A binary grid, or an incomplete header, raises `InvalidPointsError`.
    """
    with open(path, "rb") as binary:
        kind = _BINARY.get(binary.read(4))
    if kind is not None:
        raise InvalidPointsError(
            f"{path} is a binary grid of heights, as {kind} writes them, which is not read. Save it as text: as an ESRI"
            " ASCII grid (.asc), or DSAA of Surfer (.grd)."
        )
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        lines = [line.replace(",", ".").split() for line in islice(iter(partial(file.readline, _LONGEST), ""), _HEAD)]
    if lines[:1] == [["DSAA"]]:
        return _surfer(lines[1:5], path)
    head = next((index for index, words in enumerate(lines) if words and is_number(words[0])), len(lines))
    named = {words[0].lower(): words[1] for words in lines[:head] if len(words) == 2}
    return _esri(named, head, path) if {"ncols", "nrows"} <= named.keys() else None


def _esri(named: dict[str, str], head: int, path: Path) -> Grid:
    """Return a grid by the names of its header; the first row is that farthest north."""

    def number(*names: str) -> float:
        found = next((named[name] for name in names if name in named), None)
        if found is None or not is_number(found) or not np.isfinite(float(found)):
            raise InvalidPointsError(f"{path} is an ESRI ASCII grid without a number {' or '.join(names)}. Add it.")
        return float(found)

    columns, rows = _counts(named["ncols"], named["nrows"], path)
    dx, dy = number("dx", "cellsize"), number("dy", "cellsize")
    x = number("xllcorner", "xllcenter") + (0.0 if "xllcorner" not in named else 0.5 * dx)
    y = number("yllcorner", "yllcenter") + (0.0 if "yllcorner" not in named else 0.5 * dy)
    missing = float(named.get("nodata_value", _USUAL))
    return Grid(columns, rows, (x, y + (rows - 1) * dy), (dx, -dy), missing, head, "the center of its cell")


def _surfer(lines: list[list[str]], path: Path) -> Grid:
    """Return a grid by the four lines after its mark; the first row is that farthest south."""
    if [len(words) for words in lines] != [2, 2, 2, 2] or not all(is_number(word) for words in lines for word in words):
        raise InvalidPointsError(
            f"{path} is a grid of Surfer (DSAA) whose lines 2 to 5 are not its counts and the ranges of x, y and z, two"
            " numbers each. Save it again."
        )
    columns, rows = _counts(lines[0][0], lines[0][1], path)
    (west, east), (south, north) = (tuple(map(float, words)) for words in lines[1:3])
    step = ((east - west) / max(columns - 1, 1), (north - south) / max(rows - 1, 1))
    return Grid(columns, rows, (west, south), step, np.inf, 5, "its node")


def _counts(columns: str, rows: str, path: Path) -> tuple[int, int]:
    for word in (columns, rows):
        if not (word.isdecimal() and word.isascii() and 0 < len(word) < _HEAD and int(word)):
            raise InvalidPointsError(
                f"{path} is a grid of {brief(columns)} columns and {brief(rows)} rows. Save it again."
            )
    return int(columns), int(rows)


def grid_pieces(
    path: Path, grid: Grid, size: int | None, notices: list[str]
) -> Iterator[tuple[PointTable, dict[str, Array]]]:
    """Yield the cells that have data as points, all at once or with a size in pieces, with no further columns.

    Pieces are those in which the text is read. At the end notices get what was read, and how many cells have no data.
    """
    pieces = _points(path, grid, notices)
    if size is None:
        yield PointTable(np.concatenate([np.empty((0, 3)), *pieces])), {}
    else:
        yield from ((PointTable(points), {}) for points in pieces)


def _points(path: Path, grid: Grid, notices: list[str]) -> Iterator[Floats]:
    """Yield the points of cells with data, (k, 3)."""
    count, done, missed = grid.columns * grid.rows, 0, 0
    for heights in _heights(path, grid.head):
        if done + len(heights) > count:
            raise InvalidPointsError(
                f"{path} has more heights than those of its {grid.columns} columns and {grid.rows} rows. Save it again."
            )
        row, column = np.divmod(np.arange(done, done + len(heights)), grid.columns)
        there = (heights != grid.missing) & (np.abs(heights) <= FARTHEST)  # not NaN, nor the largest number as Surfer's
        places = (grid.start[0] + grid.step[0] * column, grid.start[1] + grid.step[1] * row, heights)
        yield np.stack(places, axis=1)[there]
        done += len(heights)
        missed += int(np.count_nonzero(~there))
    if done < count:
        raise InvalidPointsError(f"{path} ends after {done:,} of its {count:,} heights. Copy or save it again.")
    without = f"; left out {missed:,} without data" if missed else ""
    size = f"{grid.columns} x {grid.rows}"
    notices.append(f"{path.name}: is a grid of {size} heights, each read as a point at {grid.where}{without}.")


def _heights(path: Path, head: int) -> Iterator[Floats]:
    """Yield the numbers after so many lines, (k,); rows may be longer than any line of points, or be divided."""
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        for _ in range(head):
            file.readline(_LONGEST)
        begun = ""
        while block := file.read(_BLOCK):
            text = begun + block
            words = text.replace(",", ".").split()
            begun = words.pop() if words and not text[-1].isspace() else ""
            if len(begun) > _LONGEST:
                raise InvalidPointsError(f"{path} has text among its heights. Save it again.")
            yield np.array(words, np.float64)
        yield np.array(begun.split(), np.float64)
