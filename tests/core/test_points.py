from functools import partial

import numpy as np
import pytest
from scipy import sparse

import core
from benchmarks.samplings import fibonacci_sphere, square_random, uneven_sphere
from core.geometry.points import scale_points


@pytest.fixture
def sphere():
    return fibonacci_sphere(600)


def test_not_finite_points_are_counted(sphere):
    sphere[3, 1] = np.nan
    sphere[17, 0] = np.inf
    with pytest.raises(core.InvalidPointsError, match="2 of 600 points.*not finite"):
        core.build_laplacian(sphere)


@pytest.mark.parametrize("shape", [(12,), (6, 2), (4, 3, 1), (3, 4)])
def test_wrong_shape(shape):
    with pytest.raises(core.InvalidPointsError, match=r"shape \(n, 3\)"):
        core.build_laplacian(np.zeros(shape))


@pytest.mark.parametrize("dtype", [complex, bool, object, "U3"])
def test_wrong_type(sphere, dtype):
    with pytest.raises(core.InvalidPointsError, match="real numbers"):
        core.build_laplacian(sphere.astype(dtype))


def test_ragged_lists():
    with pytest.raises(core.InvalidPointsError, match="shape"):
        core.build_laplacian([[0.0, 0.0, 0.0], [1.0, 2.0]])


def test_no_points():
    with pytest.raises(core.TooFewPointsError, match="no points"):
        core.build_laplacian(np.zeros((0, 3)))


def test_fewer_different_points_than_a_surface_needs(sphere):
    with pytest.raises(core.TooFewPointsError, match=r"at least 7 different points, and there are 5 among 50\."):
        core.build_laplacian(np.tile(sphere[:5], (10, 1)))


def test_all_points_at_one_place():
    with pytest.raises(core.PointCloudError):
        core.build_laplacian(np.ones((300, 3)))


def test_collinear_points():
    with pytest.raises(core.NotASurfaceError, match="500 points lie on a straight line"):
        core.build_laplacian(np.linspace(0.0, 1.0, 500)[:, None] * [1.0, 2.0, 3.0])


@pytest.mark.parametrize("build", [core.build_laplacian, core.paper.build_laplacian], ids=["default", "paper"])
def test_points_along_a_curve(build):
    angle = np.linspace(0.0, 2.0 * np.pi, 3000, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle), 0.2 * np.sin(3.0 * angle)])
    with pytest.raises(core.NotASurfaceError, match="along a curve"):
        build(circle)


def test_a_small_component_is_left_out_with_a_notice(sphere):
    component = np.array([[4.0, 0.0, 0.0], [4.01, 0.0, 0.0], [4.0, 0.01, 0.0]])
    laplacian = core.build_laplacian(np.concatenate([sphere, component]))
    assert any("components left out" in notice and ": 3 (" in notice for notice in laplacian.notices)
    np.testing.assert_array_equal(np.flatnonzero(laplacian.component < 0), [600, 601, 602])
    np.testing.assert_allclose(laplacian.areas[:600], core.build_laplacian(sphere).areas, rtol=1e-9)


def abrupt_change():
    grid = np.stack(np.meshgrid(np.linspace(0.0, 1.0, 41), np.linspace(0.0, 1.0, 41)), axis=-1).reshape(-1, 2)
    coarse = np.stack(np.meshgrid(np.arange(1.2, 4.0, 0.2), np.arange(0.0, 3.0, 0.2)), axis=-1).reshape(-1, 2)
    plane = np.concatenate([grid, coarse])
    return np.column_stack([plane, 0.1 * plane[:, 0] ** 2])


def test_an_abrupt_change_of_spacing_is_no_component():
    laplacian = core.build_laplacian(abrupt_change())
    assert laplacian.areas.sum() == pytest.approx(10.0, rel=0.2)
    assert core.paper.check_stability(laplacian).components == laplacian.component.max() + 1


def test_float32_far_from_the_origin_is_refused(sphere):
    with pytest.raises(core.InvalidPointsError, match="from the origin"):
        core.check_points((sphere + 1e6).astype(np.float32))


def test_float64_a_million_extents_away_is_handled(sphere):
    near, far = core.build_laplacian(sphere), core.build_laplacian(sphere + 2e6)
    np.testing.assert_allclose(far.areas, near.areas, rtol=1e-5)
    assert far.areas.sum() == pytest.approx(near.areas.sum(), rel=1e-6)


def test_float64_too_far_to_tell_apart(sphere):
    with pytest.raises(core.InvalidPointsError, match="from the origin"):
        core.build_laplacian(sphere + 1e14)


def test_integers_are_numbers(sphere):
    whole = np.round(sphere * 1e6).astype(np.int64)
    np.testing.assert_allclose(
        core.build_laplacian(whole).areas, core.build_laplacian(whole.astype(float)).areas, rtol=0.0
    )


