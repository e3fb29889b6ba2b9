"""Records of binary PLY files with lists, which are skipped: each is a number of items, and these."""

import os
import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import BinaryIO, TypeAlias

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..errors import InvalidPointsError
from ..types import Array, Ints
from .rows import too_short

Code: TypeAlias = str | tuple[str, str]  # of a number, or of the length and the items of a list
Part: TypeAlias = tuple[list[str], tuple[str, str] | None]

_BLOCK = 2**16  # records that are found before their numbers are read
_LONGEST = 1000  # numbers of a list that are looked at


def read_fixed(file: BinaryIO, begin: int, order: str, types: Sequence[Code], count: int, path: Path) -> list[Array]:
    """Read the columns of records that are no lists.

    Parameters
    ----------
    file : file object
    begin : int
        Where the first record begins.
    order : {"<", ">"}
        Of the bytes.
    types : list of str, or of pairs of str
        numpy's code of each property; of a list that of its length, and of its items.
    count : int
        Of the records.
    path : pathlib.Path
        The file, for the texts of errors.
    """
    data, place = _rest(file, begin, types, count, path), 0
    rows = _equal_records(data, order, types, count)
    if rows is not None:
        return [rows[f"f{index}"].astype(code) for index, code in enumerate(types) if isinstance(code, str)]
    parts = _divide(types)
    columns = [np.empty(count, code) for codes, _ in parts for code in codes]
    octets = np.frombuffer(data, np.uint8)
    for done in range(0, count, _BLOCK):
        marks, place = _walk(data, place, order, parts, min(_BLOCK, count - done), path, (done, count))
        index = 0
        for starts, (codes, _) in zip(marks.T, parts, strict=True):
            record = np.dtype([(f"f{number}", order + code) for number, code in enumerate(codes)])
            if not codes:
                continue
            records = sliding_window_view(octets, record.itemsize)[starts].view(record)[:, 0]
            for number in range(len(codes)):
                columns[index][done : done + len(marks)] = records[f"f{number}"]
                index += 1
    return columns


def end_of_records(file: BinaryIO, begin: int, order: str, types: Sequence[Code], count: int, path: Path) -> int:
    """Return where records end; the parameters are those of `read_fixed`."""
    if all(isinstance(code, str) for code in types):
        return begin + count * np.dtype([(f"f{index}", code) for index, code in enumerate(types)]).itemsize
    data, place = _rest(file, begin, types, count, path), 0
    rows = _equal_records(data, order, types, count)
    if rows is not None:
        return begin + rows.nbytes
    for done in range(0, count, _BLOCK):
        _, place = _walk(data, place, order, _divide(types), min(_BLOCK, count - done), path, (done, count))
    return begin + place


def first_list(file: BinaryIO, begin: int, order: str, code: tuple[str, str]) -> Ints:
    """Return the numbers of the list with which the first record begins; fewer where the file ends before."""
    size, item = (np.dtype(order + part) for part in code)
    file.seek(begin)
    count = np.frombuffer(file.read(size.itemsize).ljust(size.itemsize, b"\0"), size)[0]
    found = np.frombuffer(file.read(item.itemsize * min(max(int(count), 0), _LONGEST)), np.uint8)
    return found[: len(found) // item.itemsize * item.itemsize].view(item).astype(np.int64)


def _rest(file: BinaryIO, begin: int, types: Sequence[Code], count: int, path: Path) -> bytes:
    """Return the bytes of a file from a place on; refuse one that is too short for so many empty lists."""
    least = sum(int((code if isinstance(code, str) else code[0])[1:]) for code in types)
    found = max(os.fstat(file.fileno()).st_size - begin, 0) // least
    if found < count:
        raise too_short(path, found, count)
    file.seek(begin)
    return file.read()


def _equal_records(data: bytes, order: str, types: Sequence[Code], count: int) -> Array | None:
    """Return records whose lists are all as long as those of the first one; None if they are not."""
    fields, lengths, size = [], {}, 0
    for index, code in enumerate(types):
        if isinstance(code, tuple):
            number = _reader(data, order, code[0])
            try:
                length = number(size)
            except (IndexError, struct.error):  # the file ends there
                return None
            fields += [(f"n{index}", order + code[0]), (f"f{index}", f"V{max(length, 0) * int(code[1][1:])}")]
            lengths[f"n{index}"] = length
        else:
            fields.append((f"f{index}", order + code))
        size = np.dtype(fields).itemsize
    if count * size > len(data):
        return None
    rows = np.frombuffer(data, np.dtype(fields), count)
    return rows if all((rows[name] == length).all() for name, length in lengths.items()) else None


def _divide(types: Sequence[Code]) -> list[Part]:
    """Divide properties after each list: codes of those before it, and its own; None after the last list."""
    parts: list[Part] = [([], None)]
    for code in types:
        if isinstance(code, tuple):
            parts[-1] = (parts[-1][0], code)
            parts.append(([], None))
        else:
            parts[-1][0].append(code)
    return parts


def _reader(data: bytes, order: str, code: str) -> Callable[[int], int]:
    """Return a function that reads the number at an offset."""
    if code == "u1":
        return data.__getitem__
    read = struct.Struct(order + np.dtype(code).char).unpack_from
    return lambda place: read(data, place)[0]


def _walk(
    data: bytes, place: int, order: str, parts: list[Part], count: int, path: Path, progress: tuple[int, int]
) -> tuple[Ints, int]:
    """Find records one by one, since the offset of each depends on all before.

    Returns
    -------
    ndarray, (count, parts) int64
        Where the properties before each list begin, and those after the last one.
    int
        Where the next record begins.
    """
    steps = [
        (sum(int(code[1:]) for code in codes), _reader(data, order, pair[0]), int(pair[0][1:]), int(pair[1][1:]))
        for codes, pair in parts
        if pair is not None
    ]
    tail, marks = sum(int(code[1:]) for code in parts[-1][0]), []
    try:
        for _ in range(count):
            for fixed, number, head, item in steps:
                marks.append(place)
                place += fixed
                length = number(place)
                if length < 0:
                    raise InvalidPointsError(f"{path} is broken: it has a list of {length} numbers. Export it again.")
                place += head + length * item
            marks.append(place)
            place += tail
    except (IndexError, struct.error):  # the file ends here
        place = len(data) + 1
    if place > len(data):
        done, total = progress
        raise too_short(path, done + max(len(marks) - 1, 0) // len(parts), total)
    return np.array(marks, np.int64).reshape(-1, len(parts)), place
