"""The paper's operator before it is made symmetric, eq. (5)."""

import numpy as np
from scipy import sparse

from core.kernel import pair_kernel


def unsymmetrized_operator(pairs, normals, areas):
    """Assemble the operator of eq. (5): each row projects its neighbors on its own tangent plane.

    Parameters
    ----------
    pairs : Pairs
        Of m distinct points.
    normals : ndarray, (m, 3)
        Unit normals.
    areas : ndarray, (m,)
        Area elements in scaled coordinates.

    Returns
    -------
    csr_array, (m, m)
        L in scaled coordinates: rows sum to zero, not symmetric for any inner product in general.
    """
    row = np.concatenate([pairs.first, pairs.second])
    column = np.concatenate([pairs.second, pairs.first])
    distance, lengths = np.tile(pairs.distance, 2), np.tile(pairs.mean(pairs.lengths), 2)
    difference = pairs.points[row] - pairs.points[column]
    height = np.einsum("ij,ij->i", difference, normals[row])
    projected = np.sqrt(np.maximum(distance**2 - height**2, 0.0))
    weights = pair_kernel(projected / lengths) / lengths**4 * areas[column]
    count = len(areas)
    matrix = sparse.csr_array((weights, (row, column)), shape=(count, count))
    return (matrix - sparse.diags_array(matrix.sum(axis=1), format="csr")).tocsr()
