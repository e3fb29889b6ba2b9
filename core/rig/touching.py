"""Sheets of a surface that touch, as a hand and a hip: told apart by their normals."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components, dijkstra

from ..geometry import COUNT
from ..operator import LaplaceBeltrami
from ..types import Bools, Floats
from .inside import Inside

_TRUSTED = 0.5  # trust of points whose normals count, as everywhere
_OFF = 1.5  # cells of the grid from a point, where both its sides are looked at
_SURE = 0.5  # of the sum of winding numbers on both sides: one on a closed body, minus one where normals point inwards
_ALONG = 1e-3  # of the length of a step, that counts as height across the surface


def outward_normals(laplacian: LaplaceBeltrami) -> Floats:
    """Return unit normals, (n, 3), that point outwards on closed components, on each of several bodies that touch.

    The operator's may be those of one body reversed, where bodies touch at so few points that nothing tells whether
    these are two outsides or one surface. Points next to a contact, whose winding numbers say little, have the side of
    those from which the way along the surface is the straightest.
    """
    component, normals = laplacian.component, laplacian.normals
    ends = np.bincount(component[component >= 0], laplacian.boundary[component >= 0]) > 0.0
    kept = np.flatnonzero((component >= 0) & ~ends[component])
    if not len(kept):
        return normals
    winding, points = Inside(laplacian), laplacian.surface_points[kept]
    off = _OFF * winding.cell * normals[kept]
    sides = winding.at(points + off) + winding.at(points - off)
    if not (sides < -_SURE).any():
        return normals
    result = normals.copy()
    result[kept] *= _spread(laplacian.stiffness[kept][:, kept], points, normals[kept], sides)[:, None]
    return result


def _spread(stiffness: sparse.csr_array, points: Floats, normals: Floats, sides: Floats) -> Floats:
    """Return signs of normals, (m,), by the winding numbers of sure points.

    Each point is two nodes of a graph, one for each sign; steps join those whose normals agree then.
    """
    first, second = stiffness.nonzero()
    first, second = first[first < second], second[first < second]
    chord = points[second] - points[first]
    across = sum(np.abs(np.einsum("ij,ij->i", chord, normals[ends])) for ends in (first, second))
    length = across + _ALONG * np.linalg.norm(chord, axis=1) + np.finfo(float).tiny
    count, other = len(points), np.einsum("ij,ij->i", normals[first], normals[second]) < 0.0
    rows, columns = (
        np.concatenate([first, first + count]),
        np.concatenate([second + count * other, second + count * ~other]),
    )
    graph = sparse.csr_array((np.tile(length, 2), (rows, columns)), shape=(2 * count, 2 * count))
    sure = np.flatnonzero(np.abs(sides) >= _SURE)
    starts = sure + count * (sides[sure] < 0.0)
    way = dijkstra(graph, directed=False, indices=starts, min_only=True)
    return np.where(way[count:] < way[:count], -1.0, 1.0)


def apart(stiffness: sparse.csr_array, normals: Floats, trust: Floats | None = None) -> tuple[sparse.csr_array, Bools]:
    """Leave out pairs of points whose normals, (m, 3), differ by more than a right angle; rows sum to zero again.

    Where sheets lie closer than the points of each, single normals are wrong, and would join both sheets. Trust, (m,),
    is as of `LaplaceBeltrami`. Return also the points that are not trusted, or would be alone or with a few others:
    they are no sheet, but may have normals of the wrong sign, and stay with that sheet which they are coupled with
    most. The stiffness has no positive numbers off its diagonal.
    """
    pairs = stiffness.tocoo()
    first, second = pairs.coords
    cut = np.einsum("ij,ij->i", normals[first], normals[second]) <= 0.0
    doubt = np.zeros(len(normals), dtype=bool) if trust is None else trust < _TRUSTED
    sheet = connected_components(without(stiffness, cut | doubt[first] | doubt[second]), directed=False)[1]
    open_ = np.bincount(sheet)[sheet] < COUNT
    unsure = np.zeros(len(normals), dtype=bool)
    while True:  # from the edges of a patch of such points inwards
        beside = open_[first] & ~open_[second]
        shares = sparse.coo_array((-pairs.data[beside], (first[beside], sheet[second[beside]])), shape=stiffness.shape)
        shares.sum_duplicates()
        order = np.argsort(shares.data, kind="stable")  # the last one counts
        found = shares.coords[0][order]
        if not len(found):
            break
        sheet[found] = shares.coords[1][order]
        unsure[found], open_[found] = True, False
    cut = np.where(unsure[first] | unsure[second], sheet[first] != sheet[second], cut)
    return without(stiffness, cut), unsure


def without(stiffness: sparse.csr_array, cut: Bools) -> sparse.csr_array:
    """Return the stiffness without some pairs of points, given for each stored entry in the order of ``tocoo``."""
    pairs = stiffness.tocoo()
    first, second = pairs.coords
    kept = ~cut & (first != second)
    weights = sparse.csr_array((-pairs.data[kept], (first[kept], second[kept])), shape=stiffness.shape)
    return (sparse.diags_array(weights.sum(axis=1), format="csr") - weights).tocsr()
