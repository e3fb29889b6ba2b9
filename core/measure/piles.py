"""The volume between a part of the surface and a plane, or another surface."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from ..arguments import as_doubles, check_array, check_plane
from ..errors import InvalidPointsError
from ..frozen import Frozen
from ..geometry import as_mask
from ..linalg import eigh
from ..operator import LaplaceBeltrami
from ..types import Bools, Floats, Ints
from .regions import SurfaceMeasures, measures_of
from .volume import NOISE

_OPEN = 0.05  # of the volume: what a strip as wide as the part, beyond where the surface ends, adds at most untold
_NEAR = 7  # nearest points, the point itself among them, of which one is beyond the rim


@dataclass(frozen=True)
class Pile(Frozen):
    """The volume between a part of the surface and a plane, or another surface.

    Attributes
    ----------
    above, below : float
        On the side that the normal of the plane points to, and on the other one; of the plane through the rim on the
        side that most of the part lies on, and on the other one. Neither is negative [L^3].
    uncertainty : float
        The difference of both is expected within this [L^3]: what the edge of the part, the trust in areas and noise
        leave open, and that the rim is not plane, or not quite where the points end.
    notices : list of str
        Texts for the user: where the surface ends off the plane, and where another one has no height.
    """

    above: float
    below: float
    uncertainty: float
    notices: list[str] = field(default_factory=list)


def pile_volume(
    laplacian: LaplaceBeltrami,
    members: ArrayLike,
    *,
    plane: tuple[ArrayLike, ArrayLike] | None = None,
    heights: ArrayLike | None = None,
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
    heights : array_like, (n,), optional
        Heights above another surface, along the vector across the plane, to be measured from instead of the plane [L];
        not finite where that surface is not known. `surface_deviation` with that vector as normals gives them.

    Returns
    -------
    Pile

    Raises
    ------
    InvalidPointsError
        Members of another kind, none on the surface, none with a height, a point or vector of another kind, heights
        without a plane, or without one fewer than three points at the rim: there is none through them.

    See Also
    --------
    enclosed_volume : The volume within a closed surface.
    measure_region : Area and boundary of the part.

    Notes
    -----
    The sum of area elements, projected onto the plane, times heights above it. The rim are the points on both sides of
    the line between members and others, and those at the boundary of the surface; the plane is fitted to them by least
    squares. One through all members would have as much above it as below. A part that overhangs its rim is measured
    right if its normals point to one side. Where the surface itself ends within the part, off the plane, a piece may be
    missing: its volume is not known, and a notice says so.

    Examples
    --------
    Half of the unit ball, 2 pi / 3, and with a cylinder of height 1 below it, 5 pi / 3:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> found = mf.measure.pile_volume(laplacian, points[:, 2] > 0)
    >>> print(round(found.above, 1), found.below < 0.1)
    2.1 True
    >>> found = mf.measure.pile_volume(laplacian, points[:, 2] > 0, plane=([0, 0, -1], [0, 0, 1]))
    >>> print(round(found.above, 1), found.below)
    5.2 0.0
    """
    chosen = as_mask(members, len(laplacian.points)) & (laplacian.component >= 0)
    if not chosen.any():
        raise InvalidPointsError(
            f"None of the {len(chosen)} points of the surface is a member, so there is nothing to measure. Choose some."
        )
    whole = measures_of(laplacian)
    points, rim = laplacian.surface_points, _rim(whole, chosen)
    if plane is None:
        if heights is not None:
            raise InvalidPointsError("Heights are given, but no plane whose normal they are along. Give one.")
        place, axis = _fitted(points[rim], int(np.count_nonzero(chosen)))
    else:
        if not isinstance(plane, (tuple, list, np.ndarray)) or len(plane) != 2:
            raise InvalidPointsError("The plane is no pair. Give a point of it and a vector across it.")
        place, axis = check_plane(*plane)
    height, facing = (points - place) @ axis, laplacian.normals @ axis
    notices: list[str] = []
    if heights is not None:
        advice = f"Give one real number for each of {len(points)} points."
        height = as_doubles(check_array(heights, "Heights", [(len(points),)], advice))
        chosen, notices = _with_height(whole, chosen, height, np.abs(facing))
        height, rim = np.where(chosen, height, 0.0), rim[chosen[rim]]
    column = np.where(chosen, laplacian.areas * height * facing, 0.0)
    above, below = (abs(float(column[side].sum())) for side in (height > 0.0, height <= 0.0))
    off = _doubt(whole, chosen, rim, np.abs(height * facing), np.abs(facing))
    if plane is None:
        base = abs(float(laplacian.areas[chosen] @ facing[chosen]))
        slope = np.sqrt(1.0 - np.minimum(facing[rim] ** 2, 1.0))
        # Points at the surface's own boundary lie half a spacing within it.
        inside = np.where(laplacian.boundary[rim], 0.5 * whole.spacing[rim] * slope, 0.0)
        off += (float(np.sqrt(np.mean(height[rim] ** 2))) + float(inside.mean())) * base
        above, below = max(above, below), min(above, below)
    return Pile(above, below, off, notices + _open(whole, chosen, height, np.abs(facing)))


