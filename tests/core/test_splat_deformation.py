"""Gaussian splats on deformed surfaces: gradients, rigid moves, a bent bar, and pictures of it."""

import functools

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import core
from benchmarks.samplings import bar, bent_end, fibonacci_sphere, random_sphere
from core.splats.ellipsoids import matrices_of, quaternions_of
from core.splats.harmonics import harmonics
from tests.splat_renderer import render

LENGTH = 4.0
TURN = Rotation.from_rotvec([0.5, 1.0, -2.0]).as_matrix()
FRONT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


@functools.cache
def bar_operator():
    return core.build_laplacian(bar(12, 48)[0])


@functools.cache
def bound_bar():
    """The splats of a bar, and what deforms them."""
    laplacian, points = bar_operator(), bar_operator().points
    reach = 2.5 * LENGTH / 48
    fixed, moved = np.flatnonzero(points[:, 0] < reach), np.flatnonzero(points[:, 0] > LENGTH - reach)
    return splats_on(laplacian), core.deform.Deformer(laplacian, moved, fixed)


def splats_on(laplacian, degree=3):
    """Flat splats in the tangent planes, as large as the points are apart, with a colour field."""
    points, normals = laplacian.points, laplacian.normals
    tangent = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    frames = np.stack([tangent, np.cross(normals, tangent), normals], axis=2)
    rng = np.random.default_rng(3)
    spacing = np.sqrt(laplacian.areas)
    return core.splats.Splats(
        points,
        spacing[:, None] * np.column_stack([rng.uniform(0.3, 0.7, (len(points), 2)), np.full(len(points), 0.05)]),
        quaternions_of(np.moveaxis(frames, 0, 2)),
        rng.uniform(0.5, 1.0, len(points)),
        2.0 * np.sin(points @ rng.standard_normal((3, 3)) * 3.0),
        0.3 * rng.standard_normal((len(points), (degree + 1) ** 2 - 1, 3)),
    )


def test_gradients_of_similarities_are_these():
    for points in (random_sphere(800), bar(8, 32)[0]):
        laplacian = core.build_laplacian(points)
        for scale in (1.0, 0.01, 300.0):
            found = core.deform.deformation_gradients(laplacian, scale * points @ TURN.T + [5.0, -3.0, 8.0])
            np.testing.assert_allclose(found, np.tile(scale * TURN, (len(points), 1, 1)), atol=1e-10 * scale)


def test_noise_that_the_operator_smooths_leaves_gradients_of_a_turn_exact():
    rng = np.random.default_rng(0)
    points = random_sphere(1500) * rng.normal(1.0, 0.02, (1500, 1))
    laplacian = core.build_laplacian(points)
    assert np.abs(laplacian.surface_points - points).max() > 0.01
    low, high = np.flatnonzero(points[:, 2] < -0.8), np.flatnonzero(points[:, 2] > 0.8)
    found = core.deform.Deformer(laplacian, high, low).gradients(points @ TURN.T + 2.0)
    np.testing.assert_allclose(found, np.broadcast_to(TURN, found.shape), atol=1e-9)


def test_gradients_of_linear_maps_are_these_along_the_surface():
    linear = np.array([[1.3, 0.2, 0.0], [0.0, 0.8, 0.3], [0.1, 0.0, 1.1]])
    errors = []
    for count in (1000, 4000):
        points = random_sphere(count)
        found = core.deform.deformation_gradients(core.build_laplacian(points), points @ linear.T)
        along = np.eye(3) - points[:, :, None] * points[:, None]
        errors.append(np.sqrt(np.mean(np.sum(((found - linear) @ along) ** 2, axis=(1, 2)))))
        across = np.einsum("nab,nb->na", found, points)
        normal = points @ np.linalg.inv(linear)  # of the ellipsoid
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        np.testing.assert_allclose(across / np.linalg.norm(across, axis=1)[:, None], normal, atol=0.02)
    assert errors[0] < 4e-4
    assert errors[1] < 0.6 * errors[0]


def test_gradients_of_a_sheet_rolled_up_are_its_turns():
    points = np.random.default_rng(1).random((3000, 3)) * [2.0, 1.0, 0.0]
    angle = points[:, 0]
    rolled = np.column_stack([np.sin(angle), points[:, 1], 1.0 - np.cos(angle)])
    found = core.deform.deformation_gradients(core.build_laplacian(points), rolled)
    wanted = Rotation.from_rotvec(-angle[:, None] * [0.0, 1.0, 0.0]).as_matrix()
    assert np.median(np.abs(found - wanted).max(axis=(1, 2))) < 0.01
    assert np.quantile(np.abs(found - wanted).max(axis=(1, 2)), 0.99) < 0.05


@functools.cache
def with_floaters():
    points = np.concatenate([fibonacci_sphere(2000), [[0.0, 0.0, 2.0], [0.0, 1.8, 0.0], [0.0, 0.0, -1.9]]])
    return core.build_laplacian(points)


@pytest.mark.parametrize("count", [None, 500])
@pytest.mark.parametrize("aware", [True, False])
def test_points_of_no_surface_go_with_the_point_next_to_them(count, aware):
    laplacian = with_floaters()
    assert (laplacian.component[-3:] < 0).all()
    z = laplacian.points[:, 2]
    own = np.arange(2003) < 2000
    kind = core.deform.Deformer if count is None else functools.partial(core.deform.coarse_deformer, count=count)
    deformer = kind(laplacian, (z > 0.7) & own, rotation_aware=aware)
    turn = TURN if aware else np.eye(3)
    found = deformer.solve(laplacian.points[deformer.handles] @ turn.T + [1.0, 2.0, 3.0])
    np.testing.assert_allclose(found, laplacian.points @ turn.T + [1.0, 2.0, 3.0], atol=1e-8)
    gradients = deformer.gradients(found)
    np.testing.assert_allclose(gradients, np.tile(turn, (2003, 1, 1)), atol=1e-8)


