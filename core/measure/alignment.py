"""One cloud moved onto another that shows the same surface, or a part of it: closest points on tangent planes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import permutations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..algebra import nearest_rotations
from ..arguments import check_array, check_finite, check_points, check_positions, check_switches, real
from ..cores import cores
from ..errors import InvalidPointsError, PointCloudError
from ..geometry import SMOOTH, read_surface
from ..linalg import det, eigh, eigvalsh, inv, svd
from ..options import LaplacianOptions
from ..progress import ends_at_one
from ..types import Array, Bools, Floats, Ints, Progress, Report

_MOST = 20_000  # points of a cloud that are aligned: of more a sample drawn at random, whose errors average out
_NEIGHBORS = 20  # that a point of a surface needs
_THREADED = 4_000  # places whose closest points several threads search for
_COARSE = 1_000  # points of a cloud from which closest ones are searched for until both lie a spacing apart
_WIDEST = 2.0  # median distances: the width of the first kernel
_NARROWER = 0.85  # each further kernel, down to one spacing
_ROUNDS, _FINE_ROUNDS = 80, 20  # at most
_STILL = 2e-2, 1e-6  # spacings that a round may move points by when it is the last one
_FACING = 0.3  # least cosine between normals of points that may be one place of the surface
_BESIDE = 1.0  # spacings along the surface from the closest point, which is beside the surface otherwise
_SPREAD = 3.0  # standard deviations, the width of the last kernel
_TOGETHER = 0.5  # spacings across the surface within which points lie on it
_NEAR = 10.0  # spacings across the surface from which a point contradicts it; further ones are other things
_AGREEING = 0.65  # share of agreeing points among these and contradicting ones: 0.74 and more found at right places
_FEWEST = 0.05  # share of points that must agree at all
_SLIDING = 1.0  # squared scatter of the normals: as much is seen of a motion that slides along the surface, or less
_TURN = np.radians(15.0)  # and a tenth of the size: further starts, where the first one fails
_SHIFT = 0.1
_PICKED = 3, 5  # places that are picked on either cloud, at least and at most
_MATCHING = 3.0  # times the least misfit of pairs, and spacings more, that others may have which are tried as well
_TRIED = 6  # of them at most


class Alignment(NamedTuple):
    """How a cloud was moved onto another, made by `align`.

    Attributes
    ----------
    matrix : ndarray, (4, 4)
        Maps points to the target: a rotation and a translation, and one scale factor where that was asked for.
    residual : ndarray, (n,)
        Distances [L] of the points, so moved, from the surface of the target: across it, and for points beside it from
        its end. Of points far off, about those from its nearest point.
    overlap : float
        Share of the points that lie on the target's surface.
    fits : bool
        Whether the surfaces agree where they overlap.
    converged : bool
        Whether the result can be trusted: it fits, and no other motion does.
    reason : str
        A sentence on why it cannot; empty where it can.
    notices : list of str
        What else there is to know: that only a sample was aligned.
    """

    matrix: Floats
    residual: Floats
    overlap: float
    fits: bool
    converged: bool
    reason: str
    notices: list[str]


@ends_at_one
def align(
    points: ArrayLike,
    target: ArrayLike,
    *,
    overlap: float = 1.0,
    scale: bool = False,
    start: ArrayLike | None = None,
    pairs: tuple[ArrayLike, ArrayLike] | None = None,
    progress: Progress | None = None,
) -> Alignment:
    """Move a cloud onto another that shows the same surface, or part of it, from nearby.

    Each point is drawn to the closest one of the other cloud, across the surface only, and the less the further off it
    is; these forces fade faster and faster until what is left is the noise, so that parts that only one of the clouds
    has, and outliers, have no say. Noise is smoothed before. It is found from 20 degrees and a tenth of the size off or
    so; where it fails, the best is taken of 12 further starts around that one. There is no search of all positions:
    begin from pairs of places otherwise.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates [L] of the cloud to move.
    target : array_like, (m, 3)
        Coordinates [L] of the other.
    overlap : float
        Above 0, up to 1: share of the points that have a counterpart in the other cloud at most. Those further off have
        no say at all. As it is 1, their distances alone decide, which does for shares down to a third.
    scale : bool
        Whether to change the size as well.
    start : array_like, (4, 4), optional
        Where to begin: a matrix that maps points to the target, of any rotation, translation and scale.
    pairs : tuple of two array_like, (k, 3), optional
        Where to begin, in place of a start: three to five places on each cloud, roughly the same ones, in any order.
        What belongs together is found by their distances, and by which way fits.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    Alignment

    Raises
    ------
    InvalidPointsError
        Points, a start or places of a wrong shape, not finite, or places on one line.
    PointCloudError
        Points without a surface, fewer than 21 included, or another overlap or scale.

    See Also
    --------
    match_places : A start from places in the same order.
    surface_deviation : Compares the clouds then, with signs.

    Notes
    -----
    Point to plane with the normals of both clouds (Rusinkiewicz 2019), which fits quadrics exactly and does not depend
    on the signs of the normals; Geman-McClure weights whose width decreases (Zhou, Park, Koltun 2016); closest points
    in both directions. Of clouds with more than 20,000 points so many, drawn at random, are aligned.

    References
    ----------
    Rusinkiewicz. A symmetric objective function for ICP. ACM Transactions on Graphics 38, 2019.
    Zhou, Park, Koltun. Fast global registration. 2016.

    Examples
    --------
    An ellipsoid, rotated by ten degrees and moved, is brought back:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> body = points * [1.0, 0.7, 0.5]
    >>> cosine, sine = np.cos(np.radians(10.0)), np.sin(np.radians(10.0))
    >>> moved = body @ [[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]] + [0.1, 0.0, 0.05]
    >>> found = mf.measure.align(moved, body)
    >>> print(found.converged, np.allclose(moved @ found.matrix[:3, :3].T + found.matrix[:3, 3], body))
    True True
    """
    report = progress or (lambda stage, fraction: None)
    check_switches(scale=scale)
    if not 0.0 < real(overlap) <= 1.0:
        raise PointCloudError(f"The overlap is {overlap!r}. Use a share above 0, up to 1.")
    given = np.eye(4) if start is None else _check_start(start)
    report("Alignment", 0.0)
    moving = _surface_of(points, "points", lambda: report("Alignment", 0.1))
    fixed = _surface_of(target, "target", lambda: report("Alignment", 0.3))
    search = _Search(moving, fixed, real(overlap), bool(scale), lambda: report("Alignment", 0.5))
    begin, back = _shift(moving.center), _shift(-fixed.center)
    if pairs is None:
        found = search.best(search.around(back @ given @ begin))
    else:
        found = search.best(back @ way @ begin for way in _ways(*pairs, fixed.unit, bool(scale)))
    report("Alignment", 0.9)
    matrix = _shift(fixed.center) @ found.matrix @ _shift(-moving.center)
    places = check_points(points)
    residual = fixed.distance(_apply(found.matrix, places - moving.center))
    sampled = max(len(places), len(np.asarray(target))) > _MOST
    text = f"Of clouds with more than {_MOST:,} points so many, drawn at random, were aligned: residuals are distances"
    notices = [f"{text} from the surface through those."] if sampled else []
    return Alignment(matrix, residual, found.overlap, found.fits, not found.reason, found.reason, notices)


def match_places(places: ArrayLike, others: ArrayLike, *, scale: bool = False) -> Floats:
    """Find the motion that brings some places nearest to others, pair by pair: a start for `align`.

    Parameters
    ----------
    places, others : array_like, (k, 3)
        Coordinates [L] of at least three pairs.
    scale : bool
        Whether to change the size as well.

    Returns
    -------
    ndarray, (4, 4)
        Maps the places to the others, with the least sum of squared distances.

    Raises
    ------
    InvalidPointsError
        Of a wrong shape, not finite, fewer than three pairs, or all places on one line, on either side.

    See Also
    --------
    align : Goes on from there.

    References
    ----------
    Umeyama. Least-squares estimation of transformation parameters between two point patterns. 1991.

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> matrix = mf.measure.match_places(points[:3], points[:3] + [2.0, 0.0, 0.0])
    >>> print(np.allclose(matrix[:3, 3], [2.0, 0.0, 0.0]), np.allclose(matrix[:3, :3], np.eye(3)))
    True True
    """
    check_switches(scale=scale)
    here = check_array(places, "Places", [(None, 3)], "Give x, y, z for each place.")
    pair = [check_positions(given, len(here), "places", "place") for given in (here, others)]
    centers = [_center(side, len(here)) for side in pair]
    left, right = (side - center for side, center in zip(pair, centers, strict=True))
    rotation = nearest_rotations((right.T @ left)[:, :, None])[:, :, 0]
    size = np.sum(right * (left @ rotation.T)) / np.sum(left**2) if scale else 1.0
    return _shift(centers[1]) @ _linear(size * rotation) @ _shift(-centers[0])


def _ways(places: ArrayLike, others: ArrayLike, spacing: float, scale: bool) -> list[Floats]:
    """Return the motions that match places in some order, those of the least misfit first."""
    given = [check_array(side, "Places", [(None, 3)], "Give x, y, z for each place.") for side in (places, others)]
    count, least, most = len(given[0]), *_PICKED
    if not (least <= count <= most and len(given[1]) == count):
        raise InvalidPointsError(
            f"{count} places are given on the points and {len(given[1])} on the target. Give {least} to {most}, as many"
            " on either."
        )
    targets = [given[1][list(order)] for order in permutations(range(count))]
    ways = [match_places(given[0], target, scale=scale) for target in targets]
    misfits = [
        float(np.linalg.norm(_apply(way, given[0]) - target) / np.sqrt(count))
        for way, target in zip(ways, targets, strict=True)
    ]
    limit = _MATCHING * (min(misfits) + spacing)
    order = np.argsort(misfits, kind="stable")[:_TRIED]
    return [ways[row] for row in order if misfits[row] <= limit]


def _center(places: Floats, count: int) -> Floats:
    """Return the center of places, (k, 3), that determine a rotation."""
    center: Floats = places.mean(axis=0) if count else np.zeros(3)
    spread = svd(places - center, compute_uv=False) if count > 2 else np.zeros(3)
    if not spread[1] > 1e-6 * spread[0]:
        raise InvalidPointsError(
            f"The {count} pairs of places do not determine a rotation. Give at least three, not on one line."
        )
    return center


def _check_start(start: ArrayLike) -> Floats:
    matrix = check_array(start, "Starts", [(4, 4)], "Give a matrix of 4 x 4 numbers.").astype(np.float64)
    check_finite(matrix, "rows of the start", "Give a matrix of finite numbers.")
    size = np.cbrt(det(matrix[:3, :3]))
    square = matrix[:3, :3].T @ matrix[:3, :3]
    if not (size > 0.0 and np.allclose(square / size**2, np.eye(3), atol=1e-3)) or not np.allclose(
        matrix[3], [0.0, 0.0, 0.0, 1.0]
    ):
        raise InvalidPointsError("The start is no rotation, translation and scale. Leave shears and mirrors out.")
    return matrix


@dataclass(frozen=True)
class _Surface:
    """The surface of one cloud, about its center, sampled evenly enough and without outliers and noise."""

    center: Floats
    places: Floats
    normals: Floats
    shape_operator: Floats
    spacing: Floats
    tree: cKDTree

    @property
    def unit(self) -> float:
        """Distance between neighbors [L]."""
        return float(np.median(self.spacing))

    def coarse(self) -> Ints:
        """Rows of fewer places, (k,), as near to each other in all parts: they are in the order of a k-d tree."""
        return np.unique(np.linspace(0, len(self.places) - 1, _COARSE).astype(int))

    def distance(self, places: Floats) -> Floats:
        """Return distances of places, (k, 3), from the surface: across it, or from its end."""
        reach, row = _closest(self.tree, places)
        offset, normals = places - self.places[row], self.normals[row]
        height = np.einsum("ij,ij->i", offset, normals)
        along = offset - height[:, None] * normals
        aside, spacing = np.linalg.norm(along, axis=1), self.spacing[row]
        inside = along * np.minimum(1.0, spacing / np.maximum(aside, 1e-300))[:, None]
        height += 0.5 * np.einsum("ij,ijk,ik->i", inside, self.shape_operator[row], inside)
        beside: Floats = np.hypot(height, np.maximum(aside - spacing, 0.0))
        return np.minimum(beside, reach)


def _surface_of(given: ArrayLike, name: str, report: Report) -> _Surface:
    """Read the surface of a cloud, of at most so many points of it."""
    options = LaplacianOptions(bandwidth="local", neighbors=_NEIGHBORS)
    try:
        points = check_points(given)
        rows = np.arange(len(points))
        if len(points) > _MOST:  # by the places, so that the order of the points does not matter
            rows = np.lexsort(points.T)[np.random.default_rng(0).permutation(len(points))[:_MOST]]
        scaled, surface = read_surface(points[rows], options, lambda stage, fraction: report())
    except PointCloudError as error:
        raise type(error)(f"In the {name}: {error}") from error
    sample, quadrics = surface.sample, surface.quadrics
    center = np.sort(points[rows], axis=0).mean(axis=0)
    places = points[rows[sample.scaled.first]] - center + scaled.scale * sample.moved
    spacing = scaled.scale * sample.nearest.spacing
    return _Surface(center, places, quadrics.normals, quadrics.shape_operator / scaled.scale, spacing, cKDTree(places))


class _Matches(NamedTuple):
    """Pairs of places of both surfaces, in the coordinates of the fixed one."""

    here: Floats  # of the moving one, (k, 3)
    there: Floats
    normals: Floats  # halves of their sum, (k, 3)
    scatter: Floats  # squares of halves of their difference, (k,)
    distance: Floats
    height: Floats  # of the one above the other, across the surface
    aside: Floats  # along it, in spacings
    cosine: Floats  # between the normals
    spacing: Floats

    def take(self, chosen: Bools) -> _Matches:
        return _Matches(*(values[chosen] for values in self))


class _Found(NamedTuple):
    """A position, and what speaks for it."""

    matrix: Floats
    overlap: float
    agreeing: float
    fits: bool
    reason: str


class _Search:
    """The search for the position of one surface on the other."""

    def __init__(self, moving: _Surface, fixed: _Surface, overlap: float, scale: bool, report: Report) -> None:
        self.moving, self.fixed, self.overlap, self.scale, self.report = moving, fixed, overlap, scale, report
        self.unit = max(fixed.unit, 1e-300)

    def best(self, starts: Iterable[Floats]) -> _Found:
        """Search from some starts; return what the first gives if that fits, or the best of all."""
        every: list[_Found] = []
        for start in starts:
            every.append(self.judge(*self.fine(self.coarse(start))))
            if every[0].fits:
                break
        return max(every, key=lambda found: (found.fits, found.overlap * found.agreeing))

    def around(self, start: Floats) -> Iterator[Floats]:
        """Yield a start, then others around it, turned and shifted along the axes of the moving surface."""
        yield start
        size = np.linalg.norm(np.ptp(self.moving.places, axis=0))
        axes = eigh(self.moving.places.T @ self.moving.places)[1].T
        middle = self.moving.places.mean(axis=0)
        for axis in [*axes, *-axes]:
            yield start @ _shift(middle) @ _linear(_rotation(_TURN * axis)) @ _shift(-middle)
            yield start @ _shift(_SHIFT * size * axis)

    def coarse(self, matrix: Floats) -> Floats:
        """Bring the surfaces within a spacing or so, by kernels that narrow."""
        rows, width = (self.moving.coarse(), self.fixed.coarse()), 0.0
        for _ in range(_ROUNDS):
            self.report()
            pairs = self.matches(matrix, *rows)
            most = np.quantile(pairs.distance, self.overlap)
            width = width or _WIDEST * float(np.quantile(pairs.distance, 0.5 * self.overlap))
            facing = np.clip((pairs.cosine - _FACING) / (1.0 - _FACING), 0.0, 1.0)
            weight = _kernel(pairs.distance, width) * facing * (pairs.distance <= most)
            matrix, moved = self.step(matrix, pairs, weight)
            if width <= self.unit and moved < _STILL[0] * self.unit:
                break
            width = max(_NARROWER * width, self.unit)
        return matrix

    def fine(self, matrix: Floats) -> tuple[Floats, float]:
        """Bring the surfaces together; return how far the last round still moved them, too."""
        moved = np.inf
        for _ in range(_FINE_ROUNDS):
            self.report()
            pairs = self.matches(matrix)
            pairs = pairs.take((pairs.aside < _BESIDE) & (pairs.cosine > SMOOTH))
            matrix, moved = self.step(matrix, pairs, self.weight(pairs))
            if moved < _STILL[1] * self.unit:
                break
        return matrix, moved

    def weight(self, pairs: _Matches) -> Floats:
        """Return weights by the heights over their scatter, (k,)."""
        if not len(pairs.height):
            return np.zeros(0)
        return _kernel(pairs.height, _SPREAD * np.median(np.abs(pairs.height)) / 0.6745 + 1e-9 * self.unit)

    def step(self, matrix: Floats, pairs: _Matches, weight: Floats) -> tuple[Floats, float]:
        """Move by one step of Gauss and Newton; return the position and how far points moved."""
        if not weight.sum() > 0.0:
            return matrix, 0.0
        equations = _Equations(pairs, weight, self.scale)
        motion = equations.motion()
        moved: Floats = np.linalg.norm(_apply(motion, pairs.here) - pairs.here, axis=1)
        return motion @ matrix, float(moved.max())

    def matches(self, matrix: Floats, here: Ints | slice = slice(None), there: Ints | slice = slice(None)) -> _Matches:
        """Find the closest places to both surfaces' chosen ones on the other surface."""
        size = np.cbrt(det(matrix[:3, :3]))
        places, normals = _apply(matrix, self.moving.places), self.moving.normals @ matrix[:3, :3].T / size
        back = _apply(inv(matrix), self.fixed.places[there])
        forth_distance, forth = _closest(self.fixed.tree, places[here])
        back_distance, back_row = _closest(self.moving.tree, back)
        first = np.concatenate([np.arange(len(places))[here], back_row])
        second = np.concatenate([forth, np.arange(len(self.fixed.places))[there]])
        spacing = np.concatenate([self.fixed.spacing[forth], size * self.moving.spacing[back_row]])
        distance = np.concatenate([forth_distance, size * back_distance])
        return _pair_up(
            places[first], self.fixed.places[second], normals[first], self.fixed.normals[second], distance, spacing
        )

    def judge(self, matrix: Floats, moved: float) -> _Found:
        """Tell whether the surfaces agree where they overlap, and nothing slides."""
        pairs = self.matches(matrix)
        above, height = pairs.aside < _BESIDE, np.abs(pairs.height)
        agree = above & (pairs.cosine > SMOOTH) & (height < _TOGETHER * pairs.spacing)
        against = above & ~agree & (height < _NEAR * pairs.spacing)
        count = len(self.moving.places)
        overlap, both = float(agree[:count].mean()), float(agree.mean())
        agreeing = float(agree.sum() / max(int((agree | against).sum()), 1))
        fits, reason = agreeing >= _AGREEING and min(overlap, both) >= _FEWEST, ""
        if not fits:
            reason = (
                f"{overlap:.0%} of the points lie on the target's surface, and of those next to it {agreeing:.0%}."
                " Begin nearer to it, or from pairs of points."
            )
        elif self.slides(pairs.take(agree)):
            reason = "The surface can slide or turn on itself, as planes, cylinders and spheres can. Use more of it."
        elif moved > _TOGETHER * self.unit:
            reason = "The position is still moving. Begin nearer to it."
        return _Found(matrix, overlap, agreeing, fits, reason)

    def slides(self, pairs: _Matches) -> bool:
        """Tell whether some motion changes the heights no more than the scatter of the normals lets it seem."""
        weight = self.weight(pairs)
        least, scatter = _Equations(pairs, weight, self.scale).least(), float(np.average(pairs.scatter, weights=weight))
        return least < max(_SLIDING * scatter, 1e-6)


