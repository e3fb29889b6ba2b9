"""Colour map, range and histogram of values."""

import numpy as np

CLASSES = 7  # whole numbers from 0 with a colour of their own, which then repeat
STEPPED = ("TRUTH", "CATEGORICAL", "LIDAR")  # maps with a colour for each whole number
_BINS = 60


def fit_range(
    values, name: str = "AUTO", mode: str = "AUTO", coverage: float = 98.0, locked=(0.0, 1.0), from_zero=False
):
    """Choose a colour map and its range for values.

    Parameters
    ----------
    values : ndarray, (n,)
        Numbers or truth values.
    name : {"AUTO", "VIRIDIS", "MAGMA", "COOL_WARM", "CYCLIC", "CATEGORICAL", "LIDAR"}
        AUTO takes two colours for truth values, one for each of few whole numbers, and the diverging map if the values
        reach clearly to both sides of zero.
    mode : {"AUTO", "DATA", "PERCENTILE", "SYMMETRIC", "LOCKED"}
        Range from the least to the greatest value, from one percentile to the other, as far to both sides of zero as
        those reach, or as given. AUTO is SYMMETRIC for the diverging map of signed values, DATA for the cyclic map,
        whose ends would not meet otherwise, and PERCENTILE for all else.
    coverage : float
        Percentage of the values between the percentiles, so that a few outliers do not dominate; all of them
        for truth values, few whole numbers and of stepped maps, and where it is not a number.
    locked : tuple of float
        Range to keep.
    from_zero : bool
        Whether AUTO lets the range of values above zero begin there, as that of distances does.

    Returns
    -------
    name : str
        As given, or the choice of AUTO, including "TRUTH".
    low, high : float
        Of stepped maps the first and the last whole number.
    """
    kind = values.dtype.kind
    if name == "AUTO" and kind == "b":
        return "TRUTH", 0.0, 1.0
    values = values[np.isfinite(values)].astype(np.float64)
    ends = (values.min(), values.max()) if len(values) else (0.0, 1.0)
    few = kind == "i" and len(values) > 0 and ends[0] >= -1 and ends[1] < CLASSES
    if name == "AUTO" and few:
        name = "CATEGORICAL"
    every = kind == "b" or few or name in STEPPED or np.isnan(coverage)  # Blender takes NaN for any number
    outside = 0.0 if every else 0.5 * (100.0 - coverage)
    share = np.percentile(values, (outside, 100.0 - outside)) if len(values) else ends
    if share[0] == share[1]:  # most values are equal: show the few others
        share = ends
    if name == "AUTO":
        signed = min(-share[0], share[1]) > 0.01 * max(-share[0], share[1])
        name = "COOL_WARM" if signed and (kind == "f" or ends[0] < -1) else "VIRIDIS"
    if mode == "AUTO":
        signed = name == "COOL_WARM" and share[0] < 0.0 < share[1]
        mode = "SYMMETRIC" if signed else "DATA" if name == "CYCLIC" else "PERCENTILE"
        share = (min(share[0], 0.0), share[1]) if from_zero else share
    if mode == "LOCKED":
        low, high = min(locked), max(locked)
    elif mode == "SYMMETRIC":
        high = np.abs(share).max()
        low = -high
    else:
        low, high = ends if mode == "DATA" else share
    if name in STEPPED:
        return name, float(np.rint(low)), float(np.rint(high))
    if high - low <= 1e-6 * max(abs(low), abs(high)):  # a constant, up to rounding: the middle of the map
        margin = 0.1 * abs(high) or 1.0
        low, high = low - margin, high + margin
    return name, float(low), float(high)


def all_zero(values) -> bool:
    """Whether all numbers are zero, so that there is no range."""
    return values.dtype.kind == "f" and len(values) > 0 and not values.any()


def histogram(values, bounds, stepped: bool):
    """Count values along an axis of the range, extended by at most half its width on each side.

    Return the edges of the bins, (b + 1,), one for each whole number where these have a colour each; how many values
    each holds, (b,); and how many lie below and above the range.
    """
    values = values[np.isfinite(values)].astype(np.float64)
    low, high = bounds
    beyond = int(np.count_nonzero(values < low)), int(np.count_nonzero(values > high))
    if stepped:
        low, high = low - 0.5, high + 0.5
        edges = np.arange(low, high + 0.5) if high - low <= 4 * _BINS else np.linspace(low, high, _BINS + 1)
    else:
        half = 0.5 * (high - low)
        first, last = (values.min(), values.max()) if len(values) else (low, high)
        edges = np.linspace(max(min(first, low), low - half), min(max(last, high), high + half), _BINS + 1)
    return edges, np.histogram(values, edges)[0], beyond
