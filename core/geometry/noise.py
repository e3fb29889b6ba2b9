"""Noise: its measure, and points moved onto the surface that their neighbours describe."""

import numpy as np
from scipy.spatial import cKDTree

from .nearest import fading_weights, spacing_of
from .quadrics import fit_quadrics

_SAMPLE = 2000  # points at which the noise is measured
_FEW, _MANY = 20, 60  # neighbours of the two fits that tell noise from shape
_GROWTH = 1.7  # noise misses both alike; shape misses the wide fit more
_NONE = 5e-4  # misfit, as a share of the spacing, that is no noise
LEAST = 0.02  # noise below this share of the spacing is left alone
STRONG = 0.25  # noise above this share is smoothed twice
FILLING = 0.4  # noise above this share fills the neighbourhoods as a volume would: it is smoothed until little is left
LITTLE = 0.07  # misfit, as a share of the spacing, that is little
MOST = 6  # rounds of smoothing
_LEFT = 0.08  # of the spacing: noise that a fit may leave, which shrinks with the root of its neighbours
_NEIGHBORS = (24, 90)  # of the fit that points are projected on, at least and at most: more would round what is shape


def noise_level(tree, misfit):
    """Measure the noise as a share of the spacing.

    Parameters
    ----------
    tree : cKDTree
        Of m points.
    misfit : float
        Of quadrics that keep close sheets apart, in units of the spacing: the noise is no more than that.

    Returns
    -------
    float
        Median, over a sample of the points, of the misfit of a quadric through 20 neighbours, in units of the spacing;
        zero where it is next to nothing, or where a quadric through 60 neighbours fits so much worse that it is
        shape, not noise, that it misses. No shape is missed by as much as `FILLING`, on which both fits fail alike.
    """
    rows = np.arange(0, tree.n, max(1, tree.n // _SAMPLE))
    if misfit < _NONE or tree.n <= _MANY:
        return 0.0
    distance, index = tree.query(tree.data[rows], k=_MANY + 1, workers=-1)
    spacing = spacing_of(distance)
    few, many = (
        np.median(fit_quadrics(tree.data, index[:, :count], fading_weights(distance[:, :count]), rows).misfit / spacing)
        for count in (_FEW + 1, _MANY + 1)
    )
    level = float(min(few, misfit))
    return level if many < _GROWTH * few or level > FILLING else 0.0


def project_points(points, method, noise, component=None):
    """Move points onto the surface that their neighbours describe.

    Parameters
    ----------
    points : ndarray, (m, 3)
        Components stand far apart.
    method : {"quadric", "plane"}
        Onto a quadric through their neighbours, or onto the plane through the mean of 90, as the paper does.
    noise : float
        Their noise as a share of the spacing: little noise needs few neighbours.
    component : ndarray, (m,) int, optional
        Component of each point.

    Returns
    -------
    ndarray, (m, 3)
    """
    smallest = len(points) if component is None else np.bincount(component).min()
    # A quadric has six coefficients.
    many = _NEIGHBORS[1] if method == "plane" else int(np.clip(6.0 * (noise / _LEFT) ** 2, *_NEIGHBORS))
    distance, index = cKDTree(points).query(points, k=min(many + 1, smallest), workers=-1)
    weight = fading_weights(distance)
    if method == "quadric":
        return points + fit_quadrics(points, index, weight).height
    weight /= weight.sum(axis=1, keepdims=True)
    mean = np.einsum("ik,ikc->ic", weight, points[index])
    centered = points[index] - mean[:, None]
    normal = np.linalg.eigh(np.swapaxes(weight[:, :, None] * centered, 1, 2) @ centered)[1][:, :, 0]
    return points + np.einsum("ic,ic->i", mean - points, normal)[:, None] * normal
