"""Boundaries: where the surface ends, how far from it the points are, and the images in it."""

import numpy as np
import pytest

import core
from benchmarks.samplings import (
    closed_plate,
    disc_eigenvalues,
    disc_random,
    fibonacci_sphere,
    grid_points,
    hemisphere_random,
    marching_cubes_sphere,
    noisy_sphere,
    open_cylinder,
    random_sphere,
    sausage,
    square_grid,
    square_random,
    torus_low_discrepancy,
    torus_points,
    uneven_sphere,
)
from core.geometry.arcs import arc_length
from core.geometry.bandwidth import mean_gaps
from core.geometry.boundary import _surrounded, find_boundary, measure_boundary, no_boundary
from core.geometry.cells import measure_cells
from core.geometry.cloud import read_cloud
from core.geometry.nearest import find_nearest
from core.operator.areas import KernelMatrix
from core.options import LaplacianOptions

CLOSED = {
    "random sphere": random_sphere(1500),
    "another random sphere": random_sphere(1500, 5),
    "marching cubes": marching_cubes_sphere(20),
    "density jump": uneven_sphere(2000),
    "random torus": torus_points(1500),
    "even torus": torus_low_discrepancy(1000),
    "thin torus": torus_points(2000, minor=0.15),
    "bent capsule": sausage(2000, bent=True)[0],
    "closed plate": closed_plate()[0],
}
UP = (0.0, 0.0, 1.0)


def flat_boundary(points):
    """Find and measure the boundary of points in the plane z = 0."""
    nearest, normals = find_nearest(points), np.tile(UP, (len(points), 1))
    cells = measure_cells(nearest, normals, np.zeros(len(points)), no_boundary(len(points)))
    at_boundary = find_boundary(nearest, normals, mean_gaps(nearest, cells.radius, 1))
    return measure_boundary(nearest, normals, at_boundary)


def side_distances(points, width, height):
    """Distances to the two nearest sides of a rectangle with a corner at the origin, (n, 2)."""
    x, y = points[:, 0], points[:, 1]
    return np.sort(np.column_stack([x, width - x, y, height - y]), axis=1)[:, :2]


def disc_of_rings(count):
    """Rings of points that all own the same area of the unit disc to a few percent, their areas, and distances."""
    points, areas = [], []
    for ring in range(count):
        around = round(2.0 * np.pi * (ring + 0.5))
        angle = 2.0 * np.pi * np.arange(around) / around + ring
        points.append((ring + 0.5) / count * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]))
        areas.append(np.full(around, np.pi * (2.0 * ring + 1.0) / count**2 / around))
    points = np.concatenate(points)
    return points, np.concatenate(areas), 1.0 - np.linalg.norm(points, axis=1)


def row_sums(cloud):
    """The kernel's integral around every point, images included, with exact areas of a unit grid."""
    matrix = KernelMatrix(cloud.pairs, arc_length(cloud), cloud.boundary)
    return matrix @ cloud_areas(cloud)


def cloud_areas(cloud):
    """Areas of grid points on a unit square, whose boundary points own half a cell and whose corners a quarter."""
    across = np.isclose(np.abs(cloud.scaled.points[:, :2]), np.abs(cloud.scaled.points[:, :2]).max())
    side = np.sqrt(len(across)) - 1.0
    return 0.5 ** across.sum(axis=1) / (side * cloud.scaled.scale) ** 2


