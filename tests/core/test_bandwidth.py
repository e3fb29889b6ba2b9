"""Smoothing lengths: what makes them wide and what narrow."""

import numpy as np
import pytest

import core
from benchmarks.samplings import (
    beaded_sphere,
    fibonacci_sphere,
    random_sphere,
    square_grid,
    square_random,
    torus_area,
    torus_low_discrepancy,
    uneven_sphere,
)
from core.geometry.cloud import read_cloud
from core.options import LaplacianOptions


def lengths(points, **settings):
    """Smoothing lengths of the caller's points, in their unit."""
    cloud = read_cloud(points, LaplacianOptions(**settings))
    return cloud.scaled.scatter(cloud.pairs.lengths * cloud.scaled.scale, 0.0)


def torus_rows(rows, ratio):
    """A torus of radii 1 and 0.4 in rows along its ring, so many times denser along them than across."""
    along = int(rows / 0.4 * ratio)
    ring, tube = np.meshgrid(np.arange(along) * 2.0 * np.pi / along, np.arange(rows) * 2.0 * np.pi / rows)
    radius = 1.0 + 0.4 * np.cos(tube)
    return np.stack([radius * np.cos(ring), radius * np.sin(ring), 0.4 * np.sin(tube)], axis=-1).reshape(-1, 3)


def spread(values):
    return values.std() / values.mean()


class TestAdaptive:
    @pytest.mark.parametrize("seed", range(2))
    def test_constant_where_the_density_is(self, seed):
        points = random_sphere(1200, seed)
        adaptive = lengths(points)
        assert spread(adaptive) < 0.2  # single neighborhoods ask for more
        assert np.abs(adaptive / adaptive.mean() - 1.0).max() < 0.6

    @pytest.mark.parametrize("seed", range(2))
    def test_follows_a_density_jump(self, seed):
        points = uneven_sphere(2000, seed)
        adaptive = lengths(points)
        coarse, dense = (adaptive[side * points[:, 2] > 0.5].mean() for side in (-1.0, 1.0))
        assert 1.5 < coarse / dense < 3.3  # the spacing changes threefold, and the sphere bends

    def test_varies_slowly(self):
        for points, most in ((random_sphere(1000), 0.7), (uneven_sphere(1200), 1.0)):
            pairs = read_cloud(points, LaplacianOptions()).pairs
            assert np.abs(np.log(pairs.lengths[pairs.first] / pairs.lengths[pairs.second])).max() < most

    def test_a_change_of_density_leaves_the_operator_right(self):
        # Even points, of which one half has four times as many.
        few, many = fibonacci_sphere(750), fibonacci_sphere(3000)
        points = np.concatenate([few[few[:, 2] > 0.0], many[many[:, 2] < 0.0]])
        laplacian = core.build_laplacian(points)
        x = points[:, 0]
        assert np.linalg.norm(laplacian.apply(x) + 2.0 * x) < 5e-2 * np.linalg.norm(2.0 * x)
        values = laplacian.eigenpairs(36).eigenvalues[1:] / np.repeat([2.0, 6.0, 12.0, 20.0, 30.0], [3, 5, 7, 9, 11])
        assert np.abs(values - 1.0).mean() < 1e-3

    @pytest.mark.parametrize("ratio", [3, 5])
    def test_reach_across_rows(self, ratio):
        # Points denser along one direction: h is that of the other one, and the area and the modes are right.
        points = torus_rows(16, ratio)
        laplacian = core.build_laplacian(points)
        across = 2.0 * np.pi * 0.4 / 16
        assert np.all(laplacian.smoothing_lengths > 0.5 * across)  # 3 h is beyond the next row
        assert np.all(laplacian.smoothing_lengths < 2.0 * across)
        assert laplacian.component.max() == 0
        assert laplacian.areas.sum() == pytest.approx(torus_area(), rel=2e-2)

    def test_reaches_half_a_turn_around_a_bead_of_few_points(self):
        # The hundredth neighbor of its points lies far off on the sphere.
        points, bead, areas = beaded_sphere(0.05, 60)
        laplacian = core.build_laplacian(points)
        assert np.median(3.0 * laplacian.smoothing_lengths[bead]) < 1.3 * np.pi * 0.05
        assert laplacian.areas[bead].sum() == pytest.approx(areas[1], rel=0.15)
        assert laplacian.areas[~bead].sum() == pytest.approx(areas[0], rel=1e-3)

    def test_never_narrower_than_the_points_demand(self):
        points = torus_low_discrepancy(4000, minor=0.05)
        spacing = np.sqrt(torus_area(1.0, 0.05) / 4000)
        assert lengths(points).min() > 0.65 * spacing

    def test_widens_with_irregularity(self):
        spacing = np.sqrt(4.0 * np.pi / 1200)
        even, random = (lengths(sphere(1200)).mean() / spacing for sphere in (fibonacci_sphere, random_sphere))
        assert random > 1.5 * even

    def test_no_other_at_the_boundary_of_a_grid(self):
        points = square_grid(40)
        adaptive = lengths(points)
        middle = np.abs(points[:, :2] - 0.5).max(axis=1) < 0.25
        np.testing.assert_allclose(adaptive, adaptive[middle].mean(), rtol=0.04)

    def test_hardly_any_other_at_the_boundary_of_a_random_square(self):
        points = square_random(1200)
        adaptive = lengths(points)
        middle = np.abs(points[:, :2] - 0.5).max(axis=1) < 0.25
        mean = adaptive[middle].mean()
        assert adaptive[~middle].mean() == pytest.approx(mean, rel=0.1)
        np.testing.assert_allclose(adaptive, mean, rtol=0.5)
        # Without the boundary, neighbourhoods there would look sparse.
        unaware = lengths(points, boundary="off")
        assert unaware.max() > 1.1 * unaware[middle].mean()

    def test_narrower_in_a_narrow_surface(self):
        narrow = lengths(10.5 * square_random(110, 1))  # ten spacings
        assert narrow.max() < 0.3 * 10.5
        assert narrow.min() > 1.2

    def test_a_factor_scales_them_where_no_point_asks_for_more(self):
        points = fibonacci_sphere(900)
        np.testing.assert_allclose(lengths(points, bandwidth_factor=1.7), 1.7 * lengths(points), rtol=0.05)

    def test_a_factor_leaves_less_to_ask_for(self):
        points = random_sphere(900)
        narrow, wide = lengths(points), lengths(points, bandwidth_factor=1.7)
        assert 1.2 < wide.mean() / narrow.mean() < 1.7
        assert spread(wide) < 0.7 * spread(narrow)

    def test_the_number_of_neighbors_is_not_theirs(self):
        points = random_sphere(1000)
        np.testing.assert_array_equal(lengths(points, neighbors=50), lengths(points))


