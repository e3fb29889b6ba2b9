"""Deformation in real time: solved on some of the points, whose motions are interpolated to all others."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.spatial import cKDTree

from ..arguments import check_positions, check_switches, whole
from ..cores import cores
from ..errors import PointCloudError
from ..geometry import balanced_weights, move_apart, nearest_in_blocks, thin
from ..operator import LaplaceBeltrami, followers, narrow_laplacian
from ..progress import ends_at_one
from ..types import Bools, Floats, Ints, Progress
from .deformation import (
    NEIGHBORS,
    Deformation,
    Deformer,
    HandleSolver,
    check_constraints,
    components_held,
    notices_of_components,
)

_COUNT = 6000  # points to solve on
_FEWEST = 300  # of a component, as far as it has them
_ALL = 1.5  # times the count: so few points are all solved on
_NEAR, _CLOSER = 10.0, 0.5  # of where constraints begin, in distances of chosen points, these are up to so much closer
_SOURCES = 10  # points that each other one follows
_SHARP = 1e-10  # share of the squared distance to the last source within which a point is at a source
_RIDGE = 1e-2  # share of the spread of sources: weights need not balance less, such as heights above the surface


class CoarseDeformer(HandleSolver):
    """Deforms a surface by its handles as `Deformer` does, in a fraction of the time, for dragging.

    Some of the points, spread as evenly as the given ones permit, are deformed by a `Deformer` of their own. Each of
    the others follows the motions x -> R_j (x - p_j) + x_j of a few of them, with weights that add up to one. Handles
    and anchors are where they should be; a surface that is moved rigidly comes out rigid to round-off.

    Parameters
    ----------
    laplacian, handles, anchors, rotation_aware, weights, neighbors, progress
        As of `Deformer`.
    count : int
        How many points to solve on, about.

    Attributes
    ----------
    points, handles, anchors, rotation_aware, notices
        As of `Deformer`.

    Raises
    ------
    PointCloudError, InvalidPointsError, SolverError
        As of `Deformer`.

    See Also
    --------
    Deformer : Solves on all points.
    coarse_deformer : Chooses between the two.

    References
    ----------
    Sumner, Schmid, Pauly. Embedded deformation for shape manipulation. ACM Trans. Graph. 26, 2007. For the motions of
    few points that carry all others.

    Examples
    --------
    Half of the points, or far fewer of many, suffice where the cap at one pole is lifted, and that at the other stays:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> z = points[:, 2]
    >>> laplacian = mf.build_laplacian(points)
    >>> deformer = mf.deform.CoarseDeformer(laplacian, z > 0.8, z < -0.8, count=400)
    >>> moved = deformer.solve(points[deformer.handles] + [0, 0, 1])
    >>> print((moved - points)[[0, 799], 2].round(2), (moved - points)[:, 2].mean().round(1))
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
        count: int = _COUNT,
        progress: Progress | None = None,
    ) -> None:
        report = progress or (lambda stage, fraction: None)
        n = len(laplacian.points)
        check_switches(rotation_aware=rotation_aware)
        count = _check_count(count)
        self.points = laplacian.points
        self.handles, self.anchors, weights = check_constraints(handles, anchors, weights, n)
        self.rotation_aware = bool(rotation_aware)
        self._chosen = np.flatnonzero(weights)
        held, weights = np.concatenate([self.handles, self.anchors])[self._chosen], weights[self._chosen]
        component = laplacian.component
        components = components_held(component, held)
        self.notices = notices_of_components(component, components)
        # Whatever the surface does, hard constraints are where they should be, and so are lone points.
        self._placed = np.flatnonzero(np.isinf(weights) | (component[held] < 0))
        self._held = held
        moving = np.flatnonzero(np.isin(component, components))
        self._moving, self._carried_points = moving, moving
        if not len(moving):
            return

        report("Points", 0.0)
        rank = np.zeros(n, dtype=np.int64)
        rank[self.anchors], rank[self.handles] = 1, 2
        rank[np.setdiff1d(np.concatenate([self.handles, self.anchors]), held)] = 0
        apart = move_apart(laplacian.surface_points[moving], component[moving])
        areas = laplacian.areas[moving]
        lengths = laplacian.smoothing_lengths[moving] * _closer_to_border(apart, areas, rank[moving] > 0, count)
        spacing = _spacing(areas, lengths, component[moving], count)
        looked = lambda: report("Points", 0.05)  # noqa: E731
        rows = moving[thin(apart, areas, spacing, count, rank[moving], looked)]
        report("Operator", 0.1)
        coarse = narrow_laplacian(
            laplacian, neighbors, rows=rows, progress=lambda stage, share: report("Operator", 0.1 + 0.5 * share)
        )
        place = np.full(n, -1)
        place[held] = np.arange(len(held))
        own = np.flatnonzero(place[rows] >= 0)  # of the coarse points, those that are constrained
        self._rows, self._pulled = rows, place[rows[own]]
        self._coarse = Deformer(
            coarse,
            own,
            rotation_aware=rotation_aware,
            weights=self._gathered(laplacian, coarse, own, weights),
            neighbors=neighbors,
            progress=lambda stage, share: report(stage, 0.6 + 0.2 * share),
        )
        self._carry(
            laplacian, followers(self.points, component, held), lambda share: report("Points", 0.8 + 0.2 * share)
        )

    def _gathered(self, laplacian: LaplaceBeltrami, coarse: LaplaceBeltrami, own: Ints, weights: Floats) -> Floats:
        """Return the weights of constrained coarse points, each with the pull of the soft constraints next to it.

        A weight counts in units of the resistance of one point, which grows as its area falls.
        """
        gathered = weights[self._pulled]
        soft = np.flatnonzero(np.isfinite(weights) & (laplacian.component[self._held] >= 0))
        if len(soft):
            rows, held = self._rows[own], self._held[soft]
            apart = move_apart(laplacian.points, np.maximum(laplacian.component, 0))
            near = cKDTree(apart[rows]).query(apart[held])[1]
            pull = np.bincount(near, weights[soft] / laplacian.areas[held], minlength=len(own)) * coarse.areas[own]
            gathered = np.where(np.isinf(gathered), np.inf, pull)
        return gathered

    def _carry(self, laplacian: LaplaceBeltrami, followers: tuple[Ints, Ints], report: Callable[[float], None]) -> None:
        """Prepare the weights with which the motions of coarse points carry the others, and points on no surface."""
        sources = self._coarse.moving
        apart = move_apart(laplacian.points, np.maximum(laplacian.component, 0))
        weights = _linear_weights(apart[self._rows[sources]], apart[self._moving], report)
        row = np.full(len(self.points), -1)
        row[self._moving] = np.arange(len(self._moving))
        lone, leader = followers[0], row[followers[1]]
        lone, leader = lone[leader >= 0], leader[leader >= 0]
        weights = sparse.vstack([weights, weights[leader]], format="csr")
        self._weights, self._carried_points = weights, np.concatenate([self._moving, lone])
        self._center = self.points[self._moving].mean(axis=0)
        self._rest = self.points[self._carried_points] - self._center
        self._offset = self._rest - weights @ (self.points[self._rows[sources]] - self._center)

    def _deform(
        self, target: Floats, most: int, share: float, start: ArrayLike | None, progress: Progress | None
    ) -> Deformation:
        result, taken, converged = self.points.copy(), 0, True
        if len(self._moving):
            if start is not None:
                start = check_positions(start, len(self.points), "starting points", "point")[self._rows]
            placed, taken, converged = self._coarse.deform(
                target[self._pulled], steps=most, rtol=share, start=start, progress=progress
            )
            result[self._carried_points] = self._carried(placed)
        result[self._held[self._placed]] = target[self._placed]
        return Deformation(result, taken, converged)

    def gradients(self, points: ArrayLike) -> Floats:
        """Find deformation gradients as `Deformer.gradients` does, interpolated from some points."""
        result = np.tile(np.eye(3), (len(self.points), 1, 1))
        if len(self._moving):
            points = check_positions(points, len(self.points), "points after the deformation", "point")
            found = self._coarse.gradients(points[self._rows])[self._coarse.moving]
            result[self._carried_points] = (self._weights @ found.reshape(-1, 9)).reshape(-1, 3, 3)
        return result

    def _carried(self, placed: Floats) -> Floats:
        """Return new positions of the carried points, (k, 3), for those of the coarse points."""
        sources = self._coarse.moving
        now = placed[sources] - self._center
        if not self.rotation_aware:
            return self._weights @ now + self._offset + self._center
        rest = self.points[self._rows[sources]] - self._center
        rotation = np.moveaxis(self._coarse.rotations(placed), 2, 0)
        shift = now - np.einsum("mab,mb->ma", rotation, rest)
        maps = self._weights @ np.concatenate([rotation.reshape(-1, 9), shift], axis=1)
        return np.einsum("nab,nb->na", maps[:, :9].reshape(-1, 3, 3), self._rest) + maps[:, 9:] + self._center