@pytest.mark.parametrize("size", [1e-300, 1e-70, 1e70, 1e200, 1e308])
def test_sizes_whose_squares_overflow(sphere, size):
    with pytest.raises(core.InvalidPointsError, match="squared lengths"):
        core.build_laplacian(size * sphere)


def test_one_point_out_of_all_bounds(sphere):
    with pytest.raises(core.InvalidPointsError, match="squared lengths"):
        core.build_laplacian(np.concatenate([sphere, [[1e308, 0.0, 0.0], [-1e308, 0.0, 0.0]]]))


@pytest.mark.parametrize(("rings", "meridians"), [(9, 18), (13, 24), (16, 18)])
@pytest.mark.parametrize(
    "build", [core.build_laplacian, partial(core.paper.build_laplacian, areas="uniform", denoise=True)]
)
def test_globes(rings, meridians, build):
    """Their poles are many points at one place but for rounding, and have many neighbours at one distance."""
    up, around = np.meshgrid(np.linspace(0.0, np.pi, rings), 2.0 * np.pi * np.arange(meridians) / meridians)
    points = np.stack([np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], axis=2).reshape(-1, 3)
    laplacian = build(points)
    assert np.all(np.isfinite(laplacian.normals))
    assert np.all(laplacian.areas > 0.0)


class TestDuplicates:
    @pytest.fixture(scope="class")
    @classmethod
    def both(cls):
        """Operators of a sphere, and of it with some points given again, and where these are in their order."""
        sphere, order = fibonacci_sphere(600), np.random.default_rng(0).permutation(650)
        doubled = np.concatenate([sphere, sphere[:40], sphere[:10]])[order]
        return core.build_laplacian(sphere), core.build_laplacian(doubled), np.argsort(order)

    @pytest.mark.parametrize(("apart", "copies"), [(1e-17, 9), (1e-14, 1), (1e-10, 9)])
    def test_rounding_tells_no_points_apart(self, sphere, both, apart, copies):
        rng = np.random.default_rng(1)
        near = [sphere + apart * rng.standard_normal(sphere.shape) for _ in range(copies)]
        laplacian = core.build_laplacian(np.concatenate([sphere, *near]))
        assert laplacian.notices == [f"Points that lie on another one: {copies * len(sphere):,}. They share one area."]
        np.testing.assert_allclose(laplacian.areas[: len(sphere)] * (copies + 1), both[0].areas, rtol=1e-6)

    def test_a_heap_is_one_point(self, sphere):
        heap = sphere[7] + 1e-12 * np.random.default_rng(2).standard_normal((20_000, 3))
        assert len(scale_points(np.concatenate([sphere, heap])).points) == len(sphere)

    def test_they_share_one_area_and_a_notice_counts_them(self, both):
        single, doubled, place = both
        assert any("on another one: 50." in notice for notice in doubled.notices)
        areas, expected = doubled.areas[place], single.areas
        np.testing.assert_allclose(areas[600:640] + areas[:40] + np.pad(areas[640:], (0, 30)), expected[:40], rtol=1e-9)
        np.testing.assert_allclose(areas[:10], areas[640:], rtol=1e-12)
        assert areas.sum() == pytest.approx(expected.sum(), rel=1e-12)

    @pytest.mark.parametrize(
        "use",
        [
            lambda on: core.distance.geodesic_distance(on, [0]),
            lambda on: core.distance.grow(on, [0], 0.5).astype(float),
            lambda on: core.spectral.segment(on, 4),
            lambda on: core.clean.smooth_points(on, 20, keep="area"),
            lambda on: core.clean.fair_points(on, keep="volume"),
        ],
        ids=["distance", "grown", "parts", "smooth", "fair"],
    )
    def test_all_that_is_done_is_the_same_at_each_copy(self, both, use):
        _, doubled, place = both
        found = use(doubled)[place]
        np.testing.assert_allclose(found[600:640], found[:40], atol=1e-9)
        np.testing.assert_allclose(found[640:], found[:10], atol=1e-9)
        assert np.ptp(found) > 0.0

    def test_the_operator_and_its_spectrum_are_the_same(self, both):
        single, doubled, place = both
        expected, found = (
            each.apply(np.sin(3.0 * each.points[:, 0]) + each.points[:, 1]) for each in (single, doubled)
        )
        np.testing.assert_allclose(found[place][:600], expected, rtol=0.0, atol=1e-9)
        expected, found = (each.eigenpairs(12).eigenvalues for each in (single, doubled))
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-9)

    def test_the_couplings_of_all_copies_sum_to_those_of_one_point(self):
        """On an open surface, too, where images couple a point to itself."""
        points, rng = square_random(700), np.random.default_rng(0)
        copied = rng.permutation(np.append(np.arange(700), rng.integers(0, 700, 90)))
        single, several = core.build_laplacian(points), core.build_laplacian(points[copied])
        sums = sparse.csr_array((np.ones(len(copied)), (copied, np.arange(len(copied)))))
        for expected, found in (single.stiffness, several.stiffness), (single.images, several.images):
            assert found.has_canonical_format
            assert np.all(found.data != 0.0)
            np.testing.assert_allclose((sums @ found @ sums.T).toarray(), expected.toarray(), atol=1e-9)


