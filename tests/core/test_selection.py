"""Selections that grow along the surface, and the ends of it."""

import numpy as np
import pytest

import core
from benchmarks.samplings import random_sphere, sausage


@pytest.fixture(scope="module")
def sphere():
    return core.build_laplacian(random_sphere(3000))


@pytest.mark.parametrize("distance", [0.3, 1.0, 2.0])
def test_a_cap_of_a_sphere(sphere, distance):
    angle = np.arccos(np.clip(sphere.points @ sphere.points[5], -1.0, 1.0))
    grown = core.distance.grow(sphere, [5], distance)
    assert np.all(grown[angle < 0.95 * distance])
    assert not np.any(grown[angle > 1.005 * distance])


def test_from_several_points_and_from_a_mask(sphere):
    both = core.distance.grow(sphere, [5, 900], 0.4)
    np.testing.assert_array_equal(both, core.distance.grow(sphere, [5], 0.4) | core.distance.grow(sphere, [900], 0.4))
    np.testing.assert_array_equal(core.distance.grow(sphere, np.isin(np.arange(3000), [5, 900]), 0.4), both)


def test_nothing_grows_from_nothing_or_by_nothing(sphere):
    assert not core.distance.grow(sphere, [], 1.0).any()
    np.testing.assert_array_equal(np.flatnonzero(core.distance.grow(sphere, [17, 3], 0.0)), [3, 17])


def test_along_a_bent_sausage_and_not_across_the_gap(operators):
    laplacian, along = operators("bent capsule"), sausage(bent=True)[1]
    grown = core.distance.grow(laplacian, along < 0.0, 1.5)
    assert np.all(grown[along < 1.3])
    assert not np.any(grown[along > 1.7])


@pytest.mark.parametrize("distance", [-1.0, np.nan, None, "far"])
def test_distances_that_make_no_sense(sphere, distance):
    with pytest.raises(core.PointCloudError, match="distance to grow by"):
        core.distance.grow(sphere, [0], distance)


def test_unknown_points(sphere):
    with pytest.raises(core.InvalidPointsError, match="below 3000"):
        core.distance.grow(sphere, [3000], 1.0)


class TestOppositeEnds:
    @pytest.fixture
    def strip(self):
        return np.random.default_rng(3).random((2000, 3)) * (6.0, 1.0, 0.0)

    def test_of_a_strip_they_are_quarters_of_discs_at_opposite_corners(self, strip):
        ends = core.distance.opposite_ends(core.build_laplacian(strip), share=0.05)
        radius = np.sqrt(4.0 * 0.05 * 6.0 / np.pi)  # of a quarter of a disc that has this share of 6 x 1
        corners = np.array([[x, y, 0.0] for x in (0.0, 6.0) for y in (0.0, 1.0)])
        found = []
        for rows in ends:
            away = np.linalg.norm(strip[:, None] - corners, axis=2)
            corner = away[rows].max(axis=0).argmin()
            assert away[rows, corner].max() == pytest.approx(radius, rel=0.1)
            assert np.isin(np.flatnonzero(away[:, corner] < 0.85 * radius), rows).all()
            found.append(corner)
        assert sum(found) == 3  # opposite ones
        assert found[0] != found[1]

    def test_they_lie_on_the_largest_component(self):
        points = np.concatenate([0.3 * random_sphere(400) + [9.0, 0.0, 0.0], random_sphere(750)])
        for rows in core.distance.opposite_ends(core.build_laplacian(points)):
            assert rows.min() >= 400

    def test_three_points_at_least(self, sphere):
        assert [len(rows) for rows in core.distance.opposite_ends(sphere, 1e-9)] == [3, 3]

    @pytest.mark.parametrize("share", [0.0, -1.0, 0.3, np.nan])
    def test_shares_out_of_bounds(self, sphere, share):
        with pytest.raises(core.PointCloudError, match="Use a number above 0, up to 0.25"):
            core.distance.opposite_ends(sphere, share)

    @pytest.mark.parametrize("share", [0.01, 0.05, 0.25])
    def test_on_a_sphere_they_are_caps_of_that_area_around_opposite_points(self, sphere, share):
        one, other = core.distance.opposite_ends(sphere, share)
        assert sphere.areas[one].sum() / sphere.areas.sum() == pytest.approx(share, abs=0.003)
        assert sphere.areas[other].sum() / sphere.areas.sum() == pytest.approx(share, abs=0.003)
        assert not np.intersect1d(one, other).size
        middles = [sphere.points[rows].mean(axis=0) for rows in (one, other)]
        directions = [middle / np.linalg.norm(middle) for middle in middles]
        assert directions[0] @ directions[1] < -0.95
        for rows, direction in zip((one, other), directions, strict=True):
            angle = np.arccos(np.clip(sphere.points[rows] @ direction, -1.0, 1.0))
            assert angle.max() < np.arccos(1.0 - 2.0 * share) + 0.15  # the area of a cap, 2 pi (1 - cos angle)


