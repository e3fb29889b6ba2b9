import functools

import numpy as np
import pytest
from scipy.special import sph_harm_y

import core
from benchmarks.samplings import disc_random, fibonacci_sphere, hemisphere_random, open_cylinder, square_grid
from core.clean.smoothing import boundary_places

BUMP = 0.1


def bumps(directions):
    """Height of the bumpy shape over the unit sphere: a tenth of Y_6^3, of unit norm."""
    z = np.clip(directions[:, 2], -1.0, 1.0)
    around = np.arctan2(directions[:, 1], directions[:, 0])
    return BUMP * np.sqrt(2.0) * sph_harm_y(6, 3, np.arccos(z), around).real


def noisy_sphere(count, bumpy, level=0.03):
    """Points over the Fibonacci sphere with noise of the radius, and the noise."""
    directions = fibonacci_sphere(count)
    noise = level * np.random.default_rng(0).standard_normal(count)
    return directions * (1.0 + bumps(directions) * bumpy + noise)[:, None], noise


def radial(points, bumpy):
    """Radial distances from the shape, and the height of the bumps as a share of theirs."""
    radius = np.linalg.norm(points, axis=1)
    height = bumps(points / radius[:, None])
    return radius - 1.0 - bumpy * height, (radius - radius.mean()) @ height / (height @ height)


def rms(values):
    return np.sqrt(np.mean(np.asarray(values) ** 2))


@pytest.fixture(scope="module")
def clouds():
    return {
        bumpy: (core.build_laplacian(noisy_sphere(3000, bumpy)[0]), noisy_sphere(3000, bumpy)[1])
        for bumpy in (False, True)
    }


@pytest.fixture(scope="module")
def ellipsoid():
    return core.build_laplacian(fibonacci_sphere(1000) * [1.0, 0.8, 0.6])


@pytest.fixture(scope="module")
def components():
    points = np.concatenate([fibonacci_sphere(900), 0.5 * fibonacci_sphere(600) + [5.0, 0.0, 0.0]])
    lone = [[0.0, 90.0, 0.0], [0.0, 90.0, 1.0]]
    return core.build_laplacian(np.concatenate([points, lone]))


SMOOTHERS = {
    "modes": lambda laplacian, **settings: core.clean.smooth_points(laplacian, 100, **settings),
    "fairing": core.clean.fair_points,
    "band": lambda laplacian, **settings: core.clean.smooth_points(laplacian, core.clean.band(0.0, 110.0), **settings),
}


@pytest.fixture(scope="module")
def smoothed(clouds):
    """Function from the name of a smoother and whether the sphere is bumpy to the smooth points."""
    return functools.cache(lambda name, bumpy: SMOOTHERS[name](clouds[bumpy][0]))


@pytest.mark.parametrize("bumpy", [False, True], ids=["sphere", "bumpy sphere"])
@pytest.mark.parametrize("name", SMOOTHERS)
def test_noise_falls_and_the_shape_stays(clouds, smoothed, name, bumpy):
    error, height = radial(smoothed(name, bumpy), bumpy)
    noise = clouds[bumpy][1]
    assert rms(noise) > 2.9 * rms(error)
    assert abs(error.mean()) < 4e-3
    if bumpy:
        assert height > 0.88


def test_area_of_the_result(smoothed):
    assert core.build_laplacian(smoothed("modes", False)).areas.sum() == pytest.approx(4.0 * np.pi, rel=1e-2)


def size_of(laplacian, kind):
    """The area of a surface, or its volume by the divergence theorem."""
    height = np.einsum("ic,ic->i", laplacian.points, laplacian.normals) / 3.0
    return laplacian.areas.sum() if kind == "area" else laplacian.areas @ height


