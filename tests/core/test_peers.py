"""The peers of the evaluation that need no packages, against answers known by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.spatial import ConvexHull, Voronoi

import core
from benchmarks.peers import METHODS, Operator, build, sphere_triangles
from benchmarks.peers.check import HEADER, rows
from benchmarks.peers.clouds import voronoi_areas
from benchmarks.peers.operator import Unsymmetric
from benchmarks.samplings import (
    fibonacci_sphere,
    icosahedral_sphere,
    random_sphere,
    sphere_eigenvalues,
    square_grid,
    square_random,
)

OWN = [name for name, method in METHODS.items() if not method.packages]


def grid_triangles(side):
    corner = np.arange(side * side).reshape(side, side)
    a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]))
    return np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def away_from_boundary(points, distance):
    return (np.minimum(points[:, :2], 1.0 - points[:, :2]) > distance).all(axis=1)


def test_cotangent_on_a_flat_grid_is_the_five_point_laplacian():
    side = 9
    points = square_grid(side)
    operator = build("cotangent", points, grid_triangles(side))
    inner = away_from_boundary(points, 1e-6)
    step = 1.0 / (side - 1)
    np.testing.assert_allclose(operator.areas[inner], step**2)
    assert operator.areas.sum() == pytest.approx(1.0)
    row = operator.stiffness[[side * 4 + 4]].toarray().reshape(side, side)
    expected = np.zeros((side, side))
    expected[4, 4] = 4.0
    expected[[3, 5, 4, 4], [4, 4, 3, 5]] = -1.0
    np.testing.assert_allclose(row, expected, atol=1e-13)
    np.testing.assert_allclose(operator.apply(points[:, 0] ** 2 - 3.0 * points[:, 1] ** 2)[inner], -4.0)


def test_levy_is_cotangent_where_all_areas_are_equal():
    points = icosahedral_sphere(1)
    triangles = sphere_triangles(points)
    values = np.random.default_rng(0).standard_normal(len(points))
    expected = build("cotangent", points, triangles).apply(values)
    np.testing.assert_allclose(build("levy", points, triangles).apply(values), expected)


@pytest.mark.parametrize("name", ["cotangent", "levy", "pcl", "ours", "ours_paper"])
def test_symmetric_operators(name):
    points = random_sphere(600)
    operator = build(name, points, sphere_triangles(points))
    size = abs(operator.stiffness).max()
    assert operator.symmetric
    assert abs(operator.stiffness - operator.stiffness.T).max() < 1e-12 * size
    assert np.abs(operator.stiffness.sum(axis=1)).max() < 1e-11 * size


def test_voronoi_areas_are_those_of_the_diagram():
    sites = np.random.default_rng(1).random((200, 2))
    diagram = Voronoi(sites)
    inner = np.flatnonzero((np.abs(sites - 0.5) < 0.2).all(axis=1))
    expected = [ConvexHull(diagram.vertices[diagram.regions[diagram.point_region[i]]]).volume for i in inner]
    others = np.array([np.delete(sites, i, axis=0) - sites[i] for i in inner])
    np.testing.assert_allclose(voronoi_areas(others, np.full(len(inner), 2.0)), expected, rtol=1e-9)


def test_voronoi_cell_ends_at_its_reach():
    octagon = 8.0 * np.tan(np.pi / 8.0)  # of inradius one
    assert voronoi_areas(np.array([[[8.0, 0.0]]]), np.array([1.0])) == pytest.approx([octagon])
    # A wall at x = 0.5, seen twice in the same direction: only the nearer one cuts.
    half = voronoi_areas(np.array([[[1.0, 0.0], [3.0, 0.0]]]), np.array([1.0]))
    assert half == pytest.approx(voronoi_areas(np.array([[[1.0, 0.0]]]), np.array([1.0])))
    assert half < octagon


def test_areas_of_pcl_on_a_plane():
    points = square_grid(15)
    np.testing.assert_allclose(build("pcl", points).areas[away_from_boundary(points, 0.15)], 1.0 / 14**2)

    points = square_random(900)
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    diagram = Voronoi(points[:, :2])
    inner = np.flatnonzero(away_from_boundary(points, 0.25))
    expected = [ConvexHull(diagram.vertices[diagram.regions[diagram.point_region[i]]]).volume for i in inner]
    np.testing.assert_allclose(build("pcl", points @ turn).areas[inner], expected, rtol=1e-9)


def test_spectrum_of_pcl_is_that_of_the_heat_kernel():
    operator = build("pcl", fibonacci_sphere(1000))
    time, exact = operator.areas.mean(), sphere_eigenvalues(16)
    np.testing.assert_allclose(operator.eigenvalues(16), (1.0 - np.exp(-time * exact)) / time, rtol=1e-2, atol=1e-9)


def test_gmls_is_exact_for_quadratics_on_a_plane():
    flat = square_random(500)
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    x, y = flat[:, 0], flat[:, 1]
    operator = build("gmls2", flat @ turn)
    np.testing.assert_allclose(operator.apply(1.0 + x - 2.0 * y + 3.0 * x * x + x * y - 5.0 * y * y), -4.0, rtol=1e-7)
    assert operator.areas is None
    assert not operator.symmetric


def test_gmls_sees_the_curvature_of_a_surface():
    points = fibonacci_sphere(1000)
    x = points[:, 0]
    assert np.linalg.norm(build("gmls2", points).apply(x) + 2.0 * x) < 1e-2 * np.linalg.norm(2.0 * x)


@pytest.mark.parametrize("name", OWN)
def test_poisson_on_a_sphere(name):
    points = fibonacci_sphere(2100)  # on fewer the paper's kernel reaches over the horizon
    x = points[:, 0]
    solution = build(name, points, sphere_triangles(points)).solve_poisson(2.0 * x + 1.0)  # the mean is taken off
    assert np.linalg.norm(solution - x) < 2e-2 * np.linalg.norm(x)
    assert abs(solution.mean()) < 1e-3


@pytest.mark.parametrize("name", ["cotangent", "pcl", "gmls2"])
def test_poisson_solves_its_own_equations(name):
    points = fibonacci_sphere(800)
    operator = build(name, points, sphere_triangles(points))
    solution = operator.solve_poisson(points[:, 2])
    assert np.ptp(operator.apply(solution) + points[:, 2]) < 1e-6  # a constant


@pytest.mark.parametrize("name", ["cotangent", "levy", "pcl"])
def test_eigenpairs(name):
    points = random_sphere(500)
    operator = build(name, points, sphere_triangles(points))
    modes = operator.eigenpairs(8)
    dense = operator.stiffness.toarray() / np.sqrt(np.outer(operator.mass, operator.mass))
    np.testing.assert_allclose(modes.eigenvalues, np.linalg.eigvalsh(dense)[:8], rtol=1e-7, atol=1e-8)
    residual = operator.apply(modes.eigenvectors[:, 5]) + modes.eigenvalues[5] * modes.eigenvectors[:, 5]
    assert np.abs(residual).max() < 1e-4 * modes.eigenvalues[5]
    gram = modes.eigenvectors.T @ (operator.mass[:, None] * modes.eigenvectors)
    np.testing.assert_allclose(gram, np.eye(8), atol=1e-8)
    assert (modes.complex, modes.negative) == (0, 0)


def test_odd_eigenvalues_are_counted():
    # Differences on a ring, with an upwind part that makes eigenvalues complex; then a shift that makes some negative.
    n = 40
    step = sparse.csr_array((np.ones(n), (np.arange(n), (np.arange(n) + 1) % n)), shape=(n, n))
    ring = 2.0 * sparse.eye_array(n) - step - step.T
    operator = Unsymmetric(np.zeros((n, 3)), (ring + 0.5 * (step - step.T)).tocsr(), np.ones(n), None)
    modes = operator.eigenpairs(5)
    assert (modes.complex, modes.negative) == (4, 0)
    angle = 2.0 * np.pi * np.array([0, 1, 1, 2, 2]) / n
    np.testing.assert_allclose(modes.eigenvalues, 2.0 - 2.0 * np.cos(angle), atol=1e-8)

    symmetric = Operator(operator.points, ring.tocsr(), np.ones(n), np.ones(n))
    assert symmetric.eigenpairs(5).negative == 0
    below = replace(symmetric, stiffness=(ring - 0.08 * sparse.eye_array(n)).tocsr())
    assert below.eigenpairs(5).negative == 3  # 2 - 2 cos(angle) is 0, 0.025 twice, and 0.098 twice


def test_ours_is_the_product():
    points = random_sphere(500)
    operator, laplacian = build("ours", points), core.build_laplacian(points)
    x = points[:, 0]
    np.testing.assert_array_equal(operator.apply(x), laplacian.apply(x))
    np.testing.assert_array_equal(operator.eigenvalues(9), laplacian.eigenpairs(9).eigenvalues)
    np.testing.assert_array_equal(operator.areas, laplacian.areas)
    paper = core.paper.build_laplacian(points)
    np.testing.assert_array_equal(build("ours_paper", points).apply(x), paper.apply(x))


def test_meshes_are_asked_for():
    with pytest.raises(ValueError, match="cotangent needs the triangles"):
        build("cotangent", random_sphere(100))


def test_rows_of_the_check():
    table = list(rows(500, ["cotangent", "gmls2"]))
    assert [len(row) for row in table] == [len(HEADER)] * 4
    assert not any("(" in cell for row in table for cell in row)  # earlier figures are of 8,000 points
