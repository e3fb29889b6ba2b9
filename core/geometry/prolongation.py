"""Prolongation of quantities from a subset to all points."""

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.spatial import cKDTree

from ..algebra import blocks, eliminate, on_all_cores
from ..arguments import as_array, check_points
from ..errors import InvalidPointsError
from ..types import Array, Floats, Ints, Report
from .nearest import SMOOTH
from .points import as_mask, check_values
from .quadrics import frames
from .subset import voxel_numbers

_NEIGHBORS = 9  # of the subset around each point
_BLOCK = 1 << 14  # points worked on at one time
_CELLS = 64  # along the longest side of the cloud: points go cell by cell, so that neighbors are near in memory
_STEEP = 10.0  # factor on distances across the surface, in the search for the nearest point of the subset
_CLOSE = 1e-6  # of the reach: a point of the subset takes its own value
_LEVEL = 1e-3  # of the scatter of the neighbors, below which they lie in a row
_BEYOND = 2.0  # scatters beyond the middle of the neighbors up to which values go on in their slope


class Prolongation:
    """Carries areas, functions and labels from a subset of points to all of them, along the surface.

    Each point belongs to the point of the subset that is nearest, steps across the surface counting ten times, so that
    close sheets stay apart. Functions are interpolated from that one and its neighbors of the same sheet: moving least
    squares of first order, whose weights rise without bound at the points of the subset, so that these keep their
    values and functions linear along the surface stay linear: an error of second order in the spacing.

    Parameters
    ----------
    points : array_like, (n, 3)
        All points [L].
    subset : array_like, (k,) int or (n,) bool
        Which of them hold values.
    normals : array_like, (k, 3)
        Unit normals of the surface at these; signs agree on each sheet.
    component : array_like, (k,) int, optional
        Numbers of components, which are kept apart.
    progress : callable, optional
        Called without arguments again and again; may raise `Cancelled`.

    Attributes
    ----------
    nearest : ndarray, (n,) int
        The row of the subset that each point belongs to.

    Raises
    ------
    InvalidPointsError
        Points, a subset or normals of a wrong shape.

    See Also
    --------
    clean.blue_noise_subset : Chooses a subset.

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> subset = mf.clean.blue_noise_subset(points, 300)
    >>> laplacian = mf.build_laplacian(points[subset])
    >>> every = mf.clean.Prolongation(points, subset, laplacian.normals)
    >>> print(np.isclose(every.shares(laplacian.areas).sum(), laplacian.areas.sum()))
    True
    >>> print(np.abs(every.interpolate(points[subset, 2]) - points[:, 2]).max() < 0.03)
    True
    """

    def __init__(
        self,
        points: ArrayLike,
        subset: ArrayLike,
        normals: ArrayLike,
        component: ArrayLike | None = None,
        progress: Report | None = None,
    ) -> None:
        points = check_points(points)
        count = len(points)
        subset = _rows(subset, count)
        chosen, normals = points[subset], check_values(normals, len(subset))
        component = np.zeros(len(subset), dtype=np.int64) if component is None else np.asarray(component)
        if normals.shape != chosen.shape or component.shape != chosen.shape[:1]:
            raise InvalidPointsError(
                f"Normals have the shape {normals.shape}, components {component.shape}, and there are {len(chosen)}"
                " points in the subset. Give one row per point of it."
            )
        unit = float(np.ldexp(1.0, np.frexp(np.ptp(points, axis=0).max())[1]))  # squares in huge units would overflow
        points, chosen = points / unit, chosen / unit
        tree, width = cKDTree(chosen), min(_NEIGHBORS, len(chosen))
        low, extent = points.min(axis=0), np.ptp(points, axis=0).max()
        self._order = np.argsort(voxel_numbers(points, low, extent / _CELLS + 1e-300), kind="stable").astype(np.int32)
        self._index = np.empty((count, width), dtype=np.int32)
        self._weight = np.empty((count, width), dtype=np.float32)
        self.nearest = np.empty(count, dtype=np.int32)

        def carry(block: slice) -> None:
            rows = self._order[block]
            index = tree.query(points[rows], k=width)[1].reshape(-1, width)
            self.nearest[rows], self._weight[block] = _weights(points[rows], chosen, normals, component, index)
            self._index[block] = index

        on_all_cores(carry, blocks(count, _BLOCK), progress or (lambda: None))

    def interpolate(self, values: ArrayLike) -> Array:
        """Interpolate functions.

        Parameters
        ----------
        values : array_like, (k,) or (k, m)
            On the subset.

        Returns
        -------
        ndarray, (n,) or (n, m) float32
            On all points; on those of the subset as given.
        """
        values = np.ascontiguousarray(values, dtype=np.float32)
        result = np.empty((len(self.nearest), *values.shape[1:]), dtype=np.float32)
        width = self._index.shape[1]

        def carry(block: slice) -> None:
            index, weight = self._index[block], self._weight[block]
            start = np.arange(0, index.size + 1, width, dtype=np.int32)
            matrix = sparse.csr_array((weight.ravel(), index.ravel(), start), shape=(len(index), len(values)))
            result[self._order[block]] = matrix @ values

        on_all_cores(carry, blocks(len(result), _BLOCK))
        return result

    def shares(self, areas: ArrayLike, left_out: ArrayLike = ()) -> Floats:
        """Share areas, or masses, evenly over the points that belong to each point of the subset: sums are kept.

        Parameters
        ----------
        areas : array_like, (k,)
        left_out : array_like, (m,) int or (n,) bool, optional
            Points that get nothing; none of the subset.

        Returns
        -------
        ndarray, (n,)
        """
        takes = ~as_mask(left_out, len(self.nearest))
        owned = np.bincount(self.nearest[takes], minlength=np.size(areas))
        return np.where(takes, (np.asarray(areas) / np.maximum(owned, 1))[self.nearest], 0.0)

    def labels(self, values: ArrayLike) -> Floats:
        """Give each point what the point of the subset has that it belongs to: truth values, numbers of components.

        Parameters
        ----------
        values : array_like, (k,) or (k, m)

        Returns
        -------
        ndarray, (n,) or (n, m)
        """
        return np.asarray(values)[self.nearest]


