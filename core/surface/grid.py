"""The corners and edges of a grid near a surface, whose voxels are as large as the points there are far apart.

Voxels are those of an octree, of which two that touch differ by one level at most. It is not kept as a tree, but as a
function of the place: `Levels`. All lengths are those of an `ImplicitSurface`, in which the finest voxel is ``unit``;
corners are whole numbers of it. The voxels of level k are ``2**k`` wide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..algebra import blocks, on_all_cores
from ..errors import PointCloudError
from ..operator import ImplicitSurface
from ..types import Array, Bools, Floats, Ints

BAND = 1.8  # voxels on both sides of the surface: an edge of the grid that it cuts ends within one
_REACH = 3.0  # spacings along the surface around a point: wider gaps are holes
_EVEN = 2.0  # times the corners that voxels as wide as the spacing there need: with fewer, all have one width
_LOST = 0.25, 0.01  # of that width that points are apart, and their share, from which on they need smaller ones
_WIDER = 2.0  # times its spacing that a gap is a point's own: wider ones are those of the sparser points beyond
_BLOCK = 2  # voxels along a block, all of one level or finer
_MARGIN = 2  # voxels around a point that are no larger than its own
_PLACES = 1 << 15  # whose levels are looked up at one time
_CANDIDATES = 1 << 20  # corners of the grid examined at one time
_FINEST = 56.0  # bits that the numbers of corners take at most where voxels are finer than usual

_OCTANTS = np.stack(np.meshgrid([-1, 0], [-1, 0], [-1, 0], indexing="ij"), axis=-1).reshape(-1, 3)
_CORNERS = _OCTANTS + 1
_AROUND = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], [-1, 0, 1], indexing="ij"), axis=-1).reshape(-1, 3)


def octaves_of(surface: ImplicitSurface, areas: Floats, usual: float) -> Ints:
    """Return by how many octaves the voxels at points are wider than usual, (m,) int: whose width is one.

    All have the usual width where this takes little more than others would, and no dense part is lost. `usual` is the
    spacing for which voxels have that width; areas are those of the points, (m,).
    """
    spacing = surface.local_spacing / usual
    octaves: Ints = np.trunc(np.log2(np.maximum(spacing, 1e-300))).astype(int)
    (width, share), fitted = _LOST, count_corners(surface, areas, 2.0**octaves)
    if np.mean(spacing < width) < share and count_corners(surface, areas, np.ones(len(areas))) < _EVEN * fitted:
        return np.zeros(len(spacing), dtype=int)
    return octaves


class Levels:
    """The level of the voxel at every place, in units of the typical spacing over the detail.

    Points, (m, 3), have octaves from `octaves_of`, and levels of their `own`, (m,); the voxel around a point may be
    finer, next to finer ones. The unit is the width of the finest voxel, and the top the coarsest level; 0 where all
    voxels are alike.
    """

    def __init__(self, places: Floats, octaves: Ints) -> None:
        extent = np.log2(np.ptp(places, axis=0) + 2.0 ** max(int(octaves.max()), 0) * _REACH).sum()
        octaves = np.maximum(octaves, min(int(np.ceil((extent - _FINEST) / 3.0)), 0))
        self.own = octaves - octaves.min()
        self.unit = float(2.0 ** octaves.min())
        self.top = int(self.own.max())
        low, counts = _extent(places / self.unit, 2.0 ** (self.top + 1) * _BLOCK * 4.0)
        if np.prod(counts) > 2.0**62:
            raise PointCloudError(
                "The extent of the points is too large relative to their spacing for a grid. Delete distant points, or"
                " lower the detail."
            )
        self._low = low.astype(np.int64)
        self.steps = np.array([counts[1] * counts[2], counts[2], 1.0]).astype(np.int64)
        self._split: list[Ints] = []  # of each level but the top: blocks of the next that hold voxels of it, or finer
        block = np.empty((0, 3), dtype=np.int64)
        for level in range(self.top):
            width = _BLOCK << level + 1
            inside = (places[self.own == level] / self.unit)[:, None] + _MARGIN * 2.0**level * (2 * _CORNERS - 1)
            beside = (block[:, None] + _AROUND).reshape(-1, 3) // 2
            block = np.concatenate([np.floor(inside.reshape(-1, 3) / width).astype(np.int64), beside])
            keys, first = np.unique(self.keys(block * width), return_index=True)
            block = block[first]
            self._split.append(keys)

    def keys(self, corners: Ints) -> Ints:
        """Return the numbers of corners, (..., 3) int."""
        first, second, third = np.moveaxis(corners - self._low, -1, 0)  # products of matrices of integers are slow
        return (first * self.steps[0] + second * self.steps[1]) + third

    def corners(self, keys: Ints) -> Ints:
        """Return the corners of numbers, (k, 3) int."""
        first, rest = np.divmod(keys, self.steps[0])
        second, third = np.divmod(rest, self.steps[1])
        return np.column_stack([first, second, third]) + self._low

    def at(self, voxels: Ints) -> Ints:
        """Return the level of the voxels that hold those of the finest level, by their lowest corners, (k, 3) int."""
        level = np.full(len(voxels), self.top)
        for below in reversed(range(self.top)):
            rows = np.flatnonzero(level == below + 1)
            width = _BLOCK << below + 1
            level[rows[contained(self.keys(voxels[rows] // width * width), self._split[below])]] = below
        return level

    def at_points(self, places: Floats) -> Ints:
        """Return the level of the voxels that hold some places, (m, 3)."""
        return self.at(np.floor(places / self.unit).astype(np.int64))

    def around(self, corners: Ints) -> Ints:
        """Return the levels of the eight voxels around corners, (k, 8); the first axis changes last."""
        there = np.zeros((len(corners), 8), dtype=np.int8)
        for block in blocks(len(corners), _PLACES) if self.top else ():
            there[block] = self.at((corners[block, None] + _OCTANTS).reshape(-1, 3)).reshape(-1, 8)
        return there


@dataclass(frozen=True)
class Grid:
    """Corners of voxels near a surface, and the edges between them, none of which holds another corner."""

    levels: Levels
    corners: Ints  # (c, 3), in units of the finest voxel
    places: Floats  # (c, 3), the same in the units of the surface
    # (e,), the corners that edges begin and end at
    first: Ints
    second: Ints
    axis: Ints  # (e,)
    length: Array  # (e,), in the units of the surface

    def around(self, edges: Ints) -> tuple[Ints, Ints]:
        """Return the lowest corners, (k, 4, 3) int, and levels, (k, 4) int, of the voxels around edges, in a circle."""
        corners, axis = self.corners[self.first[edges]], self.axis[edges]
        unit = np.eye(3, dtype=np.int64)
        second, third = unit[(axis + 1) % 3], unit[(axis + 2) % 3]
        voxels = corners[:, None] - np.stack([np.zeros_like(second), second, second + third, third], axis=1)
        if not self.levels.top:
            return voxels, np.zeros(voxels.shape[:2], dtype=int)
        level = self.levels.at(voxels.reshape(-1, 3)).reshape(-1, 4)
        width = (1 << level)[:, :, None]
        return voxels // width * width, level


def grid_around(surface: ImplicitSurface, levels: Levels, report: Callable[[], None]) -> Grid:
    """Return the part of a grid near the surface: within gaps of the points, and above them."""
    found = _refined(surface, levels, _band(surface, levels, report), report)
    keys = np.unique(np.concatenate(found))
    corners = levels.corners(keys)
    there = levels.around(corners)
    edges: list[tuple[Array, Array, Array, Array]] = []
    for axis, step in enumerate(levels.steps):
        beside = there[:, _OCTANTS[:, axis] == 0]
        least = beside.min(axis=1)
        ahead = keys + (step << least.astype(np.int64))
        place = np.minimum(np.searchsorted(keys, ahead), len(keys) - 1)
        begin = np.flatnonzero(keys[place] == ahead)
        edges.append((begin, place[begin], np.full(len(begin), axis), levels.unit * 2.0 ** least[begin]))
    first, second, axes, length = (np.concatenate(part) for part in zip(*edges, strict=True))
    places = levels.unit * corners.astype(np.float64)
    return Grid(levels, corners, places, first, second, axes, length)


def contained(keys: Ints, among: Ints) -> Bools:
    """Tell which keys are among sorted ones, (k,) bool."""
    if not len(among):
        return np.zeros(len(keys), dtype=bool)
    return among[np.minimum(np.searchsorted(among, keys), len(among) - 1)] == keys


def _extent(places: Floats, margin: float) -> tuple[Floats, Floats]:
    """Return the lowest whole numbers and their counts for places with a margin around them, (3,) each."""
    low: Floats = np.floor(places.min(axis=0)) - margin
    return low, np.ceil(np.ptp(places, axis=0)) + 2.0 * margin + 2.0


def count_corners(surface: ImplicitSurface, areas: Floats, width: Array) -> float:
    """Estimate the corners of a grid from the areas at points, (m,), and the widths of voxels there, (m,).

    The band is as thick as at the rim of the reach of a point, as far as the surface bends within.
    """
    reach = _reach(surface, slice(None), width)
    bend = width * surface.half_curvature(np.arange(len(areas))) * (reach**2 + BAND**2)
    return float(np.sum(areas / width**2 * 2.0 * (BAND + np.minimum(bend, reach))))


def _reach(surface: ImplicitSurface, rows: Ints | slice, width: Array | float) -> Array:
    """Return how far from some points the grid reaches, in voxels of some width, (k,)."""
    own, gap = surface.local_spacing[rows], surface.spacing[rows]
    return _REACH * np.minimum(gap, _WIDER * own) / width + 1.0


def _band(surface: ImplicitSurface, levels: Levels, report: Callable[[], None]) -> list[Ints]:
    """Return the corners of each level near the points whose own it is, as sorted numbers."""
    bands = []
    for level in range(levels.top + 1):
        width = levels.unit * 2.0**level
        own = np.flatnonzero(levels.own == level)
        points = surface.points[own] / width
        reach = _reach(surface, own, width)
        order = np.argsort(levels.keys(_whole(np.floor(points / 8.0) * 8.0)), kind="stable")  # neighbors work together
        half = np.ceil(np.hypot(reach, BAND)).astype(int)
        tasks = []
        for size in np.unique(half):
            rows = order[half[order] == size]
            across = np.arange(-size, size + 1)
            steps = np.stack(np.meshgrid(across, across, across, indexing="ij"), axis=-1).reshape(-1, 3)
            tasks += [(rows[block], steps) for block in blocks(len(rows), max(_CANDIDATES // len(steps), 1))]

        def near(
            task: tuple[Ints, Ints], own: Ints = own, points: Floats = points, reach: Floats = reach, level: int = level
        ) -> Ints:
            rows, steps = task
            corner = np.round(points[rows])
            shift = points[rows] - corner
            normals = surface.normals[own[rows]]
            squared = -2.0 * shift @ steps.T + (steps * steps).sum(axis=1) + (shift * shift).sum(axis=1)[:, None]
            height = normals @ steps.T - np.einsum("ij,ij->i", normals, shift)[:, None]
            bend = (levels.unit * 2.0**level * surface.half_curvature(own[rows]))[:, None] * squared
            inside = (np.abs(height) < BAND + bend) & (squared < (reach[rows] ** 2 + BAND**2)[:, None])
            row, step = np.nonzero(inside)
            return np.unique(levels.keys(_whole(corner) << level)[row] + ((steps << level) @ levels.steps)[step])

        found = on_all_cores(near, tasks, report)
        bands.append(np.unique(np.concatenate([*found, np.empty(0, dtype=np.int64)])))
    return bands


def _whole(corners: Floats) -> Ints:
    return corners.astype(np.int64)


def _refined(surface: ImplicitSurface, levels: Levels, bands: list[Ints], report: Callable[[], None]) -> list[Ints]:
    """Give each corner the level of the voxels around it: coarser where these are, and all finer ones in the band."""
    if not levels.top:
        return bands
    bands = _coarsened(levels, bands)
    for level in reversed(range(1, levels.top + 1)):
        corners = levels.corners(bands[level])
        corners = corners[levels.around(corners).min(axis=1) < level]
        report()
        if not len(corners):
            continue
        near = np.unique(levels.keys(corners[:, None] + (_AROUND << level - 1)))
        near = near[~contained(near, bands[level - 1])]
        corners = levels.corners(near)
        near = near[levels.around(corners).min(axis=1) < level]
        places = levels.unit * levels.corners(near).astype(np.float64)
        near = near[_in_band(surface, places, levels.unit * 2.0 ** (level - 1))]
        bands[level - 1] = np.union1d(bands[level - 1], near)
    return _coarsened(levels, bands)


def _coarsened(levels: Levels, bands: list[Ints]) -> list[Ints]:
    """Add the corners of all coarser voxels next to corners, and leave out what is not a corner of any."""
    bands = list(bands)
    for level in range(levels.top):
        corners = levels.corners(bands[level])
        there = levels.around(corners)
        row, octant = np.nonzero(there > level)
        width = 1 << level + 1
        low = (corners[row] + _OCTANTS[octant]) // width * width
        low = levels.corners(np.unique(levels.keys(low)))
        outer = np.unique(levels.keys(low[:, None] + width * _CORNERS))
        bands[level] = bands[level][there.min(axis=1) <= level]
        bands[level + 1] = np.union1d(bands[level + 1], outer)
    return bands


def _in_band(surface: ImplicitSurface, places: Floats, width: float) -> Bools:
    """Tell which places are in the band of voxels of some width by their nearest points, (k,) bool."""
    inside = np.zeros(len(places), dtype=bool)
    for block in blocks(len(places), _CANDIDATES):
        rows = surface.nearest(places[block])
        offset = places[block] - surface.points[rows]
        squared = np.einsum("ij,ij->i", offset, offset)
        height = np.abs(np.einsum("ij,ij->i", offset, surface.normals[rows]))
        reach = _REACH * surface.spacing[rows] + width
        bend = surface.half_curvature(rows) * squared
        inside[block] = (height < BAND * width + bend) & (squared < reach**2 + (BAND * width) ** 2)
    return inside
