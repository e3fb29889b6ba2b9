"""Columns of numbers as text: XYZ, CSV, PTS, and the vertices of OBJ files."""

import re
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import TypeAlias

import numpy as np

from ..errors import InvalidPointsError
from ..types import Array
from .cells import Blocks, Rows, find_rows
from .digits import shortest
from .grid import find_grid, grid_pieces
from .guess import Guess, are_triangles
from .layout import Layout, find_layout, given_layout
from .lines import is_number, read_text
from .loading import Loaded, load
from .names import standard_names
from .ptx import holds_ptx, read_ptx
from .ranges import ColumnPieces, Range, ranges_of
from .table import AXES, PointTable, color_by, gather_columns

Pieces: TypeAlias = Iterator[tuple[PointTable, dict[str, Array]]]

_BLOCK = 10_000  # lines that are written at once
_SAMPLE = 100  # vertices by which their columns are decided
_TRIANGLES = 100_000  # lines that may be triangles, which are looked at
_MOST_DIGITS = 15  # of a number of points; no file has so many
_SKIPPED = ("#", "//")  # prefixes of lines that may be of any length
_SCAN_NAMES = {  # of the columns of PTS files
    4: ("x", "y", "z", "intensity"),
    6: ("x", "y", "z", "r", "g", "b"),
    7: ("x", "y", "z", "intensity", "r", "g", "b"),
}


def read_columns(path: Path, columns: str = "") -> PointTable:
    """Read a text file with a point a line.

    Columns are separated by semicolons, tabs, bars, white space or commas; beside commas, numbers have decimal points,
    otherwise points or commas. A line before the first point, marked as a comment or not, may name the columns; without
    names the first three are x y z, and others colors or normals if they look like them. Names may be given, as of
    `given_layout`. Grids of heights, and a PTX file by another name, are read as such.
    """
    return _whole(column_pieces, path, columns)


def read_scan(path: Path, columns: str = "") -> PointTable:
    """Read a PTS file: scans one after another, each begins with the number of its points; columns as above."""
    return _whole(scan_pieces, path, columns)


def _whole(pieces: Callable[..., Pieces | None], path: Path, columns: str) -> PointTable:
    """Return the one piece that a whole file is."""
    notices: list[str] = []
    found = pieces(path, None, notices, columns)
    return read_ptx(path) if found is None else _colored(found, path, notices)


def _colored(pieces: Pieces, path: Path, notices: list[str]) -> PointTable:
    [(table, channels)] = pieces
    color_by(table, channels, path)
    table.notices += notices
    return table


def column_pieces(path: Path, size: int | None, notices: list[str], columns: str = "") -> Pieces | None:
    """Yield the points of a text file, so many at once or without a size all, as `gather_columns` makes them.

    What the columns are is decided by all rows, which are read for that first, unless they are named as of
    `read_columns`; notices get what is guessed and left out. Return None where the file is a PTX file; see
    `ptx_pieces`.
    """
    return _pieces(partial(read_text, path, _SKIPPED), path, size, notices, columns, {})


def scan_pieces(path: Path, size: int | None, notices: list[str], columns: str = "") -> Pieces | None:
    """Yield the points of a PTS file in the same way."""

    def blocks() -> Iterator[list[str]]:
        return _without_counts(read_text(path, _SKIPPED), path)

    return _pieces(blocks, path, size, notices, columns, _SCAN_NAMES)


def _pieces(
    blocks: Blocks, path: Path, size: int | None, notices: list[str], columns: str, usual: dict[int, tuple[str, ...]]
) -> Pieces | None:
    """Yield rows of numbers, in which columns without names have the usual ones for their number."""
    columns = columns.strip()
    grid = None if columns else find_grid(path)
    if grid is not None:
        return grid_pieces(path, grid, size, notices)
    if not columns and holds_ptx(read_text(path, _SKIPPED)):
        return None
    rows = find_rows(blocks, path)
    layout = given_layout(columns, rows) if columns else find_layout(rows, usual)
    return _by_layout(rows, layout, size, notices)


