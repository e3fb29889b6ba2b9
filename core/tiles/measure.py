"""A tile measured as it is within the whole cloud."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from ..frozen import Frozen
from ..geometry import Agreed
from ..operator import build_laplacian
from ..options import LaplacianOptions
from ..progress import ends_at_one
from ..types import Bools, Floats, Ints, Progress
from .cut import Tile
from .measures import results


@dataclass(frozen=True, eq=False)
class Measured(Frozen):
    """The results in the box of a tile, (k,) each, as of `LaplaceBeltrami` of the whole cloud.

    Attributes
    ----------
    rows : ndarray, (k,) int
        Which of the cloud's points.
    normals, areas, smoothing_lengths, quadric_mean_curvature, gaussian_curvature, boundary, trust, doubt,
    surface_points
        As of `LaplaceBeltrami`.
    mean_curvature : ndarray, (k,)
        See `mf.mean_curvature`.
    component : ndarray, (k,) int
        By the numbers that all tiles agree on; -1 for points left out.
    stiffness : csr_array, (k, n)
        Rows of the matrix of the whole cloud.
    notices : list of str
        Texts for the user, of the tile with its halo.
    """

    rows: Ints
    normals: Floats
    areas: Floats
    smoothing_lengths: Floats
    quadric_mean_curvature: Floats
    gaussian_curvature: Floats
    mean_curvature: Floats
    component: Ints
    boundary: Bools
    trust: Floats
    doubt: Ints
    surface_points: Floats
    stiffness: sparse.csr_array
    notices: list[str]


@ends_at_one
def measure_tile(
    points: ArrayLike,
    tile: Tile,
    agreed: Agreed,
    options: LaplacianOptions = LaplacianOptions(),
    *,
    progress: Progress | None = None,
) -> Measured:
    """Build the operator on a tile and its halo, and return what it says of the points in the box.

    Parameters
    ----------
    points : array_like, (n, 3)
        Coordinates of the whole cloud [L]; only those of the tile are looked at.
    tile : Tile
        From `cut`.
    agreed : Agreed
        From `survey`, or of an operator of the whole cloud.
    options : LaplacianOptions
        The same as of the survey.
    progress : callable, optional
        Called as ``progress(stage, fraction)``; may raise `Cancelled`.

    Returns
    -------
    Measured

    Raises
    ------
    PointCloudError
        The points of the tile have no sound answer; see `build_laplacian`.

    Examples
    --------
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> tiles = mf.tiles.cut(points, 2)
    >>> agreed = mf.tiles.survey(points, tiles)
    >>> parts = [mf.tiles.measure_tile(points, tile, agreed) for tile in tiles]
    >>> print(sum(part.areas.sum() for part in parts).round(1))
    12.6
    """
    points = np.asarray(points)
    count, inner = len(points), np.flatnonzero(tile.inner)
    part = build_laplacian(points[tile.rows], options=options, agreed=agreed.among(tile.rows, count), progress=progress)
    label = agreed.component if agreed.sheet is None else agreed.sheet
    rows = part.stiffness[inner]
    found, notices = results(part, None if label is None else label[tile.rows], inner)
    return Measured(
        rows=tile.rows[inner],
        **found,
        stiffness=sparse.csr_array((rows.data, tile.rows[rows.indices], rows.indptr), shape=(len(inner), count)),
        notices=notices,
    )
