"""How wide kernels are: the least error that any weights around a point leave, and the width chosen by it."""

import numpy as np
import pytest
from numpy.linalg import norm

import core
from benchmarks.samplings import fibonacci_sphere, grid_points, random_sphere
from core.geometry import bandwidth
from core.geometry.boundary import given_boundary, no_boundary
from core.geometry.cloud import read_cloud
from core.geometry.moments import least_error
from core.geometry.nearest import find_nearest
from core.kernel import pair_kernel
from core.options import LaplacianOptions

SIDE = 21  # points of a grid, whose middle has whole neighbourhoods
STEPS = np.arange(SIDE) - SIDE // 2
GRID = grid_points(STEPS, STEPS, [0.0])
UP = [0.0, 0.0, 1.0]
H = 0.764  # that of the narrowest kernel on a grid of spacing 1
MET = 1e-3


def error_of(points, normals=UP, h=H, areas=1.0, rows=None, distance=None):
    """The least error around some points, or all; of areas alike, with a boundary at these distances if given."""
    count = len(points)
    nearest, normals = find_nearest(points), np.array(np.broadcast_to(normals, (count, 3)), dtype=float)
    boundary = no_boundary(count) if distance is None else given_boundary(nearest, normals, distance)
    rows = np.arange(count) if rows is None else rows
    return least_error(nearest, normals, np.full(count, areas), boundary, np.full(count, h), rows)


def plain_error(points, h, areas, row):
    """The error of the kernel's own weights around a point of the plane z = 0."""
    offset = (points - points[row])[:, :2] / h
    distance = norm(offset, axis=1)
    near = (distance > 0.0) & (distance < 3.0)
    (x, y), weight = offset[near].T, pair_kernel(distance[near]) * areas / (4.0 * h**2)
    terms = np.array([x**2 + y**2, x, y, x**2 - y**2, 2.0 * x * y])
    return norm(terms @ weight - [1.0, 0.0, 0.0, 0.0, 0.0])


def inner(points, share=0.5):
    return np.flatnonzero(np.abs(points[:, :2]).max(axis=1) < share * np.abs(points[:, :2]).max())


def random_square(count, seed=0):
    """Random points of a square around the origin, of density 1."""
    points = np.zeros((count, 3))
    points[:, :2] = np.sqrt(count) * np.random.default_rng(seed).uniform(-0.5, 0.5, (count, 2))
    return points


class TestLeastError:
    def test_none_where_exact_weights_exist(self):
        assert error_of(GRID, rows=inner(GRID)).max() < MET
        sphere = fibonacci_sphere(2000)
        spacing = np.sqrt(4.0 * np.pi / 2000)
        # Away from the poles, where a Fibonacci sphere is uneven.
        rows = np.flatnonzero(np.abs(sphere[:, 2]) < 0.9)
        found = error_of(sphere, sphere, 0.8 * spacing, spacing**2, rows)
        assert np.mean(found < 3e-3) > 0.9

    def test_large_where_all_points_lie_on_one_side(self):
        at_edge = np.flatnonzero((GRID[:, 0] == STEPS[0]) & (np.abs(GRID[:, 1]) < 5.0))
        assert error_of(GRID, rows=at_edge).min() > 0.2

    def test_large_where_all_points_lie_in_a_row(self):
        rows = GRID * [1.0, 4.0, 1.0]
        assert error_of(rows, rows=inner(GRID)).min() > 0.2

    def test_of_a_half_plane_is_none_with_images_in_its_boundary(self):
        # The boundary is half a spacing off the first points, so that their images continue the grid.
        distance = GRID[:, 0] - STEPS[0] + 0.5
        near = np.flatnonzero((distance < 3.0) & (np.abs(GRID[:, 1]) < 5.0))
        assert error_of(GRID, rows=near, distance=distance).max() < 1e-2
        assert error_of(GRID, rows=near[distance[near] < 1.0]).min() > 0.2

    def test_no_more_than_that_of_the_kernels_own_weights(self):
        points = random_square(900)
        rows = inner(points)
        found = error_of(points, h=1.1, rows=rows)
        plain = np.array([plain_error(points, 1.1, 1.0, row) for row in rows])
        assert np.all(found < plain + 1e-5)
        assert np.mean(found) < 0.5 * np.mean(plain)

    def test_falls_with_the_width_in_a_plane(self):
        points = random_square(1600, 1)
        narrow, wide = (error_of(points, h=h, rows=inner(points)).mean() for h in (0.8, 1.6))
        assert wide < 0.2 * narrow

    @pytest.mark.parametrize("scale", [1.0, 1e-3, 1e3])
    def test_free_of_units_position_and_order(self, scale):
        points = random_square(500, 2)
        turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
        order = np.random.default_rng(1).permutation(len(points))
        moved = scale * (points @ turn.T + [7.0, -3.0, 2.0])[order]
        found = error_of(moved, turn @ UP, scale * H, scale**2)
        np.testing.assert_allclose(found, error_of(points)[order], rtol=2e-3, atol=2e-4)

    def test_the_sign_of_normals_does_not_matter(self):
        points = random_sphere(400)
        flipped = points * np.random.default_rng(0).choice([-1.0, 1.0], (400, 1))
        found = (error_of(points, normals, 0.2, 4.0 * np.pi / 400) for normals in (points, flipped))
        np.testing.assert_allclose(*found, rtol=2e-3, atol=2e-4)

    def test_of_rows_is_that_of_all(self):
        points, rows = random_square(300, 3), np.array([5, 200, 17])
        np.testing.assert_allclose(error_of(points, rows=rows), error_of(points)[rows], rtol=1e-4, atol=1e-6)


@pytest.fixture
def widening(monkeypatch):
    """Function from points to the factor by which each one's h is wider than the narrowest."""

    def measure(points, **options):
        found = []
        for narrowest in (False, True):
            with monkeypatch.context() as patched:
                if narrowest:
                    patched.setattr(bandwidth, "least_error", lambda *given: np.zeros(len(given[-1])))
                cloud = read_cloud(points, LaplacianOptions(**options))
                found.append(cloud.scaled.scatter(cloud.pairs.lengths, np.nan))
        return found[0] / found[1]

    return measure


class TestWidths:
    def test_even_points_stay_at_the_narrowest(self, widening):
        assert widening(GRID)[inner(GRID)].max() < 1.001
        sphere = fibonacci_sphere(3000)
        assert np.mean(widening(sphere)) < 1.01

    def test_random_points_are_wider_within_bounds(self, widening):
        found = widening(random_sphere(3000))
        assert 1.1 < found.mean() < 2.0
        assert found.max() <= 1.3**3 + 1e-9

    @pytest.mark.parametrize("radius", [4.0, 6.0])
    def test_a_bent_surface_is_no_wider_than_a_flat_one(self, widening, radius):
        flat = random_square(1200)
        turn = flat[:, 0] / radius
        kept = np.abs(turn) < 0.8 * np.pi  # rolled up, it does not meet itself
        flat, turn = flat[kept], turn[kept]
        bent = np.stack([radius * np.sin(turn), flat[:, 1], radius * np.cos(turn)], axis=1)
        rows = inner(flat)
        assert widening(bent)[rows].mean() < widening(flat)[rows].mean()

    @pytest.mark.parametrize(("sphere", "pairs", "margin"), [(random_sphere, 54, 8), (fibonacci_sphere, 22, 3)])
    def test_pairs_a_row(self, sphere, pairs, margin):
        laplacian = core.build_laplacian(sphere(4000))
        assert laplacian.stiffness.nnz / 4000 - 1.0 == pytest.approx(pairs, abs=margin)
