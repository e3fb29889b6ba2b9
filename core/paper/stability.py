"""The assumptions and conclusions of the paper's Theorem 1, measured on an operator."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..cores import cores
from ..frozen import Frozen
from ..operator import LaplaceBeltrami


@dataclass(frozen=True, kw_only=True)
class Stability(Frozen):
    """The assumptions of Theorem 1 on a cloud, and its conclusions on the operator.

    Attributes
    ----------
    area_ratio : float
        (A1) Largest area over the smallest.
    fill_distance : float
        (A2) Largest distance of a point to its sixth neighbor [L]: no hole among the points is much wider.
    most_neighbors : int
        (A3) Most points inside one support.
    least_bandwidth : float
        (A4) Least ratio of the smoothing length to the distance of the sixth neighbor.
    row_sum, column_sum : float
        Largest entry of L e and of areas . L, relative to the largest diagonal entry: both vanish, for e spans the
        kernel of L and the areas that of its transpose.
    components : int
        Dimension of the kernel: components of the operator's graph.
    """

    area_ratio: float
    fill_distance: float
    most_neighbors: int
    least_bandwidth: float
    row_sum: float
    column_sum: float
    components: int

    def concerns(self) -> list[str]:
        """Return a sentence for each assumption that does not hold comfortably; none for a sound operator."""
        found = []
        if self.area_ratio > 1e4:
            found.append(f"(A1) The areas differ by a factor of {self.area_ratio:.3g}.")
        if self.least_bandwidth < 0.4:
            found.append(
                f"(A2, A4) Somewhere the smoothing length is only {self.least_bandwidth:.2g} times the distance to"
                " the sixth neighbor."
            )
        if self.most_neighbors > 5000:
            found.append(f"(A3) One support holds {self.most_neighbors} points.")
        if self.components > 1:
            found.append(f"The operator falls into {self.components} components, each with its own constant.")
        return found


def check_stability(laplacian: LaplaceBeltrami) -> Stability:
    """Measure the assumptions (A1) to (A4) of Theorem 1 and the two kernels it names.

    Parameters
    ----------
    laplacian : LaplaceBeltrami

    Returns
    -------
    Stability
        Of the points that take part. (A5) holds for the kernel by construction; (A6) concerns boundaries, not measured
        here.

    See Also
    --------
    build_laplacian : Builds operators.
    paper.build_laplacian : Builds that of the paper.

    Examples
    --------
    A closed surface of one component, where only constants have no Laplacian:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> laplacian = mf.build_laplacian(points)
    >>> stability = mf.paper.check_stability(laplacian)
    >>> print(stability.components, stability.row_sum < 1e-12, stability.concerns())
    1 True []
    """
    known = np.flatnonzero(laplacian.component >= 0)
    distinct, first = np.unique(laplacian.points[known], axis=0, return_index=True)
    spacing = cKDTree(distinct).query(distinct, k=[min(7, len(distinct))], workers=cores())[0][:, 0]
    stiffness, areas = laplacian.stiffness[known][:, known], laplacian.areas[known]
    largest = stiffness.diagonal().max()
    return Stability(
        area_ratio=float(areas.max() / areas.min()),
        fill_distance=float(spacing.max()),
        most_neighbors=int(np.diff(stiffness.indptr).max()),
        least_bandwidth=float((laplacian.smoothing_lengths[known[first]] / spacing).min()),
        row_sum=float(np.abs(stiffness.sum(axis=1)).max() / largest),
        column_sum=float(np.abs(stiffness.sum(axis=0)).max() / largest),
        components=int(connected_components(stiffness, directed=False, return_labels=False)),
    )
