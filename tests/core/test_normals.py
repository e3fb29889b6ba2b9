import numpy as np
import pytest

import core
from benchmarks.samplings import hemisphere_random, random_sphere, torus_points
from core.geometry.nearest import find_nearest
from core.geometry.quadrics import fit_quadrics


def torus_normals(points, major=1.0):
    radius = np.linalg.norm(points[:, :2], axis=1)
    center = np.column_stack([points[:, :2] * (major / radius)[:, None], np.zeros(len(points))])
    normals = points - center
    return normals / np.linalg.norm(normals, axis=1)[:, None]


def angle(found, exact):
    return np.arccos(np.clip(np.abs(np.einsum("ij,ij->i", found, exact)), 0.0, 1.0))


def normals_by(method, points):
    """Normals of the default, or of one of the paper's two kinds."""
    if method == "quadric":
        return core.estimate_normals(points)
    return core.paper.build_laplacian(points, normals=method, areas="uniform", neighbors=20).normals


def test_normals_of_a_torus_by_quadrics_and_by_weighted_and_plain_covariance():
    points = torus_points(2400)
    errors = {}
    for method, bound in (("quadric", 0.01), ("wpca", 0.06), ("pca", 0.12)):
        normals = normals_by(method, points)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-12)
        errors[method] = angle(normals, torus_normals(points))
        assert np.sqrt(np.mean(errors[method] ** 2)) < bound
    assert errors["wpca"].mean() < errors["pca"].mean()


def test_outliers_have_no_rows_around_them():
    """The least bent quadric leans farther from a sphere below outliers than the fit does: by 55, not 42 degrees."""
    rng = np.random.default_rng(0)
    above = rng.standard_normal((200, 3))
    above *= rng.uniform(1.05, 1.5, (200, 1)) / np.linalg.norm(above, axis=1, keepdims=True)
    nearest = find_nearest(np.concatenate([random_sphere(4000), above]))
    found = fit_quadrics(nearest.points, nearest.index, nearest.weight).normals[4000:]
    lean = angle(found, above / np.linalg.norm(above, axis=1, keepdims=True))
    assert np.degrees(np.median(lean)) < 49.0


@pytest.mark.parametrize("method", ["quadric", "wpca"])
def test_orientation_points_outwards_on_closed_surfaces(method):
    points = torus_points(1500)
    normals = normals_by(method, points)
    assert np.all(np.einsum("ij,ij->i", normals, torus_normals(points)) > 0.9)


def test_orientation_of_two_spheres():
    sphere = random_sphere(800)
    points = np.concatenate([sphere, 0.5 * sphere + [4.0, 0.0, 0.0]])
    normals = core.estimate_normals(points)
    assert np.all(np.einsum("ij,ij->i", normals, np.concatenate([sphere, sphere])) > 0.9)


SHEETS = {  # heights over the unit square, of terrain whose normals must point up
    "plain": lambda u, v: 0.0 * u,
    "slope": lambda u, v: 1.5 * u - 0.7 * v,
    "waves": lambda u, v: 0.2 * np.sin(4.0 * u),
    "pit": lambda u, v: -0.15 * np.exp(-10.0 * ((u - 0.5) ** 2 + (v - 0.5) ** 2)),
    "valley": lambda u, v: 0.3 * np.abs(u - 0.5),
    "quarry": lambda u, v: np.clip(2.0 * np.hypot(u - 0.5, v - 0.5) - 0.9, -0.2, 0.0),
}


@pytest.mark.parametrize("sheet", SHEETS)
@pytest.mark.parametrize("over", [1.0, -1.0])
def test_terrain_faces_up(sheet, over):
    """Also one that is turned over by half a turn, whose hills are pits then."""
    u, v = np.random.default_rng(0).random((2, 600))
    points = np.column_stack([u, over * v, over * SHEETS[sheet](u, v)])
    normals = core.estimate_normals(points)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], (len(points), 1))
    assert np.all(normals[:, 2] > 0.0)
    assert np.all(core.surface.surface_discs(points).normals[:, 2] > 0.0)
    for method in ("outside", "winding"):
        assert np.all(core.orient_normals(points, signs * normals, method=method)[:, 2] > 0.0), method


def test_terrain_with_what_overhangs_faces_up():
    """A tenth of it are balls that lie on the ground."""
    u, v = np.random.default_rng(0).random((2, 3000))
    ball = 0.03 * random_sphere(100) + [0.0, 0.0, 0.03]
    places = [[0.2, 0.3, 0.0], [0.7, 0.6, 0.0], [0.4, 0.8, 0.0]]
    ground = np.column_stack([u, v, 0.05 * np.sin(6.0 * u)])
    normals = core.surface.surface_discs(np.concatenate([ground, *(ball + place for place in places)])).normals
    assert np.mean(normals[: len(ground), 2] > 0.0) > 0.98


@pytest.mark.parametrize("turn", [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [1.0, 0.0, 0.0]])
def test_bowls_and_bodies_face_outwards_whichever_way_they_are_turned(turn):
    """Half a sphere, open above, below or at a side, is what a scanner sees of a body: its outer side is told."""
    points = hemisphere_random(750)
    points = points[:, [2, 0, 1]] if turn[1] == 0.0 else points * turn
    normals = core.estimate_normals(points)
    assert np.all(np.einsum("ij,ij->i", normals, points) > 0.5)


def test_a_wall_keeps_one_side():
    """It faces neither up nor down."""
    u, v = np.random.default_rng(0).random((2, 3000))
    points = np.column_stack([u, 0.05 * np.sin(6.0 * u) * np.sin(5.0 * v), v])
    normals = core.estimate_normals(points)
    assert np.all(normals[:, 1] > 0.0) or np.all(normals[:, 1] < 0.0)
