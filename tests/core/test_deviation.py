"""How far points are from the surface of another cloud, against surfaces whose distance is known."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere, square_random


def spacing_of(laplacian):
    return np.sqrt(np.median(laplacian.areas))


@pytest.mark.parametrize("name", ["even sphere", "random sphere"])
@pytest.mark.parametrize("radius", [1.0, 1.02, 1.3, 0.9])
def test_spheres_of_other_radii(operators, name, radius):
    laplacian = operators(name)
    normals = fibonacci_sphere(890)
    found = core.measure.surface_deviation(laplacian, radius * normals, normals)
    assert found.known.all()
    np.testing.assert_allclose(found.distance, radius - 1.0, atol=0.01 * spacing_of(laplacian))


def test_signs_are_those_of_the_normals(operators):
    normals = fibonacci_sphere(500)
    out, back = (
        core.measure.surface_deviation(operators("even sphere"), 1.1 * normals, side * normals) for side in (3.0, -1.0)
    )
    np.testing.assert_allclose(back.distance, -out.distance, atol=1e-9)


def test_flat_squares_at_a_distance(operators):
    laplacian = operators("square grid")
    points = square_random(500, 5) + [0.0, 0.0, 0.07]
    inside = np.abs(points[:, :2] - 0.5).max(axis=1) < 0.5 - spacing_of(laplacian)
    found = core.measure.surface_deviation(laplacian, points, np.tile([0.0, 0.0, 1.0], (500, 1)))
    assert found.known[inside].all()
    np.testing.assert_allclose(found.distance[inside], 0.07, atol=1e-6)


def test_slanted_normals_measure_along_themselves(operators):
    laplacian = operators("square grid")
    points = np.array([[0.4, 0.5, 0.1], [0.5, 0.6, -0.1]])
    found = core.measure.surface_deviation(laplacian, points, [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]])
    np.testing.assert_allclose(found.distance, [0.1 * np.sqrt(2.0), -0.1 * np.sqrt(2.0)], atol=1e-6)


def test_points_beside_the_other_surface_are_not_compared(operators):
    laplacian = operators("square grid")
    beside = np.array([[1.3, 0.5, 0.01], [0.5, -0.2, 0.01], [0.5, 0.5, 0.01]])
    found = core.measure.surface_deviation(laplacian, beside, np.tile([0.0, 0.0, 1.0], (3, 1)))
    assert found.known.tolist() == [False, False, True]
    assert found.distance[:2].tolist() == [0.0, 0.0]


def test_clouds_that_are_far_apart():
    """As when one is in the coordinates of a national grid, and the other is not: nothing is met."""
    normals = random_sphere(750, 0)
    rough = normals * (1.0 + 0.2 * np.sin(5.0 * normals[:, :1]) * np.sin(7.0 * normals[:, 1:2]))
    laplacian = core.build_laplacian(rough)
    for far in (1e2, 1e4, 4e6, 1e9):
        found = core.measure.surface_deviation(laplacian, normals + [0.1 * far, far, 0.0], normals)
        assert not found.known.any()
        assert not found.distance.any()


def test_normals_along_the_surface_meet_nothing(operators):
    laplacian = operators("square grid")
    found = core.measure.surface_deviation(laplacian, [[0.5, 0.5, 0.2], [0.4, 0.5, 0.2]], [[1.0, 0.0, 0.0]] * 2)
    assert not found.known.any()


def test_greatest_distance(operators):
    normals = fibonacci_sphere(400)
    points = normals * np.where(normals[:, 2:] > 0.0, 1.05, 1.2)
    found = core.measure.surface_deviation(operators("even sphere"), points, normals, 0.1)
    assert np.array_equal(found.known, normals[:, 2] > 0.0)


@pytest.mark.parametrize("greatest", [0.0, -1.0, np.nan, "far"])
def test_wrong_greatest_distance(operators, greatest):
    with pytest.raises(core.PointCloudError, match="greatest distance"):
        core.measure.surface_deviation(operators("even sphere"), np.eye(3), np.eye(3), greatest)


def test_normals_that_do_not_fit(operators):
    with pytest.raises(core.InvalidPointsError, match="do not fit 4 points"):
        core.measure.surface_deviation(operators("even sphere"), np.eye(4, 3), np.eye(3))


class TestNearest:
    @pytest.mark.parametrize("radius", [0.05, 0.7, 1.0, 1.3, 3.0, 100.0])
    def test_spheres(self, operators, radius):
        laplacian = operators("random sphere")
        found = core.measure.surface_deviation(laplacian, radius * random_sphere(500, 77), None)
        assert found.known.all()
        np.testing.assert_allclose(found.distance, abs(radius - 1.0), atol=0.01 * spacing_of(laplacian))

    def test_a_torus_from_all_around(self, operators):
        laplacian = operators("random torus")
        places = np.random.default_rng(3).uniform(-1.5, 1.5, (800, 3))
        ring = np.hypot(np.hypot(*laplacian.points[:, :2].T) - 1.0, laplacian.points[:, 2]).mean()
        exact = np.abs(np.hypot(np.hypot(*places[:, :2].T) - 1.0, places[:, 2]) - ring)
        found = core.measure.surface_deviation(laplacian, places, None)
        np.testing.assert_allclose(found.distance, exact, atol=0.05 * spacing_of(laplacian))

    def test_where_the_surface_ends_it_is_that_of_the_nearest_point(self, operators):
        laplacian = operators("square grid")
        places = np.array([[1.5, 0.5, 0.0], [0.5, -0.4, 0.3], [0.437, 0.512, 0.2]])
        found = core.measure.surface_deviation(laplacian, places, None)
        nearest = cKDTree(laplacian.points).query(places)[0]
        assert np.all(found.distance <= nearest)
        np.testing.assert_allclose(found.distance, [0.5, 0.5, 0.2], atol=spacing_of(laplacian))
        assert found.distance[2] == pytest.approx(0.2, abs=1e-6)

    def test_greatest_distance(self, operators):
        places = [[0.0, 0.0, 1.05], [0.0, 0.0, 1.2]]
        found = core.measure.surface_deviation(operators("even sphere"), places, None, 0.1)
        assert found.known.tolist() == [True, False]
        assert found.distance[1] == 0.0


def sheet(count, seed, turn=0.0, noise=0.0):
    """Return random points of a square of two, turned from level by an angle about its X axis."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-1.0, 1.0, (2, count))
    z = noise * rng.normal(size=count)
    return np.column_stack([x, np.cos(turn) * y - np.sin(turn) * z, np.sin(turn) * y + np.cos(turn) * z])


