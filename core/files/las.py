"""LAS and LAZ, the files of laser scanners, by laspy and lazrs."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from ..errors import TooFewPointsError
from ..types import Array, Bools, Floats
from .copc import Box, Octree, read_octree, records_of
from .las_choices import LasChoices
from .las_form import COMPATIBLE, OFFSET, SYSTEM, LasForm, is_lost, read_form
from .las_packages import import_las
from .las_packing import PackedChunk, Record, check_header, check_size, read_records
from .reference import Reference, read_reference
from .rows import too_short
from .table import CHANNELS, NORMAL, NORMALS, PointTable, color_by, full_color, normal_names, take_normals

_COLUMNS = ("intensity", "classification", "return_number", "nir")  # that become attributes, if they exist
_OPTIONAL = (  # and these, unless they are zero everywhere, which stands for none
    "gps_time",
    "number_of_returns",
    "scan_direction_flag",
    "edge_of_flight_line",
    "synthetic",
    "key_point",
    "overlap",
    "scanner_channel",
    "scan_angle_rank",
    "scan_angle",
    "user_data",
    "point_source_id",
)
_WAVEFORMS = "wavepacket_index"
_COLORS = CHANNELS[:3]
_WITHHELD = "withheld"
_NUMBERS = (1, 3)  # of a column that becomes an attribute
_BLOCK = 2**16  # points that are read at once
_CLASSES = 256
_MOST_DEGREES = 360.0


class LasFile(NamedTuple):
    """An open file."""

    path: Path
    file: BinaryIO
    reader: Any  # at the first point
    chunks: list[PackedChunk]  # of compressed points
    reference: Reference  # what it states of its coordinates
    records: list[Record]

    @property
    def octree(self) -> Octree | None:
        """The nodes of a cloud optimized file; None of another one."""
        return read_octree(self.file, self.chunks, self.path)

    def places(self, block: Any, kept: Bools | slice = slice(None)) -> Floats:
        """Return the coordinates of points, (n, 3)."""
        header = self.reader.header
        columns = [block[name][kept] * header.scales[axis] + header.offsets[axis] for axis, name in enumerate("XYZ")]
        return np.stack(columns, axis=1)

    def names(self, withheld: bool = False) -> list[str]:
        """Return the names of the other numbers of a point, those of the flag among them if it is asked for."""
        names = [*self._sources(withheld)]
        normals = normal_names(names)
        return [*(name for name in names if name not in normals), *([NORMAL] if normals else [])]

    def columns(self, block: Any, kept: Bools | slice, withheld: bool = False) -> dict[str, Array]:
        """Return the other numbers of points by name: red, green and blue, and those that become attributes."""
        columns = {name: np.asarray(block[source])[kept] for name, source in self._sources(withheld).items()}
        if withheld:
            columns[_WITHHELD] = columns[_WITHHELD].astype(np.uint8)
        return columns | take_normals(columns)

    def _sources(self, withheld: bool) -> dict[str, str]:
        """Return laspy's names of what is read, by ours."""
        known = set(self.reader.header.point_format.standard_dimension_names)
        colors = _COLORS if known.issuperset(_COLORS) else ()
        names = [*colors, *(name for name in (*_COLUMNS, *_OPTIONAL) if name in known)]
        extra = {name: item.name for name, item in self._extras.items()}
        return {**dict(zip(names, names, strict=True)), **extra, **({_WITHHELD: _WITHHELD} if withheld else {})}

    @property
    def _extras(self) -> dict[str, Any]:
        """The extra bytes that are read, by our names."""
        extra = self.reader.header.point_format.extra_dimensions
        return {" ".join(item.name.split()) or "extra": item for item in extra if item.num_elements in _NUMBERS}

    def form(self, las: LasChoices) -> LasForm:
        """Return what the file states besides, in the unit that is read."""
        extras = self._extras
        normals = dict(zip(normal_names(extras), NORMALS, strict=False))  # as `to_columns` names them
        named = {normals.get(name, name): item for name, item in extras.items()}
        return read_form(self.reader.header, self.records, named).scaled(self.scale(las))

    def notices(self) -> list[str]:
        """Report the columns and records that are not read, and times that LAS 1.4 would count from another begin."""
        layout, name = self.reader.header.point_format, self.path.name
        extra = [item for item in layout.extra_dimensions if item.num_elements not in _NUMBERS]
        notices = [f"{name}: left out {item.name}, which has {item.num_elements} numbers per point." for item in extra]
        if _WAVEFORMS in layout.standard_dimension_names:
            notices.append(
                f"{name}: left out the waveforms of its points, {_WAVEFORMS} to z_t. Use the file itself for these."
            )
        lost = [f"{record.user} {record.number}" for record in self.records if is_lost(record)]
        if lost:
            notices.append(
                f"{name}: left out records of its header, {', '.join(lost)}, which are long, or of these points alone."
            )
        if COMPATIBLE in {record.user for record in self.records}:
            notices.append(
                f"{name}: was written for programs before LAS 1.4: classes above 31, numbers of returns above 7 and"
                " fine scan angles are in the columns called LAS 1.4 and so on. LASzip can save it without that mode."
            )
        header = self.reader.header
        if header.global_encoding.value & OFFSET:
            notices.append(
                f"{name}: its GPS times begin {header.gps_time_offset} million seconds after the begin of GPS time, as"
                " LAS 1.5 may tell, not 1000. LAS files keep that; elsewhere do not compare them."
            )
        return notices

    def is_geographic(self, points: Floats) -> bool:
        """Whether coordinates, (n, 3), are longitude and latitude: the file states it, and they are not too large."""
        return self.reference.geographic and bool(np.abs(points[:, :2]).max(initial=0.0) <= _MOST_DEGREES)

    def scale(self, las: LasChoices) -> Floats:
        """Return the factors of coordinates in the file to those that are read, (3,)."""
        return self.reference.meters if las.meters else np.ones(3)


