"""Kinds of columns without names, by their values: colors, normals, or unknown."""

from collections.abc import Callable

import numpy as np

from ..types import Array, Floats

_COLORS = ("r", "g", "b")
_SCANNED = ("intensity", *_COLORS)
_NORMALS = ("nx", "ny", "nz")
_FULL = 255.0
_SAMPLE = 10_000  # rows that are examined first
_MOST = 30  # columns that are examined
_LENGTH = 0.02  # by which lengths of normals, rounded to a few digits, may differ from 1
_STEP = 1e-4  # by which shares of 255 may differ from whole ones, in a file of a few digits


def guess_names(values: Array, unknown: list[str], scanned: bool = True) -> list[str]:
    """Name columns that a file does not name.

    Parameters
    ----------
    values : ndarray, (n, k)
    unknown : list of str
        A name for each, for those that are neither.
    scanned : bool
        Whether a single number before colors may be an intensity: not one before the coordinates, which counts points.

    Returns
    -------
    list of str
        r g b, alpha, nx ny nz, intensity, or the given ones.
    """
    names = list(unknown)
    values = values[np.isfinite(values).all(axis=1)]
    color, normal = _best_pair(_triples(values, _are_colors), _triples(values, _are_normals), values)
    if normal is not None:
        names[normal : normal + 3] = _NORMALS
    if color is not None:
        names[color : color + 3] = _COLORS
        alpha = color + 3
        full = _FULL if values[:, color:alpha].max() > 1.0 else 1.0
        if alpha < len(names) and alpha != normal and (values[:, alpha] == full).all():
            names[alpha] = "alpha"
        if scanned and color == 1 and len(names) == len(_SCANNED):
            names = list(_SCANNED)
    return names


def _triples(values: Array, fits: Callable[[Array], bool]) -> list[int | None]:
    """Return the first of three columns that fit, each, and None for no such columns."""
    sample = values[:: max(len(values) // _SAMPLE, 1)]
    firsts = range(min(values.shape[1], _MOST) - 2) if len(values) else ()
    return [
        None,
        *(first for first in firsts if fits(sample[:, first : first + 3]) and fits(values[:, first : first + 3])),
    ]


def _best_pair(colors: list[int | None], normals: list[int | None], values: Array) -> tuple[int | None, int | None]:
    """Choose columns of colors and of normals that explain most; of colors those whose channels differ least.

    Opacities, intensities and labels beside them differ more.
    """
    pairs = [
        (color, normal)
        for color in colors
        for normal in normals
        if color is None or normal is None or abs(color - normal) >= 3
    ]

    def quality(pair: tuple[int | None, int | None]) -> tuple[int, float, bool]:
        color, normal = pair
        explained = (color is not None) + (normal is not None)
        return explained, -_spread(values, color), color is not None

    return max(pairs, key=quality)


def _spread(values: Floats, first: int | None) -> float:
    """Return how much the channels of colors differ."""
    if first is None:
        return 0.0
    channels = values[:, first : first + 3]
    alpha = 2.0 * _FULL if (channels == _FULL).all(axis=0).any() else 0.0  # the same everywhere
    return float(np.ptp(channels, axis=1).mean()) + alpha


def _are_colors(values: Floats) -> bool:
    """Whether three columns are whole numbers from 0 to 255, or their shares, and not all 0 or 1."""
    if not ((values >= 0.0) & (values <= _FULL)).all() or _are_normals(values):
        return False
    if values.max() > 1.0:
        return bool((values == np.round(values)).all())
    shares = _FULL * values
    return bool((np.abs(shares - np.round(shares)) < _FULL * _STEP).all() and (shares % _FULL != 0.0).any())


def _are_normals(values: Floats) -> bool:
    """Whether three columns are vectors of length 1, but for some that are zero or missing."""
    lengths = np.linalg.norm(values, axis=1)
    there = lengths > 0.0
    return bool(2 * there.sum() > len(values) and (np.abs(lengths[there] - 1.0) < _LENGTH).all())
