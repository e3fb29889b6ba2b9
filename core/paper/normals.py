"""Normals by principal component analysis, eq. (9), and denoising by such planes."""

import numpy as np
from scipy.spatial import cKDTree

from ..algebra import blocks, on_all_cores
from ..geometry import Pairs, check_surface, count_curves, fading_weights, roundness
from ..kernel import kernel
from ..linalg import eigh
from ..types import Floats

_AROUND = 90  # neighbors of a plane that a point is projected onto
_BLOCK = 1 << 12  # points


def covariance_normals(pairs: Pairs, weighted: bool = True) -> Floats:
    """Estimate unit normals by (weighted) principal component analysis, eq. (9).

    Parameters
    ----------
    pairs : Pairs
        Of m distinct points.
    weighted : bool
        Weigh by the kernel W_h (WPCA) or count every neighbor alike (PCA).

    Returns
    -------
    ndarray, (m, 3)
        Unit normals of arbitrary sign: the direction of least variance.

    Raises
    ------
    NotASurfaceError
        The points of many neighborhoods lie along a curve.
    """
    points = pairs.points
    if weighted:
        weights = pairs.half(kernel(pairs.distance / pairs.mean(pairs.lengths)))
    else:
        weights = pairs.half(np.ones(len(pairs.first)))
    own = kernel(0.0) if weighted else 1.0
    axes = np.triu_indices(3)
    moments = np.column_stack([np.ones(len(points)), points, points[:, axes[0]] * points[:, axes[1]]])
    moments = own * moments + weights @ moments + weights.T @ moments
    moments /= moments[:, :1]
    mean = moments[:, 1:4]
    covariance = np.empty((len(points), 3, 3))
    covariance[:, axes[0], axes[1]] = covariance[:, axes[1], axes[0]] = (
        moments[:, 4:] - mean[:, axes[0]] * mean[:, axes[1]]
    )
    variances, directions = eigh(covariance)
    check_surface(count_curves(roundness(variances)), len(variances))
    return np.ascontiguousarray(directions[:, :, 0])


def tangent_planes(points: Floats) -> Floats:
    """Project every point, (n, 3), onto the plane through its neighbors, as section 6 does for noisy points."""
    tree, result = cKDTree(points), np.empty_like(points)

    def project(part: slice) -> None:
        distance, index = tree.query(points[part], k=min(_AROUND + 1, len(points)))
        weight = fading_weights(distance)
        weight /= weight.sum(axis=1, keepdims=True)
        mean = np.einsum("ik,ikc->ic", weight, points[index])
        centered = points[index] - mean[:, None]
        normal = eigh(np.swapaxes(weight[:, :, None] * centered, 1, 2) @ centered)[1][:, :, 0]
        result[part] = points[part] + np.einsum("ic,ic->i", mean - points[part], normal)[:, None] * normal

    on_all_cores(project, blocks(len(points), _BLOCK))
    return result
