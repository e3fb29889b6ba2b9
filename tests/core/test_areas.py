import functools
import re
from dataclasses import replace

import numpy as np
import pytest

import core
from benchmarks.samplings import (
    closed_plate,
    fibonacci_sphere,
    marching_cubes_sphere,
    noisy_sphere,
    random_sphere,
    rough_sphere,
    square_random,
    torus_points,
    uneven_sphere,
)
from core.algebra.solvers import bounded_quadratic
from core.geometry.arcs import arc_length
from core.geometry.boundary import no_boundary
from core.geometry.cloud import read_cloud
from core.operator.areas import KernelMatrix, fast_areas, solve_areas
from core.options import LaplacianOptions
from core.paper import areas as paper_areas
from core.paper.areas import TAU, constrained_areas, regularized_areas

SPHERE = 4.0 * np.pi
METHODS = ["fast", "regularized", "constrained", "uniform"]


def areas_by(method, points, **settings):
    """Areas of the default, or of one of the paper's three kinds."""
    if method == "fast":
        return core.estimate_areas(points)
    return core.paper.build_laplacian(points, areas=method, **settings).areas


def closed_matrix(points, factor):
    """The paper's matrix of eq. (6), with one smoothing length and distances in space."""
    options = LaplacianOptions(bandwidth="global", bandwidth_factor=factor, boundary="off", sheets=False)
    pairs = read_cloud(points, options).pairs
    return KernelMatrix(pairs, pairs.distance, no_boundary(len(points)))


@pytest.fixture(scope="module")
def uneven():
    return closed_matrix(uneven_sphere(400), 0.5), np.ones(400)


def objective(matrix, areas, target, rho=1e-3):
    return np.sum((matrix @ areas - target) ** 2) + rho * areas @ areas


@pytest.mark.parametrize("method", METHODS)
def test_even_sphere(method):
    areas = areas_by(method, fibonacci_sphere(1000))
    assert np.all(areas > 0.0)
    assert areas.sum() == pytest.approx(SPHERE, rel=2e-3)
    assert areas.std() < 0.03 * areas.mean()


@pytest.mark.parametrize("points", [random_sphere(1500), marching_cubes_sphere(21)], ids=["random", "marching cubes"])
def test_irregular_spheres(points):
    areas = core.estimate_areas(points)
    assert np.all(areas > 0.0)
    assert areas.sum() == pytest.approx(SPHERE, rel=1e-3)


@pytest.mark.parametrize("projection", ["auto", "off"])
@pytest.mark.parametrize("level", [0.002, 0.005, 0.01, 0.02])
def test_a_little_noise_leaves_even_points_even(level, projection):
    # Solved for as closely as those of clean points, areas would differ by half.
    areas = core.estimate_areas(noisy_sphere(1000, level), options=LaplacianOptions(projection=projection))
    assert areas.sum() == pytest.approx(SPHERE, rel=1e-3)
    assert areas.std() < (0.007 + 4.5 * level) * areas.mean()


def test_torus():
    assert core.estimate_areas(torus_points(2000)).sum() == pytest.approx(4.0 * np.pi**2 * 0.4, rel=3e-3)


def test_density_jump():
    points = uneven_sphere(1800)
    areas = core.estimate_areas(points)
    assert np.all(areas > 0.0)
    assert areas.sum() == pytest.approx(SPHERE, rel=1e-2)
    assert areas[points[:, 2] < -0.3].mean() / areas[points[:, 2] > 0.3].mean() == pytest.approx(9.0, rel=0.05)


class TestRelief:
    """Shape finer than the normals tell lengthens the ways along the surface; noise does not."""

    @pytest.mark.parametrize(
        ("points", "wavelength", "slope"),
        [
            pytest.param(fibonacci_sphere(2000), 5, 0.2, id="even"),
            pytest.param(marching_cubes_sphere(21), 6, 0.4, id="cubes"),
            pytest.param(fibonacci_sphere(2000), 8, 0.4, id="even, long waves"),
        ],
    )
    def test_has_its_area(self, points, wavelength, slope):
        rough, exact = rough_sphere(points, wavelength, slope)
        cloud = read_cloud(rough, LaplacianOptions())

        def error(squared_slope):
            changed = replace(cloud, squared_slope=squared_slope)
            areas = solve_areas(changed, arc_length(changed)) * cloud.scaled.scale**2
            return areas.sum() / exact - 1.0

        assert abs(error(cloud.squared_slope)) < 0.01

    def test_is_its_slope_where_normals_are_smooth(self):
        rough, _ = rough_sphere(fibonacci_sphere(2000), 4, 0.2)
        measured = read_cloud(rough, LaplacianOptions()).squared_slope.mean()
        assert 0.4 < measured / (0.5 * 0.2**2) < 1.0  # along a chord it is half of the squared slope

    @pytest.mark.parametrize("points", [fibonacci_sphere(1000), random_sphere(1000)], ids=["even", "random"])
    def test_of_smooth_surfaces_is_none(self, points):
        assert read_cloud(points, LaplacianOptions()).squared_slope.max() < 1e-6

    @pytest.mark.parametrize(("side", "thickness", "most"), [(40, 2, 0.01), (20, 8, 0.018), (20, 20, 0.013)])
    def test_of_sharp_edges_is_little(self, side, thickness, most):
        box, _, _, area = closed_plate(side, thickness)
        assert core.estimate_areas(box).sum() == pytest.approx(area, rel=most)

    @pytest.mark.parametrize("level", [0.05, 0.2])
    def test_noise_is_none(self, level):
        noisy = noisy_sphere(1000, level)
        assert not read_cloud(noisy, LaplacianOptions()).squared_slope.any()
        assert read_cloud(noisy, LaplacianOptions(projection="off")).squared_slope.min() > 0.0

    def test_does_not_depend_on_the_signs_of_normals(self):
        rough, _ = rough_sphere(fibonacci_sphere(1000), 6, 0.3)
        normals = core.estimate_normals(rough)
        flipped = normals * np.random.default_rng(0).choice([-1.0, 1.0], len(rough))[:, None]
        expected = core.build_laplacian(rough, normals).areas
        np.testing.assert_allclose(core.build_laplacian(rough, flipped).areas, expected, rtol=1e-9)