def coarse_deformer(
    laplacian: LaplaceBeltrami, handles: ArrayLike, anchors: ArrayLike = (), *, count: int = _COUNT, **settings: Any
) -> CoarseDeformer | Deformer:
    """Prepare a deformation in real time.

    Parameters
    ----------
    laplacian, handles, anchors, count, settings
        As of `CoarseDeformer`, the last ones by their names.

    Returns
    -------
    CoarseDeformer or Deformer
        The latter, which solves on all points, where they are hardly more than `CoarseDeformer` would solve on.

    Raises
    ------
    PointCloudError, InvalidPointsError, SolverError
        As of `Deformer`.
    """
    if len(laplacian.points) <= _ALL * _check_count(count):
        return Deformer(laplacian, handles, anchors, **settings)
    return CoarseDeformer(laplacian, handles, anchors, count=count, **settings)


def _check_count(count: int) -> int:
    """Return how many points to solve on."""
    if not whole(count) >= 1:
        raise PointCloudError(f"The number of points to solve on is {count!r}. Use a whole number of at least 1.")
    return int(count)


def _closer_to_border(points: Floats, areas: Floats, held: Bools, count: int) -> Floats:
    """Return factors of the distances between chosen points, smaller near the border of constrained sets."""
    away = np.empty(len(points))
    for own in (held, ~held):
        away[own] = cKDTree(points[~own]).query(points[own], workers=cores())[0]
    return np.clip(away / (_NEAR * np.sqrt(areas.sum() / count)), _CLOSER, 1.0)


