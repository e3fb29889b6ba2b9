"""The method of images: past a boundary the surface goes on as in a mirror."""

import numpy as np

from ..geometry import CURVED, SMOOTH, Boundary, Pairs
from ..kernel import SUPPORT
from ..types import Bools, Floats, Ints


def mirror(pairs: Pairs, distance: Floats, boundary: Boundary) -> list[tuple[Ints, Floats, Floats]]:
    """Find the pairs that the mirror image of one end in the boundary still reaches.

    Parameters
    ----------
    pairs : Pairs
        With p pairs of m points.
    distance : ndarray, (p,)
        Distance of each pair along the surface.
    boundary : Boundary
        Of the m points.

    Returns
    -------
    list of (rows, distance, factor), (k,) each
        Rows of the pairs, no row twice; from one end to the image of the other, ``s'^2 = s^2 + 4 d_i d_j`` for a
        straight boundary; how much larger the image of the area is than the area. First for the nearest boundaries,
        then for the second ones, then for the images of images across a corner.

    Notes
    -----
    Of two points along a boundary of geodesic curvature k the images lie further apart than the points, by the share
    k (d_i + d_j) of their squared distance along the boundary; areas grow by as much.
    """
    lengths = pairs.lengths
    near = boundary.reached(lengths)  # further points have no image within reach
    known = np.isfinite(boundary.distance[:, 0])
    first, second = pairs.first, pairs.second
    rows = np.zeros(0, dtype=np.intp)
    if near.any():
        rows = np.flatnonzero((near[first] & known[second]) | (near[second] & known[first]))
    first, second = first[rows], second[rows]
    d, e = boundary.distance[first], boundary.distance[second]
    curvature = 0.5 * (boundary.curvature[first] + boundary.curvature[second])
    cosine = np.einsum("iac,ibc->iab", boundary.outward[first], boundary.outward[second])
    alone = ~np.isfinite(d[:, 1]) & ~np.isfinite(e[:, 1])
    # Which boundary of the second point is the first one's nearest?
    alike = np.maximum(cosine, 0.0)
    swapped = ~alone & (alike[:, 0, 1] + alike[:, 1, 0] > alike[:, 0, 0] + alike[:, 1, 1])
    e[swapped] = e[swapped, ::-1]
    curvature[swapped] = 0.5 * (boundary.curvature[first[swapped]] + boundary.curvature[second[swapped], ::-1])
    agreed = np.where(swapped[:, None], np.stack([cosine[:, 0, 1], cosine[:, 1, 0]], axis=1), cosine[:, [0, 1], [0, 1]])
    seen = np.isfinite(d) & np.isfinite(e) & (alone[:, None] | (agreed > SMOOTH))
    return _images(seen, distance[rows], d, e, curvature, 0.5 * (lengths[first] + lengths[second]), rows)


def own_images(pairs: Pairs, boundary: Boundary) -> list[tuple[Ints, Floats, Floats]]:
    """Return the images that points have within their own reach, as `mirror` does for pairs."""
    rows = np.flatnonzero(boundary.reached(pairs.lengths))
    d = boundary.distance[rows]
    return _images(np.isfinite(d), np.zeros(len(rows)), d, d, boundary.curvature[rows], pairs.lengths[rows], rows)


def _images(
    seen: Bools, distance: Floats, d: Floats, e: Floats, curvature: Floats, lengths: Floats, rows: Ints
) -> list[tuple[Ints, Floats, Floats]]:
    result = []
    squared = distance**2
    further = squared.copy()
    larger = np.ones(len(rows))
    for side in (0, 1):
        left, right = np.where(seen[:, side], d[:, side], 0.0), np.where(seen[:, side], e[:, side], 0.0)
        growth = np.clip(curvature[:, side] * (left + right), -CURVED, CURVED)
        added = 4.0 * left * right + growth * np.maximum(squared - (left - right) ** 2, 0.0)
        further += added
        larger *= 1.0 + growth
        reached = seen[:, side] & (squared + added < (SUPPORT * lengths) ** 2)
        result.append((rows[reached], np.sqrt(squared + added)[reached], 1.0 + growth[reached]))
    reached = seen.all(axis=1) & (further < (SUPPORT * lengths) ** 2)
    result.append((rows[reached], np.sqrt(further[reached]), larger[reached]))
    return result
