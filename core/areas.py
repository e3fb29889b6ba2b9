"""Area elements from the unit-integral condition of the kernel, eqs. (6) to (8) of the paper."""

from dataclasses import dataclass, replace

import numpy as np

from .distances import arc_length
from .errors import AreaError
from .kernel import kernel
from .neighbors import find_neighborhoods
from .normals import unit_normals
from .options import LaplacianOptions
from .surface import fit_surface

_FLOOR = 0.05  # least area in units of the density area; keeps the ratios of Theorem 1's (A1) bounded
_ROUNDS, _STEPS = 10, 15  # of the fast areas
_RESOLVED = 1e-2  # eigenvalues of the scaled kernel matrix below this are left to the start
TAU = 2.0**-52  # the paper's lower bound of eq. (8), in scaled coordinates


@dataclass(frozen=True)
class AreaSolution:
    """Areas and how they were found.

    Attributes
    ----------
    areas : ndarray, (n,)
        Area elements, all positive.
    products : int
        Products with the kernel matrix.
    held : float
        Share of the points at the lower bound.
    converged : bool
        Whether the solver reached its tolerance; the fast areas are a fixed number of steps.
    """

    areas: np.ndarray
    products: int
    held: float
    converged: bool


def estimate_areas(points, normals=None, options=LaplacianOptions()):
    """Estimate the area element of every point, the operator's own, without the operator.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L].
    normals : array_like, (n, 3), optional
        Normals to use as they are; estimated where not given.
    options : LaplacianOptions
        Settings.

    Returns
    -------
    ndarray, (n,)
        Areas [L^2]; points at the same place share one area in equal parts.

    Raises
    ------
    PointCloudError
        The points have no sound areas; see `build_laplacian`.
    """
    neighborhoods = find_neighborhoods(points, options)
    scaled = neighborhoods.scaled
    target, distance = np.ones(len(scaled.points)), neighborhoods.distance
    if options.curvature_correction:
        given = None if normals is None else unit_normals(normals, len(scaled.inverse))[scaled.first]
        surface = fit_surface(neighborhoods, options, given)
        target, distance = surface.kernel_integral, arc_length(neighborhoods, surface.normals)
    return scaled.share(solve_areas(neighborhoods, distance, target, options).areas) * scaled.scale**2


def solve_areas(neighborhoods, distance, target, options):
    """Solve for the areas of the distinct points, in scaled coordinates, by the method the options name.

    Parameters
    ----------
    neighborhoods : Neighborhoods
        Of m distinct points, with p pairs.
    distance : ndarray, (p,)
        Distance of each pair: in space, or along the surface.
    target : ndarray, (m,)
        The integral that the kernel should have at each point.
    options : LaplacianOptions
        Its areas and regularization settings.

    Returns
    -------
    AreaSolution

    Raises
    ------
    AreaError
        Eq. (7), which has no bound, gave areas that are not positive.
    """
    matrix = KernelMatrix(neighborhoods, distance)
    if options.areas == "fast":
        return fast_areas(matrix, target)
    if options.areas == "constrained":
        return constrained_areas(matrix, target, options.regularization)
    solution = regularized_areas(matrix, target, options.regularization)
    if options.areas == "uniform":
        return replace(solution, areas=np.full(len(target), solution.areas.mean()))
    bad = int(np.count_nonzero(solution.areas <= 0.0))
    if bad:
        raise AreaError(
            f"The regularized areas of {bad} of {len(target)} points are not positive. Choose the areas option 'fast'"
            " or 'constrained', or raise the regularization."
        )
    return solution


class KernelMatrix:
    """The symmetric matrix A of eq. (6), a_ij = W(distance_ij, h_ij), kept as half its pairs."""

    def __init__(self, neighborhoods, distance):
        lengths = neighborhoods.mean(neighborhoods.lengths)
        self._half = neighborhoods.half(kernel(distance / lengths) / lengths**2)
        self._diagonal = kernel(0.0) / neighborhoods.lengths**2

    def __matmul__(self, values):
        return self._diagonal * values + self._half @ values + self._half.T @ values


def fast_areas(matrix, target):
    """Solve A v = b by a projected Chebyshev iteration that starts at the density areas v0 = 1 / (A 1).

    With M = V0^(1/2) A V0^(1/2), whose eigenvalues lie in [0, 1] whatever the points, each round runs Chebyshev's
    semi-iteration on M y = V0^(1/2) b for v = V0^(1/2) y, over the eigenvalues above 1e-2: the smooth part is solved
    for, and what the kernel cannot see stays near the density areas. Between rounds areas below the floor of 0.05 v0
    are put on it, held there, and released when the gradient turns inward. A fixed number of linear steps, unlike
    conjugate gradients, does not amplify rounding: the result is the same to 1e-10 for any order of the points.

    Parameters
    ----------
    matrix : KernelMatrix
        A, (n, n).
    target : ndarray, (n,)
        b, the integral that the kernel should have at each point (1 on a flat surface).

    Returns
    -------
    AreaSolution
    """
    density = 1.0 / (matrix @ np.ones(len(target)))
    root = np.sqrt(density)
    center, radius = 0.5 * (1.0 + _RESOLVED), 0.5 * (1.0 - _RESOLVED)
    y, held = root, np.zeros(len(target), dtype=bool)
    for _ in range(_ROUNDS):
        residual = root * (target - matrix @ (root * y))
        held &= residual < 0.0
        residual[held] = 0.0
        ratio = radius / center
        change = residual / center
        for _ in range(_STEPS):
            y = y + change
            image = root * (matrix @ (root * change))
            image[held] = 0.0
            residual -= image
            following = 1.0 / (2.0 * center / radius - ratio)
            change = following * ratio * change + (2.0 * following / radius) * residual
            ratio = following
        y = y + change
        held = y <= _FLOOR * root
        y = np.maximum(y, _FLOOR * root)
    return AreaSolution(root * y, 1 + _ROUNDS * (1 + _STEPS), float(held.mean()), True)


