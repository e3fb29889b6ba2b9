"""The quintic spline kernel of the paper's appendix, and its symbol on a flat patch.

All functions take the dimensionless distance ``q = distance / h``. In physical units ``W_h(r) = kernel(r / h) / h**2``
and the pair weight of the operator, ``-2 W_h'(r) / r``, is ``pair_kernel(r / h) / h**4``.
"""

import functools

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import j0

from .types import Floats

SUPPORT = 3.0
"""Radius of the kernel's support in units of h."""

NORMALIZATION = 7.0 / (478.0 * np.pi)
"""Makes the kernel integrate to one over the plane."""

SECOND_MOMENT = 2771.0 / 2868.0
"""Integral of |x|^2 W_1 over the plane: ``mu2`` of the symbol's expansion ``s(t) = t^2 - mu2 t^4 / 8 + ...``."""

RESOLVED = 2.2
"""Largest ``t = k h`` whose frequency k is recovered from the symbol without multiplying noise by more than 3."""


def kernel(q: ArrayLike) -> Floats:
    """Evaluate the kernel W_1 at distances in units of the smoothing length; it is zero beyond the support of 3."""
    q = np.asarray(q, dtype=np.float64)
    return NORMALIZATION * (_power(3.0 - q, 5) - 6.0 * _power(2.0 - q, 5) + 15.0 * _power(1.0 - q, 5))


def kernel_derivative(q: ArrayLike) -> Floats:
    """Evaluate the derivative W_1'(q), never positive."""
    q = np.asarray(q, dtype=np.float64)
    return -5.0 * NORMALIZATION * (_power(3.0 - q, 4) - 6.0 * _power(2.0 - q, 4) + 15.0 * _power(1.0 - q, 4))


def pair_kernel(q: ArrayLike) -> Floats:
    """Evaluate ``-2 W_1'(q) / q``, the pair weight of eqs. (3) and (10), finite (240 x normalisation) at q = 0."""
    q = np.asarray(q, dtype=np.float64)
    near = np.minimum(q, 1.0)
    far = np.maximum(q, 1.0)
    outer = 5.0 * (_power(3.0 - far, 4) - 6.0 * _power(2.0 - far, 4)) / far
    inner = 120.0 + near * near * (50.0 * near - 120.0)  # the same quotient for q < 1, divided out by hand
    return 2.0 * NORMALIZATION * np.where(q < 1.0, inner, outer)


def symbol(t: ArrayLike) -> Floats:
    """Evaluate s(t): on a flat patch a wave of frequency k has the eigenvalue ``s(k h) / h**2``.

    It is ``-4 pi * integral_0^3 W_1'(r) (1 - J0(t r)) dr``, by Gauss-Legendre quadrature on the spline's three
    intervals, for frequencies times the smoothing length, not negative.
    """
    nodes, weights = np.polynomial.legendre.leggauss(24)
    radii = np.concatenate([(nodes + 1.0) / 2.0 + start for start in range(3)])
    weights = np.tile(weights / 2.0, 3) * kernel_derivative(radii)
    t = np.asarray(t, dtype=np.float64)
    return -4.0 * np.pi * ((1.0 - j0(t[..., None] * radii)) @ weights)


def inverse_ratio(s: ArrayLike) -> Floats:
    """Invert the symbol on its increasing branch: return ``t^2 / s`` for the t with ``symbol(t) = s``, not negative.

    It is smooth and close to one, so that small eigenvalues keep their relative accuracy. It is infinite past the
    resolved range, ``s(2.2) = 2.82``.
    """
    s = np.asarray(s, dtype=np.float64)
    slope, limit = _slope_of_ratio()
    within = np.clip(s, 0.0, limit)
    return np.where(s <= limit, 1.0 + within * slope(within), np.inf)


@functools.cache
def _slope_of_ratio() -> tuple[np.polynomial.Chebyshev, float]:
    """Return ``(t^2 / s - 1) / s`` as a polynomial of s, as exact as the symbol is, and how far it holds."""
    t = np.linspace(0.0, RESOLVED, 513)[1:]
    s = symbol(t)
    slope = np.polynomial.Chebyshev.fit(s, (t**2 / s - 1.0) / s, 20, domain=[0.0, s[-1]], w=s)
    return slope, s[-1]


def _power(base: Floats, exponent: int) -> Floats:
    base = np.maximum(base, 0.0)
    squared = base * base
    return squared * squared * base if exponent == 5 else squared * squared
