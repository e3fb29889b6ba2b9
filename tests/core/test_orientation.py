from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

import core
from benchmarks.samplings import fibonacci_sphere, torus_points
from core.geometry import winding
from core.geometry.nearest import find_nearest
from core.geometry.orientation import _near_energies, _settled
from core.geometry.winding import _energies, _least, _patch_energies, coupling, divide_patches
from tests.core.test_normals import torus_normals


def box(count=18):
    """Points of the faces of a cube without its edges, so that no two faces are joined smoothly, and their normals."""
    side = (np.arange(count) + 0.5) / count
    u, v = (grid.ravel() for grid in np.meshgrid(side, side))
    points, normals = [], []
    for axis in range(3):
        for end in (0.0, 1.0):
            points.append(np.insert(np.column_stack([u, v]), axis, end, axis=1))
            normals.append(np.tile((2.0 * end - 1.0) * np.eye(3)[axis], (len(u), 1)))
    return np.concatenate(points), np.concatenate(normals)


def mixed(normals, seed=0):
    return normals * np.random.default_rng(seed).choice([-1.0, 1.0], (len(normals), 1))


@pytest.mark.parametrize("method", ["outside", "winding"])
def test_torus_and_box_point_outwards(method):
    points = torus_points(1500)
    np.testing.assert_allclose(
        core.orient_normals(points, mixed(torus_normals(points)), method=method), torus_normals(points), atol=1e-12
    )
    points, normals = box()
    np.testing.assert_array_equal(core.orient_normals(points, mixed(normals), method=method), normals)


def test_winding_joins_parts_that_the_scan_left_apart():
    """Four bands of a tube, no two of which share a neighbour: each alone hardly knows its outside."""
    angle, height = np.meshgrid(2.0 * np.pi * np.arange(80) / 80, np.linspace(-3.0, 3.0, 76))
    angle, height = angle.ravel(), height.ravel()
    normals = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    points = normals + height[:, None] * [0.0, 0.0, 1.0]
    kept = np.abs(np.mod(4.0 * angle / (2.0 * np.pi), 1.0) - 0.5) < 0.4
    found = core.orient_normals(points[kept], mixed(normals[kept]))
    np.testing.assert_allclose(found, normals[kept], atol=1e-12)


def test_each_of_two_close_boxes_points_outwards():
    points, normals = box()
    both, outwards = np.concatenate([points, points + [1.2, 0.0, 0.0]]), np.concatenate([normals, normals])
    np.testing.assert_array_equal(core.orient_normals(both, mixed(outwards)), outwards)


def test_each_of_two_distant_spheres_points_outwards():
    sphere = fibonacci_sphere(800)
    points = np.concatenate([sphere, 0.5 * sphere + [9.0, 0.0, 0.0]])
    normals = np.concatenate([sphere, sphere])
    np.testing.assert_allclose(core.orient_normals(points, mixed(normals)), normals, atol=1e-12)


@pytest.mark.parametrize("method", ["outside", "winding", "viewpoint"])
def test_turn_shift_scale_and_order_change_nothing(method):
    points, normals = box(16)
    eye = np.array([0.5, 0.4, 0.6])
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    order = np.random.default_rng(2).permutation(len(points))
    given = mixed(normals)
    one = core.orient_normals(points, given, method=method, viewpoint=eye)
    other = core.orient_normals(
        1e3 * (points @ turn + [3.0, 0.0, 1.0])[order],
        (given @ turn)[order],
        method=method,
        viewpoint=1e3 * (eye @ turn + [3.0, 0.0, 1.0]),
    )
    np.testing.assert_allclose(other, (one @ turn)[order], atol=1e-9)


def test_viewpoint_within_turns_all_inwards_and_one_per_point_outwards():
    points, normals = box()
    given = mixed(normals)
    inner = core.orient_normals(points, given, method="viewpoint", viewpoint=[0.5, 0.5, 0.5])
    np.testing.assert_array_equal(inner, -normals)
    outer = core.orient_normals(points, given, method="viewpoint", viewpoint=points + 0.1 * normals)
    np.testing.assert_array_equal(outer, normals)


