"""Noise removed along the normals, edges kept: bilateral filters of normals, then of heights."""

import numpy as np
from scipy import sparse

from ..arguments import check_switches
from ..operator import LaplaceBeltrami
from ..progress import ends_at_one
from ..types import Array, Floats, Ints, Progress

_WIDTH = 0.6  # smoothing lengths of the Gaussian over the distance
_TURN = 0.25  # of the Gaussian over the difference of normals: across an edge of 45 degrees there is next to nothing
_TURNS, _STEPS = 12, 10  # rounds of both filters
_FARTHEST = 3.0  # times the scatter of heights around: farther off is no noise
_STEP = 0.7  # of the mean height: less than one, for even samplings


@ends_at_one
def clean_points(
    laplacian: LaplaceBeltrami,
    *,
    keep_edges: bool = True,
    dirichlet: bool = False,
    progress: Progress | None = None,
) -> Floats:
    """Remove noise: move each point along its normal onto the surface of its neighbors, without those across edges.

    Normals are filtered first: each becomes the mean of those around, weighted by distance and by how little they
    differ, so that edges grow sharp. Then points move along these normals by their mean height over circular arcs from
    their neighbors, with the same weights; each point counts itself, so that one of which no neighbor knows the side
    stays where it is. None moves farther than three times the scatter of the heights around it. Spheres, cylinders and
    planes stay as they are.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        The neighborhood of a point is what it couples the point with: the support of the kernel, on one sheet.
    keep_edges : bool
        Whether neighbors count less the more their normals differ.
    dirichlet : bool
        Whether boundary points stay where they are.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    ndarray, (n, 3)
        New positions of ``laplacian.points`` [L]. Points that the operator leaves out stay.

    See Also
    --------
    fair_points : By frequency: smooths edges, too.
    smooth_points : Filters by any response, or by modes.

    References
    ----------
    Fleishman, Drori, Cohen-Or. Bilateral mesh denoising. 2003. Zheng, Fu, Au, Tai. Bilateral normal filtering for mesh
    denoising. 2011.

    Examples
    --------
    Radii that scatter by 0.02 scatter by a third of that afterwards:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> noisy = points * np.random.default_rng(0).normal(1, 0.02, (800, 1))
    >>> clean = mf.clean.clean_points(mf.build_laplacian(noisy))
    >>> print(np.linalg.norm(clean, axis=1).std() < 0.007)
    True
    """
    check_switches(keep_edges=keep_edges, dirichlet=dirichlet)
    report = progress or (lambda stage, fraction: None)
    first, second, near = _couples(laplacian)
    normals, weight = laplacian.normals, near
    own = np.where(laplacian.component >= 0, laplacian.areas, 1.0)  # those of points left out are too small for squares
    for turn in range(_TURNS if keep_edges else 0):
        report("Normals", 0.5 * turn / _TURNS)
        summed = _matrix(near * _alike(normals, first, second), first, second, len(normals)) @ normals
        summed += own[:, None] * normals
        normals = summed / np.linalg.norm(summed, axis=1)[:, None]
    if keep_edges:
        weight = near * _alike(normals, first, second)
    # Each counts itself, at its own height: where no neighbor agrees with a point it stays.
    total = own + np.bincount(first, weight, len(normals))
    arcs = 0.5 * (normals[first] + normals[second])
    height, free = np.zeros(len(normals)), ~laplacian.boundary if dirichlet else np.ones(len(normals), dtype=bool)
    most = np.full(len(normals), np.inf)
    for step in range(_STEPS):
        report("Heights", 0.5 + 0.5 * step / _STEPS)
        points = laplacian.points + height[:, None] * normals
        above = np.einsum("ij,ij->i", points[first] - points[second], arcs)
        mean, square = (np.bincount(first, weight * above**power, len(normals)) / total for power in (1, 2))
        if step == 0:
            most = _FARTHEST * _medians(np.sqrt(np.maximum(square - mean**2, 0.0)), first, second)
        height = np.clip(height - _STEP * free * mean, -most, most)
    return laplacian.points + height[:, None] * normals


def _couples(laplacian: LaplaceBeltrami) -> tuple[Ints, Ints, Floats]:
    """Return the pairs of points that take part, both ways, with their weights by distance and area."""
    pairs = laplacian.stiffness.tocoo()
    first, second = pairs.row, pairs.col
    kept = laplacian.component >= 0
    both = (first != second) & kept[first] & kept[second]
    first, second = first[both], second[both]
    offset = laplacian.surface_points[first] - laplacian.surface_points[second]
    width = _WIDTH * np.minimum(laplacian.smoothing_lengths[first], laplacian.smoothing_lengths[second])
    weight: Floats = np.exp(-0.5 * np.einsum("ij,ij->i", offset, offset) / width**2) * laplacian.areas[second]
    return first, second, weight


def _medians(values: Floats, first: Ints, second: Ints) -> Floats:
    """Return the median of a quantity over the neighbors of each point, (n,); zero where there are none."""
    count = np.bincount(first, minlength=len(values))
    ordered = np.append(values[second[np.lexsort((values[second], first))]], 0.0)
    result: Floats = np.where(count > 0, ordered[np.cumsum(count) - count + count // 2], 0.0)
    return result


def _alike(normals: Floats, first: Ints, second: Ints) -> Floats:
    turn = normals[first] - normals[second]
    alike: Floats = np.exp(-0.5 * np.einsum("ij,ij->i", turn, turn) / _TURN**2)
    return alike


def _matrix(weight: Array, first: Ints, second: Ints, count: int) -> sparse.csr_array:
    return sparse.csr_array((weight, (first, second)), shape=(count, count))
