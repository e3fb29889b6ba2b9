"""Sheets of a surface that touch, as a hand and a hip: told apart by their normals."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ...geometry import COUNT
from ...types import Bools, Floats

_TRUSTED = 0.5  # trust of points whose normals count, as everywhere


def apart(stiffness: sparse.csr_array, normals: Floats, trust: Floats | None = None) -> tuple[sparse.csr_array, Bools]:
    """Leave out pairs of points whose normals differ by more than a right angle.

    Where sheets lie closer than the points of each, single normals are wrong, and would join both sheets.

    Parameters
    ----------
    stiffness : csr_array, (m, m)
        Without positive numbers off its diagonal.
    normals : ndarray, (m, 3)
    trust : ndarray, (m,), optional
        How reliable they are, as of `LaplaceBeltrami`.

    Returns
    -------
    stiffness : csr_array, (m, m)
        Rows sum to zero again.
    unsure : ndarray, (m,) bool
        Points that are not trusted, or would be alone or with a few others: they are no sheet, but may have normals of
        the wrong sign, and stay with that sheet which they are coupled with most.
    """
    pairs = stiffness.tocoo()
    first, second = pairs.coords
    cut = np.einsum("ij,ij->i", normals[first], normals[second]) <= 0.0
    doubt = np.zeros(len(normals), dtype=bool) if trust is None else trust < _TRUSTED
    sheet = connected_components(without(stiffness, cut | doubt[first] | doubt[second]), directed=False)[1]
    open_ = np.bincount(sheet)[sheet] < COUNT
    unsure = np.zeros(len(normals), dtype=bool)
    while True:  # from the edges of a patch of such points inwards
        beside = open_[first] & ~open_[second]
        shares = sparse.coo_array((-pairs.data[beside], (first[beside], sheet[second[beside]])), shape=stiffness.shape)
        shares.sum_duplicates()
        order = np.argsort(shares.data, kind="stable")  # the last one counts
        found = shares.coords[0][order]
        if not len(found):
            break
        sheet[found] = shares.coords[1][order]
        unsure[found], open_[found] = True, False
    cut = np.where(unsure[first] | unsure[second], sheet[first] != sheet[second], cut)
    return without(stiffness, cut), unsure


def without(stiffness: sparse.csr_array, cut: Bools) -> sparse.csr_array:
    """Return the stiffness without some pairs of points, given for each stored entry in the order of ``tocoo``."""
    pairs = stiffness.tocoo()
    first, second = pairs.coords
    kept = ~cut & (first != second)
    weights = sparse.csr_array((-pairs.data[kept], (first[kept], second[kept])), shape=stiffness.shape)
    return (sparse.diags_array(weights.sum(axis=1), format="csr") - weights).tocsr()
