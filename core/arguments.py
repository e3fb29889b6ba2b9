"""Checks of the numbers, switches and arrays that callers give, and their conversion."""

from collections.abc import Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .errors import InvalidPointsError, PointCloudError, TooFewPointsError
from .types import Array, FilePath, Floats

Shape: TypeAlias = tuple[int | None, ...]

_HUGE = 1e100  # of a coordinate, so that no product overflows
_LARGEST = 1e60  # coordinates [L] of points, and its inverse the least extent: powers of lengths must be numbers, too


def real(given: Any) -> float:
    """Return a real number as a float; NaN, which no comparison lets pass, for anything else."""
    number = given[()] if isinstance(given, np.ndarray) and given.ndim == 0 else given
    if isinstance(number, bool) or not isinstance(number, Real):
        return np.nan
    try:
        return float(number)
    except OverflowError:  # a whole number of more than 308 digits
        return np.inf if given > 0 else -np.inf


def whole(given: Any) -> float:
    """Return a whole number as an int; NaN, which no comparison lets pass, for anything else."""
    if isinstance(given, Integral) and not isinstance(given, bool):
        return int(given)
    number = real(given)
    return int(number) if np.isfinite(number) and number == np.floor(number) else np.nan


def positive(given: Any, name: str) -> float:
    """Return a finite number above zero as a float; something else raises `PointCloudError`."""
    number = real(given)
    if not 0.0 < number < np.inf:
        raise PointCloudError(f"The {name} is {given!r}. Use a number above zero.")
    return number


def not_negative(given: Any, name: str) -> float:
    """Return a finite number that is not negative as a float; something else raises `PointCloudError`."""
    number = real(given)
    if not 0.0 <= number < np.inf:
        raise PointCloudError(f"The {name} is {given!r}. Use a number that is not negative.")
    return number


def as_path(given: FilePath) -> Path:
    """Return the path of a name; what is neither a text nor path-like raises `PointCloudError`."""
    try:
        return Path(given)
    except TypeError as error:
        raise PointCloudError(f"{given!r} is no name of a file. Give a text or a path.") from error


def check_switches(**switches: Any) -> None:
    """Check that arguments are truth values; something else raises `PointCloudError`."""
    for name, value in switches.items():
        if not isinstance(value, bool | np.bool_):
            raise PointCloudError(f"Option {name} is {value!r}. Use True or False.")


def as_array(given: ArrayLike, name: str) -> Array:
    """Return an argument as an array; rows of different lengths, or masked values, raise `InvalidPointsError`."""
    try:
        array = np.asarray(given)
    except (TypeError, ValueError) as error:
        raise InvalidPointsError(f"{name} must be an array with rows of one length: {error}.") from error
    masked = np.count_nonzero(np.ma.getmask(given))
    if masked:
        raise InvalidPointsError(f"{name} have {masked} masked values. Leave their points out, or fill them.")
    return array


def as_doubles(array: Array, copy: bool = True) -> Floats:
    """Return an array of real numbers in double precision; those beyond its range become infinite."""
    with np.errstate(over="ignore"):
        return array.astype(np.float64, copy=copy)


def check_array(given: ArrayLike, name: str, shapes: Sequence[Shape], advice: str, kinds: str = "iuf") -> Array:
    """Return an argument as an array of numbers of one of some shapes.

    Parameters
    ----------
    given : array_like
    name : str
        What it is, as a plural that begins a sentence.
    shapes : sequence of tuple of int or None
        None for any length.
    advice : str
        A sentence that says what to give.
    kinds : str
        numpy's kinds of types: integers, unsigned ones, floating-point numbers, truth values (b).

    Raises
    ------
    InvalidPointsError
        Another shape or type.
    """
    array = as_array(given, name)
    if array.dtype.kind not in kinds or not any(_fits(array.shape, shape) for shape in shapes):
        raise InvalidPointsError(f"{name} have the shape {array.shape} and type {array.dtype}. {advice}")
    return array