@pytest.mark.parametrize("keep", ["area", "volume"])
def test_size_is_kept_where_the_filter_shrinks(clouds, ellipsoid, keep):
    shrinking = core.clean.exponential(0.1)
    for laplacian, tolerance in ((ellipsoid, 6e-3), (clouds[False][0], 1e-2)):
        assert rms(core.clean.smooth_points(laplacian, shrinking)) < 0.9 * rms(laplacian.points)
        kept = core.build_laplacian(core.clean.smooth_points(laplacian, shrinking, keep=keep))
        assert size_of(kept, keep) == pytest.approx(size_of(laplacian, keep), rel=tolerance)


def test_kept_volume_of_the_sphere_is_its_own():
    laplacian = core.build_laplacian(fibonacci_sphere(750))
    for keep in ("area", "volume"):
        radius = np.linalg.norm(core.clean.smooth_points(laplacian, core.clean.exponential(0.2), keep=keep), axis=1)
        np.testing.assert_allclose(radius, 1.0, atol=1e-3)


@pytest.mark.parametrize("keep", ["area", "volume"])
def test_size_is_kept_under_a_mask(ellipsoid, keep):
    mask = np.clip(ellipsoid.points[:, 0] + 0.3, 0.0, 1.0)
    moved = core.clean.smooth_points(ellipsoid, core.clean.exponential(0.05), mask=mask, keep=keep)
    np.testing.assert_array_equal(moved[mask == 0.0], ellipsoid.points[mask == 0.0])
    assert np.abs(moved - ellipsoid.points).max() > 1e-3
    assert size_of(core.build_laplacian(moved), keep) == pytest.approx(size_of(ellipsoid, keep), rel=3e-3)


def test_exponential_shrinks_the_sphere_by_its_factor():
    laplacian = core.build_laplacian(fibonacci_sphere(750))
    found = core.clean.smooth_points(laplacian, core.clean.exponential(0.1))
    np.testing.assert_allclose(found, np.exp(-0.2) * laplacian.points, atol=2e-3)
    found = core.clean.fair_points(laplacian, 0.1, order=1)
    np.testing.assert_allclose(found, laplacian.points / 1.2, atol=2e-3)
    found = core.clean.fair_points(laplacian, 0.1, order=2)
    np.testing.assert_allclose(found, laplacian.points / 1.04, atol=2e-3)


def test_few_modes_of_a_sphere_give_the_sphere():
    laplacian = core.build_laplacian(fibonacci_sphere(750) + [3.0, 0.0, -2.0])
    np.testing.assert_allclose(core.clean.smooth_points(laplacian, 4), laplacian.points, atol=5e-3)


def test_details_are_boosted(clouds):
    laplacian = core.build_laplacian(noisy_sphere(1000, True, 0.0)[0])
    boosted = core.clean.smooth_points(laplacian, core.clean.boost(1.5, 15.0))
    error, height = radial(boosted, False)
    assert 1.35 < height < 1.6
    assert abs(error.mean()) < 1e-2
    spectrum = laplacian.eigenpairs(120)
    np.testing.assert_allclose(
        core.clean.smooth_points(laplacian, core.clean.boost(1.5, 15.0), spectrum), boosted, atol=1e-2
    )


def test_spectrum_given_or_computed_is_the_same(ellipsoid):
    spectrum = ellipsoid.eigenpairs(40)
    np.testing.assert_allclose(
        core.clean.smooth_points(ellipsoid, 20, spectrum), core.clean.smooth_points(ellipsoid, 20), atol=1e-8
    )


def test_modes_beyond_those_resolved_serve_a_reconstruction():
    wide = core.LaplacianOptions(bandwidth_factor=1.7)
    ellipsoid = core.build_laplacian(fibonacci_sphere(600) * [1.0, 0.8, 0.6], options=wide)
    with pytest.raises(core.UnresolvedModesError):
        ellipsoid.eigenpairs(180)
    errors = [rms(core.clean.smooth_points(ellipsoid, count) - ellipsoid.points) for count in (10, 50, 180)]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 2e-3


