"""LAS and LAZ files written: what they know of a point in their own columns, all else as extra bytes."""

import re
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import PointCloudError
from ..types import Floats
from .ranges import ColumnPieces, Range, ranges_of
from .table import AXES, CHANNELS

_KNOWN = {  # columns of every point, by the greatest number
    "intensity": 65535,
    "classification": 255,
    "return_number": 15,
    "gps_time": np.inf,
}
_COLORS = CHANNELS[:3]
_STEPS = 2.0**31  # that a coordinate has
_NAME = 32  # bytes of a name
_FINEST = -9  # power of ten of the finest step: coarser ones compress better


def write_las(path: Path, pieces: ColumnPieces, name: str) -> list[str]:
    """Write a LAS file of version 1.4, compressed if its name ends in .laz, piece by piece.

    Parameters
    ----------
    path : pathlib.Path
    pieces : callable
    name : str
        Of the file, for texts.

    Returns
    -------
    list of str
        Notices of differences between what was given and what is written.

    Raises
    ------
    PointCloudError
        laspy or lazrs is missing.
    """
    try:
        import laspy
        import lazrs  # noqa: F401
    except ImportError as error:
        raise PointCloudError(
            f"{name} cannot be written: {error.name} is missing. Install laspy and lazrs, or choose another format."
        ) from error
    _, ranges = ranges_of(pieces)
    corners = [ranges.pop(axis) for axis in AXES]
    colored = all(color in ranges for color in _COLORS)
    header = laspy.LasHeader(point_format=7 if colored else 6, version="1.4")
    low, high = np.array([[corner.low, corner.high] for corner in corners], dtype=np.float64).T
    header.offsets, header.scales = np.floor(low), np.full(3, _step(low, high))
    left_out = CHANNELS if colored else ()  # of what becomes a column of its own
    places, extra, notices = dict[str, str](), dict[str, Any](), list[str]()
    for column, found in ranges.items():
        if column in left_out:
            continue
        places[column] = column
        if column not in _KNOWN or not _fits(found, _KNOWN[column]):
            short = _free(column, {*header.point_format.dimension_names, *extra})
            if short != column:
                notices.append(f"{name}: {column} is written as {short}: LAS has short names, and some of its own.")
            places[column], extra[short] = short, _storable(found)
    header.add_extra_dims([laspy.ExtraBytesParams(short, kind) for short, kind in extra.items()])
    for record in header.vlrs.get("ExtraBytesVlr"):
        for item in record.extra_bytes_structs:  # laspy would state ranges, of the first point of each piece alone
            item.options &= ~(item.MIN_BIT_MASK | item.MAX_BIT_MASK)
    with laspy.open(str(path), mode="w", header=header) as file:
        for columns in pieces():
            points = laspy.ScaleAwarePointRecord.zeros(len(columns[AXES[0]]), header=header)
            for axis in AXES:
                points[axis] = columns[axis]
            for color in _COLORS if colored else ():
                points[color] = columns[color].astype(np.uint16) * 257  # of eight bits to sixteen
            for column, place in places.items():
                points[place] = columns[column].astype(extra.get(place, columns[column].dtype), copy=False)
            file.write_points(points)
    return notices


def _step(low: Floats, high: Floats) -> float:
    """Return the finest power of ten in which coordinates fit."""
    extent = float((high - np.floor(low)).max())
    return float(10.0 ** max(np.ceil(np.log10(max(extent, 1e-300) / _STEPS)), _FINEST))


def _fits(found: Range, most: float) -> bool:
    return (found.whole or most == np.inf) and found.low >= 0 and found.high <= most


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
