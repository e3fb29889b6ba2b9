"""Which side of a surface positions around it are on, whatever the signs of its normals."""

import numpy as np
from scipy import sparse

from ...geometry import ON, SMOOTH
from ...operator import Heights, ImplicitSurface
from ...types import Floats, Ints

_FAINT = 0.1  # weight of an edge far from all points, relative to one next to them
_PAST = 1.0  # how far beyond the boundary a surface has no sides


def find_sides(
    surface: ImplicitSurface, there: Heights, places: Floats, first: Ints, second: Ints, around: bool
) -> Floats:
    """Find on which of two sides of a surface positions near it are.

    Each edge between two positions votes whether its ends are on one side or on two, by the quadrics of the points next
    to them: by heights only, not by the signs of normals. The largest votes count first: positions are joined to
    groups, groups to larger ones by the sum of all edges between them, until none is left. So paths through the empty
    space around thin parts count as much as those along the surface.

    Parameters
    ----------
    surface : ImplicitSurface
    there : Heights
        Of the positions.
    places : ndarray, (k, 3)
    first, second : ndarray, (e,) int
        Positions at the ends of edges, which are of length one.
    around : bool
        Whether paths through the empty space far from points count in full, as those around thin parts do; else little.

    Returns
    -------
    ndarray, (k,)
        1.0 on the side that most normals point to in each group of positions that edges join, -1.0 on the other.
    """
    votes = _votes(surface, there, places, first, second, around)
    side, group = agreeing(len(places), first, second, votes)
    outer = np.bincount(group, side * there.height * there.support)
    return np.where(outer[group] < 0.0, -side, side)


def _votes(surface: ImplicitSurface, there: Heights, places: Floats, first: Ints, second: Ints, around: bool) -> Floats:
    """Return the vote of each edge for its ends being on one side, (e,); negative for two.

    An end that is close to the surface has a small vote. A crossed quadric counts as far as points support it, so that
    the surface does not go on beyond its sharp edges. Where the quadrics at both ends do not agree, the vote is zero.
    """
    own, other = there.nearest[first], there.nearest[second]
    by_own, by_other = (
        (surface.over(rows, places[first]), surface.over(rows, places[second])) for rows in (own, other)
    )
    cut = by_own[0] * by_own[1] < 0.0
    votes = np.minimum(np.min(np.abs([*by_own, *by_other]), axis=0), 1.0)
    cosine = np.einsum("ij,ij->i", surface.normals[own], surface.normals[other])
    apart = np.abs(surface.over(own, surface.points[other])) + np.abs(surface.over(other, surface.points[own]))
    one = (np.abs(cosine) > SMOOTH) & (apart < 2.0 * ON * (surface.spacing[own] + surface.spacing[other]))
    support = np.minimum(there.support[first], there.support[second])
    whole = 1.0 if around else np.maximum(support, _FAINT)
    votes *= np.where(cut, np.where(one, _FAINT - support, 0.0), whole)
    unknown = (cut != (by_other[0] * by_other[1] < 0.0)) | (
        np.maximum(there.beyond[first], there.beyond[second]) > _PAST
    )
    return np.where(unknown, 0.0, votes)


def agreeing(count: int, first: Ints, second: Ints, votes: Floats) -> tuple[Floats, Ints]:
    """Choose signs that agree across edges of positive votes and differ across negative ones, the largest sums first.

    Parameters
    ----------
    count : int
        Of positions.
    first, second : ndarray, (e,) int
        The ends of edges.
    votes : ndarray, (e,)

    Returns
    -------
    sign : ndarray, (count,)
        1.0 or -1.0.
    group : ndarray, (count,) int
        The same number for positions that edges join.
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
