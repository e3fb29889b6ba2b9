"""Anderson acceleration of fixed-point iterations."""

import numpy as np

from ..linalg import solve
from ..types import Floats

_MEMORY = 5  # previous steps that the next one is extrapolated from


class Anderson:
    """Accelerates a fixed-point iteration: half of the steps or fewer, to the same fixed point.

    Smaller differences of residuals than the smallest, a regularization of the least squares relative to the trace of
    their matrix, are rounding error, or due to the map's not being linear. (Walker, Ni. Anderson acceleration for
    fixed-point iterations. SIAM J. Numer. Anal. 49, 2011.)
    """

    def __init__(self, smallest: float) -> None:
        self._smallest = smallest
        self._last: tuple[Floats, Floats] | None = None
        self._differences: list[tuple[Floats, Floats]] = []

    def extrapolate(self, before: Floats, after: Floats) -> Floats:
        """Return the next iterate, from the last one and what the map made of it, arrays of one shape."""
        change = after - before
        if self._last is not None:
            difference = after - self._last[0], change - self._last[1]
            self._differences = [*self._differences[1 - _MEMORY :], difference]
        self._last = after, change
        shares = self._shares(change)
        if not shares:
            return after
        steps = [part * ended for part, (ended, _) in zip(shares, self._differences, strict=True)]
        return after - np.sum(steps, axis=0)

    def _shares(self, change: Floats) -> tuple[float, ...]:
        """Return the coefficients of least residual; none at first, or if no step changed anything."""
        changes = [changed for _, changed in self._differences]
        products = np.array([[_dot(left, right) for left in changes] for right in changes])
        if not products.any():
            return ()
        products += self._smallest * np.trace(products) * np.eye(len(products))
        return tuple(solve(products, [_dot(changed, change) for changed in changes]).tolist())


def _dot(left: Floats, right: Floats) -> float:
    """Return the dot product, not by BLAS, whose sums depend on the number of its threads."""
    return float(np.einsum("i,i->", left.ravel(), right.ravel()))