class _Equations:
    """The normal equations of a motion that takes the heights between pairs of places away, halved between both."""

    def __init__(self, pairs: _Matches, weight: Floats, scale: bool) -> None:
        self.here, self.there = (np.average(side, axis=0, weights=weight) for side in (pairs.here, pairs.there))
        left, right = pairs.here - self.here, pairs.there - self.there
        middle = 0.5 * (left + right)
        self.size = np.sqrt(np.average(np.einsum("ij,ij->i", middle, middle), weights=weight)) + 1e-300
        columns = [2.0 * np.cross(middle, pairs.normals) / self.size, pairs.normals]
        if scale:
            columns.append(np.einsum("ij,ij->i", middle, pairs.normals)[:, None] / self.size)
        slopes = np.concatenate(columns, axis=1)
        weighted = slopes * (weight / weight.sum())[:, None]
        self.matrix: Floats = weighted.T @ slopes
        self.right_side: Floats = -weighted.T @ np.einsum("ij,ij->i", left - right, pairs.normals)

    def least(self) -> float:
        """Mean square of the heights that the least visible motion of size one makes."""
        halved = self.matrix.copy()
        halved[:3] *= 0.5  # the rotation is done twice, once to each side
        halved[:, :3] *= 0.5
        return float(eigvalsh(halved)[0])

    def motion(self) -> Floats:
        """Solve for the motion, (4, 4); what is not determined stays as it is."""
        values, vectors = eigh(self.matrix)
        solution = vectors @ ((vectors.T @ self.right_side) / np.maximum(values, 1e-6 * values[-1] + 1e-300))
        turn, shift = solution[:3] / self.size, solution[3:6]
        angle = np.arctan(np.linalg.norm(turn))
        half = _rotation(turn * (angle / max(np.linalg.norm(turn), 1e-300)))
        growth = np.exp(solution[6] / self.size) if len(solution) > 6 else 1.0
        linear = growth * half @ half
        motion = _linear(linear)
        motion[:3, 3] = self.there + np.sqrt(growth) * np.cos(angle) * half @ shift - linear @ self.here
        return motion


