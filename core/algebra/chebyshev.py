"""Polynomials of a matrix, by its products."""

from collections.abc import Callable, Iterator

from ..types import Floats


def chebyshev_terms(product: Callable[[Floats], Floats], start: Floats) -> Iterator[Floats]:
    """Yield ``T_0(M) y``, ``T_1(M) y`` and so on, without end, for the Chebyshev polynomials T_k.

    Parameters
    ----------
    product : callable
        y -> M y, a new array each time. The eigenvalues of M should lie in [-1, 1], where no term grows.
    start : ndarray
        y, of any shape.

    Yields
    ------
    ndarray
        Not to be changed.
    """
    yield start
    before, now = start, product(start)
    while True:
        yield now
        following = product(now)
        following *= 2.0
        following -= before
        before, now = now, following
