"""A local origin for coordinates that are too large for single precision, such as those of a national grid."""

import numpy as np

_FINE = 1e-5  # step of single precision that does not hurt, as a share of the extent ...
_FINEST = 1e-3  # ... and in all: a millimetre where the unit is the metre
_POINT = 1e-30  # extent below which points are at one place, for single precision and for powers of ten
_SHARED = 1e-4  # step for the sake of a common origin; about four times finer than what `check_points` refuses


def _step(points):
    """Distance of neighbouring numbers of single precision at the largest coordinate."""
    return float(np.spacing(np.float32(np.abs(points).max())))


def is_coarse(points) -> bool:
    """Whether single precision would hurt the points where they are."""
    return _step(points) > min(_FINE * _extent(points), _FINEST)


def _extent(points):
    """Longest side of the box around the points; that of points at one place counts as one."""
    extent = float(np.ptp(points, axis=0).max())
    return extent if extent > _POINT else 1.0


def choose_origin(points, known=None):
    """Choose what is subtracted from points before they are stored in single precision.

    Parameters
    ----------
    points : ndarray, (n, 3) float64
    known : array_like, (3,), optional
        The origin of other points, which these share if they are near enough to it, so that they stay aligned.

    Returns
    -------
    ndarray, (3,) float64
        Zero if the points do well without. Otherwise the middle of the points, rounded to a power of ten below their
        extent, so that it is easily told.
    """
    extent = _extent(points)
    if known is not None and _step(points - known) <= _SHARED * extent:
        return np.array(known, dtype=np.float64)
    if not is_coarse(points):
        return np.zeros(3)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    grid = 10.0 ** np.floor(np.log10(extent))
    return np.round(middle / grid) * grid
