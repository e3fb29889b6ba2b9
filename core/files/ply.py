"""PLY, the Stanford polygon format: the vertices and their properties, in text or binary."""

import os
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import islice, takewhile
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from ..arguments import as_path
from ..errors import InvalidPointsError
from ..types import Array, FilePath, Ints
from .ascii_words import ascii_words
from .lines import brief
from .ply_lists import Code, end_of_records, first_list, read_fixed
from .polygons import triangles
from .ranges import ColumnPieces, Columns, Range, ranges_of
from .rows import read_records, read_rows, record_blocks
from .table import PointTable, from_columns, gather_columns, to_columns

_CODES = ("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8")
_NAMES = dict(zip(_CODES, ("char", "uchar", "short", "ushort", "int", "uint", "float", "double"), strict=True))
_TYPES = {name: code for code, name in _NAMES.items()}
_TYPES |= {np.dtype(code).name: code for code in (*_CODES, "i8", "u8")}  # int8, ..., float64; some write 64 bits
_TYPES["bool"] = "u1"
_ORDERS = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}
_LONGEST = 1000  # characters of a line of the header, and lines
_CORNERS = ("vertex_indices", "vertex_index")  # the list of a face
_MOST_DIGITS = 15  # of a count
_PADDING = 2  # bytes that may follow all elements: the end of a line


class _Element(NamedTuple):
    name: str
    count: int  # type: ignore[assignment]  # in place of the method of tuples
    names: list[str]  # of the properties
    types: list[Code]

    @property
    def lists(self) -> list[str]:
        """Names of the properties that are lists."""
        return [name for name, code in zip(self.names, self.codes, strict=True) if code is None]

    @property
    def codes(self) -> list[str | None]:
        """numpy's codes of the properties, None for lists."""
        return [None if isinstance(code, tuple) else code for code in self.types]


class PlyVertices(NamedTuple):
    """The vertices of a PLY file, in its types.

    Attributes
    ----------
    columns : dict of str to ndarray, (n,)
        By the names of the properties, in the types of the file.
    order : str or None
        "<" or ">", the order of bytes; None for text.
    comments : list of str
        Lines of the header that do not describe the data.
    notices : list of str
        Which elements and lists were left out.
    """

    columns: dict[str, Array]
    order: str | None
    comments: list[str]
    notices: list[str]


def read_ply(path: Path) -> PointTable:
    """Read the vertices of a PLY file with all their properties.

    A file that is no PLY file, or broken, raises `InvalidPointsError`, whose text says where.
    """
    vertices = read_vertex_columns(path)
    table = from_columns(vertices.columns, path)
    table.notices += vertices.notices
    return table


def read_vertex_columns(path: FilePath) -> PlyVertices:
    """Read the vertices of a PLY file in its types; errors as of `read_ply`."""
    path = as_path(path)
    with open(path, "rb") as file:
        order, before, vertex, after, comments, notices = _read_vertex(file, path)
        if order is None:
            skipped = sum(element.count for element in before)
            columns = read_rows(file, vertex.codes, vertex.count, path, skipped, None if after else notices)
        else:
            begin = _end(file, order, before, path)
            notices += _rest_notices(file, begin, order, vertex, after, path)
            columns = _read_binary(file, begin, order, vertex, path)
    single = [name for name in vertex.names if name not in vertex.lists]
    return PlyVertices(dict(zip(single, columns, strict=True)), order, comments, notices)


def ply_pieces(path: Path, size: int, notices: list[str]) -> Iterator[tuple[PointTable, dict[str, Array]]] | None:
    """Yield the vertices of a binary PLY file, so many at once, as `gather_columns` makes them.

    Notices get what is left out. Return None where the file can only be read as a whole: it is text, or has lists at
    its vertices.
    """
    with open(path, "rb") as file:
        order, before, vertex, after, _, found = _read_vertex(file, path)
        if order is None or vertex.lists:
            return None
        begin = _end(file, order, before, path)
        notices += [*found, *_rest_notices(file, begin, order, vertex, after, path)]
    return _vertex_pieces(path, begin, order, vertex, size)


