"""Which side of a surface positions around it are on, whatever the signs of its normals."""

import numpy as np
from scipy import sparse

from ..algebra import blocks
from ..geometry import ON, SMOOTH
from ..operator import Heights, ImplicitSurface
from ..types import Floats, Ints
from .grid import Grid

_FAINT = 0.1  # weight of an edge far from all points, relative to one next to them
_EDGES = 1 << 16  # that vote at one time
_PAST = 1.0  # edges of the grid: how far beyond the boundary a surface has no sides


def find_sides(surface: ImplicitSurface, there: Heights, grid: Grid, around: bool) -> Floats:
    """Find on which of two sides of a surface the corners of a grid near it are, (c,): 1.0 or -1.0.

    Each edge between two corners votes whether its ends are on one side or on two, by the quadrics of the points next
    to them: by heights only, not by the signs of normals. The largest votes count first: positions are joined to
    groups, groups to larger ones by the sum of all edges between them, until none is left. So paths through the empty
    space around thin parts count as much as those along the surface, if `around`; else those far from points count
    little. Of each group of corners that edges join, most normals point to the side 1.0.
    """
    support = there.support
    parts = blocks(len(grid.first), _EDGES)
    votes = np.concatenate([_votes(surface, there, support, grid, part, around) for part in parts])
    side, group = agreeing(len(grid.places), grid.first, grid.second, votes)
    outer = np.bincount(group, side * there.height * support)
    return np.where(outer[group] < 0.0, -side, side)


def _votes(surface: ImplicitSurface, there: Heights, support: Floats, grid: Grid, edges: slice, around: bool) -> Floats:
    """Return the vote of each of some edges for its ends being on one side, (k,); negative for two.

    An end that is close to the surface has a small vote. A crossed quadric counts as far as points support it, so that
    the surface does not go on beyond its sharp edges. Where the quadrics at both ends do not agree, the vote is zero.
    """
    places, first, second, length = grid.places, grid.first[edges], grid.second[edges], grid.length[edges]
    own, other = there.nearest[first], there.nearest[second]
    by_own, by_other = (
        (surface.over(rows, places[first]), surface.over(rows, places[second])) for rows in (own, other)
    )
    cut = by_own[0] * by_own[1] < 0.0
    votes = np.minimum(np.min(np.abs([*by_own, *by_other]), axis=0) / length, 1.0)
    cosine = np.einsum("ij,ij->i", surface.normals[own], surface.normals[other])
    apart = np.abs(surface.over(own, surface.points[other])) + np.abs(surface.over(other, surface.points[own]))
    one = (np.abs(cosine) > SMOOTH) & (apart < 2.0 * ON * (surface.spacing[own] + surface.spacing[other]))
    support = np.minimum(support[first], support[second])
    whole = 1.0 if around else np.maximum(support, _FAINT)
    votes *= np.where(cut, np.where(one, _FAINT - support, 0.0), whole)
    unknown = (cut != (by_other[0] * by_other[1] < 0.0)) | (
        np.maximum(there.beyond[first], there.beyond[second]) > _PAST * length
    )
    return np.where(unknown, 0.0, votes)


def agreeing(count: int, first: Ints, second: Ints, votes: Floats) -> tuple[Floats, Ints]:
    """Choose signs that agree across edges of positive votes and differ across negative ones, the largest sums first.

    Edges have two ends and votes, (e,) each. Return the signs, 1.0 or -1.0, and groups, the same number for positions
    that edges join, (count,) each.
    """
    sign, group, every = np.ones(count), np.arange(count), np.arange(count)
    while True:
        low, high = np.sort([group[first], group[second]], axis=0)
        between = low != high
        first, second, votes, low, high = (values[between] for values in (first, second, votes, low, high))
        signed = votes * sign[first] * sign[second]
        total = sparse.coo_array((signed, (low, high)), shape=(count, count)).tocsr().tocoo()
        link = np.flatnonzero(total.data)
        if not len(link):
            return sign, group
        link = link[np.argsort(np.abs(total.data[link]), kind="stable")]
        ends = np.stack(total.coords)[:, link]
        best = np.full(count, -1)
        best[ends.T.ravel()] = np.repeat(np.arange(len(link)), 2)  # the last one, which is the largest, stays
        joined = np.flatnonzero(best >= 0)
        parent, factor = every.copy(), np.ones(count)
        parent[joined] = ends[:, best[joined]].sum(axis=0) - joined
        factor[joined] = np.sign(total.data[link[best[joined]]])
        root = (parent[parent] == every) & (every <= parent)  # of two that chose each other
        parent[root], factor[root] = every[root], 1.0
        while np.any(parent[parent] != parent):
            factor, parent = factor * factor[parent], parent[parent]
        sign, group = sign * factor[group], parent[group]
