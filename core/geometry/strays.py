"""Stray points: a score of each point for how far it is off the surface, and the parts that gaps separate."""

import numpy as np
from scipy.spatial import cKDTree

from ..types import Bools, Floats, Ints, Report
from .components import even_reach, label_connected
from .nearest import AGREEING, FEW, GAP, ON, Nearest
from .noise import FILLING
from .outliers import SCATTERS, Alone, heights_over_witnesses, third_heights, third_least, witnesses_of
from .quadrics import fit_quadrics
from .rows import look_across_rows

PARTS = 30  # points of a part that others are joined to, and that is no clump of stray points
_ON = 0.4  # spacings from the surface within which a point lies on it
_AROUND = slice(1, 25)  # neighbors, the lower quartile of whose spacings is the spacing around a point
_LONELY = 1.7  # times the spacing around to a point's third neighbor: no witness until known to be on the surface
_ALONE = 2.0  # times the spacing around that a point's third neighbor is away: off the surface by one, it is stray
_POWER = 4.0  # of that distance: a little farther away tells more than a little higher
_HIGHEST = 4.0  # height that counts, at most: where points scatter more, as in trees, it says nothing more
_SPARSE = 1.3  # spacing over that around, from which witnesses must show a surface
_FILLING = 0.6  # scatter around a witness, in spacings, that no surface has
_ROUGHER = 2.0  # scatter over the upper quartile of the cloud's, that no surface has, either
_ROUNDS = 6  # after which what is on the surface hardly changes
_NEAR, _GAP = 3, 2.5  # points within so many distances of their third neighbors, at both ends, are joined
_REACH, _WIDE = 7, 2.0  # and few points to many, within two distances of the seventh neighbor of those


def stray_scores(nearest: Nearest, report: Report = lambda: None) -> Floats:
    """Measure how far points are off the surface that their neighbors describe, (m,): above 1 for stray points.

    As in `find_outliers` twelve neighbors are the witnesses of a point, and three must agree. Here points far from
    their neighbors, by the spacing of these, take part in no witness' quadric until they are known to be on the
    surface, so that many stray points do not vouch for each other. What scatters about the surface as densely as the
    points around is no stray, and what lies alone needs less height to be one.

    The score is the height, that is the third least over the quadrics of the witnesses, over what counts as on the
    surface, 4 at most, or its cube where above 1, times the fourth power of the distance of the third neighbor on the
    surface, over two spacings of the points there. It is infinite where no three witnesses show a surface. `report` is
    called before each round; it may raise `Cancelled`.
    """
    spacing, surface = nearest.spacing, nearest.quadrics
    around = np.quantile(spacing[nearest.index[:, _AROUND]], 0.25, axis=1)
    third = nearest.distance[:, min(_NEAR, nearest.distance.shape[1] - 1)]
    sparse, sparsest = spacing > _SPARSE * around, spacing > GAP * np.median(spacing)
    off, before = third > _LONELY * around, np.zeros(len(spacing), dtype=bool)
    over_whole = third_heights(nearest, surface, np.arange(len(off)))
    lonely, over_all, alone = off, over_whole.copy(), Alone(nearest, surface)
    for _ in range(_ROUNDS):
        report()
        changed = (off != before)[nearest.index].any(axis=1)
        gone = off[nearest.index]
        clean, fewer = nearest.keep(~gone), gone.any(axis=1)
        # Points all of whose neighbors count get their first quadrics and heights back.
        rows, whole = np.flatnonzero(changed & fewer), np.flatnonzero(changed & ~fewer)
        surface = surface.put(whole, nearest.quadrics.take(whole))
        surface.assign(rows, fit_quadrics(clean.points, clean.index[rows], clean.weight[rows], rows))
        clean = clean.with_quadrics(surface)
        alone.forget(np.flatnonzero(changed))
        over = changed[nearest.index].any(axis=1)
        again = over & fewer[nearest.index].any(axis=1)
        over_all[over] = over_whole[over]
        over_all[again] = third_heights(clean, surface, np.flatnonzero(again))
        height = _heights(clean, alone, over_all > _ON * spacing, sparse, sparsest, off, lonely)
        before, off = off, height > 1.0
        if (off == before).all():
            break
    # Off the surface the height decides, up to where points scatter; on it, the distance from others.
    share = np.minimum(height, _HIGHEST)
    share = np.where(np.isinf(height), np.inf, np.maximum(share, share**3))
    for _ in range(_ROUNDS):
        report()
        scores: Floats = share * (_loneliness(nearest, off) / _ALONE) ** _POWER
        before, off = off, scores > 1.0
        if (off == before).all():
            break
    return scores


