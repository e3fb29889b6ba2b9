"""Stray points: near, far and in clumps they are found; real parts, thin and sparse ones too, are not taken."""

from itertools import pairwise

import numpy as np
import pytest

import core
from benchmarks.samplings import (
    closed_plate,
    fibonacci_sphere,
    noisy_sphere,
    open_cylinder,
    parallel_sheets,
    random_sphere,
    sausage,
    square_random,
    torus_points,
    uneven_sphere,
)
from benchmarks.strays import in_box, in_clumps, marked, near

COUNT = 2000
SPACING = np.sqrt(4.0 * np.pi / COUNT)


def wall_behind(count=200):
    """A sphere, and a wall behind it with a third of its density in each direction."""
    wall = square_random(count) * np.sqrt(count) * 3.0 * SPACING
    return np.concatenate([random_sphere(COUNT), np.roll(wall - wall.mean(axis=0), 1, axis=1) + [3.0, 0.0, 0.0]])


CLEAN = {
    "even sphere": lambda: fibonacci_sphere(COUNT),
    "random sphere": lambda: random_sphere(COUNT),
    "density jump": lambda: uneven_sphere(6000, ratio=100.0),
    "thin torus": lambda: torus_points(2500, minor=0.03),
    "plate": lambda: closed_plate(40)[0],
    "parallel sheets": lambda: parallel_sheets(25)[0],
    "bent capsule": lambda: sausage(2000, bent=True)[0],
    "cylinder": open_cylinder,
    "square": lambda: square_random(2500),
    "sparse wall": wall_behind,
    "noise": lambda: noisy_sphere(COUNT, 0.3),
    "much noise": lambda: noisy_sphere(COUNT, 1.0),
    "few points": lambda: fibonacci_sphere(30),
}


@pytest.mark.parametrize("name", CLEAN)
def test_clean_clouds_lose_nothing(name):
    points = CLEAN[name]()
    assert np.count_nonzero(core.clean.stray_points(points)) <= 5e-4 * len(points)


@pytest.mark.parametrize("height", [1.5, 3.0, 20.0, 1e4])
def test_a_lone_point_is_found_at_any_height(height):
    points = np.concatenate([random_sphere(COUNT), [[0.0, 0.0, 1.0 + height * SPACING]]])
    np.testing.assert_array_equal(np.flatnonzero(core.clean.stray_points(points)), [COUNT])


@pytest.mark.parametrize("sort", [in_box, near, in_clumps])
@pytest.mark.parametrize("share", [0.01, 0.1])
def test_nearly_all_are_found_and_nearly_nothing_else(sort, share):
    torus = torus_points(5000)
    extra = sort(torus, share)
    extra = extra[marked(torus, extra)]
    assert len(extra) > 0.6 * share * len(torus)
    found = core.clean.stray_points(np.concatenate([torus, extra]))
    assert found[5000:].mean() >= 0.97
    assert found[:5000].mean() <= 1e-3


def test_many_do_not_vouch_for_each_other():
    """The operator's own search for outliers, whose witnesses are all neighbors, finds fewer in a layer of them."""
    torus = torus_points(5000)
    extra = near(torus, 0.1)
    both = np.concatenate([torus, extra[marked(torus, extra)]])
    left_out = core.build_laplacian(both).component < 0
    assert np.count_nonzero(core.clean.stray_points(both)) > 1.05 * np.count_nonzero(left_out)


def test_a_stricter_choice_holds_the_milder_one():
    points = np.concatenate([noisy_sphere(COUNT, 0.3), in_box(random_sphere(COUNT), 0.1)])
    strays = core.clean.Strays(points)
    chosen = [strays.chosen(strictness) for strictness in (0.1, 0.3, 1.0, 3.0, 10.0)]
    for milder, stricter in pairwise(chosen):
        assert not (milder & ~stricter).any()
        assert np.count_nonzero(milder) < np.count_nonzero(stricter)


def test_scores_tell_the_height_and_the_distance():
    """Over an even plane: height over 0.4 of the spacing of the point, cubed; distance over two of the plane."""
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0))
    plane = np.column_stack([x.ravel(), y.ravel(), np.zeros(1600)])
    heights = np.array([1.0, 2.0, 4.0])
    above = np.column_stack([[10.5, 19.5, 29.5], [10.5, 19.5, 29.5], heights])
    scores = core.clean.Strays(np.concatenate([plane, above])).scores
    near = np.sort(np.linalg.norm(plane[None] - above[:, None], axis=2), axis=1)
    heights = np.minimum(heights / (0.4 * near[:, 11] * np.sqrt(np.pi / 12.0)), 4.0)
    around = np.sort(np.linalg.norm(plane - [10.0, 10.0, 0.0], axis=1))[12] * np.sqrt(np.pi / 12.0)
    np.testing.assert_allclose(scores[1600:], heights**3 * (near[:, 2] / (2.0 * around)) ** 4, rtol=1e-6)
    np.testing.assert_allclose(scores[:1600], 0.0, atol=1e-9)


