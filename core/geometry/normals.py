"""Normals: given ones checked, and a consistent orientation."""

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from ..algebra import by_blocks
from ..arguments import as_array, as_doubles
from ..errors import InvalidPointsError
from ..types import Array, Bools, Floats, Ints
from .distances import dots
from .nearest import Nearest

NEIGHBORS = 12
_BULGING = 0.4  # mean height over the center, along the normals, over the mean distance from it: 0.87 of half a sphere
_UPRIGHT = 0.5  # difference of a sheet's areas that face up and down, as a share of both, as seen from above
_LEVEL = 0.2  # mean cosine between a sheet's normals and the vertical from which on up is beyond doubt


def unit_normals(normals: ArrayLike, count: int) -> Floats:
    """Check given normals and scale them to unit length.

    If they are not (count, 3) finite numbers, or some are zero, `InvalidPointsError` is raised.
    """
    normals = as_array(normals, "Normals")
    if normals.shape != (count, 3) or normals.dtype.kind not in "iuf":
        raise InvalidPointsError(
            f"Normals of shape {normals.shape} and type {normals.dtype} do not fit {count} points. Give three"
            " real numbers for each point."
        )
    normals = as_doubles(normals)
    largest = np.abs(normals).max(axis=1, keepdims=True)
    bad = int(np.count_nonzero(~(np.isfinite(largest) & (largest > 0.0))))
    if bad:
        raise InvalidPointsError(f"{bad} of {count} normals are zero or not finite. Leave the normals to be estimated.")
    normals = normals / largest  # squares of tiny or huge ones would underflow or overflow
    return normals / np.linalg.norm(normals, axis=1)[:, None]


def orient_outwards(nearest: Nearest, normals: Floats) -> Floats:
    """Flip unit normals, (m, 3), so that neighbors agree, each component outwards as of `outer_signs`."""
    normals, tree = propagate_signs(nearest, normals)
    component = connected_components(tree, directed=False)[1]
    return normals * outer_signs(nearest.points, normals, component)[component, None]


def outer_signs(points: Floats, normals: Floats, part: Ints, weight: Floats | None = None) -> Floats:
    """Choose a sign for each part of a surface: away from its center, or up where it is a sheet that hardly bulges.

    A body, a bowl, or what a scanner sees of a body bulges to its outer side. Terrain does not: its hills and pits are
    low against its width. It hardly overhangs, though, so that nearly all of it faces up or down, and up is outside.
    Normals, (m, 3), agree within each part; parts, (m,), are numbers; weights, (m,), areas up to a factor.
    """
    weight = np.ones(len(points)) if weight is None else weight

    def total(values: Floats | float) -> Array:
        return np.bincount(part, weight * values)

    size = total(1.0) + np.finfo(float).tiny
    center = np.column_stack([total(points[:, axis]) for axis in range(3)]) / size[:, None]
    return signs_by_sums(side_sums(points - center[part], normals, part, weight))


def side_sums(offset: Floats, normals: Floats, part: Ints, weight: Floats) -> Floats:
    """Return the sums over each part by which its outer side is known, (parts, 10); those of divided parts add up.

    Offsets, (m, 3), are from any place, which is best near the center of the part.
    """
    height, square = np.einsum("ij,ij->i", offset, normals), np.einsum("ij,ij->i", offset, offset)
    values = np.column_stack([np.ones(len(part)), offset, normals, height, square, np.abs(normals[:, 2])])
    return np.column_stack([np.bincount(part, weight * column) for column in values.T])


def signs_by_sums(sums: Floats) -> Floats:
    """Return the signs of parts, (parts,), by their `side_sums`: see `outer_signs`."""
    outward, upward, bulges, sheet = _seen_by_sums(sums)
    return np.where(np.where(sheet & ~bulges, upward, outward) < 0.0, -1.0, 1.0)


def sides_by_sums(sums: Floats) -> Floats:
    """Return the signs of parts, (parts,), as `signs_by_sums`, but 0 where neither bulge nor slope tells them.

    An open sheet that is upright, such as a facade, has no outer side.
    """
    _, upward, bulges, sheet = _seen_by_sums(sums)
    known = bulges | (sheet & (np.abs(upward) > _LEVEL * sums[:, 0]))
    return np.where(known, signs_by_sums(sums), 0.0)


def _seen_by_sums(sums: Floats) -> tuple[Floats, Floats, Bools, Bools]:
    """Return how far parts face away from their centers, and up; and whether they bulge, and face up or down."""
    size, first, normal = sums[:, 0] + np.finfo(float).tiny, sums[:, 1:4], sums[:, 4:7]
    outward = sums[:, 7] - np.einsum("ij,ij->i", first, normal) / size
    upward = normal[:, 2]
    spread = sums[:, 8] - np.einsum("ij,ij->i", first, first) / size
    distance = np.sqrt(size * np.maximum(spread, 0.0))
    return outward, upward, np.abs(outward) >= _BULGING * distance, np.abs(upward) > _UPRIGHT * sums[:, 9]


def propagate_signs(nearest: Nearest, normals: Floats) -> tuple[Floats, sparse.csr_array]:
    """Flip unit normals, (m, 3), so that neighbors agree; return them, and the tree along which that is passed on.

    The sign travels along a minimum spanning tree of the neighbor graph, whose edges cost least where a circular arc
    joins both points best (Hoppe, DeRose, Duchamp, McDonald, Stuetzle 1992). Along an arc the second normal is the
    mirror image of the first in the plane halfway between the points, which holds across sharp edges too.
    """
    points = nearest.points
    n = len(points)
    first, second = near_edges(nearest)
    cosine = np.abs(mirrored_cosine(points, normals, first, second))
    cost = 1.0 + 1e-9 - np.minimum(cosine, 1.0)  # csgraph reads a zero cost as no edge
    start = np.searchsorted(first, np.arange(n + 1, dtype=np.int32)).astype(np.int32)
    tree = minimum_spanning_tree(sparse.csr_array((cost, second.astype(np.int32), start), shape=(n, n)))
    graph = tree + tree.T
    component = connected_components(graph, directed=False)[1]

    parent = np.arange(n)
    for root in np.unique(component, return_index=True)[1]:
        order, before = breadth_first_order(graph, root, directed=False)
        parent[order[1:]] = before[order[1:]]
    child = np.flatnonzero(parent != np.arange(n))
    sign = np.ones(n)
    sign[child] = np.where(mirrored_cosine(points, normals, child, parent[child]) < 0.0, -1.0, 1.0)
    while np.any(parent != parent[parent]):  # each round doubles the length of the path already multiplied
        sign *= sign[parent]
        parent = parent[parent]
    return normals * sign[:, None], tree


def near_edges(nearest: Nearest) -> tuple[Ints, Ints]:
    """Return the edges from every point to its nearest neighbors on its own sheet, by both ends."""
    near = slice(1, NEIGHBORS + 1)
    same = nearest.weight[:, near] > 0.0
    first = np.repeat(np.arange(len(same), dtype=np.int32), np.count_nonzero(same, axis=1))
    return first, nearest.index[:, near][same]


def mirrored_cosine(points: Floats, normals: Floats, first: Ints, second: Ints) -> Floats:
    """Cosine between the second normal and the mirror image of the first in the plane halfway between the points."""

    place, normal = points.T.copy(), normals.T.copy()

    def measure(part: slice) -> Floats:
        one, other = first[part], second[part]
        chord, left, right = place[:, other] - place[:, one], normal[:, one], normal[:, other]
        return dots(left, right) - 2.0 * dots(chord, left) * dots(chord, right) / dots(chord, chord)

    return by_blocks(measure, len(first))
