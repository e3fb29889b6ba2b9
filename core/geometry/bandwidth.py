"""Smoothing lengths: how wide the kernel is at every point."""

import numpy as np
from scipy.spatial import cKDTree

from ..cores import cores
from ..kernel import SUPPORT
from ..options import LaplacianOptions
from ..types import Floats, Ints
from .agreed import Decisions
from .boundary import Boundary
from .cells import Cells
from .moments import MET, least_error
from .nearest import ENOUGH, GAP, POWER, ROUNDS, WIDER, Nearest
from .quadrics import Quadrics

_NARROWEST = 1.08  # h over the radius of the cells
_BENT = 0.02  # relative error from the surface's curvature within the kernel, over squared curvatures times h^2
_STEPS = 4  # from neighbors to their neighbors, in search of the place deepest inside the boundary


def smoothing_lengths(
    nearest: Nearest,
    normals: Floats,
    quadrics: Quadrics,
    cells: Cells,
    boundary: Boundary,
    options: LaplacianOptions,
    component: Ints | None = None,
    decisions: Decisions | None = None,
) -> Floats:
    """Choose h for every point.

    Parameters
    ----------
    nearest : Nearest
        Of m points.
    normals : ndarray, (m, 3)
        Unit normals of any sign.
    quadrics : Quadrics
        Of the points, for how the surface bends.
    cells : Cells
        Of the points.
    boundary : Boundary
    options : LaplacianOptions
        Its bandwidth, neighbors and bandwidth_factor.
    component : ndarray, (m,) int, optional
        Component of each point; neighbors are counted within one.
    decisions : Decisions, optional
        Of the one length of "global".

    Returns
    -------
    ndarray, (m,)
        Global: the mean distance to the n-th neighbor, everywhere the same. Local: each point's own distance, averaged
        twice over the 40 nearest neighbors so that h varies slowly within a support. Adaptive: as narrow as the points
        and the shape let it be. It starts from 1.08 times the radius of the cells around, in the eighth mean, times the
        factor: the width of a gap in one direction decides, not the number of points in the others. Where a wider
        kernel would reduce the residual of its moments by more than it adds curvature error, it is wider. Even points
        have some 22 others inside it then, random ones 55. A larger factor leaves fewer points that ask for more, so
        that h varies less.
    """
    if options.bandwidth == "adaptive":
        lengths = options.bandwidth_factor * _NARROWEST * mean_gaps(nearest, cells.radius, POWER)
        cell = nearest.averaged(cells.areas, ROUNDS)
        lengths = np.maximum(lengths, options.bandwidth_factor * np.sqrt(ENOUGH / np.pi * cell) / SUPPORT)
        return lengths * _widening(nearest, normals, quadrics, cells, boundary, lengths)
    if options.bandwidth == "global":
        found = (decisions or Decisions()).settle(
            "length", lambda: float(neighbor_distance(nearest.tree, options.neighbors, component).mean())
        )
        return np.full(len(normals), options.bandwidth_factor * found)
    distance = neighbor_distance(nearest.tree, options.neighbors, component)
    return options.bandwidth_factor * nearest.averaged(distance, 2)


def _widening(
    nearest: Nearest, normals: Floats, quadrics: Quadrics, cells: Cells, boundary: Boundary, lengths: Floats
) -> Floats:
    """Return the factor on the narrowest h of every point, (m,), of least error, in the eighth mean over neighbors.

    Both errors are known before the weights: the least residual of the moments that any weights reach, and the
    curvature error, from the surface bending within the kernel, which grows with h^2. Wider kernels are tried as long
    as the sum of both falls.
    """

    def error(rows: Ints, factor: float) -> Floats:
        return least_error(nearest, normals, cells.areas, boundary, factor * lengths, rows) + factor**2 * bend[rows]

    bend = (
        _BENT * lengths**2 * nearest.averaged(np.einsum("iab,iab->i", quadrics.shape_operator, quadrics.shape_operator))
    )
    rows, result, factor = np.arange(len(lengths)), np.ones(len(lengths)), 1.0
    least = error(rows, factor)
    while len(rows):
        # Stop once the moment error is negligible, or the total error is below the curvature error of the next width.
        open_ = least > np.maximum((WIDER * factor) ** 2 * bend[rows], factor**2 * bend[rows] + MET)
        rows, least, factor = rows[open_], least[open_], WIDER * factor
        found = error(rows, factor)
        better = found < least
        rows, least = rows[better], found[better]
        result[rows] = factor
    return nearest.averaged(result**POWER) ** (1.0 / POWER)


def mean_gaps(nearest: Nearest, radius: Floats, power: int) -> Floats:
    """Return how wide the gaps around every point are, (m,): the radii of the Voronoi cells, (m,), in the mean.

    In the mean of a high power, such as the eighth, the widest gaps decide.
    """
    radius = np.minimum(radius, GAP * nearest.spacing)
    return nearest.averaged(radius**power, ROUNDS) ** (1.0 / power)


def depth(nearest: Nearest, inside: Floats) -> Floats:
    """Return how far from a boundary the surface around every point gets, (m,): half the width of a narrow one."""
    deepest = inside[:, 0]
    if np.isfinite(deepest).any():
        counted = nearest.weight > 1e-12  # weights on other sheets, and of the last one, are zero but for rounding
        for _ in range(_STEPS):
            deepest = np.max(deepest[nearest.index], axis=1, where=counted, initial=0.0)
    return deepest


def neighbor_distance(tree: cKDTree, neighbors: int, component: Ints | None) -> Floats:
    """Return how far the n-th neighbor of every point is, (m,); in components of fewer points, how far it would be.

    Components are further apart than that in the tree.
    """
    # The tree counts a point as its own first neighbor.
    distance: Floats = tree.query(tree.data, k=[min(neighbors + 1, tree.n)], workers=cores())[0][:, 0]
    if component is not None:
        size = np.bincount(component)
        for small in np.flatnonzero(size <= neighbors):
            few = size[small] - 1
            rows = np.flatnonzero(component == small)
            furthest = tree.query(tree.data[rows], k=[few + 1], workers=cores())[0][:, 0]
            distance[rows] = furthest * np.sqrt(neighbors / few)
    return distance
