import numpy as np
import pytest
from scipy.integrate import quad

from core import kernel as k


def planar_integral(function):
    return sum(quad(lambda r: 2.0 * np.pi * r * function(r), a, a + 1.0)[0] for a in range(3))


def test_kernel_integrates_to_one_over_the_plane():
    assert planar_integral(k.kernel) == pytest.approx(1.0, abs=1e-12)


def test_second_moment():
    assert planar_integral(lambda r: r**2 * k.kernel(r)) == pytest.approx(k.SECOND_MOMENT, abs=1e-12)


def test_support_ends_at_three():
    assert k.kernel(2.999) > 0.0
    assert np.all(k.kernel([3.0, 3.5, 100.0]) == 0.0)
    assert np.all(k.pair_kernel([3.0, 3.5, 100.0]) == 0.0)


def test_derivative_matches_differences_of_the_kernel():
    q = np.linspace(0.01, 3.2, 77)
    step = 1e-6
    difference = (k.kernel(q + step) - k.kernel(q - step)) / (2.0 * step)
    np.testing.assert_allclose(k.kernel_derivative(q), difference, atol=1e-9)
    assert np.all(k.kernel_derivative(q) <= 0.0)


def test_pair_kernel_is_the_derivative_divided_by_the_distance():
    q = np.linspace(1e-3, 2.99, 301)
    np.testing.assert_allclose(k.pair_kernel(q), -2.0 * k.kernel_derivative(q) / q, rtol=1e-9)


def test_pair_kernel_is_finite_at_zero():
    assert k.pair_kernel(0.0) == pytest.approx(k.pair_kernel(1e-6), rel=1e-9)
    assert np.isfinite(k.pair_kernel(0.0))


@pytest.mark.parametrize("t", [0.3, 1.0, 2.0, 4.0])
def test_symbol_is_the_eigenvalue_of_a_plane_wave(t):
    # Apply the planar operator to cos(t x) at 0, where it should return -s(t).
    def along(r):
        angle = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
        return k.pair_kernel(r) * r * np.mean(np.cos(t * r * np.cos(angle)) - 1.0) * 2.0 * np.pi

    value = sum(quad(along, a, a + 1.0)[0] for a in range(3))
    assert k.symbol(t) == pytest.approx(-value, rel=1e-9)


def test_symbol_expansion():
    t = np.array([0.02, 0.05, 0.1])
    np.testing.assert_allclose(k.symbol(t), t**2 - k.SECOND_MOMENT * t**4 / 8.0, rtol=1e-6)


def test_symbol_increases_over_the_resolved_range():
    assert np.all(np.diff(k.symbol(np.linspace(0.0, 5.5, 500))) > 0.0)
    assert k.symbol(k.RESOLVED) == pytest.approx(2.82, abs=5e-3)


def test_inverse_symbol():
    t = np.linspace(0.02, k.RESOLVED * (1.0 - 1e-9), 777)
    np.testing.assert_allclose(k.symbol(t) * k.inverse_ratio(k.symbol(t)), t**2, rtol=1e-10)


def test_inverse_symbol_at_its_ends():
    assert k.inverse_ratio(0.0) == 1.0
    assert np.isinf(k.inverse_ratio(3.0))
