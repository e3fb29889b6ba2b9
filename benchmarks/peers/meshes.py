"""Peers on triangles: the true ones of a mesh, or local ones that are made from the points."""

import numpy as np
from scipy import sparse
from scipy.spatial import ConvexHull

from .operator import Operator


def sphere_triangles(points):
    """Return the triangles of points on a sphere, or on another convex surface, (m, 3): those of their hull."""
    return ConvexHull(points).simplices


def cotangent_weights(points, triangles):
    """Compute the cotangent stiffness (Pinkall, Polthier 1993) and a third of the areas of the triangles at each point.

    Returns
    -------
    stiffness : csr_array, (n, n)
    areas : ndarray, (n,)
    """
    n = len(points)
    weights = sparse.csr_array((n, n))
    for corner in range(3):
        apex, i, j = np.roll(triangles, corner, axis=1).T
        a, b = points[i] - points[apex], points[j] - points[apex]
        twice = np.linalg.norm(np.cross(a, b), axis=1)
        cotangent = np.einsum("ij,ij->i", a, b) / twice
        weights += sparse.csr_array((0.5 * cotangent, (i, j)), shape=(n, n))
    weights += weights.T
    areas = np.bincount(triangles.ravel(), np.repeat(twice / 6.0, 3), n)
    return without_row_sums(weights), areas


def without_row_sums(weights):
    """Return the stiffness of symmetric pair weights."""
    return (sparse.diags_array(weights.sum(axis=1)) - weights).tocsr()


def cotangent(points, triangles):
    """The paper's COT: cotangent weights over a third of the areas of the triangles at each point.

    As a generalised problem, which has the eigenvalues of the symmetric form D^(-1/2) K D^(-1/2) of Vallet, Levy 2008.
    """
    stiffness, areas = cotangent_weights(points, triangles)
    return Operator(points, stiffness, areas, areas)


def levy(points, triangles):
    """The paper's symmetric COT, after Levy 2006: the mean of ``L = areas^-1 K`` and its transpose.

    The paper names the reference, but no formula. The diagonal is taken anew so that rows sum to zero: with the mean of
    the diagonals too, constants are not in the null space and on random points half of the lowest eigenvalues are
    negative. Where the areas vary it is no longer the Laplace-Beltrami operator: each pair has the mean of 1 / areas at
    its ends, every point the mass one, which is the Laplacian of the surface weighted by the density of the points, in
    apply as well as in the spectrum. (The other symmetric form in use, D^(-1/2) K D^(-1/2), has the eigenvalues and
    solutions of `cotangent`.)
    """
    stiffness, areas = cotangent_weights(points, triangles)
    rows = sparse.diags_array(stiffness.diagonal()) - stiffness
    rows = sparse.diags_array(1.0 / areas) @ rows
    return Operator(points, without_row_sums(0.5 * (rows + rows.T)), np.ones(len(areas)), areas)


def robust(points, neighbors=30):
    """Sharp, Crane 2020, by robust_laplacian's own way from points; 30 neighbours are its default."""
    import robust_laplacian

    stiffness, mass = robust_laplacian.point_cloud_laplacian(points, n_neighbors=neighbors)
    return Operator(points, sparse.csr_array(stiffness), mass.diagonal(), mass.diagonal())


def tufted(points):
    """The same tufted cover on potpourri3d's local triangles, of which there are three layers.

    robust_laplacian's own triangles lose area on dense clouds; these do not, so that this is the fairer row.
    """
    import potpourri3d
    import robust_laplacian

    triangles = potpourri3d.PointCloudLocalTriangulation(points).get_local_triangulation()
    triangles = triangles[triangles[:, :, 0] >= 0].astype(np.int64)
    stiffness, mass = robust_laplacian.mesh_laplacian(points, triangles)
    areas = mass.diagonal() / 3.0
    return Operator(points, sparse.csr_array(stiffness) / 3.0, areas, areas)
