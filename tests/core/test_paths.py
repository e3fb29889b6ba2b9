import numpy as np
import pytest
from scipy.integrate import solve_ivp

import core
from benchmarks.samplings import fibonacci_sphere, square_random, torus_points


def length(laplacian, start, end):
    return core.distance.polygon_length(core.distance.geodesic_path(laplacian, start, end))


def test_on_the_sphere_paths_are_great_circles(operators):
    laplacian = operators("random sphere")
    points, rng = laplacian.points, np.random.default_rng(2)
    pairs = rng.integers(0, len(points), (6, 2)).tolist()
    pairs += [(start, int((points @ points[start]).argmin())) for start in (5, 77)]  # nearly antipodal
    for start, end in pairs:
        exact = np.arctan2(np.linalg.norm(np.cross(points[start], points[end])), points[start] @ points[end])
        path = core.distance.geodesic_path(laplacian, start, end)
        assert core.distance.polygon_length(path) == pytest.approx(exact, rel=1e-3)
        np.testing.assert_array_equal(path[[0, -1]], points[[start, end]])
        assert np.abs(np.linalg.norm(path, axis=1) - 1.0).max() < 1e-3


def test_it_is_the_same_both_ways(operators):
    laplacian = operators("random sphere")
    assert length(laplacian, 10, 2000) == pytest.approx(length(laplacian, 2000, 10), rel=1e-4)


def geodesic_of_torus(angle, direction, reach, major=1.0, minor=0.4):
    """End of a geodesic of given length from the outer equator, by the equations of Christoffel symbols."""

    def slope(_, state):
        _, v, du, dv = state
        width = major + minor * np.cos(v)
        return [du, dv, 2.0 * minor * np.sin(v) / width * du * dv, -width * np.sin(v) / minor * du * du]

    begin = [angle, 0.0, np.cos(direction) / (major + minor), np.sin(direction) / minor]
    u, v = solve_ivp(slope, (0.0, reach), begin, rtol=1e-10, atol=1e-12).y[:2, -1]
    width = major + minor * np.cos(v)
    return [width * np.cos(u), width * np.sin(u), minor * np.sin(v)]


def test_geodesics_of_the_torus():
    starts = [[1.4 * np.cos(a), 1.4 * np.sin(a), 0.0] for a in range(4)]
    ends = [geodesic_of_torus(a, direction, 1.1) for a, direction in enumerate((0.7, -0.9, 1.3, 2.2))]
    laplacian = core.build_laplacian(np.concatenate([starts, ends, torus_points(3000, seed=4)]))
    for number in range(4):
        assert length(laplacian, number, 4 + number) == pytest.approx(1.1, rel=3e-3)


def test_on_a_cylinder_they_are_helices():
    rng = np.random.default_rng(5)
    angle, z = rng.uniform(0.0, 2.0 * np.pi, 2000), rng.uniform(0.0, 2.0, 2000)
    laplacian = core.build_laplacian(np.column_stack([np.cos(angle), np.sin(angle), z]))
    for start, end in rng.integers(0, 2000, (5, 2)):
        across = np.abs((angle[end] - angle[start] + np.pi) % (2.0 * np.pi) - np.pi)
        assert length(laplacian, start, end) == pytest.approx(np.hypot(across, z[end] - z[start]), rel=1e-3)


def test_it_leads_around_a_hole():
    """Around a disc of radius 0.2 from 0.4 on one side of its middle to 0.4 on the other: two tangents and an arc."""
    points = square_random(2500, 3)
    points = points - 0.5 * (points.min(axis=0) + points.max(axis=0))
    points = points[np.hypot(*points[:, :2].T) > 0.2]
    ends = [[-0.4, 0.0, 0.0], [0.4, 0.0, 0.0]]
    laplacian = core.build_laplacian(np.concatenate([ends, points]))
    path = core.distance.geodesic_path(laplacian, 0, 1)
    exact = 2.0 * np.sqrt(0.4**2 - 0.2**2) + 0.2 * (np.pi - 2.0 * np.arccos(0.5))
    assert core.distance.polygon_length(path) == pytest.approx(exact, rel=0.02)
    assert np.hypot(*path[:, :2].T).min() > 0.18


def test_it_follows_the_scale_and_translation():
    points = core.example_sphere()
    before = core.distance.geodesic_path(core.build_laplacian(points), 3, 500)
    after = core.distance.geodesic_path(core.build_laplacian(5.0 * points + 7.0), 3, 500)
    np.testing.assert_allclose(after, 5.0 * before + 7.0, atol=1e-4)


def test_a_point_to_itself_is_no_way():
    laplacian = core.build_laplacian(core.example_sphere())
    assert core.distance.geodesic_path(laplacian, 4, 4).shape == (2, 3)
    assert length(laplacian, 4, 4) == 0.0


def test_ends_on_two_components_or_none_are_refused():
    points = np.concatenate([fibonacci_sphere(300), fibonacci_sphere(300) + [4.0, 0.0, 0.0], [[2.0, 0.0, 9.0]]])
    laplacian = core.build_laplacian(points)
    with pytest.raises(core.ComponentError, match="0 and 400 lie on two components"):
        core.distance.geodesic_path(laplacian, 0, 400)
    with pytest.raises(core.InvalidPointsError, match="1 of the 2 ends"):
        core.distance.geodesic_path(laplacian, 0, 600)
    for wrong in (-1, 601, 1.5, None):
        with pytest.raises(core.InvalidPointsError, match="whole numbers from 0 to 600"):
            core.distance.geodesic_path(laplacian, 0, wrong)