def test_points_of_no_surface_stay_with_a_surface_that_stays():
    points = np.concatenate([fibonacci_sphere(800), fibonacci_sphere(800) + [5.0, 0, 0], [[5.0, 0, 2.0], [0, 0, 2.0]]])
    laplacian = core.build_laplacian(points)
    deformer = core.deform.Deformer(laplacian, np.arange(100))
    moved = deformer.solve(points[:100] + [0.0, 1.0, 0.0])
    np.testing.assert_allclose(moved[-2], points[-2])
    np.testing.assert_allclose(moved[-1], points[-1] + [0.0, 1.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("count", [None, 400])
def test_rigid_handles_turn_covariances_and_harmonics(count):
    splats, deformer = bound_bar()
    points, handles = deformer.points, np.concatenate([deformer.handles, deformer.anchors])
    kind = core.deform.Deformer if count is None else functools.partial(core.deform.coarse_deformer, count=count)
    free = kind(bar_operator(), handles)
    moved = free.solve(points[free.handles] @ TURN.T + [1.0, 2.0, 3.0])
    found = splats.deformed(moved, free.gradients(moved))
    np.testing.assert_allclose(found.covariances, TURN @ splats.covariances @ TURN.T, atol=1e-5 * 0.01)
    directions = np.random.default_rng(2).standard_normal((200, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    seen, before = (harmonics(way, 15) for way in (directions, directions @ TURN))
    np.testing.assert_allclose(seen @ found.harmonics, before @ splats.harmonics, atol=1e-5)


def bent_bar():
    splats, deformer = bound_bar()
    moved = deformer.solve(bent_end(deformer.points[deformer.handles], 0.5 * np.pi))
    return splats, splats.deformed(moved, deformer.gradients(moved))


def volumes(splats):
    """The areas of the ellipses of the two long axes."""
    ordered = np.sort(splats.scales, axis=1)
    return ordered[:, 1] * ordered[:, 2]


def test_a_bent_bar_keeps_its_volume_of_splats():
    before, after = bent_bar()
    assert abs(volumes(after).sum() / volumes(before).sum() - 1.0) < 0.03
    assert abs(np.prod(after.scales, axis=1).sum() / np.prod(before.scales, axis=1).sum() - 1.0) < 0.03


def gaps(splats, pairs):
    """How far the ellipses of the two long axes are apart at two standard deviations, on the way between centres."""
    way = splats.positions[pairs[:, 1]] - splats.positions[pairs[:, 0]]
    distance = np.linalg.norm(way, axis=1)
    axes = np.moveaxis(matrices_of(splats.rotations), 2, 0)
    for side in pairs.T:
        along = np.einsum("na,nak->nk", way, axes[side]) / splats.scales[side]
        shortest = np.argmin(splats.scales[side], axis=1)
        along[np.arange(len(side)), shortest] = 0.0
        distance = distance - 2.0 * np.linalg.norm(way, axis=1) / np.linalg.norm(along, axis=1)
    return distance


def test_no_gap_opens_between_the_splats_of_a_bent_bar():
    before, after = bent_bar()
    near = cKDTree(before.positions).query(before.positions, k=7)[1]
    pairs = np.column_stack([np.repeat(near[:, 0], 6), near[:, 1:].ravel()])
    old, new = gaps(before, pairs), gaps(after, pairs)
    distance = np.linalg.norm(np.diff(before.positions[pairs], axis=1)[:, 0], axis=1)
    assert np.count_nonzero(old > 0.0) > 20  # at the sharp edges, mostly
    assert (new - np.maximum(old, 0.0) < 0.1 * distance).all()


def test_pictures_turn_with_the_splats():
    """A camera that is turned as the splats are sees the same, colours that depend on the direction included."""
    splats, _ = bound_bar()
    camera = Rotation.from_rotvec([0.3, 0.2, 0.1]).as_matrix()  # no two splats are equally far
    maps = np.tile(2.0 * TURN, (len(splats), 1, 1))
    turned = splats.deformed(2.0 * splats.positions @ TURN.T + [1.0, 2.0, 3.0], maps)
    center = np.array([2.0, 0.0, 0.0])
    before = render(splats, camera, center, 5.0, (60, 100))
    after = render(turned, camera @ TURN.T, 2.0 * TURN @ center + [1.0, 2.0, 3.0], 10.0, (60, 100))
    np.testing.assert_allclose(after, before, atol=1e-6)
    assert np.ptp(before) > 0.5
    other = render(splats, camera @ TURN.T, center, 5.0, (60, 100))
    assert np.abs(other - before).max() > 0.3


def test_a_bent_bar_is_drawn_without_holes():
    """Where the surface is, the background is covered as well as before."""
    before, after = bent_bar()
    opaque = {"colors": np.full((len(before), 3), -2.0), "harmonics": np.zeros((len(before), 0, 3))}
    pictures = [
        render(
            core.splats.Splats(each.positions, each.scales, each.rotations, np.ones(len(each)), **opaque),
            FRONT,
            middle,
            5.0,
        )
        for each, middle in ((before, [2.0, 0.0, 0.0]), (after, [1.3, 0.0, 1.3]))
    ]
    straight, bent = (np.count_nonzero(picture[:, :, 0] < 0.5) for picture in pictures)
    assert 0.95 < bent / straight < 1.05
