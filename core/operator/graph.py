"""Near neighbors on the same sheet of the surface, as a graph with lengths."""

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..cores import cores
from ..geometry import COUNT, nearest_rows
from ..types import Array, Bools, Floats, Ints
from .laplacian import LaplaceBeltrami

_SEEN = 3  # nearest points examined for each that is joined: those of close sheets are among them


@dataclass(frozen=True)
class NearGraph:
    """Distinct positions of a cloud, joined to their nearest neighbors along the surface."""

    # (m, m), symmetric; distances of joined positions [L], all positive. All positions of a component are connected
    lengths: sparse.csr_array
    place: Ints  # (n,), row of each of the caller's points, the same for coincident points; -1 for points left out
    first: Ints  # (m,), one of the caller's points at each position

    def scatter(self, quantity: Array, neutral: bool | int) -> Array:
        """Return a quantity of the rows, (m,), for the caller's points; those left out get the neutral value."""
        result = quantity[self.place]
        result[self.place < 0] = neutral
        return result


def near_graph(laplacian: LaplaceBeltrami, count: int) -> NearGraph:
    """Join every point to its nearest ones among those that the operator couples it with.

    They are so many, and all at the distance of the last one. The operator's pairs lie on one sheet of the surface, so
    the graph does not cross the gap between close sheets; it uses only the nearest of them, so that edges do not cross
    features narrower than the kernel.
    """
    n = len(laplacian.points)
    known = np.flatnonzero(laplacian.component >= 0)
    _, first, inverse = np.unique(laplacian.points[known], axis=0, return_index=True, return_inverse=True)
    first = known[first]
    place = np.full(n, -1)
    place[known] = inverse.reshape(-1)
    points, component = laplacian.surface_points[first], laplacian.component[first]

    m = len(first)
    distance, index = cKDTree(points).query(points, k=min(_SEEN * count + 1, m), workers=cores())
    joined = _coupled(laplacian.stiffness, first, index)
    joined[:, 0] = False
    last = np.where(joined & (np.cumsum(joined, axis=1) <= count), distance, 0.0).max(axis=1)
    joined &= distance <= (1.0 + 1e-9) * last[:, None]
    row, column = np.nonzero(joined)
    lengths = sparse.csr_array((distance[row, column], (row, index[row, column])), shape=(m, m))
    return NearGraph(_bridge(lengths.maximum(lengths.T), points, component), place, first)


def _coupled(stiffness: sparse.csr_array, first: Ints, index: Ints) -> Bools:
    """Return which of their neighbors, (m, k) int, the stiffness couples rows with."""
    row = np.repeat(first, index.shape[1])
    number = np.arange(1.0, index.size + 1.0)  # survives a product with the pattern of the stiffness
    numbers = sparse.csr_array((number, (row, first[index].ravel())), shape=stiffness.shape)
    result = np.zeros(index.size, dtype=bool)
    result[numbers.multiply(stiffness.astype(bool)).data.astype(np.int64) - 1] = True
    return result.reshape(index.shape)


def _bridge(lengths: sparse.csr_array, points: Floats, component: Ints) -> sparse.csr_array:
    """Join disconnected subsets of each component at their nearest points.

    The stiffness leaves a point without pairs where no other one seems to lie on its sheet.
    """
    label = connected_components(lengths, directed=False)[1]
    if label.max() == component.max():
        return lengths.tocsr()
    size = np.bincount(label)
    ends = []
    for number in range(component.max() + 1):
        labels = np.unique(label[component == number])
        main = labels[np.argmax(size[labels])]
        own = np.flatnonzero(label == main)
        tree = cKDTree(points[own])
        for other in labels[labels != main]:
            rows = np.flatnonzero(label == other)
            distance, nearest = tree.query(points[rows])
            best = distance.argmin()
            ends.append((rows[best], own[nearest[best]], distance[best]))
    row, column, distance = (np.array(values) for values in zip(*ends, strict=True))
    bridges = sparse.csr_array((distance, (row, column)), shape=lengths.shape)
    return (lengths + bridges + bridges.T).tocsr()


def coupled_components(laplacian: LaplaceBeltrami) -> Ints:
    """Number the components of the cloud between which the operator couples no points, (n,) int.

    Those of fewer than 41 points are -1: points left out, and single ones within a component that are so far off
    its surface that they have no neighbors.
    """
    count, label = connected_components(laplacian.stiffness, directed=False)
    large = np.bincount(label, minlength=count) >= COUNT
    return np.where(large, np.cumsum(large) - 1, -1)[label]


def mean_spacing(laplacian: LaplaceBeltrami) -> Floats:
    """Return the distance between the points of an even sample as dense as the neighbors of each, (n,) [L].

    Points left out have no neighbors, and get the median of the others.
    """
    stiffness = laplacian.stiffness
    neighbors = sparse.csr_array((np.ones(stiffness.nnz), stiffness.indices, stiffness.indptr), shape=stiffness.shape)
    spacing = np.sqrt(neighbors @ laplacian.areas / np.maximum(neighbors.sum(axis=1), 1.0))
    known = laplacian.component >= 0
    result: Floats = np.where(known, spacing, np.median(spacing[known]))
    return result


def followers(points: Floats, component: Ints, held: Ints | tuple[()] = ()) -> tuple[Ints, Ints]:
    """Return the points on no surface, but for those that are held, and for each the nearest point on a surface."""
    alone = component < 0
    lone, own = np.setdiff1d(np.flatnonzero(alone), held), np.flatnonzero(~alone)
    if not len(lone) or not len(own):
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    return lone, own[nearest_rows(points[own], points[lone])]
