"""Where the inside of a surface is: the winding number of points with areas and normals, on a grid."""

from __future__ import annotations

import numpy as np
from scipy import fft
from scipy.ndimage import map_coordinates

from ..algebra import blocks
from ..cores import cores
from ..operator import LaplaceBeltrami
from ..types import Bools, Floats, Report

_CELLS = 1 << 21  # of the grid, at most
_MARGIN = 4  # cells of the grid beyond the points, on each side
_ALONG = 0.75  # of a cell, between two places that are looked at
_LEAVES = 0.5  # fall of the winding number from which a way has left the body: across a sheet it is one
_BLOCK = 1 << 9


class Inside:
    """The winding number of a surface around it: 1 inside a closed one, 0 outside, in between where it is open.

    It is the function whose gradient is minus the normals, which point outwards, as a density on the surface, and hence
    solves Poisson's equation (Kazhdan 2005). On a grid of two million cells, a bit wider than the points, the fast
    Fourier transform does this at once, for as many points as there may be; a sheet is as thick as two cells then, or
    as the spacing. `report` is called between stages; it may raise `Cancelled`.
    """

    def __init__(self, laplacian: LaplaceBeltrami, report: Report = lambda: None) -> None:
        kept = laplacian.component >= 0
        points = laplacian.surface_points[kept]
        normals, areas = laplacian.normals[kept], laplacian.areas[kept]
        low, extent = points.min(axis=0), np.ptp(points, axis=0)
        self.cell = float(max(_edge(extent), np.sqrt(np.median(areas))))
        self._low = low - _MARGIN * self.cell
        shape = [fft.next_fast_len(int(size) + 2 * _MARGIN + 2, real=True) for size in extent / self.cell]
        report()
        flux = _spread((points - self._low) / self.cell, areas[:, None] * normals / self.cell**2, shape)
        waves = np.meshgrid(
            *(2.0 * np.pi * fft.fftfreq(size) for size in shape[:2]),
            2.0 * np.pi * fft.rfftfreq(shape[2]),
            indexing="ij",
            sparse=True,
        )
        total, squared = np.zeros((), dtype=complex), np.zeros(())
        for part, wave in zip(flux, waves, strict=True):
            report()
            total = total + 1j * wave * fft.rfftn(part, workers=cores())
            squared = squared + wave**2
        squared[0, 0, 0] = 1.0
        field = fft.irfftn(total / squared, s=shape, workers=cores())
        border = np.concatenate([np.take(field, 0, axis=axis).ravel() for axis in range(3)])
        self._winding = (field - border.mean()).astype(np.float32)

    def at(self, places: Floats) -> Floats:
        """Return the winding number at places [L], (..., 3); zero beyond the grid."""
        index = np.moveaxis((places - self._low) / self.cell, -1, 0)
        return map_coordinates(self._winding, index, order=1, mode="constant", output=np.float32)

    def sees(self, starts: Floats, ends: Floats) -> Bools:
        """Return which straight ways do not leave the body, (k,) bool, between places in or on it, (k, 3) each [L]."""
        result = np.empty(len(starts), dtype=bool)
        length = np.linalg.norm(ends - starts, axis=1)
        order = np.argsort(length, kind="stable")
        for block in blocks(len(order), _BLOCK):
            rows = order[block]  # about as long
            steps = int(np.ceil(length[rows[-1]] / (_ALONG * self.cell))) + 2
            share = np.linspace(0.0, 1.0, steps)[None, :, None]
            winding = self.at(starts[rows, None] + share * (ends - starts)[rows, None])
            result[rows] = (np.maximum.accumulate(winding, axis=1) - winding).max(axis=1) < _LEAVES
        return result


def _edge(extent: Floats) -> float:
    """Return the edge of the cells of a grid that is as large as allowed, around a box."""
    size, edge = np.maximum(extent, 1e-6 * extent.max()), 0.0
    for _ in range(30):
        edge = float(np.cbrt(np.prod(size + (2 * _MARGIN + 1) * edge) / _CELLS))
    return edge


def _spread(index: Floats, values: Floats, shape: list[int]) -> Floats:
    """Return the sums of vectors at places, in cells, on a grid, (3, ...), each shared by the eight nodes around."""
    first = np.floor(index).astype(np.intp)
    share = index - first
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    result = np.zeros((3, int(np.prod(shape))))
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(corner, share, 1.0 - share), axis=1)
        node = (first + corner) @ strides
        for axis in range(3):
            result[axis] += np.bincount(node, weight * values[:, axis], result.shape[1])
    return result.reshape(3, *shape)