def _loneliness(nearest: Nearest, off: Bools) -> Floats:
    """Return how far the third neighbor is, over the spacing there, (m,), as if points off the surface were not there.

    The spacing is the median of those of the three neighbors. The last of the forty stands for those beyond.
    """
    gone = off[nearest.index[:, 1:]]
    rows, last, fewer = np.arange(len(off)), gone.shape[1], np.flatnonzero(gone.any(axis=1))
    known = np.cumsum(~gone[fewer], axis=1, dtype=np.int8)

    def place(count: int) -> Ints:
        """Return where the neighbor of that number stands, or the last one."""
        found = np.full(len(off), min(count, last))
        found[fewer] = np.minimum(1 + np.count_nonzero(known < count, axis=1), last)
        return found

    few = min(FEW, last)
    spacing = nearest.distance[rows, place(few)] * np.sqrt(np.pi / few)
    around = np.median([spacing[nearest.index[rows, place(1 + count)]] for count in range(AGREEING)], axis=0)
    result: Floats = nearest.distance[rows, place(AGREEING)] / around
    return result


def _heights(
    clean: Nearest, alone: Alone, rough: Bools, sparse: Bools, sparsest: Bools, off: Bools, lonely: Bools
) -> Floats:
    """Return the heights, (m,), over what counts as on the surface, by quadrics without the points off it so far."""
    spacing, surface, result = clean.spacing, clean.quadrics, np.zeros(len(off))
    roughness = np.quantile((surface.misfit / spacing)[~off], 0.75) if not off.all() else 0.0
    suspects = np.flatnonzero(off | lonely | rough | (sparsest & (surface.misfit > ON * spacing)))
    witnesses = witnesses_of(clean, suspects)
    alone.fit(clean, surface, np.unique(witnesses))
    scatter = alone.scatter[witnesses]
    height = heights_over_witnesses(clean, alone.surface, suspects)
    height /= _ON * spacing[suspects, None] + SCATTERS * scatter
    limit = np.where(sparse, max(_FILLING, _ROUGHER * roughness), np.inf)
    limit[sparsest] = FILLING
    filling = scatter > limit[suspects, None] * spacing[witnesses]
    height[filling] = np.inf
    for _ in range(_ROUNDS):  # those found on the surface become witnesses, those off it are none
        result[suspects] = third_least(np.where(off[witnesses], np.inf, height))
        before, off = off, result > 1.0
        if (off == before).all():
            break
    return result


def without(nearest: Nearest, off: Bools) -> Nearest:
    """Return the neighbors of the points that are not off the surface, (m,) bool."""
    around: Bools = np.any(off[nearest.index], axis=1)
    return look_across_rows(nearest.renewed(cKDTree(nearest.points[~off]), around, ~off))


def label_parts(nearest: Nearest) -> Ints:
    """Number the parts of a cloud without points off its surface, which gaps separate, (m,) int.

    Points are joined to neighbors nearer than 2.5 times the distances of the third neighbors of both, so that clumps of
    few points do not reach each other; then parts of few points to those of many, within the reach of these.
    """
    index, distance = nearest.index[:, 1:], nearest.distance[:, 1:]
    last = distance.shape[1] - 1
    reach = _GAP * distance[:, min(_NEAR - 1, last)]
    close = np.maximum(np.minimum(reach[:, None], reach[index]), np.median(reach))
    label = label_connected(index, distance <= close)
    wide = np.where(nearest.in_row, even_reach(nearest), _WIDE * distance[:, min(_REACH - 1, last)])
    while True:
        large = (np.bincount(label) >= PARTS)[label]
        joined = ~large[:, None] & large[index] & (distance <= wide[index])
        rows = np.flatnonzero(joined.any(axis=1))
        if not len(rows):
            return label
        target = np.arange(label.max() + 1)
        target[label[rows]] = label[index[rows, joined[rows].argmax(axis=1)]]
        label = target[label]
