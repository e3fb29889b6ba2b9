"""LAS and LAZ, the files of laser scanners: by laspy and lazrs, imported only here."""

import os
import struct
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ..errors import InvalidPointsError, PointCloudError, TooFewPointsError
from ..types import Array, Bools
from .las_choices import LasChoices
from .rows import too_short, unpacks_too_far
from .table import PointTable, depth_notices, unit_colors

_TIMES = "gps_time"
_COLUMNS = ("intensity", "classification", "return_number", "nir", _TIMES)  # that become attributes, if they exist
_COLORS = ("red", "green", "blue")
_BLOCK = 2**16  # points that are read at once
_SHORTEST = 227  # bytes of a header

_DETAIL = 54  # bytes of a variable length record at least
_CHUNKED, _LAYERED = 2, 3  # kinds of compression
# Items of a compressed point by number: bytes, and layers if there are any. Others are extra bytes, a layer for each.
_ITEMS = {6: (20, 0), 7: (8, 0), 8: (6, 0), 9: (29, 0), 10: (30, 9), 11: (6, 1), 12: (8, 2), 13: (29, 1)}
_EXTRA = (0, 14)
_CLASSES = 256
_MOST_DEGREES = 360.0
_GEOGRAPHIC = (1024, 2)  # key of GeoTIFF and its value


def read_las(path: Path, las: LasChoices = LasChoices()) -> PointTable:
    """Read a LAS or LAZ file: coordinates, intensity, class, return, colors and extra dimensions.

    Points that are flagged as withheld are left out, unless they are chosen, as are those of classes that are not.

    Raises
    ------
    PointCloudError
        laspy or lazrs is missing, or the file is broken.
    """
    try:
        import laspy
        import lazrs
    except ImportError as error:
        raise PointCloudError(
            f"{path} cannot be read: {error.name} is missing. Install laspy and lazrs, or export the points as PLY."
        ) from error
    with open(path, "rb") as file:
        _check_header(file, path)
        try:
            # Not in parallel: that takes memory for as many points as a file names in a chunk.
            with laspy.open(file, closefd=False, read_evlrs=False, laz_backend=laspy.LazBackend.Lazrs) as reader:
                _check_size(file, reader.header, path)
                return _read(reader, path, las)
        except (laspy.errors.LaspyException, lazrs.LazrsError) as error:
            raise ValueError(f"{error}") from error  # `read_points` reports it as numpy's


def _check_header(file: BinaryIO, path: Path) -> None:
    """Refuse files that are not LAS, or state more records than fit: laspy would search them all."""
    size = os.fstat(file.fileno()).st_size
    data = file.read(_SHORTEST)
    if len(data) < _SHORTEST or data[:4] != b"LASF":
        raise InvalidPointsError(f"{path} is no LAS file: it does not begin with the header of one. Export it again.")
    length, begin, details = struct.unpack_from("<HII", data, 94)
    if length + details * _DETAIL > begin or begin > size:
        raise InvalidPointsError(
            f"{path} is shorter than its header states: {details} records before byte {begin:,} of {size:,}. Copy it"
            " again."
        )
    file.seek(0)


def _check_size(file: BinaryIO, header: Any, path: Path) -> None:
    """Refuse a file that is too short for its points, before there is memory for them."""
    begin, size = header.offset_to_point_data, os.fstat(file.fileno()).st_size
    needed = header.point_count * header.point_format.size
    if unpacks_too_far(needed, size) if header.are_points_compressed else needed > size - begin:
        raise InvalidPointsError(
            f"{path} is shorter than the {header.point_count:,} points that its header states. Copy it again."
        )
    if header.are_points_compressed and header.point_count:
        _check_packing(file, begin, size, header, path)
        file.seek(begin)


def _check_packing(file: BinaryIO, begin: int, size: int, header: Any, path: Path) -> None:
    """Refuse compressed points whose chunks are longer than the file.

    lazrs allocates memory for whatever a file states, and aborts the whole program where there is too little.
    """
    import lazrs

    found = [detail.record_data for detail in header.vlrs.get("LasZipVlr")]
    kind, items = (0, []) if not found else _read_items(found[0])
    wanted = [size for number, size in items if number in _ITEMS and _ITEMS[number][0] != size]
    if (
        kind not in (_CHUNKED, _LAYERED)
        or wanted
        or sum(size for _, size in items) != header.point_format.size
        or any(number not in _ITEMS and number not in _EXTRA for number, _ in items)
    ):
        raise InvalidPointsError(f"{path} uses an unknown compression, or is corrupted. Save it again as LAS.")
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
    place, left = begin + 8, header.point_count
    layers = sum(_ITEMS[number][1] if number in _ITEMS else length for number, length in items)
    for count, length in lazrs.read_chunk_table(file, lazrs.LazVlr(found[0])):
        if left <= 0:
            break  # writers may begin a chunk at the end that gets no points
        if not 0 <= length <= end - place:
            raise fault
        if kind == _LAYERED:
            head = header.point_format.size + 4 * (1 + layers)
            if length < head or sum(read(f"<{layers}I", place + head - 4 * layers)) != length - head:
                raise fault
        place, left = place + length, left - count
    if left > 0:
        raise fault


