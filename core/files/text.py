"""Columns of numbers as text: XYZ, CSV, PTS, and the vertices of OBJ files."""

import re

import numpy as np

from ..errors import InvalidPointsError
from .table import PointTable, from_columns, to_columns

_DELIMITERS = (";", "\t", None, ",")  # in this order; None is white space
_BLOCK = 10_000  # lines that are written at once
_HEADER = 20  # lines before the first point at most
_SCAN_NAMES = {  # of the columns of PTS files
    4: ("x", "y", "z", "intensity"),
    6: ("x", "y", "z", "r", "g", "b"),
    7: ("x", "y", "z", "intensity", "r", "g", "b"),
}


def read_columns(path) -> PointTable:
    """Read a text file with a point a line.

    Columns are separated by semicolons, tabs, white space or commas; beside commas as separators, numbers have decimal
    points, otherwise points or commas. The last line before the first point, marked as a comment or not, may name the
    columns; without names the first three are x y z.
    """
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    return _read_rows(lines, path)


def read_scan(path) -> PointTable:
    """Read a PTS file: scans one after another, each begins with the number of its points."""
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    filled = [number for number, line in enumerate(lines) if line.strip()]
    at = 0
    while at < len(filled) and lines[filled[at]].strip().isdecimal():
        count = int(lines[filled[at]])
        lines[filled[at]] = ""
        at += 1 + count
        if at > len(filled):
            missing = at - len(filled)
            raise InvalidPointsError(
                f"{path} announces {count} points, but {count - missing} lines follow. Copy or export the file again."
            )
    if 0 < at < len(filled):
        raise InvalidPointsError(
            f"{path} announces fewer points than it has: the first one beyond is in line {filled[at] + 1}."
            " Correct the number of points, which stands before them."
        )
    return _read_rows(lines, path, _SCAN_NAMES)


def _read_rows(lines, path, usual=()) -> PointTable:
    """Read lines, in which columns without names have the usual ones for their number."""
    first, delimiter = _find_first(lines, path)
    words = _words(lines[first], delimiter)
    names = _find_names(lines[:first], delimiter, len(words))
    if not names and len(words) in usual:
        names = usual[len(words)]
    numeric = [index for index, word in enumerate(words) if _is_number(word)]
    lower = [name.lower() for name in names]
    if {"x", "y", "z"} <= set(lower):
        places = [lower.index(axis) for axis in "xyz"]
    else:
        places = numeric[:3]
    extra = [index for index in numeric if index not in places and index < len(names)]
    notices = []
    unnamed = len(numeric) - len(extra) - 3
    if unnamed > 0:
        notices.append(f"{path.name}: left out {unnamed} columns that no header names.")
    rows = lines[first:]
    try:
        values = _load(rows, delimiter, places + extra)
    except ValueError:
        problem = _find_problem(lines, first, delimiter, places, names)
        if problem:
            raise InvalidPointsError(
                f"{path} does not hold columns of numbers x y z: {problem}. Correct the file."
            ) from None
        problem = _find_problem(lines, first, delimiter, extra, names)
        notices.append(f"{path.name}: left out all columns but x y z, for {problem}.")
        extra, values = [], _load(rows, delimiter, places)
    columns = dict(zip("xyz", values.T, strict=False))
    columns.update((names[index], values[:, 3 + number]) for number, index in enumerate(extra))
    table = from_columns(columns, path)
    table.notices += notices
    return table


def _load(rows, delimiter, columns):
    if delimiter != "," and any("," in row for row in rows):
        rows = [row.replace(",", ".") for row in rows]
    return np.loadtxt(rows, delimiter=delimiter, usecols=columns, ndmin=2)


def _find_first(lines, path):
    """Find the first line with three numbers, and what separates them."""
    seen = 0
    for number, line in enumerate(lines):
        for delimiter in _DELIMITERS:
            if sum(map(_is_number, _words(line, delimiter))) >= 3:
                return number, delimiter
        seen += bool(line.strip())
        if seen > _HEADER:
            break
    problem = "there are none" if seen <= _HEADER else f"there are none in its first {_HEADER} lines"
    raise InvalidPointsError(f"{path} does not hold columns of numbers x y z: {problem}. Correct the file.")


