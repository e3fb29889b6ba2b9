"""Peers on points alone that no package offers: PCL of Luo, Safa, Wang, and GMLS."""

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from .meshes import without_row_sums
from .operator import Operator, Unsymmetric

_NORMALS = 16  # neighbours of the tangent planes
_VORONOI = 30  # neighbours that may bound a cell
_BLOCK = 4000  # cells at a time
_CUT = 1e-6  # share of the heat kernel's height at which it ends: 175 neighbours where t is the squared spacing
_STENCIL = 16  # points of a GMLS fit, its own included
_REACH = 1.1  # where its weights end, in distances to the last of them


def tangent_coordinates(points, neighbors):
    """Find neighbourhoods and their coordinates in the plane of least squares.

    Parameters
    ----------
    points : ndarray, (n, 3)
    neighbors : ndarray, (m, k) int
        Each point's own index comes first.

    Returns
    -------
    flat : ndarray, (n, k, 2)
        Relative to the point, along the plane.
    height : ndarray, (n, k)
        Relative to the point, across the plane.
    """
    offset = points[neighbors] - points[neighbors[:, :1]]
    near = offset[:, :_NORMALS]
    near = near - near.mean(axis=1, keepdims=True)
    axes = np.linalg.eigh(np.einsum("nki,nkj->nij", near, near))[1]
    local = offset @ axes
    return local[:, :, :0:-1], local[:, :, 0]


def voronoi_areas(flat, reach):
    """Compute the areas of the Voronoi cells of the origin among neighbours in the plane.

    On the bisector of each neighbour every other one leaves an interval; what is left of all of them is the edge.

    Parameters
    ----------
    flat : ndarray, (n, k, 2)
        Neighbours, the origin not among them.
    reach : ndarray, (n,)
        Cells end at a regular octagon of this inradius, up to which the neighbours determine them.

    Returns
    -------
    ndarray, (n,)
    """
    turn = 0.25 * np.pi * np.arange(8)
    frame = 2.0 * reach[:, None, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    sites = np.concatenate([flat, frame], axis=1)
    length = np.linalg.norm(sites, axis=2)
    along = np.stack([-sites[:, :, 1], sites[:, :, 0]], axis=2) / length[:, :, None]
    # The points sites[j] / 2 + s along[j] of an edge fulfil s rise <= room for every other site.
    product = sites @ sites.transpose(0, 2, 1)
    rise = along @ sites.transpose(0, 2, 1)
    room = 0.5 * (length[:, None, :] ** 2 - product)
    parallel = np.abs(rise) <= 1e-12 * length[:, None, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = room / rise
    end = np.where((rise > 0.0) & ~parallel, bound, np.inf).min(axis=2)
    begin = np.where((rise < 0.0) & ~parallel, bound, -np.inf).max(axis=2)
    hidden = (parallel & (room < -1e-12 * length[:, None, :] ** 2)).any(axis=2)  # behind one in the same direction
    return 0.25 * np.einsum("nj,nj->n", np.where(hidden, 0.0, np.maximum(end - begin, 0.0)), length)


def pcl(points, time_factor=1.0):
    """Luo, Safa, Wang 2009: the heat kernel between points with Voronoi cells of their tangent planes.

    ``L f(x_i) = sum_j exp(-|x_i - x_j|^2 / 4 t) / (4 pi t^2) (f_j - f_i) v_j``, a symmetric pencil with the areas v.

    Parameters
    ----------
    points : ndarray, (n, 3)
    time_factor : float
        t in squared spacings, of which one is the mean area.

    Notes
    -----
    At a boundary, where nothing bounds them, cells reach out some 1.5 spacings: the areas are too large there.
    """
    tree = cKDTree(points)
    distance, neighbors = tree.query(points, _VORONOI + 1)
    areas = np.empty(len(points))
    for begin in range(0, len(points), _BLOCK):
        part = slice(begin, begin + _BLOCK)
        flat = tangent_coordinates(points, neighbors[part])[0]
        areas[part] = voronoi_areas(flat[:, 1:], 0.5 * distance[part, -1])
    time = time_factor * areas.mean()
    pairs = tree.query_pairs(np.sqrt(-4.0 * time * np.log(_CUT)), output_type="ndarray")
    i, j = pairs.T
    squared = ((points[i] - points[j]) ** 2).sum(axis=1)
    weights = np.exp(-squared / (4.0 * time)) / (4.0 * np.pi * time**2) * areas[i] * areas[j]
    weights = sparse.csr_array((weights, (i, j)), shape=(len(points), len(points)))
    return Operator(points, without_row_sums(weights + weights.T), areas, areas)


def gmls2(points):
    """Moving least squares of degree 2 on 16 points: height of the surface and function, fitted over the tangent plane.

    Both fits go through the point itself. With the fitted height's slopes h_i, second derivatives h_ij and the metric
    g = I + grad h grad h^T the operator is ``g^ij (f_ij - h_ij h . grad f / (1 + |grad h|^2))`` at the origin.
    """
    n = len(points)
    distance, neighbors = cKDTree(points).query(points, _STENCIL)
    unit = distance[:, -1:]
    flat, height = tangent_coordinates(points, neighbors)
    u, v = np.moveaxis(flat[:, 1:] / unit[:, :, None], 2, 0)
    weight = (1.0 - (distance[:, 1:] / (_REACH * unit)) ** 2) ** 2  # the root of the weights of the squares
    basis = np.stack([u, v, 0.5 * u * u, u * v, 0.5 * v * v], axis=2)
    derivatives = np.linalg.pinv(weight[:, :, None] * basis) * weight[:, None, :]  # (n, 5, k) of the neighbours' values
    slope_u, slope_v, *bend = np.einsum("nck,nk->cn", derivatives, height[:, 1:] / unit)
    stretch = 1.0 + slope_u**2 + slope_v**2
    inverse = (1.0 - slope_u**2 / stretch, -2.0 * slope_u * slope_v / stretch, 1.0 - slope_v**2 / stretch)
    drift = -sum(g * h for g, h in zip(inverse, bend, strict=True)) / stretch
    factors = np.stack([drift * slope_u, drift * slope_v, *inverse], axis=1)
    rows = np.einsum("nc,nck->nk", factors, derivatives) / unit**2
    pointer = np.arange(0, rows.size + 1, rows.shape[1])
    weights = sparse.csr_array((rows.ravel(), neighbors[:, 1:].ravel(), pointer), shape=(n, n))
    return Unsymmetric(points, without_row_sums(weights), np.ones(n), None)
