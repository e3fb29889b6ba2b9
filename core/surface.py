"""What the cloud tells about the surface around each point: normal and Gaussian curvature."""

from dataclasses import dataclass

import numpy as np

from .errors import NotASurfaceError
from .kernel import SECOND_MOMENT
from .neighbors import fading_weights, find_neighborhoods
from .normals import covariance_normals, orient_normals
from .options import LaplacianOptions

_NEIGHBORS = 40
_BLOCK = 1 << 13  # points fitted at one time
_RIDGE = 1e-10  # keeps the normal equations solvable where the neighbours lie on a conic
_LARGEST = 0.3  # most that a curvature term may change an area or a weight, where the fit is poor


@dataclass(frozen=True)
class LocalSurface:
    """Normals and curvature of the distinct points, in scaled coordinates.

    Attributes
    ----------
    normals : ndarray, (m, 3)
        Unit normals; their signs agree only where orientation was asked for.
    curvature : ndarray, (m,)
        ``mu2 h^2 K``: the Gaussian curvature K as it enters the corrections, without units; zero without
        ``options.curvature_correction``.
    """

    normals: np.ndarray
    curvature: np.ndarray

    @property
    def kernel_integral(self):
        """Integral of the kernel over the surface around each point, ``1 - mu2 h^2 K / 6``, clipped, (m,)."""
        return 1.0 - np.clip(self.curvature / 6.0, -_LARGEST, _LARGEST)

    @property
    def weight_factor(self):
        """Factor of the pair weights, ``1 + mu2 h^2 K / 4``, clipped; a pair takes the mean of its ends, (m,)."""
        return 1.0 + np.clip(self.curvature / 4.0, -_LARGEST, _LARGEST)


def estimate_normals(points, options=LaplacianOptions()):
    """Estimate unit normals from points alone.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    options : LaplacianOptions
        Its bandwidth, normals and orient settings.

    Returns
    -------
    ndarray, (n, 3)
        Of arbitrary sign unless ``options.orient``.

    Raises
    ------
    PointCloudError
        The points have no tangent planes; see `build_laplacian`.
    """
    neighborhoods = find_neighborhoods(points, options)
    return fit_surface(neighborhoods, options).normals[neighborhoods.scaled.inverse]


def fit_surface(neighborhoods, options, normals=None):
    """Find normals, unless given, and Gaussian curvature, if the options correct for it.

    Parameters
    ----------
    neighborhoods : Neighborhoods
        Of m distinct points.
    options : LaplacianOptions
        Its normals, orient and curvature_correction settings.
    normals : ndarray, (m, 3), optional
        Unit normals to use as they are.

    Returns
    -------
    LocalSurface

    Raises
    ------
    NotASurfaceError
        The points of many neighbourhoods lie along a curve.
    """
    curvature = np.zeros(len(neighborhoods.points))
    estimated = normals
    if options.curvature_correction or (normals is None and options.normals == "quadric"):
        fitted, gaussian = fit_quadrics(neighborhoods.tree)
        if options.curvature_correction:
            curvature = SECOND_MOMENT * neighborhoods.lengths**2 * gaussian
        if options.normals == "quadric":
            estimated = fitted
    if normals is not None:
        return LocalSurface(normals, curvature)
    if options.normals != "quadric":
        estimated = covariance_normals(neighborhoods, weighted=options.normals == "wpca")
    if options.orient:
        estimated = orient_normals(neighborhoods, estimated)
    return LocalSurface(estimated, curvature)


def fit_quadrics(tree):
    """Fit ``z = c0 + c1 u + c2 v + c3 u^2 + c4 u v + c5 v^2`` to the 40 nearest neighbours of every point.

    The frame (u, v, z) comes from the covariance of the same neighbours; nearer ones weigh more.

    Parameters
    ----------
    tree : cKDTree
        Of m distinct points.

    Returns
    -------
    normals : ndarray, (m, 3)
        Unit normals of arbitrary sign.
    gaussian : ndarray, (m,)
        Gaussian curvature [1 / L^2].

    Raises
    ------
    NotASurfaceError
        The points of many neighbourhoods lie along a curve.
    """
    points, count = tree.data, tree.n
    normals, gaussian = np.empty((count, 3)), np.empty(count)
    curves = 0
    for start in range(0, count, _BLOCK):
        block = slice(start, min(start + _BLOCK, count))
        distance, near = tree.query(points[block], k=min(_NEIGHBORS + 1, count), workers=-1)
        weight = fading_weights(distance)[:, :, None]
        offset = points[near] - points[block, None]
        centered = offset - (weight * offset).sum(axis=1, keepdims=True) / weight.sum(axis=1, keepdims=True)
        variance, frame = np.linalg.eigh(np.swapaxes(weight * centered, 1, 2) @ centered)
        curves += np.count_nonzero(variance[:, 1] < 5e-3 * variance[:, 2])
        unit = distance[:, -1]  # the equations are well scaled in units of the farthest neighbour's distance
        z, v, u = np.moveaxis(offset @ frame / unit[:, None, None], 2, 0)
        basis = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=2)
        weighted = np.swapaxes(basis * weight, 1, 2)
        fit = np.linalg.solve(weighted @ basis + _RIDGE * np.eye(6), weighted @ z[:, :, None])[:, :, 0]
        slope = 1.0 + fit[:, 1] ** 2 + fit[:, 2] ** 2
        gaussian[block] = (4.0 * fit[:, 3] * fit[:, 5] - fit[:, 4] ** 2) / (slope * unit) ** 2
        local = np.stack([np.ones_like(slope), -fit[:, 2], -fit[:, 1]], axis=1) / np.sqrt(slope)[:, None]
        normals[block] = np.einsum("iab,ib->ia", frame, local)
    if curves > 0.01 * count:
        raise NotASurfaceError(
            f"Around {curves} of {count} points the neighbors lie along a curve, so there is no tangent plane. Use"
            " points of a surface."
        )
    return normals, gaussian
