"""Meshes of the surface that points lie on, against surfaces that are known."""

import functools
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import core
from benchmarks.awkward import box
from benchmarks.samplings import fibonacci_sphere, random_sphere, square_random
from core import cores
from core.surface import meshing
from core.surface.grid import grid_around
from core.surface.quads import all_quads
from core.surface.sides import agreeing


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
    return functools.cache(lambda name, detail=1.0: core.surface.mesh_surface(operators(name), detail))


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
    apart = np.maximum(spacing, np.sqrt(laplacian.areas))  # of the points there
    assert np.all(cKDTree(centers).query(laplacian.points)[0] < 1.2 * apart / detail)  # it leaves no point out
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
    mesh = core.surface.mesh_surface(laplacian)
    assert euler_characteristic(mesh) == 1  # that of a disc
    assert area_of(mesh) == pytest.approx(2.0 * np.pi * 0.7, rel=0.03)
    assert mesh.vertices[:, 2].min() == pytest.approx(0.3, abs=0.5 * typical_spacing(laplacian))


def test_flat_square_stays_flat():
    laplacian = core.build_laplacian(square_random(1200))
    mesh = core.surface.mesh_surface(laplacian)
    assert np.abs(mesh.vertices[:, 2]).max() < 1e-9
    assert area_of(mesh) == pytest.approx(1.0, rel=0.03)


def test_sheets_apart_are_two_meshes():
    ball = fibonacci_sphere(750)
    mesh = core.surface.mesh_surface(core.build_laplacian(np.concatenate([ball, ball + [2.5, 0.0, 0.0]])))
    assert np.all(edges_of(mesh) == 2)
    assert euler_characteristic(mesh) == 4


def test_sheets_within_one_voxel_share_no_vertex():
    turn = Rotation.from_rotvec([0.4, 0.3, 0.2]).as_matrix()
    laplacian = core.build_laplacian(fibonacci_sphere(3000) * [1.0, 0.8, 0.085] @ turn)
    mesh = core.surface.mesh_surface(laplacian)
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
    one, mesh = meshes("another random sphere"), core.surface.mesh_surface(other)
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
    mesh = core.surface.mesh_surface(laplacian)
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
    other = core.surface.mesh_surface(core.build_laplacian(points[order]))
    np.testing.assert_allclose(other.vertices, one.vertices, atol=1e-6)
    assert np.array_equal(other.faces, one.faces)


def test_scale_and_place_only_scale_and_move():
    points = fibonacci_sphere(750)
    one, other = (core.surface.mesh_surface(core.build_laplacian(cloud)) for cloud in (points, 1024.0 * points))
    np.testing.assert_allclose(other.vertices, 1024.0 * one.vertices, atol=1e-6)
    moved = core.surface.mesh_surface(core.build_laplacian(1e-3 * points + [50.0, -20.0, 7.0]))
    np.testing.assert_allclose(np.linalg.norm(moved.vertices - [50.0, -20.0, 7.0], axis=1), 1e-3, rtol=1e-3)


def test_turned_points_give_the_same_surface():
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    points = fibonacci_sphere(1500) * [1.0, 0.7, 0.5]
    mesh = core.surface.mesh_surface(core.build_laplacian(points @ turn.T))
    assert np.all(edges_of(mesh) == 2)
    on = np.linalg.norm((mesh.vertices @ turn) / [1.0, 0.7, 0.5], axis=1)
    np.testing.assert_allclose(on, 1.0, atol=2e-3)


def test_values_are_carried_along_the_surface(operators, meshes):
    laplacian, mesh = operators("random sphere"), meshes("random sphere")
    carried = core.surface.values_on_mesh(laplacian, mesh.vertices).interpolate(laplacian.points)
    assert len(carried) == len(laplacian.points) + len(mesh.vertices)
    np.testing.assert_allclose(carried[len(laplacian.points) :], mesh.vertices, atol=0.01)


@pytest.mark.parametrize("detail", [0.0, -1.0, np.nan, np.inf, "fine", True])
def test_wrong_detail(operators, detail):
    with pytest.raises(core.PointCloudError, match="detail"):
        core.surface.mesh_surface(operators("even sphere"), detail)


def test_detail_that_no_memory_holds(operators):
    with pytest.raises(core.NotEnoughMemoryError, match="Lower the detail"):
        core.surface.mesh_surface(operators("even sphere"), 1e5)


def test_detail_coarser_than_the_surface(operators):
    with pytest.raises(core.PointCloudError, match="raise the detail"):
        core.surface.mesh_surface(operators("even sphere"), 1e-3)


def two_sheets(ratio, count=600, seed=0):
    """Return a square of dense points beside one of points that are a ratio as far apart, in one component."""
    rng = np.random.default_rng(seed)
    side = np.sqrt(count)
    dense = rng.random((count, 2)) * [side, side] - [side, 0.5 * side]
    sparse = rng.random((count, 2)) * [side * ratio, side * ratio] - [0.0, 0.5 * side * ratio]
    return np.pad(np.concatenate([dense, sparse]), ((0, 0), (0, 1)))


