"""Noise: its measure around every point, and points moved onto the surface that their neighbors describe."""

import numpy as np
from scipy.spatial import cKDTree

from ..algebra import blocks, on_all_cores
from ..cores import cores
from ..types import Floats, Ints
from .nearest import COUNT, ENOUGH, ROUNDS, Nearest, fading_weights, spacing_of
from .quadrics import fit_quadrics

_SHAPE = 1.6  # residual of a fit to 40 over that to 20, from which it is shape: noise leaves both alike
_LEAST = 0.02  # noise below this share of the spacing is left alone
LEFT = 0.08  # of the spacing: scatter about a fit that is negligible; it falls with the root of its neighbors
FILLING = 0.4  # noise above this share fills the neighborhoods as a volume would
FALLING = 0.85  # share of misfit that a round leaves, at most: .2 of noise of a spacing, .83 of three; .86 in volumes
LARGEST = 90  # neighbors of the fit that points are projected on, at most: more would round the shape
_BLOCK = 1 << 12  # points projected at one time


def near_misfit(nearest: Nearest) -> Floats:
    """Return how far quadrics through 20 neighbors miss these, (m,)."""
    near = slice(None), slice(COUNT // 2 + 1)  # with the point itself
    return fit_quadrics(nearest.points, nearest.index[near], fading_weights(nearest.distance[near])).misfit


def misfits(tree: cKDTree, rows: Ints) -> Floats:
    """Return how far quadrics through 40 neighbors of some points of a tree, (k,) int, miss these, in spacings."""
    distance, index = tree.query(tree.data[rows], k=min(COUNT, tree.n), workers=cores())
    return fit_quadrics(tree.data, index, fading_weights(distance), rows).misfit / spacing_of(distance)


def mean_misfits(nearest: Nearest, *misfits: Floats) -> Floats:
    """Return the geometric means of misfits of quadrics, (m,) each, over the neighborhood, in spacings, row by row.

    An edge that runs through a neighborhood has little weight.
    """
    logarithms = np.log(np.maximum(np.stack(misfits, axis=1) / nearest.spacing[:, None], 1e-12))
    means: Floats = np.exp(nearest.averaged(logarithms, ROUNDS // 2).T)
    return means


def noise_level(nearest: Nearest, near: Floats, mixed: Floats, misfit: Floats) -> Floats:
    """Measure the noise around every point as a share of the spacing, (m,), by `mean_misfits`.

    These are of quadrics through 20 neighbors, through 40, and through those of 40 that lie on the point's own sheet:
    where the last is much less, there are several sheets and no noise. It is the misfit of a quadric through 20
    neighbors; zero where it is next to nothing, or where a quadric through 40 fits so much worse that it is shape, not
    noise, that it misses. No shape is missed by as much as `FILLING`. An edge that runs through the neighborhood is no
    noise. The majority of the neighbors decides.
    """
    few, many, own = mean_misfits(nearest, near, mixed, misfit)
    noisy = (few > _LEAST) & (few < _SHAPE * own) & ((few > FILLING) | (many < _SHAPE * few))
    return np.where(nearest.averaged(noisy.astype(float)) > 0.5, few, 0.0)


def project_points(tree: cKDTree, rows: Ints, noise: Floats, smallest: int | None = None) -> Floats:
    """Move some points, (k,) int, onto quadrics through their neighbors; return where they are then, (k, 3).

    Components stand far apart in the tree. Little noise, (m,) as a share of the spacing, needs few neighbors.
    `smallest` is how many points the smallest component has; there is one if not given.
    """
    smallest = tree.n if smallest is None else min(smallest, tree.n)
    # A quadric has six coefficients.
    asked = np.clip(6.0 * (noise[rows] / LEFT) ** 2, ENOUGH, LARGEST)
    many = np.minimum(asked.astype(int), smallest - 1)
    order = np.argsort(many, kind="stable")  # blocks of similar counts: none is queried for more than it needs
    result = np.empty((len(rows), 3))

    def project(part: slice) -> None:
        block = order[part]
        result[block] = _projected(tree, rows[block], many[block])

    on_all_cores(project, blocks(len(rows), _BLOCK))
    return result


def _projected(tree: cKDTree, rows: Ints, many: Ints) -> Floats:
    points = tree.data
    distance, index = tree.query(points[rows], k=many.max() + 1)
    weight = fading_weights(np.minimum(distance, distance[np.arange(len(many)), many, None]))
    return points[rows] + fit_quadrics(points, index, weight, rows).height