def _read_items(data: bytes) -> tuple[int, list[tuple[int, ...]]]:
    """Return the kind of compression, and number and bytes of each item of a point."""
    (kind,), (count,) = struct.unpack_from("<H", data), struct.unpack_from("<H", data, 32)
    return kind, [struct.unpack_from("<HH", data, 34 + 6 * index) for index in range(count)]


def _read(reader: Any, path: Path, choices: LasChoices) -> PointTable:
    """Read the points block by block."""
    header = reader.header
    count, known = header.point_count, set(header.point_format.dimension_names)
    names = [name for name in (*_COLUMNS, *header.point_format.extra_dimension_names) if name in known]
    table, tally = PointTable(np.empty((count, 3))), _Tally(choices)
    colors = np.empty((count, 3), np.uint16) if known.issuperset(_COLORS) else None
    done = 0
    for block in reader.chunk_iterator(_BLOCK):
        kept = tally.keep(block)
        for axis, name in enumerate("XYZ"):
            values = block[name][kept] * header.scales[axis] + header.offsets[axis]
            rows = slice(done, done + len(values))
            table.points[rows, axis] = values
        if colors is not None:
            for axis, name in enumerate(_COLORS):
                colors[rows, axis] = block[name][kept]
        for name in names:
            values = np.asarray(block[name])
            if values.shape[1:] in ((), (3,)):
                _put(table, " ".join(name.split()) or "extra", rows, values[kept], count)
            elif done == 0:
                table.notices.append(f"{path.name}: left out {name}, which has {values.shape[1]} numbers per point.")
        if choices.withheld:
            _put(table, "withheld", rows, np.asarray(block["withheld"])[kept].astype(np.uint8), count)
        done = rows.stop
    if tally.total < count:
        raise too_short(path, tally.total, count)
    table.notices += tally.notices(path, done)
    if done < count:
        table.points = table.points[:done]
        table.attributes = {name: values[:done] for name, values in table.attributes.items()}
    if not table.attributes.get(_TIMES, np.ones(1)).any():  # some programs write zeros where they have none
        del table.attributes[_TIMES]
    if colors is not None and colors[:done].any():  # scanners without a camera write black
        table.colors = unit_colors(colors[:done])
        table.notices += depth_notices(colors[:done], path)
    table.degrees = np.abs(table.points[:, :2]).max(initial=0.0) <= _MOST_DEGREES and _is_geographic(header)
    return table


class _Tally:
    """Selects the points that are read, and counts those of each class."""

    def __init__(self, choices: LasChoices) -> None:
        self._choices = choices
        self.total = self._withheld = 0
        self._found = np.zeros(_CLASSES, int)  # but withheld ones, unless these are read

    def keep(self, block: Any) -> Bools | slice:
        """Return which points of a block are read, as an index."""
        withheld, classes = np.asarray(block["withheld"]).astype(bool), np.asarray(block["classification"])
        kept = ~withheld | self._choices.withheld
        self.total += len(kept)
        self._withheld += int(np.count_nonzero(withheld))
        self._found += np.bincount(classes[kept], minlength=_CLASSES)
        if self._choices.classes:
            kept &= np.isin(classes, [*self._choices.classes])
        return slice(None) if kept.all() else kept

    def notices(self, path: Path, count: int) -> list[str]:
        """Report which points were left out, where this many are read; refuse a file of which none is left."""
        others, result = self._found.sum() - count, []
        if self._withheld and self._choices.withheld:
            result.append(f"{path.name}: {self._withheld} points are withheld, which means deleted; they are kept.")
        elif self._withheld:
            withheld = f"{self._withheld} withheld points, which means deleted. Withheld Points keeps them."
            if not count and not others:
                raise TooFewPointsError(f"{path} has no points but {withheld}")
            result.append(f"{path.name}: left out {withheld}")
        if others and not count:
            there = ", ".join(f"{number} ({self._found[number]:,} points)" for number in np.flatnonzero(self._found))
            wanted = ", ".join(map(str, sorted(self._choices.classes)))
            raise TooFewPointsError(f"{path} has no points of the classes {wanted}. Choose some of {there}.")
        if others:
            result.append(f"{path.name}: left out {others} points of other classes than those chosen.")
        return result


def _put(table: PointTable, name: str, rows: slice, values: Array, count: int) -> None:
    """Write values to some rows of an attribute, which is created with so many at the first ones."""
    if name not in table.attributes:
        table.attributes[name] = np.empty((count, *values.shape[1:]), values.dtype)
    table.attributes[name][rows] = values


def _is_geographic(header: Any) -> bool:
    """Whether a file states that its coordinates are longitude and latitude: by its keys of GeoTIFF, or by WKT."""
    words = "".join(detail.string for detail in header.vlrs.get("WktCoordinateSystemVlr"))
    if words:
        return ("GEOG" in words or "GEODCRS" in words) and "PROJ" not in words
    keys = [key for detail in header.vlrs.get("GeoKeyDirectoryVlr") for key in detail.geo_keys]
    return any((key.id, key.value_offset) == _GEOGRAPHIC for key in keys)