def _pair_up(here: Floats, there: Floats, left: Floats, right: Floats, distance: Floats, spacing: Floats) -> _Matches:
    """Measure pairs of places with normals of any sign."""
    cosine = np.einsum("ij,ij->i", left, right)
    right = np.where(cosine < 0.0, -1.0, 1.0)[:, None] * right
    mean, apart = 0.5 * (left + right), 0.5 * (left - right)
    height = np.einsum("ij,ij->i", here - there, mean) / np.sqrt(np.einsum("ij,ij->i", mean, mean))
    aside = np.sqrt(np.maximum(distance**2 - height**2, 0.0)) / spacing
    scatter = np.einsum("ij,ij->i", apart, apart)
    return _Matches(here, there, mean, scatter, distance, height, aside, np.abs(cosine), spacing)


def _closest(tree: cKDTree, places: Floats) -> tuple[Floats, Ints]:
    """Return distance and row of the closest point to each place; threads are worth it for many."""
    return tree.query(places, workers=cores() if len(places) > _THREADED else 1)


def _kernel(values: Floats, width: float) -> Floats:
    """Weights of Geman and McClure: 1 at 0, 1/4 at the width."""
    square = width * width
    result: Floats = (square / (square + values * values + 1e-300)) ** 2
    return result


def _rotation(vector: Floats) -> Floats:
    """Rotation about a vector by its length in radians, (3, 3)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / max(angle, 1e-300)
    turn = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * turn + (1.0 - np.cos(angle)) * turn @ turn


def _apply(matrix: Array, points: Floats) -> Floats:
    result: Floats = points @ matrix[:3, :3].T + matrix[:3, 3]
    return result


def _linear(matrix: Floats) -> Floats:
    result = np.eye(4)
    result[:3, :3] = matrix
    return result


def _shift(offset: Floats) -> Floats:
    result = np.eye(4)
    result[:3, 3] = offset
    return result
