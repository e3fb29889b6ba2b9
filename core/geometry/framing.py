"""What a picture of points is to hold."""

import numpy as np

from ..types import Floats


def without_far(points: Floats) -> Floats:
    """Return points, (n, 3), but those few that are further away from the others than these reach, (k, 3).

    They reach along each axis over all but the outermost two percent at both ends.
    """
    low, high = np.percentile(points, (2.0, 98.0), axis=0)
    far = np.max(high - low)
    near = ((points >= low - far) & (points <= high + far)).all(axis=1)
    return points[near]
