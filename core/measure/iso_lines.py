"""Lines on a mesh along which values are the same."""

from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import connected_components, depth_first_order

from ..arguments import as_array, as_doubles, check_array, check_positions, real
from ..errors import InvalidPointsError, PointCloudError
from ..types import Bools, Floats, Ints


class IsoLine(NamedTuple):
    """A line along which values are the same.

    Attributes
    ----------
    level : float
        These values.
    points : ndarray, (k, 3)
        Vertices of the line in their order [L].
    closed : bool
        Whether the last vertex is joined to the first.
    """

    level: float
    points: Floats
    closed: bool


def iso_lines(vertices: ArrayLike, faces: ArrayLike, values: ArrayLike, levels: ArrayLike) -> list[IsoLine]:
    """Find the lines on a mesh along which values, linear on each triangle, are those of some levels.

    Parameters
    ----------
    vertices : array_like, (n, 3)
        Coordinates [L].
    faces : array_like, (m, 3) or (m, 4) int
        Triangles or quads, by their vertices; quads count as two triangles.
    values : array_like, (n,)
        Triangles with one that is not finite have no lines.
    levels : array_like, (l,)

    Returns
    -------
    list of IsoLine
        Of maximal length: they end only at the boundary of the mesh, and where more than two faces meet.

    Raises
    ------
    PointCloudError
        Arrays of wrong shapes or types, faces of vertices that do not exist, or a level that is not finite.

    See Also
    --------
    surface.mesh_surface : Makes a mesh.
    surface.values_on_mesh : Carries values to its vertices.

    Examples
    --------
    A circle of latitude, where the height is a half:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> mesh = mf.surface.mesh_surface(mf.build_laplacian(points))
    >>> (circle,) = mf.measure.iso_lines(mesh.vertices, mesh.faces, mesh.vertices[:, 2], [0.5])
    >>> steps = circle.points - np.roll(circle.points, 1, axis=0)
    >>> print(circle.closed, (np.linalg.norm(steps, axis=1).sum() / (np.pi * np.sqrt(3))).round(2))
    True 1.0
    """
    vertices, triangles, values, levels = _checked(vertices, faces, values, levels)
    triangles = triangles[np.isfinite(values[triangles]).all(axis=1)]
    lines = [_joined(vertices, values, level, _segments(triangles, values > level)) for level in levels]
    return list(chain.from_iterable(lines))


def _checked(
    vertices: ArrayLike, faces: ArrayLike, values: ArrayLike, levels: ArrayLike
) -> tuple[Floats, Ints, Floats, list[float]]:
    """Return the arguments of `iso_lines` as arrays, with triangles for faces."""
    count = len(np.atleast_1d(as_array(vertices, "Vertices")))
    vertices = check_positions(vertices, count, "vertices", "vertex")
    faces = check_array(faces, "Faces", [(None, 3), (None, 4)], "Give three or four whole numbers for each.", "iu")
    if faces.size and not 0 <= faces.min() <= faces.max() < len(vertices):
        raise InvalidPointsError(
            f"Faces have vertices from {faces.min()} to {faces.max()}, and there are {len(vertices)}. Count from zero."
        )
    values = check_array(values, "Values", [(count,)], f"Give one real number for each of {count} vertices.", "iufb")
    numbers = [real(level) for level in np.atleast_1d(as_array(levels, "Levels")).ravel().tolist()]
    if not np.isfinite(numbers).all():
        raise PointCloudError(f"The levels are {numbers}. Use finite numbers.")
    triangles = faces if faces.shape[1] == 3 else np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    return vertices, triangles.astype(np.int64), as_doubles(values), numbers


def _segments(triangles: Ints, above: Bools) -> Ints:
    """Return the segments of a line within triangles, (s, 2, 2) int: two edges each, by their lower and upper end.

    An edge is cut where one end is above the level and the other one is not.
    """
    inside = above[triangles]
    cut = inside != np.roll(inside, -1, axis=1)
    crossed = cut.any(axis=1)
    edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)[crossed], axis=2)
    return edges[cut[crossed]].reshape(-1, 2, 2)


def _joined(vertices: Floats, values: Floats, level: float, segments: Ints) -> list[IsoLine]:
    """Join segments to lines."""
    if not len(segments):
        return []
    count = len(vertices)
    key = segments[:, :, 0] * count + segments[:, :, 1]
    cuts, ends = np.unique(key, return_inverse=True)
    ends = ends.reshape(key.shape)
    meeting = np.bincount(ends.ravel())[ends] > 2  # where more than two faces meet, each segment ends alone
    ends[meeting] = len(cuts) + np.arange(np.count_nonzero(meeting))
    cuts = np.concatenate([cuts, key[meeting]])
    low, high = np.divmod(cuts, count)
    share = (level - values[low]) / (values[high] - values[low])
    places = vertices[low] + share[:, None] * (vertices[high] - vertices[low])
    order, starts, closed = _ordered(ends, len(cuts))
    return [
        IsoLine(level, places[line], bool(loop))
        for line, loop in zip(np.split(order, starts[1:]), closed, strict=True)
        if len(line)
    ]


def _ordered(ends: Ints, count: int) -> tuple[Ints, Ints, Bools]:
    """Order cuts along the lines that segments, (s, 2) pairs of cuts, form.

    Return the cuts, line by line, (count,) int; where in them each line begins, (l,) int; and which are closed, (l,)
    bool.
    """
    used = np.unique(ends)
    segments = sparse.csr_array((np.ones(len(ends), bool), (ends[:, 0], ends[:, 1])), shape=(count, count))
    degree = np.bincount(ends.ravel(), minlength=count)
    _, line = connected_components(segments, directed=False)
    line = np.unique(line[used], return_inverse=True)[1].reshape(-1)
    first = used[np.lexsort([degree[used], line])]  # of an open line one of its ends
    first = first[np.unique(np.sort(line), return_index=True)[1]]
    # A depth-first search from one more node, joined to the first cut of each line, visits line after line.
    both = sparse.vstack([segments + segments.T, sparse.csr_array((1, count), dtype=bool)])
    both = sparse.hstack([both, sparse.csr_array((count + 1, 1), dtype=bool)], format="lil")
    both[count, first] = True
    order = depth_first_order(both.tocsr(), count, directed=True, return_predecessors=False)[1:]
    begins = np.flatnonzero(np.isin(order, first))
    return order, begins, degree[order[begins]] == 2
