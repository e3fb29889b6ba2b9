"""Minimal surfaces: known ones, boundaries that none spans, and the ways to end."""

import importlib
import sys

import numpy as np
import pytest

import core
from benchmarks.plateau import cap, catenoid, catenoid_errors, helicoid, tube
from benchmarks.samplings import fibonacci_sphere, grid_points, hemisphere_random, random_sphere, square_grid
from core.deform.boundary_curve import BoundaryCurve

iteration = importlib.import_module("core.deform.minimal_surface")  # the function has the same name


@pytest.fixture(scope="module")
def cylinder():
    return tube(98, 20)


@pytest.fixture(scope="module")
def settled(cylinder):
    return core.deform.minimal_surface(*cylinder)


@pytest.fixture(scope="module")
def coarse():
    """A smaller one, and what becomes of it."""
    points, fixed = tube(48, 10)
    return points, fixed, core.deform.minimal_surface(points, fixed)


def circle(count, radius=1.0):
    angle = 2.0 * np.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])


class TestCatenoid:
    def test_known_figures(self):
        waist, area = catenoid()
        assert waist == pytest.approx(1.6967, abs=5e-5)
        assert area == pytest.approx(23.9672, abs=5e-5)

    def test_area_waist_and_profile(self, settled):
        assert settled.converged
        assert settled.reason == "converged"
        area, waist, profile = catenoid_errors(settled.points, settled.areas)
        assert abs(area) < 2e-3
        assert abs(waist) < 2e-3
        assert profile < 3e-3

    def test_history(self, cylinder, settled):
        assert settled.initial_area == pytest.approx(8.0 * np.pi, rel=3e-3)
        assert len(settled.area_history) == settled.steps
        assert settled.area_history[-1] == pytest.approx(settled.areas.sum(), rel=1e-12)
        assert np.all(np.diff([settled.initial_area, *settled.area_history]) < 1e-4)
        assert settled.notices == []

    def test_fixed_points_stay(self, cylinder, settled):
        points, fixed = cylinder
        np.testing.assert_array_equal(settled.points[fixed], points[fixed])
        assert np.all(np.linalg.norm(settled.points - points, axis=1)[~fixed] > 1e-3)

    def test_nothing_changes_in_further_steps(self, coarse):
        _, fixed, settled = coarse
        further = core.deform.minimal_surface(settled.points, fixed, epsilon=0.0, max_steps=5)
        assert further.steps == 5
        assert not further.converged
        assert np.abs(further.points - settled.points).max() < 1e-3

    def test_irregular_points(self):
        random = np.random.default_rng(3)
        angle, z = 2.0 * np.pi * random.random(900), 2.0 * random.random(900) - 1.0
        rings = np.concatenate([circle(75, 2.0) - [0, 0, 1], circle(75, 2.0) + [0, 0, 1]])
        points = np.concatenate([rings, np.column_stack([2.0 * np.cos(angle), 2.0 * np.sin(angle), z])])
        film = core.deform.minimal_surface(points, np.arange(150))
        assert film.converged
        area, waist, profile = catenoid_errors(film.points, film.areas)
        assert abs(area) < 1e-2
        assert abs(waist) < 1e-2
        assert profile < 3e-2

    def test_noise_is_smoothed(self):
        points, fixed = tube(60, 12)
        points += 0.02 * np.random.default_rng(0).standard_normal(points.shape) * ~fixed[:, None]
        film = core.deform.minimal_surface(points, fixed)
        assert film.converged
        assert catenoid_errors(film.points, film.areas)[2] < 1e-2


def test_an_edge_at_fixed_points_is_no_neck():
    """A catenoid between fixed cylinders, which it meets at an angle: more points resolve it better and better."""

    def curved(count):
        rng = np.random.default_rng(0)
        z, angle = rng.uniform(-0.6, 0.6, count), rng.uniform(0.0, 2.0 * np.pi, count)
        radius = 0.5 * np.cosh(np.minimum(np.abs(z), 0.4) / 0.5)
        points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
        laplacian = core.build_laplacian(points)
        film = iteration._Film(laplacian, np.abs(z) > 0.4, laplacian.options, None)
        return film.state(points, laplacian).curved

    assert curved(6000) < 0.75 * curved(1500) < 0.3


