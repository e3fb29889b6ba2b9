"""Outliers: points off the surface are left out, far ones and near ones, and clean surfaces lose none."""

import numpy as np
import pytest

import core
from benchmarks.samplings import (
    closed_plate,
    fibonacci_sphere,
    noisy_sphere,
    open_cylinder,
    parallel_sheets,
    random_sphere,
    sausage,
    square_grid,
    square_random,
    torus_points,
    uneven_sphere,
)
from core.geometry.nearest import find_nearest
from core.geometry.outliers import find_outliers

COUNT = 2000
SPACING = np.sqrt(4.0 * np.pi / COUNT)


def box_around(points, share, seed=2):
    """Points all over a box a fifth larger to each side, as a share of those given."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.2 * (high - low)
    return np.random.default_rng(seed).uniform(low - margin, high + margin, (int(share * len(points)), 3))


def layer_around(share, reach=0.1, seed=5):
    """Points nearer than the reach to the unit sphere, as a share of `COUNT`."""
    points = random_sphere(int(share * COUNT), seed)
    return points * (1.0 + np.random.default_rng(seed + 1).uniform(-reach, reach, (len(points), 1)))


def cube_random(count, seed=0):
    """Random points on the surface of a cube."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.0, 1.0, (count, 3))
    points[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-1.0, 1.0], count)
    return points


def cone_random(count, seed=0):
    """Random points on an open cone with a sharp tip."""
    rng = np.random.default_rng(seed)
    height, angle = np.sqrt(rng.random(count)), 2.0 * np.pi * rng.random(count)
    return np.column_stack([height * np.cos(angle) / 3.0, height * np.sin(angle) / 3.0, height])


def spheres_of_three_densities():
    return np.concatenate(
        [
            random_sphere(3000),
            0.8 * random_sphere(400, 1) + [2.5, 0.0, 0.0],
            0.1 * fibonacci_sphere(1500) + [0.0, 2.5, 0.0],
        ]
    )


CLEAN = {
    "even sphere": lambda: fibonacci_sphere(COUNT),
    "random sphere": lambda: random_sphere(COUNT),
    "density jump": lambda: uneven_sphere(8000, ratio=100.0),
    "torus": lambda: torus_points(COUNT),
    "thin torus": lambda: torus_points(2500, minor=0.03),
    "cube": lambda: cube_random(COUNT),
    "box": lambda: closed_plate(20, 8)[0],
    "plate": lambda: closed_plate(40)[0],
    "parallel sheets": lambda: parallel_sheets(25)[0],
    "bent capsule": lambda: sausage(2000, bent=True)[0],
    "cone": lambda: cone_random(COUNT),
    "cylinder": open_cylinder,
    "square": lambda: square_random(2500),
    "grid": lambda: square_grid(50),
    "three densities": spheres_of_three_densities,
    "slight noise": lambda: noisy_sphere(COUNT, 0.1),
    "noise": lambda: noisy_sphere(COUNT, 0.3),
    "few points": lambda: fibonacci_sphere(30),
}


@pytest.mark.parametrize("name", CLEAN)
def test_clean_surfaces_lose_next_to_nothing(name):
    points = np.unique(CLEAN[name](), axis=0)
    assert np.count_nonzero(find_outliers(find_nearest(points))) <= 5e-4 * len(points)


@pytest.mark.parametrize("height", [0.75, 1.5, 3.0, 20.0])
def test_a_lone_point_is_found_at_any_height(height):
    points = np.concatenate([random_sphere(COUNT), [[0.0, 0.0, 1.0 + height * SPACING]]])
    np.testing.assert_array_equal(np.flatnonzero(find_outliers(find_nearest(points))), [COUNT])


def test_what_is_within_the_noise_is_none():
    noisy = noisy_sphere(COUNT, 0.4)
    for height, found in ((1.0, False), (4.0, True)):
        points = np.concatenate([noisy, [[0.0, 0.0, 1.0 + height * SPACING]]])
        assert find_outliers(find_nearest(points))[-1] == found


@pytest.mark.parametrize("share", [0.01, 0.2])
def test_a_box_full_of_them_does_not_change_the_area(share):
    surface = random_sphere(COUNT)
    outliers = box_around(surface, share)
    far = np.abs(np.linalg.norm(outliers, axis=1) - 1.0) > 1.5 * SPACING
    laplacian = core.build_laplacian(np.concatenate([surface, outliers]))
    assert laplacian.areas.sum() == pytest.approx(4.0 * np.pi, rel=1e-2)
    assert np.all(laplacian.component[:COUNT] == 0)
    assert np.all(laplacian.component[COUNT:][far] == -1)


@pytest.mark.parametrize("share", [0.01, 0.1])
def test_a_layer_of_them_near_the_surface_does_not_change_the_area(share):
    laplacian = core.build_laplacian(np.concatenate([random_sphere(COUNT), layer_around(share)]))
    assert laplacian.areas.sum() == pytest.approx(4.0 * np.pi, rel=1e-2)
    assert np.all(laplacian.component[:COUNT] == 0)


def test_they_do_not_join_components():
    points = np.concatenate([random_sphere(1000), random_sphere(1000, 1) + [2.6, 0.0, 0.0]])
    laplacian = core.build_laplacian(np.concatenate([points, box_around(points, 0.1)]))
    np.testing.assert_array_equal(np.unique(laplacian.component), [-1, 0, 1])
    assert laplacian.areas.sum() == pytest.approx(8.0 * np.pi, rel=1e-2)


def test_a_notice_tells_how_many_and_their_share():
    surface = fibonacci_sphere(900)
    (notice,) = core.build_laplacian(np.concatenate([surface, 1.3 * surface[::9]])).notices
    assert notice.endswith("left out: 100 (10 %).")


def test_noise_is_measured_without_them():
    surface = noisy_sphere(COUNT, 0.3)
    alone, together = (
        next(float(notice.split()[2]) for notice in core.build_laplacian(points).notices if "Noise" in notice)
        for points in (surface, np.concatenate([surface, box_around(surface, 0.1)]))
    )
    assert together == pytest.approx(alone, abs=0.02)
