"""Components: components with their own operators, and lone points that are left out."""

import numpy as np
import pytest

import core
from benchmarks.samplings import (
    disc_random,
    fibonacci_sphere,
    grid_points,
    hemisphere_random,
    noisy_sphere,
    random_sphere,
    uneven_sphere,
)
from core.geometry.components import label_components, move_apart
from core.geometry.nearest import COUNT, find_nearest
from core.options import LaplacianOptions

LARGE, SMALL = fibonacci_sphere(1500), 0.7 * fibonacci_sphere(900) + [4.0, 0.0, 0.0]
LONE = np.array([[0.0, 5.0, 0.0], [0.0, 5.1, 0.0], [0.0, -7.0, 0.0], [9.0, 9.0, 9.0]])
OUT = slice(900, 904)


@pytest.fixture(scope="module")
def parts():
    """Two components, the small one first, and four lone points between them."""
    return core.build_laplacian(np.concatenate([SMALL, LONE, LARGE]))


@pytest.fixture(scope="module")
def spectrum(parts):
    return parts.eigenpairs(8)


class TestLabels:
    def test_the_largest_component_is_the_first(self):
        label = label_components(find_nearest(np.concatenate([SMALL, LARGE])))
        np.testing.assert_array_equal(label, np.repeat([1, 0], [900, 1500]))

    @pytest.mark.parametrize("count", [40, 41])
    def test_components_smaller_than_a_neighbourhood_are_none(self, count):
        label = label_components(find_nearest(np.concatenate([LARGE, 0.1 * fibonacci_sphere(count) + [3.0, 0.0, 0.0]])))
        np.testing.assert_array_equal(label, np.repeat([0, -1 if count < COUNT else 1], [1500, count]))

    @pytest.mark.parametrize(
        "points", [random_sphere(1500), uneven_sphere(1000), noisy_sphere(1000, 0.5)], ids=["random", "jump", "noisy"]
    )
    def test_one_surface_is_one_component(self, points):
        assert np.all(label_components(find_nearest(points)) == 0)

    def test_eight_points_are_enough(self):
        cube = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        options = core.LaplacianOptions(bandwidth="local", neighbors=6, bandwidth_factor=1.0)
        np.testing.assert_array_equal(core.build_laplacian(cube, options=options).component, 0)

    def test_the_gap_is_measured_in_spacings(self):
        square = grid_points(range(20), range(20), [0.0])
        for scale in (1.0, 1e-3):
            apart, near = (
                label_components(find_nearest(scale * np.concatenate([square, square + [19.0 + gap, 0.0, 0.0]])))
                for gap in (10.0, 1.5)
            )
            assert apart.max() == 1
            assert near.max() == 0

    @pytest.mark.parametrize(("count", "joined"), [(8, True), (9, False)])
    def test_the_spacing_is_that_to_the_eighth_neighbor(self, count, joined):
        # Clumps in a row: the eighth neighbour of a point is in the next clump, or still in its own.
        x = np.arange(20.0)[:, None] + np.linspace(-1e-3, 1e-3, count)
        label = label_components(find_nearest(grid_points(x.ravel(), [0.0], [0.0])))
        assert np.all(label == 0) == joined

    def test_moving_apart_keeps_all_distances_within_a_part(self):
        points = np.concatenate([SMALL, LARGE])
        label = np.repeat([1, 0], [900, 1500])
        moved = move_apart(points, label)
        np.testing.assert_array_equal(moved[label == 0], LARGE)
        np.testing.assert_allclose(np.ptp(moved[label == 1], axis=0), np.ptp(SMALL, axis=0), rtol=1e-12)
        assert find_nearest(moved).tree.query(moved[label == 1], k=1000)[0][:, -1].min() > np.ptp(points, axis=0).max()
        assert move_apart(points, np.zeros(2400, dtype=int)) is points


