import numpy as np
import pytest
from scipy.special import sph_harm_y

import core
from benchmarks.samplings import fibonacci_sphere, square_grid


def harmonic(degree, order, points):
    """Real spherical harmonic of unit norm, times the root of two for an order above zero."""
    return sph_harm_y(degree, order, np.arccos(points[:, 2]), np.arctan2(points[:, 1], points[:, 0])).real


@pytest.fixture(scope="module")
def sphere():
    return core.build_laplacian(fibonacci_sphere(2000))


@pytest.fixture(scope="module")
def spectrum(sphere):
    return sphere.eigenpairs(49)


@pytest.fixture(scope="module")
def components():
    """Two spheres, three lone points that get no operator."""
    points = np.concatenate([fibonacci_sphere(900), 0.5 * fibonacci_sphere(600) + [5.0, 0.0, 0.0]])
    lone = [[0.0, 90.0, 0.0], [0.0, 90.0, 1.0], [0.0, 91.0, 0.0]]
    return core.build_laplacian(np.concatenate([points, lone]))


def relative(found, exact):
    return np.linalg.norm(found - exact) / np.linalg.norm(exact)


@pytest.mark.parametrize(("degree", "order"), [(3, 0), (5, 4)])
def test_the_first_modes_hold_a_spherical_harmonic_and_the_ones_before_do_not(sphere, spectrum, degree, order):
    values = harmonic(degree, order, sphere.points)
    held = core.clean.spectral_filter(values, spectrum, sphere.areas, (degree + 1) ** 2)
    assert relative(held, values) < 1e-2
    assert np.linalg.norm(
        core.clean.spectral_filter(values, spectrum, sphere.areas, degree**2)
    ) < 1e-2 * np.linalg.norm(values)


def test_response_multiplies_each_degree_by_its_factor(sphere, spectrum):
    low, high = harmonic(1, 0, sphere.points), harmonic(4, 2, sphere.points)
    found = core.clean.spectral_filter(low + high, spectrum, sphere.areas, lambda k2: 1.0 / (1.0 + k2))
    assert relative(found, low / 3.0 + high / 21.0) < 5e-3


def test_rest_is_the_factor_of_what_the_spectrum_does_not_hold(sphere, spectrum):
    low, beyond = harmonic(2, 1, sphere.points), harmonic(9, 3, sphere.points)
    found = core.clean.spectral_filter(low + beyond, spectrum, sphere.areas, core.clean.exponential(0.1), rest=0.25)
    assert relative(found, np.exp(-0.6) * low + 0.25 * beyond) < 5e-3
    unchanged = core.clean.spectral_filter(beyond, spectrum, sphere.areas, np.ones_like, rest=1.0)
    np.testing.assert_allclose(unchanged, beyond, atol=1e-12)


def test_columns_are_filtered_one_by_one(sphere, spectrum):
    values = np.random.default_rng(0).standard_normal((2000, 2))
    for filtered in (
        lambda f: core.clean.spectral_filter(f, spectrum, sphere.areas, 10),
        lambda f: core.clean.chebyshev_filter(sphere, f, core.clean.exponential(0.02)),
    ):
        both = filtered(values)
        assert both.shape == values.shape
        np.testing.assert_allclose(both[:, 1], filtered(values[:, 1]), atol=1e-12)


@pytest.mark.parametrize(
    "response",
    [
        core.clean.exponential(0.05),
        core.clean.fairing(0.02),
        core.clean.fairing(0.05, 1),
        core.clean.band(4.0, 25.0),
        core.clean.boost(1.5, 10.0),
        lambda k2: np.interp(k2, [0.0, 20.0, 40.0], [1.0, 1.3, 0.1]),
    ],
    ids=["exponential", "fairing", "implicit step", "band", "boost", "curve"],
)
def test_polynomial_has_the_factors_of_the_response(sphere, response):
    for degree in (0, 1, 3, 5):
        values = harmonic(degree, min(degree, 2), sphere.points)
        found = core.clean.chebyshev_filter(sphere, values, response)
        factor = response(np.array([degree * (degree + 1.0)]))[0]
        np.testing.assert_allclose(found, factor * values, atol=1e-2)


def test_polynomial_and_modes_agree(sphere, spectrum):
    values = np.exp(sphere.points[:, 0])
    smooth = core.clean.exponential(0.3)
    modes = core.clean.spectral_filter(values, spectrum, sphere.areas, smooth)
    assert relative(core.clean.chebyshev_filter(sphere, values, smooth), modes) < 1e-3


def test_first_order_fairing_solves_the_implicit_equation(sphere):
    values = np.random.default_rng(0).standard_normal(2000)
    found = core.clean.chebyshev_filter(sphere, values, core.clean.fairing(0.1, 1), tolerance=1e-8)
    np.testing.assert_allclose(found - 0.1 * sphere.apply(found), values, atol=1e-5)
    found = core.clean.chebyshev_filter(sphere, values, core.clean.fairing(0.1, 1), raw=True, tolerance=1e-8)
    areas = sphere.areas
    np.testing.assert_allclose(
        areas * found + 0.1 * (sphere.stiffness @ found), areas * values, atol=1e-5 * areas.max()
    )


