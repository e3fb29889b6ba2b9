"""The paper taken literally: Algorithm 1, eq. (5), and Theorem 1."""

import numpy as np
import pytest

import core
from benchmarks.paper.descent import algorithm_1
from benchmarks.paper.unsymmetrized import unsymmetrized_operator
from benchmarks.samplings import fibonacci_sphere, random_sphere, uneven_sphere
from core.geometry.boundary import no_boundary
from core.geometry.cloud import read_cloud
from core.operator.areas import KernelMatrix
from core.options import LaplacianOptions, PaperOptions
from core.paper.areas import TAU, constrained_areas, regularized_areas


@pytest.fixture(scope="module")
def problem():
    options = LaplacianOptions(bandwidth="global", boundary="off", sheets=False)
    pairs = read_cloud(uneven_sphere(400), options).pairs
    matrix, target = KernelMatrix(pairs, pairs.distance, no_boundary(400)), np.ones(400)
    return matrix, target, regularized_areas(matrix, target, 1e-3).areas


class TestAlgorithm1:
    @pytest.fixture(scope="class")
    @classmethod
    def result(cls, problem):
        return algorithm_1(*problem, steps=20_000)

    def test_every_step_decreases_the_objective(self, result):
        assert result.steps > 10
        assert np.all(np.diff(result.objective) < 0.0)

    def test_armijo_condition_of_a_step(self, problem):
        before = algorithm_1(*problem, steps=7)
        after = algorithm_1(*problem, steps=8)
        change = after.areas - before.areas
        mu = np.abs(change).max() / after.residual
        assert before.objective[-1] - after.objective[-1] > 1e-4 / mu * (change @ change)

    def test_areas_stay_feasible(self, result):
        assert result.areas.min() >= TAU

    def test_optimality_at_the_end(self, problem, result):
        matrix, target, _ = problem
        gradient = 2.0 * (matrix @ (matrix @ result.areas - target) + 1e-3 * result.areas)
        assert result.converged
        assert result.residual <= 1e-3
        held = result.areas <= TAU
        assert np.all(gradient[held] > -1e-3)
        scale = np.abs(2.0 * (matrix @ target)).max()
        assert np.abs(gradient[~held]).max() < 1e-3 * scale

    def test_the_fast_solver_of_the_same_problem_is_at_least_as_good(self, problem, result):
        matrix, target, _ = problem
        best = constrained_areas(matrix, target, 1e-3, products=40_000).areas
        value = np.sum((matrix @ best - target) ** 2) + 1e-3 * best @ best
        assert value <= result.objective[-1] * (1.0 + 1e-9)

    def test_feasible_start_is_kept(self):
        # The paper: on the uniform sphere the solution of eq. (7) is positive, and no iteration is made.
        pairs = read_cloud(fibonacci_sphere(500), PaperOptions().cloud).pairs
        matrix, target = KernelMatrix(pairs, pairs.distance, no_boundary(500)), np.ones(500)
        start = regularized_areas(matrix, target, 1e-3).areas
        np.testing.assert_allclose(algorithm_1(matrix, target, start).areas, start, rtol=1e-5)

    def test_the_guard_ends_a_search_that_rounding_would_keep_going(self, problem):
        matrix, target, start = problem
        result = algorithm_1(matrix, target, start, epsilon=0.0, steps=200_000, rho=1e3)
        assert result.stalled
        assert result.steps < 200_000


def eq_5_on_the_sphere(count):
    """The matrix of eq. (5), and -x / 2 of the unit sphere whose Laplacian is x."""
    points = fibonacci_sphere(count)
    cloud = read_cloud(points, PaperOptions(neighbors=30).cloud)
    scaled, pairs = cloud.scaled, cloud.pairs
    areas = core.paper.build_laplacian(points, neighbors=30).areas[scaled.first] / scaled.scale**2
    matrix = unsymmetrized_operator(pairs, points[scaled.first], areas) / scaled.scale**2
    return matrix, points[scaled.first, 0]


class TestUnsymmetrizedOperator:
    def test_rows_sum_to_zero(self):
        matrix, _ = eq_5_on_the_sphere(500)
        assert np.abs(matrix.sum(axis=1)).max() < 1e-10 * np.abs(matrix.diagonal()).max()

    def test_error_is_of_second_order(self):
        errors = []
        for count in (2000, 8000):  # the fewest with such an error
            matrix, x = eq_5_on_the_sphere(count)
            errors.append(np.linalg.norm(matrix @ x + 2.0 * x) / np.linalg.norm(2.0 * x))
        assert errors[1] < 0.03
        assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)

    def test_is_not_symmetric_for_the_areas_where_normals_differ(self):
        points = random_sphere(400) * [1.0, 0.7, 0.4]
        cloud = read_cloud(points, PaperOptions().cloud)
        scaled, pairs = cloud.scaled, cloud.pairs
        laplacian = core.paper.build_laplacian(points)
        areas = laplacian.areas[scaled.first] / scaled.scale**2
        weak = unsymmetrized_operator(pairs, laplacian.normals[scaled.first], areas).multiply(areas[:, None])
        assert abs(weak - weak.T).max() > 1e-3 * abs(weak).max()
        weak = laplacian.stiffness
        assert abs(weak - weak.T).max() == 0.0


class TestTheorem1:
    @pytest.fixture(scope="class")
    @classmethod
    def laplacian(cls):
        return core.build_laplacian(random_sphere(900))

    def test_kernels(self, laplacian):
        operator = -laplacian.stiffness.toarray() / laplacian.areas[:, None]
        left, values, right = np.linalg.svd(operator)
        assert values[-1] < 1e-10 * values[0]
        assert values[-2] > 1e-6 * values[0]
        np.testing.assert_allclose(np.abs(right[-1]), 1.0 / np.sqrt(900.0), rtol=1e-6)
        np.testing.assert_allclose(np.abs(left[:, -1]), laplacian.areas / np.linalg.norm(laplacian.areas), rtol=1e-5)

    def test_bordered_operator_has_a_bounded_inverse(self):
        # Delta_h + V e^T / h^2 stays away from singular as the sampling is refined.
        bounds = []
        for count in (300, 1200):
            laplacian = core.build_laplacian(fibonacci_sphere(count))
            scaled = laplacian.areas / laplacian.smoothing_lengths**2
            operator = laplacian.stiffness.toarray() / -laplacian.areas[:, None] + np.outer(scaled, np.ones(count))
            bounds.append(np.linalg.norm(np.linalg.inv(operator), np.inf))
        assert bounds[1] < 2.0 * bounds[0]

    def test_assumptions_hold_on_a_good_cloud(self, laplacian):
        stability = core.paper.check_stability(laplacian)
        assert stability.concerns() == []
        assert stability.components == 1
        assert stability.row_sum < 1e-12
        assert stability.column_sum < 1e-12
        assert stability.area_ratio == pytest.approx(laplacian.areas.max() / laplacian.areas.min())
        assert stability.most_neighbors == np.diff(laplacian.stiffness.indptr).max()

    def test_two_parts_and_narrow_kernels_are_concerns(self):
        sphere = random_sphere(300)
        options = LaplacianOptions(bandwidth="local", neighbors=13, bandwidth_factor=0.3)
        laplacian = core.build_laplacian(np.concatenate([sphere, sphere + [9.0, 0.0, 0.0]]), options=options)
        concerns = " ".join(core.paper.check_stability(laplacian).concerns())
        assert "2 components" in concerns
        assert "A4" in concerns