def hopf_torus(across, around, waves=3, height=0.5):
    """Return points of the image in space of the circles of Hopf's fibration over a closed curve, (n, 3)."""
    along, fiber = np.meshgrid(
        2.0 * np.pi * np.arange(across) / across, 2.0 * np.pi * np.arange(around) / around, indexing="ij"
    )
    half = 0.25 * np.pi + 0.5 * height * np.sin(waves * along)
    first, second = np.cos(half) * np.exp(1j * fiber), np.sin(half) * np.exp(1j * (fiber + along))
    places = np.stack([first.real, first.imag, second.real], axis=-1) / (1.0 - second.imag)[..., None]
    return places.reshape(-1, 3)


class TestDensitiesThatMeet:
    @staticmethod
    @functools.cache
    def statue(dense, sparse, half):
        rng = np.random.default_rng(4)
        plaza = np.pad(rng.uniform(-half, half, (sparse, 2)), ((0, 0), (0, 1)))
        return core.build_laplacian(np.concatenate([0.25 * random_sphere(dense) + [0.0, 0.0, 0.6], plaza]))

    @pytest.mark.parametrize("half", [2.0, 10.0, 40.0])
    def test_a_statue_on_a_plaza(self, half):
        mesh = core.surface.mesh_surface(self.statue(3000, 800, half))
        assert mesh.notices == []
        assert len(mesh.faces) < 4 * 3800
        low = mesh.vertices[mesh.faces].mean(axis=1)[:, 2] < 0.2
        areas = np.linalg.norm(areas_of(mesh), axis=1)
        assert areas[~low].sum() == pytest.approx(np.pi / 4.0, rel=0.01)
        assert areas[low].sum() == pytest.approx(4.0 * half**2, rel=0.05)
        assert edges_of(mesh).max() == 2
        statue = np.linalg.norm(mesh.vertices - [0.0, 0.0, 0.6], axis=1) < 0.3
        assert np.abs(np.linalg.norm(mesh.vertices[statue] - [0.0, 0.0, 0.6], axis=1) - 0.25).max() < 1e-3

    def test_a_dense_part_that_is_small_is_not_lost(self):
        mesh = core.surface.mesh_surface(self.statue(1000, 4000, 10.0))
        low = mesh.vertices[mesh.faces].mean(axis=1)[:, 2] < 0.2
        assert np.linalg.norm(areas_of(mesh), axis=1)[~low].sum() == pytest.approx(np.pi / 4.0, rel=0.02)

    @pytest.mark.parametrize("ratio", [3.0, 11.0, 27.0, 100.0])
    def test_side_by_side(self, ratio):
        points = two_sheets(ratio)
        laplacian = core.build_laplacian(points)
        mesh = core.surface.mesh_surface(laplacian)
        assert len(mesh.faces) < 6 * len(points)
        assert edges_of(mesh).max() == 2
        assert np.abs(mesh.vertices[:, 2]).max() < 1e-6
        assert area_of(mesh) == pytest.approx(600.0 * (1.0 + ratio**2), rel=0.06)
        assert np.all(np.ptp(np.sort(mesh.faces, axis=1), axis=1) > 0)
        assert all(len(set(face)) == 4 for face in mesh.faces.tolist())  # quads all over

    @pytest.mark.parametrize("height", [0.45, 0.8])
    def test_hopf_torus(self, height):
        points = hopf_torus(60, 30, height=height)
        laplacian = core.build_laplacian(points)
        assert laplacian.areas.max() > 30.0 * laplacian.areas.min()
        mesh = core.surface.mesh_surface(laplacian)
        assert np.all(edges_of(mesh) == 2)
        assert euler_characteristic(mesh) == 0
        assert len(mesh.faces) < 6 * len(points)
        assert area_of(mesh) == pytest.approx(area_of(core.surface.SurfaceMesh(*fine_hopf_torus(height))), rel=0.03)

    def test_components_of_all_sizes(self):
        ball = fibonacci_sphere(800)
        points = np.concatenate([ball * size + [3.0 * place, 0.0, 0.0] for place, size in enumerate((1.0, 0.1, 0.01))])
        mesh = core.surface.mesh_surface(core.build_laplacian(points))
        assert np.all(edges_of(mesh) == 2)
        assert euler_characteristic(mesh) == 6
        for place, size in enumerate((1.0, 0.1, 0.01)):
            apart = np.linalg.norm(mesh.vertices - [3.0 * place, 0.0, 0.0], axis=1)
            np.testing.assert_allclose(apart[apart < 1.5 * size], size, rtol=3e-3)

    def test_what_is_needed_is_in_proportion_to_the_points(self, monkeypatch):
        needed = []
        monkeypatch.setattr(meshing, "available_memory", lambda: 1)
        for half in 2.0, 10.0, 40.0:
            laplacian = self.statue(3000, 800, half)
            laplacian.release()
            with pytest.raises(core.NotEnoughMemoryError) as caught:
                core.surface.mesh_surface(laplacian)
            needed.append(float(str(caught.value).partition(" about ")[2].split()[0]))
        assert max(needed) < 0.1  # GB

    def test_a_few_sparse_points_beside_many_dense_ones(self, monkeypatch):
        grids = []
        monkeypatch.setattr(meshing, "grid_around", lambda *given: grids.append(grid_around(*given)) or grids[-1])
        rng = np.random.default_rng(1)
        dense = rng.random((4000, 2)) * [63.2, 63.2] - [63.2, 0.0]
        sparse = rng.random((40, 2)) * [63.2, 63.2]
        points = np.pad(np.concatenate([dense, sparse]), ((0, 0), (0, 1)))
        points[:, 2] = 6.0 * np.sin(0.05 * points[:, 0])
        mesh = core.surface.mesh_surface(core.build_laplacian(points))
        assert len(mesh.faces) < 2.5 * len(points)
        assert len(grids[0].corners) < 10 * len(points)

    @pytest.mark.parametrize(("across", "detail"), [(36, 1.0), (24, 2.0)])
    def test_the_check_before_is_right_within_a_factor_of_two(self, across, detail, monkeypatch):
        monkeypatch.setenv(cores.VARIABLE, "1")  # more of them take blocks of their own
        laplacian = core.build_laplacian(hopf_torus(2 * across, across))
        with monkeypatch.context() as patch:
            patch.setattr(meshing, "available_memory", lambda: 1)
            with pytest.raises(core.NotEnoughMemoryError) as caught:
                core.surface.mesh_surface(laplacian, detail)
        expected = float(str(caught.value).partition(" about ")[2].split()[0]) * 2.0**30
        tracemalloc.start()
        core.surface.mesh_surface(laplacian, detail)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert 0.5 * peak < expected < 2.0 * peak

    def test_points_without_a_mesh_are_told(self):
        cube = np.random.default_rng(2).uniform(-0.4, 0.4, (800, 3)) + [3.0, 0.0, 0.0]
        laplacian = core.build_laplacian(np.concatenate([random_sphere(1300), cube]))
        (notice,) = core.surface.mesh_surface(laplacian).notices
        number = int(notice.split()[3].replace(",", ""))
        assert 0.1 * len(cube) < number < len(cube)


