"""Why results are in doubt where they are: what the neighbors of a point look like."""

from dataclasses import replace
from enum import IntEnum

import numpy as np

from ..linalg import eigvalsh
from ..types import Array, Floats, Ints
from .cells import Cells
from .nearest import ON, ROUNDS, Nearest, fading_weights
from .noise import FILLING

_OWN = 0.5  # two sheets: the residual of the own sheet's fit is at most this share of the mixed fit's
_AGREED = 0.8  # mean squared cosine of normals from which the points belong to one smooth surface
_LONG = 5.0  # area of the circle around a cell over the cell's: of rectangles 6 by 1; 3.3 of random points


class Doubt(IntEnum):
    """Causes for which the results at a point are in doubt.

    Attributes
    ----------
    NONE
        They are not.
    FEW
        The points are too few for how much the surface bends, or for how fast their density changes.
    VOLUME
        The neighbors fill a volume and lie on no surface, as in vegetation, or where details are finer than the
        spacing.
    NOISE
        They lie around a surface, but are off it by about the spacing.
    ROWS
        They lie in rows, far from each other.
    SHEETS
        Another sheet of the surface is about as near as the next points.
    LEFT_OUT
        The point is an outlier, or in a component of few points, and left out of the operator.

    See Also
    --------
    LaplaceBeltrami : Its `doubt` holds these.

    Examples
    --------
    None of the results on a well sampled sphere are in doubt; many on points throughout a cube are, for one cause:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> print(mf.build_laplacian(points).doubt.max())
    0
    >>> points = np.random.default_rng(0).uniform(-1.0, 1.0, (2000, 3))
    >>> doubt = mf.build_laplacian(points).doubt
    >>> print(mf.Doubt(np.bincount(doubt[doubt > 0]).argmax()).name)
    VOLUME
    """

    NONE = 0
    FEW = 1
    VOLUME = 2
    NOISE = 3
    ROWS = 4
    SHEETS = 5
    LEFT_OUT = 6


def likely_causes(nearest: Nearest, normals: Floats, cells: Cells, scatter: Floats) -> Ints:
    """Tell what would be wrong at every point, (m,) of `Doubt`, if its results should turn out to be in doubt.

    `scatter`, (2, m), are the `mean_misfits` of the fit to all neighbors, and of that to those on the point's own
    sheet, before noise was smoothed, in spacings. Where the fit to all neighbors has a large residual, but that to the
    own sheet has not, there are several sheets. Otherwise a residual above `FILLING`, which no shape has, is noise if
    the normals agree once it is smoothed, and no surface if they do not. Where it is small, points are in rows if cells
    are long and narrow, or else too few.
    """
    missed, own = scatter
    filling = missed > FILLING
    smooth = filling & (_agreement(nearest, normals) > _AGREED) if filling.any() else filling
    slender = np.exp(nearest.averaged(np.log(np.pi * cells.radius**2 / cells.areas)))
    return np.select(
        [(missed > ON) & (own < _OWN * missed), smooth, filling, slender > _LONG],
        [Doubt.SHEETS, Doubt.NOISE, Doubt.VOLUME, Doubt.ROWS],
        Doubt.FEW,
    )


def _agreement(nearest: Nearest, normals: Floats) -> Floats:
    """Return the mean squared cosine of the normals around every point to the direction that they agree with most."""
    everywhere = replace(nearest, weight=fading_weights(nearest.distance))  # over all sheets
    products = np.einsum("ia,ib->iab", normals, normals).reshape(-1, 9)
    products = everywhere.averaged(products, ROUNDS // 2)
    largest: Array = eigvalsh(products.reshape(-1, 3, 3))[:, 2]
    return largest
