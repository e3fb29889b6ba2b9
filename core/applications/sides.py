"""Which side of a surface the corners of a grid are on, whatever the signs of its normals."""

import numpy as np
from scipy import sparse

from ..geometry.nearest import ON, SMOOTH

_FAINT = 0.1  # what an edge of the grid off all points tells for one side, beside one that points are next to


def find_sides(surface, there, places, first, second):
    """Tell on which of two sides places near a surface are.

    Each edge between two places tells whether it cuts the quadric of the point that is nearest: its ends are on two
    sides then, or on one. What tells most is believed first: places are joined to groups, groups to larger ones by all
    edges between them, until none is left. So ways through the empty space around thin parts count as much as those
    along the surface.

    Parameters
    ----------
    surface : ImplicitSurface
        The signs of its normals need not agree.
    there : Heights
        Of the places.
    places : ndarray, (k, 3)
    first, second : ndarray, (e,) int
        Places at the ends of edges.

    Returns
    -------
    ndarray, (k,)
        1.0 on the side that most normals point to in each group of places that edges join, -1.0 on the other.
    """
    told = _told(surface, there, places, first, second)
    side, group = _agreeing(len(places), first, second, told)
    votes = np.bincount(group, side * there.height * _support(there))
    return np.where(votes[group] < 0.0, -side, side)


def _support(there):
    """Return how near the foot of places is to a point, from 1 to 0, (k,)."""
    return np.exp(-np.maximum(there.distance**2 - (there.height / there.spacing)**2, 0.0))


def _told(surface, there, places, first, second):
    """Return by how much each edge tells that its ends are on one side, negative on two, (e,)."""
    p, q = there.nearest[first], there.nearest[second]
    heights = [surface.over(rows, places[ends]) for rows in (p, q) for ends in (first, second)]
    cut_p, cut_q = heights[0] * heights[1] < 0.0, heights[2] * heights[3] < 0.0
    clear = np.minimum(np.min(np.abs(heights), axis=0), 1.0)
    support = np.minimum(*(_support(there)[ends] for ends in (first, second)))
    told = np.where(cut_p == cut_q, clear, 0.0)
    cosine = np.einsum("ij,ij->i", surface.normals[p], surface.normals[q])
    apart = np.abs(surface.over(p, surface.points[q])) + np.abs(surface.over(q, surface.points[p]))
    one = (np.abs(cosine) > SMOOTH) & (apart < 2.0 * ON * (surface.spacing[p]+surface.spacing[q]))
    told[cut_p & cut_q] *= np.where(one, _FAINT - support, 0.0)[cut_p & cut_q]
    return told


def _agreeing(count, first, second, told):
    """Return a sign for each of some places, and the group that edges join it to, by joining what tells most."""
    group, sign = np.arange(count), np.ones(count)
    while True:
        kept = (group[first] != group[second])
        first, second, told = first[kept], second[kept], told[kept]
        low, high = np.minimum(group[first], group[second]), np.maximum(group[first], group[second])
        total = sparse.coo_array((told * sign[first] * sign[second], (low, high)), shape=(count, count)).tocsr()
        total.sum_duplicates()
        total = total.tocoo()
        low, high = total.coords
        held = total.data != 0.0
        low, high, weight = low[held], high[held], total.data[held]
        if not len(low):
            return sign, group
        order = np.argsort(np.abs(weight), kind="stable")
        best = np.full(count, -1)
        ends = np.stack([low[order], high[order]], axis=1).ravel()
        best[ends] = np.repeat(order, 2)  # the last assignment, of the largest, stays
        head = np.arange(count)
        turn = np.ones(count)
        picks = np.flatnonzero(best >= 0)
        pick = best[picks]
        head[picks] = low[pick] + high[pick] - picks
        turn[picks] = np.sign(weight[pick])
        root = (head[head] == np.arange(count)) & (np.arange(count) < head)
        head[root], turn[root] = np.flatnonzero(root), 1.0
        while (head[head] != head).any():
            turn, head = turn * turn[head], head[head]
        sign, group = sign * turn[group], head[group]