def test_parts_have_their_points_and_areas():
    ball, bead = random_sphere(3000), 0.2 * fibonacci_sphere(120) + [3.0, 0.0, 0.0]
    strays = core.clean.Strays(np.concatenate([ball, bead, [[0.0, 3.0, 0.0]]]))
    np.testing.assert_array_equal(strays.part_counts, [3000] * 3000 + [120] * 120 + [0])
    np.testing.assert_allclose(strays.part_areas[[0, 3000, 3120]], [4.0 * np.pi, 0.16 * np.pi, 0.0], rtol=0.1)


def test_small_parts_are_taken_below_a_number_or_an_area():
    bead = np.arange(3120) >= 3000
    points = np.concatenate([random_sphere(3000), 0.2 * fibonacci_sphere(120) + [3.0, 0.0, 0.0]])
    none = np.zeros(3120, dtype=bool)
    for settings, found in (
        ({}, none),
        ({"smallest": 120}, none),
        ({"smallest": 121}, bead),
        ({"smallest_area": 0.3}, none),
        ({"smallest_area": 0.7}, bead),
        ({"smallest": 10**9, "smallest_area": 1e9}, bead),  # never the largest
    ):
        np.testing.assert_array_equal(core.clean.stray_points(points, **settings), found)


@pytest.mark.parametrize(("count", "taken"), [(40, True), (400, False)])
def test_sparser_parts_need_more_points(count, taken):
    """Forty points five spacings apart may be chance, four hundred are not."""
    wall = square_random(count) * np.sqrt(count) * 5.0 * SPACING
    points = np.concatenate([random_sphere(COUNT), np.roll(wall, 1, axis=1) + [3.0, 0.0, 0.0]])
    assert np.all(core.clean.stray_points(points)[COUNT:] == taken)


def test_a_floating_clump_is_taken_unless_parts_may_have_any_size():
    clump = [0.0, 0.0, 2.0] + 0.3 * SPACING * np.random.default_rng(3).normal(size=(20, 3))
    points = np.concatenate([random_sphere(COUNT), clump])
    assert core.clean.stray_points(points)[COUNT:].all()
    assert not core.clean.stray_points(points, smallest=0)[COUNT:].all()


def test_nothing_depends_on_place_size_turn_or_order():
    points = np.concatenate([noisy_sphere(COUNT, 0.2), near(random_sphere(COUNT), 0.1)])
    found = core.clean.stray_points(points)
    order = np.random.default_rng(0).permutation(len(points))
    turn = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])
    np.testing.assert_array_equal(core.clean.stray_points(points[order]), found[order])
    np.testing.assert_array_equal(core.clean.stray_points(1e-5 * points + [1.0, 2.0, 3.0]), found)
    np.testing.assert_array_equal(core.clean.stray_points(points @ turn.T), found)


def test_copies_of_a_point_are_taken_together():
    points = np.concatenate([random_sphere(COUNT), [[0.0, 0.0, 2.0]] * 3])
    np.testing.assert_array_equal(np.flatnonzero(core.clean.stray_points(points)), [COUNT, COUNT + 1, COUNT + 2])
    twice = np.repeat(random_sphere(COUNT), 2, axis=0)
    assert core.clean.Strays(twice).part_counts[0] == 2 * COUNT


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"strictness": 0.0}, "strictness is 0.0. Use a number above zero"),
        ({"strictness": np.nan}, "strictness is nan"),
        ({"smallest": -1}, "smallest part has -1 points"),
        ({"smallest": 2.5}, "smallest part has 2.5 points"),
        ({"smallest_area": -1.0}, "smallest area is -1.0"),
    ],
)
def test_settings_without_sense_are_refused(settings, text):
    with pytest.raises(core.PointCloudError, match=text):
        core.clean.stray_points(random_sphere(100), **settings)


def test_the_work_can_be_stopped_at_each_stage():
    stages = []
    core.clean.stray_points(random_sphere(200), progress=lambda stage, share: stages.append((stage, share)))
    assert [share for _, share in stages] == sorted(share for _, share in stages)
    for last in dict(stages):
        with pytest.raises(core.Cancelled):
            core.clean.stray_points(random_sphere(200), progress=stopping(last))


def stopping(last):
    """A progress callback that stops the work at a stage."""

    def progress(stage, share):
        if stage == last:
            raise core.Cancelled

    return progress