class TestFinding:
    @pytest.mark.parametrize(("columns", "rows"), [(40, 25), (60, 60)])
    def test_the_whole_border_of_a_grid_and_nothing_else(self, columns, rows):
        points = grid_points(np.arange(columns), np.arange(rows), [0.0])
        distance = side_distances(points, columns - 1.0, rows - 1.0)[:, 0]
        np.testing.assert_array_equal(flat_boundary(points).at_boundary, distance == 0.0)

    def test_both_ends_of_a_cylinder(self):
        points = open_cylinder()
        cloud = read_cloud(points, LaplacianOptions())
        np.testing.assert_array_equal(cloud.boundary.at_boundary, np.abs(points[cloud.scaled.first, 2]) > 1.0 - 1e-9)

    def test_only_points_near_the_boundary_of_a_random_disc(self):
        points, distance = disc_random(2000)
        at_boundary = flat_boundary(points).at_boundary
        spacing = np.sqrt(np.pi / 2000)
        assert distance[at_boundary].max() < 4.0 * spacing
        # A boundary point in every stretch of four spacings.
        angle = np.sort(np.arctan2(points[at_boundary, 1], points[at_boundary, 0]))
        assert np.diff(np.append(angle, angle[0] + 2.0 * np.pi)).max() < 4.0 * spacing

    def test_the_boundary_of_a_hole(self):
        points = square_random(4200)
        center = np.linalg.norm(points - [0.5, 0.5, 0.0], axis=1)
        points, center = points[center > 0.15], center[center > 0.15]
        boundary = flat_boundary(points)
        around = boundary.at_boundary & (center < 0.3)
        assert np.count_nonzero(around) > 40
        assert center[around].max() < 0.15 + 4.0 / np.sqrt(4200)
        close = center < 0.2
        # The boundary of a hole bends the other way.
        assert np.median(boundary.curvature[close, 0]) == pytest.approx(-1.0 / 0.15, rel=0.2)

    @pytest.mark.parametrize("name", CLOSED)
    def test_none_on_closed_surfaces(self, name):
        assert np.count_nonzero(read_cloud(CLOSED[name], LaplacianOptions()).boundary.at_boundary) == 0

    @pytest.mark.parametrize("seed", range(1, 4))
    def test_none_where_a_dense_half_goes_on_as_a_sparse_one(self, seed):
        dense, sparse = random_sphere(12_000, seed), random_sphere(200, seed + 10)
        points = np.concatenate([dense[dense[:, 2] < 0.0], sparse[sparse[:, 2] >= 0.0]])
        assert not np.any(read_cloud(points, LaplacianOptions()).boundary.at_boundary)

    @pytest.mark.parametrize(("radius", "found"), [(2.0, False), (8.0, True)])
    def test_holes_that_are_wide_enough(self, radius, found):
        points = grid_points(np.arange(50.0), np.arange(50.0), [0.0])
        center = np.linalg.norm(points - [24.5, 24.5, 0.0], axis=1)
        at_boundary = flat_boundary(points[center > radius]).at_boundary
        assert np.any(at_boundary[center[center > radius] < 12.0]) == found

    @pytest.mark.parametrize("seed", range(2))
    def test_none_at_the_edge_of_a_thin_lens(self, seed):
        # Two caps that meet at an acute edge, and hardly bend elsewhere.
        rng = np.random.default_rng(seed)
        radius, angle = np.sqrt(rng.random(3000)), 2.0 * np.pi * rng.random(3000)
        height = 0.25 * (1.0 - radius**2) * np.where(np.arange(3000) % 2, 1.0, -1.0)
        points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
        assert not np.any(read_cloud(points, LaplacianOptions()).boundary.at_boundary)

    @pytest.mark.parametrize("level", [0.1, 0.5])
    def test_none_on_a_noisy_sphere(self, level):
        assert not np.any(read_cloud(noisy_sphere(1000, level), LaplacianOptions()).boundary.at_boundary)

    def test_switched_off(self):
        points = square_grid(18)
        off = read_cloud(points, LaplacianOptions(boundary="off")).boundary
        assert not np.any(off.at_boundary)
        assert np.all(np.isinf(off.distance))
        # Without images the unit integral makes areas too large at the boundary.
        assert core.estimate_areas(points, options=LaplacianOptions(boundary="off")).sum() > 1.05


