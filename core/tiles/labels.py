"""Labels and signs that hold across tiles: merged over the points that tiles have in common."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from ..geometry import ScaledPoints, label_connected
from ..types import Array, Bools, Floats, Ints
from .site import Site
from .store import Record, Store, Told


def label_links(site: Site, scaled: ScaledPoints, index: Ints, joined: Bools) -> Told:
    """Number what links from points in the box of a tile join, within it.

    Parameters
    ----------
    site : Site
    scaled : ScaledPoints
        The m distinct points.
    index : ndarray, (m, k) int
        Neighbors of each.
    joined : ndarray, (m, k) bool
        Those that links lead to; what is said of points outside the box is left to their tiles.

    Returns
    -------
    dict
        The label of each point in the box, and how many distinct ones have each; of the points outside that links
        reach the tile that they belong to, their places in it, and their labels here.
    """
    part, count, inner = site.part, len(scaled.points), site.inner(scaled)
    joined = joined & inner[:, None]
    label = label_connected(index, joined)
    reached = np.zeros(count, dtype=bool)
    reached[index[joined]] = True
    reached &= ~inner
    used = inner | reached
    names, number = np.unique(label[used], return_inverse=True)
    label = np.full(count, -1)
    label[used] = number.reshape(-1)
    rows = scaled.first[reached]
    return {
        "label": site.own(scaled, label, -1),
        "size": np.bincount(label[inner], minlength=len(names)),
        "owner": part.owner[rows],
        "place": part.place[rows],
        "reached": label[reached],
    }


class Merged(NamedTuple):
    """Labels of all tiles, merged."""

    start: Ints  # (tiles + 1,), where the labels of each tile begin among those of all
    label: Ints  # (labels,), the merged label of each label of each tile
    size: Ints  # (merged,), how many distinct points have each merged one


def merge_labels(store: Store, step: str) -> Merged:
    """Merge the labels that `label_links` gave in a step, over the points that links reach in other tiles."""
    sizes = list(store.told(step, "size"))
    start = starts(store, step, map(len, sizes))
    edges: list[Ints] = [np.zeros((2, 0), dtype=np.int64)]
    for number in store.visited(step):
        owner, place, reached = (store.read(step, number, name) for name in ("owner", "place", "reached"))
        for other in np.unique(owner):
            if store.done(step, int(other)):
                rows = owner == other
                known = store.read(step, int(other), "label")[place[rows]]
                pairs = np.stack([start[other] + known, start[number] + reached[rows]])[:, known >= 0]
                edges.append(np.unique(pairs, axis=1))
    first, second = np.concatenate(edges, axis=1)
    graph = sparse.csr_array((np.ones(len(first), dtype=bool), (first, second)), shape=(start[-1], start[-1]))
    label = connected_components(graph, directed=False)[1]
    return Merged(start, label, np.bincount(label, np.concatenate(sizes)).astype(np.int64))


def starts(store: Store, step: str, counts: Iterable[int]) -> Ints:
    """Return where the labels of each tile begin among those of all, by how many a step has told of each that it has.

    They are (tiles + 1,), up to the last tile that the step has been at.
    """
    done = np.array(store.visited(step))
    length = np.zeros(done.max() + 2, dtype=np.int64)
    length[done + 1] = list(counts)
    begin: Ints = np.cumsum(length)
    return begin


def names_of(step: str, name: str, start: Ints, values: Array) -> Record:
    """Return the record of what is agreed on, under a name, for the labels that a step has given in each tile."""
    return {name: values, f"{step} start": start}


def agree_on_signs(first: Ints, second: Ints, votes: Floats, count: int) -> Floats:
    """Choose signs of patches, (count,), so that those that have points in common agree.

    Votes, (k,), between two patches each are above zero where their normals agree, below where they do not. Those on
    the same two patches add up; where signs cannot please all sums, the greatest count.
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
