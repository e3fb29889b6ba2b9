"""Labels and signs that hold across tiles: merged over the points that tiles have in common."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from ..types import Floats, Ints


def merge_links(links: Iterable[tuple[Ints, Ints, Ints]], count: int) -> Ints:
    """Number what links join, within and across tiles.

    Parameters
    ----------
    links : iterable of (rows, first, second)
        Of each tile the rows, (k,) int, of its points in the cloud, and the links from points in its box, by their
        places among these.
    count : int
        Points of the cloud.

    Returns
    -------
    ndarray, (count,) int
        A label of each point; -1 for those that are in no tile.
    """
    label, offset = np.full(count, -1), 0
    edges: list[Ints] = []
    for rows, first, second in links:
        graph = sparse.csr_array((np.ones(len(first), dtype=bool), (first, second)), shape=(len(rows),) * 2)
        number, part = connected_components(graph, directed=False)
        part = part + offset
        offset += number
        known = label[rows] >= 0
        edges.append(np.unique(np.stack([label[rows[known]], part[known]]), axis=1))
        label[rows[~known]] = part[~known]
    first, second = np.concatenate(edges, axis=1)
    graph = sparse.csr_array((np.ones(len(first), dtype=bool), (first, second)), shape=(offset, offset))
    merged = connected_components(graph, directed=False)[1]
    return np.where(label >= 0, merged[label], -1)


def agree_on_signs(first: Ints, second: Ints, votes: Floats, count: int) -> Floats:
    """Choose signs of patches so that those that have points in common agree.

    Parameters
    ----------
    first, second : ndarray, (k,) int
        Two patches.
    votes : ndarray, (k,)
        Above zero where their normals agree, below where they do not. Those on the same two patches add up; where signs
        cannot please all sums, the greatest count.
    count : int
        Patches.

    Returns
    -------
    ndarray, (count,)
        1 or -1.
    """
    ends = np.concatenate([first, second]).astype(np.int32), np.concatenate([second, first]).astype(np.int32)
    signs = sparse.csr_array((np.concatenate([votes, votes]), ends), shape=(count, count))  # sums all votes of a pair
    cost = signs.copy()
    cost.data = 1.0 / np.maximum(np.abs(signs.data), 1e-6)
    forest = minimum_spanning_tree(cost)
    forest = (forest + forest.T).tocsr()
    surface = connected_components(forest, directed=False)[1]
    result = np.ones(count)
    for root in np.unique(surface, return_index=True)[1]:
        order, before = breadth_first_order(forest, root, directed=False)
        for patch in order[1:]:
            result[patch] = result[before[patch]] * (-1.0 if signs[before[patch], patch] < 0.0 else 1.0)
    return result
