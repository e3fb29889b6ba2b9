"""LAS and LAZ files written: what they know of a point in their own columns, all else as extra bytes."""

import re
from collections.abc import Iterable, Iterator
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..types import Array, Bools, Floats
from .las_form import FULL, TIME, WKT, LasForm
from .las_packages import import_las
from .ranges import ColumnPieces, Columns, Range, ranges_of
from .table import AXES, CHANNELS, NORMALS

_COLORS, _ALPHA = CHANNELS[:3], CHANNELS[3]
_RETURNS = ("return_number", "number_of_returns")
_LEGACY, _EXTENDED = (0, 1, 2, 3), (6, 7, 8)  # point formats, those of few bits and those of many
_NORMALS = dict(zip(NORMALS, ("NormalX", "NormalY", "NormalZ"), strict=True))  # as other programs find them
_TIMES, _WEEK = "gps_time", 604_800.0  # seconds
_STEPS = 2.0**31  # that a coordinate has
_NAME = 32  # bytes of a name
_FINEST = -9  # power of ten of the finest step: coarser ones compress better


class _Place(NamedTuple):
    """Where columns are written: one of LAS for one of ours, or three of ours as a vector."""

    name: str
    columns: tuple[str, ...]
    dtype: Any

    def values(self, given: Columns) -> Array:
        """Return what is written."""
        if len(self.columns) == 1:
            return given[self.columns[0]].astype(self.dtype, copy=False)
        return np.stack([given[column] for column in self.columns], axis=1)


def write_las(path: Path, pieces: ColumnPieces, name: str, form: LasForm | None = None) -> list[str]:
    """Write a LAS file, compressed if its name ends in .laz, piece by piece.

    Parameters
    ----------
    path : pathlib.Path
    pieces : callable
    name : str
        Of the file, for texts.
    form : LasForm, optional
        Of the file that the points were read from: point format, version, what else its header states, types of extra
        bytes; and steps, on those axes on which all points still are on them. If not given, the version is 1.4, and all
        returns are single ones unless columns tell them.

    Returns
    -------
    list of str
        Notices of differences between what was given and what is written.

    Raises
    ------
    PointCloudError
        laspy or lazrs is missing.
    """
    laspy, _ = import_las()
    ranges, on_steps = _looked_at(pieces, form)
    low, high = np.array([[ranges[axis].low, ranges[axis].high] for axis in AXES], dtype=np.float64).T
    kind = _point_format({number: laspy.PointFormat(number) for number in (*_LEGACY, *_EXTENDED)}, ranges, form)
    first, last = ("1.2", "1.4") if kind in _LEGACY else ("1.4", "1.5")
    version = "1.4" if form is None else min(max(form.version, first), last)
    header = laspy.LasHeader(point_format=kind, version=version)
    header.offsets, header.scales = np.floor(low), np.full(3, _step(low, high))
    places, extras, notices = _places(header.point_format, ranges, form, name)
    header.global_encoding.value = _encoding(kind, ranges)
    if form is not None:
        form.put(header)
        steps = np.where(on_steps, form.scales, header.scales)
        if (steps > form.scales).any():
            notices.append(
                f"{name}: coordinates are rounded to {steps.max():g}, not to {max(form.scales):g} as in the file that"
                " they are from: they reach too far."
            )
        header.offsets, header.scales = np.where(on_steps, form.offsets, header.offsets), steps
    header.add_extra_dims([laspy.ExtraBytesParams(**given) for given in extras])
    for record in header.vlrs.get("ExtraBytesVlr"):
        for item in record.extra_bytes_structs:  # laspy would state ranges, of the first point of each piece alone
            item.options &= ~(item.MIN_BIT_MASK | item.MAX_BIT_MASK)
    if form is None and header.global_encoding.value & TIME:
        notices.append(f"{name}: gps_time goes beyond a week, so it is written as standard GPS time.")
    unknown = [column for column in _RETURNS if form is None and column not in {place.name for place in places}]
    if unknown == [_RETURNS[1]]:
        notices.append(
            f"{name}: no column tells how many returns a pulse had. They are written as those up to each point."
        )
    with laspy.open(str(path), mode="w", header=header, encoding_errors="ignore") as file:  # texts as they were
        for columns in pieces():
            points = laspy.ScaleAwarePointRecord.zeros(len(columns[AXES[0]]), header=header)
            for axis in AXES:
                points[axis] = columns[axis]
            for place in places:
                points[place.name] = place.values(columns)
            for column in unknown:  # zero is invalid
                points[column] = np.maximum(points[_RETURNS[0]], 1)
            file.write_points(points)
    return notices