class TestFrontPoint:
    """The point that one sees, and not one behind it."""

    RAYS = np.random.default_rng(3).uniform(-0.65, 0.65, (200, 2))

    def picked(self, points, reach):
        return [core.distance.front_point(points, [x, y, 5.0], [0.0, 0.0, -1.0], reach) for x, y in self.RAYS]

    def test_on_the_near_side_of_a_sphere(self):
        points = random_sphere(2100)
        picked = points[self.picked(points, 2.0 * np.sqrt(4.0 * np.pi / 2100))]
        assert (picked[:, 2] > 0.3).all()
        assert np.linalg.norm(picked[:, :2] - self.RAYS, axis=1).mean() < 0.04

    def test_of_a_surface_that_is_seen_at_a_slant_the_point_under_the_ray(self):
        flat = np.column_stack([np.mgrid[-1:1:60j, -1:1:60j].reshape(2, -1).T, np.zeros(3600)])
        slant = flat * [1.0, 1.0, 0.0] + 1.5 * flat[:, :1] * [0.0, 0.0, 1.0]
        for index in (1000, 1830, 2500):
            assert core.distance.front_point(slant, slant[index] + [0.0, 0.0, 5.0], [0.0, 0.0, -2.0], 0.1) == index

    def test_a_direction_of_no_length(self):
        with pytest.raises(core.PointCloudError, match="has zero length"):
            core.distance.front_point([[0.0, 0.0, 1.0]], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 1.0)

    def test_nothing_behind_the_eye_far_from_the_ray_or_without_a_place(self):
        points = np.array([[0.0, 0.0, 9.0], [3.0, 0.0, 0.0], [np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0]])
        assert core.distance.front_point(points, [0.0, 0.0, 5.0], [0.0, 0.0, -1.0], 0.5) == -1


class TestSeenPoints:
    """What is seen of a surface, by hidden surfaces whose answer is known."""

    DOWN = np.array([0.0, 0.0, -1.0])

    @pytest.mark.parametrize("normals", [True, False])
    @pytest.mark.parametrize("eye", [None, 3.0])
    def test_of_a_sphere_the_half_that_faces_the_view(self, normals, eye):
        points = core.example_sphere(2000)
        horizon = 0.0 if eye is None else 1.0 / eye  # where rays from the eye touch the sphere
        given = {"normals": points} if normals else {}
        place = {} if eye is None else {"eye": [0.0, 0.0, eye]}
        seen = core.distance.seen_points(points, 1.2 * np.sqrt(4.0 * np.pi / 2000), self.DOWN, **given, **place)
        assert seen[points[:, 2] > horizon + 0.2].all()
        assert not seen[points[:, 2] < horizon - 0.25].any()

    @pytest.mark.parametrize(("elevation", "normals"), [(30, True), (30, False), (12, True)])
    def test_ground_is_seen_at_a_low_angle(self, elevation, normals):
        ground = np.column_stack([np.random.default_rng(0).uniform(-1.0, 1.0, (4000, 2)), np.zeros(4000)])
        angle = np.radians(elevation)
        up = np.tile([0.0, 0.0, 1.0], (4000, 1)) if normals else None
        view = [np.cos(angle), 0.0, -np.sin(angle)]
        assert core.distance.seen_points(ground, 1.3 * np.sqrt(4.0 / 4000), view, normals=up).mean() > 0.99

    def test_a_sheet_hides_the_next_one_and_what_is_asked_for_is_told(self):
        grid = np.mgrid[-1:1:40j, -1:1:40j].reshape(2, -1).T
        spacing = 2.0 / 39.0
        sheets = np.concatenate([np.column_stack([grid, np.full(1600, height)]) for height in (0.0, -2.0 * spacing)])
        asked = np.arange(3200) % 2 == 0
        up = np.tile([0.0, 0.0, 1.0], (3200, 1))
        seen = core.distance.seen_points(sheets, spacing, self.DOWN, normals=up, among=asked)
        assert (seen == (asked & (sheets[:, 2] == 0.0))).all()
        below = core.distance.seen_points(sheets, spacing, -self.DOWN, normals=up)
        assert (below == (sheets[:, 2] < 0.0)).all()

    def test_it_takes_lengths_of_any_unit(self):
        points = core.example_sphere(500)
        first = core.distance.seen_points(points, 0.2, self.DOWN)
        assert (core.distance.seen_points(1e6 * points, 2e5, 3.0 * self.DOWN) == first).all()
        assert (core.distance.seen_points(1e-6 * points, 2e-7, self.DOWN) == first).all()

    def test_from_within_a_sphere_what_is_before_the_eye_and_nothing_behind_it(self):
        points = core.example_sphere(500)
        seen = core.distance.seen_points(points, 0.15, self.DOWN, eye=[0.0, 0.0, 0.0])
        assert not seen[points[:, 2] >= 0.0].any()
        assert seen[points[:, 2] < -0.3].all()

    def test_points_without_a_place_neither_hide_nor_are_seen(self):
        points = np.array([[0.0, 0.0, 2.0], [np.nan, 0.0, 1.0], [0.0, 0.0, np.inf], [0.0, 0.0, 0.0], [0.01, 0.0, -1.0]])
        seen = core.distance.seen_points(points, 0.1, self.DOWN)
        assert seen.tolist() == [True, False, False, False, False]
        assert not core.distance.seen_points(points[1:3], 0.1, self.DOWN).any()

    def test_a_direction_of_no_length(self):
        with pytest.raises(core.PointCloudError, match="has zero length"):
            core.distance.seen_points(np.eye(3), 0.1, [0.0, 0.0, 0.0])
