"""Columns of numbers as text: XYZ, CSV, PTS, and the vertices of OBJ files."""

import re
from functools import partial
from itertools import chain, islice

import numpy as np

from ..errors import InvalidPointsError
from .lines import brief, is_number, read_blocks
from .table import PointTable, from_columns, to_columns

_DELIMITERS = (";", "\t", None, ",")  # in this order; None is white space
_BLOCK = 10_000  # lines that are written at once
_HEADER = 20  # lines before the first point at most
_MOST_DIGITS = 15  # of a number of points; no file has so many
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
    return _read_rows(partial(_blocks, path), path)


def _blocks(path, skipped=("#", "//")):
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        yield from read_blocks(file, path, skipped)


def read_scan(path) -> PointTable:
    """Read a PTS file: scans one after another, each begins with the number of its points."""
    return _read_rows(lambda: _without_counts(_blocks(path), path), path, _SCAN_NAMES)


def _without_counts(blocks, path):
    """Yield the lines of a PTS file, empty ones for the numbers of points, which must be right if there are any."""
    count = missing = passed = 0
    counted = None  # whether the first line was a number of points
    for lines in blocks:
        for index, line in enumerate(lines):
            if counted is False:
                break
            word = line.strip()
            if word and missing:
                missing -= 1
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


def _read_rows(blocks, path, usual=()) -> PointTable:
    """Read rows of numbers, in which columns without names have the usual ones for their number.

    `blocks` gives the lines of the file anew at each call; see `read_blocks`.
    """
    first, words, delimiter, before = _find_first(blocks(), path)
    names = _find_names(before, delimiter, len(words))
    if not names and len(words) in usual:
        names = usual[len(words)]
    numeric = [index for index, word in enumerate(words) if is_number(word)]
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
    try:
        values = _load(blocks(), first, delimiter, places + extra)
    except ValueError:
        problem = _find_problem(blocks(), first, delimiter, places, names)
        if problem:
            raise InvalidPointsError(
                f"{path} does not hold columns of numbers x y z: {problem}. Correct the file."
            ) from None
        problem = _find_problem(blocks(), first, delimiter, extra, names)
        if not problem:
            raise
        notices.append(f"{path.name}: left out all columns but x y z, for {problem}.")
        extra, values = [], _load(blocks(), first, delimiter, places)
    columns = dict(zip("xyz", values.T, strict=False))
    columns.update((names[index], values[:, 3 + number]) for number, index in enumerate(extra))
    table = from_columns(columns, path)
    table.notices += notices
    return table


def _load(blocks, first, delimiter, columns):
    rows = chain.from_iterable(_plain(lines, delimiter) for lines in blocks)
    return np.loadtxt(islice(rows, first, None), delimiter=delimiter, usecols=columns, ndmin=2)


def _plain(lines, delimiter):
    """Return lines as numpy reads them: it knows comments with # alone, and decimal points."""
    text = "\n".join(lines)
    if "//" in text:
        text = re.sub("//.*", "", text)
    elif delimiter == "," or "," not in text:
        return lines
    return (text if delimiter == "," else text.replace(",", ".")).split("\n")


def _find_first(blocks, path):
    """Find the first line with three numbers: how many are before it, its words, what separates them, the last before.

    That is the last one with anything in it; empty if there is none.
    """
    seen, before = 0, ""
    for number, line in enumerate(chain.from_iterable(blocks)):
        if not line.strip():
            continue
        for delimiter in _DELIMITERS:
            words = _words(line, delimiter)
            if sum(map(is_number, words)) >= 3:
                return number, words, delimiter, before
        seen, before = seen + 1, line
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


def _find_names(line, delimiter, width):
    """Return the names of the columns from the line before the first point; none if it does not fit."""
    line = line.strip().lstrip("#/%! ")
    for separator in (delimiter, None):
        names = [name.strip().strip('"').strip() for name in line.split(separator)]
        if len(names) == width and not any(map(is_number, names)) and len(set(names)) == width:
            return tuple(names)
    return ()


def _find_problem(blocks, first, delimiter, columns, names):
    """Return what is wrong with the first line that lacks a number in one of some columns; empty if none does."""
    for number, line in enumerate(islice(chain.from_iterable(blocks), first, None), start=first + 1):
        words = _words(line, delimiter) if line.strip() else []
        if not any(words):
            continue
        for index in columns:
            if index >= len(words):
                return f"line {number} has {len(words)} columns only"
            if not is_number(words[index]):
                return f"line {number} has {brief(words[index])!r} where a number should be"
    return ""


def read_vertices(path) -> PointTable:
    """Read the vertices of an OBJ file, with colors if they have any."""
    faces = 0

    def blocks(other=()):
        """Yield the lines of vertices without their v, and what is given in place of others."""
        nonlocal faces
        faces = 0
        for lines in _blocks(path, skipped=("#", "f", "l")):
            lines = [line.lstrip() for line in lines]
            faces += sum(line.startswith(("f ", "f\t", "l ", "l\t")) for line in lines)
            yield [part for line in lines for part in ((line[2:],) if line.startswith(("v ", "v\t")) else other)]

    rows = chain.from_iterable(blocks())
    words = next(filter(None, (row.split("#")[0].split() for row in rows)), None)
    if words is None:
        raise InvalidPointsError(f"{path} has no vertices, which are lines that begin with v. It holds no points.")
    names = {6: "x y z r g b", 7: "x y z w r g b"}.get(len(words), "x y z").split()
    used = [index for index, name in enumerate(names) if name != "w"]
    try:
        values = np.loadtxt(chain.from_iterable(blocks()), usecols=used, ndmin=2)
    except ValueError:
        problem = _find_problem(blocks(other=[""]), 0, None, used, names)
        if not problem:
            raise
        raise InvalidPointsError(f"{path} has a broken vertex: {problem}. Correct the file.") from None
    table = from_columns(dict(zip([names[index] for index in used], values.T, strict=True)), path)
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
