"""The paper's operator: eq. (5), and eq. (10), which makes it symmetric."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from ..algebra import on_all_cores
from ..arguments import check_points
from ..geometry import Cloud, Pairs, Patch, pair_heights, read_cloud, toward
from ..kernel import pair_kernel
from ..memory import check_memory
from ..operator import KernelMatrix, LaplaceBeltrami, Stiffness, laplacian_of, stiffness_matrix
from ..options import PaperOptions
from ..progress import ends_at_one
from ..types import Floats, Progress
from .areas import AREAS
from .normals import covariance_normals, tangent_planes


@ends_at_one
def build_laplacian(
    points: ArrayLike,
    *,
    areas: str = "constrained",
    normals: str | ArrayLike = "wpca",
    regularization: float = 1e-3,
    neighbors: int = 100,
    denoise: bool = False,
    left_out: ArrayLike = (),
    progress: Progress | None = None,
) -> LaplaceBeltrami:
    """Build the paper's operator: one smoothing length, no boundary, none of the corrections of the default.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    areas : {"constrained", "regularized", "uniform"}
        Area elements by eq. (8), by eq. (7), or the mean of those of eq. (7) for every point.
    normals : {"wpca", "pca"} or array_like, (n, 3)
        From the covariance of eq. (9), its neighbors weighted by the kernel or all alike; or normals to use as they
        are, of any length and sign.
    regularization : float
        rho of eqs. (7) and (8), in coordinates scaled to a root mean square radius of one.
    neighbors : int
        h is the mean distance to this neighbor; the radius of the kernel is 3 h, for some nine times as many.
    denoise : bool
        Project every point onto the plane through its neighbors first, as section 6 does for noisy points.
    left_out : array_like, (k,) int or (n,) bool, optional
        Points to leave out.
    progress : callable, optional
        Called as ``progress(stage, fraction)`` in each stage; may raise `Cancelled`.

    Returns
    -------
    LaplaceBeltrami
        Its `apply` and `eigenpairs`, eqs. (11) and (12), make no symbol correction. Normals take the side that those of
        local quadrics have.

    Raises
    ------
    AreaError
        Eq. (7), which has no bound, gave areas that are not positive.
    PointCloudError
        A setting out of range, or points without a sound answer, as of the default operator.

    See Also
    --------
    build_laplacian : The default, for scans.
    check_stability : Measures what Theorem 1 of the paper assumes.

    References
    ----------
    Petronetto, Paiva, Helou, Stewart, Nonato. Mesh-free discrete Laplace-Beltrami operator. 2013.

    Examples
    --------
    The total is the area of the unit sphere, 4 pi:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> print(mf.paper.build_laplacian(points).areas.sum().round(2))
    12.57
    """
    report = progress or (lambda stage, fraction: None)
    given = None if isinstance(normals, str) else normals
    options = PaperOptions(
        areas=areas,
        normals=normals if isinstance(normals, str) else "wpca",
        regularization=regularization,
        neighbors=neighbors,
        denoise=denoise,
    )
    checked = check_points(points)
    check_memory(len(checked), options.cloud)
    places = tangent_planes(checked) if denoise else checked
    cloud = read_cloud(places, options.cloud, given, progress=report, left_out=left_out)
    pairs, scaled = cloud.pairs, cloud.scaled
    if given is None:
        own = covariance_normals(pairs, weighted=options.normals == "wpca")
        cloud = replace(cloud, normals=toward(own, cloud.normals))

    report("Areas", 0.5)
    matrix = KernelMatrix(pairs, pairs.distance, cloud.boundary, lambda: report("Areas", 0.6))
    solution = AREAS[options.areas](matrix, np.ones(len(pairs.points)), options.regularization)
    if solution.residual:
        cloud.notices.append(
            f"The areas were not found in {solution.products} steps: a share of {solution.residual:.1g} of their"
            " equations is left, and they may be far off. Raise the regularization."
        )

    report("Operator", 0.8)
    cloud = replace(cloud, moved=(places - checked)[scaled.first] / scaled.scale)
    return laplacian_of(checked, cloud, solution.areas, symmetrized_operator(cloud, solution.areas), options.cloud)


def symmetrized_operator(cloud: Cloud, areas: Floats) -> Stiffness:
    """Assemble ``-D G D`` of eq. (10): a pair is projected on one plane, that of its mean normal.

    There are no images in boundaries, and no widths for the symbol correction. Areas, (m,), are in scaled coordinates.
    """
    pairs, count = cloud.pairs, len(cloud.scaled.inverse)
    h = pairs.mean(pairs.lengths)
    weights = pair_kernel(projected_distance(pairs, cloud.normals) / h) / h**4
    weights *= areas[pairs.first] * areas[pairs.second]
    own = pair_kernel(0.0) / pairs.lengths**4 * areas**2
    none = np.zeros(len(areas))
    matrix = stiffness_matrix(cloud.scaled, pairs, weights, own)
    return Stiffness(matrix, sparse.csr_array((count, count)), none, none)


def projected_distance(pairs: Pairs, normals: Floats) -> Floats:
    """Return the length of each pair's difference in the plane orthogonal to its mean normal, eq. (10).

    Parameters
    ----------
    pairs : Pairs
        With p pairs.
    normals : ndarray, (m, 3)
        Unit normals. The second is flipped to the first one's side, pair by pair: signs do not matter.

    Returns
    -------
    ndarray, (p,)
    """
    result = np.empty(len(pairs.first))
    points, normals = pairs.points.T.copy(), normals.T.copy()

    def measure(patch: Patch) -> None:
        _, left, right, cosine = pair_heights(patch.first, patch.second, points, normals)
        side = np.where(cosine < 0.0, -1.0, 1.0)
        # The mean of two unit normals has the squared length (1 + cos) / 2.
        height = (left + side * right) ** 2 / (2.0 + 2.0 * np.abs(cosine))
        result[patch.pairs] = np.sqrt(np.maximum(pairs.distance[patch.pairs] ** 2 - height, 0.0))

    on_all_cores(measure, pairs.patches)
    return result
