"""Keep close sheets of a surface apart: which neighbours lie on the same sheet, told by their normals."""

from dataclasses import fields

import numpy as np

from .surface import fit_surface

_CLOSE = 0.6  # sheets nearer than this many spacings are taken as one
LEANING = 0.1  # what normals may be off by, as a share of the distance
_MISFIT = 0.2  # a quadric that misses its points by more than this share of the spacing may mix two sheets
_PATIENCE = 0.3  # of the spacing: neighbours of a plane through nearby points count as near it
_SEEDS = 9  # nearest neighbours, every two of which make such a plane
_BLOCK = 1 << 11


def same_sheet(left, right, dot, distance, spacing, leaning=LEANING):
    """Tell which pairs lie on one sheet: their chord is orthogonal to their mean normal, within what may be off.

    Parameters
    ----------
    left, right : ndarray
        Height of the second point above the tangent plane of the first, and above its own plane as seen from the first.
    dot : ndarray
        Cosine of the two normals; its sign flips the second one.
    distance, spacing : ndarray
        Of the pair.
    leaning : float
        What normals may be off by, as a share of the distance.

    Returns
    -------
    ndarray of bool
    """
    return np.abs(left + np.where(dot < 0.0, -right, right)) <= 2.0 * (_CLOSE * spacing + leaning * distance)


def on_sheet(nearest, normals, rows, other, distance, leaning=LEANING):
    """Tell which of other points lie on the sheet of some points.

    Parameters
    ----------
    nearest : Nearest
        Of m points.
    normals : ndarray, (m, 3)
        Unit normals.
    rows : ndarray, (k,) int
        The points.
    other : ndarray, (k, views) int
        Points that each of them is compared with.
    distance : ndarray, (k, views)
    leaning : float
        See `same_sheet`.

    Returns
    -------
    same : ndarray, (k, views) bool
    cosine : ndarray, (k, views)
        Of the angle between the normals.
    """
    chord = nearest.points[other] - nearest.points[rows, None]
    cosine = np.einsum("ikc,ic->ik", normals[other], normals[rows])
    left = np.einsum("ikc,ic->ik", chord, normals[rows])
    right = np.einsum("ikc,ikc->ik", chord, normals[other])
    return same_sheet(left, right, cosine, distance, nearest.spacing[rows, None], leaning), cosine


def fit_sheets(nearest):
    """Fit a quadric around every point to the neighbours of its own sheet.

    Where the quadric of all neighbours misses them, a plane is looked for among those through the point and two of its
    nearest neighbours that has most neighbours near it, and moved to fit these best. With these normals neighbours on
    other sheets are told from those on the point's own, and left out of its quadric.

    Parameters
    ----------
    nearest : Nearest
        Of m points.

    Returns
    -------
    LocalSurface
        Of the m points.
    nearest : Nearest
        With the neighbours on other sheets at weight zero.
    """
    points, index = nearest.points, nearest.index
    surface = fit_surface(points, index, nearest.weight)
    spacing = nearest.spacing
    mixed = np.flatnonzero(surface.misfit > _MISFIT * spacing)
    if not len(mixed):
        return surface, nearest
    normals = surface.normals.copy()
    for start in range(0, len(mixed), _BLOCK):
        rows = mixed[start : start + _BLOCK]
        offset = points[index[rows]] - points[rows, None]
        normals[rows] = _own_plane(offset, nearest.weight[rows], spacing[rows])
    touched = np.zeros(len(points), dtype=bool)
    touched[mixed] = True
    touched = np.flatnonzero(touched | touched[index].any(axis=1))
    kept = np.ones(index.shape, dtype=bool)
    kept[touched] = on_sheet(nearest, normals, touched, index[touched], nearest.distance[touched])[0]
    # A quadric has six coefficients; a point that keeps fewer than a dozen neighbours keeps all of them.
    kept |= (kept & (nearest.weight > 0.0)).sum(axis=1, keepdims=True) < 12
    nearest = nearest.keep(kept)
    again = np.flatnonzero(~kept.all(axis=1))
    if len(again):
        refit = fit_surface(points, index[again], nearest.weight[again], again, normals[again])
        for quantity in fields(surface):
            getattr(surface, quantity.name)[again] = getattr(refit, quantity.name)
    return surface, nearest


def _own_plane(offset, weight, spacing):
    first, second = np.triu_indices(min(_SEEDS, offset.shape[1] - 1), 1)
    nearby = offset[:, 1:21]
    a, b = offset[:, 1 + first], offset[:, 1 + second]
    normal = np.cross(a, b)
    length = np.linalg.norm(normal, axis=2)
    narrow = length < 0.25 * np.linalg.norm(a, axis=2) * np.linalg.norm(b, axis=2)
    normal /= np.where(length > 0.0, length, 1.0)[:, :, None]
    height = (normal @ np.swapaxes(nearby, 1, 2)) / (_PATIENCE * spacing)[:, None, None]
    cost = np.minimum(height**2, 1.0).sum(axis=2) + np.where(narrow, offset.shape[1], 0.0)
    normal = normal[np.arange(len(normal)), cost.argmin(axis=1)]
    for _ in range(4):
        height = np.einsum("ikc,ic->ik", offset, normal) / (_PATIENCE * spacing)[:, None]
        near = weight / (1.0 + height**2) ** 2
        normal = np.linalg.eigh(np.swapaxes(near[:, :, None] * offset, 1, 2) @ offset)[1][:, :, 0]
    return normal
