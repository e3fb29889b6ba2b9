from dataclasses import replace

import numpy as np
import pytest
from numpy.linalg import norm
from scipy.spatial import cKDTree

import core
from benchmarks.samplings import (
    fibonacci_sphere,
    hemisphere_random,
    marching_cubes_sphere,
    random_sphere,
    uneven_sphere,
)
from core.geometry.arcs import arc_length
from core.geometry.cloud import read_cloud
from core.geometry.pairs import Pairs, find_pairs
from core.kernel import SECOND_MOMENT, pair_kernel
from core.operator import weights as weights_module
from core.operator.areas import KernelMatrix, solve_areas
from core.operator.curvature import kernel_integral, uneven
from core.operator.weights import balance_weights

CLOUDS = {
    "even": lambda: fibonacci_sphere(3000),
    "random": lambda: np.concatenate([random_sphere(1500), -random_sphere(1500)]),  # its center is that of the sphere
    "marching cubes": lambda: marching_cubes_sphere(35),
}


def prepared(points, vary=None):
    """Return a cloud, distances, areas and pair weights, as the operator has them before they are balanced."""
    cloud = read_cloud(points, core.LaplacianOptions())
    pairs = cloud.pairs
    if vary is not None:
        lengths = vary(pairs.points)
        found = find_pairs(cKDTree(pairs.points), lengths)
        cloud = replace(cloud, pairs=Pairs(pairs.points, lengths, *found))
        pairs = cloud.pairs
    distance = arc_length(cloud)
    areas = solve_areas(cloud, distance)
    h = pairs.mean(pairs.lengths)
    weights = pair_kernel(distance / h) / h**4 * areas[pairs.first] * areas[pairs.second]
    return cloud, distance, areas, weights * pairs.mean(1.0 + SECOND_MOMENT / 4.0 * pairs.lengths**2)


def moments(cloud, weights, areas):
    """Return |first moment| times h, and the second moment over 2 areas, (m, 3, 3), from exact ways on the sphere."""
    pairs = cloud.pairs
    points = pairs.points / norm(pairs.points, axis=1)[:, None]
    first, second = (np.zeros((len(points), *shape)) for shape in ((3,), (3, 3)))
    for here, there in ((pairs.first, pairs.second), (pairs.second, pairs.first)):
        cosine = np.einsum("ij,ij->i", points[here], points[there])[:, None]
        way = points[there] - cosine * points[here]
        way *= np.arccos(np.clip(cosine, -1.0, 1.0)) / norm(way, axis=1)[:, None]
        np.add.at(first, here, weights[:, None] * way)
        np.add.at(second, here, (weights[:, None] * way)[:, :, None] * way[:, None, :])
    return norm(first, axis=1) / areas * pairs.lengths, second / (2.0 * areas)[:, None, None]


def spread(matrices):
    return (matrices**2).sum(axis=(1, 2))