class TestGivenNormals:
    def test_they_are_used_as_they_are(self, sphere):
        laplacian = core.build_laplacian(sphere, normals=-2.0 * sphere)
        np.testing.assert_allclose(laplacian.normals, -sphere, atol=1e-12)

    def test_wrong_length(self, sphere):
        with pytest.raises(core.InvalidPointsError, match="do not fit 600 points"):
            core.build_laplacian(sphere, normals=sphere[:5])

    def test_zero_normals(self, sphere):
        normals = sphere.copy()
        normals[:4] = 0.0
        with pytest.raises(core.InvalidPointsError, match="4 of 600 normals are zero"):
            core.build_laplacian(sphere, normals=normals)


@pytest.mark.parametrize(
    "settings",
    [
        {"bandwidth": "wide"},
        {"neighbors": 3},
        {"neighbors": 20.5},
        {"bandwidth_factor": 0.0},
        {"bandwidth_factor": float("nan")},
        {"boundary": "on"},
        {"projection": "twice"},
        {"neighbors": 10, "bandwidth_factor": 0.2},
        {"bandwidth": "local", "neighbors": 10, "bandwidth_factor": 0.2},
    ],
)
def test_options_out_of_range(settings):
    with pytest.raises(core.PointCloudError, match="Choose|Use|Raise"):
        core.LaplacianOptions(**settings)


def test_points_left_out_before_stay_so():
    scaled = scale_points(fibonacci_sphere(60))
    once = scaled.leave_out(np.arange(60) < 3)
    twice = once.leave_out(np.arange(57) == 0)
    assert np.count_nonzero(twice.inverse < 0) == 4
    known = twice.inverse >= 0
    np.testing.assert_array_equal(twice.points[twice.inverse[known]], scaled.points[scaled.inverse[known]])
    np.testing.assert_array_equal(twice.scatter(np.ones(56), 0.0), np.where(known, 1.0, 0.0))


def test_points_with_no_others_within_their_kernels_are_left_out():
    """They have no row in the matrix, which solvers would wait for."""
    narrow = core.LaplacianOptions(bandwidth="global", neighbors=20, bandwidth_factor=0.3)
    laplacian = core.build_laplacian(uneven_sphere(3000, ratio=60.0), options=narrow)
    alone = np.diff(laplacian.stiffness.indptr) == 0
    assert alone.any()
    np.testing.assert_array_equal(laplacian.component < 0, alone)
    np.testing.assert_array_equal(laplacian.doubt == core.Doubt.LEFT_OUT, alone)
    assert laplacian.areas[alone].max() < 1e-200
    assert any("no others within" in notice for notice in laplacian.notices)
    assert np.isfinite(laplacian.eigenpairs(4).eigenvalues).all()


ONE = {  # calls that take points by their indices, with the index of one
    "distance": lambda laplacian, one: core.distance.geodesic_distance(laplacian, one),
    "nearest": lambda laplacian, one: core.distance.nearest_source(laplacian, one),
    "grow": lambda laplacian, one: core.distance.grow(laplacian, one, 1.0),
    "transport": lambda laplacian, one: core.distance.transport(laplacian, one, [0.0, 1.0, 0.0]),
    "map": lambda laplacian, one: core.distance.logarithmic_map(laplacian, one),
    "fixed": lambda laplacian, one: core.distance.solve_poisson(laplacian, laplacian.points[:, 0], one, 0.0),
    "inpaint": lambda laplacian, one: core.rig.inpaint(laplacian, one, [2.0]),
    "region": lambda laplacian, one: core.measure.measure_region(laplacian, one).area,
    "left out": lambda laplacian, one: core.build_laplacian(laplacian.points, left_out=one).areas,
}


@pytest.mark.parametrize("call", ONE.values(), ids=ONE)
def test_the_index_of_one_point_is_a_set_of_points(operators, call):
    laplacian = operators("even sphere")
    expected = call(laplacian, [700])
    np.testing.assert_array_equal(call(laplacian, 700), expected)
    np.testing.assert_array_equal(call(laplacian, np.int64(700)), expected)


@pytest.mark.parametrize("wrong", [True, 7.0, 2500, "seven"])
def test_no_index_of_one_point(operators, wrong):
    with pytest.raises(core.InvalidPointsError, match="Give whole numbers below 2500"):
        core.distance.geodesic_distance(operators("even sphere"), wrong)