class TestMeasuring:
    def test_distances_on_a_square_grid_to_both_sides_of_a_corner(self):
        points = grid_points(np.arange(40.0), np.arange(40.0), [0.0])
        boundary, exact = flat_boundary(points), side_distances(points, 39.0, 39.0)
        np.testing.assert_allclose(boundary.distance[:, 0], exact[:, 0], atol=0.1)
        second = np.isfinite(boundary.distance[:, 1])
        np.testing.assert_allclose(boundary.distance[second, 1], exact[second, 1], atol=0.1)
        assert np.all(second[exact[:, 1] <= 8.0])
        assert np.abs(boundary.curvature).max() < 1e-3
        across = boundary.outward[exact[:, 1] > exact[:, 0] + 1.0, 0]
        np.testing.assert_allclose(np.abs(across[:, :2]).max(axis=1), 1.0, atol=0.05)

    @pytest.mark.parametrize("side", [12, 16])
    def test_distances_on_a_small_square_grid(self, side):
        points = grid_points(np.arange(float(side)), np.arange(float(side)), [0.0])
        boundary, exact = flat_boundary(points), side_distances(points, side - 1.0, side - 1.0)
        np.testing.assert_allclose(boundary.distance, exact, atol=0.1)

    @pytest.mark.parametrize("seed", range(3))
    def test_distances_and_curvature_on_a_random_disc(self, seed):
        points, exact = disc_random(1400, seed)
        spacing = np.sqrt(np.pi / 1400)
        boundary = flat_boundary(points)
        near = exact < 8.0 * spacing
        error = (boundary.distance[near, 0] - exact[near]) / spacing
        assert abs(error.mean()) < 0.15
        assert np.sqrt(np.mean(error**2)) < 0.45
        assert np.median(boundary.curvature[near, 0]) == pytest.approx(1.0, abs=0.25)
        radial = points[near] / np.linalg.norm(points[near], axis=1)[:, None]
        assert np.einsum("ij,ij->i", boundary.outward[near, 0], radial).min() > 0.9

    @pytest.mark.parametrize("seed", range(2))
    def test_both_distances_on_a_random_square(self, seed):
        points = 60.0 * square_random(1800, seed)
        boundary, exact = flat_boundary(points), side_distances(points, 60.0, 60.0)
        near = exact[:, 0] < 8.0
        assert np.abs(boundary.distance[near, 0] - exact[near, 0]).mean() < 0.35
        corner = exact[:, 1] < 5.0
        assert np.mean(np.isfinite(boundary.distance[corner, 1])) > 0.9
        seen = np.isfinite(boundary.distance[:, 1])
        assert exact[seen, 1].max() < 30.0
        assert np.median(np.abs(boundary.distance[seen, 1] - exact[seen, 1])) < 0.5

    def test_distances_along_a_curved_surface(self):
        points = hemisphere_random(2000)
        cloud = read_cloud(points, LaplacianOptions())
        scaled = cloud.scaled
        exact = np.arcsin(points[scaled.first, 2])
        spacing = np.sqrt(2.0 * np.pi / 2000)
        near = exact < 8.0 * spacing
        error = (cloud.boundary.distance[near, 0] * scaled.scale - exact[near]) / spacing
        assert abs(error.mean()) < 0.15
        assert np.sqrt(np.mean(error**2)) < 0.45
        # The equator is a geodesic.
        assert abs(np.median(cloud.boundary.curvature[near, 0])) < 0.1

    def test_the_course_leads_no_further_than_its_points(self):
        points = square_grid(28)
        step = 1.0 / 39.0
        some = (points[:, 0] == 0.0) & (np.abs(points[:, 1] - 0.5) < 6.0 * step)
        nearest = find_nearest(points)
        boundary = measure_boundary(nearest, np.tile([0.0, 0.0, 1.0], (len(points), 1)), some)
        beside = np.abs(points[:, 1] - 0.5) < 5.0 * step
        near = beside & (points[:, 0] < 9.0 * step)
        np.testing.assert_allclose(boundary.distance[near, 0], points[near, 0], atol=1e-9)
        away = (points[:, 0] == 0.0) & (np.abs(points[:, 1] - 0.5) > 11.0 * step)
        assert away.sum() > 10
        assert not np.isfinite(boundary.distance[away]).any()

    def test_few_points_have_no_boundary(self):
        points = np.random.default_rng(0).random((200, 3)) * (1.0, 1.0, 0.0)
        nearest, normals = find_nearest(points), np.tile(UP, (200, 1))
        boundary = measure_boundary(nearest, normals, np.arange(200) < 3)
        assert not np.any(boundary.at_boundary)
        assert np.all(np.isinf(boundary.distance))


