"""PTX, rasters of rays of scanners by Leica: scans one after another, each with its position and matrix."""

from collections.abc import Iterator
from itertools import chain, islice
from pathlib import Path

import numpy as np

from ..errors import InvalidPointsError
from ..types import Array, Bools, Floats
from .lines import brief, is_number, read_text
from .table import SCANNER, PointTable, from_columns, gather_columns

_HEAD = 10  # lines: columns, rows, the scanner's position and axes, and four rows of a matrix
_MOST_DIGITS = 9  # of a number of columns or rows
_NAMES = ("x", "y", "z", "intensity", "r", "g", "b")
_WIDTHS = (3, 4, 6, 7)  # numbers of a point
_LAST = [0.0, 0.0, 0.0, 1.0]  # column of a matrix, ...
_ROUNDED = 1e-6  # ... but for rounding
_UNKNOWN = 0.5  # intensity of rays that hit nothing


def holds_ptx(blocks: Iterator[list[str]]) -> bool:
    """Whether a text begins as PTX does, whatever the file is called."""
    lines = filter(_is_filled, chain.from_iterable(blocks))
    return _parse([*islice(lines, _HEAD)]) is not None


def read_ptx(path: Path) -> PointTable:
    """Read a PTX file: the points of all scans, transformed by their matrices, without rays that hit nothing.

    Each point gets the position of its scanner as a vector, and the number of its scan, if there are several. A file
    that is no PTX file, or announces another number of points than it has, raises `InvalidPointsError`, whose text says
    where.
    """
    scans = [(values, center, missed) for values, center, missed, _ in _scans(path)]
    return _join([(values, center) for values, center, _ in scans], sum(missed for *_, missed in scans), path)


def ptx_pieces(path: Path, size: int, notices: list[str]) -> Iterator[tuple[PointTable, dict[str, Array]]]:
    """Yield the points of each scan as `gather_columns` makes them, whatever the size; notices come at the end."""
    total = 0
    for number, (values, center, missed, several) in enumerate(_scans(path)):
        total += missed
        table, channels = gather_columns(dict(zip(_names(values), values.T, strict=True)), path)
        table.attributes[SCANNER] = np.tile(center, (len(values), 1))
        if several:
            table.attributes["scan"] = np.full(len(values), number, dtype=np.int32)
        yield table, channels
    notices += _missed_notices(total, path)


def _scans(path: Path) -> Iterator[tuple[Floats, Floats, int, bool]]:
    """Yield the points, (n, k), of each scan, the scanner's position, the missed rays, and if there are other scans."""
    numbered = enumerate(chain.from_iterable(read_text(path)), start=1)
    lines = ((number, line) for number, line in numbered if _is_filled(line))
    count, head = 0, [*islice(lines, _HEAD)]
    while head:
        found = _read_scan(lines, head, count, path)
        count, head = count + 1, [*islice(lines, _HEAD)]
        yield *found, bool(count > 1 or head)


def _names(values: Floats) -> list[str]:
    """Return the names of the numbers of a point, of which some have no intensity or colors."""
    names = _NAMES if values.shape[1] != 6 else [name for name in _NAMES if name != "intensity"]
    return list(names[: values.shape[1]])


def _missed_notices(missed: int, path: Path) -> Iterator[str]:
    if missed:
        yield f"{path.name}: left out {missed} rays that hit nothing (0 0 0)."


def _is_filled(line: str) -> bool:
    """Whether a line is neither empty nor a comment, as some programs write before the first scan."""
    return bool(line.strip()) and not line.lstrip().startswith(("#", "//"))


def _parse(lines: list[str]) -> tuple[int, Floats, Floats] | None:
    """Return the number of points, the scanner's position and the matrix in the first lines of a scan, or None."""
    words = [line.split() for line in lines]
    if [len(row) for row in words] != [1, 1, 3, 3, 3, 3, 4, 4, 4, 4]:
        return None
    sizes = [row[0] for row in words[:2]]
    if not all(word.isdecimal() and word.isascii() and len(word) <= _MOST_DIGITS for word in sizes):
        return None
    if not all(is_number(word) for row in words[2:] for word in row):
        return None
    matrix = np.array(words[6:], dtype=np.float64)
    if not np.isfinite(matrix).all():
        return None
    if matrix[3].tolist() == _LAST and matrix[:, 3].tolist() != _LAST:  # it is transposed
        matrix = matrix.T
    if not np.allclose(matrix[:, 3], _LAST, rtol=0.0, atol=_ROUNDED):
        return None
    return int(sizes[0]) * int(sizes[1]), np.array(words[2], dtype=np.float64), matrix


