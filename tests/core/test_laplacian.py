from functools import partial

import numpy as np
import pytest

import core
from benchmarks.accuracy import relative, sphere_errors
from benchmarks.samplings import fibonacci_sphere, hemisphere_random, icosahedral_sphere, random_sphere, torus_points


@pytest.fixture(scope="module")
def torus():
    return core.build_laplacian(torus_points(2500))


@pytest.fixture(scope="module", params=["default", "paper"])
def any_operator(request):
    build = {"default": core.build_laplacian, "paper": core.paper.build_laplacian}[request.param]
    return build(random_sphere(1000) * [1.0, 0.9, 0.7])


class TestStructure:
    def test_symmetric_to_the_last_bit(self, any_operator):
        assert abs(any_operator.stiffness - any_operator.stiffness.T).max() == 0.0

    def test_rows_sum_to_zero(self, any_operator):
        rows = np.abs(any_operator.stiffness.sum(axis=1))
        assert np.all(rows <= 1e-10 * any_operator.stiffness.diagonal())

    def test_pair_weights_are_not_negative(self, any_operator):
        entries = any_operator.stiffness.tocoo()
        assert np.all(entries.data[entries.row != entries.col] <= 0.0)

    def test_positive_semi_definite_with_one_zero(self, any_operator):
        values = np.linalg.eigvalsh(any_operator.stiffness.toarray())
        assert values[0] >= -1e-10 * values[-1]
        assert values[1] > 1e-6 * values[-1]

    def test_real_spectrum_by_symmetry_for_the_areas(self, any_operator):
        f, g = np.random.default_rng(0).standard_normal((2, len(any_operator.areas)))
        left = f @ (any_operator.areas * any_operator.apply(g))
        assert left == pytest.approx(g @ (any_operator.areas * any_operator.apply(f)), rel=1e-9)

    def test_negative_semi_definite_in_its_strong_form(self, any_operator):
        for f in np.random.default_rng(0).standard_normal((5, len(any_operator.areas))):
            assert f @ (any_operator.areas * any_operator.apply(f)) < 0.0

    def test_index_type_suits_every_solver(self, any_operator):
        assert any_operator.stiffness.indices.dtype == np.int32
        assert any_operator.stiffness.has_sorted_indices


class TestPaper:
    @pytest.fixture(scope="class")
    @classmethod
    def errors(cls):
        points = icosahedral_sphere(28)  # the paper's
        assert len(points) == 7842
        laplacian = core.paper.build_laplacian(points)
        return sphere_errors(laplacian), laplacian.areas.sum()

    def test_figure_3_uniform_sphere_with_wpca_normals(self, errors):
        assert errors[0][1] == pytest.approx(24.5e-3, rel=0.05)
        assert errors[0][2] == pytest.approx(19.4e-3, rel=0.05)

    def test_figure_2_area(self, errors):
        assert errors[1] == pytest.approx(4.0 * np.pi, rel=1e-4)


def build_wide(points):
    """The operator whose kernel is wide enough for smooth surfaces' digits."""
    return core.build_laplacian(points, options=core.LaplacianOptions(bandwidth_factor=1.7))


class TestAccuracy:
    def test_curvature_correction_helps_where_the_surface_bends_two_ways(self):
        points = torus_points(2000)
        major, minor = 1.0, 0.4
        radius = np.linalg.norm(points[:, :2], axis=1)
        cosine = (radius - major) / minor
        sine = points[:, 2] / minor
        # z = r sin v has the Laplacian (1 / (w r^2)) d/dv (w d/dv z) with w = R + r cos v.
        exact = -sine / minor - sine * cosine / radius
        corrected, plain = (
            relative(build(points).apply(points[:, 2]), exact)
            for build in (build_wide, partial(core.paper.build_laplacian, areas="uniform", neighbors=50))
        )
        assert corrected < 0.02
        assert corrected < 0.5 * plain

    def test_symbol_correction_helps(self):
        laplacian = build_wide(fibonacci_sphere(1500))
        f = laplacian.points[:, 0] ** 2
        exact = 2.0 - 6.0 * f
        assert relative(laplacian.apply(f), exact) < 0.2 * relative(laplacian.apply(f, raw=True), exact)

    def test_error_falls_on_even_points(self):
        coarse, fine = (max(sphere_errors(build_wide(fibonacci_sphere(n)))) for n in (1000, 4000))
        assert fine < 1.2 * coarse
        assert fine < 1.2e-3


def test_it_says_what_it_is_of():
    one, far = fibonacci_sphere(400), fibonacci_sphere(900) + [9.0, 0.0, 0.0]
    assert repr(core.build_laplacian(one)).startswith("<LaplaceBeltrami: 400 points, 1 component, area 12.5")
    both = core.build_laplacian(np.concatenate([one, far, [[4.0, 0.0, 0.0]]]))
    area = f"{both.areas.sum():.6g}"
    assert repr(both) == f"<LaplaceBeltrami: 1301 points, 2 components, area {area}, 1 left out>"
    assert float(area) == pytest.approx(8.0 * np.pi, rel=1e-3)


class TestApply:
    def test_columns_one_by_one(self, torus):
        both = torus.apply(torus.points[:, :2])
        np.testing.assert_allclose(both[:, 1], torus.apply(torus.points[:, 1]), rtol=1e-12, atol=1e-12)

    def test_raw_is_the_stiffness_over_the_areas(self, torus):
        f = torus.points[:, 0]
        np.testing.assert_array_equal(torus.apply(f, raw=True), -(torus.stiffness @ f) / torus.areas)

    def test_constants_vanish(self, torus):
        assert np.abs(torus.apply(np.ones(len(torus.areas)))).max() < 1e-9

    @pytest.mark.parametrize("shape", [(7,), (2500, 2, 2), ()])
    def test_wrong_length(self, torus, shape):
        with pytest.raises(core.InvalidPointsError, match="2500 points"):
            torus.apply(np.zeros(shape))


class TestMeanCurvature:
    @pytest.mark.parametrize("radius", [0.5, 20.0])
    def test_sphere(self, radius):
        points = radius * fibonacci_sphere(1500) + [1.0, 2.0, 3.0]
        laplacian = core.build_laplacian(points)
        np.testing.assert_allclose(core.measure.mean_curvature(laplacian), 1.0 / radius, rtol=2e-2)

    def test_up_to_the_boundary_of_a_hemisphere(self):
        laplacian = core.build_laplacian(hemisphere_random(750))
        assert laplacian.boundary.any()
        np.testing.assert_allclose(core.measure.mean_curvature(laplacian), 1.0, rtol=0.1)


class TestProgress:
    def test_stages_come_in_order(self):
        calls = []
        core.build_laplacian(random_sphere(400), progress=lambda stage, fraction: calls.append((stage, fraction)))
        assert list(dict.fromkeys(stage for stage, _ in calls)) == ["Normals", "Neighbors", "Areas", "Operator"]
        fractions = [fraction for _, fraction in calls]
        assert fractions == sorted(fractions)
        assert 0.0 <= fractions[0] < fractions[-1] == 1.0
