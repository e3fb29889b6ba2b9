"""E57, the files of terrestrial laser scanners: scans that XML describes, each with its pose."""

import itertools
import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np

from ..errors import InvalidPointsError
from ..types import Array, Floats, Ints
from .e57_bytes import PAGE, place_of, read_bytes, read_streams, unpack
from .lines import brief
from .pose import shift, turn
from .rows import unpacks_too_far
from .table import NORMAL, PointTable, full_color, unit_colors

_HEAD = "<8sI12xQQQ"  # magic, version, offset and length of the description, size of a page
_LONGEST = 32_000_000  # bytes of a description; that of a thousand scans has some millions

_SMALLEST = 100.0  # extent of scans in millimeters, in these
_LEAST, _GREATEST = -(2**63), 2**63 - 1  # whole numbers
_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_NORMALS = ("nor:normalX", "nor:normalY", "nor:normalZ")
_COLORS = ("colorRed", "colorGreen", "colorBlue")
_KINDS = ("Integer", "ScaledInteger", "Float", "String")


class _Field(NamedTuple):
    name: str
    kind: str  # of `_KINDS`
    width: int  # bits of a value; texts are not read
    low: int = 0  # limits of whole numbers, before they are scaled
    high: int = 1
    scale: float = 1.0
    offset: float = 0.0


class _Scan(NamedTuple):
    element: Element  # that describes it
    fields: list[_Field]
    count: int  # type: ignore[assignment]  # of its points
    offset: int  # in the file


def read_e57(path: Path) -> PointTable:
    """Read the points of all scans of an E57 file, transformed by their poses, with all numeric fields.

    Each point gets the position of its scanner as a vector, if the file has it, and the number of its scan, if there
    are several. Those that are marked as invalid are left out. A file that is no E57 file, or broken, raises
    `InvalidPointsError`, whose text says where.
    """
    notices: list[str] = []
    tables = [*e57_scans(path, notices)]
    table = _join(tables) if tables else PointTable(np.empty((0, 3)))
    table.notices += notices
    return table


def e57_scans(path: Path, notices: list[str]) -> Iterator[PointTable]:
    """Yield the points of each scan as of `read_e57`; the notices get what was left out, at the end."""
    with open(path, "rb") as file:
        scans = [scan for scan in _find_scans(file, path) if scan.count]
        total = sum(scan.count for scan in scans)
        values = sum(scan.count * max(len(scan.fields), 3) for scan in scans)
        if unpacks_too_far(8 * values, os.fstat(file.fileno()).st_size):  # constant fields take no bytes of the file
            raise InvalidPointsError(f"{path} is too short for the {total:,} points that it names. Copy it again.")
        places, missed = [place_of(scan.offset) for scan in scans], total
        # The same bytes are read for one scan only, or a small file could name them many times.
        ends = dict(reversed([*itertools.pairwise([*sorted(places), np.inf])]))
        whole, extent = True, 0.0
        for index, (place, scan) in enumerate(zip(places, scans, strict=True)):
            table = _read_scan(file, place, ends[place], scan, path)
            whole = whole and bool((table.points % 1.0 == 0.0).all())
            extent = max(extent, *(float(np.ptp(axis)) for axis in table.points.T if len(axis)), 0.0)
            _transform(table, scan.element)
            missed -= len(table.points)
            if len(scans) > 1:
                table.attributes["scan"] = np.full(len(table.points), index, np.int32)
            yield table
    if whole and extent > _SMALLEST:
        notices.append(
            f"{path.name}: all coordinates are whole numbers, up to {extent:,.0f} apart, which E57 counts in meters. If"
            " they are millimeters, scale the points by 0.001."
        )
    texts = {field.name: None for scan in scans for field in scan.fields if field.kind == "String"}
    if texts:
        notices.append(f"{path.name}: left out {brief(', '.join(texts))}, which holds no numbers.")
    if missed:
        notices.append(f"{path.name}: left out {missed} points that the scanner marked as invalid.")