def _read_scan(
    lines: Iterator[tuple[int, str]], head: list[tuple[int, str]], number: int, path: Path
) -> tuple[Floats, Floats, int]:
    """Read a scan: its points, (n, k), transformed by its matrix, the scanner's position, the number of missed rays."""
    found = _parse([line for _, line in head])
    if found is None and number:
        raise InvalidPointsError(
            f"{path}, line {head[0][0]}: {brief(head[0][1])!r} does not begin a scan: scan {number} has more points"
            " than its columns and rows announce, or the file is truncated. Export it again."
        )
    if found is None:
        raise InvalidPointsError(
            f"{path} is no PTX file: it does not begin with two counts, the scanner's position and axes, and a matrix"
            " of 4 rows. Export it again."
        )
    count, place, matrix = found
    values = _read_rows(lines, count, number, path)
    missed = _missed(values)
    values = values[~missed]
    values[:, :3] = values[:, :3] @ matrix[:3, :3] + matrix[3, :3]
    return values, _center(values[:, :3], place, matrix), int(np.count_nonzero(missed))


def _missed(values: Floats) -> Bools:
    """Return which rays hit nothing: those at 0 0 0, except a single one that has an intensity."""
    missed = (values[:, :3] == 0.0).all(axis=1)
    if values.shape[1] in (4, 7):
        measured = missed & (values[:, 3] != 0.0) & (values[:, 3] != _UNKNOWN)
        if np.count_nonzero(measured) == 1:
            missed &= ~measured
    return missed


def _read_rows(lines: Iterator[tuple[int, str]], count: int, number: int, path: Path) -> Floats:
    """Read the rows of a scan."""
    seen = [0]  # the line that numpy read last

    def rows() -> Iterator[str]:
        for seen[0], line in islice(lines, count):
            yield line

    try:
        values = np.loadtxt(rows(), ndmin=2, comments=None) if count else np.empty((0, 3))
    except ValueError as error:
        raise InvalidPointsError(
            f"{path}, scan {number + 1}, near line {seen[0]}: {brief(str(error).split('; use')[0])}. All of its"
            f" {count} points need the same numbers: x y z, intensity, and r g b if there are colors. Export it again."
        ) from None
    if len(values) < count:
        raise InvalidPointsError(
            f"{path} announces {count} points in scan {number + 1}, but {len(values)} follow. Copy or export it again."
        )
    if values.shape[1] not in _WIDTHS:
        raise InvalidPointsError(
            f"{path} has {values.shape[1]} numbers per point in scan {number + 1}. PTX has x y z, intensity, and r g b."
        )
    return values


def _center(points: Floats, place: Floats, matrix: Floats) -> Floats:
    """Return the position of the scanner: the origin of its own coordinates, transformed by the matrix.

    Programs that have transformed the points themselves write the identity.
    """
    moved = matrix[3, :3]
    if (matrix == np.eye(4)).all() and len(points):
        middle = points.mean(axis=0)
        return min((moved, place), key=lambda center: np.linalg.norm(middle - center))
    return moved


def _join(scans: list[tuple[Floats, Floats]], missed: int, path: Path) -> PointTable:
    """Return one table of all scans; attributes that a scan lacks are zero, colors white."""
    counts = [len(values) for values, _ in scans]
    total = sum(counts)
    columns: dict[str, Floats] = {}
    colored = np.zeros(total, bool)
    for start, (values, _) in zip(np.cumsum([0, *counts]), scans, strict=False):
        for name, column in zip(_names(values), values.T, strict=True):
            columns.setdefault(name, np.zeros(total))[start : start + len(values)] = column
        colored[start : start + len(values)] = values.shape[1] > 4
    table = from_columns({name: columns.get(name, np.zeros(0)) for name in columns or "xyz"}, path)
    if table.colors is not None:
        table.colors[~colored] = 1.0
    table.attributes[SCANNER] = np.repeat([center for _, center in scans] or np.empty((0, 3)), counts or 0, axis=0)
    if len(scans) > 1:
        table.attributes["scan"] = np.repeat(np.arange(len(scans), dtype=np.int32), counts)
    table.notices += _missed_notices(missed, path)
    return table
