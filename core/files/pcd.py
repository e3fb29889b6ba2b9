"""PCD, the point files of the Point Cloud Library: text, binary, or compressed by LZF."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from ..errors import InvalidPointsError
from ..types import Array
from .lines import brief, is_number
from .pose import shift, turn
from .rows import read_records, read_rows, too_short
from .table import SCANNER, PointTable, from_columns

_LONGEST = 10_000  # bytes of a line of the header; some have hundreds of fields
_MOST_LINES = 100  # of the header
_MOST_DIGITS = 15  # of a count
_WIDEST = 10_000  # numbers of a point
_TYPES = {f"{kind} {size}": f"{kind.lower()}{size}" for kind in "IU" for size in (1, 2, 4, 8)}
_TYPES |= {"F 4": "f4", "F 8": "f8"}
_COLORS = ("rgb", "rgba")  # fields that hold a color in the bytes of one number
_NOWHERE = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]  # position and rotation, w x y z, of sensors that no one placed
_MOST_REPEATED = 88  # times that LZF may make data longer: three bytes repeat 264 at most


class _Field(NamedTuple):
    name: str
    code: str  # numpy's, without the byte order
    count: int  # type: ignore[assignment]  # numbers of each point


def read_pcd(path: Path) -> PointTable:
    """Read the points of a PCD file with all their fields of one number; those that the sensor missed are left out.

    A file that is no PCD file, or broken, raises `InvalidPointsError`, whose text says where.
    """
    with open(path, "rb") as file:
        fields, count, kind, viewpoint = _read_header(file, path)
        notices: list[str] = []
        if kind == "ascii":
            values = _read_text(file, fields, count, path, notices)
        else:
            values = (_read_binary if kind == "binary" else _read_packed)(file, fields, count, path)
    left_out = [field.name for field in fields if field.count != 1 and field.name != "_"]
    columns = {
        field.name: column
        for field, column in zip(fields, values, strict=True)
        if column is not None and field.name != "_"  # which only fills records
    }
    for name in _COLORS:
        if name in columns:
            columns |= _split_color(columns.pop(name), alpha=name == "rgba")
            break
    table = from_columns(columns, path)
    table.notices += [*notices, *_placed(table, viewpoint, path)]
    if left_out:
        table.notices.append(f"{path.name}: left out {brief(', '.join(left_out))}, with several numbers per point.")
    return table


def _placed(table: PointTable, viewpoint: list[str], path: Path) -> Iterator[str]:
    """Transform a table by the position and rotation of the sensor, as viewers do, and report it unless it has none."""
    numbers = [float(word) for word in viewpoint if is_number(word)]
    if not viewpoint or numbers == _NOWHERE:
        return
    shown = brief(" ".join(viewpoint))
    if (
        len(numbers) != len(viewpoint)
        or len(numbers) != len(_NOWHERE)
        or not np.isfinite(numbers).all()
        or not any(numbers[3:])
    ):
        yield f"{path.name}: VIEWPOINT {shown} is no position with a rotation, and not used. Correct it in the header."
        return
    turn(table, numbers[3:])
    shift(table, np.array(numbers[:3]))
    yield (
        f"{path.name}: moved its points by VIEWPOINT {shown}, as viewers do; {SCANNER} is that position. If they were"
        " in place before, let VIEWPOINT be 0 0 0 1 0 0 0 in the header."
    )


def _read_header(file: BinaryIO, path: Path) -> tuple[list[_Field], int, str, list[str]]:
    """Return the fields, the number of points, the kind of data and the viewpoint; leave the file where data begin."""
    found: dict[str, list[str]] = {}
    for number in range(1, _MOST_LINES):
        line = file.readline(_LONGEST).decode(errors="replace").strip()
        key, *words = line.split() or ["#"]
        match key:
            case _ if key.startswith("#"):
                pass
            case "FIELDS" | "SIZE" | "TYPE" | "COUNT" | "VIEWPOINT":
                found[key] = words
            case "WIDTH" | "HEIGHT" | "POINTS" if len(words) == 1 and _is_count(words[0]):
                found[key] = words
            case "VERSION":
                pass
            case "DATA" if words in (["ascii"], ["binary"], ["binary_compressed"]):
                return *_read_fields(found, path), words[0], found.get("VIEWPOINT", [])
            case _:
                raise InvalidPointsError(
                    f"{path}, line {number}: {line[:60]!r} is not valid in the header of a PCD file. Export it again."
                )
    raise InvalidPointsError(f"{path} has no header of a PCD file that ends with DATA. Export it again.")


def _is_count(word: str) -> bool:
    return word.isdecimal() and word.isascii() and len(word) <= _MOST_DIGITS


def _read_fields(found: dict[str, list[str]], path: Path) -> tuple[list[_Field], int]:
    """Return the fields and the number of points that the lines of a header state."""
    names, sizes, types = (found.get(key, []) for key in ("FIELDS", "SIZE", "TYPE"))
    counts = found.get("COUNT", ["1"] * len(names))
    width, height = (int(found.get(key, [usual])[0]) for key, usual in (("WIDTH", "0"), ("HEIGHT", "1")))
    count = int(found["POINTS"][0]) if "POINTS" in found else width * height
    codes = [_TYPES.get(f"{kind} {size}", "") for kind, size in zip(types, sizes, strict=False)]
    if (
        not len(names) == len(sizes) == len(types) == len(counts)
        or "" in codes
        or not all(map(_is_count, counts))
        or sum(map(int, counts)) > _WIDEST
    ):
        raise InvalidPointsError(
            f"{path} has a header whose lines FIELDS, SIZE, TYPE and COUNT do not fit each other. Export it again."
        )
    return [_Field(name, code, int(number)) for name, code, number in zip(names, codes, counts, strict=True)], count


def _read_text(file: BinaryIO, fields: list[_Field], count: int, path: Path, notices: list[str]) -> list[Array | None]:
    types = [field.code for field in fields for _ in range(field.count)]
    columns = read_rows(file, types, count, path, notices=notices)
    firsts = np.cumsum([0] + [field.count for field in fields])
    return [columns[first] if field.count == 1 else None for field, first in zip(fields, firsts, strict=False)]


def _read_binary(file: BinaryIO, fields: list[_Field], count: int, path: Path) -> list[Array | None]:
    record = np.dtype([(f"f{index}", f"<{field.code}", (field.count,)) for index, field in enumerate(fields)])
    rows = read_records(file, file.tell(), record, count, path)
    return [
        rows[f"f{index}"][:, 0].astype(field.code) if field.count == 1 else None for index, field in enumerate(fields)
    ]


def _read_packed(file: BinaryIO, fields: list[_Field], count: int, path: Path) -> list[Array | None]:
    """Read data compressed as a whole: all values of the first field, then all of the next one."""
    head = file.read(8)
    packed, length = struct.unpack("<II", head) if len(head) == 8 else (0, 0)
    begin, size = file.tell(), file.seek(0, 2)
    sizes = [field.count * int(field.code[1:]) for field in fields]
    if packed > size - begin or length > _MOST_REPEATED * packed or length != count * sum(sizes):
        raise too_short(path, min(length, _MOST_REPEATED * max(size - begin, 0)) // max(sum(sizes), 1), count)
    file.seek(begin)
    data = _unpack(file.read(packed), length)
    places = np.cumsum([0] + [count * size for size in sizes])
    return [
        np.frombuffer(data, f"<{field.code}", count, place).astype(field.code) if field.count == 1 else None
        for field, place in zip(fields, places, strict=False)
    ]


def _unpack(data: bytes, length: int) -> bytearray:
    """Decompress LZF: runs of literal bytes, and repetitions of bytes before, one after another."""
    block: bytes | bytearray
    result = bytearray(length)
    place = done = 0
    try:
        while place < len(data):
            control = data[place]
            place += 1
            if control < 32:
                run = control + 1
                block = data[place : place + run]
                place += run
            else:
                run = control >> 5
                if run == 7:
                    run += data[place]
                    place += 1
                run += 2
                first = done - ((control & 31) << 8) - data[place] - 1
                place += 1
                if first < 0:
                    raise ValueError("its compressed data refer to bytes before the start")
                block = result[first : min(first + run, done)]
                if len(block) < run:  # it repeats itself, too
                    block = (block * (run // len(block) + 1))[:run]
            if len(block) != run or done + run > length:
                raise ValueError("its compressed data are longer than its header states, or truncated")
            result[done : done + run] = block
            done += run
    except IndexError as error:
        raise ValueError("its compressed data are truncated") from error
    if done != length:
        raise ValueError("its compressed data are shorter than its header states")
    return result


def _split_color(column: Array, alpha: bool) -> dict[str, Array]:
    """Return the columns of a color whose bytes are alpha, red, green and blue of a whole number, or of a float."""
    bits = column.astype(np.float32).view(np.uint32) if column.dtype.kind == "f" else column.astype(np.uint32)
    channels = {name: (bits >> shift).astype(np.uint8) for name, shift in (("red", 16), ("green", 8), ("blue", 0))}
    opacity = (bits >> 24).astype(np.uint8)
    return channels | ({"alpha": opacity} if alpha and opacity.any() else {})
