"""Weights that fall off with a distance, by the shapes of Blender's proportional editing."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_doubles, check_array, positive
from ..errors import InvalidPointsError, PointCloudError
from ..types import Floats

# Of the share of the radius that is left, 1 at the source and 0 at the radius.
_SHAPES: dict[str, Callable[[Floats], Floats]] = {
    "smooth": lambda left: left * left * (3.0 - 2.0 * left),
    "sphere": lambda left: np.sqrt(left * (2.0 - left)),
    "root": np.sqrt,
    "inverse_square": lambda left: left * (2.0 - left),
    "sharp": lambda left: left * left,
    "linear": lambda left: left,
    "constant": lambda left: (left > 0.0).astype(float),
}


def falloff(distance: ArrayLike, radius: float, shape: str = "smooth") -> Floats:
    """Let weights fall off from 1 at the distance zero to 0 at a radius.

    Parameters
    ----------
    distance : array_like, (n,)
        Not negative [L]; infinite where no source reaches.
    radius : float
        Distance from which on weights are zero [L], above zero.
    shape : {"smooth", "sphere", "root", "inverse_square", "sharp", "linear", "constant"}
        As Blender's proportional editing names them.

    Returns
    -------
    ndarray, (n,)
        From 0 to 1.

    Raises
    ------
    InvalidPointsError
        Distances that are negative or no numbers.
    PointCloudError
        A radius that is not above zero, or an unknown shape.

    See Also
    --------
    geodesic_distance : Distances along the surface.

    Examples
    --------
    A quarter of the way around the unit sphere, and half of it:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> distance = mf.distance.geodesic_distance(mf.build_laplacian(points), [0])
    >>> weights = mf.distance.falloff(distance, np.pi / 2)
    >>> print(weights[[0, 400, 799]].round(1))
    [1. 0. 0.]
    """
    given = as_doubles(check_array(distance, "Distances", [(None,)], "Give one for each point."))
    wrong = np.count_nonzero(~(given >= 0.0))
    if wrong:
        raise InvalidPointsError(f"{wrong} of {len(given)} distances are negative or no numbers. Give them from 0 on.")
    reach = positive(radius, "radius")
    if not isinstance(shape, str) or shape not in _SHAPES:
        raise PointCloudError(f"There is no falloff {shape!r}. Choose from {', '.join(_SHAPES)}.")
    result: Floats = _SHAPES[shape](1.0 - np.minimum(given / reach, 1.0))
    return result
