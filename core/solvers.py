"""Solves with the operator: a narrower one from the same points, and its factors."""

from dataclasses import replace

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import cg, splu

from .components import SMALLEST
from .errors import SolverError
from .laplacian import build_laplacian

NARROW = 45  # neighbours inside the support of a narrow operator: the fewest that random points bear
_STEPS = 20_000  # of conjugate gradients, at most


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


def drop_faint_pairs(stiffness, share=1e-2):
    """Leave out the pairs that hardly count, which makes factors smaller.

    Parameters
    ----------
    stiffness : csr_array, (n, n)
        Symmetric, rows sum to zero, nothing positive off the diagonal.
    share : float
        Pairs whose weight is below this share of the diagonal at both ends are left out. The kernel falls off so
        steeply that these are more than half of the pairs, with a few percent of the weight.

    Returns
    -------
    csr_array, (n, n)
        With the same properties; the given one where parts would lose their connection.
    """
    pairs, diagonal = stiffness.tocoo(), stiffness.diagonal()
    kept = -pairs.data > share * np.minimum(diagonal[pairs.row], diagonal[pairs.col])  # not the diagonal
    weights = sparse.csr_array((-pairs.data[kept], (pairs.row[kept], pairs.col[kept])), shape=stiffness.shape)
    if connected_components(weights, directed=False)[0] > connected_components(stiffness, directed=False)[0]:
        return stiffness
    return (sparse.diags_array(weights.sum(axis=1), format="csr") - weights).tocsr()


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
        Its unknowns in the order that `dissection_order` gives, or factors become large.

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
    A symmetric order without pivoting is 30 to 50 times faster here than SuperLU's defaults.
    """
    try:
        factors = splu(matrix.tocsc(), permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError as error:
        raise SolverError(
            f"The equations of {matrix.shape[0]} points have no single solution ({error}). Fix some points"
            " on every connected part."
        ) from error
    return factors.solve


def conjugate_gradients(matrix, load, start=None, rtol=1e-9, progress=None):
    """Solve symmetric equations whose diagonal holds most of them.

    Parameters
    ----------
    matrix : csr_array or LinearOperator, (m, m)
        Positive semi-definite; the diagonal of an array is the preconditioner.
    load : ndarray, (m,)
        In the range of the matrix.
    start : ndarray, (m,), optional
        First guess.
    rtol : float
        Of the residual against the load.
    progress : callable, optional
        Called as ``progress("Solve", fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (m,)

    Raises
    ------
    SolverError
        No convergence.
    """
    step = 0

    def count(_):
        nonlocal step
        step += 1
        if progress is not None and step % 20 == 0:
            progress("Solve", step / (step + 200.0))

    scaling = sparse.diags_array(1.0 / matrix.diagonal()) if sparse.issparse(matrix) else None
    solution, failed = cg(matrix, load, start, rtol=rtol, atol=0.0, maxiter=_STEPS, M=scaling, callback=count)
    if failed:
        raise SolverError(
            f"The equations of {len(load)} points were not solved in {_STEPS} steps. Fix more points, or raise"
            " the number of neighbors."
        )
    return solution
