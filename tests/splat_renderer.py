"""A little renderer of Gaussian splats for tests and pictures of the manual, independent of what it is to show.

Orthographic, from back to front, in numpy and scipy alone: a Python loop over splats, for pictures that need no speed.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import sph_harm_y

_REACH = 3.5  # standard deviations that are drawn
_LEAST = 1.0 / 255.0  # of the opacity


def render(splats, camera, center, width, shape=(200, 200), background=(1.0, 1.0, 1.0)):
    """Draw splats.

    Parameters
    ----------
    splats : Splats
    camera : array_like, (3, 3)
        Rows: to the right, upwards, and from the scene to the viewer; orthonormal.
    center : array_like, (3,)
        What is in the middle of the picture.
    width : float
        Of the picture, in the unit of the splats.
    shape : tuple of int
        Rows and columns.
    background : tuple of float

    Returns
    -------
    ndarray, (rows, columns, 3)
        From 0 to 1, in sRGB as the splats were trained.
    """
    camera = np.asarray(camera, dtype=np.float64)
    rows, columns = shape
    pixel = width / columns
    seen = (splats.positions - np.asarray(center)) @ camera.T
    turns = Rotation.from_quat(splats.rotations, scalar_first=True).as_matrix()
    axes = camera @ turns * splats.scales[:, None, :]
    spread = axes[:, :2] @ np.swapaxes(axes[:, :2], 1, 2) / pixel**2
    place = np.column_stack([seen[:, 0], -seen[:, 1]]) / pixel + [columns / 2.0, rows / 2.0]
    spread[:, 0, 1] *= -1.0  # the rows of a picture run downwards
    spread[:, 1, 0] *= -1.0
    spread += 0.1 * np.eye(2)  # none is thinner than a pixel
    inverse = np.linalg.inv(spread)
    reach = _REACH * np.sqrt(np.einsum("nkk->nk", spread))
    color = np.clip(colors(splats, -camera[2]), 0.0, 1.0)
    picture = np.tile(np.asarray(background, dtype=np.float64), (rows, columns, 1))
    for index in np.argsort(seen[:, 2], kind="stable"):
        if splats.opacities[index] < _LEAST:
            continue
        low = np.maximum(np.floor(place[index] - reach[index]), 0).astype(int)
        high = np.minimum(np.ceil(place[index] + reach[index]) + 1, (columns, rows)).astype(int)
        if (low >= high).any():
            continue
        x = np.arange(low[0], high[0]) + 0.5 - place[index, 0]
        y = (np.arange(low[1], high[1]) + 0.5 - place[index, 1])[:, None]
        (a, b), (_, c) = inverse[index]
        alpha = splats.opacities[index] * np.exp(-0.5 * (a * x * x + 2.0 * b * x * y + c * y * y))
        part = picture[low[1] : high[1], low[0] : high[0]]
        part += alpha[:, :, None] * (color[index] - part)
    return picture


def colors(splats, direction):
    """Return the colors of splats as they are seen in a direction, (n, 3)."""
    x, y, z = direction
    polar, azimuth = np.arccos(np.clip(z, -1.0, 1.0)), np.arctan2(y, x)
    result = 0.5 + splats.colors * sph_harm_y(0, 0, 0.0, 0.0).real
    degree = round(np.sqrt(splats.harmonics.shape[1] + 1)) - 1
    number = 0
    for own in range(1, degree + 1):
        for order in range(-own, own + 1):
            value = sph_harm_y(own, abs(order), polar, azimuth)
            value = value.real if order >= 0 else value.imag
            result = result + splats.harmonics[:, number] * value * (np.sqrt(2.0) if order else 1.0)
            number += 1
    return result