def test_polynomial_of_functions_that_vanish_at_a_boundary():
    laplacian = core.build_laplacian(square_grid(21))
    x, y, _ = laplacian.points.T
    values = np.sin(np.pi * x) * np.sin(2.0 * np.pi * y)
    found = core.clean.chebyshev_filter(laplacian, values, core.clean.exponential(0.02), dirichlet=True)
    assert relative(found, np.exp(-0.1 * np.pi**2) * values) < 3e-2
    level = np.cos(np.pi * x) * np.cos(2.0 * np.pi * y)
    found = core.clean.chebyshev_filter(laplacian, level, core.clean.exponential(0.02))
    assert relative(found, np.exp(-0.1 * np.pi**2) * level) < 3e-2


def test_heat_is_kept_on_each_part_alone(components):
    values = np.random.default_rng(0).random(len(components.areas))
    found = core.clean.chebyshev_filter(components, values, core.clean.exponential(0.1), tolerance=1e-8)
    for part in (0, 1):
        mass = np.where(components.component == part, components.areas, 0.0)
        assert mass @ found == pytest.approx(mass @ values, rel=1e-5)
    # For a long time all becomes even.
    found = core.clean.chebyshev_filter(components, values, core.clean.exponential(9.0), tolerance=1e-8)
    for part in (0, 1):
        assert np.ptp(found[components.component == part]) < 1e-3
    left_out = components.component < 0
    assert np.count_nonzero(left_out) == 3
    np.testing.assert_array_equal(found[left_out], values[left_out])


def test_fewer_modes_than_parts_are_refused(components):
    spectrum = components.eigenpairs(6)
    values = np.where(components.component == 0, 2.0, -1.0)
    with pytest.raises(core.PointCloudError, match="first 2 modes are the constants"):
        core.clean.spectral_filter(values, spectrum, components.areas, 1)
    found = core.clean.spectral_filter(values, spectrum, components.areas, 2)
    known = components.component >= 0
    np.testing.assert_allclose(found[known], values[known], atol=1e-6)
    assert np.all(found[~known] == 0.0)


@pytest.mark.parametrize(
    ("low", "high", "factors"),
    [(4.0, 100.0, [0, 1, 0]), (0.0, 100.0, [1, 1, 0]), (4.0, np.inf, [0, 1, 1]), (0.0, np.inf, [1, 1, 1])],
)
def test_band_keeps_what_is_inside(low, high, factors):
    response = core.clean.band(low, high)
    np.testing.assert_allclose(response(np.array([2.0, 25.0, 200.0])), factors, atol=1e-3)
    for edge in {low, high} - {0.0, np.inf}:
        assert response(np.array([edge]))[0] == pytest.approx(0.5, abs=1e-6)


def test_boost_raises_details_by_its_gain():
    np.testing.assert_allclose(core.clean.boost(3.0, 50.0)(np.array([0.0, 1e4])), [1.0, 3.0], atol=1e-3)


@pytest.mark.parametrize(
    "make",
    [
        lambda: core.clean.exponential(-1.0),
        lambda: core.clean.exponential(np.nan),
        lambda: core.clean.fairing(np.inf),
        lambda: core.clean.fairing(1.0, 7),
        lambda: core.clean.band(3.0, 2.0),
        lambda: core.clean.band(1.0, 2.0, softness=0.0),
        lambda: core.clean.boost(np.nan, 1.0),
    ],
)
def test_impossible_responses(make):
    with pytest.raises(core.PointCloudError, match="Use"):
        make()


@pytest.mark.parametrize(
    ("response", "words"),
    [
        (lambda k2: np.tile(k2, 2), "shape"),
        (lambda k2: np.log(k2 - 1.0 + 0.0 * k2), "not finite"),
        (lambda k2: k2 + 1j, "complex"),
    ],
)
@pytest.mark.filterwarnings("ignore:invalid value")
def test_responses_that_give_no_numbers(sphere, spectrum, response, words):
    values = sphere.points[:, 0]
    with pytest.raises(core.PointCloudError, match=words):
        core.clean.spectral_filter(values, spectrum, sphere.areas, response)
    with pytest.raises(core.PointCloudError, match=words):
        core.clean.chebyshev_filter(sphere, values, response)


def test_a_step_is_too_abrupt_for_a_polynomial(sphere):
    with pytest.raises(core.PointCloudError, match="Soften it"):
        core.clean.chebyshev_filter(sphere, sphere.points[:, 0], lambda k2: (k2 < 20.0).astype(float))


@pytest.mark.parametrize("count", [0, -1, 50, 2.5, True, None])
def test_impossible_numbers_of_modes(sphere, spectrum, count):
    with pytest.raises(core.PointCloudError, match="from 1 to 49"):
        core.clean.spectral_filter(sphere.points, spectrum, sphere.areas, count)


@pytest.mark.parametrize(
    ("values", "words"),
    [(np.zeros(5), "2000 points"), (np.full(2000, np.nan), "2000 of 2000"), (np.zeros((2000, 2, 2)), "2000 points")],
)
def test_bad_values(sphere, spectrum, values, words):
    with pytest.raises(core.InvalidPointsError, match=words):
        core.clean.spectral_filter(values, spectrum, sphere.areas, 4)
    with pytest.raises(core.InvalidPointsError, match=words):
        core.clean.chebyshev_filter(sphere, values, core.clean.exponential(1.0))
