"""The curves in which a plane cuts the surface, with their lengths and the area that they enclose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import check_plane
from ..distance import polygon_length
from ..frozen import Frozen
from ..geometry import frames
from ..operator import ImplicitSurface, LaplaceBeltrami
from ..progress import ends_at_one
from ..surface import mesh_surface
from ..types import Bools, Floats, Progress, Report
from .iso_lines import IsoLine, iso_lines

_SIDE = 0.25  # spacings between corners, at most, so that polygons are close to curves
_ROUNDS = 3  # of moving corners onto the surface
_STEP = 0.5  # spacings that a corner moves in one of them, at most
_FLAT = 0.1  # sine of the angle between plane and surface below which the place of the curve is in doubt
_TOUCHING = 0.01  # share of corners in such a place before it is said
_SHORT = 1.0  # spacings that a curve is long, at least


class SectionCurve(NamedTuple):
    """A curve in which a plane cuts the surface.

    Attributes
    ----------
    points : ndarray, (k, 3)
        Corners of a polygon in their order, on the plane and on the surface [L].
    closed : bool
        Whether the last corner is joined to the first.
    length : float
        Of the polygon [L].
    enclosed_area : float
        Of the polygon [L^2]: negative for a hole, which lies inside an odd number of others; 0 for an open curve.
    """

    points: Floats
    closed: bool
    length: float
    enclosed_area: float


@dataclass(frozen=True)
class CrossSection(Frozen):
    """The curves in which a plane cuts the surface.

    Attributes
    ----------
    curves : list of SectionCurve
        The longest first.
    length : float
        Of all of them [L].
    enclosed_area : float
        Of all closed ones, holes subtracted [L^2].
    notices : list of str
        Texts for the user: open curves, and where the plane only touches the surface.
    """

    curves: list[SectionCurve]
    length: float
    enclosed_area: float
    notices: list[str]


@ends_at_one
def cross_section(
    laplacian: LaplaceBeltrami,
    point: ArrayLike,
    normal: ArrayLike,
    *,
    progress: Progress | None = None,
) -> CrossSection:
    """Cut the surface of points by a plane.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points. The signs of its normals do not matter.
    point : array_like, (3,)
        A point of the plane [L].
    normal : array_like, (3,)
        Vector across the plane, of any length.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    CrossSection
        Without curves where the plane passes beside the surface.

    Raises
    ------
    InvalidPointsError
        A point or normal of another shape, that is not finite, or a normal of length zero.
    PointCloudError
        So few points that there is no mesh of them.
    NotEnoughMemoryError
        More points than the free memory is enough for, before the start.

    See Also
    --------
    enclosed_volume : The volume within the whole surface.
    iso_lines : Lines on a mesh along which any function is the same.

    Notes
    -----
    The height over the plane is a function on a mesh of the surface, and the curves are its lines of height zero. Their
    corners are then moved within the plane onto the quadrics of the points, to which they are as close as those to the
    surface. Where the plane only touches the surface, the place of the curve is ill determined, which is said.

    Examples
    --------
    Half above its middle, the section of the unit sphere is a circle of radius sqrt(3 / 4):

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> found = mf.measure.cross_section(mf.build_laplacian(points), [0, 0, 0.5], [0, 0, 1])
    >>> print(len(found.curves), round(found.enclosed_area / np.pi, 2))
    1 0.75
    """
    place, across = check_plane(point, normal)
    report = progress or (lambda stage, fraction: None)
    mesh = mesh_surface(laplacian, progress=progress)
    report("Section", 0.95)
    spacing = float(np.sqrt(np.median(laplacian.areas[laplacian.component >= 0])))
    lines = iso_lines(mesh.vertices, mesh.faces, (mesh.vertices - place) @ across, [0.0])
    lines = [line._replace(points=_finer(line, _SIDE * spacing)) for line in lines]
    lines, flat = _onto(ImplicitSurface(laplacian, spacing), lines, across, lambda: report("Section", 0.97))
    kept = [line for line in lines if _length(line) > _SHORT * spacing]
    kept.sort(key=_length, reverse=True)
    areas = _areas(kept, frames(across[None])[0, :, 1:], place)
    curves = [
        SectionCurve(line.points, line.closed, _length(line), float(area))
        for line, area in zip(kept, areas, strict=True)
    ]
    return CrossSection(
        curves=curves,
        length=sum(curve.length for curve in curves),
        enclosed_area=float(areas.sum()),
        notices=mesh.notices + _notices(curves, len(lines) - len(kept), flat),
    )


def _onto(
    surface: ImplicitSurface, lines: list[IsoLine], across: Floats, report: Report
) -> tuple[list[IsoLine], float]:
    """Move the corners of lines within the plane onto the surface.

    Return them, and the share of the corners where the plane only touches the surface.
    """
    if not lines:
        return [], 0.0
    places = surface.scaled(np.concatenate([line.points for line in lines]))
    for _ in range(_ROUNDS):
        there = surface.heights(places, report)
        slope = there.normal - (there.normal @ across)[:, None] * across
        steep = np.linalg.norm(slope, axis=1)
        step = np.clip(there.height / np.maximum(steep, _FLAT), -_STEP * there.spacing, _STEP * there.spacing)
        places -= (step / np.maximum(steep, 1e-300))[:, None] * slope
    ends = np.cumsum([len(line.points) for line in lines])[:-1]
    moved = np.split(surface.placed(places), ends)
    found = [line._replace(points=points) for line, points in zip(lines, moved, strict=True)]
    return found, float(np.mean(steep < _FLAT))


def _sides(line: IsoLine) -> Floats:
    """Return the corners of a line, with the first one again at the end if it is closed."""
    return np.concatenate([line.points, line.points[: int(line.closed)]])


def _length(line: IsoLine) -> float:
    """Return the length of a line, with its last side if it is closed."""
    return polygon_length(_sides(line))


def _finer(line: IsoLine, longest: float) -> Floats:
    """Return the corners of a line, (k, 3), with more of them along sides that are too long."""
    corners = _sides(line)
    parts = np.ceil(np.linalg.norm(np.diff(corners, axis=0), axis=1) / longest).astype(int)
    at = np.concatenate([[0], np.cumsum(np.maximum(parts, 1))])
    places = np.arange(at[-1] + int(not line.closed))
    return np.column_stack([np.interp(places, at, column) for column in corners.T])


def _areas(lines: list[IsoLine], axes: Floats, place: Floats) -> Floats:
    """Return the areas, (l,), that lines enclose in the plane of axes, (3, 2): negative for holes, 0 if open."""
    loops = [(line.points - place) @ axes if line.closed else np.zeros((1, 2)) for line in lines]
    first = np.array([loop[0] for loop in loops]).reshape(-1, 2)
    closed = np.array([line.closed for line in lines], dtype=bool)
    sizes, depth = np.zeros(len(lines)), np.zeros(len(lines), dtype=int)
    for number in np.flatnonzero(closed):
        loop = loops[number]
        ahead = np.roll(loop, -1, axis=0)
        sizes[number] = 0.5 * abs(float(np.sum(loop[:, 0] * ahead[:, 1] - loop[:, 1] * ahead[:, 0])))
        inside = closed & (first > loop.min(axis=0)).all(axis=1) & (first < loop.max(axis=0)).all(axis=1)
        inside[number] = False
        depth[inside] += _within(first[inside], loop, ahead)
    return np.where(depth % 2 == 1, -sizes, sizes)


def _within(places: Floats, begin: Floats, end: Floats) -> Bools:
    """Return which places, (k, 2), lie within a polygon, by how many of its sides a ray crosses, (k,) bool."""
    offset = places[:, None, 1] - begin[:, 1]
    crossed = (offset < 0.0) != (places[:, None, 1] - end[:, 1] < 0.0)
    rise = np.where(crossed, end[:, 1] - begin[:, 1], 1.0)
    meets = begin[:, 0] + offset / rise * (end[:, 0] - begin[:, 0])
    ahead = crossed & (meets > places[:, None, 0])
    result: Bools = np.count_nonzero(ahead, axis=1) % 2 == 1
    return result


def _notices(curves: list[SectionCurve], short: int, flat: float) -> list[str]:
    """Return texts on curves that are open, that are left out, or whose place is in doubt."""
    result = []
    opened = sum(not curve.closed for curve in curves)
    if opened:
        result.append(
            f"{opened} of {len(curves)} curves of the section are open, where the points end: they enclose no area."
        )
    if short:
        result.append(f"{short} curves shorter than the distance between points are left out of the section.")
    if flat > _TOUCHING:
        result.append(
            f"At {flat:.0%} of its corners the plane only touches the surface: there the section is in doubt. Move or"
            " turn the plane a little."
        )
    return result
