import numpy as np
import pytest

import core
from benchmarks.samplings import random_sphere
from core.measure.regions import _edge, _find_line, _Line, _second, _slope, _step, measures_of


def cap(points, degrees, axis=(0.3, -0.5, 0.8)):
    return points @ axis / np.linalg.norm(axis) > np.cos(np.radians(degrees))


@pytest.mark.parametrize("degrees", [40.0, 60.0, 90.0])
def test_a_cap_of_random_points_has_the_area_and_the_circle_of_a_sphere(operators, degrees):
    laplacian = operators("random sphere")
    found = core.measure.measure_region(laplacian, cap(laplacian.points, degrees))
    angle = np.radians(degrees)
    area, length = 2.0 * np.pi * (1.0 - np.cos(angle)), 2.0 * np.pi * np.sin(angle)
    assert found.area == pytest.approx(area, rel=0.012)
    assert abs(found.area - area) < found.area_uncertainty < 0.05 * area
    assert found.boundary_length == pytest.approx(length, rel=0.012)
    middle = 0.5 * (1.0 + np.cos(angle)) * np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    np.testing.assert_allclose(found.centroid, middle, atol=0.02)


def test_the_line_bends_as_the_circle_does(operators):
    """A window that is chosen by the curvature of its own parabola makes it a quarter larger."""
    measures = measures_of(operators("random sphere"))
    bend = []
    for axis in random_sphere(12, 1):
        _, line = _find_line(measures, measures.laplacian.points @ axis > np.cos(np.radians(50.0)), lambda done: None)
        bend.append(np.mean(line.bend) * np.tan(np.radians(50.0)))
    assert np.mean(bend) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_distances_from_a_circle_in_the_plane_are_exact(operators, side):
    laplacian = operators("square grid")
    points, spacing = laplacian.surface_points, measures_of(laplacian).spacing.mean()
    middle, radius, angle = points.mean(axis=0), 10.0 * spacing, np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    outward = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    same = np.ones(60)
    up = same[:, None] * laplacian.normals[0]
    rest = side / radius * same, spacing * same, np.zeros(60, dtype=np.int64), same[:0]
    line = _Line(middle + radius * outward, up, -side * outward, *rest)
    near = np.abs(np.linalg.norm(points - middle, axis=1) - radius) < 0.4 * radius
    rows, distance, _ = line.distances(laplacian, np.flatnonzero(near))
    exact = side * (radius - np.linalg.norm(points[rows] - middle, axis=1))
    np.testing.assert_allclose(distance, exact, atol=1e-12 * radius)


def test_a_third_of_a_torus(operators):
    laplacian = operators("random torus")
    around = np.arctan2(laplacian.points[:, 1], laplacian.points[:, 0]) % (2.0 * np.pi)
    found = core.measure.measure_region(laplacian, around < 2.0 * np.pi / 3.0)
    assert found.area == pytest.approx(4.0 * np.pi**2 * 0.4 / 3.0, rel=0.01)
    assert found.boundary_length == pytest.approx(4.0 * np.pi * 0.4, rel=0.015)


def test_a_band_has_two_circles(operators):
    laplacian = operators("even sphere")
    z = laplacian.points[:, 2]
    found = core.measure.measure_region(laplacian, np.flatnonzero((z > -0.4) & (z < 0.5)))
    assert found.area == pytest.approx(2.0 * np.pi * 0.9, rel=0.01)
    assert found.boundary_length == pytest.approx(2.0 * np.pi * (np.sqrt(0.84) + np.sqrt(0.75)), rel=0.01)


def test_the_other_side_of_a_thin_wall_is_no_part():
    """A plate of two sheets three spacings apart, with half of one of them chosen."""
    u, v = np.meshgrid(np.arange(60.0), np.arange(40.0), indexing="ij")
    sheet = np.column_stack([u.ravel(), v.ravel(), 0.0 * u.ravel()])
    points = np.concatenate([sheet, sheet + [0.0, 0.0, 3.0]])
    up = np.repeat([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]], len(sheet), axis=0)
    laplacian = core.build_laplacian(points, up)
    members = (points[:, 2] > 1.0) & (points[:, 0] < 29.6)
    found = core.measure.measure_region(laplacian, members)
    assert found.area == pytest.approx(laplacian.areas[members].sum(), rel=0.01)
    assert found.boundary_length == pytest.approx(40.0 + 2.0 * 30.0 + 40.0, rel=0.03)


