"""Stray points: a score of each point for how far it is off the surface, and the parts that gaps separate."""

import numpy as np

from ..types import Bools, Floats, Ints, Report
from .components import even_reach, label_connected
from .nearest import GAP, ON, Nearest
from .noise import FILLING
from .outliers import SCATTERS, Alone, heights_over_witnesses, third_least, witnesses_of
from .quadrics import fit_quadrics
from .rows import look_across_rows

PARTS = 30  # points of a part that others are joined to, and that is no clump of stray points
_ON = 0.4  # spacings from the surface within which a point lies on it
_AROUND = slice(1, 25)  # neighbours whose spacing a point's own is compared with, by their lower quartile
_LONELY = 1.7  # times that a point's third neighbour is away: no witness until it is known to be on the surface
_SPARSE = 1.3  # times its spacing: witnesses must show a surface
_FILLING = 0.6  # scatter around a witness, in spacings, that no surface has
_ROUGHER = 2.0  # nor has it so much more than the upper quartile of the cloud
_ROUNDS = 6  # after which what is on the surface hardly changes
_NEAR, _GAP = 3, 2.5  # points within so many distances of their third neighbours, at both ends, are joined
_REACH, _WIDE = 7, 2.0  # and few points to many, within two distances of the seventh neighbour of those


def stray_scores(nearest: Nearest, report: Report = lambda: None) -> Floats:
    """Measure how far points are off the surface that their neighbours describe.

    As in `find_outliers` twelve neighbours are the witnesses of a point, and three must agree. Here points far from
    their neighbours, by the spacing of these, take part in no witness' quadric until they are known to be on the
    surface, so that many stray points do not vouch for each other.

    Parameters
    ----------
    nearest : Nearest
        Of m points.
    report : callable
        Called before each round; may raise `Cancelled`.

    Returns
    -------
    ndarray, (m,)
        The third least height over the quadrics of the witnesses, over what counts as on the surface: above 1 off it,
        infinite where no three witnesses show a surface.
    """
    spacing, surface = nearest.spacing, nearest.quadrics
    around = np.quantile(spacing[nearest.index[:, _AROUND]], 0.25, axis=1)
    third = nearest.distance[:, min(_NEAR, nearest.distance.shape[1] - 1)]
    sparse, sparsest = spacing > _SPARSE * around, spacing > GAP * np.median(spacing)
    off, before = third > _LONELY * around, np.zeros(len(spacing), dtype=bool)
    for _ in range(_ROUNDS):
        report()
        clean, rows = nearest.keep(~off[nearest.index]), np.flatnonzero((off != before)[nearest.index].any(axis=1))
        surface = surface.put(rows, fit_quadrics(clean.points, clean.index[rows], clean.weight[rows], rows))
        clean = clean.with_quadrics(surface)
        scores = _scores(clean, sparse, sparsest, off)
        before, off = off, scores > 1.0
        if (off == before).all():
            break
    return scores


def _scores(clean: Nearest, sparse: Bools, sparsest: Bools, off: Bools) -> Floats:
    """Return the scores, (m,), by quadrics without the points that are off the surface so far."""
    spacing, surface, result = clean.spacing, clean.quadrics, np.zeros(len(off))
    roughness = np.quantile((surface.misfit / spacing)[~off], 0.75) if not off.all() else 0.0
    rough = third_least(heights_over_witnesses(clean, surface, np.arange(len(off)))) > _ON * spacing
    suspects = np.flatnonzero(off | rough | (sparsest & (surface.misfit > ON * spacing)))
    witnesses, alone = witnesses_of(clean, suspects), Alone(clean, surface)
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
    """Return the neighbours of the points that are not off the surface, (m,) bool."""
    around: Bools = np.any(off[nearest.index], axis=1)
    return look_across_rows(nearest.renewed(nearest.points[~off], around, ~off))


def label_parts(nearest: Nearest) -> Ints:
    """Number the parts of a cloud without points off its surface, which gaps separate.

    Points are joined to neighbours nearer than 2.5 times the distances of the third neighbours of both, so that clumps
    of few points do not reach each other; then parts of few points to those of many, within the reach of these.

    Parameters
    ----------
    nearest : Nearest
        Of m points.

    Returns
    -------
    ndarray, (m,) int
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
