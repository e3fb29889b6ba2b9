"""Thinning in one pass: the same whatever the pieces are, and as even as a subset of all points at once."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.spatial import cKDTree

import core
from benchmarks.samplings import random_sphere, uneven_sphere

FAR = np.array([446_000.0, 4_000_000.0, 120.0])


def together(pieces):
    """Return the chosen points, and their numbers."""
    points = np.concatenate([np.empty((0, 3)), *(points for points, _ in pieces)])
    return points, np.concatenate([np.empty(0, int), *(numbers["row"] for _, numbers in pieces)])


def cut(points, parts, order=None):
    """Return points in pieces, with their rows."""
    order = np.arange(len(points)) if order is None else order
    return [(points[rows], {"row": rows}) for rows in np.array_split(order, parts)]


@pytest.mark.parametrize("count", [20, 300])
def test_neither_the_cut_nor_the_order_makes_a_difference(count):
    points = FAR + uneven_sphere(20_000, ratio=30.0)
    results = []
    for seed, parts in ((None, 1), (None, 7), (1, 40), (2, 500)):
        order = None if seed is None else np.random.default_rng(seed).permutation(len(points))
        chosen, rows = together(core.clean.thin_pieces(cut(points, parts, order), count))
        assert_array_equal(chosen, points[rows])
        results.append(np.sort(rows))
    assert 0.9 * count <= len(results[0]) <= count
    for result in results[1:]:
        assert_array_equal(result, results[0])


@pytest.mark.parametrize("cloud", [random_sphere, lambda n: uneven_sphere(n, ratio=30.0)])
def test_chosen_points_are_even(cloud):
    """As those of a subset of all points at once: halves of a sphere get as many, and none are much closer."""
    points, count = cloud(30_000), 500
    chosen = together(core.clean.thin_pieces(cut(points, 20), count))[0]
    subset = points[core.clean.blue_noise_subset(points, count)]
    nearest = [cKDTree(few).query(few, k=2)[0][:, 1] for few in (chosen, subset)]
    assert nearest[0].min() > 0.8 * nearest[1].min()
    for axis in range(3):
        shares = [np.count_nonzero(few[:, axis] > 0.0) / len(few) for few in (chosen, subset)]
        assert abs(shares[0] - 0.5) < abs(shares[1] - 0.5) + 0.02


def test_cells_are_fine_enough_for_a_volume():
    """Cells twice as wide are an eighth as many there, and that is still enough."""
    points = np.random.default_rng(0).uniform(size=(40_000, 3))
    for count in (100, 700, 2000):
        chosen = together(core.clean.thin_pieces(cut(points, 9), count))[0]
        assert 0.8 * count <= len(chosen) <= count


def test_few_points_stay_as_they_are():
    points = np.repeat(random_sphere(50), 2, axis=0)
    assert_array_equal(together(core.clean.thin_pieces(cut(points, 3), 100))[1], np.arange(100))
    assert core.clean.thin_pieces([], 5) == []
    assert core.clean.thin_pieces([(np.empty((0, 3)), {})], 5) == []


def test_points_at_one_place():
    pieces = cut(np.tile(FAR, (1000, 1)), 10)
    assert len(together(core.clean.thin_pieces(pieces, 10))[0]) == 1


def test_one_far_away_makes_no_cells_too_many_to_number():
    points = np.concatenate([1e-6 * random_sphere(5000), [[1e6, 0.0, 0.0]]])
    for order in (None, np.arange(len(points))[::-1]):
        chosen = together(core.clean.thin_pieces(cut(points, 20, order), 50))[0]
        assert chosen[:, 0].max() == 1e6
        assert len(chosen) <= 50


def test_what_is_asked_for_is_checked():
    with pytest.raises(core.PointCloudError, match="whole number of at least 1"):
        core.clean.thin_pieces([], 0)
    with pytest.raises(core.PointCloudError, match="not finite"):
        core.clean.thin_pieces([(np.full((2, 3), np.nan), {})], 5)


def test_it_can_be_stopped():
    def stop():
        raise core.Cancelled

    with pytest.raises(core.Cancelled):
        core.clean.thin_pieces(cut(random_sphere(100), 2), 5, progress=stop)
