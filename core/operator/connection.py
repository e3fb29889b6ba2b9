"""The connection Laplacian: the operator on tangent vectors, each a complex number in the frame of its point."""

import numpy as np
from scipy import sparse

from ..algebra import blocks, on_all_cores
from ..geometry import lengthened
from ..types import Array, Floats, Report

_BLOCK = 1 << 15  # pairs worked on at one time, so that they stay in the cache


def tangent_frames(normals: Floats) -> Array:
    """Give each tangent plane a frame, (n, 3) complex, so that a complex number is a tangent vector.

    It is the first axis plus i times the second one; the two and the unit normal, (n, 3), are orthonormal and
    right-handed. The vector ``v`` has the number ``v @ frame`` of its point, and the number c is the vector ``(conj(c)
    * frame).real``.
    """
    axis = np.zeros_like(normals)
    axis[np.arange(len(normals)), np.abs(normals).argmin(axis=1)] = 1.0  # the one that lies most in the plane
    first = axis - np.einsum("ij,ij->i", axis, normals)[:, None] * normals
    first /= np.linalg.norm(first, axis=1)[:, None]
    return first + 1j * np.cross(normals, first)


def connection_laplacian(
    stiffness: sparse.csr_array,
    normals: Floats,
    frames: Array,
    mass: Floats | float = 0.0,
    report: Report = lambda: None,
) -> sparse.csr_array:
    """Build the operator on tangent vectors from the one on functions.

    Parameters
    ----------
    stiffness : csr_array, (n, n)
        Symmetric, rows sum to zero, nothing positive off the diagonal.
    normals : ndarray, (n, 3)
        Unit normals.
    frames : ndarray, (n, 3) complex
        As `tangent_frames` gives them.
    mass : float or ndarray, (n,)
        Added to the diagonal.
    report : callable
        Called after each block of pairs; may raise `Cancelled`.

    Returns
    -------
    csr_array, (n, n) complex
        Hermitian positive semi-definite: without a mass, ``x* K x`` is the sum over pairs of
        ``w |x_i - r_ij x_j|^2``, where r_ij is the smallest rotation from the tangent plane of j to that of i.
        Where all frames are parallel it is the stiffness itself. Pairs whose normals point to opposite sides have no
        such rotation, and are left out.

    References
    ----------
    Sharp, Soliman, Crane. The Vector Heat Method. 2019.
    """
    count = len(normals)
    first = np.repeat(np.arange(count, dtype=np.int32), np.diff(stiffness.indptr))
    once = first < stiffness.indices
    first, second, weight = first[once], stiffness.indices[once], -stiffness.data[once]
    entries = np.empty(len(first), dtype=complex)
    normal, real, imaginary = (np.ascontiguousarray(values.T) for values in (normals, frames.real, frames.imag))

    def measure(block: slice) -> None:
        i, j = first[block], second[block]
        left, right, axis = normal.take(i, axis=1), normal.take(j, axis=1), real.take(j, axis=1)
        cosine = _dot(left, right)
        # The smallest rotation takes a vector v at right angles to a to v - (v . b) / (1 + a . b) (a + b).
        across = _dot(axis, left) / np.where(cosine > 0.0, 1.0 + cosine, 1.0)
        axis -= across * right  # the frame has no component along the other normal
        x, y = _dot(axis, real.take(i, axis=1)), _dot(axis, imaginary.take(i, axis=1))
        entries[block].real, entries[block].imag = lengthened(x, y, np.where(cosine > 0.0, -weight[block], 0.0))

    on_all_cores(measure, blocks(len(first), _BLOCK), report)
    kept = np.flatnonzero(entries)
    first, second, entries = first[kept], second[kept], entries[kept]
    start = np.concatenate([[0], np.cumsum(np.bincount(first, minlength=count))]).astype(np.int32)
    half = sparse.csr_array((entries, second, start), shape=(count, count))
    report()
    size = np.abs(entries)
    diagonal = mass + np.bincount(first, size, count) + np.bincount(second, size, count)
    half = (half + sparse.diags_array(0.5 * diagonal.astype(complex), format="csr")).tocsr()
    report()
    other = half.conj().T.tocsr()
    report()
    return half + other


def _dot(left: Floats, right: Floats) -> Floats:
    """Return the dot products of vectors, both (3, k)."""
    return np.einsum("ak,ak->k", left, right)