class TestFlat:
    @pytest.mark.parametrize("deepest", [0.0, -0.6])
    def test_caps_become_discs(self, deepest):
        points = fibonacci_sphere(600)
        radius = np.sqrt(1.0 - deepest**2)
        ring = circle(round(43 * radius), radius) + [0.0, 0.0, deepest]
        points = np.concatenate([ring, points[points[:, 2] > deepest + 0.05]])
        film = core.deform.minimal_surface(points, np.arange(len(ring)))
        assert film.converged
        assert np.abs(film.points[:, 2] - deepest).max() < 1e-2
        assert film.areas.sum() == pytest.approx(np.pi * radius**2, rel=5e-3)

    def test_random_hemisphere(self):
        film = core.deform.minimal_surface(*cap(hemisphere_random(600), 50))
        assert film.converged
        assert np.abs(film.points[:, 2]).max() < 1e-2
        assert film.areas.sum() == pytest.approx(np.pi, rel=5e-3)

    def test_open_box(self):
        # Without sharp edges and with four corners of the boundary.
        side = np.linspace(0.0, 1.0, 17)
        box = grid_points(side, side, side[:9])
        across = np.minimum(box, 1.0 - box)[:, :2].min(axis=1) == 0.0
        box = box[across | (box[:, 2] == side[8])]
        fixed = box[:, 2] == 0.0
        film = core.deform.minimal_surface(box, fixed)
        assert film.converged
        assert np.abs(film.points[:, 2]).max() < 1e-2
        assert film.areas.sum() == pytest.approx(1.0, rel=1e-2)

    def test_a_band_of_fixed_points(self):
        points = square_grid(21)
        inset = np.minimum(points, 1.0 - points)[:, :2].min(axis=1)
        points[:, 2] = 3.0 * np.maximum(inset - 0.1, 0.0) ** 2
        film = core.deform.minimal_surface(points, inset < 0.1)
        assert film.converged
        assert np.abs(film.points[:, 2]).max() < 1e-3
        assert film.areas.sum() == pytest.approx(1.0, rel=5e-3)

    def test_pinned_part_of_a_closed_surface(self):
        points = fibonacci_sphere(600)
        free = points[:, 2] > 0.6
        film = core.deform.minimal_surface(points, ~free, max_steps=3)
        np.testing.assert_array_equal(film.points[~free], points[~free])
        # Across a crease the kernel sees both sides: within a spacing, which is 0.1 here.
        assert np.abs(film.points[free, 2] - 0.6).max() < 0.1

    def test_the_boundary_that_was_found(self):
        points = hemisphere_random(500, 2)
        boundary = core.build_laplacian(points).boundary
        film = core.deform.minimal_surface(points, boundary, max_steps=2)
        assert film.points[:, 2].max() < points[boundary, 2].max() + 1e-2


def test_helicoid_between_four_corners():
    points, boundary, area = helicoid(25)
    film = core.deform.minimal_surface(points, boundary)
    assert film.converged
    x, y, z = film.points.T
    assert np.abs(x * np.sin(z) - y * np.cos(z)).max() < 2e-3
    assert film.areas.sum() == pytest.approx(area, rel=4e-3)


class TestInvariance:
    def test_motion_scale_and_order(self, coarse):
        points, fixed, expected = coarse
        turn = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
        order = np.random.default_rng(2).permutation(len(points))
        film = core.deform.minimal_surface(
            (30.0 * points @ turn.T + [5.0, -70.0, 20.0])[order], np.flatnonzero(fixed[order])
        )
        assert film.steps == expected.steps
        moved = 30.0 * expected.points[order] @ turn.T + [5.0, -70.0, 20.0]
        np.testing.assert_allclose(film.points, moved, atol=30.0 * 1e-3)
        np.testing.assert_allclose(film.area_history, 900.0 * expected.area_history, rtol=2e-3)

    def test_the_same_twice(self, coarse):
        points, fixed, expected = coarse
        np.testing.assert_array_equal(core.deform.minimal_surface(points, fixed).points, expected.points)