def _find_scans(file: BinaryIO, path: Path) -> list[_Scan]:
    """Return the scans that the description of a file lists."""
    head = file.read(struct.calcsize(_HEAD)).ljust(struct.calcsize(_HEAD), b"\0")
    magic, version, begin, length, page = struct.unpack(_HEAD, head)
    if (magic, version, page) != (b"ASTM-E57", 1, PAGE):
        raise InvalidPointsError(f"{path} is no E57 file: it does not begin with the header of one. Export it again.")
    if length > _LONGEST:
        raise InvalidPointsError(f"{path} describes itself in {length:,} bytes, which is too long. Export it again.")
    root = _parse(read_bytes(file, place_of(begin), length, path).tobytes())
    return [_describe(scan) for scan in root.findall("data3D/vectorChild")]


def _parse(text: bytes) -> Element:
    """Return the root of a tree of XML, whose tags keep their prefixes; in UTF-8, as E57 files are."""
    builder, parser = TreeBuilder(), expat.ParserCreate("UTF-8")
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = _refuse_doctype
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise ValueError(f"its description is no XML: {error}") from error
    return builder.close()


def _refuse_doctype(*_: int | str | None) -> None:
    """Refuse declarations of entities, a few of which may expand to any amount of text."""
    raise ValueError("its description has a DOCTYPE, which E57 files never have")


def _describe(scan: Element) -> _Scan:
    """Return the fields, number and offset of the points of a scan."""
    points, prototype = scan.find("points"), scan.find("points/prototype")
    if points is None or prototype is None:
        raise ValueError("it describes a scan without its points")
    count, offset = int(points.get("recordCount", "0")), int(points.get("fileOffset", "0"))
    if count < 0:
        raise ValueError(f"it describes a scan of {count} points")
    kinds = [(element, element.get("type", "")) for element in prototype.iter()]
    return _Scan(scan, [_field(element, kind) for element, kind in kinds if kind in _KINDS], count, offset)


def _field(element: Element, kind: str) -> _Field:
    """Return a field of a kind."""
    name = element.tag
    if kind == "Float":
        return _Field(name, kind, 32 if element.get("precision") == "single" else 64)
    if kind == "String":
        return _Field(name, kind, 0)
    low, high = int(element.get("minimum", _LEAST)), int(element.get("maximum", _GREATEST))
    if not _LEAST <= low <= high <= _GREATEST:
        raise ValueError(f"the values of {brief(name)} cannot be from {low} to {high}")
    width = (high - low).bit_length()
    if kind == "Integer":
        return _Field(name, kind, width, low, high)
    return _Field(name, kind, width, low, high, float(element.get("scale", 1.0)), float(element.get("offset", 0.0)))


def _read_scan(file: BinaryIO, place: int, end: float, scan: _Scan, path: Path) -> PointTable:
    streams = read_streams(file, place, end, [field.width for field in scan.fields], scan.count, path)
    fields, columns = {}, {}
    for field in scan.fields:
        stream = streams.pop(0)
        if field.kind != "String":
            fields[field.name], columns[field.name] = field, _values(stream, field, scan.count)
    cartesian = fields.keys() >= set(_CARTESIAN)
    names = _CARTESIAN if cartesian else _SPHERICAL
    if not fields.keys() >= set(names):
        raise InvalidPointsError(
            f"{path} has a scan without coordinates among its fields {brief(', '.join(fields))}. Each point needs"
            f" {', '.join(_CARTESIAN)} or {', '.join(_SPHERICAL)}."
        )
    points = np.stack([columns.pop(name) for name in names], axis=1, dtype=np.float64)
    kept = columns.pop("cartesianInvalidState" if cartesian else "sphericalInvalidState", 0) == 0
    kept = kept & ~np.isnan(points).any(axis=1)
    if not kept.all():
        points, columns = points[kept], {name: values[kept] for name, values in columns.items()}
    if not cartesian:
        points = _from_spherical(points)
    table = PointTable(
        points, columns, single=all(fields[name].kind == "Float" and fields[name].width == 32 for name in names)
    )
    if fields.keys() >= set(_COLORS):
        values = np.stack([columns.pop(name) for name in _COLORS], axis=1)
        limits = [_color_range(scan.element, fields[name]) for name in _COLORS]
        table.colors = _unit_colors(values, *np.transpose(limits))
    if fields.keys() >= set(_NORMALS):
        columns[NORMAL] = np.stack([columns.pop(name) for name in _NORMALS], axis=1)
    return table


