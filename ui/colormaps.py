"""Colour maps as even samples, and the range of values they stretch over."""

import numpy as np

# sRGB in hexadecimal, low to high. Viridis is perceptually uniform: S. van der Walt, N. Smith, E. Firing, CC0.
_VIRIDIS = (
    "440154 481a6c 472f7d 414487 39568c 31688e 2a788e 23888e 1f988b 22a884 35b779 54c568 7ad151 a5db36 d2e21b fde725"
)
# Diverging with a light middle: K. Moreland, Diverging Color Maps for Scientific Visualization, 2009.
_COOL_WARM = (
    "3b4cc0 4e68d8 6282ea 779af7 8db0fe a3c2fe b9d0f9 ccd9ed dddcdc ecd3c5 f5c4ac f7b093 f4987a eb7d62 dd5f4b ca3b37"
    " b40426"
)
_MAPS = {"VIRIDIS": _VIRIDIS, "COOL_WARM": _COOL_WARM}
# For -1 as "none", then 0 to 6, which any colour vision tells apart: M. Okabe, K. Ito, Color Universal Design, 2008.
_CLASSES = ("555555", "0072b2", "e69f00", "009e73", "d55e00", "56b4e9", "cc79a7", "f0e442")
_MOST = len(_CLASSES) - 1
_FALSE, _TRUE = "bdbdbd", "d55e00"


def fit(values, coverage: float, name: str = "AUTO"):
    """Choose a colour map and its range for values.

    Parameters
    ----------
    values : ndarray, (n,)
        Numbers or truth values.
    coverage : float
        Percentage of the values inside the range, so that a few outliers do not wash the rest out; all of them for
        whole numbers and truth values.
    name : {"AUTO", "VIRIDIS", "COOL_WARM"}
        AUTO takes two colours for truth values, one for each of few whole numbers, and the diverging map if the values
        reach clearly to both sides of zero.

    Returns
    -------
    name : str
        As given, or what AUTO came to: also "TRUTH" or "CLASSES".
    low, high : float
        Symmetric about zero for the diverging map of signed values.
    """
    if name == "AUTO" and values.dtype.kind == "b":
        return "TRUTH", 0.0, 1.0
    if name == "AUTO" and values.dtype.kind == "i" and len(values) and values.min() >= -1:
        if values.max() < _MOST:
            return "CLASSES", float(values.min()), float(values.max())
        name = "VIRIDIS"
    outside = 0.5 * (100.0 - coverage) if values.dtype.kind == "f" else 0.0  # whole numbers have no outliers
    values = values[np.isfinite(values)].astype(np.float64)
    low, high = np.percentile(values, (outside, 100.0 - outside)) if len(values) else (0.0, 1.0)
    if low == high:  # most values alike: the few others are what there is to see
        low, high = values.min(), values.max()
    if name == "AUTO":
        name = "COOL_WARM" if min(-low, high) > 0.01 * max(-low, high) else "VIRIDIS"
    if name == "COOL_WARM" and low < 0.0 < high:
        high = max(-low, high)
        low = -high
    if high - low <= 1e-6 * max(abs(low), abs(high)):  # a constant, up to rounding: the middle of the map
        margin = 0.1 * abs(high) or 1.0
        low, high = low - margin, high + margin
    return name, float(low), float(high)


def step_colors(name: str, low: float, high: float) -> list:
    """Colours of the whole numbers from low to high as linear (r, g, b, 1); none for maps without steps."""
    if name == "TRUTH":
        return [_color(_FALSE), _color(_TRUE)]
    if name == "CLASSES":
        return [_color(code) for code in _CLASSES[int(low) + 1 : int(high) + 2]]
    return []


def linear_colors(name: str) -> list:
    """Colours of a map, low to high, as linear (r, g, b, 1): what shaders and colour ramps take."""
    return [_color(code) for code in _MAPS[name].split()]


def _color(code):
    return (*(_linear(int(code[i : i + 2], 16) / 255.0) for i in (0, 2, 4)), 1.0)


def _linear(value):
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4
