"""Functions on the surface that solve Poisson's or Laplace's equation, with or without fixed values."""

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.spatial import cKDTree

from ..algebra import solve_symmetric
from ..arguments import as_array, as_doubles, check_array, check_finite
from ..cores import cores
from ..errors import InvalidPointsError, PointCloudError
from ..geometry import as_mask
from ..kernel import SECOND_MOMENT
from ..operator import LaplaceBeltrami, coupled_components, mean_spacing, narrow_laplacian
from ..progress import ends_at_one
from ..types import Bools, Floats, Ints, Progress

_MEAN = 1e-2  # of the source's mean size: a larger mean is intended, a smaller one is an error of the quadrature
_DEEP = 0.6  # share of a point's weights that lead to fixed points, where it lies deep inside a set of them
_NARROW = 60  # neighbors of the narrow operator: fewer are too noisy at random points, more leak more
# Distances from thin sets, in units of h, between which the narrow operator is blended into the wide one.
_NEAR = 1.5, 3.0
_LEAST = 2e-3  # share of the wide operator everywhere: it connects what the narrow one does not
_GRAZING = 0.1  # least distance from the edge of a set of fixed points, in spacings


@ends_at_one
def solve_poisson(
    laplacian: LaplaceBeltrami,
    source: ArrayLike,
    fixed: ArrayLike | None = None,
    fixed_values: ArrayLike | None = None,
    *,
    progress: Progress | None = None,
) -> Floats:
    """Solve -Delta u = source.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points; at boundaries without fixed points nothing flows across.
    source : array_like, (n,)
        A function on the points [unit of u / L^2]; one number stands for a constant one.
    fixed : array_like, (k,) int or (n,) bool, optional
        Points with known values. Fixing the points of a whole boundary gives the values there.
    fixed_values : array_like, (k,), optional
        Their values, in the order of the indices; one number serves all.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n,)
        u. On components without fixed points the source's mean must vanish, and u has the mean of all fixed
        values there, zero if there are none. Points that were left out have that value too, unless they are fixed.

    Raises
    ------
    InvalidPointsError
        Source, points or values of another shape, not finite, or two values for one point.
    PointCloudError
        The source's mean does not vanish where nothing is fixed.
    SolverError
        The solver did not converge.

    See Also
    --------
    harmonic_field : Without a source.
    LaplaceBeltrami.apply : The operator itself.

    Notes
    -----
    Without fixed points the solution is corrected for the kernel's width: of ``lambda = k^2 - mu2 h^2 k^4 / 8`` the
    inverse is ``1 / k^2 + mu2 h^2 / 8``, so that ``mu2 h^2 / 8`` times the source is subtracted.

    A set of fixed points may be any band, line, or single points. Values past the edge of a band continue those before
    it linearly (as in Morris, Fox, Zhu, 1997), which makes weights across the edge larger: none becomes negative, so
    that the maximum principle holds. Near sets thinner than the kernel, one of more than 60 neighbors is
    blended with a narrow one.

    References
    ----------
    Figures 8 and 15 of the paper.

    Examples
    --------
    On the unit sphere -Delta z = 2 z:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> z = points[:, 2]
    >>> laplacian = mf.build_laplacian(points)
    >>> solution = mf.distance.solve_poisson(laplacian, 2 * z)
    >>> print(np.abs(solution - z).max().round(2))
    0.0
    """
    count = len(laplacian.points)
    report = progress or (lambda stage, fraction: None)
    source = _read_source(source, count)
    index, values = read_values(fixed, fixed_values, count)
    report("Equations", 0.0)
    component = coupled_components(laplacian)
    known = component >= 0
    is_fixed = np.zeros(count, dtype=bool)
    is_fixed[index] = True
    held = np.zeros(component.max() + 1, dtype=bool)
    held[component[known & is_fixed]] = True
    loose = np.flatnonzero(known)[~held[component[known]]]  # points of components without any fixed point
    source = _without_mean(laplacian.areas, source, component, loose)

    result = np.full(count, values.mean() if len(values) else 0.0)
    level = result[0]
    result[index] = values
    inside = known & is_fixed
    free = np.flatnonzero(known & ~is_fixed)
    if not len(free):
        return result
    free = free[cKDTree(laplacian.points[free]).indices]  # neighbors near in memory make the products faster
    load = laplacian.areas[free] * source[free]
    if inside.any():
        matrix, pull = _with_fixed_points(laplacian, inside, np.where(is_fixed, result, 0.0), free, report)
        load += pull
    else:
        matrix = laplacian.stiffness[free][:, free]
    report("Equations", 0.5)
    result[free] = solve_symmetric(matrix, load, result[free], report)
    result[loose] -= SECOND_MOMENT / 8.0 * laplacian.kernel_widths[loose] ** 2 * source[loose]
    result[loose] += level - _means(laplacian.areas, result, component, loose)
    return result