class TestAny:
    @pytest.mark.parametrize("bandwidth", ["adaptive", "local", "global"])
    def test_pairs_are_those_within_three_mean_lengths(self, bandwidth):
        options = LaplacianOptions(bandwidth=bandwidth, sheets=False)
        pairs = read_cloud(uneven_sphere(450), options).pairs
        reach = 3.0 * pairs.mean(pairs.lengths)
        assert np.all(pairs.distance <= reach * (1.0 + 1e-12))
        between = np.linalg.norm(pairs.points[:, None] - pairs.points, axis=2)
        inside = between <= 1.5 * (pairs.lengths[:, None] + pairs.lengths)
        assert len(pairs.first) == (np.count_nonzero(inside) - len(inside)) // 2
        assert len({frozenset(pair) for pair in zip(pairs.first.tolist(), pairs.second.tolist(), strict=True)}) == len(
            pairs.first
        )

    @pytest.mark.parametrize("bandwidth", ["local", "global"])
    def test_free_of_units_position_and_order(self, bandwidth):
        points = uneven_sphere(600)
        order = np.random.default_rng(1).permutation(len(points))
        turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
        before = lengths(points, bandwidth=bandwidth)
        moved = lengths((17.0 * points @ turn + 5.0)[order], bandwidth=bandwidth)
        np.testing.assert_allclose(moved, 17.0 * before[order], rtol=1e-9)
        np.testing.assert_allclose(lengths(1e-6 * points, bandwidth=bandwidth), 1e-6 * before, rtol=1e-9)

    def test_global_ones_are_all_the_same(self):
        assert np.ptp(lengths(uneven_sphere(900), bandwidth="global")) == 0.0
