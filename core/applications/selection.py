"""Sets of points: grown by distance along the cloud."""

import numpy as np
from scipy.sparse.csgraph import dijkstra

from ..arguments import real
from ..errors import PointCloudError
from ..geometry import as_mask
from .graph import near_graph

_NEIGHBORS = 20  # so many directions make paths at most 2 % longer than the way along the surface


def grow(laplacian, chosen, distance):
    """Add all points within a distance along the surface to a set of points.

    Distances are lengths of paths from neighbour to neighbour on the same sheet, so that the set does not jump to
    another sheet, or another component, that passes nearby. They are a few percent too long at most.

    Parameters
    ----------
    laplacian : LaplaceBeltrami
        Of n points.
    chosen : array_like, (k,) int or (n,) bool
        The set, which may be empty.
    distance : float
        How far to grow [L], not negative; infinity selects whole components.

    Returns
    -------
    ndarray, (n,) bool
        The points chosen, and those near them. Points left out of the operator are only in it if they were chosen.

    Raises
    ------
    InvalidPointsError
        Neither whole numbers below n nor n truth values.
    PointCloudError
        A distance that is negative or not a number.

    See Also
    --------
    geodesic_distance : The distances themselves.
    segment : Sets of points found by shape.

    Examples
    --------
    A cap of the unit sphere that ends pi / 3 from its pole is a quarter of it:

    >>> import numpy as np
    >>> import core
    >>> z = 1 - (np.arange(800) + 0.5) / 400  # 800 points, evenly on the unit sphere
    >>> ring = np.sqrt(1 - z**2) * np.exp(2.39996j * np.arange(800))
    >>> points = np.column_stack([ring.real, ring.imag, z])
    >>> laplacian = core.build_laplacian(points)
    >>> print(core.grow(laplacian, [0], np.pi / 3).mean().round(2))
    0.25
    """
    mask = as_mask(chosen, len(laplacian.points))
    reach = real(distance)
    if not reach >= 0.0:
        raise PointCloudError(f"The distance to grow by is {distance!r}. Use a number that is not negative.")
    graph = near_graph(laplacian, _NEIGHBORS)
    start = np.unique(graph.place[mask & (graph.place >= 0)])
    if not len(start):
        return mask.copy()
    way = dijkstra(graph.lengths, directed=False, indices=start, min_only=True, limit=reach)
    return mask | graph.scatter(np.isfinite(way), False)
