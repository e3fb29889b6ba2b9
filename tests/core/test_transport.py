"""The connection Laplacian, directions carried along surfaces, and maps around a point."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import diags_array
from scipy.sparse.linalg import splu

import core
from benchmarks.samplings import open_cylinder, random_sphere, square_grid, square_random
from core.algebra import TwoGrid
from core.operator import connection_laplacian, tangent_frames


def connection(laplacian):
    frames = tangent_frames(laplacian.normals)
    return connection_laplacian(laplacian.stiffness, laplacian.normals, frames)


@pytest.fixture(scope="module")
def sphere():
    return core.build_laplacian(random_sphere(2000))


@pytest.fixture(scope="module")
def square():
    return core.build_laplacian(square_grid(40))


def exact_map(laplacian, source, direction):
    """The logarithmic map of the unit sphere, and the angle to each point."""
    points, normal = laplacian.points, laplacian.normals[source]
    first = direction - (direction @ normal) * normal
    first /= np.linalg.norm(first)
    angle = np.arctan2(points @ np.cross(normal, first), points @ first)
    distance = np.arccos(np.clip(points @ points[source], -1.0, 1.0))
    return distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]), distance


def test_frames_are_orthonormal_and_right_handed():
    normals = random_sphere(500)
    frames = tangent_frames(normals)
    assert_allclose(np.cross(frames.real, frames.imag), normals, atol=1e-12)
    assert_allclose(np.linalg.norm(frames.real, axis=1), 1.0)
    vectors = np.cross(normals, [1.0, 2.0, 3.0])
    number = np.einsum("ij,ij->i", vectors, frames)
    assert_allclose((number.conj()[:, None] * frames).real, vectors, atol=1e-12)


def test_it_is_hermitian_and_positive_with_the_pairs_of_the_stiffness(sphere):
    matrix = connection(sphere)
    assert abs(matrix - matrix.conj().T).max() == 0.0
    rng = np.random.default_rng(0)
    for _ in range(5):
        x = rng.standard_normal(2000) + 1j * rng.standard_normal(2000)
        assert (x.conj() @ (matrix @ x)).real > 0.0
    assert abs(abs(matrix) - abs(sphere.stiffness)).max() < 1e-12


def test_a_mass_comes_onto_the_diagonal(sphere):
    frames = tangent_frames(sphere.normals)
    matrix = connection_laplacian(sphere.stiffness, sphere.normals, frames, sphere.areas)
    assert abs(matrix - connection(sphere) - diags_array(sphere.areas)).max() < 1e-12


def test_pairs_that_face_opposite_ways_are_left_out(square):
    normals = square.normals.copy()
    turned = np.arange(1600) % 3 == 0
    normals[turned] *= -1.0
    matrix = connection_laplacian(square.stiffness, normals, tangent_frames(normals)).tocoo()
    assert not np.any(turned[matrix.row] != turned[matrix.col])
    assert abs(matrix).sum(axis=1).min() > 0.0


def test_on_a_plane_it_is_the_stiffness(square):
    assert abs(connection(square) - square.stiffness).max() < 1e-12


def test_another_choice_of_frames_is_a_change_of_basis(sphere):
    turn = np.exp(1j * np.random.default_rng(0).uniform(0.0, 6.0, 2000))
    frames = tangent_frames(sphere.normals)
    turned = connection_laplacian(sphere.stiffness, sphere.normals, turn.conj()[:, None] * frames)
    # A frame turned back makes the numbers of vectors turn ahead, and the matrix with them.
    values = np.random.default_rng(1).standard_normal(2000) + 0j
    assert_allclose(turned @ (turn.conj() * values), turn.conj() * (connection(sphere) @ values), atol=1e-10)


def test_the_lowest_fields_on_the_sphere_have_the_eigenvalue_one(sphere):
    """Gradients of the coordinates; on the unit sphere the connection Laplacian takes each to minus itself."""
    frames = tangent_frames(sphere.normals)
    gradient = frames @ np.array([0.3, -0.5, 0.8])
    quotient = (gradient.conj() @ (connection(sphere) @ gradient)).real / (sphere.areas @ np.abs(gradient) ** 2)
    assert quotient == pytest.approx(1.0, abs=0.04)


class TestTwoGrid:
    @pytest.mark.parametrize("reach", [0.1, 0.3])
    def test_each_value_is_right_to_a_share_of_itself(self, operators, reach):
        """Although the largest is many powers of ten larger than the least."""
        laplacian = operators("coarse torus")
        mass = laplacian.areas / reach**2
        frames = tangent_frames(laplacian.normals)
        matrix = connection_laplacian(laplacian.stiffness, laplacian.normals, frames, mass)
        load = np.zeros(2000, dtype=complex)
        load[[7, 900]] = 1.0, 1j
        exact = splu(matrix.tocsc()).solve(load)
        assert np.abs(exact).min() < 1e-3 * np.abs(exact).max()
        solver = TwoGrid(matrix, mass, laplacian.points, lambda stage, fraction: None)
        found = solver.solve(load, np.ones(2000, dtype=bool), lambda stage, fraction: None)
        assert np.max(np.abs(found - exact) / np.abs(exact)) < 1e-3

    def test_points_that_nothing_is_coupled_with_keep_their_own(self, square):
        rows = np.r_[:1600, -1]  # a row of zeros after those of the square
        stiffness = square.stiffness.copy()
        stiffness.resize(1601, 1601)
        normals, points = square.normals[rows], square.points[rows]
        mass = np.append(square.areas, 1e-30)
        matrix = connection_laplacian(stiffness, normals, tangent_frames(normals), mass)
        solver = TwoGrid(matrix, mass, points, lambda stage, fraction: None)
        load = np.zeros(1601, dtype=complex)
        load[[5, 1600]] = 1.0, 1j
        found = solver.solve(load, np.arange(1601) < 1600, lambda stage, fraction: None)
        assert found[1600] == pytest.approx(1j / 1e-30)
        residual = np.linalg.norm((matrix @ found - load)[:1600])
        assert residual < 1e-2

    def test_what_does_not_converge_is_an_error(self, square, monkeypatch):
        monkeypatch.setattr("core.algebra.two_grid._STEPS", 1)
        with pytest.raises(core.SolverError, match="in 1 steps"):
            core.distance.transport(square, [0], [1.0, 0.0, 0.0])


class TestTransport:
    def test_constant_on_a_plane(self, square):
        found = core.distance.transport(square, [5, 800], [3.0, 4.0, 7.0])
        assert_allclose(found, np.tile([0.6, 0.8, 0.0], (1600, 1)), atol=1e-6)

    def test_along_great_circles(self, sphere):
        points, source = sphere.points, 7
        direction = np.cross(points[source], [0.0, 0.0, 1.0])
        found = core.distance.transport(sphere, [source], direction)
        # The rotation that takes the source to a point along the great circle takes the direction with it.
        direction /= np.linalg.norm(direction)
        total = points + points[source]
        exact = direction - (points @ direction / (1.0 + points @ points[source]))[:, None] * total
        near = points @ points[source] > -0.9
        cosine = np.einsum("ij,ij->i", found, exact)[near]
        assert np.degrees(np.sqrt(np.mean(np.arccos(np.clip(cosine, -1.0, 1.0)) ** 2))) < 0.5
        assert_allclose(np.linalg.norm(found, axis=1), 1.0)
        assert np.abs(np.einsum("ij,ij->i", found, sphere.normals)).max() < 1e-9

    def test_around_a_cylinder(self):
        points = open_cylinder()[::2]
        laplacian = core.build_laplacian(points)
        axis = np.argmin(np.abs(laplacian.normals).mean(axis=0))
        found = core.distance.transport(laplacian, [len(points) // 2], np.eye(3)[axis])
        assert_allclose(found[:, axis], 1.0, atol=1e-3)

    def test_the_nearest_of_several_sources_counts(self, square):
        x = square.points[:, 0]
        left, right = np.argmin(x), np.argmax(x)
        found = core.distance.transport(square, [left, right], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
        near = np.linalg.norm(square.points[:, None] - square.points[[left, right]], axis=2)
        assert found[near[:, 0] < 0.5 * near[:, 1], 0].min() > 0.95
        assert found[near[:, 1] < 0.5 * near[:, 0], 1].min() > 0.95

    @pytest.mark.parametrize(
        ("sources", "directions", "message"),
        [
            ([], [1.0, 0.0, 0.0], "no points with directions"),
            ([0, 0], [1.0, 0.0, 0.0], "named more than once"),
            ([0], [1.0, 0.0], "have the shape"),
            ([0], [np.nan, 0.0, 0.0], "not finite"),
            ([0, 1], [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]], "1 of 2 directions"),
            ([0], [0.0, 0.0, 0.0], "1 of 1 directions"),
        ],
    )
    def test_wrong_arguments(self, square, sources, directions, message):
        with pytest.raises(core.InvalidPointsError, match=message):
            core.distance.transport(square, sources, directions)


class TestLogarithmicMap:
    @pytest.mark.parametrize(
        ("sample", "mean", "most"), [(square_random, 0.012, 0.08), (lambda count: square_grid(32), 0.03, 0.08)]
    )
    def test_on_a_plane_differences_of_coordinates(self, sample, mean, most):
        laplacian = core.build_laplacian(sample(2000))
        source = np.argmin(np.linalg.norm(laplacian.points - laplacian.points.mean(axis=0), axis=1))
        found = core.distance.logarithmic_map(laplacian, source, [1.0, 0.0, 0.0])
        exact = (laplacian.points - laplacian.points[source])[:, :2] * [1.0, laplacian.normals[source, 2]]
        error = np.linalg.norm(found - exact, axis=1) / np.ptp(exact[:, 0])
        assert np.sqrt(np.mean(error**2)) < mean  # on a grid shortest paths keep to its directions
        assert error.max() < most

    def test_on_a_sphere_distance_and_azimuth(self, sphere):
        direction = np.array([0.0, 0.3, 1.0])
        found = core.distance.logarithmic_map(sphere, 7, direction)
        exact, distance = exact_map(sphere, 7, direction)
        error = np.linalg.norm(found - exact, axis=1)[distance < 2.6]
        assert np.sqrt(np.mean(error**2)) < 0.025
        assert_allclose(found[7], 0.0)

    def test_a_cylinder_unrolls(self):
        around, height = np.random.default_rng(0).uniform((0.0, 0.0), (2.0 * np.pi, 3.0), (3000, 2)).T
        points = np.column_stack([np.cos(around), np.sin(around), height])
        laplacian = core.build_laplacian(points)
        source = np.argmin(np.hypot(around - np.pi, height - 1.5))
        found = core.distance.logarithmic_map(laplacian, source, [0.0, 0.0, 1.0])
        out = np.sign(laplacian.normals[source, :2] @ points[source, :2])
        exact = np.column_stack([height - height[source], -out * (around - around[source])])
        near = np.abs(around - np.pi) < 2.0
        error = np.linalg.norm(found - exact, axis=1)[near]
        assert np.sqrt(np.mean(error**2)) < 0.025
        assert np.quantile(error, 0.99) < 0.1

    def test_a_direction_turns_the_map(self, sphere):
        normal = sphere.normals[7]
        first = np.cross(normal, [1.0, 0.0, 0.0])
        along, across = (core.distance.logarithmic_map(sphere, 7, axis) for axis in (first, np.cross(normal, first)))
        assert_allclose(across, np.column_stack([along[:, 1], -along[:, 0]]), atol=1e-2)

    def test_stages_are_reported(self):
        laplacian, reports = core.build_laplacian(random_sphere(600)), []
        core.distance.logarithmic_map(laplacian, 7, progress=lambda stage, fraction: reports.append(stage))
        assert {"Equations", "Factors", "Directions", "Lengths", "Distance"} == set(reports)

    def test_wrong_source(self, square):
        with pytest.raises(core.InvalidPointsError, match="whole numbers below"):
            core.distance.logarithmic_map(square, 1600)
