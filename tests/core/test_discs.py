"""Discs for drawing: they cover the surface, are no larger than its gaps ask, and lie in the tangent planes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere, torus_points, uneven_sphere

SHAPES = {
    "sphere": (random_sphere, 4.0 * np.pi),
    "uneven sphere": (uneven_sphere, 4.0 * np.pi),
    "torus": (torus_points, 1.6 * np.pi**2),
}


def covered(points, radii, places):
    """Share of places that lie on the disc of one of the points near them."""
    distance, index = cKDTree(points).query(places, k=30)
    return np.mean((distance <= radii[index]).any(axis=1))


@pytest.mark.parametrize("name", SHAPES)
def test_they_cover_the_surface_and_not_much_more(name):
    sample, area = SHAPES[name]
    points = sample(4000)
    discs = core.surface.surface_discs(points)
    assert covered(points, 1.03 * discs.radii, sample(20_000, seed=7)) > 0.999
    assert covered(points, 0.8 * discs.radii, sample(20_000, seed=7)) < 0.99
    assert np.pi * np.sum(discs.radii**2) < 4.0 * area


def test_normals_point_outwards():
    points = random_sphere(1000)
    assert np.einsum("ij,ij->i", core.surface.surface_discs(points).normals, points).min() > 0.99


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_they_grow_with_the_points(scale):
    points = random_sphere(500)
    discs, others = core.surface.surface_discs(points), core.surface.surface_discs(scale * points)
    assert_allclose(others.radii, scale * discs.radii, rtol=1e-9)
    assert_allclose(others.normals, discs.normals, atol=1e-9)


def test_a_linear_map_takes_them_to_those_of_the_mapped_surface():
    linear = np.array([[1.3, 0.2, 0.0], [0.0, 0.8, 0.3], [0.1, 0.0, 1.1]])
    rng = np.random.default_rng(4)
    normals = rng.standard_normal((300, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    moved = core.surface.Discs(normals, rng.uniform(0.5, 2.0, 300)).deformed(np.tile(linear, (300, 1, 1)))
    wanted = normals @ np.linalg.inv(linear)
    assert_allclose(moved.normals, wanted / np.linalg.norm(wanted, axis=1)[:, None], atol=1e-12)
    # The largest stretch of all directions in the tangent plane.
    angle = np.linspace(0.0, np.pi, 2000)[:, None]
    for row in range(5):
        one = np.cross(normals[row], [0.3, 0.5, -0.8])
        one /= np.linalg.norm(one)
        ways = np.cos(angle) * one + np.sin(angle) * np.cross(normals[row], one)
        most = np.linalg.norm(ways @ linear.T, axis=1).max()
        given = core.surface.Discs(normals[row : row + 1], np.ones(1)).deformed(linear[None])
        assert_allclose(given.radii, most, rtol=1e-5)


def test_turns_and_scales_keep_them_and_lost_planes_keep_their_normals():
    normals, radii = random_sphere(50), np.ones(50)
    turn = Rotation.from_rotvec([0.5, 1.0, -2.0]).as_matrix()
    moved = core.surface.Discs(normals, radii).deformed(np.tile(3.0 * turn, (50, 1, 1)))
    assert_allclose(moved.normals, normals @ turn.T, atol=1e-12)
    assert_allclose(moved.radii, 3.0)
    lost = core.surface.Discs(normals, radii).deformed(np.zeros((50, 3, 3)))
    assert_allclose(lost.normals, normals)
    assert_allclose(lost.radii, 0.0)


def test_a_point_off_the_surface_gets_a_disc_like_the_others():
    points = np.vstack([random_sphere(800), [[9.0, 0.0, 0.0]]])
    discs = core.surface.surface_discs(points)
    assert_allclose(discs.normals[-1], [0.0, 0.0, 1.0])
    assert discs.radii[-1] == np.median(discs.radii[:-1])


def test_few_points_are_enough():
    assert np.isfinite(core.surface.surface_discs(random_sphere(7)).radii).all()
    with pytest.raises(core.TooFewPointsError):
        core.surface.surface_discs(random_sphere(6))


def even_torus(count):
    """A grid around a torus as of `torus_points`."""
    wide = round(np.sqrt(2.5 * count))
    u, v = (2.0 * np.pi * np.arange(steps) / steps for steps in (wide, round(count / wide)))
    u, v = (values.ravel() for values in np.meshgrid(u, v))
    return np.stack([(1.0 + 0.4 * np.cos(v)) * np.cos(u), (1.0 + 0.4 * np.cos(v)) * np.sin(u), 0.4 * np.sin(v)], axis=1)


def half(points):
    return points[points[:, 2] > 0.0]


def jittered_half_sphere():
    points = fibonacci_sphere(4000)
    points += 0.2 * np.sqrt(4.0 * np.pi / 4000) * np.random.default_rng(4).uniform(-1.0, 1.0, points.shape)
    return half(points / np.linalg.norm(points, axis=1)[:, None])


def grid_of_a_wave(jitter=0.0):
    places = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 45)] * 2), axis=-1).reshape(-1, 2)
    places = places + jitter / 22.0 * np.random.default_rng(2).uniform(-1.0, 1.0, places.shape)
    return np.column_stack([places, 0.1 * np.sin(4.0 * places[:, 0])])


def below_equator(places):
    return -places[..., 2]


def outside_square(places):
    return np.abs(places[..., :2]).max(axis=-1) - 1.0


# Points, their spacing, how far places are beyond the edge, and how far discs may be: points are jittered across it.
OPEN = {
    "even half sphere": (lambda: half(fibonacci_sphere(4000)), np.sqrt(4.0 * np.pi / 4000), below_equator, 1.05),
    "jittered half sphere": (jittered_half_sphere, np.sqrt(4.0 * np.pi / 4000), below_equator, 1.05),
    "random half sphere": (lambda: half(random_sphere(8000)), np.sqrt(4.0 * np.pi / 8000), below_equator, 1.3),
    "grid": (grid_of_a_wave, 1.0 / 22.0, outside_square, 1.05),
    "jittered grid": (lambda: grid_of_a_wave(0.2), 1.0 / 22.0, outside_square, 1.25),
    "in millimeters": (lambda: 1e3 * grid_of_a_wave(0.2), 1e3 / 22.0, lambda q: 1e3 * outside_square(q / 1e3), 1.25),
}


def rims(points, discs):
    """Places all around the discs, (n, 48, 3)."""
    axes = core.geometry.frames(discs.normals)[:, :, 1:]
    angle = 2.0 * np.pi * np.arange(48) / 48.0
    ways = np.einsum("nca,ak->nkc", axes, np.stack([np.cos(angle), np.sin(angle)]))
    return points[:, None] + discs.radii[:, None, None] * ways


@pytest.mark.parametrize("name", OPEN)
def test_they_end_within_a_spacing_of_an_open_edge(name):
    make, spacing, beyond, most = OPEN[name]
    points = make()
    for discs in (core.surface.surface_discs(points), analyzed(points)):
        past = beyond(rims(points, discs)).max(axis=1) / spacing
        # Of random points single ones next to the edge have discs that cover empty places further inside.
        assert np.mean(past > most) <= (0.001 if "random" in name else 0.0)
        assert past.max() < 1.6


def analyzed(points):
    """Discs as the operator knows them, drawn after an analysis."""
    laplacian = core.build_laplacian(points)
    return core.surface.Discs(laplacian.normals, laplacian.disc_radii)


def bush(seed=1):
    rng = np.random.default_rng(seed)
    return np.concatenate([grid_of_a_wave(0.2), rng.uniform([-0.3, -0.3, 0.1], [0.3, 0.3, 0.6], (150, 3))])


def dense_and_sparse():
    dense, sparse = fibonacci_sphere(12_000), fibonacci_sphere(240)
    return np.concatenate([half(dense), sparse[sparse[:, 2] <= 0.0]])


@pytest.mark.parametrize("find", [core.surface.surface_discs, analyzed])
@pytest.mark.parametrize("make", [bush, dense_and_sparse, jittered_half_sphere, lambda: uneven_sphere(4000)])
def test_none_is_larger_than_three_spacings_of_its_neighborhood(find, make):
    points = make()
    distance, index = cKDTree(points).query(points, k=13)
    spacing = core.geometry.spacing_of(distance)[index].max(axis=1)
    assert (find(points).radii <= 3.001 * spacing).all()


@pytest.mark.parametrize(
    ("points", "places"),
    [
        (random_sphere(3000), random_sphere(20_000, seed=7)),
        (fibonacci_sphere(3000), random_sphere(20_000, seed=7)),
        (torus_points(3000), torus_points(20_000, seed=7)),
        (even_torus(3000), torus_points(20_000, seed=7)),
        (dense_and_sparse(), random_sphere(20_000, seed=7)),
    ],
    ids=["random sphere", "even sphere", "random torus", "even torus", "seven times as dense"],
)
def test_nothing_of_a_closed_surface_is_left_uncovered(points, places):
    assert covered(points, 1.1 * core.surface.surface_discs(points).radii, places) == 1.0  # as large as they are drawn


def test_they_turn_with_the_points():
    points, turn = jittered_half_sphere(), Rotation.from_rotvec([0.5, 1.0, -2.0]).as_matrix()
    assert_allclose(
        core.surface.surface_discs(points @ turn.T).radii, core.surface.surface_discs(points).radii, rtol=1e-6
    )


def test_points_left_out_get_no_discs_wider_than_their_spacing_asks():
    rng = np.random.default_rng(0)
    clump = [0.0, 0.0, 3.0] + 1e-4 * rng.standard_normal((5, 3))
    points = np.concatenate([random_sphere(800), clump])
    distance = cKDTree(points).query(points[-5:], k=13)[0]
    radii = core.surface.surface_discs(points).radii
    assert_allclose(radii[-5:], np.minimum(np.median(radii[:-5]), 3.0 * core.geometry.spacing_of(distance)))
