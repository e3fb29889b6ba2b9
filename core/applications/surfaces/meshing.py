"""A mesh of the surface that the points lie on: surface nets on a sparse grid near the points."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ...algebra import blocks, on_all_cores
from ...arguments import positive
from ...cores import cores
from ...errors import NotEnoughMemoryError, PointCloudError
from ...geometry import Prolongation, check_points
from ...memory import available_memory
from ...operator import ImplicitSurface, LaplaceBeltrami
from ...types import Bools, Floats, Ints, Progress
from .sides import find_sides

_BAND = 1.8  # voxels on both sides of the surface: an edge of the grid that it cuts ends within one
_REACH = 3.0  # spacings along the surface around a point: wider gaps are holes
_COVERED = 1.5  # voxels between a point and the next cut, at most, where a mesh passes
_BARE = 0.05  # share of the points that may stay without a mesh; less than 0.002 do where sides are found
_ROUNDS = 2  # of moving vertices onto the surface, after which errors are a thousandth of a voxel
_FRAGMENT = 20.0  # Voronoi cells that a component of the mesh covers at least: smaller ones are left out
_FEWEST = 20  # faces of a mesh
_CANDIDATES = 1 << 20  # corners of the grid examined at one time
_BYTES = 1200  # of memory for each voxel of the grid that meets the surface, at the peak
_SHARE = 0.8  # of the free memory, which other programs need as well


class SurfaceMesh(NamedTuple):
    """A mesh of a surface.

    Attributes
    ----------
    vertices : ndarray, (m, 3)
        Positions on the surface [L].
    faces : ndarray, (q, 4) int
        Quads, by their vertices: counterclockwise as seen against the normals.
    """

    vertices: Floats
    faces: Ints


def mesh_surface(laplacian: LaplaceBeltrami, detail: float = 1.0, *, progress: Progress | None = None) -> SurfaceMesh:
    """Make a mesh of the surface that the points lie on.

    Quadrics of near points give the distance of corners of a regular grid from the surface, in a narrow band around
    it, and which of them are on the same side: signs of normals do not matter. Each voxel that the surface cuts gets
    a vertex and each cut edge a quad (surface nets); the vertices are then moved onto the surface, to which they are as
    close as the quadrics: an error of third order in the spacing. Where the points end, at a boundary or at gaps of
    several spacings, the mesh ends too.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        The mesh is oriented to the side that most of its normals point to. Points that it leaves out are not used.
    detail : float
        Voxels along the median spacing of the points: 2 gives four times as many faces as 1.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    SurfaceMesh

    Raises
    ------
    PointCloudError
        A detail that is not above zero, or so fine or so coarse that there is no mesh.
    NotEnoughMemoryError
        More voxels than the free memory is enough for, before the start.

    See Also
    --------
    values_on_mesh : Interpolates functions on the points at the vertices.
    surface_discs : Draws a surface without a mesh.

    References
    ----------
    S. F. F. Gibson, Constrained elastic surface nets, 1998; R. Kolluri, Provably good moving least squares, 2008.

    Examples
    --------
    A mesh of the unit sphere has no boundary and no handles, vertices - edges + faces = 2, where each quad has two
    edges to itself:

    >>> import numpy as np
    >>> import core
    >>> points = core.example_sphere()
    >>> mesh = core.mesh_surface(core.build_laplacian(points))
    >>> print(len(mesh.vertices) - len(mesh.faces))
    2
    >>> print(np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1).max() < 1e-3)
    True
    """
    report = progress or (lambda stage, fraction: None)
    size = positive(detail, "detail of the mesh")
    report("Grid", 0.5)
    kept = laplacian.component >= 0
    spacing = np.sqrt(np.median(laplacian.areas[kept]))
    voxel = spacing / size
    places = laplacian.areas[kept].sum() / voxel**2
    _check_memory(places, size)
    surface = ImplicitSurface(laplacian, voxel)
    grid, keys = _band(surface, lambda: report("Grid", 0.55))
    cuts = _cuts(surface, grid, keys, lambda: report("Grid", 0.7))
    report("Faces", 0.85)
    vertices, faces = _without_fragments(*_quads(grid, *cuts), _FRAGMENT * size**2)
    if not len(faces) or places < _FEWEST:
        raise PointCloudError(
            f"The {np.count_nonzero(kept)} points give no mesh at a detail of {size:g}: voxels are larger than the"
            " surface, or too few points lie between its edges. Raise the detail, or add points."
        )
    vertices = _onto(surface, vertices, _boundary(faces), lambda: report("Faces", 0.9))
    return SurfaceMesh(surface.placed(vertices), faces)


def values_on_mesh(
    laplacian: LaplaceBeltrami, vertices: ArrayLike, *, progress: Callable[[], None] | None = None
) -> Prolongation:
    """Prepare to interpolate functions on the points at the vertices of their mesh, along the surface.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
    vertices : array_like, (m, 3)
        Positions on or near the surface [L].
    progress : callable, optional
        Called without arguments, repeatedly; may raise `Cancelled`.

    Returns
    -------
    Prolongation
        Its `interpolate` and `labels` take values on the n points and return those at the n points and then at the m
        vertices.

    Raises
    ------
    InvalidPointsError
        Vertices of a wrong shape or not finite.

    See Also
    --------
    mesh_surface : Computes the vertices.
    """
    places = np.concatenate([laplacian.points, check_points(vertices)])
    subset = np.arange(len(laplacian.points))
    return Prolongation(places, subset, laplacian.normals, laplacian.component, progress=progress)


def _check_memory(places: float, detail: float) -> None:
    """Refuse a mesh that needs more than the free memory."""
    free = available_memory()
    if free is not None and _BYTES * places > _SHARE * free:
        raise NotEnoughMemoryError(
            f"A mesh at a detail of {detail:g} would take about {_BYTES * places / 2**30:.1f} GB of memory, and"
            f" {free / 2**30:.1f} GB are free. Lower the detail, or free memory.",
            fitting=int(_SHARE * free / _BYTES),
        )


class _Grid:
    """Corners of voxels of size one, numbered by int64, (k,)."""

    def __init__(self, points: Floats, margin: float) -> None:
        self.low = np.floor(points.min(axis=0)) - margin
        counts = np.ceil(np.ptp(points, axis=0)) + 2.0 * margin + 2.0
        if np.prod(counts) > 2.0**62:
            raise PointCloudError(
                "The extent of the points is too large relative to their spacing for a grid. Delete distant points, or"
                " lower the detail."
            )
        self.steps = np.array([counts[1] * counts[2], counts[2], 1.0]).astype(np.int64)

    def keys(self, corners: Floats) -> Ints:
        """Return the numbers of corners, (..., 3) float whole numbers as from `corners`."""
        return (corners - self.low).astype(np.int64) @ self.steps

    def corners(self, keys: Ints) -> Floats:
        """Return the positions of corners, (k, 3) float."""
        first, rest = np.divmod(keys, self.steps[0])
        second, third = np.divmod(rest, self.steps[1])
        return np.column_stack([first, second, third]) + self.low


def _band(surface: ImplicitSurface, report: Callable[[], None]) -> tuple[_Grid, Ints]:
    """Return a grid and its corners near the surface as sorted numbers: within gaps of the points, and above them."""
    reach = _REACH * surface.spacing + 1.0
    grid = _Grid(surface.points, np.ceil(reach.max()) + 3.0)
    order = np.argsort(grid.keys(np.floor(surface.points / 8.0) * 8.0), kind="stable")  # neighbours work together
    half = np.ceil(np.hypot(reach, _BAND)).astype(int)
    tasks = []
    for size in np.unique(half):
        rows = order[half[order] == size]
        across = np.arange(-size, size + 1)
        steps = np.stack(np.meshgrid(across, across, across, indexing="ij"), axis=-1).reshape(-1, 3)
        tasks += [(rows[block], steps) for block in blocks(len(rows), max(_CANDIDATES // len(steps), 1))]

    def near(task: tuple[Ints, Ints]) -> Ints:
        rows, steps = task
        corner = np.round(surface.points[rows])
        shift = surface.points[rows] - corner
        normals = surface.normals[rows]
        squared = -2.0 * shift @ steps.T + (steps * steps).sum(axis=1) + (shift * shift).sum(axis=1)[:, None]
        height = normals @ steps.T - np.einsum("ij,ij->i", normals, shift)[:, None]
        bend = surface.half_curvature(rows)[:, None] * squared
        inside = (np.abs(height) < _BAND + bend) & (squared < (reach[rows] ** 2 + _BAND**2)[:, None])
        row, step = np.nonzero(inside)
        return np.unique(grid.keys(corner)[row] + (steps @ grid.steps)[step])

    found = on_all_cores(near, tasks, report)
    return grid, np.unique(np.concatenate(found))


def _cuts(
    surface: ImplicitSurface, grid: _Grid, keys: Ints, report: Callable[[], None]
) -> tuple[Ints, Ints, Bools, Floats, Bools]:
    """Find the edges of the grid that the surface cuts.

    Returns
    -------
    ndarrays, (k,) int, (k,) int, (k,) bool, (k, 3), (k,) bool
        The corner each begins at, its axis, whether the outer side is ahead along it, where it is cut, and whether
        the surface there is that of the points.
    """
    corners = grid.corners(keys)
    there = surface.heights(corners, report)
    edges = []
    for axis, step in enumerate(grid.steps):
        place = np.minimum(np.searchsorted(keys, keys + step), len(keys) - 1)
        begin = np.flatnonzero(keys[place] == keys + step)
        edges.append((begin, place[begin], np.full(len(begin), axis)))
    first, second, axis = (np.concatenate(part) for part in zip(*edges, strict=True))
    wrong = np.zeros(len(surface.points), dtype=bool)
    for around in True, False:
        surface.flip(wrong)  # as they were
        side = find_sides(surface, there, corners, first, second, around)
        wrong = np.bincount(there.nearest, side * there.height, len(surface.points)) < 0.0
        surface.flip(wrong)
        edge, cut, belongs = _between(surface, corners, first, second, axis, side, report)
        # Paths around that lead through a gap instead of around a thin part lose the surface between.
        if _bare(surface, cut[belongs]) <= _BARE:
            break
    return keys[first[edge]], axis[edge], side[first[edge]] < 0.0, cut, belongs


def _between(
    surface: ImplicitSurface,
    corners: Floats,
    first: Ints,
    second: Ints,
    axis: Ints,
    side: Floats,
    report: Callable[[], None],
) -> tuple[Ints, Floats, Bools]:
    """Find the edges between corners on two sides.

    Returns
    -------
    ndarrays, (k,) int, (k, 3), (k,) bool
        Their numbers, where they are cut, and whether the surface there is that of the points.
    """
    edge = np.flatnonzero(side[first] != side[second])
    first, second, axis = first[edge], second[edge], axis[edge]
    cut, nearest = corners[first], surface.nearest(0.5 * (corners[first] + corners[second]))
    low, high = surface.over(nearest, corners[first]), surface.over(nearest, corners[second])
    crossed = (low < 0.0) != (high < 0.0)  # elsewhere it is closed around sharp edges
    cut[np.arange(len(cut)), axis] += np.where(crossed, low / np.where(crossed, low - high, 1.0), 0.5)
    return edge, cut, surface.heights(cut, report).belongs


def _bare(surface: ImplicitSurface, cut: Floats) -> float:
    """Return the share of points without a cut near them, which get no mesh."""
    if not len(cut):
        return 1.0
    apart = cKDTree(cut).query(surface.points, distance_upper_bound=_COVERED, workers=cores())[0]
    return np.mean(np.isinf(apart))


def _quads(grid: _Grid, begin: Ints, axis: Ints, forward: Bools, cut: Floats, belongs: Bools) -> tuple[Floats, Ints]:
    """Return the vertices of the voxels that are cut, each the mean of its cuts, and a quad around each that belongs.

    A voxel that several sheets cut has a vertex for each.
    """
    own, second, third = (grid.steps[(axis + shift) % 3] for shift in range(3))
    around = begin[:, None] - np.stack([np.zeros_like(second), second, second + third, third], axis=1)
    sides = np.stack([begin, begin - second, begin - third, begin], axis=1)  # faces of voxels between those around
    sides = 3 * sides + np.stack([axis + 1, axis + 2, axis + 1, axis + 2], axis=1) % 3
    inner = np.where(forward, begin, begin + own)
    corner = _joined(around, sides.ravel(), np.repeat(inner, 4))
    count = np.bincount(corner)
    total = [np.bincount(corner, np.repeat(column, 4)) for column in cut.T]
    vertices = np.column_stack(total) / count[:, None]
    faces = corner.reshape(-1, 4)
    faces = np.where(forward[:, None], faces, faces[:, ::-1])[belongs]
    return vertices, faces


def _joined(around: Ints, sides: Ints, inner: Ints) -> Ints:
    """Number the vertices of quads so that each of their edges has two quads at most, (4 q,) int.

    Parameters
    ----------
    around : ndarray, (q, 4) int
        Voxels of the corners of quads.
    sides : ndarray, (4 q,) int
        What each edge, from one corner to the next, crosses: a face between two voxels.
    inner : ndarray, (4 q,) int
        The corner of the grid below the surface at each. Where four quads meet, two sheets pass: those of a quad and of
        the other one around the same corner.
    """
    _, meeting, count = np.unique(sides, return_inverse=True, return_counts=True)
    meeting = meeting.reshape(-1)
    several = np.where(count[meeting] > 2, inner, -1)
    order = np.lexsort([several, meeting])
    same = (np.diff(meeting[order]) == 0) & (np.diff(several[order]) == 0)
    ends = np.arange(4 * len(around)).reshape(-1, 4)
    ends = np.stack([ends, np.roll(ends, -1, axis=1)], axis=2).reshape(-1, 2)
    ends = np.take_along_axis(ends, np.argsort(around.ravel()[ends], axis=1), axis=1)[order]
    first, second = ends[:-1][same].ravel(), ends[1:][same].ravel()
    graph = sparse.coo_array((np.ones(len(first), dtype=bool), (first, second)), shape=(around.size, around.size))
    return connected_components(graph, directed=False)[1]


def _without_fragments(vertices: Floats, faces: Ints, least: float) -> tuple[Floats, Ints]:
    """Leave out the components of less than so many faces, and all vertices without faces."""
    count = len(vertices)
    edges = (np.ones(3 * len(faces), dtype=bool), (np.repeat(faces[:, 0], 3), faces[:, 1:].ravel()))
    label = connected_components(sparse.coo_array(edges, shape=(count, count)), directed=False)[1][faces[:, 0]]
    faces = faces[np.bincount(label)[label] >= least] if len(faces) else faces
    used, faces = np.unique(faces, return_inverse=True)
    return vertices[used], faces.reshape(-1, 4).astype(np.int32)


def _boundary(faces: Ints) -> Ints:
    """Return the vertices at edges of one face, (k,) int."""
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1).astype(np.int64)
    keys, count = np.unique(edges[:, 0] << 32 | edges[:, 1], return_counts=True)
    lone = keys[count == 1]
    return np.unique(np.concatenate([lone >> 32, lone & 0xFFFFFFFF]))


def _onto(surface: ImplicitSurface, vertices: Floats, ends: Ints, report: Callable[[], None]) -> Floats:
    """Move vertices onto the surface, and those at ends of the mesh to the boundary if there is one within a voxel."""
    for _ in range(_ROUNDS):
        there = surface.heights(vertices[ends], report)
        ahead = np.where(np.abs(there.beyond) < 2.0, there.beyond, 0.0)
        vertices[ends] -= ahead[:, None] * there.outward
        there = surface.heights(vertices, report)
        vertices -= np.clip(there.height, -0.5, 0.5)[:, None] * there.normal
    return vertices