def test_areas_of_a_part_and_of_the_rest_add_up(operators):
    laplacian = operators("random sphere")
    members = cap(laplacian.points, 50.0)
    one, other = (core.measure.measure_region(laplacian, part) for part in (members, ~members))
    assert one.area + other.area == pytest.approx(laplacian.areas.sum(), rel=1e-3)
    assert one.boundary_length == pytest.approx(other.boundary_length, rel=2e-3)


def test_the_boundary_of_the_surface_counts_next_to_members(operators):
    """Half a unit square: a line across of length 1, and two unit sides' worth of the boundary."""
    laplacian = operators("random square")
    low = laplacian.points.min(axis=0).round()
    left = laplacian.points[:, 0] - low[0] < 0.5
    found = core.measure.measure_region(laplacian, left)
    assert found.area == pytest.approx(0.5, rel=0.015)
    assert found.boundary_length == pytest.approx(3.0, rel=0.04)
    assert core.measure.measure_region(laplacian, np.ones(len(left), dtype=bool)).boundary_length == pytest.approx(
        4.0, rel=0.03
    )


def test_all_of_a_closed_surface_has_no_boundary(operators):
    laplacian = operators("even sphere")
    found = core.measure.measure_region(laplacian, np.ones(len(laplacian.points), dtype=bool))
    assert found.area == pytest.approx(laplacian.areas.sum(), rel=1e-12)
    assert found.boundary_length == 0.0
    assert 0.0 < found.area_uncertainty < 0.02 * found.area
    np.testing.assert_allclose(found.centroid, 0.0, atol=1e-3)


def test_shares_weigh_the_areas(operators):
    laplacian = operators("even sphere")
    share = 0.5 + 0.5 * laplacian.points[:, 2]
    found = core.measure.measure_region(laplacian, share)
    assert found.area == pytest.approx(2.0 * np.pi, rel=1e-3)
    np.testing.assert_allclose(found.centroid, [0.0, 0.0, 1.0 / 3.0], atol=1e-3)


def test_it_follows_rotation_translation_scale_and_order():
    points, rng = core.example_sphere(), np.random.default_rng(1)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    order = rng.permutation(len(points))
    members = points[:, 2] > 0.2
    before = core.measure.measure_region(core.build_laplacian(points), members)
    moved = (3.0 * points @ turn + [10.0, -4.0, 2.0])[order]
    after = core.measure.measure_region(core.build_laplacian(moved), members[order])
    assert after.area == pytest.approx(9.0 * before.area, rel=1e-6)
    assert after.boundary_length == pytest.approx(3.0 * before.boundary_length, rel=1e-6)
    np.testing.assert_allclose(after.centroid, 3.0 * before.centroid @ turn + [10.0, -4.0, 2.0], atol=1e-5)


def test_the_step_and_its_kernels_have_the_moments_that_the_formulas_take():
    x = np.linspace(-1.0, 1.0, 20_001)
    step, slope, second = _step(x), _slope(x), _second(x)
    assert (step[0], step[10_000], step[-1]) == (0.0, 0.5, 1.0)
    np.testing.assert_allclose(np.gradient(step, x)[1:-1], slope[1:-1], atol=1e-7)
    np.testing.assert_allclose(np.gradient(slope, x)[1:-1], second[1:-1], atol=1e-6)
    assert 2.0 * np.mean(x**2 * slope) == pytest.approx(1.0 / 7.0, rel=1e-3)
    x = np.linspace(0.0, 1.0, 20_001)
    assert np.mean(_edge(x)) == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize(
    ("members", "text"),
    [
        (np.zeros(800, dtype=bool), "None of the 800 points"),
        (np.full(800, 2.0), "reach from 2 to 2"),
        (np.full(3, 0.5), "share from 0 to 1"),
        ([900], "whole numbers below 800"),
    ],
)
def test_members_that_are_none_are_refused(members, text):
    laplacian = core.build_laplacian(core.example_sphere())
    with pytest.raises(core.InvalidPointsError, match=text):
        core.measure.measure_region(laplacian, members)