class TestPinching:
    @pytest.mark.parametrize("height", [2.8, 5.0])
    def test_rings_too_far_apart(self, height):
        points, fixed = tube(30, round(3.0 * height), height=height)
        film = core.deform.minimal_surface(points, fixed)
        assert not film.converged
        assert film.reason == "pinching"
        assert any("pinches" in notice for notice in film.notices)
        assert np.isfinite(film.points).all()
        assert np.isfinite(film.areas).all()
        assert len(film.area_history) == film.steps
        # The last sound surface still is one piece, smaller than the first.
        assert core.build_laplacian(film.points).component.max() == 0
        assert film.areas.sum() < film.initial_area

    def test_rings_just_near_enough(self):
        points, fixed = tube(60, 16, height=2.6)
        film = core.deform.minimal_surface(points, fixed)
        assert film.converged
        assert abs(catenoid_errors(film.points, film.areas, height=2.6)[1]) < 2e-2


class TestEnding:
    def test_step_limit(self, coarse):
        points, fixed, expected = coarse
        film = core.deform.minimal_surface(points, fixed, max_steps=1)
        assert (film.steps, film.converged, film.reason) == (1, False, "step limit")
        assert film.area_history[0] == expected.area_history[0]
        assert len(film.notices) == 1

    def test_no_steps(self, coarse):
        points, fixed, expected = coarse
        film = core.deform.minimal_surface(points, fixed, max_steps=0)
        np.testing.assert_array_equal(film.points, points)
        assert film.areas.sum() == film.initial_area == expected.initial_area
        assert len(film.area_history) == 0

    def test_noise_at_a_crease_is_not_followed(self):
        """A belt of a sphere whose fixed ends are wide, where steps go on without getting anywhere."""
        points = random_sphere(1200)
        points = points[np.abs(points[:, 2]) < 0.5]
        fixed = np.abs(points[:, 2]) > 0.36
        film = core.deform.minimal_surface(points, fixed)
        assert (film.converged, film.steps < 9) == (True, True)
        further = core.deform.minimal_surface(points, fixed, epsilon=0.0, max_steps=film.steps + 2)
        moved = np.linalg.norm(further.points - film.points, axis=1)
        assert np.sqrt(np.mean(moved**2)) < 0.02 * np.sqrt(film.areas.mean())
        assert abs(further.areas.sum() / film.areas.sum() - 1.0) < 5e-4

    @pytest.mark.parametrize("raising", [False, True])
    def test_callback(self, coarse, raising):
        points, fixed, expected = coarse
        seen = []

        def callback(step, moved, area):
            seen.append((step, moved.copy(), area))
            moved[:] = np.nan
            if step == 2:
                if raising:
                    raise core.Cancelled
                return False
            return None

        film = core.deform.minimal_surface(points, fixed, callback=callback)
        assert film.reason == ("cancelled" if raising else "stopped")
        assert not film.converged
        assert [step for step, _, _ in seen] == [1, 2]
        np.testing.assert_array_equal(film.points, seen[-1][1])
        np.testing.assert_array_equal(film.area_history, [area for _, _, area in seen])
        np.testing.assert_array_equal(film.area_history, expected.area_history[:2])

    def test_cancelled_within_a_step(self, coarse):
        points, fixed, expected = coarse
        builds = []

        def progress(stage, fraction):
            builds.append((stage, fraction))
            if builds.count(("Areas", 0.72)) == 4:  # of the given points twice, then of each step
                raise core.Cancelled

        film = core.deform.minimal_surface(points, fixed, progress=progress)
        assert (film.steps, film.reason) == (1, "cancelled")
        np.testing.assert_array_equal(film.area_history, expected.area_history[:1])


class TestRefusals:
    @pytest.mark.parametrize("fixed", [[], [0, 1, 2], np.ones(480, dtype=bool)])
    def test_too_few_or_too_many_fixed(self, coarse, fixed):
        with pytest.raises(core.InvalidPointsError, match="points are fixed"):
            core.deform.minimal_surface(coarse[0], fixed)

    def test_a_free_edge(self, coarse):
        with pytest.raises(core.InvalidPointsError, match="ends at 48 points"):
            core.deform.minimal_surface(coarse[0], coarse[0][:, 2] == -1.0)

    def test_a_part_without_fixed_points(self, coarse):
        points, fixed, _ = coarse
        both = np.concatenate([points, fibonacci_sphere(500) + [9.0, 0.0, 0.0]])
        with pytest.raises(core.InvalidPointsError, match="500 of 980 points are in components"):
            core.deform.minimal_surface(both, np.flatnonzero(fixed))

    @pytest.mark.parametrize(
        "settings", [{"epsilon": -1.0}, {"epsilon": np.nan}, {"max_steps": -1}, {"max_steps": 1.5}]
    )
    def test_settings_out_of_range(self, coarse, settings):
        with pytest.raises(core.InvalidPointsError, match="tolerance"):
            core.deform.minimal_surface(*coarse[:2], **settings)

    def test_bad_coordinates(self, coarse):
        points, fixed, _ = coarse
        with pytest.raises(core.InvalidPointsError, match="not finite"):
            core.deform.minimal_surface(np.where(points > 1.99, np.nan, points), fixed)
        with pytest.raises(core.InvalidPointsError, match="480 truth values"):
            core.deform.minimal_surface(points, fixed[:-1])


