"""The contents of a point file: coordinates, and other values, of each point."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain, count
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InvalidPointsError, TooFewPointsError
from ..types import Array, Bools, FilePath, Floats
from .las_form import LasForm
from .lines import brief

NORMAL = "normal"  # the attribute that files call nx ny nz
SCANNER = "scanner"  # the attribute of positions of the scanner that measured a point, which move with the points
NORMALS = ("nx", "ny", "nz")
_NORMALS = (NORMALS, ("normalx", "normaly", "normalz"))  # in lower case
_COLORS = (("red", "green", "blue"), ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue"))
CHANNELS = ("red", "green", "blue", "alpha")
_ALPHAS = (("alpha",), ("diffuse_alpha",), ("a",))
_DEPTHS = (8, 10, 12, 16, 32)  # bits of a color
AXES = ("x", "y", "z")
FARTHEST = 1e30  # of a coordinate, below the end of single precision, so that differences are numbers, too


@dataclass
class PointTable:
    """Points with attributes.

    Attributes
    ----------
    points : ndarray, (n, 3) float64
    attributes : dict of str to ndarray
        Numbers, whole numbers or truth values (n,), or vectors (n, 3).
    colors : ndarray, (n, 4) float32, or None
        Red, green, blue and alpha from 0 to 1, in sRGB.
    single : bool
        Whether the coordinates were kept in single precision.
    degrees : bool
        Whether x and y are known to be longitude and latitude.
    notices : list of str
        Which data were left out.
    las : LasForm or None
        Of a LAS file: what it states besides, so that such files are written as it was.
    owner : object or None
        What the points belong to, where a program holds more of it than points, and writes to it.
    """

    points: Floats
    attributes: dict[str, Array] = field(default_factory=dict)
    colors: Floats | None = None
    single: bool = False
    degrees: bool = False
    notices: list[str] = field(default_factory=list)
    las: LasForm | None = None
    owner: Any = None


def from_columns(columns: dict[str, Array], path: Path) -> PointTable:
    """Make a table of columns by the names that files give them.

    Parameters
    ----------
    columns : dict of str to ndarray, (n,)
        x, y and z among them; nx ny nz, or NormalX NormalY NormalZ, become the attribute "normal", three columns
        a_x a_y a_z the vector a, and red green blue, r g b, with alpha, the colors.
    path : pathlib.Path
        The file, for the texts of errors.
    """
    table, channels = gather_columns(columns, path)
    color_by(table, channels, path)
    return table


def gather_columns(columns: dict[str, Array], path: Path) -> tuple[PointTable, dict[str, Array]]:
    """Make a table without colors of columns as of `from_columns`, and return the columns of the colors, too.

    These are red, green, blue and alpha, in the numbers of the file, or none.
    """
    named = {name.lower(): name for name in reversed(columns)}  # the first of those that differ in case only
    missing = [axis for axis in AXES if axis not in named]
    if missing:
        raise InvalidPointsError(
            f"{path} has no {' '.join(missing)} among its columns {brief(', '.join(columns))}. Each point needs x y z."
        )
    left = dict(columns)

    def take(names: tuple[str, ...]) -> list[Array] | None:
        """Take columns out by their lower case names; none if one is missing."""
        if not all(name in named and named[name] in left for name in names):
            return None
        return [left.pop(named[name]) for name in names]

    coordinates = [left.pop(named[axis]) for axis in AXES]
    table = PointTable(np.stack(coordinates, axis=1, dtype=np.float64))
    table.single = any(values.dtype == np.float32 for values in coordinates)
    channels = next(filter(None, map(take, _COLORS)), [])
    if channels:
        channels = [*channels, *next(filter(None, map(take, _ALPHAS)), [])]
    table.attributes |= take_normals(left)
    for name in columns:
        match = re.fullmatch(r"(.+)_x", name)
        vector = [f"{match[1]}_{axis}" for axis in AXES] if match else []
        if match and all(component in left for component in vector):
            table.attributes[match[1]] = np.stack([left.pop(component) for component in vector], axis=1)
        elif name in left:
            table.attributes[name] = left.pop(name)
    return table, dict(zip(CHANNELS, channels, strict=False))


def normal_names(names: Iterable[str]) -> list[str]:
    """Return which of some names are the three of normals, in their order; none if one is missing."""
    named = {name.lower(): name for name in reversed([*names])}  # the first of those that differ in case only
    return next(([named[name] for name in known] for known in _NORMALS if named.keys() >= set(known)), [])


def take_normals(columns: dict[str, Array]) -> dict[str, Array]:
    """Take the normals out of columns by the names that files give them, and return them as the attribute."""
    normals = [columns.pop(name) for name in normal_names(columns)]
    return {NORMAL: np.stack(normals, axis=1)} if normals else {}


def color_by(table: PointTable, channels: dict[str, Array], path: Path) -> None:
    """Give a table the colors of columns by the names in `CHANNELS`, if there are any."""
    if channels:
        colors = np.stack([channels[name] for name in CHANNELS[:3]], axis=1)
        table.colors = unit_colors(colors, channels.get(CHANNELS[3]))
        table.notices += depth_notices(colors, path)


def unit_colors(colors: Array, alpha: Floats | None = None, full: float | None = None) -> Array:
    """Return colors from 0 to 1.

    Parameters
    ----------
    colors : ndarray, (n, 3)
        Red, green and blue in the range of their file.
    alpha : ndarray, (n,), optional
        In a range of its own.
    full : float, optional
        The number of a full color, where these are some of more; else that of them alone, see `full_color`.

    Returns
    -------
    ndarray, (n, 4) float32
    """
    result = np.ones((len(colors), 4), np.float32)
    for unit, given, known in ((result[:, :3], colors, full), (result[:, 3], alpha, None)):
        if given is not None:
            given = given.view(np.uint8) if given.dtype == np.int8 else given  # which programs use as bytes
            np.divide(given, np.float32(known or full_color(given)), out=unit, casting="same_kind")
    return np.fmin(np.fmax(result, 0.0, out=result), 1.0, out=result)  # NaN becomes 0


def full_color(values: Array) -> float:
    """Return the number of a full color: 255 for types of one byte, otherwise by the largest value.

    Programs write 8, 10 or 12 bits in types of 16, and from 0 to 1 in whole numbers where all colors are pure.
    """
    if values.dtype.itemsize == 1:
        return 255.0
    largest = float(np.fmax.reduce(values, axis=None, initial=0))
    bright = largest < 2.0 and not (values == np.round(values)).all()  # brighter than 1, since whole numbers would be
    if largest <= 1.0 or bright:
        return 1.0
    return next((2.0**bits - 1.0 for bits in _DEPTHS if largest < 2.0**bits), 1.0)


def depth_notices(colors: Array, path: Path) -> Iterator[str]:
    """Report the depth of colors, where it is unusual."""
    full = full_color(colors)
    if full in (1023.0, 4095.0):
        yield f"{path.name}: no color is above {full:g}, so the range is taken as 0 to {full:g}."


def to_columns(table: PointTable, double: bool = True, full: float = 255.0) -> dict[str, Array]:
    """Return the columns of a table by the names of files, numbers as they are; the reverse of `from_columns`.

    Coordinates stay in double precision if asked for; `full` is the number of a full color.
    """
    columns = dict(zip(AXES, (table.points if double else table.points.astype(np.float32)).T, strict=True))
    attributes = dict(table.attributes)
    if NORMAL in attributes and attributes[NORMAL].ndim == 2:
        columns.update(zip(NORMALS, attributes.pop(NORMAL).T, strict=True))
    if table.colors is not None:
        values = np.round(full * table.colors).astype(np.min_scalar_type(int(full)))
        columns.update(zip(CHANNELS, values.T, strict=True))
    for name, values in attributes.items():
        columns.update((_free_name(new, columns), numbers) for new, numbers in split_columns(name, values).items())
    return columns


def split_columns(name: str, values: Array) -> dict[str, Array]:
    """Return an attribute as columns of numbers by their names: vectors as one of each axis."""
    if values.ndim == 1:
        return {name: values}
    return {f"{name}_{axis}": column for axis, column in zip(AXES[: len(values.T)], values.T, strict=True)}


def _free_name(name: str, columns: dict[str, Array]) -> str:
    """Return a name for one more column, with a number if it is taken: an attribute may be called x."""
    numbered = (f"{name}_{number}" for number in count(2))
    return next(free for free in chain([name], numbered) if free not in columns)


def without_missed(table: PointTable, path: Path) -> PointTable:
    """Return a table, modified in place, without the points that have no valid coordinates, which a notice tells.

    Sensors write NaN for rays without a hit, other programs the largest number.
    """
    missed = Missed()
    kept = missed.add(table.points)
    if not missed.count or missed.far == len(kept):
        return table
    if missed.count == len(kept):
        raise TooFewPointsError(
            f"{path} has no points: all {missed.count} have no valid coordinates ({missed.values}). Export it again."
        )
    table.points = table.points[kept]
    table.attributes = {name: values[kept] for name, values in table.attributes.items()}
    table.colors = None if table.colors is None else table.colors[kept]
    table.notices += missed.notices(path)
    return table


class Missed:
    """Counts points without valid coordinates: `count` those looked at, and `far` those of them with finite ones."""

    def __init__(self) -> None:
        self.count = self.far = 0
        self._infinite = False

    def add(self, points: Floats) -> Bools:
        """Look at points, (k, 3), and return which of them have valid coordinates."""
        kept: Bools = np.all(np.abs(points) <= FARTHEST, axis=1)
        wrong = points[~kept]
        self.count += len(wrong)
        self.far += int(np.count_nonzero(np.isfinite(wrong).all(axis=1)))
        self._infinite = self._infinite or bool(np.isinf(wrong).any())
        return kept

    @property
    def values(self) -> str:
        """What they have instead."""
        values = "NaN or infinity" if self._infinite else "NaN"
        return f"{values}, or beyond {FARTHEST:g}" if self.far else values

    def notices(self, path: Path) -> Iterator[str]:
        """Report that they were left out."""
        if self.count:
            yield f"{path.name}: left out {self.count} points that the sensor missed ({self.values})."


def check_places(points: Floats, path: FilePath) -> float:
    """Refuse a file without points, or with coordinates that are not finite or too large, and return the largest."""
    if len(points) == 0:
        raise TooFewPointsError(f"{path} has no points. Give a file with points.")
    largest = float(np.abs(points).max())
    if largest <= FARTHEST:
        return largest
    bad, fault = np.flatnonzero(~np.isfinite(points).all(axis=1)), "not finite (NaN or infinity)"
    if len(bad) == 0:
        bad, fault = np.flatnonzero((np.abs(points) > FARTHEST).any(axis=1)), f"beyond {FARTHEST:g}"
    raise InvalidPointsError(
        f"{path}: {len(bad)} of {len(points)} points have coordinates that are {fault}, the first of them is"
        f" point {bad[0] + 1}. Delete these points from the file."
    )
