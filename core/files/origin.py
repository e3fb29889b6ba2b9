"""A local origin for coordinates that are too large for single precision, such as those of a national grid."""

import numpy as np
from numpy.typing import ArrayLike

from ..types import Bools, Floats

_FINE = 1e-5  # step of single precision that does not hurt, as a share of the extent ...
_FINEST = 1e-3  # ... and in all: a millimetre where the unit is the metre, ...
_FINEST_DEGREE = 1e-8  # ... as is this on the ground
_OWN = 1e-4  # error as a share of the extent along one axis, whose unit may be another than that of the others
_FLAT = 1e-9  # share of the longest side below which another one has no extent but that of rounding
_POINT = 1e-30  # extent below which points are at one place, for single precision and for powers of ten
_SHARED = 10.0  # times that the step may be coarser for the sake of a common origin, less than `check_points` refuses
_NARROW = 100.0  # of heights in metres to degrees, and ...
_FAR = 10.0  # ... of degrees to their extent, at least


def is_coarse(points: Floats) -> bool:
    """Whether single precision would hurt the points where they are."""
    return bool((_steps(points) > _allowed(points, look_like_degrees(points))).any())


def look_like_degrees(points: Floats) -> bool:
    """Whether x and y look like longitude and latitude, in either order, beside heights in metres.

    They are then in the range of such, far from zero by their own extent, and narrow as no thing would be.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    extent, largest = high - low, np.maximum(np.abs(low), np.abs(high))[:2]
    return bool(
        largest.max() <= 180.0
        and largest.min() <= 90.0
        and extent[:2].min() > 0.0
        and _NARROW * extent[:2].max() <= extent[2]
        and _FAR * extent[:2].max() <= largest.max()
    )


def _steps(points: Floats) -> Floats:
    """Distance of neighboring numbers of single precision at the largest coordinate of each axis, (3,)."""
    return np.spacing(np.abs(points).max(axis=0).astype(np.float32)).astype(np.float64)


def _extents(points: Floats) -> tuple[float, Floats]:
    """Longest side of the box around the points, and all three; that of points at one place counts as one."""
    extents = np.ptp(points, axis=0)
    longest = float(extents.max())
    return longest if longest > _POINT else 1.0, extents


def _allowed(points: Floats, degrees: bool) -> Floats:
    """Steps of single precision that do not hurt, (3,).

    For axes of one unit they follow from the longest side. For an axis of another unit they follow from its own side,
    if single precision changes its numbers, and for degrees from lengths on the ground.
    """
    longest, extents = _extents(points)
    allowed = np.full(3, min(_FINE * longest, _FINEST))
    for axis in np.flatnonzero(extents > _FLAT * longest):
        error = np.abs(points[:, axis].astype(np.float32) - points[:, axis]).max()
        if degrees and axis < 2 and error > 0.0:
            allowed[axis] = _FINEST_DEGREE
        elif error > _OWN * extents[axis]:
            allowed[axis] = min(allowed[axis], _OWN * extents[axis])
    return allowed


def choose_origin(points: Floats, known: ArrayLike | None = None, *, degrees: bool = False) -> Floats:
    """Choose the origin that is subtracted from points before they are stored in single precision.

    Parameters
    ----------
    points : ndarray, (n, 3) float64
    known : array_like, (3,), optional
        The origin of other points, which these share if they are near enough to it, so that they stay aligned.
    degrees : bool
        Whether x and y are known to be longitude and latitude; otherwise they are if they look like it.

    Returns
    -------
    ndarray, (3,) float64
        Zero if single precision suffices. Otherwise the middle of the points, rounded to a power of ten below their
        extent, so that it is easily read; along axes with units of their own, only of those that need it.
    """
    longest, extents = _extents(points)
    allowed = _allowed(points, degrees or look_like_degrees(points))
    own = allowed < min(_FINE * longest, _FINEST)
    if known is not None and _share(points - np.asarray(known), allowed, own, longest):
        return np.array(known, dtype=np.float64)
    coarse = _steps(points) > allowed
    shifted = coarse & own if not (coarse & ~own).any() else np.full(3, True)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    grid = 10.0 ** np.floor(np.log10(np.where(own, np.maximum(extents, _POINT), longest)))
    return np.where(shifted, np.round(middle / grid) * grid, 0.0)


def _share(points: Floats, allowed: Floats, own: Bools, longest: float) -> bool:
    """Whether points less the origin of others have steps that are fine enough for the sake of a common one."""
    return bool((_steps(points) <= np.where(own, _SHARED * allowed, _SHARED * _FINE * longest)).all())