def _rows(subset: ArrayLike, count: int) -> Ints:
    """Return the rows of a subset, indices in their order or a mask."""
    given = as_array(subset, "Subsets")
    if given.dtype == bool and given.shape == (count,):
        given = np.flatnonzero(given)
    if given.ndim != 1 or given.dtype.kind not in "iu" or not len(given) or given.min() < 0 or given.max() >= count:
        raise InvalidPointsError(
            f"A subset has the shape {given.shape} and type {given.dtype}. Give whole numbers from 0 to {count - 1}, or"
            f" {count} truth values, at least one."
        )
    return given


def _weights(points: Floats, chosen: Floats, normals: Floats, component: Ints, index: Ints) -> tuple[Ints, Floats]:
    """Return the rows of the subset that some points belong to, (b,), and the weights of their neighbors, (b, 9)."""
    step = chosen[index] - points[:, None]
    height = np.einsum("ijk,ijk->ij", normals[index], step)
    squared = np.einsum("ijk,ijk->ij", step, step)
    row = np.arange(len(points))
    best = np.argmin(squared + _STEEP**2 * height**2, axis=1)
    first = index[row, best]

    own = normals[first]
    same = (np.einsum("ijk,ik->ij", normals[index], own) > SMOOTH) & (component[index] == component[first][:, None])
    same[row, best] = True
    reach = squared.max(axis=1, keepdims=True) * 1.01 + 1e-290
    weight = np.where(same, (1.0 - squared / reach) / (squared + _CLOSE**2 * reach), 0.0)
    weight /= weight.sum(axis=1, keepdims=True)

    # Along the surface only: in the tangent plane.
    offset = np.einsum("ijk,ikl->lij", step, frames(own)[:, :, 1:])
    return first, balanced_weights(weight, offset, _LEVEL, _BEYOND)


def balanced_weights(weight: Floats, offset: Floats, least: float, beyond: float = np.inf) -> Floats:
    """Balance weights, so that they carry linear functions as they are: moving least squares of first order.

    The value at zero of the linear function that fits the values at some offsets best is a sum of these values with
    other weights. Weights, (n, k), of the neighbors of each place add up to one, as do those that are returned;
    offsets, (d, n, k), are where the neighbors are, seen from the place. `least` is the share of the neighbors' scatter
    that counts as one in each direction: those in which less is not balanced. `beyond` is up to how many scatters
    beyond the middle of the neighbors values go on in their slope.
    """
    dimensions = len(offset)
    mean = np.einsum("nk,dnk->dn", weight, offset)
    offset = offset - mean[:, :, None]
    equations = np.empty((dimensions, dimensions + 1, len(weight)))
    for row, weighted in enumerate(weight * offset):
        for column in range(row + 1):
            equations[row, column] = equations[column, row] = np.einsum("nk,nk->n", weighted, offset[column])
    scatter = sum(equations[axis, axis] for axis in range(dimensions))
    far = np.sqrt(np.sum(mean**2, axis=0) / np.maximum(scatter, 1e-300))
    equations[range(dimensions), range(dimensions)] += np.where(scatter > 0.0, least * scatter, 1.0)
    equations[:, dimensions] = mean / np.maximum(far / beyond, 1.0)
    slope = eliminate(equations)[:, dimensions]
    return weight * (1.0 - np.einsum("dn,dnk->nk", slope, offset))