class TestImages:
    @pytest.fixture(scope="class")
    @classmethod
    def disc_sums(cls):
        """Integrals of the kernel with exact areas around the points near the boundary."""
        points, areas, distance = disc_of_rings(25)
        cloud = read_cloud(points, LaplacianOptions(), boundary_distance=distance)
        matrix = KernelMatrix(cloud.pairs, cloud.pairs.distance, cloud.boundary)
        sums = matrix @ (areas[cloud.scaled.first] / cloud.scaled.scale**2)
        near = cloud.boundary.distance[:, 0] < 3.0 * cloud.pairs.lengths
        return sums[near]

    @pytest.mark.parametrize("side", [28, 42])
    def test_they_complete_the_kernel_at_straight_boundaries_at_corners_and_between(self, side):
        cloud = read_cloud(square_grid(side), LaplacianOptions())
        np.testing.assert_allclose(row_sums(cloud), 1.0, atol=1.5e-2)

    def test_without_them_it_is_cut(self):
        cloud = read_cloud(square_grid(28), LaplacianOptions(boundary="off"))
        sums = row_sums(cloud)
        assert sums.min() < 0.4
        assert sums.max() == pytest.approx(1.0, abs=4e-2)

    def test_they_nearly_complete_it_at_curved_boundaries(self, disc_sums):
        np.testing.assert_allclose(disc_sums, 1.0, atol=0.03)

    @pytest.mark.parametrize("wide", [6, 10, 14])
    def test_both_boundaries_of_a_strip(self, wide):
        points = grid_points(np.arange(wide + 1.0), np.arange(80.0), [0.0])
        assert core.estimate_areas(points).sum() == pytest.approx(79.0 * wide, rel=0.12)

    def test_areas_of_a_grid_are_even_up_to_its_boundary(self, operators):
        laplacian = operators("square grid")
        areas, sides = laplacian.areas * 59.0**2, (side_distances(laplacian.points, 1.0, 1.0) < 1e-9).sum(axis=1)
        assert 0.4 < areas[sides > 0].mean() < 0.75
        assert areas[sides == 0].mean() == pytest.approx(1.0, rel=0.05)
        ratio = areas / 0.5**sides
        assert ratio.min() > 0.3
        assert ratio.max() < 3.0

    @pytest.mark.parametrize("given", [True, False], ids=["boundary given", "boundary found"])
    def test_few_areas_of_a_random_disc_are_near_the_floor(self, given):
        points, distance = disc_random(1000)
        areas = core.estimate_areas(points, boundary_distance=distance if given else None)
        assert np.mean(areas < 0.1 * areas.mean()) < 0.05
        assert areas.max() < 6.0 * areas.mean()