def regularized_areas(matrix, target, rho, products=8000, rtol=1e-10):
    """Minimise |A v - b|^2 + rho |v|^2, eq. (7), without a bound.

    A is symmetric, so the solution (A^2 + rho)^(-1) A b is the real part of (A + i sqrt(rho))^(-1) b. That system has
    the square root of the other one's condition number; it is solved by conjugate gradients for complex symmetric
    matrices (COCG; van der Vorst and Melissen 1990), preconditioned by the density areas.

    Returns
    -------
    AreaSolution
        Areas may be negative where the points are irregular.
    """
    density = 1.0 / (matrix @ np.ones(len(target)))
    shift = 1j * np.sqrt(rho)
    v = np.zeros(len(target), dtype=complex)
    residual = target.astype(complex)
    direction = density * residual
    moment = residual @ direction  # without conjugation, here and below
    used = 1
    while used + 2 <= products:
        image = (matrix @ direction.real) + 1j * (matrix @ direction.imag) + shift * direction
        used += 2
        length = moment / (direction @ image)
        v += length * direction
        residual -= length * image
        if np.linalg.norm(residual) <= rtol * np.linalg.norm(target):
            return AreaSolution(v.real, used, 0.0, True)
        scaled = density * residual
        moment, previous = residual @ scaled, moment
        direction = scaled + (moment / previous) * direction
    return AreaSolution(v.real, used, 0.0, False)


def constrained_areas(matrix, target, rho, products=4000, rtol=1e-6):
    """Minimise |A v - b|^2 + rho |v|^2 with v >= tau, eq. (8), starting from the solution of eq. (7).

    Returns
    -------
    AreaSolution
    """
    start = regularized_areas(matrix, target, rho)
    if start.areas.min() >= TAU:
        return start
    density = 1.0 / (matrix @ np.ones(len(target)))
    damping = rho * density**2
    u, used, converged = bounded_quadratic(
        lambda u: density * (matrix @ (matrix @ (density * u))) + damping * u,
        density * (matrix @ target),
        TAU / density,
        np.maximum(start.areas, TAU) / density,
        1.0,
        products // 2,
        rtol,
    )
    held = float(np.mean(u <= TAU / density))
    return AreaSolution(np.maximum(density * u, TAU), start.products + 2 * used, held, converged)


def bounded_quadratic(product, right, lower, start, norm, products, rtol):
    """Minimise ``x.Hx / 2 - x.right`` over x >= lower by proportioned conjugate gradients.

    Conjugate gradients on the free unknowns, a projected step where one meets its bound, and a release of held ones
    when their gradient outweighs that of the free (MPRGP; Dostal and Schoeberl 2005).

    Parameters
    ----------
    product : callable
        x -> H x, H symmetric positive definite.
    right, lower, start : ndarray, (n,)
        Right-hand side, bounds, feasible start.
    norm : float
        Upper bound of the largest eigenvalue of H.
    products : int
        Most products with H.
    rtol : float
        Tolerance on the projected gradient, relative to the right-hand side.

    Returns
    -------
    x : ndarray, (n,)
    used : int
        Products spent.
    converged : bool
    """
    step = 1.9 / norm
    x = start.copy()
    gradient = product(x) - right
    used = 1
    tolerance = rtol * np.linalg.norm(right)

    def split(gradient, x):
        held = x <= lower
        return np.where(held, 0.0, gradient), np.where(held, np.minimum(gradient, 0.0), 0.0)

    free, chopped = split(gradient, x)
    direction = free
    while used < products:
        if free @ free + chopped @ chopped <= tolerance**2:
            return x, used, True
        reduced = np.minimum(free, (x - lower) / step)
        if chopped @ chopped <= reduced @ free:
            image = product(direction)
            used += 1
            curvature = direction @ image
            length = (gradient @ direction) / curvature
            falling = direction > 0.0
            room = np.min((x[falling] - lower[falling]) / direction[falling], initial=np.inf)
            if length <= room:
                x = np.maximum(x - length * direction, lower)
                gradient = gradient - length * image
                free, chopped = split(gradient, x)
                direction = free - ((free @ image) / curvature) * direction
                continue
            half = x - room * direction
            free = split(gradient - room * image, half)[0]
            x = np.maximum(half - step * free, lower)
            gradient = product(x) - right
            used += 1
        else:
            image = product(chopped)
            used += 1
            length = (gradient @ chopped) / (chopped @ image)
            x = x - length * chopped
            gradient = gradient - length * image
        free, chopped = split(gradient, x)
        direction = free
    return x, used, False