def _spacing(areas: Floats, lengths: Floats, component: Ints, count: int) -> Floats:
    """Return how far apart to choose points: as the kernel's width, but closer where components would have few."""
    share = np.bincount(component, areas / lengths**2)
    expected = count * share / share.sum()
    fewest = np.minimum(np.bincount(component), _FEWEST)
    closer = np.sqrt(np.minimum(expected / np.maximum(fewest, 1), 1.0))
    return lengths * closer[component]


def _linear_weights(sources: Floats, points: Floats, report: Callable[[float], None]) -> sparse.csr_array:
    """Return the matrix that carries values from sources to points, exact for constants and, along surfaces, linear.

    Weights fade to zero at the last neighbor, so that none appears or vanishes suddenly, and rise at the sources, so
    that these keep their values, times a linear function that balances them around the point (moving least squares).
    """
    found, indices = [], []
    for start, distance, index in nearest_in_blocks(sources, points, _SOURCES + 1, lambda: None):
        report(start / len(points))
        offset = sources.T[:, index] - points.T[:, start : start + len(index), None]
        last = distance[:, -1:]
        share = (distance / np.where(last > 0.0, 1.0001 * last, 1.0)) ** 2  # so that a single one keeps some weight
        weight = (1.0 - share) ** 2 / (share + _SHARP)
        found.append(balanced_weights(weight / weight.sum(axis=1, keepdims=True), offset, _RIDGE))
        indices.append(index)
    weights = np.concatenate(found)
    starts = np.arange(0, weights.size + 1, weights.shape[1])
    return sparse.csr_array((weights.ravel(), np.concatenate(indices).ravel(), starts), (len(points), len(sources)))