class TestIslands:
    def test_components_are_numbered_by_size(self, parts):
        np.testing.assert_array_equal(parts.component, np.repeat([1, -1, 0], [900, 4, 1500]))

    def test_each_has_its_own_constant(self, spectrum, parts):
        assert np.all(spectrum.eigenvalues[:2] < 1e-9)
        for mode in spectrum.eigenvectors[:, :2].T:
            for part in (0, 1):
                assert np.ptp(mode[parts.component == part]) < 1e-7

    def test_each_has_its_own_modes(self, spectrum):
        np.testing.assert_allclose(spectrum.eigenvalues[2:5], 2.0, rtol=3e-3)
        np.testing.assert_allclose(spectrum.eigenvalues[5:], 2.0 / 0.49, rtol=3e-3)

    def test_each_has_its_own_area(self, parts):
        areas = [parts.areas[parts.component == part].sum() for part in (0, 1)]
        np.testing.assert_allclose(areas, [4.0 * np.pi, 4.0 * np.pi * 0.49], rtol=3e-3)

    def test_nothing_couples_them(self, parts):
        assert parts.stiffness[parts.component == 0][:, parts.component == 1].count_nonzero() == 0

    @pytest.mark.parametrize(
        ("use", "elsewhere"),
        [
            (lambda on: core.distance.geodesic_distance(on, [0]), np.inf),
            (lambda on: core.distance.signed_distance(on, [0, 1]), np.inf),
            (lambda on: core.distance.nearest_source(on, [0]), -1),
            (lambda on: core.distance.grow(on, [0], np.inf), False),
            (lambda on: np.linalg.norm(core.distance.transport(on, [0], [0.3, 0.5, 0.9]), axis=1), 0.0),
            (lambda on: core.distance.logarithmic_map(on, 0)[:, 1], np.nan),
        ],
        ids=["distance", "signed distance", "nearest source", "grown", "transport", "map"],
    )
    def test_what_begins_on_one_stays_there(self, parts, use, elsewhere):
        found = use(parts)
        assert np.isfinite(found[:900]).all()
        assert not np.any(found[:900] == elsewhere)
        np.testing.assert_array_equal(found[900:], elsewhere)

    def test_each_is_oriented_outward(self, parts):
        outward = np.concatenate([SMALL - [4.0, 0.0, 0.0], LARGE])
        normals = np.delete(parts.normals, OUT, axis=0)
        assert np.einsum("ij,ij->i", normals, outward).min() > 0.69

    def test_each_is_what_it_would_be_alone(self):
        # "adaptive" widens all kernels by the irregularity of the whole cloud.
        options = LaplacianOptions(bandwidth="local", bandwidth_factor=0.55)
        together = core.build_laplacian(np.concatenate([SMALL, LARGE]), options=options)
        for rows in (slice(0, 900), slice(900, 2400)):
            alone = core.build_laplacian(together.points[rows], options=options)
            np.testing.assert_allclose(together.areas[rows], alone.areas, rtol=1e-6)
            np.testing.assert_allclose(together.smoothing_lengths[rows], alone.smoothing_lengths, rtol=1e-9)
            np.testing.assert_allclose(together.apply(together.points)[rows], alone.apply(alone.points), atol=1e-2)

    @pytest.mark.parametrize("count", [60, 80, 100])
    def test_fewer_points_than_neighbors_are_enough(self, count):
        points = np.concatenate([fibonacci_sphere(750), 0.2 * fibonacci_sphere(count) + [3.0, 0.0, 0.0]])
        laplacian = core.build_laplacian(points)
        small = laplacian.component == 1
        assert np.count_nonzero(small) == count
        assert not any("left out" in notice for notice in laplacian.notices)
        # 60 points hardly resolve a sphere.
        assert laplacian.areas[small].sum() == pytest.approx(4.0 * np.pi * 0.04, rel=0.3)
        assert laplacian.areas[~small].sum() == pytest.approx(4.0 * np.pi, rel=3e-3)
        assert np.all(laplacian.eigenpairs(3).eigenvalues[:2] < 1e-9)

    def test_a_small_component_has_the_area_that_the_same_points_have_alone(self):
        component = 0.2 * fibonacci_sphere(120) + [3.0, 0.0, 0.0]
        together = core.estimate_areas(np.concatenate([fibonacci_sphere(750), component]))[750:]
        assert together.sum() == pytest.approx(core.estimate_areas(component).sum(), rel=1e-2)

    def test_a_small_open_component(self):
        points = np.concatenate(
            [grid_points(range(40), range(40), [0.0]), grid_points(range(100, 108), range(8), [0.0])]
        )
        laplacian = core.build_laplacian(points)
        assert laplacian.areas[laplacian.component == 0].sum() == pytest.approx(39.0**2, rel=1e-2)
        assert laplacian.areas[laplacian.component == 1].sum() == pytest.approx(7.0**2, rel=1e-2)

    @pytest.mark.parametrize("side", range(8, 17))
    def test_a_small_open_surface(self, side):
        points = grid_points(range(side), range(side), [0.0])
        parts = 1 if side**2 > 100 else 2
        points = np.concatenate([points + [100.0 * part, 0.0, 0.0] for part in range(parts)])
        laplacian = core.build_laplacian(points)
        assert laplacian.areas.sum() == pytest.approx(parts * (side - 1.0) ** 2, rel=1e-2)
        assert not any("narrow" in notice for notice in laplacian.notices)

    @pytest.mark.parametrize("count", [110, 200])
    def test_a_small_random_disc(self, count):
        areas = np.array([core.estimate_areas(disc_random(count, seed)[0]).sum() for seed in range(10)])
        assert np.sqrt(np.mean((areas / np.pi - 1.0) ** 2)) < 0.05

    @pytest.mark.parametrize(("count", "bound"), [(110, 0.2), (200, 0.1)])
    def test_a_small_hemisphere(self, count, bound):
        areas = [core.estimate_areas(hemisphere_random(count, seed)).sum() for seed in range(3)]
        np.testing.assert_allclose(areas, 2.0 * np.pi, rtol=bound)

    @pytest.mark.parametrize(("width", "length", "told"), [(3, 60, True), (5, 40, False)])
    def test_a_narrow_strip_and_its_notice(self, width, length, told):
        laplacian = core.build_laplacian(grid_points(range(width), range(length), [0.0]))
        assert laplacian.areas.sum() == pytest.approx((width - 1.0) * (length - 1.0), rel=0.1)
        assert any("narrow" in notice for notice in laplacian.notices) == told

    def test_far_apart(self):
        points = np.concatenate([LARGE, 0.7 * fibonacci_sphere(900) + [400.0, 0.0, 0.0]])
        laplacian = core.build_laplacian(points)
        np.testing.assert_array_equal(np.bincount(laplacian.component), [1500, 900])
        assert laplacian.areas.sum() == pytest.approx(4.0 * np.pi * 1.49, rel=3e-3)

    def test_a_small_noisy_component(self):
        points = np.concatenate([noisy_sphere(1000, 0.4), 0.15 * noisy_sphere(70, 0.4, 1) + [3.0, 0.0, 0.0]])
        laplacian = core.build_laplacian(points)
        area = laplacian.areas[laplacian.component == 1].sum()
        assert area == pytest.approx(4.0 * np.pi * 0.15**2, rel=0.5)