def test_areas_are_the_operators_own():
    points = random_sphere(900)
    np.testing.assert_array_equal(core.estimate_areas(points), core.build_laplacian(points).areas)
    np.testing.assert_array_equal(
        core.estimate_areas(points, normals=points), core.build_laplacian(points, normals=points).areas
    )


@pytest.mark.parametrize("method", METHODS[1:])
def test_scale_shift_rotation_and_order(method):
    points = fibonacci_sphere(400) * [1.0, 0.8, 0.6]  # eqs. (7) and (8) need wide kernels elsewhere
    areas = areas_by(method, points, neighbors=40)
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    order = np.random.default_rng(1).permutation(len(points))
    for scale in (1e-3, 1e3):
        moved = areas_by(method, (scale * points @ turn + scale * 3.0)[order], neighbors=40)
        np.testing.assert_allclose(moved, scale**2 * areas[order], rtol=1e-6)


@pytest.mark.parametrize(("method", "points"), [("constrained", square_random(400)), ("uniform", random_sphere(300))])
def test_areas_by_least_squares_do_not_depend_on_the_unit(points, method):
    areas = areas_by(method, points, neighbors=30)
    inches = areas_by(method, points / 0.0254, neighbors=30)
    np.testing.assert_allclose(0.0254**2 * inches, areas, rtol=0.0, atol=1e-6 * areas.mean())


@pytest.mark.parametrize("method", ["constrained", "uniform"])
def test_areas_that_are_not_found_are_told_with_what_is_left(method, monkeypatch):
    """After ten products, with which no machine's rounding solves for 500 areas."""
    monkeypatch.setitem(paper_areas.AREAS, "constrained", functools.partial(constrained_areas, products=10))
    monkeypatch.setattr(paper_areas, "regularized_areas", lambda *given: regularized_areas(*given[:3], products=10))
    notices = core.paper.build_laplacian(random_sphere(500), areas=method, neighbors=25, regularization=1e-12).notices
    assert any(
        re.match(r"The areas were not found in [\d,]+ steps: a share of \S+ of their eq", text) for text in notices
    )


def test_the_plain_linear_system_goes_negative_and_says_so():
    with pytest.raises(core.AreaError, match="not positive.*'constrained'"):
        core.paper.build_laplacian(uneven_sphere(750), areas="regularized", neighbors=25)


def test_regularized_areas_solve_the_normal_equations():
    matrix = closed_matrix(random_sphere(400), 0.8)
    dense = np.column_stack([matrix @ column for column in np.eye(400)])
    exact = np.linalg.solve(dense @ dense + 1e-3 * np.eye(400), dense @ np.ones(400))
    np.testing.assert_allclose(regularized_areas(matrix, np.ones(400), 1e-3).areas, exact, rtol=1e-4)


def test_constrained_areas_keep_the_bound_and_are_optimal(uneven):
    matrix, target = uneven
    solution = constrained_areas(matrix, target, 1e-3, products=40_000)
    assert solution.residual == 0.0
    areas = solution.areas
    assert areas.min() >= TAU
    gradient = 2.0 * (matrix @ (matrix @ areas - target) + 1e-3 * areas)
    scale = np.abs(2.0 * (matrix @ target)).max()
    held = areas <= TAU
    assert held.any()
    assert np.abs(gradient[~held]).max() < 1e-4 * scale
    assert gradient[held].min() > -1e-4 * scale


def test_constrained_areas_are_better_than_any_clipped_ones(uneven):
    matrix, target = uneven
    best = objective(matrix, constrained_areas(matrix, target, 1e-3).areas, target)
    assert best < objective(matrix, np.maximum(regularized_areas(matrix, target, 1e-3).areas, TAU), target)
    assert best < objective(matrix, 1.0 / (matrix @ target), target)
    assert best < objective(matrix, fast_areas(matrix, target, 1.0 / (matrix @ target)), target)


def test_fast_areas_improve_on_density(uneven):
    matrix, target = uneven
    density = 1.0 / (matrix @ target)
    areas = fast_areas(matrix, target, density)
    assert np.all(areas >= 0.5 * density * (1.0 - 1e-12))
    assert np.sum((matrix @ areas - target) ** 2) < 0.3 * np.sum((matrix @ density - target) ** 2)


@pytest.mark.parametrize("seed", range(5))
def test_bounded_quadratic_meets_the_optimality_conditions(seed):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((40, 40))
    matrix = root @ root.T + 0.1 * np.eye(40)
    right, lower = rng.standard_normal(40), -0.1 * rng.random(40)
    norm = np.linalg.norm(matrix, 2)
    x, used, left = bounded_quadratic(lambda v: matrix @ v, right, lower, np.zeros(40), norm, 5000, 1e-10)
    assert left <= 1e-10
    assert used < 5000
    gradient = matrix @ x - right
    assert np.all(x >= lower)
    held = x <= lower
    assert held.any()
    assert np.abs(gradient[~held]).max() < 1e-8
    assert gradient[held].min() > -1e-8
