"""Minimal surfaces through fixed rims: the problem of Plateau, Figure 14 of the paper."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from .errors import Cancelled, InvalidPointsError, NotASurfaceError, PointCloudError
from .laplacian import LaplaceBeltrami, build_laplacian
from .options import LaplacianOptions
from .points import as_mask, check_points
from .rim_curve import RimCurve
from .rims import FEWEST

_REACH = 8.0  # smoothing lengths from the rim at which no kernel sees it, also after a step
_TURN = 0.3  # most that a step may move a point, in units of the radius to which the surface bends there
_RISE = 3e-3  # share of the area by which the measured one may rise by chance
_HALVINGS = 4  # of a step that was too long
_NECK = 0.7  # smoothing length over the radius to which the surface bends, where it is no longer resolved
_FEW = 16  # points that may be less well resolved
_SURPLUS = 0.01  # of the tolerance: the area that may still be lost when the iteration ends
_RTOL, _PRODUCTS = 1e-6, 500  # of the linear solves


@dataclass(frozen=True, eq=False, repr=False)
class MinimalSurface:
    """Points moved towards the least area that their fixed rim can span.

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
        Whether the area has settled, on a surface whose area every small change raises.
    steps : int
        Steps that were taken and kept.
    reason : {"converged", "step limit", "stopped", "cancelled", "pinching", "stalled"}
        Why the iteration ended.
    notices : list of str
        What a user should know.
    """

    points: np.ndarray
    areas: np.ndarray
    area_history: np.ndarray
    initial_area: float
    converged: bool
    steps: int
    reason: str
    notices: list


def minimal_surface(
    points,
    fixed,
    epsilon=1e-4,
    max_steps=100,
    options=LaplacianOptions(projection="off"),
    callback=None,
    progress=None,
):
    """Move points along their normals until the area is the least that the fixed points permit.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates of a surface that ends at the fixed points [L].
    fixed : array_like, (n,) bool or (k,) int
        Points that stay: every rim of the surface, and others at will.
    epsilon : float
        The iteration ends when a step changes the area by a smaller share than this, and the next one could save no
        more than a hundredth of it. Zero: go on to the last step.
    max_steps : int
        Most steps to take.
    options : LaplacianOptions
        Settings of the operator, which is built anew for every step.
    callback : callable, optional
        Called as ``callback(step, points, area)`` after every step; ends the iteration by returning False or raising
        `Cancelled`, and the surface stays as it is then.
    progress : callable, optional
        Called as ``progress(stage, fraction)`` during each step; may raise `Cancelled`, which ends the iteration too.

    Returns
    -------
    MinimalSurface

    Raises
    ------
    InvalidPointsError
        Too few fixed points, nothing but fixed points, a rim that is not fixed, or a tolerance out of range.
    PointCloudError
        No operator can be built on the given points.
    Cancelled
        Raised by `progress` before there is an operator of the given points.

    Notes
    -----
    The paper (after Pinkall and Polthier) solves L x = 0 for the coordinates with the rim points fixed, and repeats
    this with the operator of the new points. Taken literally it fails: next to a rim the kernel is cut off, so that
    the areas come out too large and the operator pulls points away from the rim, the surface slides off it within about
    five steps and collapses; and points wander within the surface, which changes nothing about its shape, so that the
    iteration never settles. Where the surface bends strongly the full step also overshoots: the top of a hemisphere is
    drawn to a spike.

    Here the mirror image of a point in the rim carries ``2 c - x``, with c the rim next to it, and points move along
    their normals n alone, x + u n. The area's first change is ``-r . u`` with ``r = n . (pull c - K x)``, and its
    second one that of the Jacobi operator, ``K - areas |A|^2``, with |A|^2 the sum of the squared principal curvatures.
    So ``(K - areas |A|^2) u = r`` is Newton's step, which settles within few of them; the fixed point, r = 0, is that
    of the paper's iteration. Where that matrix is not definite, as on the way to a pinching neck, ``(K + areas |A|^2)
    u = r``, the paper's own step along the normals, still lowers the area. No step moves a point further than a
    share of the radius to which the surface bends there; one that raises the area is halved.

    Rims too far apart span no surface in one piece: then the neck shrinks until the points no longer resolve it. That
    is reported as pinching, with the last surface that they did resolve. On the way there the area may hardly change
    for many steps; only a definite Jacobi operator tells that a surface has settled.

    References
    ----------
    Petronetto et al. 2013, section 5, Figure 14. Pinkall and Polthier. Computing discrete minimal surfaces and their
    conjugates. 1993.
    """
    points = check_points(points)
    fixed = as_mask(fixed, len(points))
    if not epsilon >= 0.0 or int(max_steps) != max_steps or max_steps < 0:
        raise InvalidPointsError(
            f"A tolerance of {epsilon!r} and {max_steps!r} steps were asked for. Give a tolerance of at least 0 and a"
            " whole number of steps."
        )
    iteration = _Flow(points, fixed, options, progress)
    area_history = []
    notices = list(iteration.notices)
    state = iteration.state(points, iteration.first)
    initial_area = state.area
    unresolved = max(_NECK, state.neck)
    reason = "step limit"
    try:
        while len(area_history) < max_steps:
            before = state
            state, reason = iteration.advance(before, unresolved)
            if state is None:
                state = before
                break
            area_history.append(state.area)
            change = abs(state.area - before.area)
            if callback is not None and callback(len(area_history), state.points.copy(), state.area) is False:
                reason = "stopped"
                break
            if change < epsilon * state.area and state.definite and state.savings < _SURPLUS * epsilon * state.area:
                reason = "converged"
                break
            reason = "step limit"
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
        notices=notices,
    )


@dataclass(frozen=True, eq=False)
class _State:
    """A surface on the way, its operator, and the step that leads on.

    Attributes
    ----------
    step : ndarray, (n,)
        Motion along the normals [L]; zero at fixed points.
    savings : float
        Area that the step would save if the area were quadratic [L^2].
    definite : bool
        Whether the Jacobi operator is.
    neck : float
        How badly the kernel resolves the bends of the surface.
    """

    points: np.ndarray
    laplacian: LaplaceBeltrami
    area: float
    step: np.ndarray
    savings: float
    definite: bool
    neck: float


class _Flow:
    """What stays the same during the iteration: the rim, the fixed points and the settings."""

    def __init__(self, points, fixed, options, progress):
        self.options, self.progress = options, progress
        first = build_laplacian(points, options=options, progress=progress)
        self.free = np.flatnonzero(~fixed & (first.component >= 0))
        rows = _rim_points(first, fixed)
        self.notices = list(first.notices)
        self.rim = rows
        self.curve = RimCurve(points[rows])
        self.row = cKDTree(points[rows]).query(self.curve.points)[1]

        self.first = first

    def state(self, points, before):
        """Build the operator of moved points, and the next step."""
        foot, index = self.curve.nearest(points)
        distance = self.curve.distance(points, before.normals, foot, index, before.normals[self.rim[self.row]])
        distance[distance > _REACH * before.smoothing_lengths] = np.inf
        laplacian = build_laplacian(points, options=self.options, boundary_distance=distance, progress=self.progress)
        if np.any(laplacian.component[self.free] < 0) or laplacian.component.max() > self.first.component.max():
            raise NotASurfaceError("The surface came apart.")
        return self.next_step(points, laplacian, foot)

    def next_step(self, points, laplacian, foot):
        free = self.free
        stiffness, pull = laplacian.fixed_rim
        normals = laplacian.normals
        force = np.einsum("ic,ic->i", normals, pull @ foot - stiffness @ points)[free]
        bend = np.maximum(4.0 * laplacian.mean_bend**2 - 2.0 * laplacian.gaussian_curvature, 0.0)
        stiffness = stiffness[free][:, free]
        turned = sparse.diags_array(laplacian.areas[free] * bend[free])
        step = np.zeros(len(points))
        solution, definite = conjugate_gradients(stiffness - turned, force)
        if not definite:
            solution, _ = conjugate_gradients(stiffness + turned, force)
        step[free] = solution
        bend = np.sqrt(bend)
        savings = 0.5 * float(solution @ force)
        longest = np.max(np.abs(step) * bend, initial=0.0)
        if longest > _TURN:
            step *= _TURN / longest
        neck = bend[free] * laplacian.smoothing_lengths[free]
        neck = np.partition(neck, -min(_FEW, len(neck)))[-min(_FEW, len(neck))]
        import os
        if os.environ.get("MS"):
            print("area %.5f savings %.2e max %.2e scale %.2f definite %s neck %.3f"%(laplacian.areas.sum(),savings,np.abs(step).max(),min(1,_TURN/max(longest,1e-30)),definite,neck),flush=True)
        return _State(points, laplacian, float(laplacian.areas.sum()), step, savings, definite, float(neck))

    def advance(self, before, limit):
        """Take a step, a shorter one if need be; returns the new state, or None and why there is none."""
        share = 1.0
        for _ in range(_HALVINGS + 1):
            reason = "stalled"
            try:
                points = before.points + (share * before.step)[:, None] * before.laplacian.normals
                state = self.state(points, before.laplacian)
                if state.neck > limit:
                    reason = "pinching"
                elif np.isfinite(state.area) and state.area <= (1.0 + _RISE) * before.area:
                    return state, ""
            except PointCloudError as error:
                print("error", error)
                reason = "pinching"
            share *= 0.5
        return None, reason


def _rim_points(laplacian, fixed):
    """Return those of the fixed points that lie at the rim, (k,) int."""
    found = laplacian.boundary
    points = laplacian.points
    rows = np.flatnonzero(fixed)
    if len(np.unique(points[rows], axis=0)) < FEWEST or len(rows) == len(points):
        raise InvalidPointsError(
            f"{len(rows)} of {len(points)} points are fixed. Fix the points of the rim, at least {FEWEST} different"
            " ones, and leave the others free."
        )
    spacing = np.median(cKDTree(points).query(points, k=13)[0][:, 12]) * np.sqrt(np.pi / 12)
    if found.any():
        away = cKDTree(points[rows]).query(points[found])[0] > 4 * spacing
        if np.count_nonzero(away) >= FEWEST:
            raise InvalidPointsError(
                f"The surface also ends at {np.count_nonzero(away)} points that are not fixed. A free edge would only"
                " shrink: fix it too."
            )
        sure = np.flatnonzero(fixed & found)
        if len(sure) >= FEWEST:
            foot, _ = RimCurve(points[sure]).nearest(points[rows])
            rows = rows[np.linalg.norm(points[rows] - foot, axis=1) < 0.5 * spacing]
    return rows


def conjugate_gradients(matrix, right):
    """Solve a symmetric system with the diagonal as preconditioner, or find that the matrix is not definite.

    Returns
    -------
    solution : ndarray, (m,)
    definite : bool
    """
    diagonal = matrix.diagonal()
    solution = np.zeros_like(right)
    if not np.all(diagonal > 0.0):
        return solution, False
    residual = right.copy()
    scaled = residual / diagonal
    direction, moment = scaled.copy(), residual @ scaled
    goal = _RTOL**2 * moment
    for _ in range(_PRODUCTS):
        if moment <= goal:
            break
        image = matrix @ direction
        curvature = direction @ image
        if curvature <= 0.0:
            return solution, False
        length = moment / curvature
        solution += length * direction
        residual -= length * image
        scaled = residual / diagonal
        moment, previous = residual @ scaled, moment
        direction = scaled + (moment / previous) * direction
    return solution, True