@ends_at_one
def harmonic_field(
    laplacian: LaplaceBeltrami, fixed: ArrayLike, fixed_values: ArrayLike, *, progress: Progress | None = None
) -> Floats:
    """Spread fixed values smoothly over the surface: Delta f = 0.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    fixed : array_like, (k,) int or (n,) bool
        Points with known values, at least one.
    fixed_values : array_like, (k,)
        Their values, in the order of the indices; one number serves all.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n,)
        f, nowhere outside the range of the fixed values. Components without fixed points, and points that were
        left out, have the mean of the fixed values.

    Raises
    ------
    InvalidPointsError
        No fixed points, points or values of another shape, not finite, or two values for one point.
    SolverError
        The solver did not converge.

    See Also
    --------
    solve_poisson : With a source.
    geodesic_distance : Distances from points.

    References
    ----------
    Figure 15 of the paper.

    Examples
    --------
    One at a pole and minus one at the other gives zero at the equator:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> field = mf.distance.harmonic_field(laplacian, [0, 799], [1, -1])
    >>> print(field[[0, 400, 799]].round(1))
    [ 1.  0. -1.]
    """
    index, values = read_values(fixed, fixed_values, len(laplacian.points))
    if not len(index):
        raise InvalidPointsError("No points are fixed, so the field is not determined. Fix at least one point.")
    result = solve_poisson(laplacian, 0.0, index, values, progress=progress)
    return np.clip(result, values.min(), values.max())  # only rounding lies outside


def read_values(fixed: ArrayLike | None, values: ArrayLike | None, count: int) -> tuple[Ints, Floats]:
    """Return fixed points as indices (k,) and their values (k,).

    Another shape, numbers that are not finite, or two values for one point raise `InvalidPointsError`.
    """
    if fixed is None:
        fixed = np.zeros(0, dtype=int)
    mask = as_mask(fixed, count)
    index = as_array(fixed, "Fixed points")
    if index.dtype == bool and index.shape == (count,):
        index = np.flatnonzero(mask)
    index = index.astype(np.intp).ravel() % count
    advice = f"Give one number for each of {len(index)} fixed points."
    given = check_array(() if values is None else values, "Fixed values", [(), (len(index),)], advice, "biuf")
    given = np.broadcast_to(as_doubles(given).ravel(), len(index))
    check_finite(given, "fixed values", "Replace them.")
    index, first, row = np.unique(index, return_index=True, return_inverse=True)
    torn = np.count_nonzero(given != given[first][row])
    if torn:
        raise InvalidPointsError(f"{torn} fixed points have two different values. Give each point one value.")
    return index, given[first]


def _read_source(source: ArrayLike, count: int) -> Floats:
    """Return the values of the source, (n,)."""
    given = check_array(source, "Sources", [(), (count,)], f"Give one number for each of {count} points.", "biuf")
    given = np.broadcast_to(as_doubles(given), count)
    check_finite(given, "values of the source", "Replace them.")
    return given


def _means(areas: Floats, values: Floats, component: Ints, rows: Ints) -> Floats:
    """Return the area-weighted mean of values (n,) over the component of each of some rows, (k,)."""
    component, areas = component[rows], areas[rows]
    total = np.bincount(component, areas)
    return (np.bincount(component, areas * values[rows]) / np.where(total > 0.0, total, 1.0))[component]


def _without_mean(areas: Floats, source: Floats, component: Ints, rows: Ints) -> Floats:
    """Subtract the mean of the source on components without fixed points, or raise if it is not small."""
    mean, size = (_means(areas, values, component, rows) for values in (source, np.abs(source)))
    wrong = np.flatnonzero(np.abs(mean) > _MEAN * size)
    if len(wrong):
        raise PointCloudError(
            f"The source has the mean {mean[wrong[0]]:.3g} over a component of"
            f" {np.count_nonzero(component == component[rows[wrong[0]]])} points where nothing is fixed: only sources"
            " of mean zero have a solution there. Subtract the area-weighted mean of each component, or fix a point."
        )
    result = source.copy()
    result[rows] -= mean
    return result


