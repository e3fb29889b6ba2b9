"""The stages of the walk from coordinates to pairs, each called alone."""

from dataclasses import replace

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere
from core.geometry.bandwidth import mean_gaps
from core.geometry.boundary import no_boundary
from core.geometry.cells import measure_cells
from core.geometry.cloud import (
    divide_components,
    divide_sheets,
    fit_surface,
    leave_outliers,
    locate_boundary,
    read_cloud,
    remove_noise,
)
from core.geometry.points import scale_points
from core.geometry.winding import orient_by_winding


def gaps_of(surface, oriented):
    """How wide the gaps between points are, before a boundary is known."""
    nearest, count = surface.sample.nearest, len(oriented)
    gaussian = surface.quadrics.gaussian_curvature
    return mean_gaps(nearest, measure_cells(nearest, oriented, gaussian, no_boundary(count)).radius, 1)


def sample_of(points):
    return divide_components(leave_outliers(scale_points(points)))


def radii(sample):
    """Distances from the centre of a unit sphere, in its own lengths."""
    scaled = sample.scaled
    return np.linalg.norm(sample.nearest.points, axis=1) * scaled.scale


def grid(side):
    return np.stack(np.meshgrid(range(side), range(side), [0.0]), axis=-1).reshape(-1, 3).astype(float)


def test_components_are_divided_and_lone_points_left_out():
    sphere = fibonacci_sphere(600)
    sample = sample_of(np.concatenate([sphere, sphere[:400] + [5.0, 0.0, 0.0], [[0.0, 0.0, 30.0]]]))
    assert sorted(np.bincount(sample.component)) == [400, 600]
    assert len(sample.scaled.points) == 1000
    assert sample.scaled.inverse[-1] == -1
    assert not sample.moved.any()
    other = sample.component[sample.nearest.index] != sample.component[:, None]
    assert not other.any()


def test_too_few_points_left_are_an_error():
    clusters = [fibonacci_sphere(30) + [9.0 * number, 0.0, 0.0] for number in range(10)]
    with pytest.raises(core.ComponentError, match="270 of 300 points are in components of too few points"):
        sample_of(np.concatenate(clusters))


@pytest.mark.parametrize("sheets", [True, False])
def test_quadrics_have_the_normals_and_curvature_of_a_sphere(sheets):
    sample = sample_of(fibonacci_sphere(1400))
    surface = fit_surface(sample, sheets)
    outward = sample.nearest.points * sample.scaled.scale
    np.testing.assert_allclose(np.abs(np.sum(surface.quadrics.normals * outward, axis=1)), 1.0, atol=1e-4)
    np.testing.assert_allclose(surface.quadrics.gaussian_curvature / sample.scaled.scale**2, 1.0, rtol=0.05)


def test_noise_is_removed_where_it_is_measured():
    points = fibonacci_sphere(2100)
    points *= 1.0 + 0.02 * np.random.default_rng(0).standard_normal(len(points))[:, None]
    surface = fit_surface(sample_of(points), True)
    smooth = remove_noise(surface, core.LaplacianOptions())
    assert smooth.sample.noise.min() > 0.1
    assert np.std(radii(smooth.sample)) < 0.45 * np.std(radii(surface.sample))
    np.testing.assert_allclose(
        smooth.sample.nearest.points - surface.sample.nearest.points, smooth.sample.moved, atol=1e-15
    )
    assert remove_noise(surface, core.LaplacianOptions(projection="off")) is surface
    clean = fit_surface(sample_of(fibonacci_sphere(2100)), True)
    assert remove_noise(clean, core.LaplacianOptions()) is clean
    assert remove_noise(clean, core.LaplacianOptions(projection="quadric")) is not clean


def test_noise_is_removed_on_the_noisy_side_alone():
    points = fibonacci_sphere(2000)
    noise = 0.01 * np.random.default_rng(0).standard_normal(len(points)) * (points[:, 2] > 0.0)
    smooth = remove_noise(fit_surface(sample_of(points * (1.0 + noise[:, None])), True), core.LaplacianOptions())
    moved = np.linalg.norm(smooth.sample.moved, axis=1)[np.argsort(smooth.sample.scaled.first)]
    assert np.all(moved[points[:, 2] < -0.3] == 0.0)
    assert np.mean(moved[points[:, 2] > 0.3] > 0.0) > 0.99


def test_sheets_that_nowhere_meet_become_components():
    points = np.concatenate([grid(20), grid(20) + [0.0, 0.0, 1.5]])
    surface = fit_surface(sample_of(points), True)
    assert surface.sample.component.max() == 0
    divided = divide_sheets(surface)
    heights = divided.sample.scaled.points[:, 2] * divided.sample.scaled.scale
    np.testing.assert_array_equal(np.bincount(divided.sample.component), [400, 400])
    assert [len(np.unique(np.sign(heights[divided.sample.component == part]))) for part in (0, 1)] == [1, 1]


def test_one_sheet_stays_as_it_is():
    surface = fit_surface(sample_of(fibonacci_sphere(900)), True)
    assert divide_sheets(surface) is surface


class TestBoundary:
    def located(self, points, search=True, **given):
        surface = fit_surface(sample_of(points), True)
        sample = surface.sample
        oriented = orient_by_winding(sample.nearest, surface.quadrics.normals, sample.places, sample.component)
        gaps = gaps_of(surface, oriented) if search else None
        return surface.sample, locate_boundary(surface.sample, oriented, gaps, **given)

    def test_a_closed_surface_has_none(self):
        _, boundary = self.located(random_sphere(750))
        assert not boundary.at_boundary.any()
        assert not np.isfinite(boundary.distance).any()

    def test_of_a_grid_it_is_found_or_not_looked_for(self):
        points = grid(30)
        edge = ((points[:, :2] == 0.0) | (points[:, :2] == 29.0)).any(axis=1)
        sample, boundary = self.located(points)
        np.testing.assert_array_equal(boundary.at_boundary, edge[sample.scaled.first])
        assert not self.located(points, search=False)[1].at_boundary.any()

    def test_it_is_taken_as_given(self):
        points = grid(30)
        exact = np.minimum(points[:, :2], 29.0 - points[:, :2]).min(axis=1)
        sample, boundary = self.located(points, boundary_distance=exact)
        np.testing.assert_allclose(boundary.distance[:, 0] * sample.scaled.scale, exact[sample.scaled.first])
        with pytest.raises(core.InvalidPointsError, match="given by 3 different points"):
            self.located(points, boundary=[0, 1, 2])


def test_normals_are_the_given_ones():
    points = fibonacci_sphere(900)
    cloud = read_cloud(points, core.LaplacianOptions(), -points)
    np.testing.assert_allclose(cloud.normals, -points[cloud.scaled.first], rtol=1e-15)


def test_the_walk_is_these_stages():
    points = np.concatenate([grid(24), grid(24) + [0.0, 0.0, 1.5]])
    options = core.LaplacianOptions()
    surface = divide_sheets(fit_surface(sample_of(points), True))
    sample = surface.sample
    oriented = orient_by_winding(sample.nearest, surface.quadrics.normals, sample.places, sample.component)
    cloud = read_cloud(points, options)
    np.testing.assert_array_equal(cloud.component, surface.sample.component)
    np.testing.assert_array_equal(cloud.normals, oriented)
    located = locate_boundary(surface.sample, oriented, gaps_of(surface, oriented))
    np.testing.assert_array_equal(cloud.boundary.distance, located.distance)
    assert read_cloud(points, replace(options, sheets=False)).component.max() == 0
