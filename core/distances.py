"""Two measures of the distance between neighbours along the surface, from their normals."""

import numpy as np

_BLOCK = 1 << 20  # pairs worked on at one time, so that their coordinates stay in the cache


def projected_distance(neighborhoods, normals):
    """Return the length of each pair's difference in the plane orthogonal to its mean normal, eq. (10).

    Parameters
    ----------
    neighborhoods : Neighborhoods
        With p pairs.
    normals : ndarray, (m, 3)
        Unit normals. The second is flipped to the first one's side, pair by pair: signs do not matter.

    Returns
    -------
    ndarray, (p,)
    """
    return _distance(neighborhoods, normals, 1.0, lambda height, mean: -(height**2) / np.einsum("ij,ij->i", mean, mean))


def arc_length(neighborhoods, normals):
    """Return the length of the arc that joins each pair within the surface, to fourth order.

    ``s^2 = r^2 + (d . (n_j - n_i))^2 / 12``, exact to that order on spheres, cylinders and cones.

    Parameters
    ----------
    neighborhoods : Neighborhoods
        With p pairs.
    normals : ndarray, (m, 3)
        Unit normals. The second is flipped to the first one's side, pair by pair: signs do not matter.

    Returns
    -------
    ndarray, (p,)
    """
    return _distance(neighborhoods, normals, -1.0, lambda height, turn: height**2 / 12.0)


def _distance(neighborhoods, normals, sign, change):
    first, second, points = neighborhoods.first, neighborhoods.second, neighborhoods.points
    result = np.empty(len(first))
    for start in range(0, len(first), _BLOCK):
        block = slice(start, start + _BLOCK)
        i, j = first[block], second[block]
        left, right = normals[i], normals[j]
        side = np.where(np.einsum("ij,ij->i", left, right) < 0.0, -sign, sign)
        combined = left + side[:, None] * right
        height = np.einsum("ij,ij->i", points[i] - points[j], combined)
        squared = neighborhoods.distance[block] ** 2 + change(height, combined)
        result[block] = np.sqrt(np.maximum(squared, 0.0))
    return result
