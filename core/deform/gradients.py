"""Deformation gradients: the linear maps of small steps around each point of a moved surface."""

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.spatial import cKDTree

from ..algebra import by_blocks, lifted_inverse, rotations_in_groups
from ..arguments import check_positions
from ..geometry import frames
from ..operator import LaplaceBeltrami
from ..types import Bools, Floats

_FAINT = 1e-3  # share of the sum of weights that its area implies below which a point counts as coupled to none
_ROUND = 0.05  # share of the smaller extent of a neighborhood, squared, in both: a half where it is round


class DeformationGradients:
    """Finds deformation gradients of a surface that is moved again and again; see `deformation_gradients`."""

    def __init__(self, laplacian: LaplaceBeltrami) -> None:
        self._count = len(laplacian.points)
        joined = coupled(laplacian)
        own, alone = np.flatnonzero(joined), np.flatnonzero(~joined)
        self._own, self._near = own, np.arange(self._count)
        if len(own):
            self._near[own] = np.arange(len(own))
            self._near[alone] = cKDTree(laplacian.points[own]).query(laplacian.points[alone])[1]
        rest = laplacian.points[own]
        rest = rest - rest.mean(axis=0) if len(own) else rest
        pairs = laplacian.stiffness[own][:, own].tocoo()
        step = rest[pairs.row] - rest[pairs.col]
        squared, weight = np.einsum("ka,ka->k", step, step), np.maximum(-pairs.data, 0.0)
        pairs.data = np.divide(weight, squared, out=np.zeros_like(weight), where=squared > 0.0)
        self._products = step_products(pairs, rest)
        self._component = np.unique(laplacian.component[own], return_inverse=True)[1].reshape(-1)
        self._at_rest = sums_over_steps(self._products, rest)
        # Normal, then two tangents, as columns. Sums over strided arrays take ten times as long.
        self._frames = np.ascontiguousarray(np.moveaxis(frames(laplacian.normals[own]), 0, 2))
        self._tangents = np.ascontiguousarray(self._frames[:, 1:])

    def at(self, positions: ArrayLike) -> Floats:
        """Return the gradients, (n, 3, 3), for the points after the deformation, (n, 3) [L]."""
        now = check_positions(positions, self._count, "points after the deformation", "point")
        if not len(self._own):
            return np.tile(np.eye(3), (self._count, 1, 1))
        now = now[self._own]
        after, before = sums_over_steps(self._products, now - now.mean(axis=0)), self._at_rest
        rotation = rotations_in_groups(after, self._component)
        spread = np.einsum("aan->n", before)
        size = np.einsum("abn,abn->n", rotation, after) / np.where(spread > 0.0, spread, 1.0)
        alike = size * rotation  # the similarity that fits best
        # Its residual along the surface: the linear fit in the tangent plane, to steps less those by similarity.
        tangents = self._tangents
        left = np.einsum("abn,bcn->acn", after - np.einsum("abn,bcn->acn", alike, before), tangents)
        inner = np.einsum("abn,bdn->adn", np.einsum("ban,bcn->acn", tangents, before), tangents)
        slopes = np.einsum("abn,bcn->acn", left, lifted_inverse(inner, _ROUND))
        stretched = np.einsum("abn,bcn->acn", alike, tangents) + slopes
        across = np.cross(stretched[:, 1], stretched[:, 0], axis=0)  # as `frames` orders them
        area = np.sqrt(np.einsum("an,an->n", across, across))
        across /= np.sqrt(np.where(area > 0.0, area, 1.0))  # as thick as the root of the area is wide
        columns = np.stack([across, stretched[:, 0], stretched[:, 1]], axis=1)
        return np.moveaxis(np.einsum("abn,cbn->acn", columns, self._frames), 2, 0)[self._near]


def deformation_gradients(laplacian: LaplaceBeltrami, positions: ArrayLike) -> Floats:
    """Find how a deformation maps small steps around each point.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of the points before the deformation.
    positions : array_like, (n, 3)
        The points after it [L].

    Returns
    -------
    ndarray, (n, 3, 3)
        F, so that a step s along the surface becomes F s. Across the surface, which points do not determine, lengths
        change by the square root of the change of the area, and the normal stays normal: rotations, shifts and scales
        of all points are exact to round-off. Points on no surface have the F of the nearest that is.

    Raises
    ------
    InvalidPointsError
        Points of the wrong shape or type, or not finite.

    See Also
    --------
    Deformer : Deforms a surface by its handles.
    splats.Splats.deformed : Deforms ellipsoids.

    Notes
    -----
    With S the sum of w (x_j - x_i)(p_j - p_i)^T, the similarity s R that fits the steps best has the polar factor R of
    S; the linear fit in the tangent plane to its residuals is added. The weights w are those of the stiffness, as far
    as they are positive, divided by the squared lengths of the steps: heights above the tangent plane, which grow as
    these, then weigh as in the operator, to which linear functions add up to zero, and do not bias the fit.

    Examples
    --------
    A sphere stretched to twice its length along z: steps along its equator stay, those across it double.

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> z = points[:, 2]
    >>> laplacian = mf.build_laplacian(points)
    >>> gradients = mf.deform.deformation_gradients(laplacian, points * [1, 1, 2])
    >>> print(np.median(gradients[abs(z) < 0.05, 2, 2]).round(1))
    2.0
    """
    return DeformationGradients(laplacian).at(positions)


def coupled(laplacian: LaplaceBeltrami) -> Bools:
    """Return which points the operator couples to others, (n,) bool.

    On a surface the weights times the squared lengths of the steps add up to four times the area, for the Laplacian of
    the squared distance is four. Points where that sum is far smaller, such as single ones far off the surface, belong
    to a component by name only.
    """
    points, stiffness = laplacian.surface_points, laplacian.stiffness

    def weigh(rows: slice) -> Floats:
        part, count = stiffness[rows], rows.stop - rows.start
        row = np.repeat(np.arange(count), np.diff(part.indptr))
        step = points[part.indices] - points[rows][row]
        weight = np.maximum(-part.data, 0.0) * np.einsum("ka,ka->k", step, step)
        return np.asarray(np.bincount(row, weight, minlength=count), dtype=np.float64)

    sums = by_blocks(weigh, len(points))
    return (laplacian.component >= 0) & (sums > _FAINT * 4.0 * laplacian.areas)


def sums_over_steps(products: sparse.csr_array, points: Floats) -> Floats:
    """Return the sums over neighbors of w_ij (x_j - x_i)(p_j - p_i)^T, (3, 3, m), p the points at rest.

    The products, (3 m, m), are `step_products` of these and the weights; `points`, (m, 3), are x.
    """
    # Column by column: half of the time that three at once take.
    return np.array([(products @ column).reshape(3, -1) for column in np.ascontiguousarray(points.T)])


def step_products(weights: sparse.coo_array, rest: Floats) -> sparse.csr_array:
    """Return the (3 m, m) matrix G with (G x)[c m + i] = sum_j w_ij (p_j - p_i)_c (x_j - x_i), for `sums_over_steps`.

    The diagonal of the weights, (m, m), does not count; `rest`, (m, 3), is p.
    """
    step = rest[weights.col] - rest[weights.row]
    products = []
    for c in range(3):
        share = weights.data * step[:, c]
        product = sparse.csr_array((share, (weights.row, weights.col)), shape=weights.shape)
        own = np.bincount(weights.row, share, minlength=len(rest))
        products.append(product - sparse.diags_array(own, format="csr"))
    return sparse.vstack(products, format="csr")