class TestBalancedWeights:
    @pytest.mark.parametrize("name", CLOUDS)
    def test_have_no_first_moment_and_the_kernels_second(self, name):
        cloud, distance, areas, weights = prepared(CLOUDS[name]())
        balanced = weights * balance_weights(cloud, distance, weights, areas).factor
        x = cloud.pairs.points
        h = cloud.pairs.lengths[:, None, None]
        exact = (1.0 - SECOND_MOMENT / 12.0 * h**2) * (np.eye(3) - x[:, :, None] * x[:, None, :])
        errors = []
        for each in (weights, balanced):
            first, second = moments(cloud, each, areas)
            # h^4 terms, which are not part of the second moment's target, are below 1e-4 here.
            squares = first**2, spread(second - exact)
            errors.append([np.sqrt(np.average(squared, weights=areas)) for squared in squares])
        assert errors[1][0] < 0.25 * errors[0][0]
        assert errors[1][1] < max(0.5 * errors[0][1], 1e-4)

    @pytest.mark.parametrize("points", [random_sphere(750, 2), uneven_sphere(750)], ids=["random", "density jump"])
    def test_stay_positive(self, points):
        cloud, distance, areas, weights = prepared(points)
        factor = balance_weights(cloud, distance, weights, areas).factor
        assert factor.min() > 0.0
        assert np.ptp(factor) > 0.3
        stiffness = core.build_laplacian(points).stiffness.copy()
        stiffness.setdiag(0.0)
        assert stiffness.max() <= 0.0

    def test_do_not_follow_how_points_are_numbered(self):
        points = random_sphere(700)
        order = np.random.default_rng(0).permutation(len(points))
        found = []
        for turned in (points, points[order]):
            cloud, distance, areas, weights = prepared(turned)
            factor = cloud.pairs.half(balance_weights(cloud, distance, weights, areas).factor)
            place = np.argsort(cloud.scaled.first)
            found.append((factor + factor.T).tocsr()[place][:, place])
        assert abs(found[0][order][:, order] - found[1]).max() < 1e-9

    def test_reach_up_to_boundaries(self, monkeypatch):
        points = hemisphere_random(1500)
        distance = np.arcsin(points[:, 2])
        errors = []
        for rounds in (weights_module._ROUNDS, 0):
            monkeypatch.setattr(weights_module, "_ROUNDS", rounds)
            laplacian = core.build_laplacian(points)
            near = laplacian.near_boundary
            # Functions whose slope across the boundary is zero there.
            off = laplacian.apply(distance**2, raw=True) - 2.0 + 2.0 * distance * np.tan(distance)
            along = laplacian.apply(points[:, 0], raw=True) + 2.0 * points[:, 0]
            errors.append([norm(off[near]), norm(along[near])])
        balanced, plain = errors
        assert balanced[0] < 0.7 * plain[0]
        assert balanced[1] < 0.5 * plain[1]

    def test_of_points_without_pairs_are_none(self, monkeypatch):
        monkeypatch.setattr(
            "core.geometry.cloud.find_outliers", lambda nearest, usual: np.zeros(len(nearest.points), dtype=bool)
        )
        lone = np.random.default_rng(0).uniform(-1.4, 1.4, (100, 3))
        laplacian = core.build_laplacian(np.concatenate([random_sphere(1000), lone]))
        assert np.any(laplacian.stiffness.diagonal() == 0.0)
        assert np.all(laplacian.kernel_widths > 0.0)

    def test_make_the_operator_right_on_random_points(self):
        # Without them these are 2e-3 and 1.5e-3; a peer that is not symmetric (GMLS of degree 2) has 8e-4 and 1e-2.
        laplacian = core.build_laplacian(random_sphere(4000), options=core.LaplacianOptions(bandwidth_factor=1.7))
        x = laplacian.points
        assert norm(laplacian.apply(x) + 2.0 * x) < 2e-2 * norm(2.0 * x)
        exact = 2.0 - 6.0 * x**2
        assert norm(laplacian.apply(x**2) - exact) < 2e-2 * norm(exact)


def varying(points):
    return 0.1 * (1.0 + 0.15 * points[:, 2] ** 2)


@pytest.fixture(scope="module")
def sphere():
    return prepared(fibonacci_sphere(8000), varying)


class TestLengthsThatVary:
    def test_gain_of_the_integral(self, sphere):
        cloud, distance, *_ = sphere
        lengths, z = cloud.pairs.lengths, cloud.pairs.points[:, 2]
        exact = np.full(len(z), 4.0 * np.pi / len(z))
        sums = KernelMatrix(cloud.pairs, distance, cloud.boundary) @ exact
        # h = a (1 + c z^2), Laplacian(z^2) = 2 - 6 z^2 and |grad z^2|^2 = 4 z^2 (1 - z^2).
        laplacian, slope = 0.1 * 0.15 * (2.0 - 6.0 * z**2), (0.1 * 0.15) ** 2 * 4.0 * z**2 * (1.0 - z**2)
        expected = SECOND_MOMENT * (lengths * laplacian / 4.0 + slope / 8.0)
        gain = sums - kernel_integral(lengths, cloud.gaussian_curvature)
        inner = np.abs(z) < 0.95  # a Fibonacci sphere is uneven at its poles
        assert norm((gain - expected)[inner]) < 0.15 * norm(expected[inner])

    def test_leave_the_areas_right(self, sphere):
        cloud, _, areas, _ = sphere
        order = np.argsort(cloud.pairs.points[:, 2])
        bands = areas[order].reshape(16, 500).mean(axis=1) * len(areas) / (4.0 * np.pi)
        assert np.abs(bands - 1.0).max() < 3.5e-4  # 1.2e-3 without the gain

    def test_next_to_nothing_is_known_of_sharp_changes(self):
        np.testing.assert_allclose(uneven(np.array([1e-5, -1e-5])), [1e-5, -1e-5], rtol=1e-5)
        assert abs(uneven(1.0)) < 1e-3