def _vertex_pieces(
    path: Path, begin: int, order: str, vertex: _Element, size: int
) -> Iterator[tuple[PointTable, dict[str, Array]]]:
    codes = [str(code) for code in vertex.types]
    record = _record(order, codes)
    with open(path, "rb") as file:
        for rows in record_blocks(file, begin, record, vertex.count, path, size):
            yield gather_columns(dict(zip(vertex.names, _columns(rows, codes), strict=True)), path)


def _read_vertex(
    file: BinaryIO, path: Path
) -> tuple[str | None, list[_Element], _Element, list[_Element], list[str], list[str]]:
    """Read the header: order of bytes, elements before the vertices, these, those after, comments, what is left out."""
    order, elements, comments = _read_header(file, path)
    names = [element.name for element in elements]
    if "vertex" not in names:
        raise InvalidPointsError(
            f"{path} has no vertices, only {brief(', '.join(names)) or 'nothing'}. It holds no points."
        )
    place = names.index("vertex")
    vertex = elements[place]
    before, after = (
        [element for element in part if element.count] for part in (elements[:place], elements[place + 1 :])
    )
    notices = [
        f"{path.name}: left out {element.count} {brief(element.name)} elements. Only points are read."
        for element in (*before, *after)
    ]
    if vertex.lists:
        notices.append(f"{path.name}: left out {brief(', '.join(vertex.lists))}, lists of numbers at each point.")
    return order, before, vertex, after, comments, notices


def _rest_notices(
    file: BinaryIO, begin: int, order: str, vertex: _Element, after: list[_Element], path: Path
) -> list[str]:
    """Report bytes that no element names; refuse a file where each point has some of them, for these are between."""
    if vertex.lists or not vertex.count:
        return []
    end = end_of_records(file, begin, order, vertex.types, vertex.count, path)
    told = (end - begin) // vertex.count
    lists = next((index for index, element in enumerate(after) if element.lists), len(after))
    for element in after[:lists]:
        end = end_of_records(file, end, order, element.types, element.count, path)
    left = file.seek(0, os.SEEK_END) - end
    if lists < len(after) and left > 0:  # whose end only a look at all of them would tell
        name, code = after[lists].names[0], after[lists].types[0]
        corners = first_list(file, end, order, code) if name in _CORNERS and isinstance(code, tuple) else np.zeros(1)
        if not (len(corners) and ((corners >= -1) & (corners < vertex.count)).all()):  # -1 ends a strip of triangles
            raise InvalidPointsError(
                f"{path}: its first face has corners that are no points, so each point is longer than the {told} bytes"
                " that its header names, and their places would be wrong. Export it again, as text, if possible."
            )
    if lists < len(after) or left <= _PADDING:
        return []
    if left % vertex.count == 0:
        raise InvalidPointsError(
            f"{path}: {left:,} bytes follow the last point, so each of its {vertex.count:,} points has"
            f" {told + left // vertex.count} bytes where its header names {told}, and their places would be wrong."
            " Export it again, as text, if possible."
        )
    return [
        f"{path.name}: {left:,} bytes follow the last of the {vertex.count:,} points that its header names, and are"
        " left out. If these are points, too, correct their number in the header."
    ]


def read_vertex_names(path: FilePath) -> list[str]:
    """Read the names of the properties of the vertices of a PLY file; none if it has no vertices."""
    path = as_path(path)
    with open(path, "rb") as file:
        elements = _read_header(file, path)[1]
    return next((element.names for element in elements if element.name == "vertex"), [])


def read_elements(path: FilePath) -> tuple[str | None, list[str], dict[str, dict[str, Array]]]:
    """Read all elements of a PLY file without lists, in its types; errors as of `read_ply`.

    Returns
    -------
    str or None
        As `PlyVertices.order`.
    list of str
        As `PlyVertices.comments`.
    dict of str to dict of str to ndarray
        By the names of the elements, their columns by the names of the properties.
    """
    path, found = as_path(path), dict[str, dict[str, Array]]()
    before: list[_Element] = []
    with open(path, "rb") as file:
        order, elements, comments = _read_header(file, path)
        begin = file.tell()
        for element in elements:
            if element.lists:
                raise InvalidPointsError(
                    f"{path} has lists in its element {brief(element.name)}. Save it again without."
                )
            file.seek(begin)
            if order is None:
                columns = read_rows(file, element.codes, element.count, path, sum(each.count for each in before))
            else:
                columns = _read_binary(file, _end(file, order, before, path), order, element, path)
            found[element.name] = dict(zip(element.names, columns, strict=True))
            before.append(element)
    return order, comments, found


