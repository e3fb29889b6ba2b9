"""Chebyshev polynomials of a matrix, by its products."""

from collections.abc import Callable, Iterator

import numpy as np
from scipy.fft import dct

from ..types import Floats

NODES = 4096  # at which a function is evaluated


def chebyshev_nodes() -> Floats:
    """Return the places in [-1, 1] at which `chebyshev_coefficients` takes a function, descending."""
    return np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)


def chebyshev_coefficients(values: Floats) -> Floats:
    """Return the coefficients of the polynomial through a function's values at `chebyshev_nodes`, (NODES,)."""
    coefficients = dct(values) / NODES
    coefficients[0] *= 0.5
    return coefficients


def degree_needed(coefficients: Floats, tolerance: float) -> int:
    """Return the lowest degree beyond which the coefficients sum to no more than a tolerance."""
    left = np.append(np.cumsum(np.abs(coefficients[::-1]))[::-1][1:], 0.0)  # bound of the error from each degree on
    return int(np.argmax(left <= tolerance))


def chebyshev_sum(product: Callable[[Floats], Floats], coefficients: Floats, start: Floats) -> Floats:
    """Return the sum of the first `chebyshev_terms`, each times its coefficient, as an array of the same shape."""
    result = np.zeros_like(start)
    for coefficient, term in zip(coefficients, chebyshev_terms(product, start), strict=False):
        result += coefficient * term
    return result


def chebyshev_terms(product: Callable[[Floats], Floats], start: Floats) -> Iterator[Floats]:
    """Yield ``T_0(M) y``, ``T_1(M) y`` and so on, without end, for the Chebyshev polynomials T_k; not to be changed.

    `product` returns M y for y, of any shape, as a new array. The eigenvalues of M should lie in [-1, 1], where no term
    grows.
    """
    yield start
    before, now = start, product(start)
    while True:
        yield now
        following = product(now)
        following *= 2.0
        following -= before
        before, now = now, following


def chebyshev_steps(least: float, largest: float) -> Iterator[tuple[float, float]]:
    """Yield the coefficients of Chebyshev's semi-iteration for linear equations, step by step, without end.

    Parameters
    ----------
    least, largest : float
        Bounds of the eigenvalues, 0 < least < largest. Components of smaller eigenvalues converge more slowly.

    Yields
    ------
    kept, rate : float
        The next step is the last one times `kept`, and the residual times `rate`. After k steps the residual is that
        polynomial of degree k of the first one which is least over all eigenvalues, ``T_k((b + a - 2 x) / (b - a))``
        over its value at x = 0, for bounds a and b.

    References
    ----------
    Golub, Varga. Chebyshev semi-iterative methods. Numer. Math. 3, 1961.
    """
    middle, half = 0.5 * (largest + least), 0.5 * (largest - least)
    ratio = half / middle
    yield 0.0, 1.0 / middle
    while True:
        following = 1.0 / (2.0 * middle / half - ratio)
        yield following * ratio, 2.0 * following / half
        ratio = following
