"""Voids between points: slits, cracks and narrow doors, longer than chance or uneven sampling leaves any."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..cores import cores
from ..linalg import eigvalsh
from ..types import Bools, Floats, Ints
from .boundary import HOLE, PROBE, SURE, VOID
from .cells import Cells
from .components import label_connected
from .nearest import ENOUGH, NEXT, ON, ROW, Nearest
from .quadrics import fit_quadrics, frames
from .sample import Sample

_TOLD = 30.0  # area, in squared gaps, of a void that is reported though no slit; of 300,000 random points 16 at most
_LONG = 5.0  # twice the standard deviation of a slit along its length, over its radius: 1.4 of the rim of a disc


@dataclass(frozen=True)
class Voids:
    """Voids between points."""

    rims: Ints  # (k,), points around those that are far longer than wide
    # (l,), points around others, which are too round or too narrow to be told from uneven sampling by them alone
    bridged: Ints
    label: Ints  # (l,), which of these it is
    radius: Floats  # (l,), of the empty disc that touches the point

    def notices(self, sample: Sample, at_boundary: Bools) -> list[str]:
        """Return a text on the voids that the surface goes on over, by the boundary that was found, (m,) bool."""
        share = np.bincount(self.label, at_boundary[self.bridged]) / np.bincount(self.label)
        kept = share[self.label] < 0.25  # at the ends of a slit more are
        if not kept.any():
            return []
        rows, radius = self.bridged[kept], self.radius[kept]
        scaled = sample.scaled
        row, widest = rows[radius.argmax()], 2.0 * scaled.scale * radius.max()
        decimals = max(2 - int(np.floor(np.log10(widest))), 0)
        place = sample.decisions.made.center + scaled.scale * scaled.points[row]
        return [
            f"Voids that the surface goes on over: {len(np.unique(self.label[kept]))}, with {len(rows)} points around"
            f" them. The widest, {widest:.3g} or {2.0 * radius.max() / np.median(sample.nearest.spacing):.1f} spacings,"
            f" is at ({', '.join(f'{value:.{decimals}f}' for value in place)}). If the surface ends there, name the"
            " boundary, or add points."
        ]


def no_voids() -> Voids:
    """Return none."""
    none = np.zeros(0, dtype=int)
    return Voids(none, none, none, np.zeros(0))


def find_voids(nearest: Nearest, normals: Floats, cells: Cells, gaps: Floats, scatter: Floats) -> Voids:
    """Find voids by the empty discs around the furthest corners of Voronoi cells.

    Random points leave single discs twice as wide as usual, uneven ones larger and more of them, but no row of them
    that is much longer than wide, with points as dense as elsewhere all along it. Cells are within the boundary that is
    known, and measured with these normals, (m, 3). `gaps`, (m,), are the usual radii of empty discs, from `mean_gaps`;
    `scatter`, (m,), is what quadrics through the own sheet miss the neighbors by, in spacings.
    """
    found = (cells.radius > VOID * gaps) & (cells.radius < PROBE * gaps)
    rows = np.flatnonzero(found & (scatter < ON))
    usual, corner = np.zeros(len(rows)), np.einsum("ick,ik->ic", frames(normals[rows])[:, :, 1:], cells.corner[rows])
    for way in (-1.0, 3.0):  # as far from either side of the disc as its center
        there = nearest.tree.query(nearest.points[rows] + way * corner, workers=cores())[1]
        usual = np.maximum(usual, cells.radius[nearest.index[there, : NEXT + 1]].mean(axis=1))
    weight = nearest.weight[rows]
    own = np.einsum("ik,ik->i", weight, cells.areas[nearest.index[rows]]) / weight.sum(axis=1)
    usual *= np.maximum(1.0, gaps[rows] * np.sqrt(np.pi / own) / SURE)  # long and narrow cells have wider gaps
    wide = cells.radius[rows] > VOID * usual
    rows, usual = rows[wide], usual[wide]
    center = nearest.points[rows] + corner[wide]
    # Where the surface bends within the disc, other points are nearer to its center. Between rows, and where points
    # fill a volume, there are voids without an end.
    found = nearest.tree.query(center, workers=cores())[0] > cells.radius[rows] - ON * usual
    found &= fit_quadrics(nearest.points, nearest.index[rows], nearest.weight[rows], rows).roundness > ROW
    rows, usual, center = rows[found], usual[found], center[found]
    radius = cells.radius[rows]
    area = cells.areas[rows] / usual**2

    def label(some: Bools, passage: float) -> tuple[Ints, Bools, Bools]:
        return _label(nearest.tree, center[some], radius[some], usual[some], area[some], passage)

    wide = radius > SURE * usual
    number, long, large = label(wide, VOID)
    slit, others = np.flatnonzero(wide)[long[number]], np.flatnonzero(wide)[large[number]]
    number = label(np.ones(len(rows), dtype=bool), VOID)[0]
    of_slit = np.isin(number, number[slit])
    # Of those in doubt it is rather told where they end than that they do.
    number, long, _ = label(~of_slit, 1.0)
    told = long[number] | np.isin(np.flatnonzero(~of_slit), others)
    bridged = np.flatnonzero(~of_slit)[told]
    return Voids(rows[of_slit], rows[bridged], np.unique(number[told], return_inverse=True)[1], radius[bridged])


def _label(
    tree: cKDTree, center: Floats, radius: Floats, usual: Floats, area: Floats, passage: float
) -> tuple[Ints, Bools, Bools]:
    """Number the voids that empty discs, (k,) each, lie in; return which of these are slits, and which are no chance.

    Discs lie in one void if they overlap, and halfway between them it is so many times as wide as usual.
    """
    count = len(center)
    if not count:
        return np.zeros(0, dtype=int), np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
    apart, other = cKDTree(center).query(center, k=range(1, min(ENOUGH, count) + 1), workers=cores())
    near = apart <= radius[:, None] + radius[other]
    first, column = np.nonzero(near)
    second = other[first, column]
    between = tree.query(0.5 * (center[first] + center[second]), workers=cores())[0]
    near[first, column] = between > passage * np.minimum(usual[first], usual[second])
    label = label_connected(other, near)
    members = np.bincount(label)
    mean = np.stack([np.bincount(label, axis) for axis in center.T], axis=1) / members[:, None]
    away = center - mean[label]
    spread = np.stack([np.bincount(label, a * b) for a in away.T for b in away.T], axis=1) / members[:, None]
    length = 2.0 * np.sqrt(np.maximum(eigvalsh(spread.reshape(-1, 3, 3))[:, 2], 0.0))
    long = length > _LONG * np.bincount(label, radius) / members
    hole = np.bincount(label, radius / usual) / members > HOLE
    total = np.bincount(label, area)
    return label, (total > (2.0 * HOLE) ** 2) & (long | hole), total > _TOLD
