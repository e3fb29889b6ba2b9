"""Gradients of values along the surface, by which values are extrapolated around each point."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..algebra import blocks, lifted_inverse, on_all_cores
from ..arguments import as_array, as_doubles, check_array, check_positions
from ..cores import cores
from ..geometry import Discs, frames
from ..linalg import solve
from ..progress import ends_at_one
from ..types import Floats, Progress

_COUNT = 12  # neighbors: two rings of an even sample
_ROUND = 0.01  # of `lifted_inverse`
_RIDGE = 0.01  # of the second derivatives, which neighbors may hardly determine, as a share of their trace
_DETERMINED = 0.1  # share of the determinant of slopes alone that is left beside second derivatives, or these are zero
_UNFIT = 14.0  # inverse of the share of the squared rises that a fit of so many coefficients may miss
_BLOCK = 1 << 13  # points at one time


class Slopes:
    """Finds by how much values change along the surface, again and again for the same points.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    discs : Discs
        Tangent planes, and radii within which slopes are to hold; slopes of discs of radius 0 are unknown.

    Raises
    ------
    InvalidPointsError
        Points of the wrong shape or type, or not finite.

    See Also
    --------
    surface.surface_discs : Finds the discs.

    Notes
    -----
    A quadratic function of the tangent plane through the value at the point is fitted to the nearest neighbors, with
    weights that fall with their distance and with their height above that plane: those a radius above it do not count,
    such as the other side of a thin wall. As far as it fits badly, its slope is limited so that values within the disc
    stay in the range of the neighbors, as by a limiter of finite volumes: no overshoots at noise, peaks and jumps.
    Halfway to a neighbor, slopes of both then give values that differ by terms of third order.

    Examples
    --------
    The height above the equator of a sphere climbs by one per length there, and not at all at the poles:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> z = points[:, 2]
    >>> slopes = mf.measure.Slopes(points, mf.surface.surface_discs(points)).of(z)
    >>> print(slopes[abs(z) < 0.1].mean(axis=0).round(1) + 0.0)
    [0. 0. 1.]
    """

    def __init__(self, points: ArrayLike, discs: Discs) -> None:
        given = as_array(points, "Points")
        given = check_positions(given, len(given) if given.ndim else 0, "points", "point")
        given -= given.mean(axis=0) if len(given) else 0.0
        # In the order of a tree, in which neighbors lie near each other in memory, too.
        self._order = cKDTree(given).indices.copy()
        self._points, self._discs = given[self._order], Discs(discs.normals[self._order], discs.radii[self._order])
        found = range(1, min(_COUNT, max(len(given) - 1, 0)) + 2)  # the point itself first
        self._near = cKDTree(self._points).query(self._points, k=found, workers=cores())[1].astype(np.int32)

    @ends_at_one
    def of(self, values: ArrayLike, *, progress: Progress | None = None) -> Floats:
        """Return the slopes of values, (n,), as vectors in the tangent planes, (n, 3) [1/L].

        Values that are not finite count as unknown, and have none. `progress`, if given, is called now and then as
        ``progress(stage, fraction)``; it may raise `Cancelled`.
        """
        count = len(self._points)
        advice = f"Give one real number for each of {count} points."
        given = as_doubles(check_array(values, "Values", [(count,)], advice, "iufb"))[self._order]
        slopes = np.empty(self._points.shape)

        def find(rows: slice) -> None:
            slopes[self._order[rows]] = self._found(rows, given)

        report, parts = progress or (lambda stage, fraction: None), blocks(count, _BLOCK)
        done = iter(np.linspace(0.0, 1.0, len(parts) + 1))
        on_all_cores(find, parts, lambda: report("Slopes", next(done)))
        return slopes

    def _found(self, rows: slice, values: Floats) -> Floats:
        """Return the slopes at some points."""
        near, radii = self._near[rows], self._discs.radii[rows, None]
        axes = frames(self._discs.normals[rows])
        step = (self._points[near] - self._points[rows, None]) @ axes
        height, *flat = np.moveaxis(np.divide(step, radii[:, :, None], out=step, where=radii[:, :, None] > 0.0), 2, 0)
        rise = values[near] - values[rows, None]
        counts = np.isfinite(rise) & (np.abs(height) < 1.0) & (radii > 0.0)
        rise = np.where(counts, rise, 0.0)
        slope = _fit(flat, np.where(counts, height, 1.0), rise)
        return np.einsum("nac,nc->na", axes[:, :, 1:], np.divide(slope, radii, out=slope, where=radii > 0.0))


def _fit(flat: list[Floats], height: Floats, rise: Floats) -> Floats:
    """Fit quadratic functions to rises from points to their neighbors, (n, k); return their slopes, limited, (n, 2).

    Neighbors are given by their two steps in the tangent plane and their height above it, (n, k) each in radii.
    """
    across, along = flat
    squared = across**2 + along**2
    weight = np.divide((1.0 - height**2) ** 2, squared + height**2, out=np.zeros_like(height), where=squared > 0.0)
    weight *= np.divide(squared, squared + height**2, out=np.zeros_like(height), where=squared > 0.0)
    terms = np.stack([across, along, 0.5 * across**2, across * along, 0.5 * along**2], axis=1)
    weighted = weight[:, None] * terms
    inner, sums = weighted @ terms.transpose(0, 2, 1), weighted @ rise[:, :, None]
    second = inner[:, 2:, 2:]
    second = second + (_RIDGE * np.trace(second, axis1=1, axis2=2) + np.finfo(float).tiny)[:, None, None] * np.eye(3)
    known = solve(second, np.concatenate([inner[:, 2:, :2], sums[:, 2:]], axis=2))
    alone = np.concatenate([inner[:, :2, :2], sums[:, :2]], axis=2)
    left = alone - inner[:, :2, 2:] @ known
    known *= (_determinant(left) > _DETERMINED * _determinant(alone))[:, None, None]
    left = alone - inner[:, :2, 2:] @ known
    slope = lifted_inverse(left[:, :, :2].transpose(1, 2, 0), _ROUND).transpose(2, 0, 1) @ left[:, :, 2:]
    found = np.concatenate([slope, known[:, :, 2:] - known[:, :, :2] @ slope], axis=1)
    missed = rise - (found.transpose(0, 2, 1) @ terms)[:, 0]
    slope = slope[:, :, 0]
    return slope * np.maximum(_limit(slope, rise), _freedom(weight, rise, missed))[:, None]


def _determinant(sums: Floats) -> Floats:
    """Return the determinants of the first two columns of matrices, (n, 2, 3)."""
    return sums[:, 0, 0] * sums[:, 1, 1] - sums[:, 0, 1] * sums[:, 1, 0]


def _limit(slope: Floats, rise: Floats) -> Floats:
    """Return which share of slopes stays within the range of the rises to neighbors, (n,)."""
    steep = np.hypot(*slope.T)
    room = np.maximum(np.minimum(rise.max(axis=1), -rise.min(axis=1)), 0.0)
    return np.divide(room, steep, out=np.ones_like(steep), where=steep > room)


def _freedom(weight: Floats, rise: Floats, missed: Floats) -> Floats:
    """Return the trust in a fit, (n,): 1 where it is exact, 0 and less where its residuals are large."""
    total, lost = (np.einsum("nk,nk->n", weight, values**2) for values in (rise, missed))
    return 1.0 - _UNFIT * np.divide(lost, total, out=np.zeros_like(total), where=total > 0.0)
