"""Keep close sheets of a surface apart: which neighbours lie on the same sheet, told by their normals."""

import numpy as np
from scipy.sparse.csgraph import connected_components

from .components import SMALLEST, label_connected, number_by_size
from .distances import pair_heights
from .normals import NEIGHBORS, mirrored_cosine, near_edges
from .quadrics import fit_nearest, fit_quadrics

_CLOSE = 0.6  # sheets nearer than this many spacings are taken as one
LEANING = 0.1  # what normals may be off by, as a share of the distance
_MISFIT = 0.2  # a quadric that misses its points by more than this share of the spacing may mix two sheets
_PATIENCE = 0.3  # of the spacing: neighbours of a plane through nearby points count as near it
_SEEDS = 9  # nearest neighbours, every two of which make such a plane
_BLOCK = 1 << 11
_EDGES = 12  # neighbours that a sheet is followed along
_TOUCH = 1.5  # spacings within which points touch
_STEEP = 0.35  # an edge that rises more than this out of the mean tangent plane leads to another sheet
_BACK = -0.2  # cosine of two oriented normals below which the points lie on two sides of a wall
_PARALLEL = 0.5  # cosine, without its sign, of normals on one sheet where the signs do not tell
_AGAINST, _BENT = 0.5, 0.25  # turn against the bend, and bend, in radians, that cannot both be true
_LEANING = 0.3  # what normals within sharp features may be off by, as a share of the distance
_NEXT = 2.0  # spacings between neighbours whose normals cannot point against each other
_OPPOSED = -0.5  # cosine at which they do


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
    Quadrics
        Of the m points.
    nearest : Nearest
        With the neighbours on other sheets at weight zero.
    """
    points, index = nearest.points, nearest.index
    surface = fit_nearest(nearest)
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
        surface.put(again, fit_quadrics(points, index[again], nearest.weight[again], again, normals[again]))
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


def label_sheets(nearest, normals, component):
    """Divide components into sheets that are close to each other but nowhere meet.

    Parameters
    ----------
    nearest : Nearest
        Of m points.
    normals : ndarray, (m, 3)
        Unit normals of any sign.
    component : ndarray, (m,) int
        Components that gaps divide, none negative.

    Returns
    -------
    ndarray, (m,) int
        The largest component is 0; points off the surface are -1.
    """
    index, distance = nearest.index[:, 1 : _EDGES + 1], nearest.distance[:, 1 : _EDGES + 1]
    offset = nearest.points[index] - nearest.points[:, None]
    other = normals[index]
    side = np.where(np.einsum("ikc,ic->ik", other, normals) < 0.0, -1.0, 1.0)
    rise = np.einsum("ikc,ikc->ik", offset, normals[:, None] + side[:, :, None] * other)
    sheet = number_by_size(label_connected(index, np.abs(rise) <= 2.0 * _STEEP * distance))
    # Few points, such as sharp tips, are joined to the sheet that they touch; what touches none lies off the surface.
    touching = nearest.distance <= _TOUCH * nearest.spacing[nearest.index]
    lost = np.flatnonzero(sheet < 0)
    while len(lost):
        sheet[lost] = np.where(touching[lost], sheet[nearest.index[lost]], -1).max(axis=1)
        left = lost[sheet[lost] < 0]
        if len(left) == len(lost):
            break
        lost = left
    result = np.full(len(sheet), -1)
    known = sheet >= 0
    result[known] = number_by_size(sheet[known] + (sheet.max() + 1) * component[known], smallest=0)
    return result


def unsure_orientation(nearest, normals):
    """Tell where the signs of oriented normals contradict each other between close neighbours, (m,) bool.

    A one-sided surface has such a seam; so has a narrow gap that the orientation once leapt.
    """
    first, second, distance = near_edges(nearest)
    close = distance < _NEXT * nearest.spacing[first]
    first, second = first[close], second[close]
    against = mirrored_cosine(nearest.points, normals, first, second) < _OPPOSED
    result = np.zeros(len(normals), dtype=bool)
    result[first[against]] = result[second[against]] = True
    for _ in range(2):
        result |= result[nearest.index[:, 1 : NEIGHBORS + 1]].any(axis=1)
    return result


def separate_sheets(pairs, nearest, oriented, quadrics):
    """Leave out the pairs whose ends lie on different sheets, but for the last ones of a few points.

    Parameters
    ----------
    pairs : Pairs
        Of m points.
    nearest : Nearest
        Of the m points.
    oriented : ndarray, (m, 3)
        Unit normals whose signs agree.
    quadrics : Quadrics
        Of the m points.

    Returns
    -------
    Pairs
        The same ones where all lie on one sheet.
    """
    side = np.sign(np.einsum("ij,ij->i", oriented, quadrics.normals))
    shape_operator = side[:, None, None] * quadrics.shape_operator
    same = pairs_on_one_sheet(pairs, oriented, unsure_orientation(nearest, oriented), shape_operator, nearest.spacing)
    return pairs if same.all() else pairs.keep(same | last_pairs(pairs, same))


def pairs_on_one_sheet(pairs, normals, unsure, shape_operator, spacing):
    """Tell which pairs lie on one sheet of the surface.

    Parameters
    ----------
    pairs : Pairs
        With p pairs.
    normals : ndarray, (m, 3)
        Unit normals whose signs agree: two that point against each other lie on two sides of a wall.
    unsure : ndarray, (m,) bool
        Where their signs do not tell.
    shape_operator : ndarray, (m, 3, 3)
        Second fundamental form for these normals.
    spacing : ndarray, (m,)
        Distance between neighbouring points.

    Returns
    -------
    ndarray, (p,) bool
    """
    result = np.empty(len(pairs.first), dtype=bool)
    for block, chord, left, right, cosine in pair_heights(pairs.points, pairs.first, pairs.second, normals):
        mean = 0.5 * (spacing[pairs.first[block]] + spacing[pairs.second[block]])
        same = same_sheet(left, right, cosine, pairs.distance[block], mean, _LEANING)
        doubt = unsure[pairs.first[block]] | unsure[pairs.second[block]]
        same &= np.where(doubt, np.abs(cosine) > _PARALLEL, cosine > _BACK)
        # Where normals turn against the way the surface bends at both ends, two sheets face each other across a gap.
        turn = (right - left) / pairs.distance[block]
        doubtful = np.flatnonzero(same & (turn < -_AGAINST))
        i, j, chord = pairs.first[block][doubtful], pairs.second[block][doubtful], chord[doubtful]
        bend = 0.5 * sum(np.einsum("pa,pab,pb->p", chord, shape_operator[k], chord) for k in (i, j))
        same[doubtful[bend > _BENT * pairs.distance[block][doubtful]]] = False
        result[block] = same
    return result


def last_pairs(pairs, same):
    """Tell which pairs join the few points that would be left on their own to the rest, (p,) bool.

    Points in a sharp fold may belong to no sheet by their normals; each such group stays with what is nearest to it.
    """
    result = np.zeros(len(same), dtype=bool)
    while True:
        joined = pairs.keep(same | result)
        label = connected_components(joined.half(np.ones(len(joined.first))), directed=False)[1]
        size = np.bincount(label)
        size[size.argmax()] = len(label)  # the largest group is the rest, however small
        ends = label[np.stack([pairs.first, pairs.second])]
        between = np.flatnonzero((ends[0] != ends[1]) & (size[ends].min(axis=0) < SMALLEST))
        if not len(between):
            return result
        between = between[np.argsort(pairs.distance[between], kind="stable")]
        for side in ends[:, between]:
            group, nearest = np.unique(side, return_index=True)
            result[between[nearest[size[group] < SMALLEST]]] = True
