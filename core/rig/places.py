"""Where points lie on the surface of others, sheet by sheet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..algebra import blocks, on_all_cores
from ..arguments import as_doubles, check_array, check_finite, positive
from ..cores import cores
from ..errors import InvalidPointsError, PointCloudError
from ..frozen import Frozen
from ..geometry import COUNT, SMOOTH, as_mask, balanced_weights, find_nearest, frames
from ..operator import LaplaceBeltrami
from ..progress import ends_at_one
from ..types import Bools, Floats, Ints, Progress, Report
from .touching import apart, outward_normals

ANGLE = np.radians(30.0)  # between normals, of Abdrashitov et al.
_DIAGONAL = 0.05  # of the box around the source, of the same
_SPACINGS = 2.0  # at least, where that is finer than the points
_REACH = 1.5  # spacings around a point within which its quadric is the surface
_AROUND = 9  # neighbors that a value is interpolated from
_CLOSE = 1e-6  # of their reach: a place on a point takes its value
_LEVEL, _BEYOND = 1e-3, 2.0  # see `balanced_weights`
_BLOCK = 1 << 12


@dataclass(frozen=True)
class SurfaceMatch(Frozen):
    """Where points lie on the surface of others: of one source, or of several, one after another.

    Attributes
    ----------
    known : ndarray, (n,) bool
        Points with a place on the surface.
    distance : ndarray, (n,)
        From that place [L]; infinite without one.
    weights : csr_array, (n, m)
        Shares of the m points of the sources in the value at that place. Rows of known points sum to one, others are
        empty.
    nearest : ndarray, (n,) int
        Point of the sources that is nearest to that place, on the same sheet; -1 without one.
    limit : float
        Greatest distance [L] that was allowed.
    """

    known: Bools
    distance: Floats
    weights: sparse.csr_array
    nearest: Ints
    limit: float


@ends_at_one
def match_surface(
    target: LaplaceBeltrami,
    sources: LaplaceBeltrami | Sequence[LaplaceBeltrami],
    *,
    distance: float | None = None,
    angle: float = ANGLE,
    offsets: ArrayLike | None = None,
    members: Sequence[ArrayLike] | None = None,
    progress: Progress | None = None,
) -> SurfaceMatch:
    """Find the place of each point of a target on the surface of a source.

    Parameters
    ----------
    target : LaplaceBeltrami
        Of n points.
    sources : LaplaceBeltrami or sequence of them
        Of m points in all. The nearest surface counts.
    distance : float, optional
        Greatest distance of a point from its place [L]. By default 5 % of the diagonal of the box around the sources,
        or two of their spacings if that is more.
    angle : float
        Greatest angle between the normals of the point and of the surface there [radian], up to a right angle.
    offsets : array_like, (s, 3), optional
        From the points of each source to the same places in the coordinates of the target [L]; none by default.
    members : sequence of array_like, (m_i,) bool or (k,) int, optional
        Points of each source that have a value; all by default. A place among others teaches nothing.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    SurfaceMatch

    Raises
    ------
    InvalidPointsError
        Offsets or members of a wrong shape.
    PointCloudError
        No source, or a distance or angle out of range.

    See Also
    --------
    transfer_values, transfer_labels : What the points get then.

    Notes
    -----
    The surface is made of quadrics through the points of the source, within one spacing of each. Which sheet a point
    belongs to is decided by the distance to that surface, not to its points, among sheets whose normals agree, so that
    nothing is taken across the gap between nested sheets, nor from the other side of a contact. Where a surface is
    open, its normals may be reversed: most points of a component decide.

    References
    ----------
    Abdrashitov, Raichstat, Monsen, Hill. Robust skin weights transfer via weight inpainting. SIGGRAPH Asia 2023.

    Examples
    --------
    All points of one sample of the unit sphere have a place on another one, between its points:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> source = mf.build_laplacian(points)
    >>> match = mf.rig.match_surface(mf.build_laplacian(points[:, [1, 2, 0]]), source)
    >>> print(match.known.all(), match.distance.max() < 1e-2)
    True True
    """
    report = progress or (lambda stage, fraction: None)
    every = [sources] if isinstance(sources, LaplaceBeltrami) else list(sources)
    if not every:
        raise PointCloudError("There is no source. Give at least one to take values from.")
    given = positive(angle, "angle")
    if given > 0.5 * np.pi:
        raise PointCloudError(f"The angle is {angle} radians. Use one up to a right angle, 1.57.")
    shape = (len(every), 3)
    advice = f"Give x, y, z for each of {len(every)} sources."
    shifts = as_doubles(check_array(np.zeros(shape) if offsets is None else offsets, "Offsets", [shape], advice))
    check_finite(shifts, "offsets", advice)
    if members is not None and len(members) != len(every):
        raise InvalidPointsError(f"There are members of {len(members)} sources, and {len(every)} sources.")
    chosen = [np.ones(len(one.points), dtype=bool) for one in every] if members is None else members
    valid = [as_mask(have, len(one.points)) for have, one in zip(chosen, every, strict=True)]
    limit = usual_distance(every) if distance is None else positive(distance, "distance")
    parts, own = [], _sheets(target)
    for number, (one, shift, have) in enumerate(zip(every, shifts, valid, strict=True)):
        report("Places", number / len(every))
        parts.append(_match(target, own, one, shift, have, limit, np.cos(given), lambda: report("Places", 0.5)))
    return _joined(parts, limit)


def usual_distance(sources: Sequence[LaplaceBeltrami]) -> float:
    """Return the distance [L] within which points are matched by default: see `match_surface`."""
    kept = [one.component >= 0 for one in sources]
    diagonals = [np.linalg.norm(np.ptp(one.points[on], axis=0)) for one, on in zip(sources, kept, strict=True)]
    spacings = [np.sqrt(np.median(one.areas[on])) for one, on in zip(sources, kept, strict=True)]
    return float(max(_DIAGONAL * max(diagonals), _SPACINGS * max(spacings)))


@dataclass(frozen=True)
class _Sheets:
    """The points of a surface that the operator keeps, by sheets."""

    kept: Ints  # (m,), which points
    normals: Floats  # (m, 3)
    forms: Floats  # (m, 3, 3), shape operators, with the signs of these normals
    label: Ints  # (m,), number of the sheet of each
    open: Bools  # (sheets,), sheets with a boundary, whose normals may have either side
    # (sheets,), sheets of a component that has several, whose normals may have either side point by point, near a
    # contact
    mixed: Bools


def _sheets(laplacian: LaplaceBeltrami) -> _Sheets:
    kept = np.flatnonzero(laplacian.component >= 0)
    normals = outward_normals(laplacian)[kept]
    sign = np.einsum("ij,ij->i", normals, laplacian.normals[kept])
    stiffness, _ = apart(laplacian.stiffness[kept][:, kept], normals, laplacian.trust[kept])
    count, label = connected_components(stiffness, directed=False)
    ends = np.bincount(label, laplacian.boundary[kept], minlength=count) > 0.0
    owner = np.zeros(count, dtype=np.int64)
    owner[label] = laplacian.component[kept]
    forms = laplacian.shape_operator[kept] * sign[:, None, None]
    return _Sheets(kept, normals, forms, label, ends, np.bincount(owner)[owner] > 1)


def _match(
    target: LaplaceBeltrami,
    own: _Sheets,
    source: LaplaceBeltrami,
    shift: Floats,
    valid: Bools,
    limit: float,
    least: float,
    report: Report,
) -> SurfaceMatch:
    """Match points with one source: see `match_surface`; the angle by its least cosine."""
    other = _sheets(source)
    normals, forms, label, valid = other.normals, other.forms, other.label, valid[other.kept]
    near = find_nearest(source.surface_points[other.kept] + shift)
    points, reach = near.points, _REACH * near.spacing
    every = target.surface_points[own.kept]
    many = min(COUNT, len(points))
    count, width = len(every), min(_AROUND, many)
    first, distance, known = np.zeros(count, dtype=np.int64), np.empty(count), np.empty(count, dtype=bool)
    index, weight = np.empty((count, width), dtype=np.int64), np.empty((count, width))
    sign = _signs(own, other, near.tree.query(every, workers=cores()), limit)

    def match(block: slice) -> None:
        places, row = every[block], np.arange(len(every[block]))
        around = near.tree.query(places, k=many)[1]
        offset = places[:, None] - points[around]
        above = np.einsum("ikc,ikc->ik", offset, normals[around])
        along = offset - above[:, :, None] * normals[around]
        side = np.sqrt(np.einsum("ikc,ikc->ik", along, along))
        along *= np.minimum(reach[around] / np.maximum(side, 1e-300), 1.0)[:, :, None]
        slope = np.einsum("ikcd,ikd->ikc", forms[around], along)
        foot = points[around] + along - 0.5 * np.einsum("ikc,ikc->ik", along, slope)[:, :, None] * normals[around]
        there = normals[around] + slope
        cosine = np.einsum("ikc,ic->ik", there, own.normals[block]) / np.sqrt(np.einsum("ikc,ikc->ik", there, there))
        side = sign[own.label[block, None], label[around]]
        cosine = np.where(side == 0.0, np.abs(cosine), cosine * side)
        gap = np.where(cosine >= least, np.linalg.norm(places[:, None] - foot, axis=2), np.inf)
        best = gap.argmin(axis=1)
        foot, leader = foot[row, best], around[row, best]
        same = np.einsum("ikc,ic->ik", normals[around], normals[leader]) > SMOOTH
        same &= label[around] == label[leader, None]
        squared = np.where(same, np.sum((points[around] - foot[:, None]) ** 2, axis=2), np.inf)
        some = np.argpartition(squared, width - 1, axis=1)[:, :width]
        chosen = np.take_along_axis(around, some, axis=1)
        share = _shares(points[chosen] - foot[:, None], np.take_along_axis(squared, some, axis=1), normals[leader])
        index[block], weight[block] = chosen, share
        first[block] = around[row, squared.argmin(axis=1)]
        distance[block] = gap[row, best]
        known[block] = (distance[block] <= limit) & ~((share != 0.0) & ~valid[chosen]).any(axis=1)

    on_all_cores(match, blocks(count, _BLOCK), report)
    rows, n = own.kept[known], len(target.points)
    weights = sparse.csr_array(
        (weight[known].ravel(), (np.repeat(rows, width), other.kept[index[known].ravel()])),
        shape=(n, len(source.points)),
    )
    weights.eliminate_zeros()
    found, away, nearest = np.zeros(n, dtype=bool), np.full(n, np.inf), np.full(n, -1)
    found[rows], away[rows], nearest[rows] = True, distance[known], other.kept[first[known]]
    return SurfaceMatch(found, away, weights, nearest, limit)


def _signs(own: _Sheets, other: _Sheets, found: tuple[Floats, Ints], limit: float) -> Floats:
    """Return 1 or -1 for each pair of sheets: whether normals agree as they are, or the other way round; 0 for both.

    Normals of closed bodies point outwards and stay as they are. Those of open sheets are reversed where more points
    lie on a surface with reversed normals than on others.
    """
    distance, nearest = found
    close = distance <= limit
    agreement = np.zeros((len(own.open), len(other.open)))
    cosine = np.einsum("ij,ij->i", own.normals[close], other.normals[nearest[close]])
    np.add.at(agreement, (own.label[close], other.label[nearest[close]]), cosine)
    for_it = np.maximum(agreement, 0.0).sum(axis=1, keepdims=True)
    either = (own.open[:, None] | other.open) & (-agreement > for_it)
    return np.where(own.mixed[:, None] | other.mixed, 0.0, np.where(either, -1.0, 1.0))


def _shares(offset: Floats, squared: Floats, normals: Floats) -> Floats:
    """Return weights, (b, k), of neighbors in a value at a place, by offsets and their squares, infinite for none."""
    finite = np.isfinite(squared)
    reach = np.where(finite, squared, 0.0).max(axis=1, keepdims=True) * 1.01 + 1e-290
    size = np.where(finite, squared, reach)
    weight = np.where(finite, (1.0 - size / reach) / (size + _CLOSE**2 * reach), 0.0)
    weight /= weight.sum(axis=1, keepdims=True)
    flat = np.einsum("ijk,ikl->lij", offset, frames(normals)[:, :, 1:])
    return balanced_weights(weight, flat, _LEVEL, _BEYOND)


def _joined(parts: Sequence[SurfaceMatch], limit: float) -> SurfaceMatch:
    """Take the nearest surface of several sources for each point."""
    distance = np.stack([part.distance for part in parts])
    chosen, row = distance.argmin(axis=0), np.arange(distance.shape[1])
    begin = np.cumsum([0, *(part.weights.shape[1] for part in parts)])
    weights = sparse.hstack(
        [sparse.diags_array((chosen == number).astype(float)) @ part.weights for number, part in enumerate(parts)],
        format="csr",
    )
    weights.eliminate_zeros()
    nearest = np.stack([part.nearest for part in parts])[chosen, row]
    return SurfaceMatch(
        np.stack([part.known for part in parts])[chosen, row],
        distance[chosen, row],
        weights,
        np.where(nearest >= 0, nearest + begin[chosen], -1),
        limit,
    )