def _by_layout(rows: Rows, layout: Layout, size: int | None, notices: list[str]) -> Pieces:
    loaded = load(rows, layout.places, layout.others, layout.label, size)
    notices += [*layout.notices, *loaded.notices]
    indices = {layout.label(index): index for index in loaded.others}
    nameless = {label: index for label, index in indices.items() if not layout.names[index]}
    if nameless:
        guess = Guess(len(nameless))
        for _, others in loaded.pieces():
            guess.add(np.stack([others[index] for index in nameless.values()], axis=1))
        guessed = guess.names([*nameless], min(loaded.others) > max(layout.places))
        normal = "nx" in guessed
        if layout.usual:
            left = zip(nameless.items(), guessed, strict=True)
            guessed = [name if normal and name != label else layout.usual[index] for (label, index), name in left]
        if normal or not layout.usual:
            notices.append(_guess_notice(rows.path, layout.places, [*nameless], guessed))
        indices = _renamed(indices, dict(zip(nameless, guessed, strict=True)))
    indices = _renamed(indices, standard_names(indices))
    if layout.announced not in (None, loaded.count):
        notices.append(f"{rows.path.name}: announces {layout.announced} points, but {loaded.count} lines follow.")
    first = np.empty((0, 3))  # lines that may be triangles
    for places, others in loaded.pieces():
        if rows.width == 3 and not any(layout.names) and len(first) < _TRIANGLES:
            first = np.concatenate([first, places[: _TRIANGLES - len(first)]])
        named = {name: others[index] for name, index in indices.items()}
        table, channels = gather_columns(dict(zip("xyz", places.T, strict=True)) | named, rows.path)
        table.degrees = layout.degrees
        yield table, channels
    if are_triangles(first):
        notices.append(
            f"{rows.path.name}: its numbers are whole, and most pairs of them are in two lines, as of triangles by the"
            " indices of their corners. If they are, this is no point cloud: open the file with the points of these."
        )


def _renamed(columns: dict[str, int], names: dict[str, str]) -> dict[str, int]:
    """Return indices of columns by new names, but for those that others have, such as the coordinates."""
    taken = {*"xyz", *columns} - {*names}
    return {_free(names.get(name, name), name, taken): index for name, index in columns.items()}


def _free(new: str, old: str, taken: set[str]) -> str:
    """Return the new name of a column if it is free, otherwise the old one, unless it is that of a coordinate."""
    if new != old and new not in taken:
        return new
    return f"{old}_2" if old in ("x", "y", "z") else old


def _guess_notice(path: Path, places: list[int], labels: list[str], names: list[str]) -> str:
    """Report as what columns without names were read."""
    groups = [
        (kind, [label for label, name in zip(labels, names, strict=True) if name in known])
        for kind, known in (
            ("colors", ("r", "g", "b", "alpha")),
            ("normals", ("nx", "ny", "nz")),
            ("intensity", ("intensity",)),
            ("attributes", labels),
        )
    ]
    others = "; ".join(f"{', '.join(found)} as {kind}" for kind, found in groups if found)
    return (
        f"{path.name}: not all columns have names. Read {', '.join(f'column_{i + 1}' for i in places)} as x y z;"
        f" {others}. If that is wrong, give their names by columns."
    )


def _without_counts(blocks: Iterator[list[str]], path: Path) -> Iterator[list[str]]:
    """Yield the lines of a PTS file, empty ones for the numbers of points, which must be right if there are any."""
    count = missing = passed = 0
    counted = None  # whether the first line was a number of points
    for lines in blocks:
        for index, line in enumerate(lines):
            if counted is False:
                break
            word = line.strip()
            if word and missing:
                missing -= missing < count or _holds_numbers(word)
            elif word.isdecimal():
                count = missing = int(word[:_MOST_DIGITS])
                counted, lines[index] = True, ""
            elif word and counted:
                raise InvalidPointsError(
                    f"{path} announces fewer points than it has: the first one beyond is in line {passed + index + 1}."
                    " Correct the number of points, which stands before them."
                )
            elif word:
                counted = False
        passed += len(lines)
        yield lines
    if missing:
        raise InvalidPointsError(
            f"{path} announces {count} points, but {count - missing} lines follow. Copy or export the file again."
        )


def _holds_numbers(line: str) -> bool:
    """Whether a line is a point, and not one of names after a number of points."""
    return any(map(is_number, re.split(r"[\s,;]+", line)))


def read_vertices(path: Path) -> PointTable:
    """Read the vertices of an OBJ file, with colors if they have any."""
    notices: list[str] = []
    return _colored(vertex_pieces(path, None, notices), path, notices)