def _values(stream: Ints, field: _Field, count: int) -> Array:
    """Return the values of a field, (n,): floats, or whole numbers, which may be scaled to floats."""
    if field.kind == "Float":
        code = f"f{field.width // 8}"
        return stream[: count * field.width // 8].view(f"<{code}").astype(code, copy=False)
    values = unpack(stream, field.width, count)
    values += np.uint64(field.low % 2**64)  # below zero, too: sums go round
    values = values.view(np.int64)
    if field.kind == "ScaledInteger":
        return values * field.scale + field.offset
    return values.astype(np.int32) if field.low >= -(2**31) and field.high < 2**31 else values


def _from_spherical(points: Floats) -> Floats:
    """Return the positions of ranges, azimuths and elevations, (n, 3)."""
    distance, azimuth, elevation = points.T
    flat = distance * np.cos(elevation)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), distance * np.sin(elevation)], axis=1)


def _color_range(scan: Element, field: _Field) -> list[float] | tuple[float, float]:
    """Return the values of no and of full color: those of the scan, or else those that the field can have."""
    given = [_number(scan, f"colorLimits/{field.name}{end}", np.nan) for end in ("Minimum", "Maximum")]
    own = [field.scale * limit + field.offset for limit in (field.low, field.high)]
    return next(limits for limits in (given, own, (0.0, 255.0)) if limits[0] < limits[1])


def _unit_colors(values: Array, low: Floats, high: Floats) -> Array:
    """Return colors from 0 to 1 by their limits; by their numbers where they use the low byte alone, or exceed 1."""
    full = full_color(values)
    if not low.any() and (255.0 == full < high.min() or 1.0 == high.max() < full):
        return unit_colors(values)
    return unit_colors((values - low) / (high - low))


def _transform(table: PointTable, scan: Element) -> None:
    """Transform points and normals by the pose of the scanner, if the file has it."""
    if scan.find("pose/rotation") is not None:
        turn(table, [_number(scan, f"pose/rotation/{name}") for name in "wxyz"])
    if scan.find("pose/translation") is not None:
        shift(table, np.array([_number(scan, f"pose/translation/{name}") for name in "xyz"]))


def _number(scan: Element, path: str, default: float = 0.0) -> float:
    """Return a number that describes a scan; zero where its element is empty."""
    element = scan.find(path)
    return default if element is None else float(element.text or 0.0)


def _join(tables: list[PointTable]) -> PointTable:
    """Return one table of several, whose columns are removed; attributes that a scan lacks are zero, colors white."""
    if len(tables) == 1:
        return tables[0]
    likes = {name: values[:0] for table in tables for name, values in table.attributes.items()}
    result = PointTable(
        np.concatenate([table.points for table in tables]), single=any(table.single for table in tables)
    )
    for name, like in likes.items():
        columns = [table.attributes.pop(name, None) for table in tables]
        result.attributes[name] = _stacked(columns, tables, np.zeros(like.shape[1:], like.dtype))
    if any(table.colors is not None for table in tables):
        result.colors = _stacked([table.colors for table in tables], tables, np.ones(4, np.float32))
    return result


def _stacked(columns: list[Array | None], tables: list[PointTable], missing: Array) -> Array:
    """Return the columns of all tables one after another; a table without one gets the missing value at each point."""
    return np.concatenate(
        [
            np.broadcast_to(missing, (len(table.points), *missing.shape)) if column is None else column
            for column, table in zip(columns, tables, strict=True)
        ]
    )
