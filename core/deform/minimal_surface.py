"""Minimal surfaces through fixed boundaries: the problem of Plateau, Figure 14 of the paper."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.linalg import LinearOperator
from scipy.spatial import cKDTree

from ..algebra import Iterate, conjugate_gradients, multigrid
from ..arguments import check_points, real, whole
from ..errors import Cancelled, InvalidPointsError, NotASurfaceError, PointCloudError
from ..frozen import Frozen
from ..geometry import FEWEST, as_mask, find_nearest
from ..operator import LaplaceBeltrami, build_laplacian
from ..options import LaplacianOptions, check_options
from ..progress import ends_at_one
from ..types import Bools, Floats, Ints, Progress
from .boundary_curve import BoundaryCurve

_FAR = 8.0  # smoothing lengths from the boundary beyond all kernels that reach it, also after a step
_LONGEST = 0.3  # Newton step of a point times the curvature there, at most
_RISE = 3e-3  # share of the area by which the measured one may rise by chance
_HALVINGS = 3  # of a step that went too far
_NECK = 0.7  # smoothing length times curvature where the surface is no longer resolved
_FEW = 16  # points that may be less well resolved, or lie at a free edge by mistake
_SURPLUS = 0.01  # of the tolerance: the area that may still be saved when the iteration ends
_GAIN = 0.5  # of the area that may still be saved, after a step of Newton that is not lost in noise, at most
_FREE_EDGE = 4.0  # spacings from fixed points to points of a free edge
_ON_CURVE = 0.5  # spacings from the boundary's curve to its points, at most
_LOPSIDED = 0.2  # mean offset of the neighbors over their mean distance at a boundary, at least
_RTOL, _PRODUCTS = 1e-6, 500  # of the linear solves


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MinimalSurface(Frozen):
    """Points moved towards the least area with their fixed boundary.

    Attributes
    ----------
    points : ndarray, (n, 3)
        Coordinates [L] after the last good step; fixed points are where they were.
    areas : ndarray, (n,)
        Area elements there [L^2].
    area_history : ndarray, (steps,)
        Total area after each step [L^2].
    initial_area : float
        Total area of the given points [L^2].
    converged : bool
        Whether the area has converged, to a strict local minimum.
    steps : int
        Steps that were accepted.
    reason : {"converged", "step limit", "stopped", "cancelled", "pinching", "unresolved", "stalled"}
        Why the iteration ended: "stopped" by the callback, "cancelled" by `Cancelled`; "unresolved" where the points
        no longer resolve a surface that does not pinch; "stalled" where no step lowers the area.
    notices : list of str
        What a user should know.
    """

    points: Floats
    areas: Floats
    area_history: Floats
    initial_area: float
    converged: bool
    steps: int
    reason: str
    notices: list[str]


@ends_at_one
def minimal_surface(
    points: ArrayLike,
    fixed: ArrayLike,
    *,
    epsilon: float = 1e-4,
    max_steps: int = 100,
    options: LaplacianOptions = LaplacianOptions(),
    callback: Callable[[int, Floats, float], object] | None = None,
    progress: Progress | None = None,
) -> MinimalSurface:
    """Move points until the area is the least that the fixed points permit.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates of a surface that ends at the fixed points [L].
    fixed : array_like, (n,) bool or (k,) int
        Points that stay: every boundary of the surface, and any others.
    epsilon : float
        The iteration ends when a step changes the area by a smaller share than this, and the next one could save no
        more than a hundredth of it; or when a step that was to save a smaller share than this lowers neither the area
        nor, by half, what the next one could save.
        Zero: go on to the last step.
    max_steps : int
        Most steps to take.
    options : LaplacianOptions
        Settings of the operator, which is rebuilt for every step; but points are never projected to smooth noise,
        which the motion itself smooths.
    callback : callable, optional
        Called as ``callback(step, points, area)`` after every step, counted from 1. It ends the iteration by returning
        False or raising `Cancelled`; the surface is left as it is then.
    progress : callable, optional
        Called as ``progress(stage, fraction)`` during each step; may raise `Cancelled`, which ends the iteration too.

    Returns
    -------
    MinimalSurface

    Raises
    ------
    InvalidPointsError
        Too few fixed points, or nothing but fixed points; a component without any, or a boundary that is not fixed; a
        tolerance or a number of steps out of range.
    PointCloudError
        No operator can be built on the given points.
    Cancelled
        Raised by `progress` before there is an operator of the given points.

    See Also
    --------
    MinimalSurface : The result.
    measure.mean_curvature : Zero on it, but at fixed points.
    clean.fair_points : Smooths noise.

    Notes
    -----
    The paper, after Pinkall and Polthier, solves L x = 0 for the coordinates with the boundary points fixed, and
    repeats this with the operator of the new points. Taken literally that fails for two reasons. Next to a boundary the
    kernel is cut off, so that areas come out too large there and the operator pulls points away from the boundary:
    within about five steps the surface slides off and collapses. And points drift within the surface, which costs no
    area, so that the iteration never converges.

    Here the mirror image of a point in the boundary carries ``2 c - x``, c being the nearest position on the boundary.
    A motion along the normals, x + u n, changes the area by ``-r . u`` with ``r = n . (pull c - K x)``, and to second
    order by the Jacobi operator ``K - areas |A|^2``, with |A|^2 the sum of the squared principal curvatures. Newton's
    step ``(K - areas |A|^2) u = r`` converges within a few repetitions where the paper's iteration, moved along the
    normals only, would converge: at r = 0.

    Newton's step is taken where that matrix is definite and no point moves further than a share of the radius of
    curvature there. Otherwise, far from convergence or before a neck pinches off, the step is that of the paper,
    ``K x = pull c`` for whole coordinates: it never raises the area and keeps the points evenly spread, where long
    steps along the normals would draw the top of a hemisphere to a spike. A step that still raises the measured area is
    halved.

    Boundaries too far apart span no connected surface: then the neck shrinks until the points no longer resolve it.
    That is reported as pinching, with the last surface that they did resolve. Before, the area may hardly change for
    many steps; a definite Jacobi operator distinguishes convergence from that.

    The area is known up to the noise of an operator that is found anew for moved points. At a crease, as between the
    surface and fixed points beyond its boundary, that may be more than the tolerance, and more steps only follow it.

    References
    ----------
    Petronetto et al. 2013, section 5, Figure 14. Pinkall, Polthier. Computing discrete minimal surfaces and their
    conjugates. 1993.

    Examples
    --------
    A cushion over a square of area four becomes flat while its boundary is fixed:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> x, y = np.mgrid[-1:1:21j, -1:1:21j].reshape(2, -1)
    >>> points = np.column_stack([x, y, 0.5 * (1 - x**2) * (1 - y**2)])
    >>> film = mf.deform.minimal_surface(points, np.maximum(np.abs(x), np.abs(y)) == 1)
    >>> print(film.converged, round(film.initial_area, 1), film.areas.sum().round(1))
    True 4.6 4.0
    """
    points = check_points(points)
    fixed = as_mask(fixed, len(points))
    if not (real(epsilon) >= 0.0 and whole(max_steps) >= 0):
        raise InvalidPointsError(
            f"The tolerance is {epsilon!r}, the number of steps {max_steps!r}. Give a tolerance of at least 0 and a"
            " whole number of steps."
        )
    epsilon, max_steps = real(epsilon), int(whole(max_steps))
    check_options(options)
    options = replace(options, projection="off")
    first = build_laplacian(points, options=options, progress=progress)
    film = _Film(first, fixed, options, progress)
    state = film.state(points, first)
    initial_area, limit = state.area, max(_NECK, state.curved)
    area_history: list[float] = []
    reason, rise = "step limit", 0.0
    try:
        while len(area_history) < max_steps:
            before = state
            state, failure = film.advance(before, limit)
            if failure:
                reason = failure
                break
            noisy = state.rises_by_noise(before, epsilon)
            rise = state.area / before.area - 1.0 if noisy else 0.0
            if noisy and state.savings >= before.savings:
                state, reason = before, "converged"
                break
            area_history.append(state.area)
            if callback is not None and callback(len(area_history), state.points.copy(), state.area) is False:
                reason = "stopped"
                break
            settled = state.definite and state.savings <= _SURPLUS * epsilon * state.area
            if noisy or (settled and abs(state.area - before.area) < epsilon * state.area):
                reason = "converged"
                break
    except Cancelled:
        reason = "cancelled"
    return MinimalSurface(
        points=state.points,
        areas=state.laplacian.areas,
        area_history=np.array(area_history),
        initial_area=initial_area,
        converged=reason == "converged",
        steps=len(area_history),
        reason=reason,
        notices=first.notices + _notices(reason if rise <= epsilon else "restless", len(area_history), rise),
    )


def _notices(reason: str, steps: int, rise: float) -> list[str]:
    """Report why the iteration ended before convergence, or by which share the area changes at random afterwards."""
    texts = {
        "step limit": f"The surface had not converged after {steps} steps. Allow more steps, or a larger tolerance.",
        "stopped": f"The iteration was stopped after {steps} steps, before the surface had converged.",
        "pinching": (
            f"The surface pinches: after {steps} steps the points no longer resolve its neck. These boundaries"
            " span no connected surface; move them closer together. The last valid step was kept."
        ),
        "unresolved": (
            f"After {steps} steps the points no longer resolve the surface. Use more points, or spread"
            " them more evenly. The last valid step was kept."
        ),
        "restless": (
            f"The surface has converged, but its area changes by {rise:.2%} at random, more than the tolerance: sharp"
            " edges, as where it meets fixed parts of another slope, are not resolved. Fix only its boundary there."
        ),
        "stalled": f"After {steps} steps no further one lowered the area. Use more points, or spread them more evenly.",
    }
    texts["cancelled"] = texts["stopped"]
    return [texts[reason]] if reason in texts else []


@dataclass(frozen=True, eq=False)
class _State:
    """A surface during the iteration, its operator, and the next step."""

    points: Floats  # (n, 3)
    laplacian: LaplaceBeltrami
    area: float
    step: Floats  # (n, 3), to the next surface; zero at fixed points
    # Area that Newton's step would save if the area were quadratic; infinite where that step was not found
    savings: float
    definite: bool  # whether the Jacobi operator is
    # Greatest smoothing length times curvature, but for a few points, and those that couple with fixed ones
    curved: float

    def rises_by_noise(self, before: "_State", epsilon: float) -> bool:
        """Whether Newton's step to it, which was to save less than a share of the area, saved none, nor left less."""
        settled = self.definite and before.definite and before.savings <= epsilon * before.area
        return settled and self.area >= before.area and self.savings > _GAIN * before.savings


