"""Surface variation: how far the neighborhood of a point is from a plane, by the covariance of its points."""

import numpy as np
from scipy import sparse

from ..linalg import eigvalsh
from ..operator import LaplaceBeltrami
from ..types import Floats


def surface_variation(laplacian: LaplaceBeltrami) -> Floats:
    """Measure how far the points around each are from a plane: edges, corners and noise are large, flat parts small.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        The neighborhood of a point is what it couples the point with: the support of the kernel, on one sheet. Points
        count by their areas, so that the sampling does not matter.

    Returns
    -------
    ndarray, (n,)
        Smallest eigenvalue of the covariance of the neighborhood over the sum of all three: 0 in a plane, 1/3 where
        the neighbors scatter alike in all directions. On a sphere it grows with the square of the kernel's width over
        the radius; it does not change with the scale. 0 at points left out.

    See Also
    --------
    principal_curvatures : How the surface curves, independent of the size of the neighborhood.
    clean.roughness : Height of points above the smoothed surface, as a length.

    References
    ----------
    Pauly, Gross, Kobbelt. Efficient simplification of point-sampled surfaces. 2002.

    Examples
    --------
    A flat ellipsoid is farthest from planes at its equator:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> variation = mf.measure.surface_variation(mf.build_laplacian(points * [1.0, 1.0, 0.3]))
    >>> equator = np.abs(points[:, 2]) < 0.1
    >>> print(variation[equator].min() > variation[~equator].mean())
    True
    """
    points, couples = laplacian.surface_points, laplacian.stiffness.astype(bool).astype(np.float64)
    neighbors = (couples + sparse.eye_array(len(points))).astype(bool) @ sparse.diags_array(laplacian.areas)
    centered = points - points.mean(axis=0)
    mass = neighbors.sum(axis=1)[:, None]
    mean = neighbors @ centered / mass
    products = np.einsum("ni,nj->nij", centered, centered).reshape(-1, 9)
    covariance = (neighbors @ products / mass).reshape(-1, 3, 3) - np.einsum("ni,nj->nij", mean, mean)
    spread = eigvalsh(covariance)
    result: Floats = np.clip(spread[:, 0], 0.0, None) / np.maximum(spread.sum(axis=1), 1e-300)
    return np.where(laplacian.component < 0, 0.0, result)