class TestGiven:
    def test_the_boundary_that_would_be_found_changes_nothing_as_a_mask_or_as_indices(self):
        points = square_random(900)
        found = core.build_laplacian(points)
        for boundary in (found.boundary, np.flatnonzero(found.boundary)):
            given = core.build_laplacian(points, boundary=boundary)
            np.testing.assert_array_equal(given.boundary, found.boundary)
            np.testing.assert_array_equal(given.areas, found.areas)
            np.testing.assert_array_equal(given.stiffness.data, found.stiffness.data)

    def test_a_given_boundary_wins_over_the_options(self):
        points = square_grid(21)
        border = side_distances(points, 1.0, 1.0)[:, 0] < 1e-9
        options = LaplacianOptions(boundary="off")
        laplacian = core.build_laplacian(points, options=options, boundary=border)
        np.testing.assert_array_equal(laplacian.boundary, border)
        assert laplacian.areas.sum() == pytest.approx(1.0, rel=2e-2)

    def test_a_given_boundary_is_the_same_without_other_options(self):
        points = hemisphere_random(700)
        boundary = core.build_laplacian(points).boundary
        options = LaplacianOptions(boundary="off", sheets=False)
        areas = core.estimate_areas(points, options=options, boundary=boundary)
        np.testing.assert_allclose(areas, core.estimate_areas(points, boundary=boundary), rtol=1e-6)

    def test_no_points_mean_no_boundary(self):
        expected = core.estimate_areas(square_grid(30), options=LaplacianOptions(boundary="off"))
        for empty in ([], np.zeros(900, dtype=bool), np.zeros(0, dtype=int)):
            laplacian = core.build_laplacian(square_grid(30), boundary=empty)
            assert not np.any(laplacian.boundary)
            np.testing.assert_array_equal(laplacian.areas, expected)

    def test_exact_distances_give_the_eigenvalues_of_the_disc(self):
        points, distance = disc_random(2100, 3)
        laplacian = core.build_laplacian(points, boundary_distance=distance)
        values = laplacian.eigenpairs(13).eigenvalues
        np.testing.assert_allclose(values[1:], disc_eigenvalues(13)[1:], rtol=1e-2)
        assert np.abs(values[1:] / disc_eigenvalues(13)[1:] - 1.0).mean() < 3e-3
        spacing = np.sqrt(np.pi / 2100)
        assert np.all(distance[laplacian.boundary] < spacing)
        assert np.all(laplacian.boundary[distance < 0.2 * spacing])

    def test_distances_beyond_reach_may_be_infinite(self):
        points, distance = disc_random(600)
        areas = core.estimate_areas(points, boundary_distance=distance)
        cut = core.estimate_areas(points, boundary_distance=np.where(distance < 0.5, distance, np.inf))
        assert cut.sum() == pytest.approx(np.pi, rel=5e-3)
        assert cut.sum() == pytest.approx(areas.sum(), rel=1e-3)

    def test_infinite_distances_mean_no_boundary(self):
        points, _ = disc_random(900)
        np.testing.assert_array_equal(
            core.estimate_areas(points, boundary_distance=np.full(900, np.inf)),
            core.estimate_areas(points, options=LaplacianOptions(boundary="off")),
        )

    def test_distances_scale_with_the_points(self):
        points, distance = disc_random(700)
        areas = core.estimate_areas(points, boundary_distance=distance)
        scaled = core.estimate_areas(1e3 * points, boundary_distance=1e3 * distance)
        np.testing.assert_allclose(scaled, 1e6 * areas, rtol=1e-6)

    @pytest.mark.parametrize(
        "boundary", [[3, 600], [-601], [0.5, 1.5], np.zeros(599, dtype=bool), [[1, 2], [3, 4]], ["a"]]
    )
    def test_bad_boundaries(self, boundary):
        with pytest.raises(core.InvalidPointsError, match="below 600"):
            core.build_laplacian(fibonacci_sphere(600), boundary=boundary)

    @pytest.mark.parametrize(
        "distance", [np.zeros(599), np.full(600, -1e-3), np.full(600, np.nan), np.zeros((600, 1)), ["near"] * 600, 0.1]
    )
    def test_bad_distances(self, distance):
        with pytest.raises(core.InvalidPointsError, match="600 numbers"):
            core.build_laplacian(fibonacci_sphere(600), boundary_distance=distance)

    def test_too_few_points_of_a_boundary_are_refused(self):
        with pytest.raises(core.InvalidPointsError, match="given by 3 different points"):
            core.build_laplacian(square_grid(18), boundary=[0, 1, 2])


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.0])
def test_points_in_all_eighths_leave_no_gap_of_90_degrees(turn):
    angles = np.random.default_rng(2).uniform(0.0, 2.0 * np.pi, (4000, 14)) + turn
    surrounded = _surrounded(np.array([np.cos(angles), np.sin(angles)]), np.ones(angles.shape, dtype=bool))
    ordered = np.sort(angles % (2.0 * np.pi), axis=1)
    gap = np.diff(ordered, axis=1, append=ordered[:, :1] + 2.0 * np.pi).max(axis=1)
    assert surrounded.any()
    assert gap[surrounded].max() < 0.5 * np.pi
    assert surrounded[gap < 0.24 * np.pi].all()
