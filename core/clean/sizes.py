"""Areas and volumes of surfaces whose points move, and the scale that preserves them."""

from collections.abc import Callable

import numpy as np

from ..errors import PointCloudError, SolverError
from ..linalg import eigh
from ..operator import LaplaceBeltrami
from ..types import Array, Bools, Floats

_SCALE = 4.0  # a shape is not scaled by more than this, or its inverse
_ROUNDS = 30  # of the secant steps that find the scale
_AGREE = 0.25  # volumes by the three axes differ by less, unless signs of the normals do


class SurfaceSize:
    """Area or volume of each component after its points move, measured by the operator of the points before.

    The operator gives the metric of the moved surface, ``P = sum_j w_ij (x'_j - x'_i) (x'_j - x'_i)^T / (2 areas_i)``:
    its two large eigenvalues multiply to the square of the growth of the area, and the vector to the small one is the
    normal. The effect of the kernel's width on P cancels in the quotient with that of the surface before.
    """

    def __init__(self, laplacian: LaplaceBeltrami, kind: str) -> None:
        """Prepare for one operator; kind is "area" or "volume"; `before` holds the sizes before the points move.

        Normals that enclose no volume in some component raise `PointCloudError`.
        """
        self.laplacian, self.kind = laplacian, kind
        self.known = laplacian.component >= 0
        self.factor: Floats = np.ones(self.known.sum())
        growth, _ = self._metric(laplacian.surface_points)
        self.factor = 1.0 / np.where(growth > 0.0, growth, 1.0)
        areas, normals = laplacian.areas[self.known], laplacian.normals[self.known]
        self.before = self._sizes(laplacian.surface_points, areas, normals)
        if kind == "volume":
            along = self._along_axes(laplacian.surface_points, areas, normals)
            lost = np.abs(along - self.before[:, None]).max(axis=1) > _AGREE * self.before
            if lost.any():
                raise PointCloudError(
                    f"{np.count_nonzero(lost)} of {len(lost)} components enclose no volume by their"
                    " normals. Let the normals point outwards everywhere, or keep the area."
                )

    def __call__(self, moved: Floats) -> Floats:
        """Return the size of each component for new positions of all points, (components,)."""
        growth, normals = self._metric(moved)
        return self._sizes(moved, self.laplacian.areas[self.known] * growth, normals)

    def _metric(self, places: Floats) -> tuple[Floats, Floats]:
        laplacian, known = self.laplacian, self.known
        x = places - places[known].mean(axis=0)
        a, b = np.array([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]).T
        products = laplacian.stiffness @ np.column_stack([x, x[:, a] * x[:, b]])
        flat = x[:, a] * products[:, b] + x[:, b] * products[:, a] - products[:, 3:]
        flat = flat[known] / (2.0 * laplacian.areas[known])[:, None]
        metric = flat[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
        values, vectors = eigh(metric)
        normals = vectors[:, :, 0]
        side = np.where(np.einsum("ic,ic->i", normals, laplacian.normals[known]) < 0.0, -1.0, 1.0)
        return np.sqrt(np.maximum(values[:, 1] * values[:, 2], 0.0)) * self.factor, side[:, None] * normals

    def _sizes(self, places: Floats, areas: Floats, normals: Floats) -> Array:
        if self.kind == "area":
            return np.bincount(self.laplacian.component[self.known], areas)
        return self._along_axes(places, areas, normals).mean(axis=1)

    def _along_axes(self, places: Floats, areas: Floats, normals: Floats) -> Floats:
        """Return the volume of each component by the divergence of (x, 0, 0), (0, y, 0) and (0, 0, z), (c, 3)."""
        component = self.laplacian.component[self.known]
        total = np.bincount(component)
        columns = []
        for x, across in zip(places[self.known].T, normals.T, strict=True):
            center = np.bincount(component, x) / total
            columns.append(np.bincount(component, areas * (x - center[component]) * across))
        return np.column_stack(columns)


def match_size(size: Callable[[Floats], Floats], wanted: Floats, touched: Bools) -> Floats:
    """Return the scale of each component at which its size is the wanted one, by secant steps on all of them together.

    A component without such a scale near 1 raises `SolverError`.
    """
    last, scale = np.ones(len(wanted)), np.ones(len(wanted))
    error = np.where(touched, size(scale) / wanted - 1.0, 0.0)
    scale = np.where(error != 0.0, np.clip(1.0 + error, 0.25, 4.0) ** -0.5, 1.0)
    for _ in range(_ROUNDS):
        before, error = error, np.where(touched, size(scale) / wanted - 1.0, 0.0)
        if np.abs(error).max() < 1e-9:
            return scale
        with np.errstate(divide="ignore", invalid="ignore"):
            step = error * (scale - last) / (error - before)
        step = np.where(np.isfinite(step), np.clip(step, -0.5 * scale, 0.5 * scale), 0.0)
        last, scale = scale, np.clip(scale - step, 1.0 / _SCALE, _SCALE)
    raise SolverError(
        f"{np.count_nonzero(np.abs(error) >= 1e-9)} of {len(wanted)} components lose so much of their size"
        " that no scale restores it. Smooth less, or do not keep the size."
    )
