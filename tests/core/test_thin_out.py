"""Thinning: to a spacing or a number, evenly, edges first."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import core
from benchmarks.samplings import noisy_sphere, random_sphere, square_random, uneven_sphere

CLOUDS = {
    "sphere": lambda: random_sphere(3000),
    "density jump": lambda: uneven_sphere(3000, ratio=30.0),
    "noise": lambda: noisy_sphere(3000, 0.5),
    "square": lambda: square_random(3000),
    "copies": lambda: np.repeat(random_sphere(100), 30, axis=0),
}


def roof(across=40):
    """A gable roof on a grid, whose ridge is at x = 0, and which points are on the ridge."""
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, across + 1), np.linspace(-1.0, 1.0, across + 1))
    jitter = np.random.default_rng(0).uniform(-0.3, 0.3, (x.size, 2)) * 2.0 / across
    x, y = x.ravel() + jitter[:, 0] * (x.ravel() != 0.0), y.ravel() + jitter[:, 1]
    return np.column_stack([x, y, -np.abs(x)]), x == 0.0


@pytest.mark.parametrize("name", CLOUDS)
@pytest.mark.parametrize("spacing", [0.05, 0.3])
@pytest.mark.parametrize("keep_edges", [True, False])
def test_none_are_nearer_than_the_spacing_and_none_farther(name, spacing, keep_edges):
    points = CLOUDS[name]()
    chosen = core.clean.thin_out(points, spacing=spacing, keep_edges=keep_edges)
    assert np.all(np.diff(chosen) > 0)
    tree = cKDTree(points[chosen])
    assert len(tree.query_pairs(spacing * (1.0 - 1e-12))) == 0
    assert tree.query(points)[0].max() < spacing


@pytest.mark.parametrize("name", ["sphere", "density jump", "noise", "square"])
@pytest.mark.parametrize("count", [1, 50, 900])
def test_a_count_is_the_most(name, count):
    points = CLOUDS[name]()
    chosen = core.clean.thin_out(points, count=count)
    assert 0.9 * count <= len(chosen) <= count
    assert len(np.unique(points[chosen], axis=0)) == len(chosen)


def test_enough_stay_all_without_copies():
    points = CLOUDS["copies"]()
    assert len(core.clean.thin_out(points, count=100)) == 100
    assert len(np.unique(points[core.clean.thin_out(points, count=10**6)], axis=0)) == 100
    assert len(core.clean.thin_out(np.zeros((50, 3)), count=7)) == 1


def test_edges_come_first():
    """Of a roof thinned to a seventh points on the ridge stay along all of it; without the setting gaps are left."""
    points, ridge = roof()
    gaps = []
    for keep_edges in (True, False):
        chosen = core.clean.thin_out(points, spacing=0.12, keep_edges=keep_edges)
        gaps.append(cKDTree(points[chosen[ridge[chosen]]]).query(points[ridge])[0])
    (edges, anyway) = gaps
    assert edges.max() < 0.15 < 0.25 < anyway.max()
    assert edges.mean() < 0.8 * anyway.mean()


def test_nothing_depends_on_the_order():
    points = random_sphere(2000)
    order = np.random.default_rng(1).permutation(2000)
    for settings in ({"count": 300}, {"spacing": 0.2}):
        chosen = core.clean.thin_out(points, **settings)
        np.testing.assert_array_equal(np.sort(order[core.clean.thin_out(points[order], **settings)]), chosen)


def test_lengths_scale():
    points = random_sphere(2000)
    np.testing.assert_array_equal(
        core.clean.thin_out(8.0 * points, spacing=1.6), core.clean.thin_out(points, spacing=0.2)
    )


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({}, "needs a count or a spacing"),
        ({"count": 3, "spacing": 1.0}, "needs a count or a spacing"),
        ({"count": 0}, "choice of 0 points"),
        ({"count": 2.5}, "choice of 2.5 points"),
        ({"spacing": 0.0}, "spacing is 0.0"),
        ({"spacing": np.inf}, "spacing is inf"),
        ({"count": 3, "keep_edges": 1}, "keep_edges"),
    ],
)
def test_settings_without_sense_are_refused(settings, text):
    with pytest.raises(core.PointCloudError, match=text):
        core.clean.thin_out(random_sphere(100), **settings)


def test_the_work_can_be_stopped():
    def progress(stage, share):
        if stage == "Thinning":
            raise core.Cancelled

    with pytest.raises(core.Cancelled):
        core.clean.thin_out(random_sphere(500), count=100, progress=progress)


def _grid(size, spacing=1.0):
    return np.stack(np.meshgrid(np.arange(size) * spacing, np.arange(size)), axis=-1).reshape(-1, 2)


@pytest.mark.parametrize(
    "points",
    [
        np.column_stack([_grid(32), np.zeros(1024)]),
        np.stack(np.meshgrid(*[np.arange(10.0)] * 3), axis=-1).reshape(-1, 3),
        np.random.default_rng(0).integers(0, 11, (1200, 3)),
        np.repeat(np.random.default_rng(0).random((350, 3)), 3, axis=0),
        np.column_stack([_grid(32, 20.0), np.zeros(1024)]),
        np.column_stack([np.tile(_grid(16), (4, 1)), np.repeat(np.arange(4.0), 256) * 1e-3]),
        np.random.default_rng(0).random((1000, 3)),
    ],
    ids=["grid", "lattice", "integers", "duplicates", "lines", "stacked", "random"],
)
@pytest.mark.parametrize("share", [0.9, 0.5, 0.3, 0.03])
def test_as_many_as_were_asked_for_are_chosen(points, share):
    different = len(np.unique(points, axis=0))
    count = int(share * different)
    chosen = core.clean.thin_out(points, count=count)
    assert len(chosen) == count
    assert len(np.unique(points[chosen], axis=0)) == count
    assert 0.9 * count <= len(core.clean.blue_noise_subset(points, count)) <= count


def test_points_beyond_one_distance_are_somewhat_nearer():
    """Of random points by far most are as far apart as the discs let them, the last ones not much nearer."""
    points = np.column_stack([np.random.default_rng(1).random((6000, 2)), np.zeros(6000)])
    chosen = points[core.clean.thin_out(points, count=1000)]
    apart = np.sort(cKDTree(chosen).query(chosen, k=2)[0][:, 1])
    assert apart[0] > 0.6 * apart[100]