def vertex_pieces(path: Path, size: int | None, notices: list[str]) -> Pieces:
    """Yield the vertices of an OBJ file, so many at once, as `column_pieces` does."""
    faces, widths = 0, Counter[int]()

    def blocks(missing: str = "") -> Iterator[list[str]]:
        """Yield the lines of vertices without their v, and with what some lack; empty ones in place of others."""
        nonlocal faces
        faces = 0
        widths.clear()
        for lines in read_text(path, ("#", "f", "l")):
            lines = [line.lstrip() for line in lines]
            faces += sum(line.startswith(("f ", "f\t", "l ", "l\t")) for line in lines)
            lines = [line[2:] if line.startswith(("v ", "v\t")) else "" for line in lines]
            if any("#" in line for line in lines):
                lines = [line.partition("#")[0] for line in lines]
            widths.update(map(len, map(str.split, filter(None, lines))))
            yield [line and line + missing for line in lines] if missing else lines

    def look(least: int, missing: str = "") -> tuple[list[str], Loaded]:
        """Return the names of columns, by the vertices that have so many numbers, and these."""
        words = (words for words in map(str.split, chain.from_iterable(blocks())) if len(words) >= least)
        rows = Rows(partial(blocks, missing), path, 0, None, [], [*islice(words, _SAMPLE)])
        if not rows.sample:
            raise InvalidPointsError(f"{path} has no vertices, which are lines that begin with v. It holds no points.")
        names = _vertex_names(rows)
        colors = [index for index, name in enumerate(names) if index > 2 and name != "w"]
        return names, load(rows, [0, 1, 2], colors, names.__getitem__, size)

    names, loaded = look(1)
    if max(widths) > 5 > min(widths):
        bare = sum(count for width, count in widths.items() if width < 6)
        notices.append(f"{path.name}: {bare:,} of {widths.total():,} vertices have no color. They are black.")
        names, loaded = look(max(widths), " nan nan nan nan")
    notices += loaded.notices
    if faces:
        notices.append(f"{path.name}: left out {faces} faces and lines. Only points are read.")
    for places, others in loaded.pieces():
        columns = dict(zip("xyz", places.T, strict=True)) | {names[index]: values for index, values in others.items()}
        yield gather_columns(columns, path)


def _vertex_names(rows: Rows) -> list[str]:
    """Return the names of the numbers of a vertex: of seven the fourth is a weight if it is 1, or the last alpha."""
    if rows.width == 7:
        weighted = all(float(words[3]) == 1.0 for words in rows.sample if len(words) == 7 and is_number(words[3]))
        return ["x", "y", "z", "w", "r", "g", "b"] if weighted else ["x", "y", "z", "r", "g", "b", "alpha"]
    return ["x", "y", "z", "r", "g", "b"] if rows.width == 6 else ["x", "y", "z"]


def write_columns(path: Path, pieces: ColumnPieces, delimiter: str = " ") -> None:
    """Write columns as text, a point a line, with their names before them.

    Doubles among the coordinates are written with the digits of double precision. With white space as delimiter the
    line of names begins with #, which readers of XYZ files skip.
    """
    ranges = ranges_of(pieces)[1]
    line = delimiter.join(_text_format(name, found) for name, found in ranges.items()) + "\n"
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        names = [name.replace(delimiter, "_") for name in ranges]
        file.write(("# " if delimiter.isspace() else "") + delimiter.join(names) + "\n")
        for columns in pieces():
            given = [columns[name] for name in ranges]
            given = [shortest(values) if values.dtype == np.float32 else values for values in given]
            for start in range(0, len(given[0]), _BLOCK):  # blocks of rows take a third of the time of savetxt
                block = [values[start : start + _BLOCK] for values in given]
                rows = np.empty((len(block[0]), len(block)), object)  # doubles would round whole numbers of 64 bits
                for index, values in enumerate(block):
                    rows[:, index] = values
                file.write((line * len(rows)) % tuple(rows.reshape(-1).tolist()))


def _text_format(name: str, found: Range) -> str:
    """Return the shortest format in which numbers are read back exactly; coordinates have all digits that help."""
    if found.dtype.kind in "biu":
        return "%d"
    if found.dtype.itemsize < 8:
        return "%.9g"
    return "%.15g" if name in AXES or (found.whole and max(-found.low, found.high) < 1e15) else "%s"
