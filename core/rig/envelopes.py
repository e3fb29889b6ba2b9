"""The envelopes of bones: capsules that fade outwards, by which weights may be multiplied."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_doubles, check_array, check_finite
from ..types import Floats


def envelope_share(
    points: ArrayLike,
    heads: ArrayLike,
    tails: ArrayLike,
    head_radii: ArrayLike,
    tail_radii: ArrayLike,
    distances: ArrayLike,
) -> Floats:
    """Find how far points are within the envelopes of bones, as Blender's *Multiply Vertex Group with Envelope* does.

    Parameters
    ----------
    points : array_like, (k, 3)
        At rest [L].
    heads, tails : array_like, (k, 3)
        Ends of the bone of each point [L].
    head_radii, tail_radii : array_like, (k,)
        Radii of its envelope at the ends [L], linear between them.
    distances : array_like, (k,)
        How far outside of it the share falls to zero [L].

    Returns
    -------
    ndarray, (k,)
        One within the radius, and one minus the square of the share of the distance outside.

    Raises
    ------
    InvalidPointsError
        Arrays of wrong shapes, or not finite.

    See Also
    --------
    skin : Moves points by weights.

    Examples
    --------
    A bone from the center of the unit sphere to its pole, and an envelope of half a unit that fades within another:

    >>> import numpy as np
    >>> import meshfree_laplacian as mf
    >>> points = mf.example_sphere()
    >>> heads, tails = np.zeros_like(points), np.zeros_like(points) + (0, 0, 1)
    >>> half = np.full(len(points), 0.5)
    >>> found = mf.rig.envelope_share(points, heads, tails, half, half, half)
    >>> print(found[[0, 200, 799]].round(1))
    [1.  0.5 0. ]
    """
    advice = "Give points, ends, radii and distances in rows, one for each pair of a point and a bone."
    count = len(check_array(points, "Points", [(None, 3)], advice))
    vectors = [as_doubles(check_array(each, "Ends", [(count, 3)], advice)) for each in (points, heads, tails)]
    numbers = [
        as_doubles(check_array(each, "Radii", [(count,)], advice)) for each in (head_radii, tail_radii, distances)
    ]
    for each in (*vectors, *numbers):
        check_finite(each, "points or envelopes", advice)
    (place, head, tail), (first, last, reach) = vectors, numbers
    along, offset = tail - head, place - head
    squared = np.einsum("kc,kc->k", along, along)
    share = np.clip(np.einsum("kc,kc->k", offset, along) / np.where(squared > 0.0, squared, 1.0), 0.0, 1.0)
    outside = np.linalg.norm(offset - share[:, None] * along, axis=1) - (first + share * (last - first))
    fading = np.maximum(1.0 - (outside / np.where(reach > 0.0, reach, 1.0)) ** 2, 0.0)
    return np.where(outside <= 0.0, 1.0, np.where(outside < reach, fading, 0.0))
