"""How much each point follows each bone of an armature: heat that bones give off and the surface spreads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..algebra import blocks, on_all_cores, solve_columns, sparsify
from ..arguments import as_doubles, check_array, check_finite, check_switches, not_negative, positive, whole
from ..errors import InvalidPointsError, PointCloudError
from ..geometry import nearest_rows
from ..operator import LaplaceBeltrami, followers
from ..progress import ends_at_one
from ..types import Bools, Floats, Ints, Progress
from .inside import Inside
from .touching import apart, outward_normals

_SAME = 1e-3  # of the distance to the nearest bone, within which others are as near
_ACCURACY = 2e-4  # of the equations: weights are right to 1e-4
_BLOCK = 1 << 12
_SAMPLES = 64  # places along a bone that are inside or not
_INSIDE = 0.5  # winding number from which a place is inside
_BESIDE = 5e-4  # keeps bones in front of a point at a finite distance
_SMALL = 0.05  # of the extent of the points: bones that extend less may have another scale
_RESOLVED = 3.0  # smoothing lengths, the radius of the kernel: narrower blends would be jumps between points
_FLOOR = 1e-3  # of the spacing: a bone may pass through a point


@ends_at_one
def bone_weights(
    laplacian: LaplaceBeltrami,
    heads: ArrayLike,
    tails: ArrayLike,
    *,
    falloff: float = 1.0,
    visible: bool = True,
    influences: int | None = None,
    least: float = 0.0,
    notices: list[str] | None = None,
    progress: Progress | None = None,
) -> Floats:
    """Find how much each point of a surface follows each bone.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    heads, tails : array_like, (b, 3)
        Ends of the bones [L], in the space of the points.
    falloff : float
        Width of the blend between two bones, in distances to the nearest bone; above zero. No blend is narrower than
        the kernel, so that weights do not jump from a point to the next.
    visible : bool
        A bone warms only points that it reaches without leaving the body, and only its part within the body counts.
    influences : int, optional
        Most bones that a point follows; all by default.
    least : float
        Smaller weights become zero, from 0 to below 1; the largest of a point stays.
    notices : list of str, optional
        Gets texts about points that see no bone, and about bones that are small beside the points.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n, b)
        Weights from 0 to 1; rows sum to one. Points that the operator leaves out have those of the nearest one.

    Raises
    ------
    InvalidPointsError
        Ends of another shape, not finite, or none.
    PointCloudError
        A falloff that is not above zero, influences below one, or a least weight of 1 and more; bones farther from the
        points than either extends.

    See Also
    --------
    skin : Moves the points with the bones.
    smooth_weights, inpaint : Change weights that are there.
    nearest_bones : For few points, which are no surface.

    Notes
    -----
    Heat on the surface in equilibrium: ``Delta w + 2 (p - w) / (f d)^2 = 0`` with the falloff f, the distance d to the
    nearest bone that a point sees, and p one for that bone, shared where several are as near, and zero for the others.
    The product f d is three smoothing lengths at least. Points that see no bone take what flows from around. The matrix
    has nothing positive off its diagonal, so that weights lie between 0 and 1 and sum to one by themselves. What lies
    inside is told by winding numbers of areas and normals, so that it needs no faces. On a component of which no point
    sees a bone, that is not asked for.

    References
    ----------
    Baran, Popovic. Automatic rigging and animation of 3D characters. ACM Trans. Graph. 26, 2007.

    Examples
    --------
    Two bones along the axis of the unit ball share its points by halves:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> weights = mf.rig.bone_weights(laplacian, [[0, 0, -0.8], [0, 0, 0]], [[0, 0, 0], [0, 0, 0.8]])
    >>> print(weights[[0, 400, 799], 1].round(1), np.allclose(weights.sum(axis=1), 1))
    [1.  0.5 0. ] True
    """
    report = progress or (lambda stage, fraction: None)
    heads, tails = check_bones(heads, tails)
    width = positive(falloff, "falloff")
    check_switches(visible=visible)
    most = len(heads) if influences is None else whole(influences)
    least = not_negative(least, "least weight")
    if not most >= 1 or least >= 1.0:
        raise PointCloudError(
            f"Points follow {influences} bones with weights from {least} on. Use at least one, and less than 1."
        )
    most = int(min(most, len(heads)))
    report("Bones", 0.0)
    laplacian = replace(laplacian, normals=outward_normals(laplacian))
    kept = np.flatnonzero(laplacian.component >= 0)
    told = _check_extents(laplacian.points, np.concatenate([heads, tails]))
    distance, near, unseen = _seen_bones(laplacian, kept, heads, tails, visible, report)
    if notices is not None:
        notices += told + ([_unseen_text(unseen, len(kept))] if unseen else [])
    blend = np.maximum(width * distance, _RESOLVED * laplacian.smoothing_lengths[kept])
    heat = 2.0 * laplacian.areas[kept] * near.sum(axis=1) / blend**2
    result = np.empty((len(laplacian.points), len(heads)))
    result[kept] = _equilibrium(laplacian, kept, heat, near, report)
    lone, leader = followers(laplacian.points, laplacian.component)
    result[lone] = result[leader]
    np.maximum(result, 0.0, out=result)  # the solution is right to its accuracy only
    return strongest(result / result.sum(axis=1, keepdims=True), most, least)


def nearest_bones(points: ArrayLike, heads: ArrayLike, tails: ArrayLike) -> Floats:
    """Let each point follow the nearest bone alone, or those that are as near: for few points, which are no surface.

    Parameters
    ----------
    points : array_like, (n, 3)
    heads, tails : array_like, (b, 3)
        Ends of the bones [L], in the space of the points.

    Returns
    -------
    ndarray, (n, b)
        Weights from 0 to 1; rows sum to one.

    Raises
    ------
    InvalidPointsError
        Points, or ends of bones, of another shape or not finite, or none.
    PointCloudError
        Bones farther from the points than either extends.

    See Also
    --------
    bone_weights : Blends them along a surface.

    Examples
    --------
    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> weights = mf.rig.nearest_bones(points[[0, 799]], [[0, 0, -0.8], [0, 0, 0]], [[0, 0, 0], [0, 0, 0.8]])
    >>> print(weights[:, 1])
    [1. 0.]
    """
    places = as_doubles(check_array(points, "Points", [(None, 3)], "Give x, y, z of each point."))
    check_finite(places, "points", "Delete these points.")
    heads, tails = check_bones(heads, tails)
    if not len(places):
        raise InvalidPointsError("There are no points. Give at least one.")
    _check_extents(places, np.concatenate([heads, tails]))
    return _nearest_to_all(places, heads, tails, 0.0, lambda stage, fraction: None)[1].toarray()


def check_bones(heads: ArrayLike, tails: ArrayLike) -> tuple[Floats, Floats]:
    """Return the ends of bones, (b, 3) each.

    Another shape, different numbers of both, none, or those that are not finite raise `InvalidPointsError`.
    """
    advice = "Give x, y, z of one head and one tail for each bone."
    first = as_doubles(check_array(heads, "Heads", [(None, 3)], advice))
    second = as_doubles(check_array(tails, "Tails", [(len(first), 3)], advice))
    if not len(first):
        raise InvalidPointsError("There are no bones. Give the head and tail of at least one.")
    for ends, name in ((first, "heads"), (second, "tails")):
        check_finite(ends, name, advice)
    return first, second


def strongest(weights: Floats, most: int | Ints, least: float) -> Floats:
    """Return weights, (n, b), of which so many of each row, and none below the least, are left.

    The largest stays, and rows have the sum that they had.
    """
    result = np.maximum(weights, 0.0)
    total = result.sum(axis=1, keepdims=True)
    if np.min(most) < result.shape[1]:
        order = np.argsort(-result, axis=1, kind="stable")
        rank = np.empty_like(order)
        np.put_along_axis(rank, order, np.arange(result.shape[1])[None], axis=1)
        result[rank >= np.reshape(most, (-1, 1))] = 0.0
    result[(result < least) & (result < result.max(axis=1, keepdims=True))] = 0.0
    left = result.sum(axis=1, keepdims=True)
    return result * (total / np.where(left > 0.0, left, 1.0))


def _check_extents(points: Floats, ends: Floats) -> list[str]:
    """Return a notice of bones that are small beside the points; refuse those that are far away."""
    low, high = (np.array([part(points, axis=0), part(ends, axis=0)]) for part in (np.min, np.max))
    size, extent = np.linalg.norm(high - low, axis=1)
    gap = np.linalg.norm(np.maximum(low.max(axis=0) - high.min(axis=0), 0.0))
    if gap > max(size, extent):
        raise PointCloudError(
            f"The bones are {gap:.3g} away from the points. The points extend over {size:.3g}, the bones over"
            f" {extent:.3g}. Bring both to the same place and scale."
        )
    if extent < _SMALL * size:
        return [
            f"The bones extend over {extent:.3g} only, the points over {size:.3g}. See whether both are of one scale."
        ]
    return []


def _seen_bones(
    laplacian: LaplaceBeltrami, kept: Ints, heads: Floats, tails: Floats, visible: bool, report: Progress
) -> tuple[Floats, sparse.csr_array, int]:
    """Return how far the nearest bone is that each kept point sees, (m,), and shares of those as near, (m, b).

    Rows of shares sum to one; those of points that see no bone, whose number is the third result, are empty. Where no
    point sees any, all take the nearest bones.
    """
    points, normals = laplacian.surface_points[kept], laplacian.normals[kept]
    floor = _FLOOR * np.sqrt(np.median(laplacian.areas[kept]))
    if visible:
        inside = Inside(laplacian, lambda: report("Bones", 0.05))
        starts = points - inside.cell * normals
        ends = _parts_inside(heads, tails, inside)
        found = _nearest_bones(points, normals, ends, floor, lambda rows, ends: inside.sees(starts[rows], ends), report)
        if found[1].nnz:
            return *found, int(np.count_nonzero(np.diff(found[1].indptr) == 0))
    found = _nearest_to_all(points, heads, tails, floor, report)
    return *found, len(points) if visible else 0


def _nearest_to_all(
    points: Floats, heads: Floats, tails: Floats, floor: float, report: Progress
) -> tuple[Floats, sparse.csr_array]:
    """Return the same as `_nearest_bones` of points that see all bones."""
    return _nearest_bones(
        points, None, (heads, tails), floor, lambda rows, ends: np.ones(len(rows), dtype=bool), report
    )


def _unseen_text(unseen: int, count: int) -> str:
    """Return the notice of points that see no bone."""
    if unseen == count:
        return (
            "No point sees a bone from inside the body, so that all take the nearest ones. Move the bones inside, or"
            " orient the normals outwards."
        )
    return (
        f"{unseen:,} of {count:,} points see no bone without leaving the body: their weights come from the points"
        " around them."
    )


def _parts_inside(heads: Floats, tails: Floats, inside: Inside) -> tuple[Floats, Floats]:
    """Return bones cut off where they leave the body at their ends; those that are all outside stay."""
    share = np.linspace(0.0, 1.0, _SAMPLES)
    within = inside.at(heads[:, None] + share[:, None] * (tails - heads)[:, None]) > _INSIDE
    within[~within.any(axis=1)] = True
    first, last = share[within.argmax(axis=1)], share[::-1][within[:, ::-1].argmax(axis=1)]
    return heads + first[:, None] * (tails - heads), heads + last[:, None] * (tails - heads)


def _nearest_bones(
    points: Floats,
    normals: Floats | None,
    bones: tuple[Floats, Floats],
    floor: float,
    sees: Callable[[Ints, Floats], Bools],
    report: Progress,
) -> tuple[Floats, sparse.csr_array]:
    """Return the distance of points to the nearest bone seen, (m,), at least the floor, and shares, (m, b).

    With normals a bone straight below a point is the nearest, and counts farther the more it lies beside it.
    """
    distance = np.ones(len(points))

    def find(block: slice) -> tuple[Ints, Ints]:
        near = _nearest_places(points[block], *bones)
        away = points[block, None] - near
        gap = np.maximum(np.linalg.norm(away, axis=2), floor)
        if normals is not None:
            gap /= 0.5 + _BESIDE + 0.5 * np.einsum("ibc,ic->ib", away, normals[block]) / gap
        order = np.argsort(gap, axis=1, kind="stable")
        seen = np.zeros(gap.shape, dtype=bool)
        open_ = np.arange(len(gap))
        for bone in order.T:
            of = bone[open_]
            clear = sees(block.start + open_, near[open_, of])
            done, first = open_[clear], of[clear]
            distance[block.start + done] = gap[done, first]
            # Bones that meet in a joint are as near.
            seen[done] = np.abs(gap[done] - gap[done, first][:, None]) <= _SAME * gap[done, first][:, None]
            open_ = open_[~clear]
            if not len(open_):
                break
        row, column = np.nonzero(seen)
        return block.start + row, column

    found = on_all_cores(find, blocks(len(points), _BLOCK), lambda: report("Bones", 0.1))
    row, column = (np.concatenate(part) for part in zip(*found, strict=True))
    count = np.bincount(row, minlength=len(points))
    near = sparse.csr_array((1.0 / count[row], (row, column)), shape=(len(points), len(bones[0])))
    return distance, near


def _nearest_places(points: Floats, first: Floats, last: Floats) -> Floats:
    """Return the place on each bone that is nearest to each point, (m, b, 3)."""
    along = last - first
    squared = np.maximum(np.einsum("bc,bc->b", along, along), np.finfo(float).tiny)
    share = (points @ along.T - np.einsum("bc,bc->b", first, along)) / squared
    return first + np.clip(share, 0.0, 1.0)[:, :, None] * along


def _equilibrium(
    laplacian: LaplaceBeltrami, kept: Ints, heat: Floats, near: sparse.csr_array, report: Progress
) -> Floats:
    """Return the weights of points in equilibrium, (m, b); components without heat have those of the nearest other."""
    points = laplacian.surface_points[kept]
    matrix = sparsify(laplacian.stiffness[kept][:, kept])
    stiffness, unsure = apart(matrix, laplacian.normals[kept], laplacian.trust[kept])
    heat = np.where(unsure, 0.0, heat)
    component = connected_components(stiffness, directed=False)[1]
    warm = np.bincount(component, heat)[component] > 0.0
    rows, cold = np.flatnonzero(warm), np.flatnonzero(~warm)
    rows = rows[cKDTree(points[rows]).indices]  # neighbors near in memory make the products faster
    matrix = (stiffness[rows][:, rows] + sparse.diags_array(heat[rows])).tocsr()
    load = (sparse.diags_array(heat[rows]) @ near[rows]).toarray()
    result = np.empty(near.shape)
    result[rows] = solve_columns(matrix, load, _ACCURACY, lambda share: report("Weights", 0.3 + 0.7 * share))
    if len(cold):
        result[cold] = result[rows[nearest_rows(points[rows], points[cold])]]
    return result