def _read_header(file: BinaryIO, path: Path) -> tuple[str | None, list[_Element], list[str]]:
    """Return the byte order, None for text, the elements and comments; leave the file where the data begin."""
    lines = _header_lines(file)
    if next(lines).strip() != b"ply":
        raise InvalidPointsError(f"{path} is no PLY file: its first line is not 'ply'. Export it again.")
    order: str | None = ""
    elements: list[_Element] = []
    comments: list[str] = []
    for number in range(2, _LONGEST):
        line = next(lines).decode(errors="replace").strip()
        match line.split():
            case ["end_header"]:
                if order == "":
                    raise InvalidPointsError(f"{path} does not state whether it is text or binary. Export it again.")
                return order, elements, comments
            case ["format", kind, *_] if kind in _ORDERS:
                order = _ORDERS[kind]
            case ["comment" | "obj_info", *_]:
                comments.append(line)
            case ["element", name, count] if count.isdecimal() and len(count) <= _MOST_DIGITS:
                elements.append(_Element(name, int(count), [], []))
            case ["property", "list", length, item, name] if elements and length in _TYPES and item in _TYPES:
                elements[-1].names.append(name)
                elements[-1].types.append((_TYPES[length], _TYPES[item]))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].names.append(name)
                elements[-1].types.append(_TYPES[kind])
            case _:
                raise InvalidPointsError(
                    f"{path}, line {number}: {line[:60]!r} is not valid in the header of a PLY file. Export it again."
                )
    raise InvalidPointsError(f"{path} has a header without an end. Export it again.")


def _header_lines(file: BinaryIO) -> Iterator[bytes]:
    """Yield the lines of a header, which all end as the first does: those of Rhino in a carriage return alone."""
    first = file.readline(_LONGEST)
    alone = b"\r" in first.rstrip(b"\r\n")
    file.seek(0)
    while True:
        letters = islice(iter(partial(file.read, 1), b""), _LONGEST)
        yield b"".join(takewhile(b"\r".__ne__, letters)) if alone else file.readline(_LONGEST)


def _read_binary(file: BinaryIO, begin: int, order: str, vertex: _Element, path: Path) -> list[Array]:
    """Read the columns of an element."""
    if vertex.lists:
        return read_fixed(file, begin, order, vertex.types, vertex.count, path)
    codes = [code for code in vertex.codes if code is not None]
    return _columns(read_records(file, begin, _record(order, codes), vertex.count, path), codes)


def _end(file: BinaryIO, order: str, elements: list[_Element], path: Path) -> int:
    """Return where elements end that begin here."""
    begin = file.tell()
    for element in elements:
        begin = end_of_records(file, begin, order, element.types, element.count, path)
    return begin


def _record(order: str, codes: Sequence[str]) -> np.dtype[np.void]:
    """Return the type of the numbers of one element in the file."""
    return np.dtype([(f"f{index}", order + code) for index, code in enumerate(codes)])


def _columns(rows: Array, codes: Sequence[str]) -> list[Array]:
    """Return the columns of records in the order of bytes of this machine."""
    return [rows[f"f{index}"].astype(code) for index, code in enumerate(codes)]


def write_ply(path: Path, table: PointTable, double: bool = True, faces: Sequence[Ints] = ()) -> list[str]:
    """Write a table as a binary PLY file, and return notices; see `write_vertex_columns`.

    Coordinates are kept in double precision if asked for. Faces, (m, k) each, are indices of k points.
    """
    return write_vertex_columns(path, to_columns(table, double), faces=faces)


def write_vertex_columns(
    path: FilePath,
    columns: Columns,
    order: str = "<",
    comments: Sequence[str] = (),
    faces: Sequence[Ints] = (),
) -> list[str]:
    """Write a binary PLY file of all vertices at once, and return notices; see `write_vertex_pieces`.

    Parameters
    ----------
    path : path-like
    columns : dict of str to ndarray, (n,)
    order, comments
        See there.
    faces : sequence of ndarray, (m, k) int
        Of at most 255 corners each, as indices of vertices. Those of several numbers of corners become triangles, since
        some programs read no file with both.
    """
    polygons = [corners for corners in faces if len(corners)]
    divided = polygons if len(polygons) < 2 else [_all_triangles(polygons, columns)]
    notices = write_vertex_pieces(as_path(path), lambda: [columns], order, comments, divided)
    if len(polygons) > 1:
        notices.append(
            "Quads were divided into triangles, since some programs read no PLY file with both. No point is lost."
        )
    return notices