class TestOuterSides:
    @pytest.mark.parametrize("name", ["even sphere", "random torus"])
    def test_bodies_have_one(self, operators, name):
        laplacian = operators(name)
        assert np.all(core.measure.outer_sides(laplacian) == 1.0)
        assert np.all(core.measure.outer_sides(laplacian.toward(-laplacian.normals)) == -1.0)

    @pytest.mark.parametrize(
        ("degrees", "known"), [(0.0, True), (45.0, True), (70.0, True), (86.0, False), (90.0, False)]
    )
    def test_sheets_have_one_if_they_are_not_upright(self, degrees, known):
        laplacian = core.build_laplacian(sheet(900, 4, np.radians(degrees), 0.001))
        assert np.all(core.measure.outer_sides(laplacian) == float(known))

    def test_points_left_out_and_those_in_a_volume_have_none(self):
        points = np.concatenate([random_sphere(1500, 2), [[0.0, 0.0, 2.0]]])
        laplacian = core.build_laplacian(points)
        assert laplacian.component[-1] < 0
        assert core.measure.outer_sides(laplacian)[-1] == 0.0
        laplacian = core.build_laplacian(np.random.default_rng(5).random((1500, 3)))
        volume = laplacian.doubt == core.Doubt.VOLUME
        assert volume.any()
        assert not core.measure.outer_sides(laplacian)[volume].any()

    def test_beside_a_body(self, operators):
        laplacian, normals = operators("even sphere"), random_sphere(300, 6)
        flip = np.where(normals[:, :1] > 0.0, 1.0, -1.0)
        sides = core.measure.sides_beside(laplacian, core.measure.outer_sides(laplacian), 1.2 * normals, flip * normals)
        np.testing.assert_array_equal(sides, flip[:, 0])