class _Film:
    """The invariants of the iteration: the boundary, the free points, and the settings."""

    def __init__(
        self, first: LaplaceBeltrami, fixed: Bools, options: LaplacianOptions, progress: Progress | None
    ) -> None:
        self.options, self.progress = options, progress
        self.boundary = _boundary_points(first, fixed)
        self.curve = BoundaryCurve(first.points[self.boundary]) if len(self.boundary) else None
        self.free = np.flatnonzero(~fixed & (first.component >= 0))
        self.components = first.component.max()

    def state(self, points: Floats, before: LaplaceBeltrami) -> _State:
        """Build the operator of moved points, the boundary's distances by the normals before, and the next step."""
        distance, foot = None, points
        if self.curve is not None:
            foot, index = self.curve.nearest(points)
            if not self.curve.rough:  # otherwise the operator fits a boundary to them
                normals = before.normals[self.boundary[self.curve.first]]
                distance = self.curve.distance(points, before.normals, foot, index, normals)
                distance[distance > _FAR * before.smoothing_lengths] = np.inf
        laplacian = build_laplacian(
            points, options=self.options, boundary=self.boundary, boundary_distance=distance, progress=self.progress
        )
        torn = np.count_nonzero(laplacian.component[self.free] < 0)
        if torn or laplacian.component.max() > self.components:
            raise NotASurfaceError(
                f"The surface has broken apart: {torn} points are disconnected from the rest. Use more points."
            )
        return self._with_step(points, laplacian, foot)

    def _with_step(self, points: Floats, laplacian: LaplaceBeltrami, foot: Floats) -> _State:
        """Return the state with the next step."""
        stiffness, pull = laplacian.dirichlet
        free = self.free[stiffness.diagonal()[self.free] > 0.0]  # in noise a point may lie on a sheet of its own
        pulled = (pull @ foot - stiffness @ points)[free]
        normals, areas = laplacian.normals[free], laplacian.areas[free]
        squared = 4.0 * laplacian.quadric_mean_curvature[free] ** 2 - 2.0 * laplacian.gaussian_curvature[free]
        curvature = np.sqrt(np.maximum(squared, 0.0))  # |A|
        stiffness = stiffness[free][:, free]
        force = np.einsum("ic,ic->i", normals, pulled)
        jacobi = (stiffness - sparse.diags_array(areas * curvature**2)).tocsr()
        step = np.zeros_like(points)
        with multigrid(stiffness) as inverse:
            newton = _solve(jacobi, force, inverse)
            along, definite = newton.values, newton.definite
            if definite and np.max(np.abs(along) * curvature) <= _LONGEST:
                step[free] = along[:, None] * normals
            else:
                for axis in range(3):
                    step[free, axis] = _solve(stiffness, pulled[:, axis], inverse).values
        # Where it meets fixed parts of another slope an edge is sharp, however many points there are.
        held = laplacian.stiffness @ ~as_mask(self.free, len(points)) != 0.0
        bent = np.append(np.zeros(_FEW), (curvature * laplacian.smoothing_lengths[free])[~held[free]])
        return _State(
            points=points,
            laplacian=laplacian,
            area=float(laplacian.areas.sum()),
            step=step,
            savings=0.5 * float(along @ force) if newton.converged else np.inf,
            definite=definite,
            curved=float(np.partition(bent, -_FEW)[-_FEW]),
        )

    def advance(self, before: _State, limit: float) -> tuple[_State, str]:
        """Take a step, or a fraction of it, to a surface that is curved no more than the limit.

        Return the next state, and an empty text; or the same state, and why there is no next one.
        """
        for halving in range(_HALVINGS + 1):
            failure = "unresolved" if before.definite else "pinching"
            try:
                state = self.state(before.points + 0.5**halving * before.step, before.laplacian)
            except PointCloudError:
                continue
            if state.curved > limit:
                continue
            if state.area <= (1.0 + _RISE) * before.area:
                return state, ""
            failure = "stalled"
        return before, failure