def _fits(shape: tuple[int, ...], wanted: Shape) -> bool:
    return len(shape) == len(wanted) and all(size in (None, length) for length, size in zip(shape, wanted, strict=True))


def check_finite(array: Array, name: str, advice: str, limit: float = np.inf) -> None:
    """Raise `InvalidPointsError` if numbers are not finite, or not below a limit, and say in how many rows."""
    rows = np.reshape(array, (-1, np.prod(array.shape[1:], dtype=int)))
    bad = int(np.count_nonzero(~(np.abs(rows) < limit).all(axis=1)))
    if bad:
        beyond = "" if limit == np.inf else f", or beyond {limit:g}"
        raise InvalidPointsError(f"{bad} of {len(rows)} {name} are not finite (NaN or infinity){beyond}. {advice}")


def check_positions(positions: ArrayLike, count: int, name: str, singular: str) -> Floats:
    """Return positions, (count, 3), in double precision."""
    wanted = f"Give x, y, z for each {singular}: {count} rows of 3 real numbers."
    given = as_doubles(check_array(positions, name.capitalize(), [(count, 3)], wanted))
    check_finite(given, name, f"Give a position for each {singular}.", _HUGE)
    return given


def check_plane(point: ArrayLike, normal: ArrayLike) -> tuple[Floats, Floats]:
    """Return a point of the plane and its unit normal, or say what is wrong with them."""
    found = []
    for given, name in ((point, "point"), (normal, "normal")):
        array = check_array(given, f"Coordinates of the {name} of the plane", [(3,)], "Give three real numbers.")
        found.append(as_doubles(array))
        check_finite(found[-1], f"coordinates of the {name} of the plane", "Give three real numbers.")
    size = float(np.abs(found[1]).max())
    if size == 0.0:
        raise InvalidPointsError("The normal of the plane has length 0. Give a vector across the plane.")
    across = found[1] / size
    return found[0], across / np.linalg.norm(across)


def check_points(points: ArrayLike) -> Floats:
    """Check coordinates and return them in double precision.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L]. Integers are taken as numbers; the precision of float32 input is judged as such.

    Returns
    -------
    ndarray, (n, 3) float64
        A copy only where the type changes.

    Raises
    ------
    InvalidPointsError
        Not (n, 3) real numbers, not finite, or so far from the origin that their type does not resolve them.
    TooFewPointsError
        No points at all.
    """
    given = as_array(points, "Points")
    if given.ndim != 2 or given.shape[1] != 3:
        raise InvalidPointsError(f"Points must have the shape (n, 3), not {given.shape}. Give x, y, z for each point.")
    if given.dtype.kind not in "iuf":
        raise InvalidPointsError(f"Points must be real numbers, not {given.dtype}. Convert them to float64.")
    if len(given) == 0:
        raise TooFewPointsError("There are no points. Add points.")
    result = as_doubles(given, copy=False)
    check_finite(result, "points", "Delete these points.")
    largest = np.abs(result).max()
    if largest > _LARGEST:
        raise InvalidPointsError(
            f"Some of the {len(result)} points lie {largest:.3g} from the origin: squared lengths would"
            f" overflow. Delete these points, or scale the points to less than {_LARGEST:g}."
        )
    extent = np.ptp(result, axis=0).max()
    if 0.0 < extent < 1.0 / _LARGEST:
        raise InvalidPointsError(
            f"The {len(result)} points span only {extent:.3g}: squared lengths would underflow."
            f" Scale the points to more than {1.0 / _LARGEST:g}."
        )
    if len(result) > 1 and given.dtype.kind == "f" and extent < 8192.0 * np.finfo(given.dtype).eps * largest:
        raise InvalidPointsError(
            f"The {len(result)} points lie {largest:.3g} from the origin but span only {extent:.3g}:"
            f" {given.dtype} coordinates do not resolve them there. Shift them to the origin before they are"
            " stored."
        )
    return result
