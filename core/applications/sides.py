"""Which side of a surface places around it are on, whatever the signs of its normals."""

import numpy as np
from scipy import sparse

from ..geometry import ON, SMOOTH
from ..operator import Heights, ImplicitSurface
from ..types import Floats, Ints

_FAINT = 0.1  # what an edge far from all points tells for one side, beside one next to them
_PAST = 1.0  # how far beyond the boundary a surface has no sides


def find_sides(
    surface: ImplicitSurface, there: Heights, places: Floats, first: Ints, second: Ints, around: bool
) -> Floats:
    """Tell on which of two sides places near a surface are.

    Each edge between two places tells whether its ends are on one side or on two, by the quadrics of the points next to
    them: of their heights only, not of the signs of normals. What tells most is believed first: places are joined to
    groups, groups to larger ones by the sum of all edges between them, until none is left. So ways through the empty
    space around thin parts count as much as those along the surface.

    Parameters
    ----------
    surface : ImplicitSurface
    there : Heights
        Of the places.
    places : ndarray, (k, 3)
    first, second : ndarray, (e,) int
        Places at the ends of edges, which are of length one.
    around : bool
        Whether ways through the empty space far from points count in full, as ways around thin parts do; else faintly.

    Returns
    -------
    ndarray, (k,)
        1.0 on the side that most normals point to in each group of places that edges join, -1.0 on the other.
    """
    told = _told(surface, there, places, first, second, around)
    side, group = agreeing(len(places), first, second, told)
    votes = np.bincount(group, side * there.height * there.support)
    return np.where(votes[group] < 0.0, -side, side)


def _told(surface: ImplicitSurface, there: Heights, places: Floats, first: Ints, second: Ints, around: bool) -> Floats:
    """Return by how much each edge tells that its ends are on one side; negative for two, (e,).

    An end that is close to the surface tells little. That a quadric is cut counts as far as points support it, so that
    the surface does not go on beyond its sharp rims. Where the quadrics at the two ends do not agree, nothing is told.
    """
    own, other = there.nearest[first], there.nearest[second]
    by_own, by_other = (
        (surface.over(rows, places[first]), surface.over(rows, places[second])) for rows in (own, other)
    )
    cut = by_own[0] * by_own[1] < 0.0
    told = np.minimum(np.min(np.abs([*by_own, *by_other]), axis=0), 1.0)
    cosine = np.einsum("ij,ij->i", surface.normals[own], surface.normals[other])
    apart = np.abs(surface.over(own, surface.points[other])) + np.abs(surface.over(other, surface.points[own]))
    one = (np.abs(cosine) > SMOOTH) & (apart < 2.0 * ON * (surface.spacing[own] + surface.spacing[other]))
    support = np.minimum(there.support[first], there.support[second])
    whole = 1.0 if around else np.maximum(support, _FAINT)
    told *= np.where(cut, np.where(one, _FAINT - support, 0.0), whole)
    unknown = (cut != (by_other[0] * by_other[1] < 0.0)) | (
        np.maximum(there.beyond[first], there.beyond[second]) > _PAST
    )
    return np.where(unknown, 0.0, told)


def agreeing(count: int, first: Ints, second: Ints, told: Floats) -> tuple[Floats, Ints]:
    """Choose signs that edges tell to agree or, where negative, to differ: in each round what tells most for a group.

    Parameters
    ----------
    count : int
        Of places.
    first, second : ndarray, (e,) int
        The ends of edges.
    told : ndarray, (e,)

    Returns
    -------
    sign : ndarray, (count,)
        1.0 or -1.0.
    group : ndarray, (count,) int
        The same number for places that edges join.
    """
    sign, group, every = np.ones(count), np.arange(count), np.arange(count)
    while True:
        low, high = np.sort([group[first], group[second]], axis=0)
        between = low != high
        first, second, told, low, high = (values[between] for values in (first, second, told, low, high))
        total = sparse.coo_array((told * sign[first] * sign[second], (low, high)), shape=(count, count)).tocsr().tocoo()
        link = np.flatnonzero(total.data)
        if not len(link):
            return sign, group
        link = link[np.argsort(np.abs(total.data[link]), kind="stable")]
        ends = np.stack(total.coords)[:, link]
        best = np.full(count, -1)
        best[ends.T.ravel()] = np.repeat(np.arange(len(link)), 2)  # the last one, which tells most, stays
        joined = np.flatnonzero(best >= 0)
        parent, turn = every.copy(), np.ones(count)
        parent[joined] = ends[:, best[joined]].sum(axis=0) - joined
        turn[joined] = np.sign(total.data[link[best[joined]]])
        root = (parent[parent] == every) & (every <= parent)  # of two that chose each other
        parent[root], turn[root] = every[root], 1.0
        while np.any(parent[parent] != parent):
            turn, parent = turn * turn[parent], parent[parent]
        sign, group = sign * turn[group], parent[group]
