"""The points that equations of weights are solved on: all, or some of many, from which values are carried to all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from ..algebra import sparsify
from ..geometry import Prolongation, blue_noise_subset
from ..operator import LaplaceBeltrami, narrow_laplacian
from ..types import Floats, Ints, Progress

_MOST = 10_000  # points, which are solved on within two seconds; of more, so many are


@dataclass(frozen=True)
class Reduced:
    """Some of the points of a surface, with an operator of their own whose factors are small.

    Attributes
    ----------
    rows : ndarray, (m,) int
        Which points.
    points : ndarray, (m, 3)
        On the surface [L].
    stiffness : csr_array, (m, m)
    areas : ndarray, (m,)
    carry : callable
        From values (m, k) to those of all points, (n, k); points that are left out have those of the nearest one.
    """

    rows: Ints
    points: Floats
    stiffness: sparse.csr_array
    areas: Floats
    carry: Callable[[Floats], Floats]


def reduce(laplacian: LaplaceBeltrami, report: Progress) -> Reduced:
    """Choose the points to solve on."""
    kept = np.flatnonzero(laplacian.component >= 0)
    points = laplacian.surface_points[kept]
    lone = np.flatnonzero(laplacian.component < 0)
    leader = cKDTree(laplacian.points[kept]).query(laplacian.points[lone])[1] if len(lone) else lone

    def complete(values: Floats) -> Floats:
        result = np.empty((len(laplacian.points), *values.shape[1:]))
        result[kept], result[lone] = values, values[leader]
        return result

    if len(kept) <= _MOST:
        stiffness = sparsify(laplacian.stiffness[kept][:, kept])
        return Reduced(kept, points, stiffness, laplacian.areas[kept], complete)
    report("Points", 0.0)
    some = kept[blue_noise_subset(points, _MOST)]
    few = narrow_laplacian(laplacian, rows=some, progress=lambda stage, share: report("Points", share))
    on = few.component >= 0
    rows, surface = some[on], few.surface_points[on]
    every = Prolongation(points, np.searchsorted(kept, rows), few.normals[on], laplacian.component[rows])

    def carry(values: Floats) -> Floats:
        """Interpolate without leaving the range of the values around."""
        low, high = values.min(axis=0), values.max(axis=0)
        return complete(np.clip(every.interpolate(values), low, high))

    return Reduced(rows, surface, few.stiffness[on][:, on], few.areas[on], carry)
