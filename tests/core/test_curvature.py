"""The terms of curvature, against integrals over spheres."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import eval_legendre

from core.kernel import SUPPORT, kernel, pair_kernel
from core.operator.curvature import kernel_integral, second_moment, weight_factor

WIDTHS = 0.05, 0.1, 0.2, 0.3  # h on the unit sphere


def over_sphere(function, h):
    """Integrate a function of the distance from a point, up to 3 h."""
    pieces = (quad(lambda s: function(s) * np.sin(s), i * h, (i + 1) * h)[0] for i in range(int(SUPPORT)))
    return 2.0 * np.pi * sum(pieces)


def scaled(of, h, radius):
    """A term on a sphere of this radius, whose kernel is as wide as h on the unit sphere."""
    return of(np.array([h * radius]), np.array([1.0 / radius**2]))[0]


@pytest.mark.parametrize("radius", [0.5, 1.0, 20.0])
@pytest.mark.parametrize("h", WIDTHS)
class TestOnSpheres:
    # All errors are of sixth order in h.
    def test_integral_of_the_kernel(self, h, radius):
        exact = over_sphere(lambda s: kernel(s / h) / h**2, h)
        assert scaled(kernel_integral, h, radius) == pytest.approx(exact, abs=0.02 * h**4)

    def test_second_moment_of_the_weights(self, h, radius):
        exact = over_sphere(lambda s: s**2 * pair_kernel(s / h) / h**4, h) * scaled(weight_factor, h, radius)
        assert 4.0 * scaled(second_moment, h, radius) == pytest.approx(exact, abs=0.2 * h**4)

    def test_weights_give_slow_functions_their_eigenvalue(self, h, radius):
        # Relative to l (l + 1), as a polynomial in it at zero: the symbol has no part in that.
        degrees = np.arange(1, 7)
        exact = degrees * (degrees + 1.0)
        found = [
            over_sphere(
                lambda s, degree=degree: (1.0 - eval_legendre(degree, np.cos(s))) * pair_kernel(s / h) / h**4, h
            )
            for degree in degrees
        ]
        slow = np.polynomial.Polynomial.fit(exact, found / exact, len(degrees) - 1)(0.0)
        assert slow * scaled(weight_factor, h, radius) == pytest.approx(1.0, abs=0.05 * h**4)


def test_curvature_that_points_cannot_tell_changes_little():
    for of in (kernel_integral, weight_factor, second_moment):
        assert 0.3 < of(np.array([1.0]), np.array([-1e6]))[0] < 2.0
        assert 0.3 < of(np.array([1.0]), np.array([1e6]))[0] < 2.0
