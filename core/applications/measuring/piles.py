"""The volume between a part of the surface and a plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ...arguments import check_plane
from ...errors import InvalidPointsError
from ...geometry import as_mask
from ...operator import LaplaceBeltrami
from ...types import Bools, Floats, Ints
from .regions import STRIP, SurfaceMeasures
from .volume import NOISE

_NEAR = 7  # nearest points, the point itself among them, of which one is beyond the rim


@dataclass(frozen=True)
class Pile:
    """The volume between a part of the surface and a plane.

    Attributes
    ----------
    above, below : float
        On the side that the normal of the plane points to, and on the other one; of the plane through the rim on the
        side that most of the part lies on, and on the other one. Neither is negative [L^3].
    uncertainty : float
        The difference of both is expected within this [L^3]: what the edge of the part, the trust in areas and noise
        leave open, and that the rim is not plane.
    """

    above: float
    below: float
    uncertainty: float


def pile_volume(
    laplacian: LaplaceBeltrami,
    members: ArrayLike,
    *,
    plane: tuple[ArrayLike, ArrayLike] | None = None,
    measures: SurfaceMeasures | None = None,
) -> Pile:
    """Measure the volume between a part of the surface and a plane, as of a heap on the ground.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    members : array_like, (n,) bool or (k,) int
        The points of the part.
    plane : pair of array_like, (3,), optional
        A point of the plane [L], and a vector of any length across it. Without one, the plane through the rim of the
        part.
    measures : SurfaceMeasures, optional
        Of the same operator, kept for many parts: what does not depend on the part.

    Returns
    -------
    Pile

    Raises
    ------
    InvalidPointsError
        Members of another kind, none on the surface, a point or vector of another kind, or without a plane fewer than
        three points at the rim: there is none through them.

    See Also
    --------
    enclosed_volume : The volume within a closed surface.
    measure_region : Area and boundary of the part.

    Notes
    -----
    The sum of area elements, projected onto the plane, times heights above it. The rim are the points on both sides of
    the line between members and others, and those at the boundary of the surface; the plane is fitted to them by least
    squares. One through all members would have as much above it as below. A part that overhangs its rim is measured
    right if its normals point to one side.

    Examples
    --------
    Half of the unit ball, 2 pi / 3, and with a cylinder of height 1 below it, 5 pi / 3:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> laplacian = core.build_laplacian(points)
    >>> found = core.pile_volume(laplacian, points[:, 2] > 0)
    >>> print(round(found.above, 1), found.below < 0.1)
    2.1 True
    >>> found = core.pile_volume(laplacian, points[:, 2] > 0, plane=([0, 0, -1], [0, 0, 1]))
    >>> print(round(found.above, 1), found.below)
    5.2 0.0
    """
    chosen = as_mask(members, len(laplacian.points)) & (laplacian.component >= 0)
    if not chosen.any():
        raise InvalidPointsError(
            f"None of the {len(chosen)} points of the surface is a member, so there is nothing to measure. Choose some."
        )
    whole = measures or SurfaceMeasures(laplacian)
    points, rim = laplacian.surface_points, _rim(whole, chosen)
    if plane is None:
        place, axis = _fitted(points[rim], int(np.count_nonzero(chosen)))
    else:
        if not isinstance(plane, (tuple, list, np.ndarray)) or len(plane) != 2:
            raise InvalidPointsError("The plane is no pair. Give a point of it and a vector across it.")
        place, axis = check_plane(*plane)
    height, facing = (points - place) @ axis, laplacian.normals @ axis
    column = np.where(chosen, laplacian.areas * height * facing, 0.0)
    above, below = (abs(float(column[side].sum())) for side in (height > 0.0, height <= 0.0))
    off = _doubt(whole, chosen, rim, np.abs(height * facing), np.abs(facing))
    if plane is None:
        off += float(np.sqrt(np.mean(height[rim] ** 2))) * abs(float(laplacian.areas[chosen] @ facing[chosen]))
        above, below = max(above, below), min(above, below)
    return Pile(above, below, off)


def _rim(whole: SurfaceMeasures, chosen: Bools) -> Ints:
    """Return the points on both sides of the line around a part, and of the part at the surface's boundary."""
    laplacian, near = whole.laplacian, whole.around(chosen)
    end = np.flatnonzero(chosen & laplacian.boundary)
    if not len(near):
        return end
    points = laplacian.surface_points[near]
    beside = near[cKDTree(points).query(points, k=np.arange(1, min(_NEAR, len(near)) + 1))[1]]
    apart = (chosen[beside] != chosen[near, None]) & (laplacian.component[beside] == laplacian.component[near, None])
    result: Ints = np.union1d(near[apart.any(axis=1)], end)
    return result


def _fitted(rim: Floats, count: int) -> tuple[Floats, Floats]:
    """Return a point and the unit normal of the plane through the rim of a part of so many points."""
    if len(rim) < 3:
        raise InvalidPointsError(
            f"The part of {count} points has {len(rim)} points at its rim, through which there is no plane. Choose a"
            " part of the surface that ends somewhere, or a plane."
        )
    middle = rim.mean(axis=0)
    axis: Floats = np.linalg.eigh((rim - middle).T @ (rim - middle))[1][:, 0]
    return middle, axis


def _doubt(whole: SurfaceMeasures, chosen: Bools, rim: Ints, high: Floats, facing: Floats) -> float:
    """Return what the volume over a plane leaves open, by the heights above projected areas, and the projections.

    A point tells only by its spacing where the part ends: for areas see `measure_region`. Half of the rim's points lie
    within one spacing of the line on each side.
    """
    laplacian, spacing = whole.laplacian, whole.spacing
    noise = NOISE * np.linalg.norm(laplacian.surface_points - laplacian.points, axis=1)
    systematic = whole.area_doubts * high + STRIP * spacing * np.abs(whole.boundary_lengths) * high
    systematic += whole.areas * noise * facing
    edge = float(np.sqrt(0.5 * np.sum((high[rim] * spacing[rim] ** 2) ** 2)))
    return float(np.hypot(edge, systematic[chosen].sum()))
