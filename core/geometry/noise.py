"""Noise: its measure around every point, and points moved onto the surface that their neighbours describe."""

import numpy as np
from scipy.spatial import cKDTree

from .nearest import COUNT, fading_weights
from .quadrics import fit_quadrics

_FEW = 20  # neighbours of the fit that tells noise from shape, by that to all 40
_SHAPE = 1.6  # a fit to 40 that misses so much more: noise misses both nearly alike, an edge by their distance
_ROUNDS = 4  # of averaging over the neighbourhood
_LEAST = 0.02  # noise below this share of the spacing is left alone
LEFT = 0.08  # of the spacing: noise that a fit may leave, which shrinks with the root of its neighbours
FILLING = 0.4  # noise above this share fills the neighbourhoods as a volume would
MOST = 6  # rounds of smoothing
_NEIGHBORS = (24, 90)  # of the fit that points are projected on, at least and at most: more would round what is shape


def noise_level(nearest, misfit):
    """Measure the noise around every point as a share of the spacing.

    Parameters
    ----------
    nearest : Nearest
        Of m points.
    misfit : ndarray, (m,)
        Of quadrics that keep close sheets apart: where it is much less, there are several sheets and no noise.

    Returns
    -------
    ndarray, (m,)
        The misfit of a quadric through 20 neighbours; zero where it is next to nothing, or where a quadric through
        40 fits so much worse that it is shape, not noise, that it misses. No shape is missed by as much as `FILLING`.
        All are geometric means over the neighbourhood: an edge that runs through it is no noise. The majority of
        the neighbours decides.
    """

    def missed(count):
        weight = fading_weights(nearest.distance[:, : count + 1])
        return fit_quadrics(nearest.points, nearest.index[:, : count + 1], weight).misfit

    averaging = nearest.averaging()
    every = np.stack([missed(_FEW), missed(COUNT - 1), misfit], axis=1) / nearest.spacing[:, None]
    logarithms = np.log(np.maximum(every, 1e-12))
    for _ in range(_ROUNDS):
        logarithms = averaging @ logarithms
    few, many, own = np.exp(logarithms.T)
    noisy = (few > _LEAST) & (few < _SHAPE * own) & ((few > FILLING) | (many < _SHAPE * few))
    return np.where(averaging @ noisy.astype(float) > 0.5, few, 0.0)


def project_points(points, method, noise, component=None):
    """Move points onto the surface that their neighbours describe.

    Parameters
    ----------
    points : ndarray, (m, 3)
        Components stand far apart.
    method : {"quadric", "plane"}
        Onto a quadric through their neighbours, or onto the plane through the mean of 90, as the paper does.
    noise : ndarray, (m,)
        As a share of the spacing: little noise needs few neighbours.
    component : ndarray, (m,) int, optional
        Component of each point.

    Returns
    -------
    ndarray, (m, 3)
    """
    smallest = len(points) if component is None else np.bincount(component).min()
    # A quadric has six coefficients.
    many = (
        np.clip(6.0 * (noise / LEFT) ** 2, *_NEIGHBORS) if method == "quadric" else np.full(len(noise), _NEIGHBORS[1])
    )
    many = np.minimum(many.astype(int), smallest - 1)
    distance, index = cKDTree(points).query(points, k=many.max() + 1, workers=-1)
    weight = fading_weights(np.minimum(distance, distance[np.arange(len(many)), many, None]))
    if method == "quadric":
        return points + fit_quadrics(points, index, weight).height
    weight /= weight.sum(axis=1, keepdims=True)
    mean = np.einsum("ik,ikc->ic", weight, points[index])
    centered = points[index] - mean[:, None]
    normal = np.linalg.eigh(np.swapaxes(weight[:, :, None] * centered, 1, 2) @ centered)[1][:, :, 0]
    return points + np.einsum("ic,ic->i", mean - points, normal)[:, None] * normal