def fine_hopf_torus(height, across=300, around=150):
    """Return vertices and quads of the same torus as `hopf_torus` has."""
    number = np.arange(across * around).reshape(across, around)
    right, up = np.roll(number, -1, axis=0), np.roll(number, -1, axis=1)
    quads = np.stack([number, right, np.roll(right, -1, axis=1), up], axis=-1).reshape(-1, 4)
    return hopf_torus(across, around, height=height), quads


class TestQuads:
    def test_triangles_in_pairs(self):
        # Two triangles with a quad between them: each side between them is divided.
        places = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0.5, 0], [-1, 0.5, 0]], dtype=float)
        faces = np.array([[0, 1, 2, 3], [1, 4, 2, 2], [0, 0, 3, 5]])
        vertices, quads, sizes = all_quads(places, faces, np.arange(6.0))
        assert len(quads) in {3, 4}
        assert all(len(set(quad)) == 4 for quad in quads.tolist())
        np.testing.assert_array_equal(vertices[:6], places)
        assert len(sizes) == len(vertices)
        mesh = core.surface.SurfaceMesh(vertices, quads)
        assert area_of(mesh) == pytest.approx(2.0)
        assert np.all(areas_of(mesh)[:, 2] > 0.0)

    @pytest.mark.parametrize("seed", range(4))
    def test_a_closed_surface_of_triangles_and_quads(self, seed):
        # A cube of quads, some of which are divided to two triangles, wherever they lie.
        rng = np.random.default_rng(seed)
        mesh = core.surface.mesh_surface(core.build_laplacian(fibonacci_sphere(400)))
        cut = rng.random(len(mesh.faces)) < rng.choice([0.01, 0.2, 1.0])
        cut[rng.integers(len(cut))] = True
        a, b, c, d = mesh.faces[cut].T
        faces = np.concatenate([mesh.faces[~cut], np.stack([a, b, c, c], axis=1), np.stack([c, d, a, a], axis=1)])
        vertices, quads, _ = all_quads(mesh.vertices, faces[rng.permutation(len(faces))], np.ones(len(mesh.vertices)))
        made = core.surface.SurfaceMesh(vertices, quads)
        assert all(len(set(quad)) == 4 for quad in quads.tolist())
        assert np.all(edges_of(made) == 2)
        assert euler_characteristic(made) == 2
        outwards = np.einsum("ij,ij->i", areas_of(made), made.vertices[made.faces].mean(axis=1))
        assert np.all(outwards > 0.0)

    def test_a_single_triangle_ends_at_an_open_edge(self):
        places = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0.5, 0]], dtype=float)
        vertices, quads, _ = all_quads(places, np.array([[0, 1, 2, 3], [1, 4, 2, 2]]), np.ones(5))
        assert all(len(set(quad)) == 4 for quad in quads.tolist())
        assert area_of(core.surface.SurfaceMesh(vertices, quads)) == pytest.approx(1.5)