class TestLonePoints:
    def test_a_notice_counts_them(self, parts):
        assert [notice for notice in parts.notices if "left out" in notice] == [
            "Outliers and small components left out: 4 (0.17 %)."
        ]

    def test_neutral_values(self, parts, spectrum):
        assert np.all(parts.component[OUT] == -1)
        assert np.all(parts.areas[OUT] > 0.0)
        assert np.all(parts.areas[OUT] < 1e-200)
        np.testing.assert_array_equal(parts.normals[OUT], np.tile([0.0, 0.0, 1.0], (4, 1)))
        assert np.all(parts.gaussian_curvature[OUT] == 0.0)
        assert not np.any(parts.boundary[OUT])
        assert np.all(parts.smoothing_lengths[OUT] > 0.0)
        assert np.all(spectrum.eigenvectors[OUT] == 0.0)
        assert np.all(parts.apply(parts.points)[OUT] == 0.0)
        assert np.all(parts.apply(parts.points, raw=True)[OUT] == 0.0)
        assert np.all(core.measure.mean_curvature(parts)[OUT] == 0.0)
        assert parts.stiffness[OUT].count_nonzero() == 0

    def test_the_rest_is_what_it_is_without_them(self, parts):
        without = core.build_laplacian(np.concatenate([SMALL, LARGE]))
        np.testing.assert_allclose(np.delete(parts.areas, OUT), without.areas, rtol=1e-7)
        np.testing.assert_allclose(np.delete(parts.normals, OUT, axis=0), without.normals, atol=1e-9)

    def test_areas_and_normals_alone(self, parts):
        options = LaplacianOptions()
        np.testing.assert_array_equal(core.estimate_areas(parts.points, options=options), parts.areas)
        np.testing.assert_array_equal(core.estimate_normals(parts.points, options), parts.normals)

    def test_given_normals_and_boundaries_pass_them_by(self):
        points = np.concatenate([LONE, LARGE])
        laplacian = core.build_laplacian(points, normals=points, boundary_distance=np.full(1504, np.inf))
        np.testing.assert_allclose(laplacian.normals[4:], LARGE, atol=1e-9)
        assert laplacian.areas.sum() == pytest.approx(4.0 * np.pi, rel=3e-3)

    def test_duplicates_among_them(self):
        points = np.concatenate([LARGE, LONE, LONE, LARGE[:10]])
        laplacian = core.build_laplacian(points)
        assert np.all(laplacian.component[1500:1508] == -1)
        assert np.all(laplacian.areas[1500:1508] < 1e-200)
        np.testing.assert_allclose(laplacian.areas[1508:], laplacian.areas[:10], rtol=1e-9)
        assert laplacian.areas.sum() == pytest.approx(4.0 * np.pi, rel=3e-3)

    def test_stability_passes_them_by(self, parts):
        stability = core.paper.check_stability(parts)
        assert stability.components == 2
        assert stability.area_ratio < 1e4
        assert stability.fill_distance < 0.5


class TestTooLittleLeft:
    def test_most_points_in_small_components(self):
        components = [0.1 * fibonacci_sphere(30) + [3.0 * i, 3.0, 0.0] for i in range(10)]
        with pytest.raises(core.ComponentError, match="300 of 500 points are in components of too few points"):
            core.build_laplacian(np.concatenate([fibonacci_sphere(200), *components]))
