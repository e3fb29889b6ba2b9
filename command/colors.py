"""Colors of points: their name among the attributes, and the curve of sRGB."""

import numpy as np

COLOR = "Color"  # the name that imported ones get


def linear(colors):
    """Return linear colors, (n, 4), of those in sRGB; alpha stays."""
    low = colors[:, :3] <= 0.04045
    rest = np.where(low, colors[:, :3] / 12.92, ((colors[:, :3] + 0.055) / 1.055) ** 2.4)
    return np.column_stack([rest, colors[:, 3]])


def srgb(colors):
    """Return colors in sRGB, (n, 4), of linear ones from zero on; alpha stays."""
    low = colors[:, :3] <= 0.0031308
    raised = 1.055 * np.maximum(colors[:, :3], 0.0031308) ** (1.0 / 2.4) - 0.055
    return np.column_stack([np.where(low, 12.92 * colors[:, :3], raised), colors[:, 3]])
