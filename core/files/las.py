"""LAS and LAZ, the formats of laser scans: by laspy, and lazrs for what is compressed."""

import numpy as np

from ..errors import InvalidPointsError, PointCloudError
from .table import PointTable

_COLUMNS = ("intensity", "classification", "return_number")  # of every LAS file
_COLORS = ("red", "green", "blue")
_PACKED = 100  # bytes of points in one of a LAZ file at most; 5 to 20 are usual
_HEAD = 105  # bytes of a header up to the kind of its points
_RECORD = 54  # bytes of a variable length record at least
_CHUNK = 20  # bytes of a chunk at least: its first point is not compressed
_BLOCK = 1 << 18  # points read at one time


def read_las(path) -> PointTable:
    """Read a LAS or LAZ file: coordinates, intensity, class, return, colors and what its maker added.

    Raises
    ------
    InvalidPointsError
        It is no such file, or broken; the text says where.
    PointCloudError
        laspy or lazrs is not there.
    """
    try:
        import laspy  # only here: all else does without
        import lazrs
    except ImportError as error:
        raise PointCloudError(
            f"{path} is read by laspy and lazrs, which are not there ({error}). Install both, or convert it to PLY."
        ) from error
    with open(path, "rb") as file:
        size = _check_head(file, path)
        try:
            return _read(laspy.open(file, closefd=False), size, path)
        except (laspy.errors.LaspyException, lazrs.LazrsError, AttributeError, KeyError, TypeError) as error:
            raise InvalidPointsError(f"{path} is a broken LAS file: {error}. Copy or export it again.") from error
        except BaseException as error:
            if type(error).__module__ != "pyo3_runtime":  # what lazrs raises where it finds no way on
                raise
            raise InvalidPointsError(f"{path} is a broken LAZ file: {error}. Copy or export it again.") from error


def _check_head(file, path):
    """Refuse a file that names more than can follow, before it is looked for; return the size of the file.

    Lazrs would end the process where it is told to make room for more chunks than memory can hold.
    """
    head, size = file.read(_HEAD), file.seek(0, 2)
    if not head.startswith(b"LASF"):
        raise InvalidPointsError(f"{path} is no LAS file: it does not begin with LASF. Export it again.")
    begin, records = _number(head, 96, 4), _number(head, 100, 4)
    if len(head) < _HEAD or begin > size or records * _RECORD > size:
        raise InvalidPointsError(f"{path} ends before its points begin. Copy it again.")
    if head[104] & 0xC0:  # compressed
        file.seek(begin)
        table = _number(file.read(8), 0, 8)
        if table > size:  # as it is told where a file was written without going back
            file.seek(-8, 2)
            table = _number(file.read(8), 0, 8)
        file.seek(min(table, size))
        if _number(file.read(8), 4, 4) * _CHUNK > size:
            raise InvalidPointsError(f"{path} is too short for the chunks that it names. Copy it again.")
    file.seek(0)
    return size


def _number(data, begin, width):
    return int.from_bytes(data[begin : begin + width], "little")


def _read(reader, size, path):
    header = reader.header
    kind, count = header.point_format, header.point_count
    held = _PACKED * size if header.are_points_compressed else size - header.offset_to_point_data
    if count * kind.size > held:  # before there is memory for so many
        raise InvalidPointsError(f"{path} is too short for the {count:,} points that its header names. Copy it again.")
    names = [name for name in (*_COLUMNS, *kind.extra_dimension_names) if _is_kept(kind.dimension_by_name(name))]
    colored = set(_COLORS) <= set(kind.dimension_names)
    table = PointTable(np.empty((count, 3)))
    colors = np.empty((count, 3), np.uint16) if colored else None
    done = 0
    for block in reader.chunk_iterator(_BLOCK):
        rows = slice(done, done + len(block))
        for axis, name in enumerate("xyz"):
            table.points[rows, axis] = block[name]
        for name in names:
            values = np.asarray(block[name])
            if name not in table.attributes:
                table.attributes[name] = np.empty((count, *values.shape[1:]), values.dtype)
            table.attributes[name][rows] = values
        if colored:
            colors[rows] = np.stack([block[name] for name in _COLORS], axis=1)
        done = rows.stop
    if done < count:
        raise InvalidPointsError(
            f"{path} ends after {done} of the {count} points that its header names. Copy it again."
        )
    if colored and count:
        full = 255.0 if colors.max() <= 255 else 65535.0  # some programs use the low byte alone
        table.colors = np.ones((count, 4), np.float32)
        table.colors[:, :3] = colors / np.float32(full)
    return table


def _is_kept(dimension):
    """Whether a column holds a number or a vector."""
    return dimension.num_elements in {1, 3}
