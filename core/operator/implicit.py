"""The surface that points lie on, as the zero of a function around them: the mean height above near quadrics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..algebra import blocks, on_all_cores
from ..cores import cores
from ..geometry import SMOOTH, find_nearest
from ..types import Array, Bools, Floats, Ints, Report
from .laplacian import LaplaceBeltrami

_NEIGHBORS = 12  # of a place, whose quadrics are averaged
_BLOCK = 1 << 13  # places looked at at one time
_BELONGS = 3.0  # spacings from the nearest point within which a place of the surface belongs to the points


class Heights(NamedTuple):
    """What is known at some places near a surface."""

    # (k,), distance from the surface, positive on the side of the normals: exact for quadrics, to second order
    height: Floats
    normal: Floats  # (k, 3), unit normals of the surface nearby
    nearest: Ints  # (k,), the nearest point
    spacing: Floats  # (k,), of the points there
    distance: Floats  # (k,), from the nearest point, in spacings of the points there
    # (k,), how far the place lies beyond the boundary of the surface; negative inside, -inf where none is near
    beyond: Floats
    outward: Floats  # (k, 3), unit vector across that boundary; zero where none is near

    @property
    def support(self) -> Floats:
        """How near the foot of each place is to a point, from 1 at one to 0 far from all, (k,)."""
        return np.exp(-np.maximum(self.distance**2 - (self.height / self.spacing) ** 2, 0.0))

    @property
    def belongs(self) -> Bools:
        """Whether the surface next to the place is that of the points, (k,) bool: no gap between them, nor outside."""
        return (self.distance < _BELONGS) & (self.beyond <= 0.0)


class ImplicitSurface:
    """The surface of points with quadrics, as the zero of a signed height: implicit moving least squares.

    Of the nearest points of a place, those of the same sheet as the very nearest one each give how far the place is
    above their quadric; the mean of that, weighted by distance, is its height. So sharp edges stay sharp.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Heights are right where the signs of its normals agree. Points that it leaves out make no surface.
    unit : float
        Length [L] that counts as one in all that is measured.

    Attributes
    ----------
    points, normals : ndarray, (m, 3)
        The points on the surface in these units, from their middle on, and unit normals.
    spacing : ndarray, (m,)
        Distance between neighboring points in these units; next to a change of density the larger one.
    local_spacing : ndarray, (m,)
        The same, everywhere that of the nearest points.
    """

    def __init__(self, laplacian: LaplaceBeltrami, unit: float) -> None:
        kept = laplacian.component >= 0
        self._middle, self._unit = laplacian.surface_points[kept].mean(axis=0), unit
        points = self.scaled(laplacian.surface_points[kept])
        nearest = find_nearest(points)
        self.points, self._tree = points, nearest.tree
        self.local_spacing, self.spacing = nearest.spacing, nearest.spacing.copy()
        # Where dense points end and sparse ones begin, the gap between them is as wide as those of the sparse ones.
        np.maximum.at(self.spacing, nearest.index, self.spacing[:, None] - nearest.distance / _BELONGS)
        self.normals, self._component = laplacian.normals[kept], laplacian.component[kept]
        self._shape_operator = laplacian.shape_operator[kept] * unit
        inside, outward = laplacian.boundary_distance[kept] / unit, laplacian.boundary_direction[kept]
        known = np.isfinite(inside) & outward.any(axis=1)
        self._inside = np.where(known, inside, np.inf)
        self._outward = np.where(known[:, None], outward, 0.0)

    def scaled(self, points: Floats) -> Floats:
        """Return points [L], (k, 3), in the units and from the middle that all else is measured in."""
        return (points - self._middle) / self._unit

    def placed(self, points: Floats) -> Floats:
        """Return points in these units, (k, 3), as they are [L]."""
        return self._middle + self._unit * points

    def nearest(self, places: Floats) -> Ints:
        """Return the number of the point that is nearest to each place, (k,) int."""
        return self._tree.query(places, workers=cores())[1]

    def half_curvature(self, rows: Ints) -> Floats:
        """Return half the norm of the shape operator of some points, (k,): how fast the surface leaves their planes."""
        forms = self._shape_operator[rows]
        return 0.5 * np.sqrt(np.einsum("iab,iab->i", forms, forms))

    def over(self, rows: Ints, places: Floats) -> Floats:
        """Return how far places, (k, 3), are above the quadrics of some points, (k,) int."""
        offset = places - self.points[rows]
        slope = np.einsum("icd,id->ic", self._shape_operator[rows], offset)
        return np.einsum("ic,ic->i", offset, self.normals[rows] + 0.5 * slope)

    def flip(self, rows: Bools) -> None:
        """Reverse the normals of some points, (k,) int or (m,) bool."""
        self.normals[rows] *= -1.0
        self._shape_operator[rows] *= -1.0

    def heights(self, places: Floats, report: Report = lambda: None) -> Heights:
        """Measure places near the surface, (k, 3); `report` is called after each block, and may raise `Cancelled`."""
        count = len(places)
        height, spacing, distance, beyond = np.empty((4, count))
        normal, outward = np.empty((2, count, 3))
        result = Heights(height, normal, np.empty(count, dtype=np.int64), spacing, distance, beyond, outward)

        def measure(block: slice) -> None:
            for known, found in zip(result, self._measure(places[block]), strict=True):
                known[block] = found

        on_all_cores(measure, blocks(count, _BLOCK), report)
        return result

    def _measure(self, places: Floats) -> tuple[Array, ...]:
        many = min(_NEIGHBORS, len(self.points))
        distance, index = self._tree.query(places, k=many)
        first, normals = index[:, 0], self.normals[index]
        spacing = self.spacing[first]
        same = np.einsum("ikc,ic->ik", normals, normals[:, 0]) > SMOOTH
        same &= self._component[index] == self._component[first, None]
        # Far off the surface all points are at about the same distance: weights follow the excess over the nearest.
        weight = np.where(same, np.exp((distance[:, :1] ** 2 - distance**2) / spacing[:, None] ** 2), 0.0)
        weight /= weight.sum(axis=1, keepdims=True)
        offset = places[:, None] - self.points[index]
        slope = np.einsum("ikcd,ikd->ikc", self._shape_operator[index], offset)
        above = np.einsum("ikc,ikc->ik", offset, normals + 0.5 * slope)
        height = np.einsum("ik,ik->i", weight, above)
        normal = _units(np.einsum("ik,ikc->ic", weight, normals + slope))

        inside, outward = self._inside[index], self._outward[index]
        near = np.where(np.isfinite(inside[:, :1]), weight * np.isfinite(inside), 0.0)
        total = np.maximum(near.sum(axis=1), 1e-300)
        past = np.einsum("ikc,ikc->ik", offset, outward) - np.where(near > 0.0, inside, 0.0)
        beyond = np.where(near[:, 0] > 0.0, np.einsum("ik,ik->i", near, past) / total, -np.inf)
        outward = _units(np.einsum("ik,ikc->ic", near, outward))
        return height, normal, first, spacing, distance[:, 0] / spacing, beyond, outward


def _units(vectors: Floats) -> Floats:
    return vectors / np.maximum(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)), 1e-300)[:, None]
