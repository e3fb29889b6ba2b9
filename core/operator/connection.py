"""The connection Laplacian: the operator on tangent vectors, each a complex number in the frame of its point."""

import numpy as np
from scipy import sparse


def tangent_frames(normals):
    """Give each tangent plane a frame, so that a complex number is a tangent vector.

    Parameters
    ----------
    normals : ndarray, (n, 3)
        Unit normals.

    Returns
    -------
    ndarray, (n, 3) complex
        First axis plus i times the second one; the two and the normal are orthonormal and right-handed. The vector
        ``v`` has the number ``v @ frame`` of its point, and the number c is the vector ``(conj(c) * frame).real``.
    """
    axis = np.zeros_like(normals)
    axis[np.arange(len(normals)), np.abs(normals).argmin(axis=1)] = 1.0  # the one that lies most in the plane
    first = axis - np.einsum("ij,ij->i", axis, normals)[:, None] * normals
    first /= np.linalg.norm(first, axis=1)[:, None]
    return first + 1j * np.cross(normals, first)


def connection_laplacian(stiffness, normals, frames):
    """Build the operator on tangent vectors from the one on functions.

    Parameters
    ----------
    stiffness : csr_array, (n, n)
        Symmetric, rows sum to zero, nothing positive off the diagonal.
    normals : ndarray, (n, 3)
        Unit normals.
    frames : ndarray, (n, 3) complex
        As `tangent_frames` gives them.

    Returns
    -------
    csr_array, (n, n) complex
        Hermitian positive semi-definite: ``x* K x`` is the sum over pairs of ``w |x_i - r_ij x_j|^2``, where r_ij is
        the smallest rotation that turns the tangent plane of j into that of i. Where all frames are parallel it is the
        stiffness itself. Pairs whose normals point to opposite sides have no such rotation, and are left out.

    References
    ----------
    Sharp, Soliman, Crane. The Vector Heat Method. 2019.
    """
    pairs = sparse.triu(stiffness, k=1).tocoo()
    first, second = pairs.row, pairs.col
    cosine = np.einsum("ij,ij->i", normals[first], normals[second])
    kept = cosine > 0.0
    first, second, weight = first[kept], second[kept], -pairs.data[kept]
    # The smallest rotation takes a vector v at right angles to a to v - (v . b) / (1 + a . b) (a + b).
    across = np.einsum("ij,ij->i", frames[second].real, normals[first]) / (1.0 + cosine[kept])
    turned = frames[second].real - across[:, None] * (normals[first] + normals[second])
    turn = np.einsum("ij,ij->i", turned, frames[first])
    turn /= np.abs(turn)
    half = sparse.coo_array((-weight * turn, (first, second)), shape=stiffness.shape).tocsr()
    diagonal = np.bincount(first, weight, len(normals)) + np.bincount(second, weight, len(normals))
    return (sparse.diags_array(diagonal.astype(complex), format="csr") + half + half.conj().T).tocsr()
