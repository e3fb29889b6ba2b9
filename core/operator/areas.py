"""Area elements from the unit-integral condition of the kernel, eq. (6) of the paper."""

from __future__ import annotations

import functools

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike
from scipy.special import expit

from ..algebra import chebyshev_sum, on_all_cores
from ..geometry import ROUNDS, Boundary, Cloud, Pairs, Patch, arc_length, read_cloud
from ..kernel import kernel
from ..options import LaplacianOptions
from ..types import Bools, Floats, Report
from .curvature import kernel_integral, uneven
from .images import mirror, own_images

_FLOOR = 0.5  # least area in units of that of the Voronoi cell: all stay positive
_DEGREE = 8  # of the polynomial in the first round; half of it in the second, which corrects what the floor changed
_EVEN = 1e-9  # relative changes of h below this are rounding error
_MANY = 1 << 20  # pairs from which a product takes longer than to start threads
NO_AREA = 1e-300  # of points left out: positive, and negligible in any sum


def estimate_areas(
    points: ArrayLike,
    normals: ArrayLike | None = None,
    options: LaplacianOptions = LaplacianOptions(),
    *,
    boundary: ArrayLike | None = None,
    boundary_distance: ArrayLike | None = None,
) -> Floats:
    """Estimate the area element of every point, the operator's own, without the operator.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    normals, options, boundary, boundary_distance
        As in `build_laplacian`.

    Returns
    -------
    ndarray, (n,)
        Areas [L^2]; points at the same place share one area in equal parts, those left out have next to none.

    Raises
    ------
    PointCloudError
        The points have no sound areas; see `build_laplacian`.

    See Also
    --------
    build_laplacian : The operator, whose ``areas`` these are.

    Examples
    --------
    The area of the unit sphere is 4 pi:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> areas = mf.estimate_areas(points)
    >>> print(areas.shape, areas.sum().round(1))
    (800,) 12.6
    """
    cloud = read_cloud(points, options, normals, boundary, boundary_distance)
    areas = solve_areas(cloud, arc_length(cloud))
    scaled = cloud.scaled
    return scaled.scatter(areas * scaled.scale**2 / scaled.copies, NO_AREA)


def solve_areas(cloud: Cloud, distance: Floats, report: Report = lambda: None) -> Floats:
    """Solve for the areas of the distinct points, (m,), in scaled coordinates, all positive.

    Distances, (p,), are those of pairs along the surface. `report` is called before each product with the kernel
    matrix; it may raise `Cancelled`.
    """
    lengths = cloud.pairs.lengths
    matrix = KernelMatrix(cloud.pairs, distance, cloud.boundary, report)
    target = kernel_integral(lengths, cloud.gaussian_curvature) + _gain(matrix, lengths)
    return _like_cells(matrix, fast_areas(matrix, target, cloud.cell_areas), cloud)


def _like_cells(matrix: KernelMatrix, areas: Floats, cloud: Cloud) -> Floats:
    """Scale areas to those of the Voronoi cells, first locally, then by component, (m,).

    Where the surface is sharply curved, errors of the distances along it make the kernel's integral give too little
    area. The cells, one spacing wide where the kernel is several, set the total; the kernel sets how it is distributed
    among the points.
    """
    mean = 1.0 / (matrix @ areas)
    ratio = cloud.cell_areas / areas
    for _ in range(ROUNDS):
        ratio = mean * (matrix @ (areas * ratio))
    areas = areas * ratio
    total, found = (np.bincount(cloud.component, values) for values in (cloud.cell_areas, areas))
    last = cloud.decisions.settle("ratio", lambda: total / found)
    return areas * last[cloud.decisions.names(cloud.scaled, cloud.component)]


def _gain(matrix: KernelMatrix, lengths: Floats) -> Floats:
    """Return the increase of the integral of the kernel by variations of h along the surface, (m,).

    ``mu2 (h Laplacian(h) / 4 + |grad h|^2 / 8)``, from means over the kernel: that of f is ``f + mu2 h^2 / 4
    Laplacian(f)``.
    """
    if np.ptp(lengths) <= _EVEN * lengths.mean():
        return np.zeros(len(lengths))
    density = 1.0 / (matrix @ np.ones(len(lengths)))
    total = matrix @ density
    once, twice = ((matrix @ (density * values)) / (total * values) - 1.0 for values in (lengths, lengths**2))
    return uneven(0.5 * once + 0.25 * twice)


