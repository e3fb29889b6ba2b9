from dataclasses import replace

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere, square_grid, strip_points, torus_potential

OFF = 1e-6  # rounding, and the tolerance of the solver


@pytest.fixture(scope="module")
def strip():
    return core.build_laplacian(strip_points())


@pytest.fixture(scope="module")
def random_strip():
    return core.build_laplacian(strip_points(1400))


@pytest.fixture(scope="module")
def components():
    """Operator of a sphere, a smaller one far off, and three lone points."""
    lone = [[20.0, 0.0, 0.0], [0.0, 30.0, 0.0], [0.0, 0.0, 40.0]]
    return core.build_laplacian(
        np.concatenate([fibonacci_sphere(900), 0.5 * fibonacci_sphere(400) + [5.0, 0.0, 0.0], lone])
    )


def ends(points):
    """Both end bands of the strip, 0.25 wide, and the linear function between 0 and 1 there."""
    x = points[:, 0]
    return (x <= 0.25 + 1e-12) | (x >= 2.75 - 1e-12), np.clip((x - 0.25) / 2.5, 0.0, 1.0)


def demeaned(laplacian, values):
    return values - laplacian.areas @ values / laplacian.areas.sum()


def relative(found, exact):
    return np.linalg.norm(found - exact) / np.linalg.norm(exact)


@pytest.mark.parametrize(("name", "bound"), [("coarse torus", 1e-3), ("fine torus", 2e-4), ("random torus", 2e-3)])
def test_poisson_on_the_torus(operators, name, bound):
    laplacian = operators(name)
    points = laplacian.points
    found = core.distance.solve_poisson(laplacian, -points[:, 0] / np.hypot(points[:, 0], points[:, 1]))
    assert relative(found, demeaned(laplacian, torus_potential(points))) < bound
    assert abs(laplacian.areas @ found) < 1e-10


def test_the_correction_for_the_kernel_s_width_helps(operators):
    laplacian = operators("random sphere", 1.7)  # the wider, the more it corrects
    x = laplacian.points[:, 0]
    found = core.distance.solve_poisson(laplacian, demeaned(laplacian, 6.0 * (x**2 - 1.0 / 3.0)))
    plain = replace(laplacian, kernel_widths=np.zeros(len(x)))
    raw = core.distance.solve_poisson(plain, demeaned(plain, 6.0 * (x**2 - 1.0 / 3.0)))
    assert relative(found, x**2 - 1.0 / 3.0) < 3e-3
    assert relative(raw, x**2 - 1.0 / 3.0) > 5.0 * relative(found, x**2 - 1.0 / 3.0)


def test_without_fixed_points_it_inverts_apply(operators):
    laplacian = operators("even sphere")
    source = demeaned(laplacian, laplacian.points[:, 2] ** 3)
    assert relative(-laplacian.apply(core.distance.solve_poisson(laplacian, source)), source) < 5e-3


def test_a_source_with_a_mean_is_refused(operators):
    laplacian = operators("even sphere")
    with pytest.raises(core.PointCloudError, match="mean 1 over a component of 2500 points"):
        core.distance.solve_poisson(laplacian, 1.0)
    with pytest.raises(core.PointCloudError, match="Subtract"):
        core.distance.solve_poisson(laplacian, laplacian.points[:, 0] + 0.1)


@pytest.mark.parametrize(("name", "bound"), [("strip", 2e-3), ("random_strip", 2e-2)])
def test_harmonic_strip_is_linear(request, name, bound):
    laplacian = request.getfixturevalue(name)
    fixed, exact = ends(laplacian.points)
    found = core.distance.harmonic_field(laplacian, fixed, exact[fixed])
    assert np.abs(found - exact).max() < bound
    assert found.min() == 0.0
    assert found.max() == 1.0
    np.testing.assert_array_equal(found[fixed], exact[fixed])


def test_harmonic_strip_with_uniform_areas():
    laplacian = core.paper.build_laplacian(strip_points(), areas="uniform", neighbors=30, regularization=1.0)
    fixed, exact = ends(laplacian.points)
    assert np.abs(core.distance.harmonic_field(laplacian, fixed, exact[fixed]) - exact).max() < 2e-3


@pytest.mark.parametrize("name", ["strip", "random_strip"])
@pytest.mark.parametrize("value", [0.0, 1.0])
def test_a_thin_line_of_fixed_points_parts_the_strip(request, name, value):
    laplacian = request.getfixturevalue(name)
    points = laplacian.points
    width = 0.02 if name == "strip" else 0.04
    fixed, values = ends(points)
    line = np.abs(points[:, 0] - 1.5) < width
    values = np.where(line, value, np.round(values))
    found = core.distance.harmonic_field(laplacian, fixed | line, values[fixed | line])
    left, right = points[:, 0] < 1.4, points[:, 0] > 1.6
    exact = np.interp(points[:, 0], [0.25, 1.5, 2.75], [0.0, value, 1.0])
    assert np.abs(found - exact)[left | right].max() < 0.06
    # What is flat stays flat: nothing leaks through the line from the other side.
    flat = left if value == 0.0 else right
    assert np.abs(found - value)[flat].max() < 0.01


