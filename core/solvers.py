"""Solves with the operator: a narrower one from the same points, and its factors."""

from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from .components import SMALLEST
from .errors import SolverError
from .laplacian import build_laplacian

NARROW = 45  # neighbours inside the support of a narrow operator: the fewest that random points bear


def narrow_laplacian(laplacian, neighbors=NARROW):
    """Build an operator with few neighbours on the same points, to be factorised.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Its normals, rim, and the points that it takes the surface to be at are used.
    neighbors : int
        Neighbours inside the kernel's support.

    Returns
    -------
    LaplaceBeltrami
        Less accurate for functions, but it ends sharply at fixed points, and its factors are small.
    """
    options = replace(
        laplacian.options,
        bandwidth="local",
        neighbors=neighbors,
        bandwidth_factor=1.0 / 3.0,  # the support of 3 h ends at the last neighbour
        projection="off",
    )
    return build_laplacian(laplacian.surface_points, laplacian.normals, options, laplacian.boundary)


def coupled_parts(laplacian):
    """Number the parts of the cloud between which the operator couples no points, (n,) int.

    Parts of fewer than 50 points are -1: points left out, and single ones within a connected part that are so far off
    its surface that they lost all neighbours.
    """
    count, label = connected_components(laplacian.stiffness, directed=False)
    large = np.bincount(label, minlength=count) >= SMALLEST
    return np.where(large, np.cumsum(large) - 1, -1)[label]


def mean_spacing(laplacian):
    """Return the distance between the points of an even sample as dense as the neighbours of each, (n,) [L]."""
    stiffness = laplacian.stiffness
    neighbors = sparse.csr_array((np.ones(stiffness.nnz), stiffness.indices, stiffness.indptr), shape=stiffness.shape)
    return np.sqrt(neighbors @ laplacian.areas / np.maximum(neighbors.sum(axis=1), 1.0))


def factorize(matrix):
    """Factorise a sparse symmetric positive definite matrix.

    Parameters
    ----------
    matrix : sparse array, (m, m)

    Returns
    -------
    callable
        Solves for a right-hand side, (m,) or (m, k).

    Raises
    ------
    SolverError
        The matrix is singular: some part of the surface has nothing that holds it.

    Notes
    -----
    A symmetric order of minimum degree without pivoting is 30 to 50 times faster here than SuperLU's defaults.
    """
    try:
        factors = splu(
            matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError as error:
        raise SolverError(
            f"The equations of {matrix.shape[0]} points have no single solution ({error}). Fix some points on every"
            " connected part."
        ) from error
    return factors.solve
