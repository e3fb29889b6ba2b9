"""Sheets of a surface that touch, as a hand and a hip: told apart by their normals."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ...geometry import COUNT
from ...types import Bools, Floats


def apart(stiffness: sparse.csr_array, normals: Floats) -> tuple[sparse.csr_array, Bools]:
    """Leave out pairs of points whose normals differ by more than a right angle.

    Parameters
    ----------
    stiffness : csr_array, (m, m)
        Without positive numbers off its diagonal.
    normals : ndarray, (m, 3)

    Returns
    -------
    stiffness : csr_array, (m, m)
        Rows sum to zero again.
    reversed : ndarray, (m,) bool
        Points that this would leave alone, or with a few others: they are no sheet but have normals of the wrong sign,
        and stay with that sheet which they are coupled with most.
    """
    pairs = stiffness.tocoo()
    first, second = pairs.coords
    along = np.einsum("ij,ij->i", normals[first], normals[second]) > 0.0
    sheet = connected_components(without(stiffness, ~along), directed=False)[1]
    few = np.bincount(sheet)[sheet] < COUNT
    beside = few[first] & ~few[second]
    shares = sparse.coo_array((-pairs.data[beside], (first[beside], sheet[second[beside]])), shape=stiffness.shape)
    shares.sum_duplicates()
    order = np.argsort(shares.data, kind="stable")  # the last one counts
    lone = shares.coords[0][order]
    sheet[lone] = shares.coords[1][order]
    reversed_ = np.zeros(len(normals), dtype=bool)
    reversed_[lone] = True
    loose = reversed_[first] | reversed_[second]
    return without(stiffness, np.where(loose, sheet[first] != sheet[second], ~along)), reversed_


def without(stiffness: sparse.csr_array, cut: Bools) -> sparse.csr_array:
    """Return the stiffness without some pairs of points, given for each stored entry in the order of ``tocoo``."""
    pairs = stiffness.tocoo()
    first, second = pairs.coords
    kept = ~cut & (first != second)
    weights = sparse.csr_array((-pairs.data[kept], (first[kept], second[kept])), shape=stiffness.shape)
    return (sparse.diags_array(weights.sum(axis=1), format="csr") - weights).tocsr()
