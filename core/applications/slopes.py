"""Slopes of values along the surface, by which a point tells of what lies around it."""

import numpy as np
from scipy.spatial import cKDTree

from ..arguments import as_array, as_doubles, check_positions
from ..blocks import blocks, on_all_cores
from ..errors import InvalidPointsError
from ..geometry import Discs, frames
from .gradients import lifted_inverse

_COUNT = 12  # neighbours: two rings of an even sample
_UNFIT = 8.0  # one by the share of the squared rises that a slope has to explain, to be free of limits
_BLOCK = 1 << 13  # points at one time


class Slopes:
    """Finds by how much values change along the surface, again and again for the same points.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    discs : Discs
        How the surface lies, and as far as which slopes are to hold; those of radius 0 are unknown.

    Raises
    ------
    InvalidPointsError
        Points of the wrong shape or type, or not finite.

    See Also
    --------
    surface_discs : Finds the discs.

    Notes
    -----
    A linear function of the tangent plane through the value at the point is fitted to the nearest neighbours, which
    count the less the farther they are, and the less the higher they lie above that plane: those a radius above it do
    not count, such as the other side of a thin wall. As far as it fits badly it is made less steep where it would leave
    the range of their values within the disc, like a limiter of finite volumes: noise, peaks and jumps do not swing.

    Examples
    --------
    The height above the equator of a sphere climbs by one per length there, and not at all at the poles:

    >>> import numpy as np
    >>> import core
    >>> z = 1 - (np.arange(800) + 0.5) / 400  # 800 points, evenly on the unit sphere
    >>> ring = np.sqrt(1 - z**2) * np.exp(2.39996j * np.arange(800))
    >>> points = np.column_stack([ring.real, ring.imag, z])
    >>> slopes = core.Slopes(points, core.surface_discs(points)).of(z)
    >>> print(slopes[abs(z) < 0.1].mean(axis=0).round(1) + 0.0)
    [0. 0. 1.]
    """

    def __init__(self, points, discs: Discs):
        given = as_array(points, "Points")
        self._points = check_positions(given, len(given) if given.ndim else 0, "points", "point")
        self._points -= self._points.mean(axis=0) if len(self._points) else 0.0
        self._discs = discs
        found = range(1, min(_COUNT, max(len(self._points) - 1, 0)) + 2)  # the point itself first
        self._near = cKDTree(self._points).query(self._points, k=found, workers=-1)[1].astype(np.int32)

    def of(self, values):
        """Return the slopes of values, (n,), as vectors in the tangent planes, (n, 3) [1/L].

        Values that are not finite count as unknown, and have none.
        """
        given = as_array(values, "Values")
        if given.shape != (len(self._points),) or given.dtype.kind not in "iufb":
            raise InvalidPointsError(
                f"Values have the shape {given.shape} and type {given.dtype}, and there are {len(self._points)} points."
                " Give one real number per point."
            )
        values, slopes = as_doubles(given), np.zeros(self._points.shape)

        def find(rows):
            slopes[rows] = self._found(rows, values)

        on_all_cores(find, blocks(len(values), _BLOCK))
        return slopes

    def _found(self, rows, values):
        """Return the slopes at some points."""
        near, radii = self._near[rows], self._discs.radii[rows, None]
        axes = frames(self._discs.normals[rows])
        step = self._points[near] - self._points[rows, None]
        height, across, along = np.moveaxis(step @ axes, 2, 0)
        rise = values[near] - values[rows, None]
        counts = np.isfinite(rise) & (np.abs(height) < radii)
        rise = np.where(counts, rise, 0.0)
        flat = across**2 + along**2
        thin = np.divide(height, radii, out=np.ones_like(height), where=counts)
        weight = np.divide(
            (1.0 - thin**2) ** 2 * flat, (flat + height**2) ** 2, out=np.zeros_like(flat), where=flat > 0
        )
        first, second = weight * across, weight * along
        product = np.einsum("nk,nk->n", first, along)
        inner = [[np.einsum("nk,nk->n", first, across), product], [product, np.einsum("nk,nk->n", second, along)]]
        sums = np.array([np.einsum("nk,nk->n", first, rise), np.einsum("nk,nk->n", second, rise)])
        slope = np.einsum("cdn,dn->cn", lifted_inverse(np.array(inner)), sums)
        explained, total = np.einsum("cn,cn->n", slope, sums), np.einsum("nk,nk->n", weight, rise**2)
        left = np.divide(total - explained, total, out=np.zeros_like(total), where=total > 0.0)
        most = np.hypot(*slope) * radii[:, 0]
        room = np.maximum(np.minimum(rise.max(axis=1), -rise.min(axis=1)), 0.0)
        share = np.divide(room, most, out=np.ones_like(most), where=most > room)
        slope *= np.maximum(share, 1.0 - _UNFIT * left)
        return np.einsum("nac,cn->na", axes[:, :, 1:], slope)
