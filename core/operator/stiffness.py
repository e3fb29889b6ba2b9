"""Assemble the stiffness matrix, eq. (10) of the paper."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from ..kernel import SECOND_MOMENT, pair_kernel
from .curvature import weight_factor
from .images import mirror, own_images
from .weights import balance_weights

_NEUMANN, _DIRICHLET = (
    2.0,
    2.0 / 3.0,
)  # growth of the images' weights over that of their areas next to a curved boundary


@dataclass(frozen=True)
class Stiffness:
    """The weak form of the operator, and what is known of its weights.

    Attributes
    ----------
    matrix : csr_array, (n, n)
        Symmetric, rows sum to zero, columns sorted; without units, so the same in any scale.
    neumann_images, dirichlet_images : csr_array, (n, n)
        Symmetric weights of the images in one boundary, those of points in their own image on the diagonal: the part of
        the stiffness that is theirs, and what takes its place for fixed values at the boundary. (An image of an image,
        across a corner, has the point's value either way.)
    residual : ndarray, (m,)
        What the moments of the weights around each distinct point are off by, relatively; zero where they are not
        balanced.
    widths : ndarray, (m,)
        Smoothing length of the kernel whose fourth moment the weights have; h where they are not balanced.
    """

    matrix: sparse.csr_array
    neumann_images: sparse.csr_array
    dirichlet_images: sparse.csr_array
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

    Notes
    -----
    Next to a boundary of curvature k the energy of a function along the boundary comes out low by mu2 h^2 k / 4 of its
    own on the boundary, because the kernel's pairs there have their middle inside more often than outside; twice the
    growth of the images' areas makes up for it. For functions that vanish at the boundary two thirds do, as measured on
    discs.
    """
    pairs = cloud.pairs
    factor = weight_factor(pairs.lengths, cloud.gaussian_curvature)
    lengths = pairs.mean(pairs.lengths)
    scale = pairs.mean(factor) / lengths**4 * areas[pairs.first] * areas[pairs.second]
    own_scale = factor / pairs.lengths**4 * areas**2
    # Weights of pairs, and of points with themselves, without images; then those of the images in one boundary.
    plain = pair_kernel(distance / lengths) * scale, pair_kernel(0.0) * own_scale
    residual, widths = np.zeros(len(areas)), pairs.lengths
    if balanced:
        balance = balance_weights(cloud, distance, plain[0], areas, report)
        plain = plain[0] * balance.factor, plain[1]
        residual, widths = balance.residual, _widths(cloud, distance, plain[0], areas)
    neumann, dirichlet = (tuple(np.zeros_like(part) for part in plain) for _ in range(2))
    for part, images, h, units in (
        (0, mirror(pairs, distance, cloud.boundary), lengths, scale),
        (1, own_images(pairs, cloud.boundary), pairs.lengths, own_scale),
    ):
        nearest, second, across = images
        for rows, image, larger in (nearest, second):
            weight = pair_kernel(image / h[rows]) * units[rows]
            neumann[part][rows] += (1.0 + _NEUMANN * (larger - 1.0)) * weight
            dirichlet[part][rows] += (1.0 + _DIRICHLET * (larger - 1.0)) * weight
        rows, image, larger = across
        growth = np.maximum(1.0 + _NEUMANN * (larger - 1.0), 0.0)  # two boundaries that curve inwards
        plain[part][rows] += growth * pair_kernel(image / h[rows]) * units[rows]
    weights = _for_callers_points(cloud, plain[0] + neumann[0], plain[1] + neumann[1])
    stiffness = (sparse.diags_array(weights.sum(axis=1), format="csr") - weights).tocsr()
    images = [sparse.csr_array(stiffness.shape)] * 2
    if neumann[1].any():
        known = neumann[0] > 0.0
        cloud = replace(cloud, pairs=pairs.keep(known))
        images = [_for_callers_points(cloud, part[0][known], part[1]) for part in (neumann, dirichlet)]
    return Stiffness(stiffness, *images, residual, widths)


def _widths(cloud, distance, weights, areas):
    """Return the smoothing length of the kernel whose fourth moment, 8 mu2 h^2 of the area, the weights have, (m,).

    It is a mean over the neighbours, as the operator would make much of what differs from point to point by chance.
    """
    pairs = cloud.pairs
    fourth, near = pairs.half(weights * distance**4), pairs.half(weights)
    moment, unit = fourth.sum(axis=0) + fourth.sum(axis=1), 8.0 * SECOND_MOMENT * areas
    total = near.sum(axis=0) + near.sum(axis=1)
    moment, unit = (near @ (values / total) + near.T @ (values / total) for values in (moment, unit))
    width = np.sqrt(moment / unit)
    return np.where(cloud.boundary.reached(pairs.lengths), pairs.lengths, width)


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
