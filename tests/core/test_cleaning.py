"""Noise removed along normals: less of it, edges that stay, and nothing where there is none."""

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere

COUNT = 4000
SPACING = np.sqrt(24.0 / COUNT)  # on the cube


def cube(count=COUNT, seed=0):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.0, 1.0, (count, 3))
    points[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-1.0, 1.0], count)
    return points


def off_cube(points):
    """Distances from the surface of the cube."""
    beyond = np.abs(points) - 1.0
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.abs(np.minimum(beyond.max(axis=1), 0.0))


def rms(values):
    return np.sqrt(np.mean(values**2))


def noisy(points, size):
    return points + size * np.random.default_rng(1).standard_normal(points.shape)


@pytest.fixture(scope="module")
def noisy_cube():
    return core.build_laplacian(noisy(cube(), 0.3 * SPACING))


def test_edges_stay_where_smoothing_rounds_them(noisy_cube):
    before, clean = rms(off_cube(noisy_cube.points)), rms(off_cube(core.clean.clean_points(noisy_cube)))
    assert clean < 0.5 * before
    assert clean < 0.65 * rms(off_cube(core.clean.fair_points(noisy_cube)))


PLATE, NOISE = np.array([30.0, 20.0, 1.0]), 0.1


def plate(seed):
    """Return points of a plate, 60 x 40 x 2, with noise across it."""
    rng, count = np.random.default_rng(seed), 6000
    across = rng.choice(3, count, p=1.0 / PLATE / np.sum(1.0 / PLATE))
    points = rng.uniform(-1.0, 1.0, (count, 3)) * PLATE
    points[np.arange(count), across] = rng.choice([-1.0, 1.0], count) * PLATE[across]
    points[np.arange(count), across] += NOISE * rng.standard_normal(count)
    return points


def off_plate(points):
    beyond = np.abs(points) - PLATE
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.abs(np.minimum(beyond.max(axis=1), 0.0))


@pytest.mark.parametrize(("seed", "twice"), [(0, False), (1, True)])
def test_no_point_of_a_thin_plate_is_thrown_off_it(seed, twice):
    """At edges two spacings apart the normal of a point may be that of no neighbor."""
    points = plate(seed)
    if twice:
        points = np.concatenate([points, points[:1500] + 1e-6 * np.random.default_rng(9).standard_normal((1500, 3))])
    clean = core.clean.clean_points(core.build_laplacian(points))
    assert rms(off_plate(clean)) < 0.8 * rms(off_plate(points))
    assert np.linalg.norm(clean - points, axis=1).max() < 10.0 * NOISE
    assert np.mean(off_plate(clean) > off_plate(points) + 3.0 * NOISE) <= 1e-3


def test_points_move_along_one_direction_each_whatever_the_rounds(noisy_cube):
    """Without edges the direction is the normal of the operator."""
    moved = core.clean.clean_points(noisy_cube, keep_edges=False) - noisy_cube.points
    across = moved - np.einsum("ij,ij->i", moved, noisy_cube.normals)[:, None] * noisy_cube.normals
    assert np.abs(moved).max() > 0.1 * SPACING
    np.testing.assert_allclose(across, 0.0, atol=1e-12)


def test_a_sphere_without_noise_stays():
    """Circular arcs have no height over each other, though the sphere is curved."""
    points = fibonacci_sphere(1000)
    clean = core.clean.clean_points(core.build_laplacian(points), keep_edges=False)
    np.testing.assert_allclose(clean, points, atol=2e-4)
    assert rms(np.linalg.norm(core.clean.clean_points(core.build_laplacian(points)), axis=1) - 1.0) < 1e-3


def test_noise_of_a_sphere_shrinks_to_a_quarter():
    points = random_sphere(3000)
    spacing = np.sqrt(4.0 * np.pi / 3000)
    clean = core.clean.clean_points(core.build_laplacian(noisy(points, 0.5 * spacing)))
    assert rms(np.linalg.norm(clean, axis=1) - 1.0) < 0.125 * spacing


def test_it_turns_moves_and_scales_with_the_points(noisy_cube):
    turn = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])
    other = core.clean.clean_points(core.build_laplacian(3.0 * noisy_cube.points @ turn.T + [1.0, 2.0, 3.0]))
    expected = 3.0 * core.clean.clean_points(noisy_cube) @ turn.T + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(other, expected, atol=1e-5)


def test_boundary_points_and_those_left_out_stay():
    points = random_sphere(2000)
    points = np.concatenate([noisy(points[points[:, 2] > -0.2], 0.01), [[0.0, 0.0, 3.0]]])
    laplacian = core.build_laplacian(points)
    stay = laplacian.boundary | (laplacian.component < 0)
    assert 20 < stay.sum() < 200
    moved = np.abs(core.clean.clean_points(laplacian, dirichlet=True) - points).max(axis=1)
    assert np.all(moved[stay] == 0.0)
    assert np.count_nonzero(moved[~stay] == 0.0) == 0
    assert np.abs(core.clean.clean_points(laplacian) - points)[laplacian.boundary].max() > 0.0


def test_switches_are_checked_and_the_work_can_be_stopped(noisy_cube):
    with pytest.raises(core.PointCloudError, match="keep_edges"):
        core.clean.clean_points(noisy_cube, keep_edges=1)

    def progress(stage, share):
        if stage == "Heights":
            raise core.Cancelled

    with pytest.raises(core.Cancelled):
        core.clean.clean_points(noisy_cube, progress=progress)
