"""What tests of long shapes measure."""

import numpy as np


def axis_of(points):
    """The longest axis of points, their middle, and half of their length along it."""
    middle = points.mean(axis=0)
    axis = np.linalg.svd(points - middle, full_matrices=False)[2][0]
    return middle, axis, np.ptp(points @ axis) / 2