@pytest.mark.parametrize("distance", [1.5, 3.0, 1000.0])
def test_the_hidden_side_of_a_closed_surface_does_not_vote(distance):
    sphere = fibonacci_sphere(700)
    seen = core.orient_normals(sphere, mixed(sphere), method="viewpoint", viewpoint=[0.0, distance, 0.0])
    np.testing.assert_allclose(seen, sphere, atol=1e-12)
    half = sphere[:, 1] > 0.2
    found = core.orient_normals(sphere[half], mixed(sphere[half]), method="viewpoint", viewpoint=[0.0, -distance, 0.0])
    np.testing.assert_allclose(found, -sphere[half], atol=1e-12)


def test_viewpoint_of_a_flat_cloud():
    x, y = np.mgrid[0:1:20j, 0:1:20j].reshape(2, -1)
    points = np.column_stack([x, y, 0.0 * x])
    up = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    found = core.orient_normals(points, mixed(up), method="viewpoint", viewpoint=[0.0, 9.0, -1.0])
    np.testing.assert_array_equal(found, -up)


def test_few_wrong_viewpoints_are_outvoted():
    sphere = fibonacci_sphere(500)
    seen = 3.0 * sphere
    seen[::10] *= -1.0
    np.testing.assert_allclose(
        core.orient_normals(sphere, mixed(sphere), method="viewpoint", viewpoint=seen), sphere, atol=1e-12
    )


def test_areas_that_vanish_take_points_out_of_the_count():
    points, normals = box()
    areas = np.where(np.arange(len(points)) % 2, 1.0, 0.0)
    np.testing.assert_array_equal(core.orient_normals(points, mixed(normals), areas=areas), normals)


def test_copies_of_a_point_agree():
    sphere = fibonacci_sphere(600)
    points = np.concatenate([sphere, sphere[:50]])
    found = core.orient_normals(points, mixed(points))
    np.testing.assert_allclose(found, points, atol=1e-12)


def test_energy_of_two_dipoles():
    """Side by side, parallel ones share +1, one behind the other -2, times 1 / (4 pi r^3)."""
    place = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    for moment, expected in (([0.0, 0.0, 1.0], 1.0), ([1.0, 0.0, 0.0], -2.0)):
        energy = _energies(place, np.array([moment, moment]), np.ones(2), np.array([0, 1]), 1e-9, 3)
        assert energy[0, 1] == pytest.approx(expected / (4.0 * np.pi * 8.0))
        assert energy[0, 1] == energy[1, 0]
    assert not energy[2].any()


def test_clumps_that_are_near_are_taken_finely(monkeypatch):
    """Where all are near the energy of patches is that of the points, which clumps alone do not tell."""
    points = fibonacci_sphere(600)
    weight, patch = np.random.default_rng(0).random(600) + 0.5, (points[:, 2] > 0.0) + 2 * (points[:, 0] > 0.3)
    exact = _patch_energies(points, points, weight, patch)
    monkeypatch.setattr(winding, "_CLUMPS", 150)
    monkeypatch.setattr(winding, "_NEAR", 1e9)
    off = ~np.eye(4, dtype=bool)
    np.testing.assert_allclose(_patch_energies(points, points, weight, patch)[off], exact[off], rtol=1e-9)
    monkeypatch.setattr(winding, "_NEAR", 3.0)
    near = np.abs(_patch_energies(points, points, weight, patch) - exact)[off].max()
    monkeypatch.setattr(winding, "_NEAR", 0.0)
    assert near < 0.1 * np.abs(_patch_energies(points, points, weight, patch) - exact)[off].max()


