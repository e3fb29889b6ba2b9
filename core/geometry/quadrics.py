"""What the cloud tells about the surface around each point: normal and curvature, from local quadrics."""

from dataclasses import dataclass, fields

import numpy as np

from ..errors import NotASurfaceError

_BLOCK = 1 << 13  # points fitted at one time
_CURVE = 5e-3  # variance across over that along, of neighbours on a curve
_CURVES = 0.01  # share of the points around which they may be
_RIDGE = 1e-10  # keeps the normal equations solvable where the neighbours lie on a conic


@dataclass(frozen=True)
class Quadrics:
    """A quadric through the neighbours of every point.

    Attributes
    ----------
    normals : ndarray, (m, 3)
        Unit normals.
    gaussian_curvature : ndarray, (m,)
        Gaussian curvature [1 / L^2].
    max_abs_curvature : ndarray, (m,)
        The larger of the two principal curvatures, without its sign [1 / L].
    height : ndarray, (m, 3)
        From the point to the quadric, across it [L].
    shape_operator : ndarray, (m, 3, 3)
        Second fundamental form: ``t . shape_operator t`` is the curvature along the unit tangent t, positive where the
        surface bends away from the normal.
    misfit : ndarray, (m,)
        Root mean square distance of the neighbours from the quadric [L].
    curved : ndarray, (m,) bool
        The neighbours lie along a curve, so that they tell no normal.
    """

    normals: np.ndarray
    gaussian_curvature: np.ndarray
    max_abs_curvature: np.ndarray
    height: np.ndarray
    shape_operator: np.ndarray
    misfit: np.ndarray
    curved: np.ndarray

    def put(self, rows, others):
        """Put the quadrics of others, of k points, in the place of those of some rows, (k,) int."""
        for quantity in fields(self):
            getattr(self, quantity.name)[rows] = getattr(others, quantity.name)


def fit_quadrics(points, index, weight, rows=None, normals=None):
    """Fit ``z = c0 + c1 u + c2 v + c3 u^2 + c4 u v + c5 v^2`` around points.

    Parameters
    ----------
    points : ndarray, (m, 3)
        Coordinates.
    index : ndarray, (k, neighbors) int
        Neighbours of k points, ordered by distance, the point itself first.
    weight : ndarray, (k, neighbors)
        Weights of the neighbours.
    rows : ndarray, (k,) int, optional
        The points; all m of them if not given.
    normals : ndarray, (k, 3), optional
        Where the axis z points; the direction of least variance of the same neighbours if not given.

    Returns
    -------
    Quadrics
        Of the k points. The signs of the normals are arbitrary.
    """
    rows = np.arange(len(points)) if rows is None else rows
    count = len(rows)
    fitted = Quadrics(
        *(np.empty(shape) for shape in ((count, 3), count, count, (count, 3), (count, 3, 3), count)),
        curved=np.zeros(count, dtype=bool),
    )
    for start in range(0, count, _BLOCK):
        block = slice(start, start + _BLOCK)
        offset = points[index[block]] - points[rows[block], None]
        share = weight[block] / weight[block].sum(axis=1, keepdims=True)
        centered = offset - np.einsum("ik,ikc->ic", share, offset)[:, None]
        covariance = np.swapaxes(share[:, :, None] * centered, 1, 2) @ centered
        if normals is None:
            variance, frame = np.linalg.eigh(covariance)
            fitted.curved[block] = variance[:, 1] < _CURVE * variance[:, 2]
        else:
            frame = frames(normals[block])
        unit = 3.0 * np.sqrt(0.5 * np.trace(covariance, axis1=1, axis2=2))  # makes the equations well scaled
        z, v, u = np.moveaxis(offset @ frame / unit[:, None, None], 2, 0)
        basis = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=2)
        weighted = np.swapaxes(basis * share[:, :, None], 1, 2)
        fit = np.linalg.solve(weighted @ basis + _RIDGE * np.eye(6), weighted @ z[:, :, None])
        misfit = (z - (basis @ fit)[:, :, 0]) ** 2
        fit = fit[:, :, 0]
        slope = 1.0 + fit[:, 1] ** 2 + fit[:, 2] ** 2
        local = np.stack([np.ones_like(slope), -fit[:, 2], -fit[:, 1]], axis=1) / np.sqrt(slope)[:, None]
        mean, turn = fit[:, 3] + fit[:, 5], np.hypot(fit[:, 3] - fit[:, 5], fit[:, 4])
        fitted.normals[block] = np.einsum("iab,ib->ia", frame, local)
        fitted.gaussian_curvature[block] = (4.0 * fit[:, 3] * fit[:, 5] - fit[:, 4] ** 2) / (slope * unit) ** 2
        fitted.max_abs_curvature[block] = (np.abs(mean) + turn) / unit
        form = np.empty((len(fit), 2, 2))
        form[:, 0, 0], form[:, 1, 1] = -2.0 * fit[:, 3], -2.0 * fit[:, 5]
        form[:, 0, 1] = form[:, 1, 0] = -fit[:, 4]
        tangents = frame[:, :, :0:-1]  # u, v
        fitted.shape_operator[block] = (tangents @ form @ np.swapaxes(tangents, 1, 2)) / unit[:, None, None]
        fitted.height[block] = (fit[:, 0] * unit)[:, None] * frame[:, :, 0]
        fitted.misfit[block] = np.sqrt((share * misfit).sum(axis=1)) * unit
    return fitted


def fit_nearest(nearest):
    """Fit a quadric around every point to its nearest neighbours, on which all that is known of the surface rests.

    Raises
    ------
    NotASurfaceError
        The points of many neighbourhoods lie along a curve.
    """
    fitted = fit_quadrics(nearest.points, nearest.index, nearest.weight)
    curves, count = np.count_nonzero(fitted.curved), len(fitted.curved)
    if curves > _CURVES * count:
        raise NotASurfaceError(
            f"Around {curves} of {count} points the neighbors lie along a curve, so there is no tangent plane."
            " Use points of a surface."
        )
    return fitted


def heights_over(quadrics, points, rows, other):
    """Return how far other points are from the quadrics of some, with a sign, along their normals.

    Parameters
    ----------
    quadrics : Quadrics
        Of m points.
    points : ndarray, (m, 3)
    rows, other : ndarray of int
        The points with the quadrics, and those above them, of shapes that broadcast to (k, views).

    Returns
    -------
    ndarray, (k, views)
    """
    offset = points[other] - points[rows] - quadrics.height[rows]
    bend = 0.5 * np.einsum("...a,...ab,...b->...", offset, quadrics.shape_operator[rows], offset)
    return np.einsum("...a,...a->...", offset, quadrics.normals[rows]) + bend


def frames(normals):
    """Return orthonormal frames as columns (normal, and two tangents), (k, 3, 3)."""
    axis = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    tangent = np.cross(normals, axis)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    return np.stack([normals, np.cross(normals, tangent), tangent], axis=2)
