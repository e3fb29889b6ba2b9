"""Deformation of a surface by moved handles, with differential coordinates: Figure 13 of the paper."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from ..algebra import (
    TRACE,
    Anderson,
    blocks,
    dissect,
    factorize,
    nearest_rotations,
    on_all_cores,
    rotations_in_groups,
    sparsify,
)
from ..arguments import as_doubles, check_array, check_positions, check_switches, real, whole
from ..errors import PointCloudError
from ..geometry import as_indices
from ..operator import LaplaceBeltrami, coupled_components, followers, narrow_laplacian
from ..progress import ends_at_one
from ..types import Floats, Ints, Progress
from .gradients import DeformationGradients, coupled, step_products, sums_over_steps

NEIGHBORS = 60  # fewer make rotations converge slower, and factors hardly smaller once faint pairs are dropped
STEPS = 30  # most rotation-aware steps of a solve; hard cases take 15
RTOL = 1e-5
_BLOCK = 1 << 14  # rows
_SMALLEST = 1e-10  # ridge of the acceleration's equations, as a share of their trace


class Deformation(NamedTuple):
    """Where a `Deformer` moves a surface for some positions of its handles, and how it got there.

    Attributes
    ----------
    points : ndarray, (n, 3)
        The deformed points [L].
    steps : int
        Rotation-aware steps that were taken.
    converged : bool
        Whether the last one moved no point by more than the tolerance.
    """

    points: Floats
    steps: int
    converged: bool


class HandleSolver(ABC):
    """The base of solvers for the points of a surface whose handles are moved.

    Attributes
    ----------
    points : ndarray, (n, 3)
        At rest [L].
    handles, anchors : ndarray of int
        The points that are moved, and those that stay.
    """

    points: Floats
    handles: Ints
    anchors: Ints
    _chosen: Ints  # rows of handles, then anchors, whose weight is not zero

    @ends_at_one
    def solve(
        self,
        handle_positions: ArrayLike,
        *,
        steps: int = STEPS,
        rtol: float = RTOL,
        start: ArrayLike | None = None,
        progress: Progress | None = None,
    ) -> Floats:
        """Find the points for new positions of the handles.

        Parameters
        ----------
        handle_positions : array_like, (h, 3)
            Where the handles are to be [L], in the order of their indices.
        steps : int
            Most rotation-aware steps; a single one suffices for dragging; with none each component rotates as a whole.
        rtol : float
            Stop when no point moves by more than this share of the size.
        start : array_like, (n, 3), optional
            Points to estimate the first rotations from, such as the last result of a drag; otherwise those of the
            linear solution.
        progress : callable, optional
            Called as ``progress(stage, fraction)`` before each step; may raise `Cancelled`.

        Returns
        -------
        ndarray, (n, 3)
            The deformed points [L]. Those of components without constraints are where they were; those on no surface
            follow the nearest point that is.

        Raises
        ------
        InvalidPointsError
            Positions of the wrong shape or type, or not finite.
        PointCloudError
            Steps or a tolerance below zero.
        """
        return self.deform(handle_positions, steps=steps, rtol=rtol, start=start, progress=progress).points

    @ends_at_one
    def deform(
        self,
        handle_positions: ArrayLike,
        *,
        steps: int = STEPS,
        rtol: float = RTOL,
        start: ArrayLike | None = None,
        progress: Progress | None = None,
    ) -> Deformation:
        """Find the points as `solve` does, with its parameters and errors, and report how many steps that took."""
        most, share = _check_steps(steps, rtol)
        target = check_positions(handle_positions, len(self.handles), "handle positions", "handle")
        target = np.concatenate([target, self.points[self.anchors]])[self._chosen]
        return self._deform(target, most, share, start, progress)

    @abstractmethod
    def _deform(
        self, target: Floats, most: int, share: float, start: ArrayLike | None, progress: Progress | None
    ) -> Deformation:
        """Find the points for positions of the chosen constraints, in at most so many steps; see `deform`."""


class Deformer(HandleSolver):
    """Deforms a surface by its handles and preserves its details; prepared once, solved for every move.

    The deformed points x minimise ``sum_i areas_i |(L x)_i - R_i (L x_o)_i|^2`` over all positions in which handles and
    anchors are where they should be. L x_o are the differential coordinates of the points at rest x_o: mean curvature
    times normal. Without rotations (R_i = I) this is linear in the positions of the handles. The rotation-aware mode
    estimates R_i from the neighborhood of each point before and after, and solves again, until nothing moves: details
    then rotate with the surface.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of the points at rest. A narrower operator is built on its points.
    handles : array_like, (h,) int or (n,) bool
        The points to be moved.
    anchors : array_like, (a,) int or (n,) bool
        Points that stay where they are; may be empty.
    rotation_aware : bool
        Rotate details with the surface.
    weights : float or array_like, (h + a,), optional
        Make the constraints soft: how strongly handles, then anchors, are pulled to their positions. Dimensionless: a
        weight of one pulls as strongly as the surface around resists the move of that point alone. Infinity is a hard
        constraint, as all are by default; a weight of zero removes the constraint.
    neighbors : int
        Neighbors inside the kernel of the narrower operator.
    progress : callable, optional
        Called as ``progress(stage, fraction)`` at the beginning of each stage; may raise `Cancelled`.

    Attributes
    ----------
    points : ndarray, (n, 3)
        The points at rest [L]: ``norm(solve(...) - points, axis=1)`` is the displacement.
    handles, anchors : ndarray, (h,) and (a,) int
        Indices of the points; positions of the handles follow their order.
    rotation_aware : bool
        As given.
    moving : ndarray, (m,) int
        The points of components with constraints, ascending; all others stay where they are.
    notices : list of str
        What a user should know, such as points without constraints, which stay where they are.

    Raises
    ------
    PointCloudError
        No handles, points that are handles and anchors, weights that are negative or all zero.
    InvalidPointsError
        Sets of points that are neither indices nor truth values, or name a point twice; weights of a wrong number.
    SolverError
        The equations cannot be factorised.

    See Also
    --------
    distance.grow : Chooses the points around others.
    clean.smooth_points : Filters the shape.

    Notes
    -----
    The paper solves L x = b with b = (2 I - L) x_o "following the methodology of differential coordinates [Sor06]".
    Taken literally, x_o does not solve it when nothing is moved, and its terms differ in their units. Here L x is to be
    L x_o, as in the work it cites, in the least-squares sense, so that x_o is a fixed point.

    The normal equations, ``K M^-1 K (x - x_o) = 0`` with the stiffness K and the areas M at the points that are free,
    are factorised. Before the rotation-aware steps each component is rotated and moved as a whole to where its
    constrained points fit best, so that components which are moved rigidly come out rigid to round-off.

    References
    ----------
    Petronetto, Paiva, Helou, Stewart, Nonato. Mesh-free discrete Laplace-Beltrami operator. 2013. Figure 13.
    Sorkine. Differential representations for mesh processing. Computer Graphics Forum 25, 2006.
    Sorkine, Alexa. As-rigid-as-possible surface modeling. SGP 2007.

    Examples
    --------
    The cap at one pole is lifted by one, that at the other stays, and all follow, by a half on average:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> z = points[:, 2]
    >>> laplacian = mf.build_laplacian(points)
    >>> deformer = mf.deform.Deformer(laplacian, z > 0.8, z < -0.8)
    >>> moved = deformer.solve(points[deformer.handles] + [0, 0, 1])
    >>> print((moved - points)[[0, 799], 2].round(2), (moved - points)[:, 2].mean().round(2))
    [1. 0.] 0.5
    """

    @ends_at_one
    def __init__(
        self,
        laplacian: LaplaceBeltrami,
        handles: ArrayLike,
        anchors: ArrayLike = (),
        *,
        rotation_aware: bool = True,
        weights: ArrayLike | None = None,
        neighbors: int = NEIGHBORS,
        progress: Progress | None = None,
    ) -> None:
        report = progress or (lambda stage, fraction: None)
        n = len(laplacian.points)
        self.points = laplacian.points
        self.handles, self.anchors, weights = check_constraints(handles, anchors, weights, n)
        check_switches(rotation_aware=rotation_aware)
        self.rotation_aware = bool(rotation_aware)
        self.notices: list[str] = []
        held = np.concatenate([self.handles, self.anchors])

        report("Operator", 0.0)
        narrow = narrow_laplacian(laplacian, neighbors, progress=lambda stage, share: report("Operator", 0.4 * share))
        self.notices += [notice for notice in narrow.notices if notice not in laplacian.notices]
        held_components = components_held(narrow.component, held[weights > 0.0])
        component = _without_uncoupled(narrow, held_components, held[weights > 0.0])
        self.notices += notices_of_components(component, held_components)
        self._narrow = narrow
        self._gradients: DeformationGradients | None = None
        self.moving = np.flatnonzero(np.isin(component, held_components))
        self._component = np.searchsorted(held_components, component[self.moving])
        self._components = len(held_components)
        self._chosen = np.flatnonzero(weights)
        self._held, weights = held[self._chosen], weights[self._chosen]
        hard = np.isinf(weights)

        report("Equations", 0.4)
        moving = self.moving
        row = np.full(n, -1)
        row[moving] = np.arange(len(moving))
        self._row = row[self._held]
        lone, leaders = followers(narrow.points, component, held)
        led = row[leaders] >= 0  # elsewhere the surface next to them stays
        self._lone, self._leader = lone[led], row[leaders[led]]
        if not len(moving):
            return
        # The centre of each component at rest, so that sums of products do not lose digits far from the origin.
        center = np.zeros((self._components, 3))
        np.add.at(center, self._component, self.points[moving])
        center /= np.bincount(self._component)[:, None]
        self._rest = self.points[moving] - center[self._component]
        self._size = float(np.sqrt(np.mean(np.sum(self._rest**2, axis=1))))
        stiffness = sparsify(narrow.stiffness[moving][:, moving])
        report("Equations", 0.42)
        inverse = sparse.diags_array(1.0 / narrow.areas[moving], format="csr")
        energy = _energy(stiffness, inverse, lambda: report("Equations", 0.43))
        report("Equations", 0.45)
        self._differential = stiffness @ self._rest
        inside = self._row >= 0
        fixed = np.zeros(len(moving), dtype=bool)
        fixed[self._row[inside & hard]] = True
        free, self._fixed = np.flatnonzero(~fixed), np.flatnonzero(fixed)
        order, starts = dissect(energy[free][:, free], self._rest[free], lambda: report("Equations", 0.5))
        self._free = free[order]
        # A soft constraint adds its weight to the diagonal, and to the right-hand side times its target position.
        self._pull = np.zeros(len(moving))
        soft = inside & ~hard
        self._pull[self._row[soft]] = weights[soft] * energy.diagonal()[self._row[soft]]
        report("Equations", 0.55)
        free_rows = energy[self._free]
        self._coupling = free_rows[:, self._fixed].tocsr()
        self._divergence = (stiffness[self._free] @ inverse).tocsr()
        report("Equations", 0.57)
        if self.rotation_aware:
            self._edges = step_products((-stiffness).tocoo(), self._rest)

        report("Factors", 0.6)
        matrix = free_rows[:, self._free] + sparse.diags_array(self._pull[self._free])
        self._solve = (
            factorize(matrix, starts, lambda share: report("Factors", 0.6 + 0.4 * share)) if len(order) else None
        )

    def _deform(
        self, target: Floats, most: int, share: float, start: ArrayLike | None, progress: Progress | None
    ) -> Deformation:
        report = progress or (lambda stage, fraction: None)
        result = self.points.copy()
        loose = self._row < 0
        result[self._held[loose]] = target[loose]
        if not len(self.moving):
            return Deformation(result, 0, True)
        rotation, shift = self._fit_components(target)
        frame = self._rotated(rotation, self._rest) + shift[self._component]
        inside = ~loose
        wanted = np.zeros_like(frame)
        wanted[self._row[inside]] = target[inside] - frame[self._row[inside]]
        constant = self._pull[self._free, None] * wanted[self._free] - self._coupling @ wanted[self._fixed]

        def place(load: Floats | float) -> Floats:
            placed = frame + wanted
            if self._solve is not None:
                placed[self._free] = frame[self._free] + self._solve(constant + load)
            return placed

        report("Deform", 0.0)
        if start is None or not self.rotation_aware or most < 1:
            now = place(0.0)
        else:
            now = check_positions(start, len(self.points), "starting points", "point")[self.moving]
        step, converged = 0, True
        if self.rotation_aware and most > 0:
            at_rest = self._rotated(rotation, self._differential)
            converged, acceleration, begin = False, Anderson(_SMALLEST), now
            for step in range(1, most + 1):
                report("Deform", step / (most + 1.0))
                rotated = np.einsum("abn,nb->na", self._rotations(begin), self._differential)
                now = place(self._divergence @ (rotated - at_rest))
                if np.abs(now - begin).max() <= share * self._size:
                    converged = True
                    break
                begin = acceleration.extrapolate(begin, now)
        result[self.moving] = now
        if len(self._lone):
            self._move_lone(result)
        return Deformation(result, step, converged)

    def _move_lone(self, points: Floats) -> None:
        """Move points on no surface with the nearest point that is on one, in place."""
        first = self.moving[self._leader]
        step = self.points[self._lone] - self.points[first]
        if self.rotation_aware:
            step = np.einsum("abn,nb->na", self.rotations(points)[:, :, self._leader], step)
        points[self._lone] = points[first] + step

    def gradients(self, points: ArrayLike) -> Floats:
        """Return the gradients of a deformation; see `deformation_gradients`.

        Parameters
        ----------
        points : array_like, (n, 3)
            All points after it [L], such as `solve` returns.

        Returns
        -------
        ndarray, (n, 3, 3)
        """
        if self._gradients is None:
            self._gradients = DeformationGradients(self._narrow)
        return self._gradients.at(points)

    def rotations(self, points: Floats) -> Floats:
        """Estimate the rotation of the surface around each moving point, (3, 3, m), from deformed points, (n, 3)."""
        return self._rotations(points[self.moving])

    def _rotations(self, now: Floats) -> Floats:
        """Return the polar factors of sum_j w_ij (x_i - x_j)(p_i - p_j)^T, (3, 3, m), of moving points now, (m, 3)."""
        return rotations_in_groups(sums_over_steps(self._edges, now - now.mean(axis=0)), self._component)

    def _fit_components(self, target: Floats) -> tuple[Floats, Floats]:
        """Return the rotation of each component, (c, 3, 3), identity in the linear mode, and its new centre, (c, 3)."""
        inside = self._row >= 0
        row, target = self._row[inside], target[inside]
        component = self._component[row]
        rest = self._rest[row]
        count = np.bincount(component, minlength=self._components)[:, None]
        total = sparse.csr_array(
            (np.ones(len(component)), (component, np.arange(len(component)))), shape=(self._components, len(component))
        )
        before, after = total @ rest / count, total @ target / count
        rotation = np.tile(np.eye(3), (self._components, 1, 1))
        if self.rotation_aware:
            pairs = np.einsum("ka,kb->kab", target - after[component], rest - before[component])
            products = (total @ pairs.reshape(-1, 9)).reshape(-1, 3, 3)
            spread = total @ np.sum((rest - before[component]) ** 2, axis=1)
            for _ in range(2):
                # A little of the identity keeps a component from rotating about an axis that all its constraints lie
                # on, but biases the rotation; in the second round a little of that rotation does not.
                pulled = products + TRACE * spread[:, None, None] * rotation
                rotation = np.moveaxis(nearest_rotations(np.moveaxis(pulled, 0, 2)), 2, 0)
        return rotation, after - np.einsum("pab,pb->pa", rotation, before)

    def _rotated(self, rotation: Floats, vectors: Floats) -> Floats:
        """Rotate vectors at the moving points with their components."""
        if self._components == 1:
            return vectors @ rotation[0].T
        return np.einsum("nab,nb->na", rotation[self._component], vectors)


def _without_uncoupled(laplacian: LaplaceBeltrami, held_components: Ints, held: Ints) -> Ints:
    """Return components, -1 for points of those with constraints that the operator couples to none of these."""
    label = coupled_components(laplacian)
    fast = np.isin(label, label[held]) & (label >= 0) & coupled(laplacian)
    loose = np.isin(laplacian.component, held_components) & ~fast
    return np.where(loose, -1, laplacian.component)


def components_held(component: Ints, held: Ints) -> Ints:
    """Return the components that some of these points are in, ascending; others stay where they are."""
    known = np.unique(component[held])
    return known[known >= 0]


def notices_of_components(component: Ints, held: Ints) -> list[str]:
    """Report points on no surface, and components without constraints."""
    notices = []
    lone = int(np.count_nonzero(component < 0))
    free = (component >= 0) & ~np.isin(component, held)
    if lone:
        notices.append(f"{lone} points are on no surface. Unless they are handles, they follow the nearest point.")
    if free.any():
        notices.append(
            f"{len(np.unique(component[free]))} components with {np.count_nonzero(free)} points have neither handles"
            " nor anchors. They stay where they are."
        )
    return notices


def check_constraints(
    handles: ArrayLike, anchors: ArrayLike, weights: ArrayLike | None, count: int
) -> tuple[Ints, Ints, Floats]:
    """Return handles and anchors of so many points as indices, and the weight of each, handles first."""
    handles, anchors = as_indices(handles, count, "handles"), as_indices(anchors, count, "anchors")
    if not len(handles):
        raise PointCloudError("There are no handles, so nothing can be moved. Choose at least one point.")
    both = len(np.intersect1d(handles, anchors))
    if both:
        raise PointCloudError(f"{both} points are handles and anchors at once. Take them out of one of the two sets.")
    return handles, anchors, _check_weights(weights, len(handles) + len(anchors))


def _check_weights(weights: ArrayLike | None, count: int) -> Floats:
    """Return the weight of each constraint, (count,), infinite where it is hard."""
    if weights is None:
        return np.full(count, np.inf)
    advice = f"Give one number, or {count}: one per handle, then one per anchor."
    given = check_array(weights, "Weights", [(), (count,)], advice)
    bad = int(np.count_nonzero(~(given >= 0.0)))
    if bad:
        raise PointCloudError(f"{bad} weights are negative or NaN. Use numbers from zero to infinity.")
    if not given.any():
        raise PointCloudError("All weights are zero, so nothing constrains the surface. Use some above zero.")
    return np.broadcast_to(as_doubles(given), (count,))


def _check_steps(steps: int, rtol: float) -> tuple[int, float]:
    """Return the most steps of a solve, and its tolerance."""
    most, share = whole(steps), real(rtol)
    if not (most >= 0 and share >= 0.0):
        raise PointCloudError(
            f"The number of steps is {steps!r}, the tolerance {rtol!r}. Give a whole number of steps and a tolerance"
            " of at least 0."
        )
    return int(most), share


def _energy(stiffness: sparse.csr_array, inverse: sparse.csr_array, report: Callable[[], None]) -> sparse.csr_array:
    """Return K M^-1 K, computed in blocks of rows, each in a fraction of a second."""
    weighted = (stiffness @ inverse).tocsr()
    products = on_all_cores(lambda rows: weighted[rows] @ stiffness, blocks(weighted.shape[0], _BLOCK), report)
    return sparse.vstack(products, format="csr")
