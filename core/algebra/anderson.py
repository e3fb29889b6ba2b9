"""Anderson's acceleration of repeated maps."""

import numpy as np

from ..types import Floats

_MEMORY = 5  # earlier steps that one is extrapolated from


class Anderson:
    """Accelerates a repeated map: half of the steps or fewer, to the same end.

    Parameters
    ----------
    smallest : float
        Regularization of the extrapolation, as a share of the squared changes of the steps: smaller changes are
        rounding, or where the map is not linear.

    References
    ----------
    Walker, Ni. Anderson acceleration for fixed-point iterations. SIAM J. Numer. Anal. 49, 2011.
    """

    def __init__(self, smallest: float) -> None:
        self._smallest = smallest
        self._last: tuple[Floats, Floats] | None = None
        self._differences: list[tuple[Floats, Floats]] = []

    def extrapolate(self, before: Floats, after: Floats) -> Floats:
        """Return the start of the next step, from the start and the end of the last one, arrays of one shape."""
        change = after - before
        if self._last is not None:
            difference = after - self._last[0], change - self._last[1]
            self._differences = [*self._differences[1 - _MEMORY :], difference]
        self._last = after, change
        changes = [changed for _, changed in self._differences]
        products = np.array([[_dot(left, right) for left in changes] for right in changes])
        if not products.any():  # the first step, or no step changed anything
            return after
        products += self._smallest * np.trace(products) * np.eye(len(products))
        share = np.linalg.solve(products, [_dot(changed, change) for changed in changes])
        steps = [part * ended for part, (ended, _) in zip(share, self._differences, strict=True)]
        return after - np.sum(steps, axis=0)


def _dot(left: Floats, right: Floats) -> float:
    """Return the dot product, not by BLAS, whose sums depend on the number of its threads."""
    return float(np.einsum("i,i->", left.ravel(), right.ravel()))
