"""Assemble the stiffness matrix, eq. (10) of the paper."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from ..kernel import SECOND_MOMENT, pair_kernel
from .curvature import weight_factor
from .images import mirror, own_images
from .weights import balance_weights


@dataclass(frozen=True)
class Stiffness:
    """The weak form of the operator, and what is known of its weights.

    Attributes
    ----------
    matrix : csr_array, (n, n)
        Symmetric, rows sum to zero, columns sorted; without units, so the same in any scale.
    images : csr_array, (n, n)
        Symmetric weights of the images in one boundary that the matrix holds, those of points in their own image on the
        diagonal. (An image of an image, across a corner, has the point's value whatever holds at the boundary.)
    residual : ndarray, (m,)
        What the moments of the weights around each distinct point are off by, relatively; zero without balance.
    widths : ndarray, (m,)
        Smoothing length of the kernel whose fourth moment the weights have; h without balance.
    """

    matrix: sparse.csr_array
    images: sparse.csr_array
    residual: np.ndarray
    widths: np.ndarray


def assemble_stiffness(cloud, distance, areas, balanced=False, report=lambda: None):
    """Assemble K = -D G D of eq. (10) for the caller's points.

    Points at the same place take equal parts of its area and couple as neighbours at distance zero. The image of a
    point in a boundary has the point's value, so that it adds to the weight of the pair.

    Parameters
    ----------
    cloud : Cloud
        Of m distinct points, with p pairs, that stand for n of the caller's.
    distance : ndarray, (p,)
        Distance of each pair in the mean-normal plane, or along the surface.
    areas : ndarray, (m,)
        Area elements in scaled coordinates.
    balanced : bool
        Give the weights around every point the moments of the kernel, by `balance_weights`.
    report : callable
        Called now and then while that is done; may raise `Cancelled`.

    Returns
    -------
    Stiffness
    """
    pairs = cloud.pairs
    plain, mirrored, fourth = _kernel_weights(cloud, distance, areas)
    residual, widths = np.zeros(len(areas)), pairs.lengths
    if balanced:
        balance = balance_weights(cloud, distance, plain[0] + mirrored[0], areas, report)
        for part in (plain, mirrored, fourth):
            part[0][:] *= balance.factor
        residual, widths = balance.residual, _widths(pairs, plain[0] + mirrored[0], *fourth, areas)
    weights = _for_callers_points(cloud, plain[0] + mirrored[0], plain[1] + mirrored[1])
    stiffness = (sparse.diags_array(weights.sum(axis=1), format="csr") - weights).tocsr()
    known = mirrored[0] > 0.0
    cloud = replace(cloud, pairs=pairs.keep(known))
    images = _for_callers_points(cloud, mirrored[0][known], mirrored[1])
    images.eliminate_zeros()
    return Stiffness(stiffness, images, residual, widths)


def _kernel_weights(cloud, distance, areas):
    """Return what the kernel makes of pairs, (p,), and of points with themselves, (m,), as two arrays each.

    Returns
    -------
    plain : tuple of ndarray
        The weights of pairs, and of points with themselves.
    mirrored : tuple of ndarray
        The weights of images in one boundary.
    fourth : tuple of ndarray
        The fourth moments of both.
    """
    pairs = cloud.pairs
    factor = weight_factor(pairs.lengths, cloud.gaussian_curvature)
    lengths = pairs.mean(pairs.lengths)
    scale = pairs.mean(factor) / lengths**4 * areas[pairs.first] * areas[pairs.second]
    own_scale = factor / pairs.lengths**4 * areas**2
    # Weights of pairs, and of points with themselves; then those of images in one boundary.
    plain = pair_kernel(distance / lengths) * scale, pair_kernel(0.0) * own_scale
    fourth = plain[0] * distance**4, np.zeros(len(areas))
    mirrored = np.zeros_like(plain[0]), np.zeros(len(areas))
    for part, images, h, units in (
        (0, mirror(pairs, distance, cloud.boundary), lengths, scale),
        (1, own_images(pairs, cloud.boundary), pairs.lengths, own_scale),
    ):
        for whose, (rows, image, _) in zip((mirrored, mirrored, plain), images, strict=True):
            weight = pair_kernel(image / h[rows]) * units[rows]
            whose[part][rows] += weight
            fourth[part][rows] += weight * image**4
    return plain, mirrored, fourth


def _widths(pairs, weights, fourth, own_fourth, areas):
    """Return the smoothing length of the kernel whose fourth moment, 8 mu2 h^2 of the area, the weights have, (m,).

    It is a mean over the neighbours, as the operator would make much of what differs from point to point by chance.
    """
    fourth, near = pairs.half(fourth), pairs.half(weights)
    moment, unit = fourth.sum(axis=0) + fourth.sum(axis=1) + own_fourth, 8.0 * SECOND_MOMENT * areas
    total = near.sum(axis=0) + near.sum(axis=1)
    total[total == 0.0] = 1.0  # of points without pairs
    moment, unit = (near @ (values / total) + near.T @ (values / total) for values in (moment, unit))
    return np.where(unit > 0.0, np.sqrt(moment / np.where(unit > 0.0, unit, 1.0)), pairs.lengths)


def _for_callers_points(cloud, weights, own):
    """Return the symmetric matrix of pair weights and own weights for the caller's points, columns sorted."""
    scaled, pairs = cloud.scaled, cloud.pairs
    n = len(scaled.inverse)
    if scaled.duplicates:
        known = np.flatnonzero(scaled.inverse >= 0)
        row = scaled.inverse[known]
        spread = sparse.csr_array((1.0 / scaled.copies[row], (known, row)), shape=(n, len(own)))
        half = pairs.half(weights)
        return (spread @ (half + half.T + sparse.diags_array(own)) @ spread.T).tocsr()
    caller = scaled.first.astype(np.int32)
    half = sparse.csr_array((weights, (caller[pairs.first], caller[pairs.second])), shape=(n, n))
    half = half.T.tocsr()  # transposing sorts the columns, which makes the sums fast
    diagonal = np.zeros(n)
    diagonal[caller] = own
    return (half + half.T.tocsr() + sparse.diags_array(diagonal, format="csr")).tocsr()