def _with_fixed_points(
    laplacian: LaplaceBeltrami, fixed: Bools, values: Floats, free: Ints, report: Progress
) -> tuple[sparse.csr_array, Floats]:
    """Return the stiffness of the free points, (k, k), and the load on them by the fixed ones, (k,)."""
    report("Equations", 0.1)
    spacing = mean_spacing(laplacian)
    edge = _edge_distance(laplacian, fixed, spacing)
    thin = fixed & ~_thick(laplacian, fixed)
    edge[thin] = 0.0
    thin &= ~laplacian.boundary  # images do the same there
    weights, own, load = _weights(laplacian, fixed, values)
    if thin.any() and laplacian.stiffness.nnz > _NARROW * np.count_nonzero(laplacian.component >= 0):
        report("Equations", 0.2)
        distance = cKDTree(laplacian.points[thin]).query(laplacian.points, workers=cores())[0]
        ramp = np.clip((distance / laplacian.smoothing_lengths - _NEAR[0]) / (_NEAR[1] - _NEAR[0]), 0.0, 1.0)
        wide = np.maximum(ramp**2 * (3.0 - 2.0 * ramp), _LEAST)
        narrow, narrow_own, narrow_load = _weights(narrow_laplacian(laplacian, _NARROW), fixed, values)
        weights = _blend(weights, wide) + _blend(narrow, 1.0 - wide)
        own, load = wide * own + (1.0 - wide) * narrow_own, wide * load + (1.0 - wide) * narrow_load
    rows = weights[free]
    across = sparse.coo_array(rows[:, np.flatnonzero(fixed)])
    i, j = free[across.row], np.flatnonzero(fixed)[across.col]
    pulled = across.data * (1.0 + edge[j] / np.maximum(edge[i], _GRAZING * spacing[i]))
    inner = rows[:, free]
    diagonal = own[free] + np.bincount(across.row, pulled, len(free)) + inner.sum(axis=1)
    load = load[free] + np.bincount(across.row, pulled * values[j], len(free))
    return (sparse.diags_array(diagonal) - inner).tocsr(), load


def _blend(weights: sparse.csr_array, share: Floats) -> sparse.csr_array:
    """Scale pair weights by the mean of a share at both ends."""
    half = sparse.diags_array(0.5 * share)
    return (half @ weights + weights @ half).tocsr()


def _weights(laplacian: LaplaceBeltrami, fixed: Bools, values: Floats) -> tuple[sparse.csr_array, Floats, Floats]:
    """Return pair weights (n, n), and what boundaries with fixed points add to diagonal and load, (n,).

    Images in such a boundary carry ``2 c - f`` instead of f, with c the value at the nearest boundary point.
    """
    count = len(fixed)
    weights = sparse.diags_array(laplacian.stiffness.diagonal()) - laplacian.stiffness
    boundary = np.flatnonzero(laplacian.boundary)
    near = np.flatnonzero(laplacian.near_boundary)
    nothing = np.zeros(count)
    if not fixed[boundary].any() or not laplacian.images.nnz:
        return weights.tocsr(), nothing, nothing
    nearest = boundary[cKDTree(laplacian.points[boundary]).query(laplacian.points[near], workers=cores())[1]]
    chosen, c = np.zeros(count), np.zeros(count)
    chosen[near] = fixed[nearest]
    c[near] = values[nearest]
    only = sparse.diags_array(chosen)
    plain = (weights - only @ laplacian.images @ only).tocsr()
    plain.setdiag(0.0)
    # An image is no nearer than its point, but for the curvature of the boundary.
    image = (only @ laplacian.images @ only).tocsr()
    image = image.minimum(plain + sparse.diags_array(image.diagonal()))
    total = image.sum(axis=1)
    return (plain - (image - sparse.diags_array(image.diagonal()))).tocsr(), 2.0 * total, total * c + image @ c


def _edge_distance(laplacian: LaplaceBeltrami, fixed: Bools, spacing: Floats) -> Floats:
    """Return how far points are from the edge between fixed and free points, halfway between them, (n,).

    Zero for points that have no neighbors on the other side.
    """
    free = np.flatnonzero(~fixed)
    across = laplacian.stiffness[np.flatnonzero(fixed)][:, free].tocoo()
    i, j = np.flatnonzero(fixed)[across.row], free[across.col]
    length = np.linalg.norm(laplacian.surface_points[i] - laplacian.surface_points[j], axis=1)
    result = np.full(len(fixed), np.inf)
    np.minimum.at(result, i, length)
    np.minimum.at(result, j, length)
    return np.where(np.isfinite(result), np.maximum(result - 0.5 * spacing, 0.0), 0.0)


def _thick(laplacian: LaplaceBeltrami, fixed: Bools) -> Bools:
    """Return which fixed points belong to a set thicker than the kernel, (n,) bool."""
    rows = np.flatnonzero(fixed)
    weights = -laplacian.stiffness[rows][:, np.flatnonzero(~fixed)]
    deep = weights.sum(axis=1) < (1.0 - _DEEP) * laplacian.stiffness.diagonal()[rows]
    result = np.zeros(len(fixed), dtype=bool)
    result[rows] = (abs(laplacian.stiffness[rows][:, rows[deep]]).sum(axis=1) > 0.0) | deep
    return result
