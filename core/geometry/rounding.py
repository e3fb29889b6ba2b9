"""Rounded depth: points in steps along one direction, as depth cameras measure them, smoothed along it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..algebra import blocks, on_all_cores
from ..linalg import solve
from ..types import Floats
from .nearest import COUNT, FEW, NEXT, Nearest, fading_weights, find_nearest, spacing_of
from .noise import LARGEST
from .quadrics import frames

_SAMPLE = 2000  # neighborhoods looked at
_CANDIDATES, _COMPARED = 200, 5000  # planes in them that may be a level, and those that these are compared with
_AGREEING = 1.0 - 0.5 * 1e-3**2  # cosine between planes of one direction: what single precision leaves of pixels
_SAME = 0.01  # spacings between points of one level, at most
_COMMON = 0.02  # share of such planes that are parallel
_STEP = 0.3, 3.5  # spacings from level to level: finer ones are no more than noise, coarser ones are several surfaces
_CLEAN = 0.9  # share of neighbors that are on levels
_MOST = 0.75  # share of neighborhoods in which they are, at least
_APART = 0.5  # of the spacing across the direction: nearer pixels are rare on a grid, and half of those by chance
_PIXELS = 0.85  # share of points without one as near
_OTHERS = 0.7  # share of the nearest neighbors on other levels than the point: where levels are in no order
_MIXED = 0.0015  # share of such points, at least
_ALIKE = 1.5  # ratio of the quartiles of steps, at most: strays are off by any height
_FLAT = 0.5  # spacings that a step is flattened to, about, in the search for neighbors
_CUT = 4.0  # of the scatter: points farther off are no noise
_ROUNDS = 4  # of fits without those
_STEEP = 1.7  # slope of the surface over the plane across the direction: where it is steeper, steps are along it
_RIDGE = 1e-10  # keeps the equations solvable where the neighbors lie on a conic
_PAIRS = np.triu_indices(7)  # of the coefficients and the height, whose products the equations sum up
_BLOCK = 1 << 9  # points fitted at one time


class Smoothed(NamedTuple):
    """Points smoothed along the direction in which they were rounded."""

    nearest: Nearest  # of the points where they were moved to
    noise: Floats  # (m,), scatter that was smoothed, as a share of the spacing; zero where a point was left as it was
    step: float  # usual distance from level to level, as a share of the spacing; zero where no point was moved


def smooth_rounded(
    nearest: Nearest, settle: Callable[[Callable[[], Floats]], Floats] = lambda find: find()
) -> Smoothed:
    """Smooth points that are rounded in steps about as large as their spacing; others stay as they are.

    `settle` takes `find_rounding` without arguments, and returns what it finds, or what is agreed on.
    """
    rounding = settle(lambda: find_rounding(nearest.tree))
    return smooth_along(nearest, rounding) if rounding.any() else Smoothed(nearest, np.zeros(len(nearest.points)), 0.0)


def find_rounding(tree: cKDTree) -> Floats:
    """Find along which direction points are rounded in steps about as large as the spacing, with noise, (3,).

    Neighbors then lie on a few parallel planes, exactly, the same ones all over the cloud, and in no order: pixels
    beside each other are on different ones. As each pixel is seen once, no two points lie on top of each other along
    the direction, unlike those of several sheets. Some of the distinct points of a tree are looked at. The vector is as
    long as usual steps, as a share of the spacing; zero where points are not rounded so.
    """
    none, points = np.zeros(3), tree.data
    if len(points) <= FEW:
        return none
    rows = np.arange(0, len(points), 1 + len(points) // _SAMPLE)
    distance, index = tree.query(points[rows], k=min(COUNT, len(points)))
    offset = (points[index] - points[rows, None]) / spacing_of(distance)[:, None, None]
    axis = _common_normal(offset[:, 1 : NEXT + 1])
    if axis is None:
        return none
    height = offset @ axis
    some = np.ptp(height, axis=1) > _STEP[0]  # neighborhoods that are not level
    step = _steps(height)
    stepped = np.isfinite(step)
    across = np.sqrt(np.maximum(np.sum(offset**2, axis=2) - height**2, 0.0))
    across.sort(axis=1)
    single = across[:, 1] > _APART * np.sqrt(np.pi / FEW) * across[:, FEW]
    if not some.any() or stepped[some].mean() < _MOST or single[some].mean() < _PIXELS:
        return none
    low, high = np.quantile((step * spacing_of(distance))[stepped], [0.25, 0.75])
    mixed = (np.abs(height[:, 1 : NEXT + 1]) > _SAME).mean(axis=1) > _OTHERS
    return axis * np.median(step[stepped]) if high <= _ALIKE * low and mixed.mean() > _MIXED else none


def _common_normal(offset: Floats) -> Floats | None:
    """Return the direction of the planes through points and two of their neighbors that is the same most often."""
    first, second = np.triu_indices(offset.shape[1], 1)
    normal = np.cross(offset[:, first], offset[:, second]).reshape(-1, 3)
    length = np.linalg.norm(normal, axis=1)
    normal = normal[length > 0.25] / length[length > 0.25, None]
    if len(normal) < _CANDIDATES:
        return None
    some, others = normal[:: len(normal) // _CANDIDATES], normal[:: 1 + len(normal) // _COMPARED]
    share = np.mean(np.abs(some @ others.T) > _AGREEING, axis=1)
    best = some[share.argmax()]
    if share.max() < _COMMON:
        return None
    cosine = normal @ best
    agreeing = np.abs(cosine) > _AGREEING
    mean = np.sign(cosine[agreeing]) @ normal[agreeing]
    return mean / np.linalg.norm(mean)


def _steps(height: Floats) -> Floats:
    """Return the least distance between levels of neighbors, by their heights, (k, neighbors), NaN where none are."""
    gap = np.diff(np.sort(height, axis=1), axis=1)
    apart = gap > _SAME
    step = np.where(apart, gap, np.inf).min(axis=1)
    between = (apart & (gap < _STEP[0])).mean(axis=1)
    return np.where((between < 1.0 - _CLEAN) & (_STEP[0] < step) & (step < _STEP[1]), step, np.nan)


def smooth_along(nearest: Nearest, rounding: Floats) -> Smoothed:
    """Move points along the direction in which they are rounded onto quadrics through their neighbors.

    The direction, (3,), is from `find_rounding`. Neighbors are the nearest ones across the direction, as levels tell
    nothing of what is next to what. Points that are farther off than steps and noise explain, and those where the
    surface is steep, stay as they are.
    """
    points, spacing, usual = nearest.points, nearest.spacing, float(np.linalg.norm(rounding))
    axis = rounding / usual
    height = np.einsum("ikc,c->ik", points[nearest.index] - points[:, None], axis) / spacing[:, None]
    step = _steps(height)
    step = np.where(np.isnan(step), usual, step) * spacing
    flat = 2.0 ** min(np.round(np.log2(_FLAT / usual)), 0.0)  # the same where tiles agree on nearly the same steps
    flattened = points - (1.0 - flat) * (points @ axis)[:, None] * axis
    tree, width = cKDTree(flattened), min(LARGEST, len(points))
    moved, noise = points.copy(), np.zeros(len(points))
    turn = frames(axis[None])[0]

    def smooth(part: slice) -> None:
        distance, index = tree.query(flattened[part], k=width)
        height, u, v = np.moveaxis((points[index] - points[part, None]) @ turn, 2, 0) / distance[:, -1:]
        weight = fading = fading_weights(distance)
        cut = _CUT * 0.5 * step[part] / distance[:, -1]
        basis = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v, height])
        products = basis[_PAIRS[0]] * basis[_PAIRS[1]]
        equations = np.empty((len(u), 7, 7))
        for _ in range(_ROUNDS):
            sums = np.einsum("ik,nik->in", weight, products)
            equations[:, _PAIRS[0], _PAIRS[1]] = equations[:, _PAIRS[1], _PAIRS[0]] = sums
            equations[:, range(6), range(6)] += _RIDGE
            fit = solve(equations[:, :6, :6], equations[:, :6, 6:])
            off = height - np.einsum("nik,in->ik", basis[:6], fit[:, :, 0])
            wide = np.hypot(cut, _CUT * np.median(np.abs(off), axis=1))
            weight = fading * np.maximum(1.0 - (off / wide[:, None]) ** 2, 1e-6) ** 2
        kept = (np.abs(off[:, 0]) < wide) & (np.hypot(fit[:, 1, 0], fit[:, 2, 0]) < _STEEP)
        scatter = np.sqrt(np.einsum("ik,ik->i", weight, off**2) / weight.sum(axis=1)) * distance[:, -1]
        moved[part] -= np.where(kept, off[:, 0] * distance[:, -1], 0.0)[:, None] * axis
        noise[part] = np.where(kept, scatter / spacing[part], 0.0)

    on_all_cores(smooth, blocks(len(points), _BLOCK))
    return Smoothed(find_nearest(moved), noise, usual)
