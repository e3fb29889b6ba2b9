import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from benchmarks.samplings import random_sphere, uneven_sphere
from core.geometry.bandwidth import smoothing_lengths
from core.geometry.cloud import read_cloud
from core.geometry.nearest import find_nearest
from core.geometry.pairs import find_pairs
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


def test_support_may_hold_every_point():
    points = random_sphere(150)
    first, _, _ = find_pairs(cKDTree(points), np.full(150, 10.0))
    assert len(first) == 150 * 149 // 2


def test_global_length_is_the_mean_distance_to_the_hundredth_neighbor():
    points = random_sphere(500)
    distance = np.sort(cdist(points, points), axis=1)[:, 100]  # column 0 is the point itself
    lengths = smoothing_lengths(find_nearest(points), LaplacianOptions.paper())
    np.testing.assert_allclose(lengths, distance.mean(), rtol=1e-12)


def test_local_length_follows_the_spacing():
    points = uneven_sphere(4000)
    lengths = smoothing_lengths(find_nearest(points), LaplacianOptions(bandwidth="local"))
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
