"""Fewer points of a cloud: blue noise to a spacing or a number, edges first."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..arguments import check_points, check_switches, real, whole
from ..cores import cores
from ..errors import InvalidPointsError, PointCloudError
from ..geometry import NEIGHBORS, apart, nearest_in_blocks
from ..linalg import eigvalsh
from ..progress import ends_at_one
from ..types import Floats, Ints, Progress, Report

_SPACING = 12  # of them that tell the spacing
_STEP = 2.0  # each pass doubles the distance
_DISCS = 0.7  # points a squared distance that stay on an area of one
_EDGE = 0.015  # surface variation of an edge of 20 degrees, about
_RAISED = 3.0  # times the median variation, which noise has everywhere
_FEW = 0.95  # of the number wanted, which are enough to be filled up
_SAME = 1.01  # ratio of distances that leave too many and too few points, and between which nothing is looked for
_CLOSER = 0.8  # times the distance, at which more points are filled in
_TRIALS = 12
_SEED = 0


@ends_at_one
def thin_out(
    points: ArrayLike,
    *,
    count: int | None = None,
    spacing: float | None = None,
    keep_edges: bool = True,
    progress: Progress | None = None,
) -> Ints:
    """Choose fewer points, evenly spread over the surface: blue noise, in which no two are close to each other.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    count : int, optional
        How many to choose. Either this or the spacing is given.
    spacing : float, optional
        Least distance between chosen points [L].
    keep_edges : bool
        Whether points at edges, where the surface variation is high, are chosen before others.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (k,) int
        Indices, ascending. No two chosen points are nearer than the spacing, and each other point is nearer than that
        to a chosen one. By a count there are exactly so many: most at one distance, the last ones somewhat nearer. Of
        points on a grid, which come many at once, these are chosen by chance. All different places where there are no
        more than the count. The order of the points makes no difference.

    Raises
    ------
    PointCloudError
        Points of a wrong shape or not finite; both count and spacing, or neither; a count below 1, or a spacing that is
        not above zero.

    See Also
    --------
    blue_noise_subset : Much fewer of very many points, by a grid, whatever the edges.

    References
    ----------
    Pauly, Gross, Kobbelt. Efficient simplification of point-sampled surfaces. 2002 (surface variation).

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> few = points[mf.clean.thin_out(points, spacing=0.3)]
    >>> apart = np.linalg.norm(few[:, None] - few, axis=2) + 9.0 * np.eye(len(few))
    >>> print(apart.min() >= 0.3, len(mf.clean.thin_out(points, count=100)) <= 100)
    True True
    """
    report = progress or (lambda stage, fraction: None)
    check_switches(keep_edges=keep_edges)
    points = check_points(points)
    if (count is None) == (spacing is None):
        raise PointCloudError("Thinning needs a count or a spacing. Give one of them.")
    if count is not None and not whole(count) >= 1:
        raise InvalidPointsError(f"A choice of {count!r} points was asked for. Ask for a whole number of at least 1.")
    if spacing is not None and not 0.0 < real(spacing) < np.inf:
        raise InvalidPointsError(f"The spacing is {spacing!r}. Use a length above zero.")
    report("Edges", 0.0)
    area, variation = _measure(points, lambda: report("Edges", 0.1))
    order = _order(points, variation if keep_edges else np.zeros(len(points)))

    def thinned(distance: float, before: Ints = np.arange(0)) -> Ints:
        return _discs(points, order, area, distance, before, lambda: report("Thinning", 0.5))

    return thinned(real(spacing)) if count is None else _of_count(thinned, points, order, area, int(count))


def _measure(points: Floats, report: Report) -> tuple[float, Floats]:
    """Return the area of the surface, by the spacings, and the surface variation at each point, (n,)."""
    area, variation = 0.0, np.empty(len(points))
    for start, distance, index in nearest_in_blocks(points, points, NEIGHBORS, report):
        last = min(_SPACING, index.shape[1] - 1)
        area += np.sum(np.pi / max(last, 1) * distance[:, last] ** 2)
        offset = points[index] - points[index].mean(axis=1, keepdims=True)
        spread = eigvalsh(np.swapaxes(offset, 1, 2) @ offset)
        variation[start : start + len(index)] = np.clip(spread[:, 0], 0.0, None) / np.maximum(
            spread.sum(axis=1), 1e-300
        )
    return float(area), variation


def _order(points: Floats, variation: Floats) -> Ints:
    """Return the ranks of points, (n,): edges first, the sharpest before others, then all in an order by chance."""
    chance = np.empty(len(points))
    chance[np.lexsort(points.T)] = np.random.default_rng(_SEED).random(len(points))
    edge = variation > max(_EDGE, _RAISED * float(np.median(variation)))
    rank = np.empty(len(points), dtype=np.int64)
    rank[np.lexsort((chance, np.where(edge, -variation, 0.0)))] = np.arange(len(points))
    return rank


def _of_count(thinned: Callable[..., Ints], points: Floats, order: Ints, area: float, count: int) -> Ints:
    """Choose so many points at the least distance, found by trial, that leaves nearly as many, and fill them up."""
    best: Ints = np.sort(np.unique(points, axis=0, return_index=True)[1])
    if len(best) <= count:
        return best
    distance, below, most, best = np.sqrt(_DISCS * area / count), 0.0, np.inf, best[:0]
    for _ in range(2 * _TRIALS):
        chosen = thinned(distance)
        found = len(chosen)
        if found <= count:
            most = distance
            best = chosen if found > len(best) else best
            if found >= _FEW * count:
                break
        else:
            below = distance
        if most < _SAME * below:  # of points on a grid many come at once
            break
        distance *= np.sqrt(found / (0.975 * count))
        if not below < distance < most:
            distance = 0.5 * (below + most) if np.isfinite(most) else 2.0 * below
    distance = below or _CLOSER * distance
    while len(best) < count:
        more = np.setdiff1d(thinned(distance, best), best, assume_unique=True)
        best = np.append(best, more[np.argsort(order[more])[: count - len(best)]])
        distance *= _CLOSER
    return np.sort(best)


def _discs(points: Floats, order: Ints, area: float, distance: float, before: Ints, report: Report) -> Ints:
    """Choose points of which no two are nearer than a distance, in their order, and none is farther from all.

    Those chosen before stay, whatever their distances.
    """
    chosen: Ints = before
    left: Ints = np.arange(len(points))
    if len(before):
        left = _away(points, left, chosen, distance)
    while len(left):
        chosen = np.append(chosen, _by_passes(points, left, order, area, distance, report))
        report()
        left = _away(points, left, chosen, distance)
    return np.sort(chosen)


def _away(points: Floats, rows: Ints, chosen: Ints, distance: float) -> Ints:
    """Return which of some points are not nearer than a distance to any chosen one."""
    return rows[cKDTree(points[chosen]).query(points[rows], workers=cores())[0] >= distance]


def _by_passes(points: Floats, chosen: Ints, order: Ints, area: float, distance: float, report: Report) -> Ints:
    """Choose some of the points so by passes of growing distances, so that each looks at few neighbors."""
    fewest = max(1.0, _DISCS * area / distance**2)
    passes = max(1, int(np.ceil(np.log(max(len(points) / fewest, 1.0)) / np.log(_STEP**2))))
    for step in range(passes):
        reach = distance / _STEP ** (passes - 1 - step)
        while not (alone := apart(points[chosen], reach, order[chosen], None, report)).all():
            chosen = chosen[alone]
    return chosen
