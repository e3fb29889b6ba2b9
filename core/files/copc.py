"""COPC, cloud optimized point clouds: LAZ files whose chunks are the nodes of an octree, coarse levels first."""

import os
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, TypeAlias

import numpy as np

from ..errors import InvalidPointsError
from ..types import Array, Floats
from .las_packages import import_las
from .las_packing import PackedChunk

Box: TypeAlias = tuple[Floats, Floats]  # the lowest and the highest corner

_HEAD = 375  # bytes of the header, after which the octree's own record comes first
_RECORD = "<2x16sHH32x"  # who wrote it, number, length
_WRITER, _NUMBER = b"copc", 1
_OCTREE = "<5d2Q"  # center, half an edge, spacing at the root; offset and length of the first page
_ENTRY = np.dtype([("level", "<i4"), ("cell", "<i4", 3), ("place", "<u8"), ("length", "<i4"), ("count", "<i4")])
_PAGE = -1  # in place of a number of points: the entry is that of a further page


class Octree(NamedTuple):
    """The nodes of a file."""

    low: Floats  # (3,), the lowest corner of the root
    edge: float  # of the root
    entries: Array  # (m,), of nodes with points, in the order of the file: level, cell, place, length and count

    def nodes(self, box: Box | None, level: int | None) -> list[PackedChunk]:
        """Return the nodes up to a level, or of all, that meet a box, if there is one, by its two corners."""
        found = self.entries if level is None else self.entries[self.entries["level"] <= level]
        if box is not None:
            edge = self.edge * 0.5 ** found["level"][:, None]
            begin = self.low + found["cell"] * edge
            margin = 1e-6 * edge  # for points that were rounded to the other side of a face
            found = found[((begin - margin <= box[1]) & (begin + edge + margin >= box[0])).all(axis=1)]
        return [PackedChunk(*map(int, entry)) for entry in found[["place", "length", "count"]].tolist()]


def read_octree(file: BinaryIO, chunks: Sequence[PackedChunk], path: Path) -> Octree | None:
    """Read the octree of an open file, which is left where it was; None if it has none.

    The nodes must be the chunks of the file, whose name is for the texts of errors.
    """
    back = file.tell()
    file.seek(_HEAD)
    data = file.read(struct.calcsize(_RECORD) + struct.calcsize(_OCTREE))
    if len(data) < struct.calcsize(_RECORD) + struct.calcsize(_OCTREE):
        file.seek(back)
        return None
    writer, number, _ = struct.unpack_from(_RECORD, data)
    if (writer.rstrip(b"\0"), number) != (_WRITER, _NUMBER):
        file.seek(back)
        return None
    *center, half, _, place, length = struct.unpack_from(_OCTREE, data, struct.calcsize(_RECORD))
    entries = _read_pages(file, place, length, path)
    file.seek(back)
    entries = entries[np.argsort(entries["place"])]
    found = [tuple(entry) for entry in entries[["place", "length", "count"]].tolist()]
    if found != [chunk for chunk in chunks if chunk.count] or not np.isfinite([*center, half]).all():
        raise InvalidPointsError(f"{path} is broken: its octree does not match its points. Copy it again.")
    return Octree(np.array(center) - half, 2.0 * half, entries)


def _read_pages(file: BinaryIO, place: int, length: int, path: Path) -> Array:
    """Read the entries of nodes with points from all pages."""
    size, pending, seen, nodes = os.fstat(file.fileno()).st_size, [(place, length)], set(), [np.empty(0, _ENTRY)]
    while pending:
        place, length = pending.pop()
        if place in seen or not 0 <= length <= size - place or length % _ENTRY.itemsize:
            raise InvalidPointsError(f"{path} is broken: its octree has an invalid page. Copy it again.")
        seen.add(place)
        file.seek(place)
        entries = np.frombuffer(file.read(length), _ENTRY)
        further = entries["count"] == _PAGE
        pending += entries[further][["place", "length"]].tolist()
        nodes.append(entries[entries["count"] > 0])
    return np.concatenate(nodes)


def records_of(file: BinaryIO, header: Any, nodes: Sequence[PackedChunk], size: int) -> Iterator[Any]:
    """Yield the points of nodes, given in the order of the file, as records of laspy.

    So many are read at once, unless one node has more.
    """
    laspy, lazrs = import_las()

    (packing,) = (detail.record_data for detail in header.vlrs.get("LasZipVlr"))
    everything = laspy.DecompressionSelection.all().to_lazrs()
    for group in _groups(nodes, size):
        packed = bytearray()
        for node in group:
            file.seek(node.place)
            packed += file.read(node.length)
        data = np.zeros(sum(node.count for node in group) * header.point_format.size, np.uint8)
        table = [(node.count, node.length) for node in group]
        lazrs.decompress_points_with_chunk_table(packed, packing, data, table, everything)
        yield laspy.PackedPointRecord.from_buffer(data, header.point_format)


def _groups(nodes: Sequence[PackedChunk], size: int) -> Iterator[list[PackedChunk]]:
    """Yield runs of nodes that have so many points together, or one alone that has more."""
    group: list[PackedChunk] = []
    for node in nodes:
        if group and sum(other.count for other in group) + node.count > size:
            yield group
            group = []
        group.append(node)
    if group:
        yield group
