import numpy as np
import pytest

from core import LaplacianOptions, estimate_areas
from core.geometry.cloud import read_surface
from core.geometry.distances import arc_squared, bent_ways
from core.geometry.edges import find_sides


def random_cube(count, seed=0):
    """Random points of the surface of the unit cube, and their normals."""
    rng = np.random.default_rng(seed)
    points, axis = rng.random((count, 3)), rng.integers(3, size=count)
    side = rng.integers(2, size=count)
    points[np.arange(count), axis] = side
    return points, (2 * side - 1)[:, None] * np.eye(3)[axis]


def random_sphere(count, seed=0):
    points = np.random.default_rng(seed).standard_normal((count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def surface_of(points):
    return read_surface(points, LaplacianOptions(), lambda stage, fraction: None)[1]


@pytest.mark.parametrize("angle", [0.1, 0.5 * np.pi, 0.7 * np.pi])
def test_the_way_over_an_edge_has_two_legs(angle):
    rng = np.random.default_rng(0)
    (a, b), along = rng.random((2, 50)), rng.standard_normal(50)
    # One leg runs down the first plane to the edge, the other along the second one, turned by the angle.
    chord = np.stack([a + b * np.cos(angle), along, -b * np.sin(angle)])
    first, second = np.array([0.0, 0.0, 1.0]), np.array([np.sin(angle), 0.0, np.cos(angle)])
    squared = np.sum(chord**2, axis=0), first @ chord, second @ chord, np.full(50, np.cos(angle))
    none, all_ = np.zeros(50), np.ones(50)
    length, ahead = bent_ways(*squared, none, all_)
    np.testing.assert_allclose(length, (a + b) ** 2 + along**2, rtol=1e-12)
    # Unfolded into the first plane the way runs straight on.
    unfolded = chord + ahead * second[:, None]
    np.testing.assert_allclose(unfolded[:2], np.stack([a + b, along]), rtol=1e-9)
    bend = squared[2] - squared[1]
    np.testing.assert_array_equal(bent_ways(*squared, bend, all_)[0], arc_squared(*squared))
    np.testing.assert_array_equal(bent_ways(*squared, none, none)[0], arc_squared(*squared))


def test_normals_next_to_edges_are_those_of_one_side():
    points, exact = random_cube(6000)
    surface = surface_of(points)
    nearest, quadrics = surface.sample.nearest, surface.quadrics
    exact = exact[surface.sample.scaled.first]
    sides = find_sides(nearest, quadrics)

    def wrong(normals):
        return np.mean(np.abs(np.einsum("ij,ij->i", normals, exact)) < np.cos(np.radians(5.0)))

    assert wrong(quadrics.normals) > 0.25
    assert wrong(sides.normals) < 0.03


def test_a_cube_has_its_area():
    assert abs(estimate_areas(random_cube(6000)[0]).sum() / 6.0 - 1.0) < 0.002


def test_points_on_edges_have_cells_on_both_sides():
    # A fifth of the points lie on the edges, where the normal is that of either face.
    points, count = random_cube(6000)[0], 1500
    places, rng = np.random.default_rng(1).random(count), np.random.default_rng(2)
    edges = rng.integers(2, size=(count, 3)).astype(float)
    edges[np.arange(count), rng.integers(3, size=count)] = places
    assert abs(estimate_areas(np.concatenate([points, edges])).sum() / 6.0 - 1.0) < 0.01


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_a_round_surface_has_no_edges(noise):
    points = random_sphere(3000)
    spacing = np.sqrt(4.0 * np.pi / len(points))
    points *= 1.0 + noise * spacing * np.random.default_rng(1).standard_normal(len(points))[:, None]
    surface = surface_of(points)
    sides = find_sides(surface.sample.nearest, surface.quadrics)
    assert np.mean(sides.sharp > 0.5) < 0.002
