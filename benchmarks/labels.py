"""Compare divisions into parts, whose numbers mean nothing."""

import numpy as np
from scipy.optimize import linear_sum_assignment


def matched(labels, others):
    """Number the parts of a division anew, as well as they can be matched with those of another one, (n,) int."""
    table = np.zeros((max(labels.max(), others.max()) + 1,) * 2)
    np.add.at(table, (labels, others), 1.0)
    return linear_sum_assignment(table, maximize=True)[1][labels]


def agreement(labels, others):
    """Share of points with the same label, after the numbers of the labels are matched as well as they can be."""
    return np.mean(matched(labels, others) == others)
