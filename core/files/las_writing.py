"""LAS and LAZ files written: what they know of a point in their own columns, all else as extra bytes."""

import re
from itertools import count
from pathlib import Path

import numpy as np

from ..errors import PointCloudError
from ..types import Array, Floats
from .table import PointTable, to_columns

LASER_FILES = (".las", ".laz")
_KNOWN = {  # columns of every point, by the greatest number
    "intensity": 65535,
    "classification": 255,
    "return_number": 15,
    "gps_time": np.inf,
}
_COLORS = ("red", "green", "blue")
_STEPS = 2.0**31  # that a coordinate has
_NAME = 32  # bytes of a name
_FINEST = -9  # power of ten of the finest step: coarser ones compress better


def write_las(path: Path, table: PointTable) -> list[str]:
    """Write a table to a LAS file of version 1.4, compressed if its name ends in .laz.

    Parameters
    ----------
    path : pathlib.Path
    table : PointTable

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
            f"{path} cannot be written: {error.name} is missing. Install laspy and lazrs, or choose another format."
        ) from error
    columns, notices = to_columns(table), list[str]()
    for axis in ("x", "y", "z"):
        del columns[axis]
    colored = all(name in columns for name in _COLORS)
    header = laspy.LasHeader(point_format=7 if colored else 6, version="1.4")
    low = table.points.min(axis=0) if len(table.points) else np.zeros(3)
    header.offsets, header.scales = np.floor(low), np.full(3, _step(table.points))
    las = laspy.LasData(header)
    las.xyz = table.points
    if colored:
        for name in _COLORS:
            las[name] = columns.pop(name).astype(np.uint16) * 257  # of eight bits to sixteen
        columns.pop("alpha", None)
    extra: dict[str, Array] = {}
    for name, values in columns.items():
        if name in _KNOWN and _fits(values, _KNOWN[name]):
            las[name] = values
        else:
            short = _free(name, {*header.point_format.dimension_names, *extra})
            if short != name:
                notices.append(f"{path.name}: {name} is written as {short}: LAS has short names, and some of its own.")
            extra[short] = _storable(values)
    if extra:
        las.add_extra_dims([laspy.ExtraBytesParams(name, values.dtype) for name, values in extra.items()])
        for name, values in extra.items():
            las[name] = values
    las.write(str(path))
    return notices


def _step(points: Floats) -> float:
    """Return the finest power of ten in which coordinates fit."""
    if not len(points):
        return 1e-3
    extent = float((points.max(axis=0) - np.floor(points.min(axis=0))).max())
    return float(10.0 ** max(np.ceil(np.log10(max(extent, 1e-300) / _STEPS)), _FINEST))


def _fits(values: Array, most: float) -> bool:
    whole = most == np.inf or bool(np.all(values == np.round(values)))
    return whole and bool(np.all((values >= 0) & (values <= most)))


def _storable(values: Array) -> Array:
    """Return numbers in a type that extra bytes have, and whole ones in no more bytes than they need."""
    if values.dtype == bool:
        return values.astype(np.uint8)
    if values.dtype.kind in "iu" and len(values):
        return values.astype(np.promote_types(np.min_scalar_type(values.min()), np.min_scalar_type(values.max())))
    return values


def _free(name: str, taken: set[str]) -> str:
    """Return a name of at most 32 bytes that is not taken."""
    short = re.sub(r"[^\x20-\x7e]", "_", name)[:_NAME]
    numbered = (f"{short[: _NAME - 4]}_{number}" for number in count(2))
    return short if short not in taken else next(free for free in numbered if free not in taken)