class TestBoundaryCurve:
    def test_feet_on_a_circle(self):
        curve = BoundaryCurve(np.roll(circle(60), 7, axis=0))
        assert not curve.rough
        inside = circle(113, 0.8) + [0.0, 0.0, 0.1]
        foot, index = curve.nearest(inside)
        np.testing.assert_allclose(foot, circle(113), atol=2e-5)
        assert np.linalg.norm(curve.points[index] - inside, axis=1).max() < 0.25

    def test_corners_and_ends(self):
        along = np.arange(6.0)
        wire = np.concatenate([grid_points(along, [0.0], [0.0]), grid_points([0.0], along[1:], [0.0])])
        points = np.array([[2.5, 1.0, 0.0], [1.0, 3.3, 0.0], [-1.0, -1.0, 0.0], [7.0, 1.0, 0.0]])
        foot, _ = BoundaryCurve(wire).nearest(points)
        np.testing.assert_allclose(foot, [[2.5, 0, 0], [0, 3.3, 0], [0, 0, 0], [5, 0, 0]], atol=1e-12)

    def test_distances_along_a_sphere(self):
        curve = BoundaryCurve(circle(200))
        height = np.array([0.1, 0.3, 0.6])
        points = np.column_stack([np.cos(height), 0.0 * height, np.sin(height)])
        foot, index = curve.nearest(points)
        distance = curve.distance(points, points, foot, index, -curve.points)
        np.testing.assert_allclose(distance, height, rtol=1e-3)

    def test_scattered_points_are_rough(self):
        scatter = 1.0 - 0.08 * np.random.default_rng(0).random(80)
        assert BoundaryCurve(circle(80) * scatter[:, None]).rough
        assert not BoundaryCurve(circle(80)[np.random.default_rng(0).permutation(80)]).rough

    def test_points_given_twice(self):
        ring = circle(40)
        curve = BoundaryCurve(np.concatenate([ring, ring]))
        assert len(curve.points) == 40
        np.testing.assert_array_equal(np.concatenate([ring, ring])[curve.first], curve.points)


def test_given_distances_hold_beside_corners_only():
    points = square_grid(21)
    inset = np.sort(np.minimum(points, 1.0 - points)[:, :2], axis=1)
    boundary = inset[:, 0] == 0.0
    both = core.build_laplacian(points, boundary=boundary, boundary_distance=inset[:, 0])
    alone = core.build_laplacian(points, boundary_distance=inset[:, 0])
    # Corners want both of their sides, which one distance cannot tell.
    assert abs(both.areas.sum() - 1.0) < 1e-3 < abs(alone.areas.sum() - 1.0)
    # Otherwise the distances that were given are taken: a boundary a little further out leaves more area inside.
    wider = core.build_laplacian(points, boundary=boundary, boundary_distance=inset[:, 0] + 0.2 / 29)
    assert wider.areas.sum() > both.areas.sum() + 1e-2


def test_a_step_that_was_not_found_settles_nothing(monkeypatch):
    monkeypatch.setattr(sys.modules["core.deform.minimal_surface"], "_PRODUCTS", 1)
    grid = square_grid(12)
    edge = np.isin(grid[:, :2], [grid.min(), grid[:, :2].max()]).any(axis=1)
    bump = grid + 0.01 * np.where(edge, 0.0, np.sin(3.0 * grid[:, 0]))[:, None] * [0.0, 0.0, 1.0]
    film = core.deform.minimal_surface(bump, edge, epsilon=1.0, max_steps=2)
    assert (film.converged, film.reason) == (False, "step limit")
