"""Quads instead of the triangles that are left where voxels of two sizes meet."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, connected_components, dijkstra, minimum_spanning_tree
from scipy.sparse.linalg import spsolve_triangular

from ..types import Array, Bools, Floats, Ints


def all_quads(vertices: Floats, faces: Ints, sizes: Floats) -> tuple[Floats, Ints, Floats]:
    """Divide sides of faces so that all faces are quads.

    A triangle with one side divided is a quad; a quad with two of them divided is two quads. Triangles are joined in
    pairs by short ways across quads, or to an open edge, and each side that a way crosses is divided.

    Parameters
    ----------
    vertices : ndarray, (v, 3)
    faces : ndarray, (q, 4) int
        Two vertices of a triangle that follow each other are the same.
    sizes : ndarray, (v,)
        A value of each vertex, averaged at the middles of divided sides.

    Returns
    -------
    vertices : ndarray, (w, 3)
        The same, and then the middles of divided sides.
    faces : ndarray, (r, 4) int
        Without triangles, turning the same way; as many of them at each edge as before.
    sizes : ndarray, (w,)
    """
    same = faces == np.roll(faces, -1, axis=1)
    triangles = same.any(axis=1)
    if not triangles.any():
        return vertices, faces, sizes
    begin = np.where(triangles, np.argmax(same, axis=1) + 1, 0)
    faces = np.take_along_axis(faces, (np.arange(4) + begin[:, None]) % 4, axis=1)  # the last vertex is the first, too
    side, ends, between = _edges(faces, triangles)
    crossed = _crossed(between, np.flatnonzero(triangles), len(faces))
    middle = np.full(len(ends) + 1, -1)
    middle[:-1][crossed] = len(vertices) + np.arange(np.count_nonzero(crossed))
    vertices, sizes = (np.concatenate([own, own[ends[crossed]].mean(axis=1)]) for own in (vertices, sizes))
    return vertices, _divided(faces, triangles, middle[side]), sizes


def _edges(faces: Ints, triangles: Bools) -> tuple[Array, Array, Array]:
    """Find the edges between faces, each between two or at the end of one: those of four faces are two edges.

    Returns
    -------
    ndarrays, (q, 4) int, (e, 2) int, (e, 2) int
        The edges of faces, -1 for the fourth of triangles; their ends; and the faces on both sides, q for none.
    """
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2), axis=2)
    row, column = np.nonzero(~(triangles[:, None] & (np.arange(4) == 3)))
    ends = ends[row, column].astype(np.int64)
    order = np.lexsort([ends[:, 1], ends[:, 0]])
    row, column, ends = row[order], column[order], ends[order]
    fresh = np.concatenate([[True], (ends[1:] != ends[:-1]).any(axis=1)])
    rank = np.arange(len(ends)) - np.maximum.accumulate(np.where(fresh, np.arange(len(ends)), 0))
    fresh = rank % 2 == 0
    side = np.full(faces.shape, -1)
    side[row, column] = np.cumsum(fresh) - 1
    start = np.flatnonzero(fresh)
    following = np.minimum(start + 1, len(row) - 1)
    alone = fresh[following] | (following == start)
    return side, ends[start], np.column_stack([row[start], np.where(alone, len(faces), row[following])])


def _crossed(between: Ints, triangles: Ints, outside: int) -> Bools:
    """Choose the edges that ways between triangles cross: an odd number of each of them, an even number of others.

    Return which, (e,) bool. `between`, (e, 2), are the faces on both sides of edges, the smaller one first; `outside`
    is what is beyond edges of one face, where any number of ways may end.
    """
    first, second = between.T
    code = first * (outside + 1) + second
    known, one = np.unique(code, return_index=True)  # of several edges between two faces
    sources = np.append(triangles, outside)
    graph = sparse.coo_array((np.ones(len(one)), between[one].T.astype(np.int32)), shape=(outside + 1,) * 2).tocsr()
    away, before, nearest = dijkstra(
        graph, directed=False, indices=sources, unweighted=True, min_only=True, return_predecessors=True
    )
    number = np.full(outside + 1, -1)
    number[sources] = np.arange(len(sources))
    edge = one[np.isfinite(away[first[one]])]
    ends = np.sort(number[nearest[between[edge]]], axis=1)
    length = away[between[edge]].sum(axis=1) + 1.0
    apart = ends[:, 0] != ends[:, 1]
    edge, ends, length = edge[apart], ends[apart], length[apart]
    chosen = edge[_pairing(ends, length, len(sources))]
    crossed = np.bincount(chosen, minlength=len(between))
    place = between[chosen].ravel()
    while len(place := place[before[place] >= 0]):  # back to both ends of each way
        step = np.sort([place, before[place]], axis=0)
        back = one[np.searchsorted(known, step[0] * (outside + 1) + step[1])]
        crossed += np.bincount(back, minlength=len(between))
        place = before[place]
    odd: Bools = crossed % 2 == 1  # what two ways cross, none needs to
    return odd


def _pairing(ends: Ints, length: Floats, count: int) -> Ints:
    """Choose short ways between nodes of which an odd number ends at each, any number at the last node.

    Ends, (w, 2), are nodes, the smaller one first; lengths are (w,), and `count` is how many nodes there are. The ways
    are in a tree of the shortest ones.
    """
    order = np.lexsort([length, ends[:, 1], ends[:, 0]])
    code = (ends[:, 0] * count + ends[:, 1])[order]
    code, index = np.unique(code, return_index=True)
    ways = order[index]
    graph = sparse.coo_array((length[ways], ends[ways].T.astype(np.int32)), shape=(count, count))
    tree = minimum_spanning_tree(graph.tocsr()).tocoo()
    ways = ways[np.searchsorted(code, tree.row.astype(np.int64) * count + tree.col)]
    label = connected_components(tree, directed=False)[1]
    roots = np.unique(label[::-1], return_index=True)[1]
    roots = count - 1 - roots  # the last node of each tree; all hang on one more, from which one walk reaches them
    rows, columns = np.append(tree.row, roots), np.append(tree.col, np.full(len(roots), count))
    whole = sparse.coo_array((np.ones(len(rows)), np.stack([rows, columns]).astype(np.int32)), shape=(count + 1,) * 2)
    order, parent = breadth_first_order(whole.tocsr(), count, directed=False)
    place = np.argsort(order)
    nodes = order[1:]
    step = np.stack([place[parent[nodes]], place[nodes]]).astype(np.int32)
    up = sparse.coo_array((np.full(count, -1.0), step), shape=(count + 1,) * 2)
    ending = (order < count - 1).astype(float)
    below = spsolve_triangular((up + sparse.eye_array(count + 1)).tocsr(), ending, lower=False)
    child = np.where(parent[tree.row] == tree.col, tree.row, tree.col)
    odd = np.round(below[place[child]]) % 2 == 1
    result: Ints = ways[odd]
    return result


def _divided(faces: Ints, triangles: Bools, middle: Ints) -> Ints:
    """Return the quads of faces of which some sides have a middle, (r, 4) int; -1 for those without."""
    has = middle >= 0
    number = has.sum(axis=1)
    opposite = ~triangles & (number == 2) & (has[:, 0] == has[:, 2])
    # Corners from the side on that has a middle after one without, so that middles follow each other.
    corners = np.where(triangles, 3, 4)[:, None]
    last = np.take_along_axis(has, (np.arange(4) - 1) % corners, axis=1)
    begin = np.where(opposite, np.argmax(has, axis=1), np.argmax(has & ~last, axis=1))
    turn = (np.arange(4) + begin[:, None]) % corners
    faces, middle = np.take_along_axis(faces, turn, axis=1), np.take_along_axis(middle, turn, axis=1)
    a, b, c, d = range(4)
    k, m, n, o = range(4, 8)  # the middles after them
    table = np.column_stack([faces, middle])
    kinds = [
        (~triangles & (number == 0), [(a, b, c, d)]),
        (triangles & (number == 1), [(a, k, b, c)]),
        (triangles & (number == 3), [(a, k, b, m), (a, m, c, n)]),
        (opposite, [(a, k, n, d), (k, b, c, n)]),
        (~triangles & (number == 2) & ~opposite, [(a, k, b, m), (a, m, c, d)]),
        (~triangles & (number == 4), [(a, k, b, m), (m, c, n, d), (a, m, d, o)]),
    ]
    return np.concatenate([table[rows][:, quad] for rows, quads in kinds for quad in quads])
