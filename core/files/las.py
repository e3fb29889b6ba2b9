"""LAS and LAZ, the files of laser scanners: by laspy and lazrs, which nothing else needs."""

import os
import struct

import numpy as np

from ..errors import InvalidPointsError, PointCloudError
from .table import PointTable, unit_colors

_COLUMNS = ("intensity", "classification", "return_number", "nir")  # that become attributes, where a file has them
_COLORS = ("red", "green", "blue")
_BLOCK = 2**16  # points that are read at once
_SHORTEST = 227  # bytes of a header
_RATIO = 100  # of unpacked to packed points, which have 3 to 20 ...
_HARMLESS = 64e6  # ... or fewer bytes than this
_DETAIL = 54  # bytes of a variable length record at least
_CHUNKED, _LAYERED = 2, 3  # kinds of packing
# Items of a packed point by number: bytes, and layers if packed in layers. Others are extra bytes, a layer for each.
_ITEMS = {6: (20, 0), 7: (8, 0), 8: (6, 0), 9: (29, 0), 10: (30, 9), 11: (6, 1), 12: (8, 2), 13: (29, 1)}
_EXTRA = (0, 14)


def read_las(path) -> PointTable:
    """Read a LAS or LAZ file: coordinates, intensity, class, return, colors and what its maker added.

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
                return _read(reader, path)
        except (laspy.errors.LaspyException, lazrs.LazrsError) as error:
            raise ValueError(f"{error}") from error  # `read_points` tells it as it tells numpy's


def _check_header(file, path):
    """Refuse what is no LAS file, or names more records than it has room for: laspy would look for them all."""
    size = os.fstat(file.fileno()).st_size
    data = file.read(_SHORTEST)
    if len(data) < _SHORTEST or data[:4] != b"LASF":
        raise InvalidPointsError(f"{path} is no LAS file: it does not begin with the header of one. Export it again.")
    length, begin, details = struct.unpack_from("<HII", data, 94)
    if length + details * _DETAIL > begin or begin > size:
        raise InvalidPointsError(
            f"{path} has no room for what its header names: {details} records before byte {begin:,} of {size:,}. Copy"
            " it again."
        )
    file.seek(0)


def _check_size(file, header, path):
    """Refuse a file that is too short for its points, before there is memory for them."""
    begin, size = header.offset_to_point_data, os.fstat(file.fileno()).st_size
    needed = header.point_count * header.point_format.size
    if needed > (max(_RATIO * size, _HARMLESS) if header.are_points_compressed else size - begin):
        raise InvalidPointsError(
            f"{path} is too short for the {header.point_count:,} points that its header names. Copy it again."
        )
    if header.are_points_compressed and header.point_count:
        _check_packing(file, begin, size, header, path)
        file.seek(begin)


def _check_packing(file, begin, size, header, path):
    """Refuse packed points whose parts are longer than the file.

    lazrs takes memory for whatever a file names, and ends the whole program where there is too little.
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
        raise InvalidPointsError(f"{path} is packed in a way that is not known, or broken. Save it again as LAS.")
    fault = InvalidPointsError(f"{path} is broken: its packed points are not where it says. Copy or export it again.")

    def read(code, place):
        length = struct.calcsize(code)
        if not begin <= place <= size - length:
            raise fault
        file.seek(place)
        return struct.unpack(code, file.read(length))

    (end,) = read("<q", begin)
    if end == -1:  # of programs that cannot go back
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


def _read_items(data):
    """Return the kind of packing, and number and bytes of each item of a point."""
    (kind,), (count,) = struct.unpack_from("<H", data), struct.unpack_from("<H", data, 32)
    return kind, [struct.unpack_from("<HH", data, 34 + 6 * index) for index in range(count)]


def _read(reader, path):
    header = reader.header
    count, known = header.point_count, set(header.point_format.dimension_names)
    extra = list(header.point_format.extra_dimension_names)
    table = PointTable(np.empty((count, 3)))
    colors = np.empty((count, 3), np.uint16) if known.issuperset(_COLORS) else None
    done = 0
    for block in reader.chunk_iterator(_BLOCK):
        rows = slice(done, done + len(block))
        for axis, name in enumerate("XYZ"):
            table.points[rows, axis] = block[name] * header.scales[axis] + header.offsets[axis]
        if colors is not None:
            for axis, name in enumerate(_COLORS):
                colors[rows, axis] = block[name]
        for name in [*_COLUMNS, *extra]:
            if name not in known:
                continue
            values = np.asarray(block[name])
            if values.shape[1:] in ((), (3,)):
                label = " ".join(name.split()) or "extra"
                if label not in table.attributes:
                    table.attributes[label] = np.empty((count, *values.shape[1:]), values.dtype)
                table.attributes[label][rows] = values
            elif done == 0:
                table.notices.append(f"{path.name}: left out {name}, which has {values.shape[1]} numbers a point.")
        done = rows.stop
    if done < count:
        raise InvalidPointsError(
            f"{path} ends after {done} of the {count} points that its header names. Copy it again."
        )
    if colors is not None and colors.any():  # all black are those of scanners without a camera
        table.colors = unit_colors(colors)
    return table