@contextmanager
def opened_las(path: Path) -> Iterator[LasFile]:
    """Open a LAS or LAZ file; if it is broken, or laspy or lazrs is missing, raise `PointCloudError`."""
    laspy, lazrs = import_las()
    with open(path, "rb") as file:
        check_header(file, path)
        try:
            # Not in parallel: that takes memory for as many points as a file names in a chunk.
            with laspy.open(file, closefd=False, read_evlrs=False, laz_backend=laspy.LazBackend.Lazrs) as reader:
                chunks = check_size(file, reader.header, path)
                records = read_records(file, reader.header)
                for user, number, text, data, after in records:
                    if after and user == SYSTEM and data is not None:
                        reader.header.vlrs.append(laspy.vlrs.known.vlr_factory(laspy.VLR(user, number, text, data)))
                yield LasFile(path, file, reader, chunks, read_reference(reader.header), records)
        except (laspy.errors.LaspyException, lazrs.LazrsError) as error:
            raise ValueError(f"{error}") from error  # `read_points` reports it as numpy's


def read_las(path: Path, las: LasChoices = LasChoices()) -> PointTable:
    """Read a LAS or LAZ file: coordinates, colors, all other columns of its format but waveforms, and extra dimensions.

    Points that are flagged as withheld are left out, unless they are chosen, as are those of classes that are not. A
    broken file raises `PointCloudError`, as where laspy or lazrs is missing.
    """
    with opened_las(path) as file:
        count, tally, done = file.reader.header.point_count, Tally(las), 0
        table = PointTable(np.empty((count, 3)), notices=file.notices(), las=file.form(las))
        for points, columns in las_pieces(file, tally, _BLOCK):
            rows = slice(done, done + len(points))
            table.points[rows] = points
            for name, values in columns.items():
                _put(table, name, rows, values, count)
            done = rows.stop
        table.notices += [*tally.notices(path), *file.reference.notices(path, las.meters)]
        tally.refuse_none(path)
        if done < count:
            table.points = table.points[:done]
            table.attributes = {name: values[:done] for name, values in table.attributes.items()}
        settle_columns(table, path, _COLORS)
        table.degrees = file.is_geographic(table.points)
    return table


