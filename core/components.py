"""Connected parts of a cloud: gaps, lone points, and sheets that nowhere meet."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

SMALLEST = 50  # points of an island that gets an operator of its own
_GAP = 2.0  # an edge longer than this many reaches to the 8th neighbour is a gap
_REACH = 8
_EDGES = 12  # neighbours that a sheet is followed along
_TOUCH = 1.5  # spacings within which points touch
_STEEP = 0.35  # an edge that rises more than this out of the mean tangent plane leads to another sheet


def label_islands(nearest):
    """Number the parts of the cloud that lie apart from each other.

    Points are joined to their nearest neighbours, except over gaps far wider than the spacing at the nearer end; parts
    of some size are joined over gaps that are no wider than the spacing of the sparser one would let expect.

    Returns
    -------
    ndarray, (m,) int
        The largest part is 0. Parts of fewer than 50 points, which get no operator, are -1.
    """
    index, distance = nearest.index[:, 1 : _REACH + 1], nearest.distance[:, 1 : _REACH + 1]
    reach = _GAP * distance[:, -1]
    strict = distance <= np.maximum(np.minimum(reach[:, None], reach[index]), np.median(reach))
    part = _by_size(label_connected(index, strict))
    large = part >= 0
    loose = large[:, None] & large[index] & (distance <= np.maximum(reach[:, None], reach[index]))
    result = np.full(len(part), -1)
    result[large] = _by_size(label_connected(index, strict | loose)[large])
    return result


def label_sheets(nearest, normals, label):
    """Divide parts into sheets that are close to each other but nowhere meet.

    Parameters
    ----------
    nearest : Nearest
        Of m points.
    normals : ndarray, (m, 3)
        Unit normals of any sign.
    label : ndarray, (m,) int
        Parts that gaps divide, none negative.

    Returns
    -------
    ndarray, (m,) int
        The largest part is 0; points off the surface are -1.
    """
    index, distance = nearest.index[:, 1 : _EDGES + 1], nearest.distance[:, 1 : _EDGES + 1]
    offset = nearest.points[index] - nearest.points[:, None]
    other = normals[index]
    side = np.where(np.einsum("ikc,ic->ik", other, normals) < 0.0, -1.0, 1.0)
    rise = np.einsum("ikc,ikc->ik", offset, normals[:, None] + side[:, :, None] * other)
    sheet = _by_size(label_connected(index, np.abs(rise) <= 2.0 * _STEEP * distance))
    # Small parts, such as sharp tips, are joined to the sheet that they touch; what touches none lies off the surface.
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
    result[known] = _by_size(sheet[known] + (sheet.max() + 1) * label[known], smallest=0)
    return result


def label_connected(index, joined):
    """Number the connected parts of points whose neighbours, (m, k) int, are joined to them, (m, k) bool."""
    row = np.repeat(np.arange(len(index), dtype=np.int32), index.shape[1])[joined.ravel()]
    graph = sparse.csr_array((np.ones(len(row), dtype=bool), (row, index[joined])), shape=(len(index),) * 2)
    return connected_components(graph, directed=False)[1]


def _by_size(label, smallest=SMALLEST):
    _, label, size = np.unique(label, return_inverse=True, return_counts=True)
    order = np.argsort(-size, kind="stable")
    number = np.empty_like(order)
    number[order] = np.where((size[order] >= smallest) | (np.arange(len(order)) == 0), np.arange(len(order)), -1)
    return number[label]


def move_apart(points, label):
    """Move parts so far from each other that no search finds neighbours in another one; nothing else changes."""
    if label.max() == 0:
        return points
    moved = points.copy()
    moved[:, 0] += 4.0 * np.ptp(points, axis=0).max() * label
    return moved