def test_strength_and_mask_blend(ellipsoid):
    full = core.clean.smooth_points(ellipsoid, 10) - ellipsoid.points
    mask = np.linspace(0.0, 1.0, 1000)
    for strength in (0.5, 2.0, -1.0):
        moved = core.clean.smooth_points(ellipsoid, 10, strength=strength, mask=mask) - ellipsoid.points
        np.testing.assert_allclose(moved, strength * mask[:, None] * full, atol=1e-9)
    faired = core.clean.fair_points(ellipsoid, 0.01, mask=mask > 0.5) - ellipsoid.points
    assert np.all(faired[mask <= 0.5] == 0.0)
    assert np.all(np.any(faired[mask > 0.5] != 0.0, axis=1))


def test_components_keep_their_places_and_lone_points_stay(components):
    part = components.component
    assert part.max() == 1
    for found in (
        core.clean.smooth_points(components, core.clean.exponential(9.0)),
        core.clean.smooth_points(components, 8),
        core.clean.smooth_points(components, core.clean.exponential(0.1), keep="area"),
        core.clean.fair_points(components, keep="volume"),
    ):
        assert np.isfinite(found).all()
        np.testing.assert_array_equal(found[part < 0], components.points[part < 0])
        for number, center in enumerate(([0.0, 0.0, 0.0], [5.0, 0.0, 0.0])):
            np.testing.assert_allclose(found[part == number].mean(axis=0), center, atol=5e-3)


def test_each_component_keeps_its_own_size(components):
    found = core.clean.smooth_points(components, core.clean.exponential(0.05), keep="volume")
    for number, radius, center in ((0, 1.0, [0.0, 0.0, 0.0]), (1, 0.5, [5.0, 0.0, 0.0])):
        inside = components.component == number
        np.testing.assert_allclose(np.linalg.norm(found[inside] - center, axis=1), radius, rtol=4e-3)


@pytest.mark.parametrize("count", [1, 2])
def test_constants_alone_are_no_shape(components, count):
    with pytest.raises(core.PointCloudError, match=r"2 component.* at least 5"):
        core.clean.smooth_points(components, count)


class TestBoundary:
    def test_places_on_the_boundary_of_a_disc(self):
        points, distance = disc_random(1400)
        laplacian = core.build_laplacian(points)
        places = boundary_places(laplacian)
        near = laplacian.near_boundary
        moved = np.linalg.norm(places - points, axis=1)
        np.testing.assert_allclose(moved[near], distance[near], atol=0.03)
        assert np.all(moved[~near] == 0.0)

    @pytest.mark.parametrize("response", [core.clean.exponential(0.05), core.clean.fairing(0.01), 21])
    def test_a_flat_square_stays(self, response):
        laplacian = core.build_laplacian(square_grid(21))
        moved = core.clean.smooth_points(laplacian, response, dirichlet=True)
        np.testing.assert_array_equal(moved[laplacian.boundary], laplacian.points[laplacian.boundary])
        corner = np.all(np.abs(laplacian.points[:, :2] - 0.5) > 0.2, axis=1)
        np.testing.assert_allclose(moved[~corner], laplacian.points[~corner], atol=4e-3)
        np.testing.assert_allclose(moved[corner], laplacian.points[corner], atol=2e-2)

    def test_a_flat_disc_of_random_points_stays(self):
        laplacian = core.build_laplacian(disc_random(1000)[0])
        moved = core.clean.fair_points(laplacian, dirichlet=True) - laplacian.points
        assert np.linalg.norm(moved, axis=1).max() < 0.04  # the spacing
        assert rms(np.linalg.norm(moved, axis=1)) < 8e-3

    def test_noise_falls_on_an_open_cylinder_that_keeps_its_boundaries(self):
        points = open_cylinder()[::2]
        radial = points * [0.5, 0.5, 0.0]
        noise = 0.02 * np.random.default_rng(0).standard_normal(len(points))
        noise[np.abs(points[:, 2]) > 0.99] = 0.0
        laplacian = core.build_laplacian(points + noise[:, None] * radial)
        moved = core.clean.fair_points(laplacian, dirichlet=True)
        boundary = np.abs(points[:, 2]) > 0.99
        np.testing.assert_array_equal(moved[laplacian.boundary], laplacian.points[laplacian.boundary])
        assert np.mean(laplacian.boundary[boundary]) > 0.95
        assert rms(np.linalg.norm(moved[:, :2], axis=1) - 2.0) < rms(noise) / 2.5
        free = core.clean.fair_points(laplacian)
        assert np.abs(free[boundary, 2]).mean() < np.abs(moved[boundary, 2]).mean()

    def test_parts_without_a_boundary_are_not_in_the_way(self):
        ball = 0.5 * fibonacci_sphere(600) + [0.0, 0.0, 4.0]
        laplacian = core.build_laplacian(np.concatenate([hemisphere_random(750), ball]))
        assert laplacian.boundary.any()
        moved = core.clean.smooth_points(laplacian, core.clean.fairing(1e-3), dirichlet=True)
        assert np.isfinite(moved).all()
        np.testing.assert_allclose(moved[750:], ball, atol=5e-3)

    def test_an_open_surface_has_no_volume(self):
        laplacian = core.build_laplacian(square_grid(20))
        with pytest.raises(core.PointCloudError, match="enclose no volume"):
            core.clean.fair_points(laplacian, keep="volume")
        with pytest.raises(core.PointCloudError, match="keep neither"):
            core.clean.fair_points(laplacian, keep="area", dirichlet=True)


