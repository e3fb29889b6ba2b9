"""A blue-noise subset, and what is carried from it to all points, against answers that are known."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import core
from benchmarks.samplings import random_sphere, torus_points


def spacing_of(count, area=4.0 * np.pi):
    return np.sqrt(area / count)


@pytest.fixture(scope="module")
def sphere():
    return random_sphere(20000)


@pytest.fixture(scope="module")
def subset(sphere):
    return core.clean.blue_noise_subset(sphere, 3000)


@pytest.fixture(scope="module")
def prolongation(sphere, subset):
    return core.clean.Prolongation(sphere, subset, sphere[subset])


@pytest.mark.parametrize("count", [100, 3000, 15000])
def test_as_many_as_wanted_nearly(sphere, count):
    chosen = core.clean.blue_noise_subset(sphere, count)
    assert 0.9 * count <= len(chosen) <= count
    assert np.all(np.diff(chosen) > 0)


def test_no_point_is_close_to_another_and_none_is_far_from_all(sphere, subset):
    """Of random points of that number the closest two are a hundredth of the spacing apart."""
    spacing = spacing_of(len(subset))
    tree = cKDTree(sphere[subset])
    assert tree.query(sphere[subset], k=2)[0][:, 1].min() > 0.65 * spacing
    assert tree.query(sphere)[0].max() < 1.1 * spacing


def test_density_is_evened_out():
    points = torus_points(30000)
    points = np.concatenate([points, points[points[:, 0] > 0.0] * (1.0 + 1e-4), points[points[:, 0] > 0.0]])
    chosen = points[core.clean.blue_noise_subset(points, 2000)]
    assert np.mean(chosen[:, 0] > 0.0) == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("count", [10000, 13000, 15000, 17000])
def test_rounded_coordinates_leave_as_many(count):
    """Distances between them jump, so that one radius leaves far too few, and any smaller one too many."""
    points = np.round(torus_points(60000), 2)
    chosen = points[core.clean.blue_noise_subset(points, count)]
    assert 0.9 * count <= len(chosen) <= count
    spacing = spacing_of(count, np.pi**2 * 1.6)
    assert cKDTree(chosen).query(chosen, k=2)[0][:, 1].min() > 0.6 * spacing
    assert cKDTree(chosen).query(points)[0].max() < 1.2 * spacing


def test_order_makes_no_difference(sphere, subset):
    order = np.random.default_rng(1).permutation(len(sphere))
    again = core.clean.blue_noise_subset(sphere[order], 3000)
    assert set(order[again]) == set(subset)


def test_of_duplicates_one_at_most(sphere, subset):
    double = np.concatenate([sphere, sphere])
    chosen = core.clean.blue_noise_subset(double, 3000)
    assert {*map(tuple, double[chosen])} == {*map(tuple, sphere[subset])}
    assert len(core.clean.blue_noise_subset(np.repeat(sphere[:100], 5, axis=0), 400)) == 100
    assert len(core.clean.blue_noise_subset(np.ones((10, 3), dtype=int), 4)) == 1


def test_few_points_are_all_taken(sphere):
    assert np.array_equal(core.clean.blue_noise_subset(sphere[:500], 500), np.arange(500))


def test_clusters_far_apart():
    """Nearly all points in a tenth of a thousandth of the extent."""
    points = np.concatenate([1e-4 * random_sphere(5000), random_sphere(500, 1) + 10.0])
    chosen = core.clean.blue_noise_subset(points, 400)
    assert 0 < len(chosen) <= 400


@pytest.mark.parametrize("count", [0, -3, 2.5])
def test_a_count_that_is_none_is_refused(sphere, count):
    with pytest.raises(core.InvalidPointsError, match="whole number of at least 1"):
        core.clean.blue_noise_subset(sphere, count)


def test_areas_keep_their_total(sphere, subset, prolongation):
    areas = core.build_laplacian(sphere[subset]).areas
    shared = prolongation.shares(areas)
    assert shared.sum() == pytest.approx(areas.sum(), rel=1e-12)
    assert shared.sum() == pytest.approx(4.0 * np.pi, rel=1e-3)
    assert shared.min() > 0.0


def test_areas_go_to_no_points_that_are_left_out(sphere, subset, prolongation):
    areas = core.build_laplacian(sphere[subset]).areas
    out = np.setdiff1d(np.arange(0, len(sphere), 5), subset)
    shared = prolongation.shares(areas, out)
    assert (shared[out] == 0.0).all()
    assert np.delete(shared, out).min() > 0.0
    np.testing.assert_allclose(np.bincount(prolongation.nearest, shared), areas, rtol=1e-12)


def test_functions_are_carried_to_second_order(sphere, subset, prolongation):
    """Of modes of degree 1 and 2 a linear function misses about l (l + 1) spacing^2 / 8 within the spacing."""
    for degree, mode in ((1, sphere[:, 2]), (2, sphere[:, 0] * sphere[:, 1])):
        carried = prolongation.interpolate(mode[subset])
        np.testing.assert_array_equal(carried[subset], mode[subset].astype(np.float32))
        scale = degree * (degree + 1) * spacing_of(len(subset)) ** 2
        assert np.abs(carried - mode).max() < 0.6 * scale
        assert np.sqrt(np.mean((carried - mode) ** 2)) < 0.1 * scale


def test_the_error_falls_with_the_square_of_the_spacing(sphere):
    errors = []
    for count in (500, 2000):
        chosen = core.clean.blue_noise_subset(sphere, count)
        carried = core.clean.Prolongation(sphere, chosen, sphere[chosen]).interpolate(sphere[chosen])
        errors.append(np.sqrt(np.mean((carried - sphere) ** 2)))
    assert errors[0] / errors[1] > 3.5


def test_linear_functions_of_a_plane_stay_linear():
    points = np.random.default_rng(0).uniform(size=(5000, 3)) * [1.0, 1.0, 0.0]
    chosen = core.clean.blue_noise_subset(points, 600)
    values = 3.0 * points[:, 0] - points[:, 1]
    inside = np.all(np.abs(points[:, :2] - 0.5) < 0.45, axis=1)
    carried = core.clean.Prolongation(points, chosen, np.tile([0.0, 0.0, 1.0], (len(chosen), 1))).interpolate(
        values[chosen]
    )
    assert np.abs(carried - values)[inside].max() < 0.02 * spacing_of(600, 1.0)
    assert np.abs(carried - values).max() < 0.5 * spacing_of(600, 1.0)


def test_close_sheets_stay_apart():
    """Two sides of a wall, a third of the subset's spacing apart, each with values of its own."""
    side = np.random.default_rng(0).uniform(size=(20000, 2))
    upper = np.arange(20000) % 2 == 0
    spacing = spacing_of(1000, 1.0)
    points = np.column_stack([side, np.where(upper, spacing / 3.0, 0.0)])
    chosen = core.clean.blue_noise_subset(points, 2000)
    normals = np.where(upper[chosen, None], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0])
    every = core.clean.Prolongation(points, chosen, normals)
    assert np.mean(every.labels(upper[chosen]) == upper) > 0.98
    assert np.mean(np.abs(every.interpolate(upper[chosen].astype(float)) - upper) < 1e-6) > 0.98