def write_vertex_pieces(
    path: Path, pieces: ColumnPieces, order: str = "<", comments: Sequence[str] = (), faces: Sequence[Ints] = ()
) -> list[str]:
    """Write a binary PLY file, the vertices piece by piece.

    Parameters
    ----------
    path : pathlib.Path
    pieces : callable
        Names become words of ASCII. PLY has no whole numbers of 8 bytes: those that no double can hold become two
        columns, the second of which counts 2**32.
    order : {"<", ">"}
        Of the bytes.
    comments : sequence of str
        Lines of the header.
    faces : sequence of ndarray, (m, k) int
        Of the same number of corners, at most 255, as indices of vertices.

    Returns
    -------
    list of str
        Notices of differences between what was given and what is written.
    """
    count, ranges = ranges_of(pieces)
    properties, notices = _properties(ranges)
    names = dict(zip(properties, ascii_words(list(properties)), strict=True))
    record = np.dtype([(names[name], order + item.code) for name, item in properties.items()])
    kind = next(name for name, known in _ORDERS.items() if known == order)
    lines = ["ply", f"format {kind} 1.0", *comments, f"element vertex {count}"]
    lines += [f"property {_NAMES[item.code]} {names[name]}" for name, item in properties.items()]
    if len(faces):
        lines += [f"element face {sum(map(len, faces))}", "property list uchar int vertex_indices"]
    with open(path, "wb") as file:
        file.write("\n".join([*lines, "end_header\n"]).encode())
        for columns in pieces():
            rows = np.empty(len(next(iter(columns.values()))), record)
            for name, item in properties.items():
                rows[names[name]] = item.of(columns)
            rows.tofile(file)
        for corners in faces:
            lists = np.empty(len(corners), [("count", "u1"), ("corners", order + "i4", corners.shape[1])])
            lists["count"], lists["corners"] = corners.shape[1], corners
            lists.tofile(file)
    renamed = ", ".join(f"{name} as {word}" for name, word in names.items() if name != word)
    if renamed:
        notices.append(f"PLY permits ASCII names without spaces only: wrote {brief(renamed)}.")
    return notices


def _all_triangles(faces: list[Ints], columns: Columns) -> Ints:
    """Return faces of any numbers of corners as triangles."""
    points = np.stack([columns[axis] for axis in "xyz"], axis=1)
    return np.concatenate([triangles(corners, points) for corners in faces])


class _Property(NamedTuple):
    """A property that is written: the name of the column, the code of its type, and which half of its numbers it is."""

    source: str
    code: str
    half: str = ""  # "low" or "high"

    def of(self, columns: Columns) -> Array:
        """Return its numbers, in the type of the column."""
        values = columns[self.source]
        if self.half:
            kind = values.dtype.type
            return values & kind(2**32 - 1) if self.half == "low" else values >> kind(32)
        return values


def _properties(ranges: dict[str, Range]) -> tuple[dict[str, _Property], list[str]]:
    """Return columns as properties by their names, in types that PLY has, and notices of those that became two."""
    result, notices = dict[str, _Property](), list[str]()
    for name, found in ranges.items():
        code = _code(found)
        if code is not None:
            result[name] = _Property(name, code)
            continue
        upper = f"{name}_high"
        result[name] = _Property(name, "u4", "low")
        result[upper] = _Property(name, "u4" if found.dtype.kind == "u" else "i4", "high")
        notices.append(f"PLY has no type for {name}: it is {name} + 4294967296 {upper} of the file.")
    return result, notices


def _code(found: Range) -> str | None:
    """Return the code of a type of PLY that holds the numbers of a range; None if there is none."""
    if found.dtype == bool:
        return "u1"
    if found.dtype.str[1:] in _NAMES:
        return found.dtype.str[1:]
    if found.dtype.kind == "f":
        return "f8"
    limits = (("i4", -(2**31), 2**31 - 1), ("u4", 0, 2**32 - 1), ("f8", -(2**53), 2**53))
    return next((code for code, least, most in limits if least <= found.low and found.high <= most), None)
