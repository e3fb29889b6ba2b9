"""Anderson's acceleration of repeated maps."""

import numpy as np

_MEMORY = 5  # earlier steps that one is extrapolated from


class Anderson:
    """Accelerates a repeated map: half of the steps or fewer, to the same end.

    Parameters
    ----------
    smallest : float
        Share of what steps change that an extrapolation goes by: less is rounding, or what the map is not linear in.

    References
    ----------
    Walker, Ni. Anderson acceleration for fixed-point iterations. SIAM J. Numer. Anal. 49, 2011.
    """

    def __init__(self, smallest):
        self._smallest, self._last, self._differences = smallest, None, []

    def extrapolate(self, before, after):
        """Return where to go on from, given where the last step began and ended, both of any one shape."""
        change = after - before
        if self._last is not None:
            difference = after - self._last[0], change - self._last[1]
            self._differences = [*self._differences[1 - _MEMORY :], difference]
        self._last = after, change
        changes = [changed for _, changed in self._differences]
        products = np.array([[_dot(left, right) for left in changes] for right in changes])
        if not products.any():  # the first step, or all ended at one place
            return after
        products += self._smallest * np.trace(products) * np.eye(len(products))
        share = np.linalg.solve(products, [_dot(changed, change) for changed in changes])
        return after - sum(part * ended for part, (ended, _) in zip(share, self._differences, strict=True))


def _dot(left, right):
    """Return the dot product, not by BLAS, whose sums depend on the number of its threads."""
    return np.einsum("i,i->", left.ravel(), right.ravel())