def _with_height(whole: SurfaceMeasures, chosen: Bools, height: Floats, facing: Floats) -> tuple[Bools, list[str]]:
    """Return which members have a height, (n,) bool, and a notice of the others."""
    known = chosen & np.isfinite(height)
    if not known.any():
        raise InvalidPointsError(
            f"None of the {np.count_nonzero(chosen)} points of the part has the other surface above or below it. Move"
            " them onto each other."
        )
    missing = np.count_nonzero(chosen & ~known)
    if not missing:
        return known, []
    base = whole.areas * facing
    return known, [
        f"{missing:,} of {np.count_nonzero(chosen):,} points of the part, with {base[chosen & ~known].sum():.3g} of its"
        f" {base[chosen].sum():.3g} as seen along the vertical, have nothing of the other surface above or below them:"
        " no volume is measured there."
    ]


def _open(whole: SurfaceMeasures, chosen: Bools, height: Floats, facing: Floats) -> list[str]:
    """Return a notice if the surface ends within a part, (n,) bool, at some height, as where a piece is missing."""
    length = np.where(chosen & (np.abs(height) > whole.spacing), whole.boundary_lengths, 0.0)
    base, volume = (
        float(np.sum(values[chosen])) for values in (whole.areas * facing, whole.areas * facing * abs(height))
    )
    if float(length @ np.abs(height)) * np.sqrt(base) <= _OPEN * volume:
        return []
    ends = chosen & (length > 0.0)
    return [
        f"The surface ends within the part along {length.sum():.3g}, up to {np.abs(height[ends]).max():.3g} off what"
        " its volume is measured from. If a piece is missing there, its volume is not in the number, nor in the"
        " uncertainty."
    ]


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
    axis: Floats = eigh((rim - middle).T @ (rim - middle))[1][:, 0]
    return middle, axis


def _doubt(whole: SurfaceMeasures, chosen: Bools, rim: Ints, high: Floats, facing: Floats) -> float:
    """Return what the volume over a plane leaves open, by the heights above projected areas, and the projections.

    A point tells only by its spacing where the part ends: for areas see `measure_region`. Half of the rim's points lie
    within one spacing of the line on each side.
    """
    laplacian, spacing = whole.laplacian, whole.spacing
    noise = NOISE * np.linalg.norm(laplacian.surface_points - laplacian.points, axis=1)
    systematic = whole.area_doubts * high + np.abs(whole.boundary_doubts) * high
    systematic += whole.areas * noise * facing
    edge = float(np.sqrt(0.5 * np.sum((high[rim] * spacing[rim] ** 2) ** 2)))
    return float(np.hypot(edge, systematic[chosen].sum()))