def _words(line, delimiter):
    """Split a line without its comment, with decimal points; no words if the delimiter cannot be meant."""
    line = line.split("#")[0].split("//")[0].strip()
    if delimiter is None and re.search(r"\s,|,\s|,$", line):
        return []
    if delimiter != ",":
        line = line.replace(",", ".")
    return [word.strip() for word in line.split(delimiter)]


def _is_number(word):
    try:
        float(word)
    except ValueError:
        return False
    return True


def _find_names(header, delimiter, width):
    """Return the names of the columns from the line before the first point; none if there is no fitting line."""
    lines = [line for line in header if line.strip()]
    if not lines:
        return ()
    line = lines[-1].strip().lstrip("#/%! ")
    for separator in (delimiter, None):
        names = [name.strip().strip('"').strip() for name in line.split(separator)]
        if len(names) == width and not any(map(_is_number, names)) and len(set(names)) == width:
            return tuple(names)
    return ()


def _find_problem(lines, first, delimiter, columns, names):
    """Return what is wrong with the first line that lacks a number in one of some columns; empty if none does."""
    for number, line in enumerate(lines[first:], start=first + 1):
        words = _words(line, delimiter)
        if not any(words):
            continue
        for index in columns:
            if index >= len(words):
                return f"line {number} has {len(words)} columns only"
            if not _is_number(words[index]):
                return f"line {number} has {words[index]!r} where a number should be"
    return ""


def read_vertices(path) -> PointTable:
    """Read the vertices of an OBJ file, with colors if they have any."""
    lines = [line.lstrip() for line in path.read_text(encoding="utf-8", errors="replace").splitlines()]
    rows = [line[2:] for line in lines if line.startswith(("v ", "v\t"))]
    if not rows:
        raise InvalidPointsError(f"{path} has no vertices, which are lines that begin with v. It holds no points.")
    names = {6: "x y z r g b", 7: "x y z w r g b"}.get(len(rows[0].split()), "x y z").split()
    used = [index for index, name in enumerate(names) if name != "w"]
    try:
        values = np.loadtxt(rows, usecols=used, ndmin=2)
    except ValueError:
        vertices = [line if line.startswith(("v ", "v\t")) else "" for line in lines]
        problem = _find_problem([line[1:] for line in vertices], 0, None, used, names)
        raise InvalidPointsError(f"{path} has a broken vertex: {problem}. Correct the file.") from None
    table = from_columns(dict(zip([names[index] for index in used], values.T, strict=True)), path)
    faces = sum(line.startswith(("f ", "f\t", "l ", "l\t")) for line in lines)
    if faces:
        table.notices.append(f"{path.name}: left out {faces} faces and lines. Only points are read.")
    return table


def write_columns(path, table, delimiter=" ", double=True):
    """Write a table as text, a point a line, with the names of the columns before them.

    Parameters
    ----------
    path : pathlib.Path
    table : PointTable
    delimiter : str
        With white space the line of names begins with #, which readers of XYZ files pass over.
    double : bool
        Whether coordinates are written with the digits of double precision.
    """
    columns = to_columns(table)
    formats = ["%d" if values.dtype.kind in "biu" else "%.9g" for values in columns.values()]
    if double:
        formats[:3] = 3 * ["%.15g"]
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        names = [name.replace(delimiter, "_") for name in columns]
        file.write(("# " if delimiter.isspace() else "") + delimiter.join(names) + "\n")
        line = delimiter.join(formats) + "\n"
        for start in range(0, len(table.points), _BLOCK):  # some rows at a time take a third of the time of savetxt
            rows = np.stack([values[start : start + _BLOCK] for values in columns.values()], axis=1, dtype=np.float64)
            file.write((line * len(rows)) % tuple(rows.reshape(-1).tolist()))
