import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from benchmarks.samplings import random_sphere, uneven_sphere
from core.geometry import pairs as neighbor_pairs
from core.geometry import patches
from core.geometry.cloud import read_cloud
from core.geometry.nearest import nearest_rows, typical_distance
from core.geometry.pairs import Pairs, find_pairs
from core.options import LaplacianOptions


def expected_pairs(points, lengths):
    distance = cdist(points, points)
    inside = distance <= 1.5 * (lengths[:, None] + lengths[None])
    return {tuple(pair) for pair in np.argwhere(np.triu(inside, 1))}


@pytest.mark.parametrize("spread", [1.0, 8.0])
def test_pairs_are_all_within_three_mean_lengths_each_once(spread):
    points = random_sphere(700)
    lengths = 0.08 * spread ** np.random.default_rng(1).random(700)
    first, second, distance = find_pairs(cKDTree(points), lengths)
    found = [tuple(sorted(pair)) for pair in zip(first.tolist(), second.tolist(), strict=True)]
    assert len(found) == len(set(found))
    assert set(found) == expected_pairs(points, lengths)
    assert np.all(np.diff(first) >= 0)
    np.testing.assert_allclose(distance, np.linalg.norm(points[first] - points[second], axis=1), atol=1e-14)


@pytest.mark.parametrize("spread", [1.0, 8.0])
def test_pairs_of_many_candidates_are_found_by_parts(monkeypatch, spread):
    points = random_sphere(2000)
    tree, lengths = cKDTree(points), 0.06 * spread ** np.random.default_rng(1).random(2000)
    whole = find_pairs(tree, lengths)
    monkeypatch.setattr(neighbor_pairs, "_ROWS", 300)
    monkeypatch.setattr(neighbor_pairs, "_CANDIDATES", 900)
    parts = find_pairs(tree, lengths)
    for first, second, distance in (whole, parts):
        order = np.lexsort((second, first))
        first[:], second[:], distance[:] = first[order], second[order], distance[order]
    assert all(map(np.array_equal, whole, parts))


def test_patches_hold_each_pair_once_and_sum_at_both_ends(monkeypatch):
    monkeypatch.setattr(patches, "_PAIRS", 500)
    rng = np.random.default_rng(4)
    count = 300
    # The last points have no pairs of which they are the first, some in between neither.
    first, second = np.nonzero(np.triu(rng.random((count, count)) < 0.1, 1) & (np.arange(count) % 7 > 0)[:, None])
    pairs = Pairs(rng.random((count, 3)), np.ones(count), first.astype(np.int32), second.astype(np.int32), None)
    assert len(pairs.patches) > 5
    assert [row for patch in pairs.patches for row in range(patch.pairs.start, patch.pairs.stop)] == list(
        range(len(first))
    )
    values, weights = rng.random((2, count)), rng.random((3, len(first)))
    sums, exact = np.zeros((2, 2, 3, count))
    for patch in pairs.patches:
        assert np.array_equal(patch.first(values), values[:, first[patch.pairs]])
        assert np.array_equal(patch.second(values), values[:, second[patch.pairs]])
        assert np.allclose(patch.mean(values[0]), pairs.mean(values[0])[patch.pairs], rtol=1e-15)
        sums[0][:, patch.rows] += patch.over_first(weights[:, patch.pairs])
        sums[1][:, patch.columns] += patch.over_second(weights[:, patch.pairs])
    for total, end in zip(exact, (first, second), strict=True):
        np.add.at(total.T, end, weights.T)
    assert np.allclose(sums, exact, rtol=1e-13)


def test_no_pairs_make_no_patches():
    none = np.zeros(0, dtype=np.int32)
    assert Pairs(np.zeros((4, 3)), np.ones(4), none, none, np.zeros(0)).patches == []


def test_support_may_hold_every_point():
    points = random_sphere(150)
    first, _, _ = find_pairs(cKDTree(points), np.full(150, 10.0))
    assert len(first) == 150 * 149 // 2


def test_global_length_is_the_mean_distance_to_the_hundredth_neighbor():
    points = random_sphere(500)
    distance = np.sort(cdist(points, points), axis=1)[:, 100]  # column 0 is the point itself
    cloud = read_cloud(points, LaplacianOptions(bandwidth="global"))
    np.testing.assert_allclose(cloud.pairs.lengths * cloud.scaled.scale, distance.mean(), rtol=1e-12)


def test_local_length_follows_the_spacing():
    points = uneven_sphere(2000)
    cloud = read_cloud(points, LaplacianOptions(bandwidth="local"))
    lengths = cloud.scaled.scatter(cloud.pairs.lengths, 0.0)
    dense, coarse = lengths[points[:, 2] > 0.6].mean(), lengths[points[:, 2] < -0.6].mean()
    assert coarse / dense == pytest.approx(3.0, rel=0.1)


def test_local_length_varies_slowly():
    options = LaplacianOptions(bandwidth="local", bandwidth_factor=0.55)
    pairs = read_cloud(random_sphere(3000), options).pairs
    change = pairs.lengths[pairs.first] / pairs.lengths[pairs.second]
    assert np.abs(np.log(change)).max() < 0.35


def test_scaled_coordinates_are_free_of_units():
    points = random_sphere(400)
    plain = read_cloud(points, LaplacianOptions())
    moved = read_cloud(1e3 * points + 7.0, LaplacianOptions())
    np.testing.assert_allclose(moved.pairs.lengths, plain.pairs.lengths, rtol=1e-9)
    assert moved.scaled.scale == pytest.approx(1e3 * plain.scaled.scale, rel=1e-9)
    assert np.sqrt(np.mean(np.sum(plain.scaled.points**2, axis=1))) == pytest.approx(1.0, rel=1e-12)


def test_distance_of_very_many_points_is_that_of_few():
    """Of a plane whose area is 1: each of n points has the n-th part of it."""
    points = np.random.default_rng(0).random((400_000, 3)) * (1.0, 1.0, 0.0)
    for count in (20_000, 400_000):
        np.testing.assert_allclose(typical_distance(points[:count]), count**-0.5, rtol=0.05)


def test_nearest_rows_are_those_of_the_nearest_points():
    points = random_sphere(300)
    rows = np.random.default_rng(0).permutation(300)[:20]
    assert np.array_equal(nearest_rows(points, 1.02 * points[rows]), rows)
