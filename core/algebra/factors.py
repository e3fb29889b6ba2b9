"""What keeps the factors of sparse equations on a surface small: fewer pairs, and an order by nested dissection."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..linalg import eigh
from ..types import Floats, Ints, Report

_LEAF = 120  # points that are divided no further
_SHARES = (0.4, 0.45, 0.5, 0.55, 0.6)  # of the points on one side, from which the best cut is chosen


def dissect(matrix: sparse.sparray, points: Floats, report: Report = lambda: None) -> tuple[Ints, Ints]:
    """Order the unknowns of sparse equations so that their factors stay small.

    Every set of points is cut across its longest axis. The points at the cut that couple both sides come after these,
    so that nothing fills in between the sides (George, 1973).

    Parameters
    ----------
    matrix : sparse array, (m, m)
        Symmetric.
    points : ndarray, (m, 3)
        Where the unknowns are.
    report : callable
        Called before each level of cuts; may raise `Cancelled`.

    Returns
    -------
    order : ndarray, (m,) int
        The unknowns in their order.
    starts : ndarray, (k,) int
        Where in that order the parts begin: sets that are divided no further, and cuts.
    """
    count = len(points)
    pairs = sparse.triu(matrix, k=1).tocoo()
    first, second = pairs.row, pairs.col
    part, open_, place = np.zeros(count, dtype=int), np.ones(count, dtype=bool), np.zeros(count, dtype=np.int64)
    while True:
        report()
        rows = np.flatnonzero(open_)
        own = part[rows]
        size = np.bincount(own)
        if not len(rows) or size.max() <= _LEAF:
            # In each part along its longest axis: what is coupled with it are few stretches of others.
            part = np.unique(place, return_inverse=True)[1].reshape(-1)
            order = np.lexsort((_ranks_along(points, part, np.bincount(part)), part))
            return order, np.flatnonzero(np.diff(part[order], prepend=-1))
        # How far along its part each point is, as a share; of parts that are divided no further no share is reached.
        along = np.zeros(count)
        along[rows] = np.where(size[own] > _LEAF, _ranks_along(points[rows], own, size) / size[own], 0.0)
        least = np.full(len(size), np.inf)
        side, cut = np.zeros(count, dtype=np.int8), np.zeros(count, dtype=bool)
        ends = along[first], along[second]
        cuttable = (np.maximum(*ends) >= _SHARES[0]) & (np.minimum(*ends) < _SHARES[-1])
        left, right = first[cuttable], second[cuttable]
        for share in _SHARES:
            beyond = along >= share
            crossing = beyond[left] != beyond[right]
            one, other = left[crossing], right[crossing]
            swapped = beyond[one]
            for end in (np.where(swapped, other, one), np.where(swapped, one, other)):
                border = np.zeros(count, dtype=bool)
                border[end] = True
                length = np.bincount(own, border[rows], minlength=len(size))
                better = length < least
                least[better] = length[better]
                chosen = rows[better[own]]
                side[chosen], cut[chosen] = beyond[chosen], border[chosen]
        # One digit for each level, the highest first: near side, far side, cut; a cut is followed by zeros.
        place = 3 * place + np.where(open_, np.where(cut, 2, side), 0)
        open_ &= ~cut
        kept = open_[first] & open_[second] & (side[first] == side[second])
        first, second = first[kept], second[kept]
        part = 2 * part + side
        part[open_] = np.unique(part[open_], return_inverse=True)[1].reshape(-1)


def _ranks_along(points: Floats, part: Ints, size: Ints) -> Ints:
    """Rank the points of each part along its longest axis, from 0."""
    mean = np.stack([np.bincount(part, values) for values in points.T], axis=1) / size[:, None]
    offset = points - mean[part]
    products = np.stack([np.bincount(part, offset[:, a] * offset[:, b]) for a in range(3) for b in range(3)], axis=1)
    axis = eigh(products.reshape(-1, 3, 3))[1][:, :, -1]
    along = np.einsum("ij,ij->i", offset, axis[part])
    order = np.lexsort((along, part))
    rank = np.empty(len(part), dtype=int)
    rank[order] = np.arange(len(part))
    return rank - (np.cumsum(size) - size)[part]


def sparsify(stiffness: sparse.csr_array, share: float = 1e-2) -> sparse.csr_array:
    """Leave out the pairs of negligible weight, which makes factors smaller.

    Their weight is below a share of the diagonal at both ends. The kernel falls off so steeply that these are more than
    half of the pairs, with a few percent of the weight. Rows of the stiffness sum to zero, and nothing is positive off
    the diagonal, before and after. The given matrix is returned where components would lose their connection.
    """
    pairs, diagonal = stiffness.tocoo(), stiffness.diagonal()
    kept = -pairs.data > share * np.minimum(diagonal[pairs.row], diagonal[pairs.col])  # not the diagonal
    weights = sparse.csr_array((-pairs.data[kept], (pairs.row[kept], pairs.col[kept])), shape=stiffness.shape)
    if connected_components(weights, directed=False)[0] > connected_components(stiffness, directed=False)[0]:
        return stiffness
    return (sparse.diags_array(weights.sum(axis=1), format="csr") - weights).tocsr()
