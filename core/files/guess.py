"""What columns without names are, by their numbers: colors, normals, or values of an unknown kind."""

import numpy as np

_COLORS = ("r", "g", "b")
_NORMALS = ("nx", "ny", "nz")
_LENGTH = 0.02  # that normals, rounded to a few digits, may differ from 1
_STEP = 1e-4  # that shares of 255 may differ from whole ones, in a file of a few digits


def guess_names(values, unknown):
    """Name columns that a file does not name.

    Parameters
    ----------
    values : ndarray, (n, k)
    unknown : list of str
        A name for each, for those that are neither.

    Returns
    -------
    list of str
        r g b, alpha, nx ny nz, or the given ones.
    """
    values = values[np.isfinite(values).all(axis=1)]
    names = []
    while len(names) < values.shape[1]:
        names += (
            _guess_next(values[:, len(names) :], unknown[len(names)], names) if len(values) else unknown[len(names) :]
        )
    return names


def _guess_next(values, unknown, taken):
    """Name the next column, or more if they belong together."""
    if "r" not in taken and _are_colors(values[:, :3]):
        if not _are_colors(values[:, 1:4]):
            return list(_COLORS)
        if (values[:, 3] == 255).all():
            return [*_COLORS, "alpha"]
        if _is_apart(values[:, 3], values[:, 1:3]) >= _is_apart(values[:, 0], values[:, 1:3]):
            return list(_COLORS)
    if "nx" not in taken and _are_normals(values[:, :3]):
        return list(_NORMALS)
    return [unknown]


def _are_colors(values):
    """Tell whether three columns are whole numbers from 0 to 255, or their shares, and not all 0 or 1."""
    if values.shape[1] < 3 or not ((values >= 0.0) & (values <= 255.0)).all() or _are_normals(values):
        return False
    if values.max() > 1.0:
        return bool((values == np.round(values)).all())
    shares = 255.0 * values
    return bool((np.abs(shares - np.round(shares)) < 255.0 * _STEP).all() and (shares % 255.0 != 0.0).any())


def _are_normals(values):
    """Tell whether three columns are vectors of length 1, but for some that are zero or missing."""
    if values.shape[1] < 3:
        return False
    lengths = np.linalg.norm(values, axis=1)
    there = lengths > 0.0
    return bool(2 * there.sum() > len(values) and (np.abs(lengths[there] - 1.0) < _LENGTH).all())


def _is_apart(column, colors):
    """Return how far a column is from two channels of a color: channels differ less than what is none."""
    return float(np.abs(column - colors.mean(axis=1)).mean())