def _looked_at(pieces: ColumnPieces, form: LasForm | None) -> tuple[dict[str, Range], Bools]:
    """Return the ranges of columns, and on which axes all points are on the steps of a form."""
    on_steps = np.full(3, form is not None)

    def watched() -> Iterator[Columns]:
        for columns in pieces():
            if form is not None:
                on_steps[:] &= form.holds(np.stack([columns[axis] for axis in AXES], axis=1))
            yield columns

    return ranges_of(watched)[1], on_steps


def _point_format(layouts: dict[int, Any], ranges: Iterable[str], form: LasForm | None) -> int:
    """Return the first point format that has most of the columns, from that of a form on."""
    choices = [*_EXTENDED, *_LEGACY]
    wanted = set(ranges)
    if form is not None:
        family = _LEGACY if form.kind in _LEGACY else _EXTENDED
        choices, wanted = [form.kind, *family, *choices], wanted - form.extras.keys()
    return max(choices, key=lambda kind: len(wanted.intersection(layouts[kind].standard_dimension_names)))


def _encoding(kind: int, ranges: dict[str, Range]) -> int:
    """Return the bits of a header that are valid for points of which no file states any."""
    times = ranges.get(_TIMES)
    return WKT * (kind not in _LEGACY) | TIME * (times is not None and times.high > _WEEK)


def _places(
    layout: Any, ranges: dict[str, Range], form: LasForm | None, name: str
) -> tuple[list[_Place], list[dict[str, Any]], list[str]]:
    """Return where columns are written, what describes extra bytes, and notices."""
    places, extras, notices = list[_Place](), list[dict[str, Any]](), list[str]()
    left = {column: found for column, found in ranges.items() if column not in AXES}
    if _ALPHA in left and _COLORS[0] in left and left.pop(_ALPHA).low < (FULL if form is None else form.full):
        notices.append(f"{name}: left out the transparency of colors, which LAS does not have.")
    for column, given in {} if form is None else form.extras.items():
        dtype = np.dtype(given["type"])
        parts = (column,) if not dtype.shape else tuple(f"{column}_{axis}" for axis in AXES)
        if all(part in left for part in parts) and _holds(given, [left[part] for part in parts]):
            places.append(_Place(given["name"], parts, np.float64 if "scales" in given else dtype.base))
            extras.append(given)
            left = {column: found for column, found in left.items() if column not in parts}
    standard = {item.name: item for item in layout.standard_dimensions}
    for column, found in left.items():
        item = standard.get(column)
        if item is not None and (item.dtype == np.float64 or _fits(found, item.min, item.max)):
            places.append(_Place(column, (column,), item.dtype or np.uint8))
            continue
        short = _free(_NORMALS.get(column, column), {*standard, *(given["name"] for given in extras)})
        if short not in (column, _NORMALS.get(column)):
            notices.append(f"{name}: {column} is written as {short}: LAS has short names, and some of its own.")
        places.append(_Place(short, (column,), _storable(found)))
        extras.append({"name": short, "type": _storable(found)})
    return places, extras, notices


def _holds(given: dict[str, Any], parts: list[Range]) -> bool:
    """Whether the numbers of columns fit the type that extra bytes have had."""
    dtype = np.dtype(given["type"]).base
    if dtype.kind == "f":
        return all(np.promote_types(found.dtype, dtype) == dtype or "scales" in given for found in parts)
    limits = np.iinfo(dtype)
    if "scales" not in given:
        return all(_fits(found, limits.min, limits.max) for found in parts)
    with np.errstate(all="ignore"):  # of scales that a file has wrong
        ends = np.array([[found.low, found.high] for found in parts], dtype=np.float64).T
        steps = np.rint((ends - given["offsets"]) / given["scales"])
    return bool(((steps >= limits.min) & (steps <= limits.max)).all())


def _step(low: Floats, high: Floats) -> float:
    """Return the finest power of ten in which coordinates fit."""
    extent = float((high - np.floor(low)).max())
    return float(10.0 ** max(np.ceil(np.log10(max(extent, 1e-300) / _STEPS)), _FINEST))


def _fits(found: Range, least: float, most: float) -> bool:
    return found.whole and found.low >= least and found.high <= most


def _storable(found: Range) -> np.dtype[Any]:
    """Return a type that extra bytes have, and for whole numbers one of no more bytes than they need."""
    if found.dtype == bool:
        return np.dtype(np.uint8)
    if found.dtype.kind in "iu":
        return np.promote_types(np.min_scalar_type(found.low), np.min_scalar_type(found.high))
    return found.dtype


def _free(name: str, taken: set[str]) -> str:
    """Return a name of at most 32 bytes that is not taken."""
    short = re.sub(r"[^\x20-\x7e]", "_", name)[:_NAME]
    numbered = (f"{short[: _NAME - 4]}_{number}" for number in count(2))
    return short if short not in taken else next(free for free in numbered if free not in taken)
