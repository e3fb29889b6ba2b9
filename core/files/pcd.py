"""PCD, the format of the Point Cloud Library: in text, binary or compressed."""

import os
from itertools import chain

import numpy as np

from ..errors import InvalidPointsError
from .lines import brief, read_blocks
from .table import PointTable, from_columns

_KINDS = {"F": "f", "I": "i", "U": "u"}
_SIZES = {"f": (4, 8), "i": (1, 2, 4, 8), "u": (1, 2, 4, 8)}
_LINES = "VERSION", "FIELDS", "COLUMNS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA"
_LONGEST = 4000  # characters of a line of the header, and lines
_PACKED = ("rgb", "rgba")  # fields that hold a color in the bits of one number
_EXPANDED = 264  # bytes that two or three compressed ones stand for at most


def read_pcd(path) -> PointTable:
    """Read the points of a PCD file with all their fields; those without a place, as of depth cameras, are left out.

    Raises
    ------
    InvalidPointsError
        It is no PCD file, or broken; the text says where.
    """
    with open(path, "rb") as file:
        header = _read_header(file, path)
        names, record, count = _layout(header, path)
        match header["DATA"]:
            case ["ascii"]:
                columns = _read_text(file, record, count, path)
            case ["binary"]:
                columns = _read_binary(file, record, count, path)
            case ["binary_compressed"]:
                columns = _read_compressed(file, record, count, path)
            case kind:
                raise InvalidPointsError(f"{path} holds {brief(' '.join(kind))} data. Save it as ascii or binary.")
    named = {}
    for name, column in zip(names, columns, strict=True):
        if name in _PACKED and column.dtype.itemsize == 4:
            bits = column.view(np.uint32)
            named.update((color, (bits >> shift & 255).astype("u1")) for color, shift in _shifts(name))
        elif name != "_":  # fills a gap
            named[name] = column
    table = from_columns(named, path)
    return _with_places(table, path)


def _shifts(name):
    """Return the colors in a packed one, and where their bits begin."""
    return (("red", 16), ("green", 8), ("blue", 0), *((("alpha", 24),) if name == "rgba" else ()))


def _with_places(table, path):
    """Leave out the points whose coordinates are NaN: pixels of a depth camera that saw nothing."""
    there = ~np.isnan(table.points).any(axis=1)
    if there.all() or not there.any():
        return table
    attributes = {name: values[there] for name, values in table.attributes.items()}
    colors = None if table.colors is None else table.colors[there]
    told = f"{path.name}: left out {np.count_nonzero(~there):,} points without a place, as cameras write them."
    return PointTable(table.points[there], attributes, colors, table.single, [*table.notices, told])


def _read_header(file, path):
    """Return the words of each line by its first one; leave the file where the data begin."""
    header = {}
    for _ in range(_LONGEST):
        words = file.readline(_LONGEST).decode("ascii", errors="replace").split()
        if not words or words[0].startswith("#"):
            continue
        if words[0].upper() not in _LINES:
            break
        header[words[0].upper()] = words[1:]
        if "DATA" in header:
            return header
    raise InvalidPointsError(f"{path} is no PCD file: its header does not end with a line DATA. Export it again.")


def _layout(header, path):
    """Return the name of each number of a point, the numbers as a numpy type, and how many points there are."""
    try:
        fields = header.get("FIELDS") or header["COLUMNS"]
        kinds = [_KINDS[kind] for kind in header["TYPE"]]
        sizes = [int(size) for size in header["SIZE"]]
        repeats = [int(times) for times in header.get("COUNT", ["1"] * len(fields))]
        width, height = (int(header.get(key, ["1"])[0]) for key in ("WIDTH", "HEIGHT"))
        count = int(header["POINTS"][0]) if "POINTS" in header else width * height
    except (KeyError, IndexError, ValueError) as error:
        raise InvalidPointsError(f"{path} has a header that is incomplete: {error}. Export it again.") from error
    sound = len(fields) == len(kinds) == len(sizes) == len(repeats) <= _LONGEST and count >= 0
    if not sound or any(size not in _SIZES[kind] for kind, size in zip(kinds, sizes, strict=True)):
        raise InvalidPointsError(f"{path} has a header whose FIELDS, SIZE, TYPE and COUNT do not fit. Export it again.")
    if min(repeats, default=1) < 1 or sum(repeats) > _LONGEST:
        raise InvalidPointsError(f"{path} has fields of too many or no numbers. Export it again.")
    names, codes = [], []
    for name, kind, size, times in zip(fields, kinds, sizes, repeats, strict=True):
        names += [name] if times == 1 else [f"{name}_{number}" if name != "_" else "_" for number in range(times)]
        codes += [f"<{kind}{size}"] * times
    return names, np.dtype([(f"f{index}", code) for index, code in enumerate(codes)]), count


def _read_text(file, record, count, path):
    lines = filter(bytes.strip, chain.from_iterable(read_blocks(file, path)))
    first = next(lines, None)
    values = np.empty((0, len(record)))
    if first is not None:
        values = np.loadtxt(chain([first], lines), ndmin=2, comments=None, encoding="ascii")
    if values.shape[1] != len(record):
        raise InvalidPointsError(
            f"{path} has {values.shape[1]} numbers in a line where its header names {len(record)}. Export it again."
        )
    _check_count(len(values), count, path)
    return [_typed(values[:count, index], record[index]) for index in range(len(record))]


def _typed(column, kind):
    """Give numbers of text the type that the header names, where it holds them; floats stay as fine as they are."""
    if kind.kind == "f":
        return column.astype("f4") if kind.itemsize == 4 else column
    limits = np.iinfo(kind)
    return column.astype(kind) if limits.min <= column.min() and column.max() <= limits.max else column


def _read_binary(file, record, count, path):
    _check_count((os.fstat(file.fileno()).st_size - file.tell()) // record.itemsize, count, path)
    rows = np.fromfile(file, record, count)
    return [rows[name].copy() for name in record.names]


def _read_compressed(file, record, count, path):
    """Read what is compressed column by column."""
    packed, size = (int(number) for number in np.frombuffer(file.read(8).ljust(8, b"\0"), "<u4"))
    if size != count * record.itemsize or size > _EXPANDED * packed:
        raise InvalidPointsError(f"{path} does not hold the {count} points that its header names. Copy it again.")
    data = file.read(packed)
    if len(data) < packed:
        raise InvalidPointsError(f"{path} ends before its points do. Copy it again.")
    expanded = _expand(data, size)
    if len(expanded) != size:
        raise InvalidPointsError(f"{path} is broken: its compressed points have no end. Copy it again.")
    columns, begin = [], 0
    for name in record.names:
        column = np.frombuffer(expanded, record[name], count, begin)
        columns.append(column)
        begin += column.nbytes
    return columns


def _expand(data, size):
    """Undo the compression of LZF: pieces to copy as they are, and pieces that were there before; no more than a size.

    The first byte of a piece tells which of both it is, and how long.
    """
    result, place = bytearray(), 0
    while place < len(data) and len(result) <= size:
        control = data[place]
        place += 1
        if control < 32:
            result += data[place : place + control + 1]
            place += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += data[place] if place < len(data) else 0
            place += 1
        back = ((control & 31) << 8) + (data[place] if place < len(data) else 0) + 1
        place += 1
        length += 2
        if back > len(result):
            break
        piece = result[len(result) - back : len(result) - back + length]
        result += (piece * (length // len(piece) + 1))[:length]  # a piece may go on into itself
    return result


def _check_count(found, count, path):
    if found < count:
        raise InvalidPointsError(
            f"{path} ends after {found} of the {count} points that its header names. Copy or save it again."
        )