def test_points_left_out_do_not_count():
    points = random_sphere(2000)
    alone = core.measure.measure_region(core.build_laplacian(points), points[:, 2] > 0.3)
    far = np.concatenate([points, 3.0 * np.eye(3), points[:5] * 1.7])
    laplacian = core.build_laplacian(far)
    assert np.count_nonzero(laplacian.component < 0) == 8
    beside = core.measure.measure_region(laplacian, np.append(points[:, 2] > 0.3, np.ones(8, dtype=bool)))
    assert beside.area == pytest.approx(alone.area, rel=1e-6)
    assert beside.boundary_length == pytest.approx(alone.boundary_length, rel=1e-6)
    np.testing.assert_allclose(beside.centroid, alone.centroid, atol=1e-6)


def test_points_left_out_and_doubled_change_nothing():
    points = core.example_sphere()
    with_others = np.concatenate([points, [[5.0, 5.0, 5.0]], points[:3]])
    one, other = (
        core.measure.measure_region(core.build_laplacian(given), given[:, 2] > 0.2) for given in (points, with_others)
    )
    assert other.area == pytest.approx(one.area, rel=0.01)
    assert other.boundary_length == pytest.approx(one.boundary_length, rel=0.01)
    assert 0.0 < other.area_uncertainty < 0.1 * other.area


def test_the_area_of_all_is_as_uncertain_as_that_of_its_component():
    rng, points = np.random.default_rng(0), random_sphere(1500)
    laplacian = core.build_laplacian(points * (1.0 + 0.01 * rng.standard_normal((1500, 1))))
    found, parts = (
        core.measure.measure_region(laplacian, np.ones(1500, dtype=bool)),
        core.measure.measure_parts(laplacian),
    )
    assert found.area_uncertainty == pytest.approx(parts.area_uncertainties[0], rel=1e-9)
    assert found.area_uncertainty > 1e-3 * found.area


def test_the_line_of_a_sphere_is_as_long_as_its_circle_on_the_mean(operators):
    """Lines beside it are shorter: without regard to that 0.4 % would be missing from a great circle."""
    measures = measures_of(operators("even sphere"))
    points, error = measures.laplacian.points, []
    for axis in random_sphere(12, 2):
        found = core.measure.measure_region(measures.laplacian, points @ axis > 0.0)
        error.append(found.boundary_length / (2.0 * np.pi) - 1.0)
    assert abs(np.mean(error)) < 0.002


def test_lengths_are_within_their_uncertainty(operators):
    """Caps, and a square whose corners the parabolas round."""
    sphere, within, share = measures_of(operators("random sphere")), [], []
    for axis in random_sphere(10, 3):
        for degrees in (15.0, 25.0, 60.0):
            members, length = cap(sphere.laplacian.points, degrees, axis), 2.0 * np.pi * np.sin(np.radians(degrees))
            found = core.measure.measure_region(sphere.laplacian, members)
            within.append(abs(found.boundary_length - length) < found.length_uncertainty)
            share.append(found.length_uncertainty / length)
    assert np.mean(within) >= 0.9
    assert max(share[2::3]) < 0.03
    square = measures_of(operators("random square"))
    low = square.laplacian.points.min(axis=0)
    for angle in (0.2, 0.5, 0.7):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        inside = (np.abs((square.laplacian.points - low)[:, :2] @ turn - 0.5 * turn.sum(axis=0)) < 0.25).all(axis=1)
        found = core.measure.measure_region(square.laplacian, inside)
        assert abs(found.boundary_length - 2.0) < found.length_uncertainty < 0.2