def test_columns_and_labels(sphere, subset, prolongation):
    both = prolongation.interpolate(sphere[subset, :2])
    np.testing.assert_allclose(both[:, 1], prolongation.interpolate(sphere[subset, 1]), atol=1e-6)
    labels = prolongation.labels(np.arange(len(subset)))
    np.testing.assert_array_equal(labels[subset], np.arange(len(subset)))


def test_components_are_kept_apart():
    points = np.random.default_rng(0).uniform(size=(4000, 3)) * [1.0, 1.0, 0.0]
    chosen = core.clean.blue_noise_subset(points, 500)
    right = points[chosen, 0] > 0.5
    normals = np.tile([0.0, 0.0, 1.0], (len(chosen), 1))
    carried = core.clean.Prolongation(points, chosen, normals, right.astype(int)).interpolate(right.astype(float))
    assert set(np.unique(carried.round(5))) == {0.0, 1.0}


@pytest.mark.parametrize("rows", [[], [7, 20000], [[1, 2]], [0.5]])
def test_no_subset_is_refused(sphere, rows):
    with pytest.raises(core.InvalidPointsError, match="A subset has the shape"):
        core.clean.Prolongation(sphere, rows, np.ones((len(rows), 3)))


def test_normals_of_another_number_are_refused(sphere, subset):
    with pytest.raises(core.InvalidPointsError):
        core.clean.Prolongation(sphere, subset, sphere)


def test_a_subset_of_one_gives_its_value_to_all(sphere):
    single = core.clean.Prolongation(sphere[:50], [7], sphere[7:8])
    np.testing.assert_array_equal(single.interpolate([3.0]), np.full(50, 3.0, dtype=np.float32))