class KernelMatrix:
    """The symmetric matrix A of eq. (6), a_ij = W(distance_ij, h_ij), kept as half its pairs.

    Near a boundary the image of a point in it counts as a neighbor too.
    """

    def __init__(self, pairs: Pairs, distance: Floats, boundary: Boundary, report: Report = lambda: None) -> None:
        self._report = report
        own = pairs.lengths
        values = np.empty(len(distance))

        def evaluate(patch: Patch) -> None:
            lengths = patch.mean(own)
            values[patch.pairs] = kernel(distance[patch.pairs] / lengths) / lengths**2

        on_all_cores(evaluate, pairs.patches, report)
        for rows, image, factor in mirror(pairs, distance, boundary):
            lengths = 0.5 * (own[pairs.first[rows]] + own[pairs.second[rows]])
            values[rows] += factor * kernel(image / lengths) / lengths**2
        half = pairs.half(values)
        self._halves = half, half.T
        self._diagonal = kernel(0.0) / own**2
        for rows, image, factor in own_images(pairs, boundary):
            self._diagonal[rows] += factor * kernel(image / own[rows]) / own[rows] ** 2

    def __matmul__(self, values: Floats) -> Floats:
        self._report()
        if self._halves[0].nnz < _MANY:
            first, second = (half @ values for half in self._halves)
        else:
            first, second = on_all_cores(lambda half: half @ values, self._halves)
        return self._diagonal * values + first + second


def fast_areas(matrix: KernelMatrix, target: Floats, cells: Floats) -> Floats:
    """Solve A v = b by two projected rounds of polynomials in A, from the areas c of the Voronoi cells, for v > 0.

    M = V0^(1/2) A V0^(1/2) with v0 = c / (A c) has its eigenvalues in [-1, 1]; but for pairs left out between close
    sheets, images in boundaries and noise they would be positive. Each round adds p(M) times the residual to y in M y =
    V0^(1/2) b, v = V0^(1/2) y, where p(x) is close to 1 / x down to a least eigenvalue, and about zero below it: the
    smooth part is solved for, and details that the kernel does not resolve stay near the cells. In between, areas below
    the floor of c / 2 are set to it, held there, and released when the gradient points inward. A fixed number of linear
    steps, unlike conjugate gradients, does not amplify rounding: the result is the same to 1e-10 for any order of the
    points. b, (n,), is the integral that the kernel should have at each point (1 on a flat surface).
    """
    root = np.sqrt(cells / (matrix @ cells))
    right, y = root * target, cells / root
    floor = _FLOOR * y
    held = np.zeros(len(target), dtype=bool)
    for many in (_DEGREE, _DEGREE // 2):
        residual = right - root * (matrix @ (root * y))
        held &= residual < 0.0
        residual[held] = 0.0
        y = np.maximum(y + _polynomial(matrix, root, residual, held, _inverse(many)), floor)
        held = y <= floor
    return root * y


def _polynomial(matrix: KernelMatrix, root: Floats, residual: Floats, held: Bools, coefficients: Floats) -> Floats:
    """Evaluate a Chebyshev series in M on the free part of a residual."""

    def product(values: Floats) -> Floats:
        image = root * (matrix @ (root * values))
        image[held] = 0.0
        return image

    return chebyshev_sum(product, coefficients, residual)


@functools.cache
def _inverse(degree: int) -> Floats:
    """Return a Chebyshev series over [-1, 1]: 1 / x for x well above the width, about zero from there down."""
    width = 0.5 * np.pi / degree  # half the distance between its zeros there, what it separates from zero
    series: Floats = chebyshev.chebinterpolate(lambda x: expit(2.0 * x / width) * x / (x * x + width * width), degree)
    return series
