"""Assemble the stiffness matrix, eq. (10) of the paper."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from ..algebra import matrix_by_rows, on_all_cores, runs
from ..geometry import Cloud, Pairs, Patch, ScaledPoints
from ..kernel import SECOND_MOMENT, pair_kernel
from ..types import Array, Bools, Floats, Ints
from .curvature import weight_factor
from .images import mirror, own_images
from .weights import balance_weights


@dataclass(frozen=True)
class Stiffness:
    """The weak form of the operator, and measures of its weights."""

    # (n, n), symmetric, rows sum to zero, columns sorted; without units, so the same in any scale
    matrix: sparse.csr_array
    # (n, n), symmetric weights of the images in one boundary that the matrix holds, those of points in their own image
    # on the diagonal. (An image of an image, across a corner, has the point's value whatever holds at the boundary.)
    images: sparse.csr_array
    residual: Floats  # (m,), relative residual of the moments of the weights around each distinct point
    # (m,), smoothing length of the kernel whose fourth moment the weights have; zero for no symbol correction
    widths: Floats


@dataclass(frozen=True)
class _Images:
    """Weights of images in boundaries."""

    rows: Ints  # (k,), whose image each is: a pair's or a point's. A row has up to three of them
    weights: Floats  # (k,)
    fourth: Floats  # (k,), fourth moment of the weight, less that at the distance of the pair itself
    once: Bools  # (k,), those in one boundary; others are images of images


def assemble_stiffness(
    cloud: Cloud, distance: Floats, areas: Floats, report: Callable[[], None] = lambda: None
) -> Stiffness:
    """Assemble K = -D G D of eq. (10) for the caller's points, with weights of the moments that the kernel has.

    Points at the same place take equal parts of its area and couple as neighbors at distance zero. The image of a point
    in a boundary has the point's value, so that it adds to the weight of the pair. Distances, (p,), are those of pairs
    along the surface; areas, (m,), are in scaled coordinates. `report` is called now and then while weights are
    balanced; it may raise `Cancelled`.
    """
    pairs, scaled = cloud.pairs, cloud.scaled
    weights, own, images, alone = _kernel_weights(cloud, distance, areas)
    balance = balance_weights(cloud, distance, weights, areas, report)
    residual, factor = balance.residual, balance.factor[images.rows]
    weights *= balance.factor
    del balance  # its memory is needed
    images = replace(images, weights=images.weights * factor, fourth=images.fourth * factor)
    widths = _widths(pairs, distance, areas, weights, images, alone)
    stiffness = stiffness_matrix(scaled, pairs, weights, own)
    rows = images.rows[images.once]
    m = len(areas)
    mirrored = np.bincount(alone.rows[alone.once], alone.weights[alone.once], m)
    once = sparse.csr_array((images.weights[images.once], (pairs.first[rows], pairs.second[rows])), shape=(m, m))
    images = _symmetric(scaled, once, mirrored)
    return Stiffness(stiffness, images, residual, widths)


def stiffness_matrix(scaled: ScaledPoints, pairs: Pairs, weights: Floats, own: Floats) -> sparse.csr_array:
    """Return the matrix of a function's energy, half the sum of ``weights (f_i - f_j)^2`` over ordered pairs, (n, n).

    Weights, (p,), of pairs of distinct points are overwritten; `own`, (m,), are those of each point with itself: the
    coupling of points at the same place, which share its area.
    """
    half = pairs.half(weights)
    if scaled.shared:
        whole = _symmetric(scaled, half, own)
        return (sparse.diags_array(whole.sum(axis=1), format="csr") - whole).tocsr()
    total = half.sum(axis=0) + half.sum(axis=1)
    np.negative(half.data, out=half.data)
    return _symmetric(scaled, half, total)


def _kernel_weights(cloud: Cloud, distance: Floats, areas: Floats) -> tuple[Floats, Floats, _Images, _Images]:
    """Return the weights of the kernel for pairs, (p,), and for points with themselves, (m,), with their images.

    Return the images of pairs, and of points alone, too.
    """
    pairs, lengths = cloud.pairs, cloud.pairs.lengths
    factor = weight_factor(lengths, cloud.gaussian_curvature)
    weights = np.empty(len(distance))

    def weigh(patch: Patch) -> None:
        first, second, h = patch.first(areas), patch.second(areas), patch.mean(lengths)
        weights[patch.pairs] = pair_kernel(distance[patch.pairs] / h) * (patch.mean(factor) / h**4) * first * second

    on_all_cores(weigh, pairs.patches)
    own = pair_kernel(0.0) * factor / lengths**4 * areas**2

    def weigh_images(
        weights: Floats, found: list[tuple[Ints, Floats, Floats]], distance: Floats, first: Ints, second: Ints
    ) -> _Images:
        parts = []
        for number, (rows, image, _) in enumerate(found):
            i, j = first[rows], second[rows]
            h = 0.5 * (lengths[i] + lengths[j])
            weight = pair_kernel(image / h) * (0.5 * (factor[i] + factor[j]) / h**4) * areas[i] * areas[j]
            weights[rows] += weight
            parts.append((rows, weight, weight * (image**4 - distance[rows] ** 4), np.full(len(rows), number < 2)))
        return _Images(*(np.concatenate(part) for part in zip(*parts, strict=True)))

    images = weigh_images(weights, mirror(pairs, distance, cloud.boundary), distance, pairs.first, pairs.second)
    points = np.arange(len(own))
    alone = weigh_images(own, own_images(pairs, cloud.boundary), np.zeros(len(own)), points, points)
    return weights, own, images, alone


def _widths(pairs: Pairs, distance: Floats, areas: Floats, weights: Floats, images: _Images, alone: _Images) -> Floats:
    """Return the smoothing length of the kernel whose fourth moment, 8 mu2 h^2 of the area, the weights have, (m,).

    It is a mean over the neighbors, as the operator would amplify random differences from point to point.
    """

    def moments(patch: Patch) -> list[list[Floats]]:
        own = weights[patch.pairs]
        return [[own, own * distance[patch.pairs] ** 4]] * 2

    total, moment = pairs.over_ends(moments, 2)
    for rows, added in (
        (pairs.first[images.rows], images.fourth),
        (pairs.second[images.rows], images.fourth),
        (alone.rows, alone.fourth),
    ):
        moment += np.bincount(rows, added, len(areas))
    unit, near = 8.0 * SECOND_MOMENT * areas, pairs.half(weights)
    total[total == 0.0] = 1.0  # of points without pairs
    moment, unit = (near @ (values / total) + near.T @ (values / total) for values in (moment, unit))
    return np.where(unit > 0.0, np.sqrt(moment / np.where(unit > 0.0, unit, 1.0)), pairs.lengths)


def _symmetric(scaled: ScaledPoints, half: sparse.csr_array, own: Array) -> sparse.csr_array:
    """Return the symmetric matrix, (n, n), of quantities of points with others and with themselves, columns sorted.

    The half, (m, m), holds each pair once. Points at the same place share its weights.
    """
    n, m = len(scaled.inverse), len(own)
    alone = sparse.csr_array((own, np.arange(m, dtype=np.int32), np.arange(m + 1, dtype=np.int32)), shape=(m, m))
    parts, counts = (half, half.T.tocsr(), alone), np.zeros(n, dtype=np.int32)
    known = np.flatnonzero(scaled.inverse >= 0)
    counts[known] = np.sum([_entries(part, scaled) for part in parts], axis=0)[scaled.inverse[known]]
    # The caller's points, those at the same place one after the other.
    caller = known[np.argsort(scaled.inverse[known], kind="stable")].astype(np.int32)
    first = np.cumsum(scaled.copies) - scaled.copies

    def join(rows: slice) -> sparse.csr_array:
        place = scaled.inverse[rows]
        place = place[place >= 0]
        near = np.arange(3 * len(place)).reshape(3, -1).T.ravel()  # rows of the same point
        joined = sparse.vstack([part[place] for part in parts], format="csr")[near]
        values, columns, start = joined.data, joined.indices, joined.indptr[::3]
        if scaled.shared:
            times, row = scaled.copies[columns], np.repeat(place, np.diff(start))
            values = np.repeat(values / (scaled.copies[row] * times), times)
            columns = runs(first[columns], times)
            start = np.append(0, np.cumsum(times))[start]
        result = sparse.csr_array((values, caller[columns], start), shape=(len(place), n))
        result.sort_indices()
        result.eliminate_zeros()
        return result

    return matrix_by_rows(join, counts, n)


def _entries(matrix: sparse.csr_array, scaled: ScaledPoints) -> Ints:
    """Return how many entries the rows have for the caller's points, (m,): zero ones, of pairs too far along, none."""
    if not scaled.shared and matrix.data.all():
        return np.diff(matrix.indptr)
    counted = np.where(matrix.data == 0.0, 0, scaled.copies[matrix.indices])
    counts: Ints = sparse.csr_array((counted, matrix.indices, matrix.indptr), shape=matrix.shape).sum(axis=1)
    return counts
