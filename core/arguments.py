"""What callers give as numbers, switches and arrays, read so that nothing else than a check can fail on it."""

from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .errors import InvalidPointsError, PointCloudError
from .types import Array, Floats

_HUGE = 1e100  # of a coordinate, so that no product overflows


def real(given: Any) -> float:
    """Return a real number as a float; NaN, which no comparison lets pass, for what is none."""
    number = given[()] if isinstance(given, np.ndarray) and given.ndim == 0 else given
    if isinstance(number, bool) or not isinstance(number, Real):
        return np.nan
    try:
        return float(number)
    except OverflowError:  # a whole number of more than 308 digits
        return np.inf if given > 0 else -np.inf


def whole(given: Any) -> float:
    """Return a whole number as an int; NaN, which no comparison lets pass, for what is none."""
    if isinstance(given, Integral) and not isinstance(given, bool):
        return int(given)
    number = real(given)
    return int(number) if np.isfinite(number) and number == np.floor(number) else np.nan


def check_switches(**switches: Any) -> None:
    """Check that arguments are truth values.

    Raises
    ------
    PointCloudError
        One of them is something else.
    """
    for name, value in switches.items():
        if not isinstance(value, bool | np.bool_):
            raise PointCloudError(f"Option {name} is {value!r}. Use True or False.")


def as_array(given: ArrayLike, name: str) -> Array:
    """Return an argument as an array of any shape and type.

    Raises
    ------
    InvalidPointsError
        Rows of different lengths, or masked values, of which nothing is known.
    """
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


def check_positions(positions: ArrayLike, count: int, name: str, singular: str) -> Floats:
    """Return positions, (count, 3), in double precision."""
    given = as_array(positions, name.capitalize())
    if given.shape != (count, 3) or given.dtype.kind not in "iuf":
        raise InvalidPointsError(
            f"The {name} have the shape {given.shape} and type {given.dtype}, not ({count}, 3) real numbers."
            f" Give x, y, z for each {singular}."
        )
    given = as_doubles(given)  # in single precision the limit would be infinite
    bad = int(np.count_nonzero(~(np.abs(given) < _HUGE).all(axis=1)))
    if bad:
        raise InvalidPointsError(
            f"{bad} of {count} {name} are not finite (NaN or infinity), or beyond {_HUGE:g}. Give a place for"
            f" each {singular}."
        )
    return given
