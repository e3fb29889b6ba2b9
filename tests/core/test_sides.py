"""Cells of nearest sources, and distances with a sign from curves."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import core
from benchmarks.samplings import random_sphere, square_grid


@pytest.fixture(scope="module")
def sphere():
    """Random points and 160 of the equator, which come first."""
    angle = 2.0 * np.pi * np.arange(160) / 160
    equator = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(160)])
    return core.build_laplacian(np.concatenate([equator, random_sphere(4000)]))


@pytest.fixture(scope="module")
def square():
    return core.build_laplacian(square_grid(41))


def up(laplacian):
    """1 where normals of a surface that is not turned inside out point upwards or outwards, else -1."""
    return np.sign(np.sum(laplacian.normals * laplacian.points)) or 1.0


class TestNearestSource:
    def test_cells_of_a_sphere(self, sphere):
        sources = np.array([300, 900, 1500, 3000, 4000])
        label = core.distance.nearest_source(sphere, sources)
        closeness = np.sort(sphere.points @ sphere.points[sources].T, axis=1)
        clear = closeness[:, -1] - closeness[:, -2] > 0.03
        exact = (sphere.points @ sphere.points[sources].T).argmax(axis=1)
        assert_array_equal(label[clear], exact[clear])
        assert_array_equal(label[sources], np.arange(5))

    def test_a_mask_counts_in_the_order_of_points(self, sphere):
        mask = np.zeros(4160, dtype=bool)
        mask[[900, 300]] = True
        assert_array_equal(core.distance.nearest_source(sphere, mask), core.distance.nearest_source(sphere, [300, 900]))

    def test_the_source_is_as_far_as_the_distance_says(self, sphere):
        sources = [5, 900, 3000]
        label = core.distance.nearest_source(sphere, sources)
        least, *each = (core.distance.geodesic_distance(sphere, rows) for rows in (sources, *sources))
        assert_allclose(np.array(each)[label, np.arange(4160)], least, atol=1e-12)

    def test_wrong_arguments(self, square):
        with pytest.raises(core.InvalidPointsError, match="no sources"):
            core.distance.nearest_source(square, [])
        with pytest.raises(core.InvalidPointsError, match="named more than once"):
            core.distance.nearest_source(square, [1, 1])


class TestSignedDistance:
    @pytest.mark.parametrize("step", [1, 40], ids=["all points", "four of them"])
    def test_from_the_equator_it_is_the_latitude(self, sphere, step):
        found = core.distance.signed_distance(sphere, np.arange(0, 160, step), closed=True)
        latitude = np.arcsin(sphere.points[:, 2]) * up(sphere)
        error = found - latitude
        assert np.abs(error).max() < (0.006 if step == 1 else 0.02)
        assert_array_equal(found[np.arange(0, 160, step)], 0.0)

    def test_backwards_it_changes_its_sign(self, sphere):
        there = core.distance.signed_distance(sphere, np.arange(160), closed=True)
        back = core.distance.signed_distance(sphere, np.arange(160)[::-1], closed=True)
        off = np.abs(sphere.points[:, 2]) > 0.0
        assert_allclose(back[off], -there[off], atol=1e-12)

    def test_its_size_is_the_distance_from_the_points_of_a_dense_curve(self, sphere):
        signed = core.distance.signed_distance(sphere, np.arange(160), closed=True)
        assert_allclose(np.abs(signed), core.distance.geodesic_distance(sphere, np.arange(160)), atol=0.02)

    def test_a_straight_line_across_a_square(self, square):
        x, y = square.points[:, 0], square.points[:, 1]
        line = np.flatnonzero(np.abs(x - np.median(x)) < 1e-9)
        line = line[np.argsort(y[line])]
        side = -np.sign(square.normals[0, 2])
        assert_allclose(core.distance.signed_distance(square, line), side * (x - np.median(x)), atol=1e-2)
        assert_allclose(core.distance.signed_distance(square, line[[0, -1]]), side * (x - np.median(x)), atol=1e-2)

    def test_ends_that_are_near_each_other_but_far_along_the_surface(self):
        """Around a cylinder with a slit, the straight distance of which is less than a tenth of the way."""
        around, height = (
            part.ravel() for part in np.meshgrid(np.linspace(0.3, 5.983, 114), np.linspace(-0.5, 0.5, 21))
        )
        laplacian = core.build_laplacian(np.column_stack([np.cos(around), np.sin(around), height]))
        ends = [int(np.argmin(np.hypot(around - end, height))) for end in (0.3, 5.983)]
        found = core.distance.signed_distance(laplacian, ends)
        assert_allclose(np.abs(found), np.abs(height), atol=1e-2)
        assert abs(np.sum(np.sign(found) * np.sign(height))) == np.count_nonzero(height)

    def test_it_reports_each_piece_of_the_curve(self, square):
        reports = []
        curve, report = [0, 800, 1600], lambda stage, fraction: reports.append((stage, fraction))
        core.distance.signed_distance(square, curve)  # which keeps lengths
        core.distance.signed_distance(square, curve, progress=report)
        stages = [stage for stage, _ in reports]
        assert stages[:3] == ["Curve", "Curve", "Distance"]
        assert set(stages[3:]) <= {"Distance"}
        assert reports == sorted(reports, key=lambda report: report[1])

    def test_inside_and_outside_of_sharp_corners(self, square):
        points = square.points[:, :2] - np.median(square.points[:, :2], axis=0)
        half = np.ptp(points[:, 0]) / 4.0
        corners = [
            int(np.argmin(np.linalg.norm(points - half * np.array(corner), axis=1)))
            for corner in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        found = core.distance.signed_distance(square, corners, closed=True) * np.sign(square.normals[0, 2])
        half = points[corners[2]].mean()
        beyond = np.abs(points) - half
        exact = np.where(
            (beyond < 0.0).all(axis=1), -beyond.max(axis=1), -np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        )
        assert_allclose(found, exact, atol=1e-2)

    @pytest.mark.parametrize(
        ("curve", "message"), [([3], "at least two points"), ([], "at least two points"), ([3, 3], "more than once")]
    )
    def test_wrong_arguments(self, square, curve, message):
        with pytest.raises(core.InvalidPointsError, match=message):
            core.distance.signed_distance(square, curve)

    def test_a_curve_over_two_components(self):
        points = np.concatenate([random_sphere(600), random_sphere(600, 1) + [4.0, 0.0, 0.0]])
        laplacian = core.build_laplacian(points)
        with pytest.raises(core.InvalidPointsError, match="on 2 components"):
            core.distance.signed_distance(laplacian, [0, 700])
