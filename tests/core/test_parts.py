"""The table of measures of parts: areas, boundaries and means, against known ones."""

import numpy as np
import pytest

import core
from benchmarks.samplings import random_sphere


def two_spheres():
    """A unit sphere, one of radius 2 beside it, and a stray point."""
    points = random_sphere(1500, 3)
    return np.concatenate([points, 2.0 * random_sphere(1500, 4) + [6.0, 0.0, 0.0], [[3.0, 9.0, 0.0]]])


@pytest.fixture(scope="module")
def spheres():
    return core.build_laplacian(two_spheres())


def test_each_component_has_its_own_area(spheres):
    found = core.measure.measure_parts(spheres)
    radius = np.array([spheres.points[spheres.component == label, 0].max() > 2.0 for label in (0, 1)]) + 1.0
    np.testing.assert_allclose(found.areas, 4.0 * np.pi * radius**2, rtol=2e-3)
    assert (np.abs(found.areas - 4.0 * np.pi * radius**2) < found.area_uncertainties).all()
    assert (found.area_uncertainties < 0.01 * found.areas).all()
    assert found.points.tolist() == [1500, 1500]
    assert found.boundary_lengths.tolist() == found.length_uncertainties.tolist() == [0.0, 0.0]


def test_labels_of_components_are_the_components(spheres):
    one, other = core.measure.measure_parts(spheres), core.measure.measure_parts(spheres, spheres.component)
    for name in vars(one):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("labels", [(0, 1), (7, 3), (-1, 4)])
def test_halves_of_a_sphere_and_what_is_in_no_part(operators, labels):
    laplacian = operators("random sphere")
    found = core.measure.measure_parts(laplacian, np.where(laplacian.points[:, 2] > 0.0, *labels))
    named = sorted(label for label in labels if label >= 0)
    assert found.labels.tolist() == named
    np.testing.assert_allclose(found.areas, 2.0 * np.pi, rtol=0.01)
    np.testing.assert_allclose(found.boundary_lengths, 2.0 * np.pi, rtol=0.015)
    assert (np.abs(found.areas - 2.0 * np.pi) < found.area_uncertainties).all()
    assert (np.abs(found.boundary_lengths - 2.0 * np.pi) < found.length_uncertainties).all()
    assert found.points.sum() == np.count_nonzero(np.isin(np.where(laplacian.points[:, 2] > 0.0, *labels), named))


def test_a_part_of_a_component_and_a_whole_one_in_one_part(spheres):
    whole, sums = core.measure.measure_parts(spheres), core.measure.measure_parts(spheres, np.zeros(3001, dtype=int))
    assert sums.areas == pytest.approx(whole.areas.sum())
    half = np.where(spheres.points[:, 0] > 6.0, 0, 1)
    found = core.measure.measure_parts(spheres, half)
    np.testing.assert_allclose(found.areas, [8.0 * np.pi, 12.0 * np.pi], rtol=0.01)


def test_the_boundary_of_a_square(operators):
    found = core.measure.measure_parts(operators("square grid"))
    laplacian = operators("square grid")
    side = np.ptp(laplacian.points[:, 0])
    assert abs(found.areas[0] - side**2) < found.area_uncertainties[0] < 0.08 * side**2
    assert abs(found.boundary_lengths[0] - 4.0 * side) < found.length_uncertainties[0]


@pytest.mark.parametrize("noise", [0.1, 0.3])
def test_noise_is_within_the_uncertainty(noise):
    points = random_sphere(1500, 5)
    spacing = np.sqrt(4.0 * np.pi / 1500)
    heights = np.random.default_rng(6).normal(size=(1500, 1)) * noise * spacing
    exact, noisy = (
        core.measure.measure_parts(core.build_laplacian(given)) for given in (points, points * (1.0 + heights))
    )
    assert abs(noisy.areas[0] - 4.0 * np.pi) < noisy.area_uncertainties[0] < 0.05 * 4.0 * np.pi
    assert noisy.area_uncertainties[0] > 2.0 * exact.area_uncertainties[0]


def test_rotation_order_and_scale(spheres):
    order = np.random.default_rng(0).permutation(3001)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    other = core.build_laplacian(3.0 * spheres.points[order] @ turn.T + [1.0, 2.0, 3.0])
    label = (spheres.points[:, 1] > 0.3).astype(int)
    one, moved = core.measure.measure_parts(spheres, label), core.measure.measure_parts(other, label[order])
    assert moved.points.tolist() == one.points.tolist()
    np.testing.assert_allclose(moved.areas, 9.0 * one.areas, rtol=1e-6)
    np.testing.assert_allclose(moved.area_uncertainties, 9.0 * one.area_uncertainties, rtol=1e-4)
    np.testing.assert_allclose(moved.boundary_lengths, 3.0 * one.boundary_lengths, rtol=1e-4)


def test_means_by_area(spheres):
    values = np.full(3001, 2.0)
    means, squares = core.measure.part_means(spheres, values)
    np.testing.assert_allclose([means, squares], 2.0)
    height = spheres.points[:, 2]
    means, squares = core.measure.part_means(spheres, height)
    radius = np.sqrt(core.measure.measure_parts(spheres).areas / (4.0 * np.pi))
    np.testing.assert_allclose(means, 0.0, atol=0.01)
    np.testing.assert_allclose(squares, radius / np.sqrt(3.0), rtol=0.01)


def test_values_that_are_no_numbers_do_not_count(spheres):
    first = spheres.component == 0
    values = np.where(first, 1.0, np.nan)
    values[np.flatnonzero(first)[:5]] = np.inf
    means, squares = core.measure.part_means(spheres, values)
    assert means[0] == squares[0] == pytest.approx(1.0)
    assert np.isnan([means[1], squares[1]]).all()


@pytest.mark.parametrize("labels", [np.zeros(3), np.zeros(3001), np.zeros(3001, dtype=bool)])
def test_labels_of_another_kind_are_refused(spheres, labels):
    with pytest.raises(core.InvalidPointsError, match="whole number for each of 3001 points"):
        core.measure.measure_parts(spheres, labels)


def test_no_part_at_all_is_refused(spheres):
    with pytest.raises(core.InvalidPointsError, match="None of the 3001 points of the surface is in a part"):
        core.measure.measure_parts(spheres, np.full(3001, -1))


def test_it_can_be_cancelled(spheres):
    def stop(stage, fraction):
        raise core.Cancelled

    with pytest.raises(core.Cancelled):
        core.measure.measure_parts(spheres, (spheres.points[:, 2] > 0.0).astype(int), progress=stop)


@pytest.mark.parametrize("offset", [0.02, 0.3, 0.5, 0.7, 0.98])
@pytest.mark.parametrize("turned", [0.0, 1.0, 10.0])
def test_areas_of_sheets_on_grids_are_within_their_uncertainty(offset, turned):
    """How far beyond the last row of pixels a sheet goes on, nobody knows."""
    grid = np.stack(np.meshgrid(np.arange(-40.0, 40.0), np.arange(-40.0, 40.0)), axis=-1).reshape(-1, 2)
    angle = np.radians(turned)
    grid = grid @ np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    size = np.array([20.0, 15.0]) + offset
    inside = grid[(np.abs(grid) < size).all(axis=1)]
    parts = core.measure.measure_parts(core.build_laplacian(np.column_stack([inside, np.zeros(len(inside))])))
    assert abs(parts.areas[0] - 4.0 * size.prod()) <= parts.area_uncertainties[0]
