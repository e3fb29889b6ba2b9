"""Noise: its measure, its smoothing within the operator, and what that leaves alone."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import core
from benchmarks.samplings import (
    closed_plate,
    fibonacci_sphere,
    noisy_sphere,
    open_cylinder,
    parallel_sheets,
    random_sphere,
    sausage,
    square_random,
    torus_points,
    uneven_sphere,
)
from core.geometry import cloud
from core.geometry.cloud import read_cloud
from core.geometry.nearest import find_nearest
from core.geometry.noise import near_misfit, noise_level, project_points
from core.geometry.sheets import fit_sheets
from core.options import LaplacianOptions
from core.paper.normals import tangent_planes

COUNT = 1500
LEVEL = np.full(COUNT, 0.3)
SPACING = np.sqrt(4.0 * np.pi / COUNT)
CLEAN = {
    "even sphere": fibonacci_sphere(1500),
    "random sphere": random_sphere(1500),
    "density jump": uneven_sphere(2000),
    "torus": torus_points(1500),
    "thin torus": torus_points(2500, minor=0.1),
    "coarse torus": torus_points(400),
    "parallel sheets": parallel_sheets(25)[0],
    "box": closed_plate(20, 8)[0],
    "plate": closed_plate(25)[0],
    "bent capsule": sausage(2000, bent=True)[0],
    "cylinder": open_cylinder()[::3],
    "square": square_random(1500),
}


def measured(points):
    """The mean noise as the operator measures it."""
    fitted = fit_sheets(find_nearest(points))
    near = near_misfit(fitted.nearest)
    return noise_level(fitted.nearest, near, fitted.mixed.misfit, fitted.quadrics.misfit).mean()


def projected(points, noise):
    """All of some points, projected."""
    return project_points(cKDTree(points), np.arange(len(points)), noise)


def off_sphere(points):
    """Root mean square distance from the unit sphere, in spacings."""
    return np.sqrt(np.mean((np.linalg.norm(points, axis=1) - 1.0) ** 2)) / SPACING


def degrees_off(normals, points):
    """Root mean square angle between normals and those of the sphere."""
    cosine = np.abs(np.einsum("ij,ij->i", normals, points)) / np.linalg.norm(points, axis=1)
    return np.degrees(np.sqrt(np.mean(np.arccos(np.minimum(cosine, 1.0)) ** 2)))


@pytest.fixture(scope="module")
def noisy():
    return noisy_sphere(COUNT, 0.5)


@pytest.fixture(scope="module")
def laplacian(noisy):
    return core.build_laplacian(noisy)


@pytest.fixture(scope="module")
def rough(noisy):
    """The operator of the points as they are."""
    return core.build_laplacian(noisy, options=LaplacianOptions(projection="off"))


class TestLevel:
    @pytest.mark.parametrize("name", CLEAN)
    def test_nothing_on_clean_surfaces(self, name):
        assert measured(CLEAN[name]) < 0.03
        assert read_cloud(CLEAN[name], LaplacianOptions()).notices == []

    @pytest.mark.parametrize("level", [0.1, 0.25, 0.5])
    def test_about_right_on_noisy_ones(self, level):
        # The fit follows some of the noise.
        assert 0.5 * level < measured(noisy_sphere(COUNT, level)) < 1.1 * level

    def test_free_of_units(self, noisy):
        assert measured(1e-3 * noisy) == pytest.approx(measured(noisy), rel=1e-9)

    @pytest.mark.parametrize("count", [50, 61, 80])
    def test_few_points(self, count):
        assert measured(fibonacci_sphere(count)) < 0.05


class TestProjection:
    def test_quadrics_bring_the_points_back(self, noisy):
        once = projected(noisy, LEVEL)
        assert off_sphere(once) < 0.35 * off_sphere(noisy)
        assert off_sphere(projected(once, LEVEL)) < 0.9 * off_sphere(once)

    def test_planes_too_but_they_cut_the_bend(self):
        noisy = 3.0 * noisy_sphere(COUNT, 0.5)
        flat = tangent_planes(noisy) / 3.0
        assert off_sphere(flat) < 0.7 * off_sphere(noisy / 3.0)
        radius = np.linalg.norm(flat, axis=1)
        assert radius.mean() < 1.0 - 3e-3

    def test_points_of_a_plane_stay_where_they_are(self):
        points = square_random(800)
        for moved in (projected(points, np.full(800, 0.1)), tangent_planes(points)):
            np.testing.assert_allclose(moved, points, atol=1e-9)

    def test_a_quadric_hardly_moves_clean_points(self):
        points = torus_points(1500)
        spacing = np.sqrt(4.0 * np.pi**2 * 0.4 / 1500)
        moved = projected(points, np.full(1500, 0.3)) - points
        assert np.linalg.norm(moved, axis=1).max() < 0.1 * spacing

    def test_some_points_go_where_they_go_with_all(self, noisy):
        rows, level = np.arange(5, COUNT, 7), np.linspace(0.0, 0.6, COUNT)
        some = project_points(cKDTree(noisy), rows, level)
        np.testing.assert_allclose(some, projected(noisy, level)[rows], atol=1e-12)


class TestOperator:
    def test_the_callers_points_are_left_alone(self, noisy, laplacian):
        np.testing.assert_array_equal(noisy, noisy_sphere(COUNT, 0.5))
        np.testing.assert_array_equal(laplacian.points, noisy)

    def test_a_notice_tells_how_strong_it_is(self, laplacian):
        notices = [notice for notice in laplacian.notices if "Noise" in notice]
        assert len(notices) == 1
        level = float(notices[0].split()[2])
        assert 0.25 < level < 0.55

    def test_its_own_points_normals_and_areas_are_those_of_the_surface(self, noisy, laplacian, rough):
        assert off_sphere(laplacian.surface_points) < 0.25 < 0.4 < off_sphere(rough.surface_points)
        assert degrees_off(laplacian.normals, noisy) < min(6.0, 0.5 * degrees_off(rough.normals, noisy))
        quadric = core.estimate_areas(noisy, options=LaplacianOptions(projection="quadric"))
        assert laplacian.areas.sum() == pytest.approx(4.0 * np.pi, rel=1e-2)
        assert quadric.sum() == pytest.approx(4.0 * np.pi, rel=1e-2)
        assert rough.areas.sum() > 1.15 * 4.0 * np.pi

    def test_clean_points_are_taken_as_they_are(self):
        points = torus_points(750)
        automatic, off = (core.build_laplacian(points, options=LaplacianOptions(projection=p)) for p in ("auto", "off"))
        np.testing.assert_array_equal(automatic.areas, off.areas)
        np.testing.assert_array_equal(automatic.stiffness.data, off.stiffness.data)

    def test_always_if_asked_for(self):
        points = random_sphere(900)
        plain, quadric = (
            core.build_laplacian(points, options=LaplacianOptions(projection=p)) for p in ("off", "quadric")
        )
        assert np.any(quadric.areas != plain.areas)
        np.testing.assert_allclose(quadric.areas.sum(), plain.areas.sum(), rtol=4e-3)
        assert quadric.notices == []

    def test_by_planes_that_lie_inside_the_sphere(self):
        plain, plane = (
            core.paper.build_laplacian(random_sphere(600), denoise=d, areas="uniform") for d in (False, True)
        )
        assert plane.areas.sum() < 0.99 * plain.areas.sum()
        assert plane.notices == plain.notices

    @pytest.mark.parametrize("level", [1.0, 3.0])
    def test_noise_beyond_the_spacing_is_smoothed_and_told(self, level):
        noise = level * np.sqrt(4.0 * np.pi / 2000) * np.random.default_rng(1).standard_normal((2000, 1))
        laplacian = core.build_laplacian(random_sphere(2000) * (1.0 + noise))
        assert laplacian.areas.sum() == pytest.approx(4.0 * np.pi, rel=0.15)
        assert any("more than half the spacing" in notice for notice in laplacian.notices)

    def test_given_normals_are_kept(self, noisy):
        laplacian = core.build_laplacian(noisy, normals=noisy)
        np.testing.assert_allclose(laplacian.normals, noisy / np.linalg.norm(noisy, axis=1)[:, None], atol=1e-12)

    def test_a_noisy_open_surface_keeps_its_boundary(self):
        points = square_random(800)
        points[:, 2] = 0.3 / 40.0 * np.random.default_rng(1).standard_normal(800)
        laplacian = core.build_laplacian(points)
        assert laplacian.areas.sum() == pytest.approx(1.0, rel=5e-2)
        distance = np.minimum(points[:, :2], 1.0 - points[:, :2]).min(axis=1)
        assert np.count_nonzero(laplacian.boundary) > 100
        assert np.mean(distance[laplacian.boundary] < 3.0 / 40.0) > 0.95


def test_rows_of_a_scan_finer_along_than_across_are_no_curves():
    # The 20 neighbours of the measure of noise lie in one row, the 40 of the quadrics in several.
    y, x = np.mgrid[:20, :140]
    z = 0.05 * np.random.default_rng(0).standard_normal(x.size)
    laplacian = core.build_laplacian(np.column_stack([x.ravel() / 7.0, y.ravel(), z]))
    assert laplacian.areas.sum() == pytest.approx(19.0 * 139.0 / 7.0, rel=0.2)  # some of the noise counts as shape


@pytest.mark.parametrize(("level", "fewest", "most"), [(2.0, 3, 6), (None, 1, 5)], ids=["noise", "volume"])
def test_rounds_go_on_as_long_as_they_smooth(monkeypatch, level, fewest, most):
    """Noise is smoothed round by round; points that fill a volume stay as they are, whatever is done."""
    rounds, project = [], cloud.project_points
    monkeypatch.setattr(cloud, "project_points", lambda *given: rounds.append(1) or project(*given))
    rng, points = np.random.default_rng(1), random_sphere(1500)
    if level is None:
        points = np.concatenate([points, 3.0 + rng.random((1500, 3))])
    else:
        points *= 1.0 + level * np.sqrt(4.0 * np.pi / 1500) * rng.standard_normal((1500, 1))
    core.build_laplacian(points)
    assert fewest <= len(rounds) <= most