def test_small_walls_of_a_slot_are_patches_of_their_own(monkeypatch):
    """They are joined to each other, or to what is around, only where there are too many patches."""
    floor = np.argwhere(np.ones((70, 70, 1))) * 1.0
    wall = np.argwhere(np.ones((1, 4, 5))) + [33.7, 33.0, 1.0]
    points = np.concatenate([floor, wall, wall[::-1] + [0.6, 0.0, 0.0]])
    normals = np.repeat(np.eye(3)[[2, 0, 0]] * [[1.0], [1.0], [-1.0]], [4900, 20, 20], axis=0)
    steps = np.arange(len(points) - 1)  # one after the other: from the floor to a wall, and on to the other one
    tree = sparse.csr_array((np.ones(len(steps)), (steps, steps + 1)), shape=(len(points),) * 2)
    np.testing.assert_array_equal(np.bincount(divide_patches(points, normals, tree)), [4900, 20, 20])
    monkeypatch.setattr(winding, "_PATCHES", 2)
    assert divide_patches(points, normals, tree).max() < 2


def test_signs_of_least_energy_are_found_among_all():
    rng = np.random.default_rng(3)
    hidden = rng.choice([-1.0, 1.0], 9)
    mutual = np.outer(hidden, hidden) * rng.random((9, 9))
    sign = _least(mutual + mutual.T + 3.0 * np.eye(9))
    np.testing.assert_array_equal(sign * sign[0], hidden * hidden[0])


def test_energy_of_near_points_is_that_of_dipoles():
    """Where the spacing is even and all are neighbours."""
    points = torus_points(40)
    nearest, normals = find_nearest(points), torus_normals(points)
    even = replace(nearest, distance=np.broadcast_to(nearest.distance[:1], nearest.distance.shape))
    weight = np.random.default_rng(0).random(40)
    near = _near_energies(points, even, normals, weight).toarray()
    offset = points[:, None] - points
    square = np.sum(offset**2, axis=2) + even.spacing[0] ** 2
    along = np.einsum("ic,ijc->ij", normals, offset) * np.einsum("jc,ijc->ij", normals, offset)
    whole = weight[:, None] * weight * (normals @ normals.T / square**1.5 - 3.0 * along / square**2.5) / (4.0 * np.pi)
    np.testing.assert_allclose(near, whole - np.diag(np.diag(whole)), rtol=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_no_flip_of_a_point_improves_settled_signs(seed):
    """And from there nothing flips any more."""
    rng = np.random.default_rng(seed)
    energy = np.triu(rng.standard_normal((60, 60)) * (rng.random((60, 60)) < 0.2), 1)
    energy = sparse.csr_array(energy + energy.T)
    sign = _settled(energy)
    assert (sign * (energy @ sign) >= -1e-12).all()
    assert sign @ energy @ sign > np.ones(60) @ energy @ np.ones(60)
    gauge = sparse.diags_array(sign)
    np.testing.assert_array_equal(_settled((gauge @ energy @ gauge).tocsr()), np.ones(60))


def test_single_points_among_others_are_turned():
    """Of a sphere whose points were given signs by a bad tree, by the energy alone."""
    sphere = fibonacci_sphere(800)
    signs = np.where(np.random.default_rng(0).random(800) < 0.2, -1.0, 1.0)
    nearest = find_nearest(sphere)
    settled = _settled(_near_energies(sphere, nearest, signs[:, None] * sphere, nearest.spacing**2))
    np.testing.assert_array_equal(settled * signs, np.ones(800))


def test_operator_takes_the_side_and_nothing_else_changes():
    sphere = fibonacci_sphere(800)
    laplacian = core.build_laplacian(sphere)
    directions = np.where(sphere[:, 2:] > 0.0, -sphere, 0.0)
    turned = laplacian.toward(directions)
    upper = sphere[:, 2] > 0.0
    np.testing.assert_array_equal(turned.normals[upper], -laplacian.normals[upper])
    np.testing.assert_array_equal(turned.normals[~upper], laplacian.normals[~upper])
    assert np.shares_memory(turned.stiffness.data, laplacian.stiffness.data)
    np.testing.assert_allclose(
        core.measure.mean_curvature(turned),
        np.where(upper, -1.0, 1.0) * core.measure.mean_curvature(laplacian),
        atol=1e-12,
    )
    before, after = core.measure.principal_curvatures(laplacian), core.measure.principal_curvatures(turned)
    np.testing.assert_allclose(after.first[upper], -before.second[upper], atol=1e-9)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"method": "up"}, "Choose one of outside, viewpoint, winding"),
        ({"method": None}, "unknown"),
        ({"method": "viewpoint"}, "Viewpoints have the shape"),
        ({"method": "viewpoint", "viewpoint": np.zeros((5, 3))}, "each of 600 points"),
        ({"method": "viewpoint", "viewpoint": [0.0, np.nan, 0.0]}, "1 of 1 viewpoints are not finite"),
        ({"areas": np.ones(3)}, "each of 600 points"),
        ({"areas": np.zeros(600)}, "600 of 600 areas"),
        ({"areas": np.full(600, -1.0)}, "600 of 600 areas"),
    ],
)
def test_what_does_not_fit_is_refused(settings, text):
    sphere = fibonacci_sphere(600)
    with pytest.raises(core.InvalidPointsError, match=text):
        core.orient_normals(sphere, sphere, **settings)


