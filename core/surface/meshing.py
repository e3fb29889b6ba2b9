"""A mesh of the surface that the points lie on: surface nets on a grid near the points, finer where these are."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..arguments import check_points, positive
from ..cores import cores
from ..errors import NotEnoughMemoryError, TooFewPointsError
from ..frozen import Frozen
from ..geometry import Prolongation
from ..memory import available_memory
from ..operator import ImplicitSurface, LaplaceBeltrami
from ..progress import ends_at_one
from ..types import Array, Bools, Floats, Ints, Progress
from .grid import Grid, Levels, count_corners, grid_around, octaves_of
from .quads import all_quads
from .sides import find_sides

_COVERED = 1.5  # voxels between a point and the next cut, at most, where a mesh passes
_BARE = 0.05  # share of the points that may stay without a mesh; less than 0.002 do where sides are found
_TOLD = 0.02  # share of them beyond which it is told
_ROUNDS = 2  # of moving vertices onto the surface, after which errors are a thousandth of a voxel
_FRAGMENT = 20.0  # Voronoi cells that a component of the mesh covers at least: smaller ones are left out
_FEWEST = 20  # faces of a mesh
_BYTES = 700  # of memory for each corner of the grid, at the peak
_ALONE = 30_000_000  # bytes that the smallest mesh takes
_SHARE = 0.8  # of the free memory, which other programs need as well


@dataclass(frozen=True)
class SurfaceMesh(Frozen):
    """A mesh of a surface, which unpacks to its vertices and faces.

    Attributes
    ----------
    vertices : ndarray, (m, 3)
        Positions on the surface [L].
    faces : ndarray, (q, 4) int
        Quads, by their vertices: counterclockwise as seen against the normals.
    notices : list of str
        Texts for the user: points without a mesh near them.
    """

    vertices: Floats
    faces: Ints
    notices: list[str] = field(default_factory=list)

    def __iter__(self) -> Iterator[Array]:
        return iter((self.vertices, self.faces))


@ends_at_one
def mesh_surface(laplacian: LaplaceBeltrami, detail: float = 1.0, *, progress: Progress | None = None) -> SurfaceMesh:
    """Make a mesh of the surface that the points lie on.

    It is kept by the operator, until another detail is asked for.

    Quadrics of near points give the distance of corners of a grid from the surface, in a narrow band around it, and
    which of them are on the same side: signs of normals do not matter. Voxels are as wide as the median spacing of the
    points; where this varies much, as wide as that of the points there, to a factor of two: those of an octree. Each
    voxel that the surface cuts gets a vertex and each cut edge a face (surface nets); where a voxel meets smaller ones,
    sides of faces are divided so that all are quads; the vertices are then moved onto the surface, to which they are as
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
        A detail that is not above zero, or so fine that there is no mesh.
    TooFewPointsError
        Points too far apart for a mesh of that detail.
    NotEnoughMemoryError
        A grid of more corners than the free memory is enough for, before the start.

    See Also
    --------
    values_on_mesh : Interpolates functions on the points at the vertices.
    surface_discs : Draws a surface without a mesh.

    References
    ----------
    S. F. F. Gibson, Constrained elastic surface nets, 1998; R. Kolluri, Provably good moving least squares, 2008;
    T. Ju, F. Losasso, S. Schaefer, J. Warren, Dual contouring of Hermite data, 2002.

    Examples
    --------
    A mesh of the unit sphere has no boundary and no handles, vertices - edges + faces = 2, where each quad has two
    edges to itself:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> mesh = mf.surface.mesh_surface(mf.build_laplacian(points))
    >>> print(len(mesh.vertices) - len(mesh.faces))
    2
    >>> print(np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1).max() < 1e-3)
    True
    """
    size = positive(detail, "detail of the mesh")
    return laplacian.kept.result("mesh", lambda: _mesh(laplacian, size, progress), size)


def _mesh(laplacian: LaplaceBeltrami, size: float, progress: Progress | None) -> SurfaceMesh:
    """Make the mesh."""
    report = progress or (lambda stage, fraction: None)
    report("Grid", 0.5)
    kept = laplacian.component >= 0
    voxel = np.sqrt(np.median(laplacian.areas[kept])) / size
    surface = ImplicitSurface(laplacian, voxel)
    areas = laplacian.areas[kept] / voxel**2
    usual = size * np.median(surface.local_spacing / np.sqrt(areas))
    octaves = octaves_of(surface, areas, usual)
    _check_memory(count_corners(surface, areas, 2.0**octaves), size)
    levels = Levels(surface.points, octaves)
    width: Array = levels.unit * 2.0 ** levels.at_points(surface.points)
    _check_memory(count_corners(surface, areas, width), size)  # more of them next to smaller voxels
    grid = grid_around(surface, levels, lambda: report("Grid", 0.55))
    cuts = _cuts(surface, grid, width, lambda: report("Grid", 0.7))
    report("Faces", 0.85)
    vertices, faces, sizes = _without_fragments(*_polygons(grid, cuts), _FRAGMENT * size**2)
    if not len(faces) or len(faces) < _FEWEST:
        raise TooFewPointsError(
            f"The {np.count_nonzero(kept)} points give no mesh at a detail of {size:g}: voxels are larger than the"
            " surface, or too few points lie between its edges. Add points; where there are many, raise the detail."
        )
    vertices, faces, sizes = all_quads(vertices, faces, sizes)
    vertices = _onto(surface, vertices, _boundary(faces), sizes, lambda: report("Faces", 0.9))
    bare = _bare(surface, np.concatenate([vertices, vertices[faces].mean(axis=1)]), width)
    return SurfaceMesh(surface.placed(vertices), faces, _notices(bare))


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


def _check_memory(corners: float, detail: float) -> None:
    """Refuse a mesh that needs more than the free memory."""
    free, needed = available_memory(), _ALONE + _BYTES * corners
    if free is not None and needed > _SHARE * free:
        raise NotEnoughMemoryError(
            f"A mesh at a detail of {detail:g} would take about {needed / 2**30:.3g} GB of memory, and"
            f" {free / 2**30:.3g} GB are free. Lower the detail, or free memory.",
            fitting=max(int((_SHARE * free - _ALONE) / _BYTES), 0),
        )


class _Cuts(NamedTuple):
    """The edges of a grid that a surface cuts."""

    edges: Ints  # (k,)
    ahead: Bools  # (k,), whether the outer side is ahead along them
    places: Floats  # (k, 3), where they are cut
    belongs: Bools  # (k,), whether the surface there is that of the points


def _cuts(surface: ImplicitSurface, grid: Grid, width: Array, report: Callable[[], None]) -> _Cuts:
    """Find the edges of a grid that the surface cuts, by the width of the voxels at the points, (m,)."""
    there = surface.heights(grid.places, report)
    wrong = np.zeros(len(surface.points), dtype=bool)
    for around in True, False:
        surface.flip(wrong)  # as they were
        side = find_sides(surface, there, grid, around)
        wrong = np.bincount(there.nearest, side * there.height, len(surface.points)) < 0.0
        surface.flip(wrong)
        cuts = _between(surface, grid, side, report)
        # Paths around that lead through a gap instead of around a thin part lose the surface between.
        if np.mean(_bare(surface, cuts.places[cuts.belongs], width)) <= _BARE:
            break
    return cuts


def _between(surface: ImplicitSurface, grid: Grid, side: Floats, report: Callable[[], None]) -> _Cuts:
    """Find the edges between corners on two sides, (c,)."""
    edges = np.flatnonzero(side[grid.first] != side[grid.second])
    first, second, axis, length = (values[edges] for values in (grid.first, grid.second, grid.axis, grid.length))
    places, nearest = grid.places[first], surface.nearest(0.5 * (grid.places[first] + grid.places[second]))
    low, high = surface.over(nearest, grid.places[first]), surface.over(nearest, grid.places[second])
    crossed = (low < 0.0) != (high < 0.0)  # elsewhere it is closed around sharp edges
    share = np.where(crossed, low / np.where(crossed, low - high, 1.0), 0.5)
    places[np.arange(len(edges)), axis] += length * share
    return _Cuts(edges, side[first] < 0.0, places, surface.heights(places, report).belongs)


def _bare(surface: ImplicitSurface, places: Floats, width: Array) -> Bools:
    """Tell which points have no mesh near them, whose places are given, by the width of the voxels there, (m,) bool."""
    if not len(places):
        return np.ones(len(surface.points), dtype=bool)
    apart = cKDTree(places).query(surface.points, distance_upper_bound=_COVERED * width.max(), workers=cores())[0]
    return apart > _COVERED * width


def _notices(bare: Bools) -> list[str]:
    """Return a text on the points without a mesh, (n,) bool, if there are more than a few."""
    share = np.mean(bare)
    if share <= _TOLD:
        return []
    return [
        f"The mesh misses {np.count_nonzero(bare):,} of {len(bare):,} points ({share:.0%}). Where sheets are close,"
        " raise the detail; points that fill a volume have no surface."
    ]


def _polygons(grid: Grid, cuts: _Cuts) -> tuple[Floats, Ints, Floats]:
    """Return the vertices of the voxels that are cut, each the mean of its cuts, and a face around each that belongs.

    A voxel that several sheets cut has a vertex for each. A face has three vertices where one voxel is larger than the
    others around an edge: two that follow each other are the same.

    Returns
    -------
    ndarrays, (v, 3), (q, 4) int, (v,)
        Vertices, faces, and the lengths of the edges around each vertex.
    """
    corner = _joined(grid, cuts)
    count = np.bincount(corner)
    total = [np.bincount(corner, np.repeat(column, 4)) for column in (*cuts.places.T, grid.length[cuts.edges])]
    values = np.column_stack(total) / count[:, None]
    faces = corner.reshape(-1, 4)
    faces = np.where(cuts.ahead[:, None], faces, faces[:, ::-1])[cuts.belongs]
    return values[:, :3], faces, values[:, 3]


def _joined(grid: Grid, cuts: _Cuts) -> Ints:
    """Number the vertices around cut edges so that each edge of a face has another face at most, (4 k,) int.

    Each edge from one vertex to the next passes a face between two voxels. As many pass it as edges around it are cut;
    where these are more than two, several sheets do: one around each row of corners below the surface.
    """
    around, level = grid.around(cuts.edges)
    voxel, count = grid.levels.keys(around), len(around)
    begin, axis, length = (values[cuts.edges] for values in (grid.corners[grid.first], grid.axis, grid.length))
    ends = np.arange(4 * count).reshape(-1, 4)
    ends = np.stack([ends, np.roll(ends, -1, axis=1)], axis=2).reshape(-1, 2)
    one, other = voxel.ravel()[ends].T
    inside = np.flatnonzero(one == other)
    passing = np.flatnonzero(one != other)

    # The face is that of the smaller voxel; it lies across the second or the third axis.
    small = np.where(level.ravel()[ends[passing, 0]] <= level.ravel()[ends[passing, 1]], *ends[passing].T)
    level, low = level.ravel()[small], around.reshape(-1, 3)[small]
    edge, row = passing // 4, np.arange(len(passing))
    across = (axis[edge] + np.where(passing % 2 == 0, 1, 2)) % 3
    low[row, across] = begin[edge, across]
    _, face, number = np.unique(3 * grid.levels.keys(low) + across, return_inverse=True, return_counts=True)
    face = face.reshape(-1)

    # Around the face, counterclockwise: where its outline goes below the surface, and where it comes back next.
    angle, enters = np.zeros(len(passing)), np.zeros(len(passing), dtype=bool)
    several = np.flatnonzero(number[face] > 2)
    wide = 0.5 * 2.0 ** level[several]
    middle = low[several] + wide[:, None]
    half = 0.5 * length[edge[several]] / grid.levels.unit
    along = np.eye(3)[axis[edge[several]]]
    offset = begin[edge[several]] + half[:, None] * along - middle
    toward = np.where(cuts.ahead[edge[several]], -1.0, 1.0)[:, None] * along
    plane = (across[several, None] + [1, 2]) % 3
    (x, y), (u, v) = (np.take_along_axis(vector, plane, axis=1).T for vector in (offset, toward))
    angle[several] = np.arctan2(y, x)
    enters[several] = x * v - y * u > 0.0
    order = np.lexsort([angle, face])
    start = np.cumsum(number) - number
    late = order[start[(number > 2) & ~enters[order[start]]]]
    angle[late] += 2.0 * np.pi
    order = np.lexsort([angle, face])
    first = np.flatnonzero((np.arange(len(order)) - start[face[order]]) % 2 == 0)
    first = first[first + 1 < len(order)]
    first = first[face[order[first]] == face[order[first + 1]]]
    ends = np.take_along_axis(ends, np.argsort(voxel.ravel()[ends], axis=1), axis=1)
    pairs = ends[passing[order]]
    one, other = (np.concatenate([pairs[first + shift].ravel(), ends[inside, shift]]) for shift in range(2))
    graph = sparse.coo_array((np.ones(len(one), dtype=bool), (one, other)), shape=(4 * count,) * 2)
    return connected_components(graph, directed=False)[1]


def _without_fragments(vertices: Floats, faces: Ints, sizes: Floats, least: float) -> tuple[Floats, Ints, Floats]:
    """Leave out the components of less than so many faces, and all vertices without faces."""
    count = len(vertices)
    edges = (np.ones(3 * len(faces), dtype=bool), (np.repeat(faces[:, 0], 3), faces[:, 1:].ravel()))
    label = connected_components(sparse.coo_array(edges, shape=(count, count)), directed=False)[1][faces[:, 0]]
    faces = faces[np.bincount(label)[label] >= least] if len(faces) else faces
    used, faces = np.unique(faces, return_inverse=True)
    return vertices[used], faces.reshape(-1, 4).astype(np.int32), sizes[used]


def _boundary(faces: Ints) -> Ints:
    """Return the vertices at edges of one face, (k,) int."""
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1).astype(np.int64)
    keys, count = np.unique(edges[:, 0] << 32 | edges[:, 1], return_counts=True)
    lone = keys[count == 1]
    return np.unique(np.concatenate([lone >> 32, lone & 0xFFFFFFFF]))


def _onto(surface: ImplicitSurface, vertices: Floats, ends: Ints, sizes: Floats, report: Callable[[], None]) -> Floats:
    """Move vertices onto the surface, and those at ends of the mesh to the boundary if there is one within a voxel."""
    for _ in range(_ROUNDS):
        there = surface.heights(vertices[ends], report)
        ahead = np.where(np.abs(there.beyond) < 2.0 * sizes[ends], there.beyond, 0.0)
        vertices[ends] -= ahead[:, None] * there.outward
        there = surface.heights(vertices, report)
        vertices -= np.clip(there.height, -0.5 * sizes, 0.5 * sizes)[:, None] * there.normal
    return vertices
