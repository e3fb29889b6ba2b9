"""Distances between neighbours along the surface, from their normals."""

import numpy as np

_BLOCK = 1 << 20  # pairs worked on at one time, so that their coordinates stay in the cache

ARC = 0.15  # most that the turn of two normals counts for an arc's sixth order, as 1 - cosine: more is a sharp edge
_STEPS = 8  # nearest neighbours whose chords tell of roughness
_EDGE, _ACROSS = 0.9, 3  # cosine of normals at two ends of a chord across a sharp edge, and how many next to a point


def arc_squared(squared, turn, change=0.0):
    """Return the squared length of circular arcs over chords.

    ``s^2 = r^2 + t^2 (1 / 12 + c / 45)``, exact on spheres and cylinders to fourth order of the arc's angle, and to
    sixth order with the change of the normals.

    Parameters
    ----------
    squared : ndarray
        r^2, of the chord d.
    turn : ndarray
        t = d . (n_j - n_i), of the unit normals at both ends, on one side.
    change : ndarray, optional
        c = |n_j - n_i|^2 / 2, which is one minus the cosine between them.
    """
    return squared + turn**2 * (1.0 / 12.0 + change / 45.0)


def circle_arc(chord, bend):
    """Return the length of circular arcs over chords, to all orders, by the sine of half their angle, |t| / (2 r)."""
    return chord * np.where(bend > 1e-4, np.arcsin(bend) / np.maximum(bend, 1e-4), 1.0)


def projected_distance(pairs, normals):
    """Return the length of each pair's difference in the plane orthogonal to its mean normal, eq. (10).

    Parameters
    ----------
    pairs : Pairs
        With p pairs.
    normals : ndarray, (m, 3)
        Unit normals. The second is flipped to the first one's side, pair by pair: signs do not matter.

    Returns
    -------
    ndarray, (p,)
    """
    result = np.empty(len(pairs.first))
    for block, _, left, right, cosine in pair_heights(pairs.points, pairs.first, pairs.second, normals):
        side = np.where(cosine < 0.0, -1.0, 1.0)
        # The mean of two unit normals has the squared length (1 + cos) / 2.
        height = (left + side * right) ** 2 / (2.0 + 2.0 * np.abs(cosine))
        result[block] = np.sqrt(np.maximum(pairs.distance[block] ** 2 - height, 0.0))
    return result


def arc_length(cloud):
    """Return the length of the arc that joins each pair within the surface.

    ``s^2 = r^2 + (d . (n_j - n_i))^2 (1 / 12 + |n_j - n_i|^2 / 90) + g max(r^2 - a^2, 0)``. The second term is exact to
    sixth order on spheres and cylinders, to fourth order elsewhere and where normals turn by more than 32 degrees. The
    third one is the way up and down over roughness of mean squared slope g, the mean of both ends' roughness: finer
    than the normals tell, but shape. Between points one spacing a apart the chord is that way.

    Parameters
    ----------
    cloud : Cloud
        Of m points, with p pairs. The second normal is flipped to the first one's side, pair by pair: signs do not
        matter.

    Returns
    -------
    ndarray, (p,)
    """
    pairs = cloud.pairs
    result = np.empty(len(pairs.first))
    for block, _, left, right, cosine in pair_heights(pairs.points, pairs.first, pairs.second, cloud.normals):
        turn = np.where(cosine < 0.0, -right, right) - left
        result[block] = arc_squared(pairs.distance[block] ** 2, turn, np.minimum(1.0 - np.abs(cosine), ARC))
    if cloud.roughness.any():
        least = pairs.mean(cloud.spacing) ** 2
        result += pairs.mean(cloud.roughness) * np.maximum(pairs.distance**2 - least, 0.0)
    return np.sqrt(result)


def measure_roughness(nearest, normals):
    """Measure what rises and falls between neighbouring points faster than the normals, fitted to many, can tell.

    Parameters
    ----------
    nearest : Nearest
        Of m points.
    normals : ndarray, (m, 3)
        Unit normals of any sign.

    Returns
    -------
    ndarray, (m,)
        Mean square of the slope of the chords to the eight nearest neighbours against the mean normal of their ends,
        averaged over the neighbourhood. Of fourth order in the spacing on a smooth surface. Sharp edges, where normals
        turn too fast between neighbours to be right, are no roughness: arcs make up for them already.
    """
    near = slice(1, _STEPS + 1)
    index, counted = nearest.index[:, near], nearest.weight[:, near] > 0.0
    chord = nearest.points[index] - nearest.points[:, None]
    cosine = np.einsum("ikc,ic->ik", normals[index], normals)
    side = np.where(cosine < 0.0, -1.0, 1.0)
    height = np.einsum("ikc,ic->ik", chord, normals) + side * np.einsum("ikc,ikc->ik", chord, normals[index])
    across = counted & (np.abs(cosine) < _EDGE)
    smooth = counted & ~across & (across.sum(axis=1) < _ACROSS)[:, None]
    slope = np.where(smooth, (0.5 * height / nearest.distance[:, near]) ** 2, 0.0)
    return nearest.averaging() @ (slope.sum(axis=1) / np.maximum(counted.sum(axis=1), 1))


def pair_heights(points, first, second, normals):
    """Yield blocks of pairs: their rows, the chord, its height along the first normal and along the second, the cosine.

    Parameters
    ----------
    points, normals : ndarray, (m, 3)
    first, second : ndarray, (p,) int
        The ends of the pairs.
    """
    for start in range(0, len(first), _BLOCK):
        block = slice(start, start + _BLOCK)
        i, j = first[block], second[block]
        left, right = normals[i], normals[j]
        chord = points[j] - points[i]
        yield block, chord, _dot(chord, left), _dot(chord, right), _dot(left, right)


def _dot(left, right):
    """Return the inner products of the rows of two arrays, (p,)."""
    return np.einsum("ij,ij->i", left, right)