def test_directions_that_do_not_fit_are_refused():
    laplacian = core.build_laplacian(fibonacci_sphere(600))
    for directions in (np.zeros((600, 2)), np.zeros(600), np.full((600, 3), np.nan)):
        with pytest.raises(core.InvalidPointsError):
            laplacian.toward(directions)


def test_parallel_layers_of_dipoles_have_no_common_energy_however_close():
    """Else facing sheets, a spacing apart, would rather look in one direction."""
    side, width = np.meshgrid(np.arange(-60.0, 61.0), np.arange(-60.0, 61.0)), 1.0
    square = side[0] ** 2 + side[1] ** 2
    for gap in 0.3, 1.0, 2.0:
        layer, point = coupling(1.0, gap**2, square + gap**2 + width**2, width**2), coupling(1.0, 0.0, 1.0)
        assert np.abs(layer.sum()) < 0.5 * point  # what lies beyond the edges of this layer


@pytest.mark.parametrize("seed", [1, 3])
def test_the_ends_of_a_ring_that_nearly_touch_face_each_other(seed):
    """Between them are no other points, so that their neighbours would take them for one sheet, or for two alike."""
    rng = np.random.default_rng(seed)
    gap, ring, tube = 0.05, 1.0, 0.3
    turn, around = rng.random(6000) * (2.0 * np.pi - gap) + 0.5 * gap, rng.random(6000) * 2.0 * np.pi
    kept = rng.random(6000) < (ring + tube * np.cos(around)) / (ring + tube)
    turn, around = turn[kept], around[kept]
    out, up = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1), np.array([0.0, 0.0, 1.0])
    normals = np.cos(around)[:, None] * out + np.sin(around)[:, None] * up
    points = ring * out + tube * normals
    for angle, sign in (0.5 * gap, -1.0), (2.0 * np.pi - 0.5 * gap, 1.0):
        count = int(len(turn) / (2.0 * np.pi - gap) * tube / (2.0 * ring))
        radius, around = tube * np.sqrt(rng.random(count)), rng.random(count) * 2.0 * np.pi
        out = np.array([np.cos(angle), np.sin(angle), 0.0])
        end = (ring + radius * np.cos(around))[:, None] * out + (radius * np.sin(around))[:, None] * up
        points = np.concatenate([points, end])
        normals = np.concatenate([normals, np.tile(sign * np.array([-out[1], out[0], 0.0]), (count, 1))])
    found = core.estimate_normals(points)
    assert np.mean(np.einsum("ij,ij->i", found, normals) < 0.0) < 5e-3
