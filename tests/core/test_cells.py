"""Voronoi cells within the surface."""

import numpy as np
import pytest

import core
from benchmarks.samplings import (
    fibonacci_sphere,
    grid_points,
    random_sphere,
    square_grid,
    square_random,
    torus_area,
    torus_points,
    uneven_sphere,
)
from core.geometry.boundary import no_boundary
from core.geometry.cells import _intersect, measure_cells
from core.geometry.cloud import read_cloud, read_surface
from core.geometry.nearest import find_nearest
from core.options import LaplacianOptions


def cell_areas(points, **settings):
    """Areas of the cells of the caller's points, in their unit."""
    cloud = read_cloud(points, LaplacianOptions(**settings))
    return cloud.scaled.scatter(cloud.cell_areas * cloud.scaled.scale**2, 0.0)


@pytest.mark.parametrize(
    ("points", "exact", "most"),
    [
        (random_sphere(2800), 4.0 * np.pi, 2e-5),
        (fibonacci_sphere(2800), 4.0 * np.pi, 2e-5),
        (uneven_sphere(2800), 4.0 * np.pi, 1e-3),
        (torus_points(2800), torus_area(), 2e-3),
        (square_grid(33), 1.0, 1e-3),
        (square_random(1800), 1.0, 1.5e-2),
    ],
    ids=["random sphere", "even sphere", "density jump", "torus", "grid", "random square"],
)
def test_cells_tile_the_surface(points, exact, most):
    areas = cell_areas(points)
    assert areas.min() > 0.0
    assert areas.sum() == pytest.approx(exact, rel=most)


def test_cells_of_a_grid_are_its_squares():
    points = square_grid(30)
    inner = np.abs(points[:, :2] - 0.5).max(axis=1) < 0.4
    np.testing.assert_allclose(cell_areas(points)[inner], 1.0 / 29.0**2, rtol=1e-3)


@pytest.mark.parametrize("ratio", [9, 30])
def test_a_jump_of_density_leaves_no_gap(ratio):
    # The forty neighbors of a point next to the jump are all on the denser side.
    dense, few = random_sphere(9_000, 1), random_sphere(9_000 // ratio, 2)
    points = np.concatenate([dense[dense[:, 2] < 0.0], few[few[:, 2] > 0.0]])
    assert cell_areas(points).sum() == pytest.approx(4.0 * np.pi, rel=1e-2)


def test_points_that_smoothing_brings_together_have_cells():
    grid = np.stack(np.meshgrid(*[np.arange(4.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    assert (cell_areas(grid, sheets=False, neighbors=20, bandwidth_factor=1.0) > 1e-3).all()


def test_the_reach_is_that_of_the_wider_spacing():
    # Rows four times finer along than across.
    x, y = np.meshgrid(np.arange(160) / 4.0, np.arange(40.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    cloud = read_cloud(points, LaplacianOptions())
    inner = (np.abs(points[:, 0] - 20.0) < 10.0) & (np.abs(points[:, 1] - 20.0) < 10.0)
    reach = 0.5 * np.hypot(1.0, 0.25)
    lengths = cloud.scaled.scatter(cloud.pairs.lengths * cloud.scaled.scale, 0.0)
    np.testing.assert_allclose(lengths[inner], 1.08 * reach, rtol=1e-3)


def test_curvature_makes_cells_smaller_than_in_the_plane():
    points = random_sphere(300)
    surface = read_surface(points, LaplacianOptions(), lambda *_: None)[1]
    sample, quadrics = surface.sample, surface.quadrics
    curved, flat = (
        measure_cells(sample.nearest, quadrics.normals, k, no_boundary(300), sample.component).areas.sum()
        * sample.scaled.scale**2
        for k in (quadrics.gaussian_curvature, np.zeros(300))
    )
    assert curved == pytest.approx(4.0 * np.pi, rel=2e-3)
    assert flat > 4.0 * np.pi * 1.005


def test_without_neighbors_a_cell_ends_a_spacing_away():
    areas = cell_areas(square_grid(20), boundary="off")
    assert 1.0 < areas.sum() < (1.0 + 2.6 / 19.0) ** 2
    assert areas.max() < 4.0 / 19.0**2


def test_a_point_that_no_neighbor_cuts_has_no_closed_cell():
    areas, corner, closed = _intersect(np.zeros((1, 6, 2)), np.zeros(1), np.inf)
    assert not closed.any()
    assert areas.tolist() == [0.0]
    assert corner.tolist() == [[0.0, 0.0]]


def test_trust_is_low_where_the_points_do_not_tell():
    sphere = core.build_laplacian(random_sphere(1000))
    assert sphere.trust.min() > 0.9
    assert not any("LaplaceBeltrami.doubt" in notice for notice in sphere.notices)
    # A bar so thin that the neighbors of most points lie on several of its sides.
    bar = np.random.default_rng(0).uniform(0.0, 1.0, (600, 3))
    bar[np.arange(600), 1 + np.arange(600) % 2] = np.arange(600) // 2 % 2
    laplacian = core.build_laplacian(bar * [1.0, 0.03, 0.03])
    known = laplacian.component >= 0
    assert np.average(laplacian.trust[known], weights=laplacian.areas[known]) < 0.8
    assert np.all(laplacian.trust[~known] == 0.0)
    assert any("LaplaceBeltrami.doubt" in notice for notice in laplacian.notices)


def test_measured_alone():
    cloud = read_cloud(fibonacci_sphere(600), LaplacianOptions())
    nearest = find_nearest(cloud.pairs.points)
    cells = measure_cells(nearest, cloud.normals, np.ones(600), cloud.boundary)
    np.testing.assert_allclose(cells.areas, cloud.cell_areas, rtol=1e-2)
    assert np.all(cells.radius > 0.5 * nearest.spacing)
    assert np.all(cells.radius < nearest.spacing)


def test_cells_of_a_small_component_end_near_its_points():
    # A strip that bends around a place with no points, seen whole in one look at more neighbours, and a sheet far away.
    angle, radius = np.meshgrid(np.linspace(0.0, 0.5 * np.pi, 48), np.arange(30.0, 33.0))
    strip = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle], axis=2).reshape(-1, 3)
    sheet = grid_points(np.arange(40.0), np.arange(40.0), [0.0]) + [200.0, 0.0, 0.0]
    points = np.concatenate([strip, sheet])
    nearest, component = find_nearest(points), np.repeat([1, 0], [len(strip), len(sheet)])
    count = len(points)
    cells = measure_cells(nearest, np.tile([0.0, 0.0, 1.0], (count, 1)), np.zeros(count), no_boundary(count), component)
    assert cells.radius.max() < 3.0