def _boundary_points(laplacian: LaplaceBeltrami, fixed: Bools) -> Ints:
    """Return those of the fixed points that lie at a boundary, (k,) int, after checks."""
    points, found, component = laplacian.points, laplacian.boundary, laplacian.component
    rows = np.flatnonzero(fixed)
    if len(np.unique(points[rows], axis=0)) < FEWEST or len(rows) == len(points):
        raise InvalidPointsError(
            f"{len(rows)} of {len(points)} points are fixed. Fix the points of the boundary, at least {FEWEST}"
            " different ones, and leave the others free."
        )
    loose = np.setdiff1d(component[component >= 0], component[rows])
    if len(loose):
        raise InvalidPointsError(
            f"{np.count_nonzero(np.isin(component, loose))} of {len(points)} points are in components of the surface"
            " without fixed points, which would shrink to nothing. Fix their boundaries, or delete them."
        )
    nearest = find_nearest(points)
    tree = cKDTree(points[rows])
    edge = np.count_nonzero(tree.query(points[found])[0] > _FREE_EDGE * nearest.spacing[found]) if found.any() else 0
    if edge > _FEW:
        raise InvalidPointsError(
            f"The surface also ends at {edge} points that are far from the {len(rows)} fixed ones. Such an edge"
            " would only shrink: fix it too."
        )
    sure = np.flatnonzero(fixed & found)
    if len(np.unique(points[sure], axis=0)) >= FEWEST:
        foot, _ = BoundaryCurve(points[sure]).nearest(points[rows])
        away = np.linalg.norm(points[rows] - foot, axis=1)
        return rows[away < _ON_CURVE * nearest.spacing[rows]]
    # No boundary was found there: the fixed points are one if they have neighbors on one side only.
    offset = points[nearest.index[rows]] - points[rows, None]
    mean = np.linalg.norm(np.einsum("ik,ikc->ic", nearest.weight[rows], offset), axis=1)
    lopsided = mean > _LOPSIDED * np.einsum("ik,ik->i", nearest.weight[rows], nearest.distance[rows])
    return rows if np.median(lopsided) > 0.5 else rows[:0]


def _solve(matrix: sparse.csr_array, load: Floats, inverse: LinearOperator | None) -> Iterate:
    """Solve for a step, no more closely than it needs, or find that the matrix is not definite."""
    diagonal = matrix.diagonal()
    if not np.all(diagonal > 0.0):
        return Iterate(np.zeros_like(load), 0, converged=False, residual=1.0, definite=False)
    scaling = 1.0 / diagonal if inverse is None else inverse
    return conjugate_gradients(matrix, load, scaling=scaling, rtol=_RTOL, products=_PRODUCTS)