def settle_columns(table: PointTable, path: Path, channels: Sequence[str] = CHANNELS) -> None:
    """Drop columns that are zero everywhere from the attributes of a table, and color it by some, unless all are black.

    Both stand for none: programs write zeros where they have no times or flags, and scanners without a camera black.
    """
    for name in _OPTIONAL:
        if not table.attributes.get(name, np.ones(1)).any():
            del table.attributes[name]
    if table.attributes.keys() >= set(_COLORS):
        found = {name: table.attributes.pop(name) for name in channels if name in table.attributes}
        if any(found[name].any() for name in _COLORS):
            color_by(table, found, path)
            if table.las is not None:
                table.las = replace(table.las, full=full_color(np.array([found[name].max() for name in _COLORS])))


def las_pieces(
    file: LasFile, tally: "Tally", size: int, box: Box | None = None, level: int | None = None
) -> Iterator[tuple[Floats, dict[str, Array]]]:
    """Yield coordinates and other numbers of points, piece by piece.

    Parameters
    ----------
    file : LasFile
    tally : Tally
        Chooses and counts points.
    size : int
        Of a piece at most; but nodes of an octree are read whole.
    box : tuple of two ndarray, (3,), optional
        Its lowest and highest corner. Nothing is read that by header or octree is outside; other points may be.
    level : int, optional
        The last level of an octree that is read.
    """
    header, scale = file.reader.header, file.scale(tally.choices)
    box = None if box is None else (box[0] / scale, box[1] / scale)
    if box is not None and ((header.maxs < box[0]) | (header.mins > box[1])).any():
        return
    whole = box is None and level is None
    octree = None if whole else file.octree
    if octree is None:
        blocks = file.reader.chunk_iterator(size)
    else:
        blocks = records_of(file.file, header, octree.nodes(box, level), size)
    for block in blocks:
        kept = tally.keep(block)
        points = file.places(block, kept) * scale
        if len(points):
            yield points, file.columns(block, kept, tally.choices.withheld)
    if octree is None and tally.total < header.point_count:
        raise too_short(file.path, tally.total, header.point_count)


class Tally:
    """Selects the points that are read, and counts those of each class."""

    def __init__(self, choices: LasChoices) -> None:
        self.choices = choices
        self.total = self._withheld = 0
        self._found = np.zeros(_CLASSES, int)  # but withheld ones, unless these are read

    def keep(self, block: Any) -> Bools | slice:
        """Return which points of a block are read, as an index."""
        withheld, classes = np.asarray(block["withheld"]).astype(bool), np.asarray(block["classification"])
        kept = ~withheld | self.choices.withheld
        self.total += len(kept)
        self._withheld += int(np.count_nonzero(withheld))
        self._found += np.bincount(classes[kept], minlength=_CLASSES)
        if self.choices.classes:
            kept &= np.isin(classes, [*self.choices.classes])
        return slice(None) if kept.all() else kept

    @property
    def _others(self) -> int:
        """Points of other classes than those chosen."""
        chosen = [*self.choices.classes] or slice(None)
        return int(self._found.sum() - self._found[chosen].sum())

    def notices(self, path: Path) -> list[str]:
        """Report which points were left out."""
        result = []
        if self._withheld and self.choices.withheld:
            result.append(f"{path.name}: {self._withheld} points are withheld, which means deleted; they are kept.")
        elif self._withheld:
            result.append(f"{path.name}: left out {self._withheld_text}")
        if self._others:
            result.append(f"{path.name}: left out {self._others} points of other classes than those chosen.")
        return result

    @property
    def _withheld_text(self) -> str:
        return f"{self._withheld} withheld points, which means deleted. LasChoices.withheld keeps them."

    def refuse_none(self, path: Path) -> None:
        """Refuse a file of whose points none is left."""
        if not self.total or self._found.sum() > self._others:
            return
        if not self._others:
            raise TooFewPointsError(f"{path} has no points but {self._withheld_text}")
        there = ", ".join(f"{number} ({self._found[number]:,} points)" for number in np.flatnonzero(self._found))
        wanted = ", ".join(map(str, sorted(self.choices.classes)))
        raise TooFewPointsError(f"{path} has no points of the classes {wanted}. Choose some of {there}.")


def _put(table: PointTable, name: str, rows: slice, values: Array, count: int) -> None:
    """Write values to some rows of an attribute, which is created with so many at the first ones."""
    if name not in table.attributes:
        table.attributes[name] = np.empty((count, *values.shape[1:]), values.dtype)
    table.attributes[name][rows] = values
