"""Colors of points: their name among the attributes, the curve of sRGB, and how they are averaged."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from . import core

if TYPE_CHECKING:
    from collections.abc import Callable

    from tools.tool import Array

COLOR = "Color"  # the name that imported ones get


_GAMMA = 2.2  # splats are trained in sRGB


def of_splats(base: Array) -> Array:
    """Return the view-independent colors of splats, linear and opaque, (n, 4), by their harmonics of degree 0."""
    seen = np.maximum(core.splats.CONSTANT * base[:, :3] + 0.5, 0.0) ** _GAMMA
    return np.column_stack([seen, np.ones(len(seen))])


def average(colors: Array, interpolate: Callable[[Array], Array]) -> Array:
    """Return linear colors elsewhere, by a function that interpolates, and may overshoot, never below zero."""
    return np.clip(interpolate(colors), 0.0, None)


def linear(colors: Array) -> Array:
    """Return linear colors, (n, 4), of those in sRGB; alpha stays."""
    low = colors[:, :3] <= 0.04045
    rest = np.where(low, colors[:, :3] / 12.92, ((colors[:, :3] + 0.055) / 1.055) ** 2.4)
    return np.column_stack([rest, colors[:, 3]])


def srgb(colors: Array) -> Array:
    """Return colors in sRGB, (n, 4), of linear ones from zero on; alpha stays."""
    low = colors[:, :3] <= 0.0031308
    raised = 1.055 * np.maximum(colors[:, :3], 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.column_stack([np.where(low, 12.92 * colors[:, :3], raised), colors[:, 3]])
