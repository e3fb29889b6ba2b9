"""What LAS and LAZ files state about themselves, checked before laspy and lazrs act on it."""

import os
import struct
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from ..errors import InvalidPointsError
from .las_packages import import_las
from .rows import unpacks_too_far

_SHORTEST = 227  # bytes of a header
_LENGTHS, _LENGTHS_AT = struct.Struct("<HII"), 94  # of the header, of all before the points, and how many records
_BEFORE, _AFTER = struct.Struct("<2x16sHH32s"), struct.Struct("<2x16sHQ32s")  # what a record begins with
_MOST = 65535  # bytes of a record before the points
_CHUNKED, _LAYERED = 2, 3  # kinds of compression
# Items of a compressed point by number: bytes, and layers if there are any. Others are extra bytes, a layer for each.
_ITEMS = {6: (20, 0), 7: (8, 0), 8: (6, 0), 9: (29, 0), 10: (30, 9), 11: (6, 1), 12: (8, 2), 13: (29, 1)}
_EXTRA = (0, 14)
_LATEST = 3  # version of these that lazrs reads


class Record(NamedTuple):
    """A record of a file."""

    user: str  # whose it is
    number: int
    text: str  # what it is
    data: bytes | None  # None where it is longer than one before the points may be, or than the file
    after: bool  # whether it lies after the points


class PackedChunk(NamedTuple):
    """Compressed points of a file that follow each other: where they begin, their bytes, and how many they are."""

    place: int
    length: int
    count: int  # type: ignore[assignment]  # in place of the method of tuples


def check_header(file: BinaryIO, path: Path) -> None:
    """Refuse files that are not LAS, or state more records than fit: laspy would search them all."""
    size = os.fstat(file.fileno()).st_size
    data = file.read(_SHORTEST)
    if len(data) < _SHORTEST or data[:4] != b"LASF":
        raise InvalidPointsError(f"{path} is no LAS file: it does not begin with the header of one. Export it again.")
    length, begin, details = _LENGTHS.unpack_from(data, _LENGTHS_AT)
    if length + details * _BEFORE.size > begin or begin > size:
        raise InvalidPointsError(
            f"{path} is shorter than its header states: {details} records before byte {begin:,} of {size:,}. Copy it"
            " again."
        )
    file.seek(0)


def read_records(file: BinaryIO, header: Any) -> list[Record]:
    """Return all records: laspy would read those after the points whole, however long they are, and change some."""
    back, size, result = file.tell(), os.fstat(file.fileno()).st_size, list[Record]()
    file.seek(_LENGTHS_AT)
    begin, _, before = _LENGTHS.unpack(file.read(_LENGTHS.size))
    after = header.start_of_first_evlr, header.number_of_evlrs
    for head, (place, count) in ((_BEFORE, (begin, before)), (_AFTER, after)):
        for _ in range(count):
            if not 0 < place <= size - head.size:
                break
            file.seek(place)
            user, number, length, text = head.unpack(file.read(head.size))
            place += head.size
            data = file.read(length) if length <= min(_MOST, size - place) else None
            result.append(Record(_text(user), number, _text(text), data, head is _AFTER))
            place += length
    file.seek(back)
    return result


def _text(data: bytes) -> str:
    return data.partition(b"\0")[0].decode("latin-1")


def check_size(file: BinaryIO, header: Any, path: Path) -> list[PackedChunk]:
    """Refuse a file that is too short for its points, before there is memory for them.

    Return the chunks of compressed points; none where they are not compressed.
    """
    begin, size = header.offset_to_point_data, os.fstat(file.fileno()).st_size
    needed = header.point_count * header.point_format.size
    if unpacks_too_far(needed, size) if header.are_points_compressed else needed > size - begin:
        raise InvalidPointsError(
            f"{path} is shorter than the {header.point_count:,} points that its header states. Copy it again."
        )
    if header.are_points_compressed and header.point_count:
        chunks = _check_packing(file, begin, size, header, path)
        file.seek(begin)
        return chunks
    return []


def _check_packing(file: BinaryIO, begin: int, size: int, header: Any, path: Path) -> list[PackedChunk]:
    """Return the chunks of compressed points; refuse those that are longer than the file.

    lazrs allocates memory for whatever a file states, and aborts the whole program where there is too little.
    """
    _, lazrs = import_las()
    found = [detail.record_data for detail in header.vlrs.get("LasZipVlr")]
    kind, items = (0, []) if not found else _read_items(found[0])
    known = all(number in _ITEMS or number in _EXTRA for number, _, _ in items)
    latest = max((version for _, _, version in items), default=0)
    wanted = [size for number, size, _ in items if number in _ITEMS and _ITEMS[number][0] != size]
    if (
        kind not in (_CHUNKED, _LAYERED)
        or wanted
        or sum(size for _, size, _ in items) != header.point_format.size
        or not known
        or latest > _LATEST
    ):
        newer = f"by LASzip: it is of version {latest} of that, and lazrs reads {_LATEST} at most"
        cause = newer if known and latest == _LATEST + 1 else "copy it again: it may be corrupted"
        raise InvalidPointsError(
            f"{path} uses an unknown compression. Save it again as LAS by the program that it is from, or {cause}."
        )
    fault = InvalidPointsError(f"{path} is broken: its compressed points do not match its header. Copy it again.")

    def read(code: str, place: int) -> tuple[int, ...]:
        length = struct.calcsize(code)
        if not begin <= place <= size - length:
            raise fault
        file.seek(place)
        return struct.unpack(code, file.read(length))

    (end,) = read("<q", begin)
    if end == -1:  # of programs that write sequentially
        (end,) = read("<q", size - 8)
    _, chunks = read("<II", end)
    if (chunks - 1) * header.point_format.size > end - begin - 8:  # each begins with a whole point, if it has any
        raise fault
    file.seek(begin)
    place, left, result = begin + 8, header.point_count, []
    layers = sum(_ITEMS[number][1] if number in _ITEMS else length for number, length, _ in items)
    for count, length in lazrs.read_chunk_table(file, lazrs.LazVlr(found[0])):
        if left <= 0:
            break  # writers may begin a chunk at the end that gets no points
        if not 0 <= length <= end - place:
            raise fault
        if kind == _LAYERED:
            head = header.point_format.size + 4 * (1 + layers)
            if length < head or sum(read(f"<{layers}I", place + head - 4 * layers)) != length - head:
                raise fault
        result.append(PackedChunk(place, length, count))
        place, left = place + length, left - count
    if left > 0:
        raise fault
    return result


def _read_items(data: bytes) -> tuple[int, list[tuple[int, ...]]]:
    """Return the kind of compression, and number, bytes and version of each item of a point."""
    (kind,), (count,) = struct.unpack_from("<H", data), struct.unpack_from("<H", data, 32)
    return kind, [struct.unpack_from("<HHH", data, 34 + 6 * index) for index in range(count)]