@pytest.mark.parametrize("signs", [-1.0, "random"])
def test_normals_that_do_not_point_outwards_enclose_no_volume(ellipsoid, signs):
    if signs == "random":
        signs = np.random.default_rng(0).choice([-1.0, 1.0], 1000)[:, None]
    laplacian = core.build_laplacian(ellipsoid.points, signs * ellipsoid.normals)
    with pytest.raises(core.PointCloudError, match="point outwards"):
        core.clean.fair_points(laplacian, keep="volume")


def test_a_size_that_is_lost_cannot_be_kept(ellipsoid):
    with pytest.raises(core.SolverError, match="lose so much"):
        core.clean.smooth_points(ellipsoid, core.clean.exponential(5.0), keep="area")


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"strength": np.nan}, "strength"),
        ({"mask": np.zeros(1000)}, "zero at all 1000"),
        ({"mask": np.full(1000, 2.0)}, "0 to 1"),
        ({"mask": np.full(1000, np.nan)}, "not finite"),
        ({"mask": [0, 1, 2]}, "1000 points"),
        ({"keep": "length"}, "Choose one of"),
    ],
)
def test_bad_settings(ellipsoid, settings, words):
    for smoother in (core.clean.fair_points, lambda *given, **named: core.clean.smooth_points(*given, 10, **named)):
        with pytest.raises(core.PointCloudError, match=words):
            smoother(ellipsoid, **settings)


@pytest.mark.parametrize("response", [None, 2.5, True, "all"])
def test_responses_that_are_neither_number_nor_function(ellipsoid, response):
    with pytest.raises(core.PointCloudError, match="whole number of modes, or a function"):
        core.clean.smooth_points(ellipsoid, response)


@pytest.mark.parametrize("settings", [{"time": -1.0}, {"time": np.nan}, {"time": 1.0, "order": 4}])
def test_bad_fairing(ellipsoid, settings):
    with pytest.raises(core.PointCloudError, match="fairing"):
        core.clean.fair_points(ellipsoid, **settings)


