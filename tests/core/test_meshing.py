"""Meshes of the surface that points lie on, against surfaces that are known."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import core
from benchmarks.awkward import box
from benchmarks.samplings import fibonacci_sphere, random_sphere, square_random
from core.applications.surfaces.sides import agreeing


def edges_of(mesh):
    """Return how many faces each edge of a mesh has."""
    ends = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    return np.unique(ends, axis=0, return_counts=True)[1]


def euler_characteristic(mesh):
    return len(mesh.vertices) - len(edges_of(mesh)) + len(mesh.faces)


def areas_of(mesh):
    """Return the vector areas of the faces, (q, 3)."""
    corners = mesh.vertices[mesh.faces]
    return 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])


def area_of(mesh):
    return np.linalg.norm(areas_of(mesh), axis=1).sum()


def typical_spacing(laplacian):
    return np.sqrt(np.median(laplacian.areas))


@pytest.fixture(scope="module")
def meshes(operators):
    """Function from the name of a cloud and a detail to the mesh of its surface."""
    return functools.cache(lambda name, detail=1.0: core.mesh_surface(operators(name), detail))


@pytest.mark.parametrize(
    ("name", "detail"),
    [("even sphere", 0.7), ("random sphere", 1.0), ("density jump", 1.0), ("another random sphere", 2.0)],
)
def test_sphere(operators, meshes, name, detail):
    laplacian, mesh = operators(name), meshes(name, detail)
    spacing = typical_spacing(laplacian)
    assert np.all(edges_of(mesh) == 2)
    assert euler_characteristic(mesh) == 2
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1.0).max() < 0.05 * spacing
    centers = mesh.vertices[mesh.faces].mean(axis=1)
    assert np.abs(np.linalg.norm(centers, axis=1) - 1.0).max() < 0.1 * spacing
    assert cKDTree(centers).query(laplacian.points)[0].max() < 1.2 * spacing / detail  # it leaves no point out
    assert area_of(mesh) == pytest.approx(4.0 * np.pi, rel=0.01)
    assert np.all(np.einsum("ij,ij->i", areas_of(mesh), centers) > 0.0)  # faces look outwards
    edge = np.linalg.norm(mesh.vertices[mesh.faces[:, 0]] - mesh.vertices[mesh.faces[:, 1]], axis=1)
    assert np.median(edge) == pytest.approx(spacing / detail, rel=0.2)


@pytest.mark.parametrize("name", ["random torus", "coarse torus"])
def test_torus(operators, meshes, name):
    laplacian, mesh = operators(name), meshes(name)
    assert np.all(edges_of(mesh) == 2)
    assert euler_characteristic(mesh) == 0
    ring, tube = np.hypot(*laplacian.points[:, :2].T), laplacian.points[:, 2].max()
    middle = 0.5 * (ring.min() + ring.max())
    tubes = np.hypot(np.hypot(*mesh.vertices[:, :2].T) - middle, mesh.vertices[:, 2])
    assert np.abs(tubes - tube).max() < 0.1 * typical_spacing(laplacian)


@pytest.mark.parametrize("sphere", [fibonacci_sphere, random_sphere])
def test_open_cap_keeps_its_rim(sphere):
    points = sphere(2000)
    laplacian = core.build_laplacian(points[points[:, 2] > 0.3])
    mesh = core.mesh_surface(laplacian)
    assert euler_characteristic(mesh) == 1  # that of a disc
    assert area_of(mesh) == pytest.approx(2.0 * np.pi * 0.7, rel=0.03)
    assert mesh.vertices[:, 2].min() == pytest.approx(0.3, abs=0.5 * typical_spacing(laplacian))


def test_flat_square_stays_flat():
    laplacian = core.build_laplacian(square_random(1200))
    mesh = core.mesh_surface(laplacian)
    assert np.abs(mesh.vertices[:, 2]).max() < 1e-9
    assert area_of(mesh) == pytest.approx(1.0, rel=0.03)


def test_sheets_apart_are_two_meshes():
    ball = fibonacci_sphere(750)
    mesh = core.mesh_surface(core.build_laplacian(np.concatenate([ball, ball + [2.5, 0.0, 0.0]])))
    assert np.all(edges_of(mesh) == 2)
    assert euler_characteristic(mesh) == 4


def test_sheets_within_one_voxel_share_no_vertex():
    turn = Rotation.from_rotvec([0.4, 0.3, 0.2]).as_matrix()
    laplacian = core.build_laplacian(fibonacci_sphere(3000) * [1.0, 0.8, 0.085] @ turn)
    mesh = core.mesh_surface(laplacian)
    assert np.all(edges_of(mesh) == 2)
    assert euler_characteristic(mesh) == 2


@pytest.mark.parametrize("turned", ["half", "every third", "all"])
def test_signs_of_normals_make_no_holes(operators, meshes, turned):
    laplacian = operators("another random sphere")
    rows = {
        "half": laplacian.points[:, 0] > 0.1,
        "every third": np.arange(len(laplacian.points)) % 3 == 0,
        "all": np.full(len(laplacian.points), True),
    }[turned]
    sign = np.where(rows, -1.0, 1.0)
    other = replace(
        laplacian,
        normals=laplacian.normals * sign[:, None],
        shape_operator=laplacian.shape_operator * sign[:, None, None],
    )
    one, mesh = meshes("another random sphere"), core.mesh_surface(other)
    assert np.all(edges_of(mesh) == 2)
    assert euler_characteristic(mesh) == 2
    np.testing.assert_allclose(np.sort(np.linalg.norm(mesh.vertices, axis=1)), 1.0, atol=5e-3)
    assert area_of(mesh) == pytest.approx(area_of(one), rel=1e-3)
    outwards = np.einsum("ij,ij->i", areas_of(mesh), mesh.vertices[mesh.faces].mean(axis=1)) > 0.0
    assert np.all(outwards == (turned != "all" and np.count_nonzero(rows) < 0.5 * len(rows)))


def test_surface_ends_at_sharp_rims():
    sides = np.array([1.0, 1.0, 0.057])  # some two spacings thick
    points = box(sides, 4000)
    laplacian = core.build_laplacian(points)
    mesh = core.mesh_surface(laplacian)
    assert np.all(edges_of(mesh) == 2)
    assert euler_characteristic(mesh) == 2
    spacing = typical_spacing(laplacian)
    # Beyond 1.5 spacings what points tell of their quadric, exp(-r^2), is fainter than that nothing is there.
    assert np.all(np.abs(mesh.vertices - 0.5 * sides) < 0.5 * sides + 1.6 * spacing)
    assert cKDTree(points).query(mesh.vertices)[0].max() < 3.0 * spacing


def test_sides_are_found_in_one_round_or_many():
    rng = np.random.default_rng(0)
    count = 3000
    true = rng.choice([-1.0, 1.0], count)
    first = np.concatenate([np.arange(count - 1), rng.integers(0, count, 4 * count)])
    second = np.concatenate([np.arange(1, count), rng.integers(0, count, 4 * count)])
    told = true[first] * true[second] * rng.choice([0.5, 1.0, 2.0], len(first))  # with ties
    sign, group = agreeing(count, first, second, told)
    assert np.all(group == group[0])
    assert np.abs(sign @ true) == count


def test_places_that_no_edge_joins_stay_apart():
    sign, group = agreeing(5, np.array([0, 2, 3]), np.array([1, 3, 4]), np.array([-1.0, 1.0, 0.0]))
    assert sign[0] == -sign[1]
    assert sign[2] == sign[3]
    assert len(np.unique(group)) == 3
    assert group[2] == group[3]


def test_order_of_the_points_makes_no_difference(operators, meshes):
    points, one = operators("another random sphere").points, meshes("another random sphere")
    order = np.random.default_rng(1).permutation(len(points))
    other = core.mesh_surface(core.build_laplacian(points[order]))
    np.testing.assert_allclose(other.vertices, one.vertices, atol=1e-6)
    assert np.array_equal(other.faces, one.faces)


def test_scale_and_place_only_scale_and_move():
    points = fibonacci_sphere(750)
    one, other = (core.mesh_surface(core.build_laplacian(cloud)) for cloud in (points, 1024.0 * points))
    np.testing.assert_allclose(other.vertices, 1024.0 * one.vertices, atol=1e-6)
    moved = core.mesh_surface(core.build_laplacian(1e-3 * points + [50.0, -20.0, 7.0]))
    np.testing.assert_allclose(np.linalg.norm(moved.vertices - [50.0, -20.0, 7.0], axis=1), 1e-3, rtol=1e-3)


def test_turned_points_give_the_same_surface():
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    points = fibonacci_sphere(1500) * [1.0, 0.7, 0.5]
    mesh = core.mesh_surface(core.build_laplacian(points @ turn.T))
    assert np.all(edges_of(mesh) == 2)
    on = np.linalg.norm((mesh.vertices @ turn) / [1.0, 0.7, 0.5], axis=1)
    np.testing.assert_allclose(on, 1.0, atol=2e-3)


def test_values_are_carried_along_the_surface(operators, meshes):
    laplacian, mesh = operators("random sphere"), meshes("random sphere")
    carried = core.values_on_mesh(laplacian, mesh.vertices).interpolate(laplacian.points)
    assert len(carried) == len(laplacian.points) + len(mesh.vertices)
    np.testing.assert_allclose(carried[len(laplacian.points) :], mesh.vertices, atol=0.01)


@pytest.mark.parametrize("detail", [0.0, -1.0, np.nan, np.inf, "fine", True])
def test_wrong_detail(operators, detail):
    with pytest.raises(core.PointCloudError, match="detail"):
        core.mesh_surface(operators("even sphere"), detail)


def test_detail_that_no_memory_holds(operators):
    with pytest.raises(core.NotEnoughMemoryError, match="Lower the detail"):
        core.mesh_surface(operators("even sphere"), 1e5)


def test_detail_coarser_than_the_surface(operators):
    with pytest.raises(core.PointCloudError, match="Raise the detail"):
        core.mesh_surface(operators("even sphere"), 1e-3)