def test_fixed_boundary_of_a_square():
    points = square_grid(28)
    laplacian = core.build_laplacian(points)
    boundary = ((points == 0.0) | (points == 1.0))[:, :2].any(axis=1)
    exact = np.sin(np.pi * points[:, 0]) * np.sin(np.pi * points[:, 1])
    found = core.distance.solve_poisson(laplacian, 2.0 * np.pi**2 * exact, boundary, 0.0)
    assert np.abs(found - exact).max() < 2e-2


def test_fixed_boundaries_of_a_cylinder():
    height, around = np.meshgrid(np.linspace(0.0, 1.0, 25), np.arange(80) * (2.0 * np.pi / 80), indexing="ij")
    height, around = height.ravel(), around.ravel()
    laplacian = core.build_laplacian(np.column_stack([0.5 * np.cos(around), 0.5 * np.sin(around), height]))
    boundaries = (height == 0.0) | (height == 1.0)
    found = core.distance.harmonic_field(laplacian, boundaries, height[boundaries])
    np.testing.assert_allclose(found, height, atol=5e-3)


def test_maximum_principle_with_every_kind_of_set(operators):
    laplacian = operators("random sphere")
    random = np.random.default_rng(0)
    chosen = np.unique(np.concatenate([random.choice(4000, 20), np.flatnonzero(laplacian.points[:, 2] > 0.7)]))
    values = random.random(len(chosen)) + 3.0
    found = core.distance.solve_poisson(laplacian, 0.0, chosen, values)
    assert found.min() > values.min() - OFF
    assert found.max() < values.max() + OFF
    free = np.setdiff1d(np.arange(4000), chosen)
    assert found[free].std() > 0.0


def test_sums_and_multiples_of_fixed_values(strip):
    fixed, exact = ends(strip.points)
    once = core.distance.harmonic_field(strip, fixed, exact[fixed])
    np.testing.assert_allclose(
        core.distance.harmonic_field(strip, fixed, 5.0 - 3.0 * exact[fixed]), 5.0 - 3.0 * once, atol=1e-6
    )
    np.testing.assert_allclose(core.distance.harmonic_field(strip, fixed, 7.0), 7.0, atol=1e-12)


def test_indices_and_masks_agree_whatever_their_order(strip):
    fixed, exact = ends(strip.points)
    order = np.random.default_rng(0).permutation(np.flatnonzero(fixed))
    np.testing.assert_array_equal(
        core.distance.harmonic_field(strip, order, exact[order]),
        core.distance.harmonic_field(strip, fixed, exact[fixed]),
    )


def test_parts_without_fixed_points_have_the_mean_value(components):
    top = components.points[:900, 2] > 0.8
    bottom = components.points[:900, 2] < -0.8
    chosen = np.flatnonzero(top | bottom)
    values = top[chosen] * 4.0 + 2.0
    found = core.distance.harmonic_field(components, chosen, values)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found[900:], values.mean())
    assert found[:900].std() > 0.5
    found = core.distance.harmonic_field(components, [0, 1300], [1.0, 3.0])
    assert found[1300] == 3.0
    np.testing.assert_allclose(found[900:1300], 2.0)


def test_the_mean_must_vanish_on_every_part(components):
    z = components.points[:, 2]
    source = np.where(components.component == 0, z, 4.0 * z)
    found = core.distance.solve_poisson(components, source)
    assert np.isfinite(found).all()
    assert relative(found[:900], 0.5 * z[:900]) < 1e-2
    assert relative(found[900:1300], 0.5 * z[900:1300]) < 1e-2
    np.testing.assert_array_equal(found[1300:], 0.0)
    with pytest.raises(core.PointCloudError, match="400 points"):
        core.distance.solve_poisson(components, np.where(components.component == 1, 1.0, source))
    # A part that is held needs no such source.
    held = core.distance.solve_poisson(
        components, np.where(components.component == 1, 1.0, source), np.arange(900, 920), 0.0
    )
    assert np.isfinite(held).all()
    assert held[920:1300].min() > 0.0


def test_all_points_fixed(strip):
    x = strip.points[:, 0]
    np.testing.assert_array_equal(core.distance.harmonic_field(strip, np.ones(len(x), dtype=bool), x), x)


@pytest.mark.parametrize(
    ("fixed", "values", "text"),
    [
        ([], [], "No points are fixed"),
        ([0, 1], [1.0], "each of 2 fixed points"),
        ([0, 1, 2], [1.0, 2.0], "each of 3 fixed points"),
        ([0, 1], [np.nan, 1.0], "1 of 2 fixed values are not finite"),
        ([4, 4], [0.0, 1.0], "two different values"),
        ([99_999], [1.0], "Give whole numbers below 2821"),
        ([0], ["a"], "each of 1 fixed points"),
    ],
)
def test_bad_fixed_points(strip, fixed, values, text):
    with pytest.raises(core.InvalidPointsError, match=text):
        core.distance.harmonic_field(strip, fixed, values)


@pytest.mark.parametrize(
    ("source", "text"),
    [(np.zeros(3), "one number for each of 2821"), (np.full(2821, np.inf), "2821 of 2821 values")],
)
def test_bad_sources(strip, source, text):
    with pytest.raises(core.InvalidPointsError, match=text):
        core.distance.solve_poisson(strip, source, [0], [0.0])