class TestMode:
    def test_displacement_along_the_normals(self, ellipsoid):
        mode = ellipsoid.eigenpairs(5).eigenvectors[:, 4]
        full = core.clean.displace_by_mode(ellipsoid, mode, 0.2) - ellipsoid.points
        np.testing.assert_allclose(np.einsum("ic,ic->i", full, ellipsoid.normals), 0.2 * mode / np.abs(mode).max())
        assert np.linalg.norm(full, axis=1).max() == pytest.approx(0.2)
        for phase in (0.0, 1.0, np.pi):
            moved = core.clean.displace_by_mode(ellipsoid, mode, 0.2, phase=phase) - ellipsoid.points
            np.testing.assert_allclose(moved, np.cos(phase) * full, atol=1e-12)

    def test_default_amplitude_follows_the_size(self, ellipsoid):
        mode = ellipsoid.points[:, 0]
        moved = core.clean.displace_by_mode(ellipsoid, mode) - ellipsoid.points
        assert np.linalg.norm(moved, axis=1).max() == pytest.approx(0.1 * rms(np.linalg.norm(ellipsoid.points, axis=1)))

    @pytest.mark.parametrize(
        ("mode", "amplitude", "words"),
        [
            (np.zeros(1000), 1.0, "zero at all 1000"),
            (np.ones(3), 1.0, "1000 points"),
            (np.ones((1000, 2)), 1.0, "one real number for each of 1000 points"),
            (np.full(1000, np.inf), 1.0, "not finite"),
            (np.ones(1000), np.nan, "finite numbers"),
        ],
    )
    def test_bad_modes(self, ellipsoid, mode, amplitude, words):
        with pytest.raises(core.PointCloudError, match=words):
            core.clean.displace_by_mode(ellipsoid, mode, amplitude)


def test_progress_can_cancel(ellipsoid):
    def cancel(stage, fraction):
        raise core.Cancelled

    for work in (
        lambda: core.clean.smooth_points(ellipsoid, 10, progress=cancel),
        lambda: core.clean.fair_points(ellipsoid, 0.05, progress=cancel),
    ):
        with pytest.raises(core.Cancelled):
            work()


class TestRoughness:
    @pytest.mark.parametrize("bumpy", [False, True])
    def test_is_the_noise_and_not_the_shape(self, clouds, bumpy):
        laplacian, noise = clouds[bumpy]
        rough = core.clean.roughness(laplacian, 0.5)
        assert np.corrcoef(rough, noise)[0, 1] > 0.97
        assert rms(rough) == pytest.approx(rms(noise), rel=0.1)

    def test_wider_waves_count_the_less(self):
        heights = {}
        for waves in (4, 16):
            grid = square_grid(50)
            grid[:, 2] = 0.005 * np.sin(2.0 * np.pi * waves * grid[:, 0])
            normals = np.tile([0.0, 0.0, 1.0], (len(grid), 1))
            inner = np.abs(grid[:, :2] - 0.5).max(axis=1) < 0.3
            rough = core.clean.roughness(core.build_laplacian(grid, normals), 0.125)  # that of eight waves
            heights[waves] = rms(rough[inner]) / rms(grid[inner, 2])
        assert heights[4] < 0.05
        assert heights[16] > 0.9

    def test_scales_and_turns_its_sign_with_the_normals(self, clouds):
        laplacian, _ = clouds[False]
        rough = core.clean.roughness(laplacian, 0.5)
        larger = core.build_laplacian(4.0 * laplacian.points, -laplacian.normals)
        np.testing.assert_allclose(core.clean.roughness(larger, 2.0), -4.0 * rough, rtol=0.0, atol=1e-3)

    def test_point_left_out_is_not_rough(self, components):
        assert np.all(core.clean.roughness(components)[-2:] == 0.0)

    @pytest.mark.parametrize("wavelength", [0.0, -1.0, np.nan, np.inf])
    def test_wavelength_that_makes_no_sense(self, ellipsoid, wavelength):
        with pytest.raises(core.PointCloudError, match="above zero"):
            core.clean.roughness(ellipsoid, wavelength)
