"""Tiles of a cloud: each measured as it is within the whole, however the cloud is cut."""

from dataclasses import fields
from functools import cache

import numpy as np
import pytest
from scipy.spatial import cKDTree

import core
from benchmarks.surveys import agreed_among, agreed_on, in_order, survey
from core.geometry import Agreed, find_nearest
from core.geometry.boundary import no_boundary
from core.geometry.moments import least_error
from core.tiles.cut import spacing_around
from core.tiles.labels import agree_on_signs

COUNT = 2800
LENGTH, RADIUS = 12.0, 0.1  # of rods so long that tiles with halos are two thirds of them
SPACING = np.sqrt(2.0 * np.pi * RADIUS * LENGTH / COUNT)
KINDS = ("noisy", "several")


def rod(count, length, rng):
    """Return random points of a rod with round ends, (count, 3)."""
    points = rng.normal(size=(count, 3))
    cap = rng.random(count) < 2.0 * RADIUS / (length + 2.0 * RADIUS)
    points[~cap, 0] = 0.0
    points *= RADIUS / np.linalg.norm(points, axis=1)[:, None]
    points[:, 0] += np.where(cap, np.sign(points[:, 0]) * 0.5, rng.uniform(-0.5, 0.5, count)) * length
    return points


@cache
def rods(kind):
    """Return points of a rod, with noise, or with a short one, an outlier, and points at one place."""
    rng = np.random.default_rng(0)
    points = rod(COUNT, LENGTH, rng)
    if kind == "noisy":
        points = points + 0.15 * SPACING * rng.normal(size=points.shape)
    if kind == "several":
        short = rod(COUNT // 4, LENGTH / 4, rng) + [0.5, 1.0, 0.0]
        points = np.concatenate([points, short, points[:9], [[0.0, 0.0, 1.0]]])
    return points


@cache
def whole(kind):
    return core.build_laplacian(rods(kind))


@pytest.fixture(scope="module", params=KINDS)
def walk(request, tmp_path_factory):
    """A cloud in four tiles on disk, measured: its kind, the store, and what was agreed on."""
    store = survey(tmp_path_factory.mktemp("tiles") / "store", rods(request.param), 4)
    agreed = agreed_on(store)
    core.tiles.run_steps(store)
    return request.param, store, agreed


def same(left, right, rtol):
    np.testing.assert_allclose(left, right, rtol=0.0, atol=rtol * np.abs(right).max())


def assert_alike(store, laplacian, rtol):
    """Assert that joined tiles are the operator."""
    on = laplacian.component >= 0
    for name in ("normals", "quadric_mean_curvature", "gaussian_curvature", "smoothing_lengths", "areas", "trust"):
        same(in_order(store, name)[on], getattr(laplacian, name)[on], rtol)
    same(in_order(store, "mean_curvature")[on], core.measure.mean_curvature(laplacian)[on], rtol)
    for name in ("boundary", "component", "doubt"):
        np.testing.assert_array_equal(in_order(store, name), getattr(laplacian, name))
    assert abs(in_order(store, "areas").sum() / laplacian.areas.sum() - 1.0) < 1e-9


class TestAgreed:
    @pytest.mark.parametrize("kind", KINDS)
    def test_given_back_makes_the_same_operator_to_the_bit(self, kind):
        points = rods(kind)[-1400:]
        first = core.build_laplacian(points)
        again = core.build_laplacian(points, agreed=first.agreed)
        for name in ("areas", "normals", "smoothing_lengths", "component", "trust", "shape_operator", "boundary"):
            np.testing.assert_array_equal(getattr(again, name), getattr(first, name))
        np.testing.assert_array_equal(again.stiffness.data, first.stiffness.data)
        for quantity in fields(Agreed):
            np.testing.assert_array_equal(getattr(again.agreed, quantity.name), getattr(first.agreed, quantity.name))

    def test_notes_what_was_decided(self):
        agreed = whole("several").agreed
        assert agreed.smallest == COUNT // 4
        assert agreed.noisy is False
        assert whole("noisy").agreed.noisy is True
        assert agreed.component.max() == 1
        assert agreed.component[-1] == -1

    def test_among_some_points_keeps_the_bridges_within(self):
        agreed = Agreed(bridges=np.array([[0, 5], [3, 4], [4, 1]]), component=np.arange(6))
        some = agreed.among(np.array([1, 3, 4]), 6)
        np.testing.assert_array_equal(some.bridges, [[1, 2], [2, 0]])
        np.testing.assert_array_equal(some.component, [1, 3, 4])


def test_spacing_is_even_around_random_points():
    points = np.pad(np.random.default_rng(0).random((4000, 2)), ((0, 0), (0, 1)))
    inner = np.abs(points[:, :2] - 0.5).max(axis=1) < 0.4
    around, own = spacing_around(points)[inner] * 4000**0.5, find_nearest(points).spacing[inner] * 4000**0.5
    assert abs(around.mean() - 1.0) < 0.05
    assert around.std() < 0.75 * own.std()
    np.testing.assert_array_equal(spacing_around(points[:1]), [0.0])


class TestTiles:
    def test_divide_the_points(self, walk):
        kind, store, _ = walk
        rows = [store.columns(number)["row"] for number in range(store.count)]
        np.testing.assert_array_equal(np.sort(np.concatenate(rows)), np.arange(len(rods(kind))))
        assert max(len(store.part(number).points) for number in range(store.count)) < 0.8 * len(rods(kind))

    def test_have_halos_of_the_points_near_their_own(self, tmp_path):
        points, halo = rods("several"), 10.0
        store = survey(tmp_path / "store", points, 4, halo, until="areas")
        spacing = np.empty(len(points))
        rows = [store.columns(number)["row"] for number in range(store.count)]
        for own in rows:
            spacing[own] = spacing_around(points[own])
        for number, (_, among) in enumerate(agreed_among(store)):
            own, part = rows[number], store.part(number)
            distance = cKDTree(points[own]).query(points)[0]
            away = distance / np.maximum(spacing, np.median(spacing[own]))
            np.testing.assert_array_equal(np.sort(among), np.flatnonzero(away <= halo))
            np.testing.assert_array_equal(part.close, away[among] <= 0.5 * halo)
            np.testing.assert_array_equal(part.points, points[among])

    def test_hold_points_at_one_place_together(self, tmp_path):
        points = np.repeat(np.random.default_rng(0).random((50, 3)), 3, axis=0)
        store = core.tiles.cut_to_store(lambda: [(points, {"row": np.arange(150)})], tmp_path / "store", 40)
        for number in range(store.count):
            own = store.columns(number)["row"]
            assert np.all(np.bincount(own // 3)[own // 3] == 3)

    def test_are_measured_as_the_whole(self, walk):
        kind, store, _ = walk
        assert_alike(store, whole(kind), 1e-5 if kind == "noisy" else 1e-6)

    def test_are_rows_of_the_matrix_of_the_whole_by_its_record(self, walk):
        kind, store, _ = walk
        points, laplacian, rtol = rods(kind), whole(kind), 1e-5 if kind == "noisy" else 1e-6
        for number, (_, rows) in enumerate(agreed_among(store)):
            part = core.build_laplacian(points[rows], agreed=laplacian.agreed.among(rows, len(points)))
            own = slice(len(store.own(number)))
            wanted = laplacian.stiffness[rows[own]]
            assert abs(part.stiffness[own] - wanted[:, rows]).max() <= rtol * abs(laplacian.stiffness).max()
            assert np.isin(wanted.indices, rows).all()


class TestSurvey:
    def test_finds_what_the_whole_decides(self, walk):
        kind, _, found = walk
        known = whole(kind).agreed
        for name in ("center", "scale", "spacing", "reach"):
            np.testing.assert_allclose(getattr(found, name), getattr(known, name), rtol=1e-12, atol=1e-15)
        for name in ("component", "sheet", "smallest", "noisy"):
            np.testing.assert_array_equal(getattr(found, name), getattr(known, name))
        on = known.sheet >= 0
        assert np.all(np.einsum("ij,ij->i", found.side, known.side)[on] > 0.0)

    def test_does_not_depend_on_the_cut(self, walk, tmp_path):
        kind, store, known = walk
        turned = rods(kind) @ np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
        other = survey(tmp_path / "store", turned, 3)
        found, rtol = agreed_on(other), 1e-5 if kind == "noisy" else 1e-6
        core.tiles.run_steps(other)
        np.testing.assert_allclose(found.ratio, known.ratio, rtol=rtol)
        np.testing.assert_array_equal(found.sheet, known.sheet)
        for name in ("areas", "mean_curvature"):
            same(in_order(other, name), in_order(store, name), rtol)


def test_errors_of_moments_do_not_depend_on_which_points_are_asked_together():
    points = np.random.default_rng(0).normal(size=(600, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    areas, lengths = np.full(600, 4.0 * np.pi / 600), np.full(600, 0.2)
    given = find_nearest(points), points, areas, no_boundary(600), lengths
    together = least_error(*given, np.arange(600))
    hard = np.flatnonzero(together > 1e-2)
    assert 10 < len(hard) < 500
    for rows in hard, np.flatnonzero(together < 1e-2)[:50]:
        np.testing.assert_allclose(least_error(*given, rows), together[rows], rtol=1e-3, atol=1e-6)


class TestLabels:
    def test_of_signs_follow_most_votes(self):
        # A chain of three patches, the second reversed; one false vote between the ends, and a patch alone.
        sign = agree_on_signs(np.array([0, 1, 0, 1]), np.array([1, 2, 2, 0]), np.array([-4.0, -7.0, -1.0, -5.0]), 4)
        np.testing.assert_array_equal(sign, [1.0, -1.0, 1.0, 1.0])


def test_points_that_fill_volumes_are_judged_alike_however_the_cloud_is_cut(tmp_path):
    rng = np.random.default_rng(0)
    ground = np.column_stack([rng.uniform(0.0, 40.0, 3000), rng.uniform(0.0, 10.0, 3000), np.zeros(3000)])
    leaves = [
        size * rng.normal(size=(400, 3)) + place for size, place in ((0.8, [8.0, 5.0, 6.0]), (1.4, [30.0, 5.0, 6.0]))
    ]
    points = np.concatenate([ground, *leaves])
    first, second = (
        survey(tmp_path / str(count), points, count, 6.0, until="sheets").record["filling"] for count in (2, 5)
    )
    assert first[0] > 0.4  # of the spacing
    np.testing.assert_allclose(first, second, rtol=1e-9)


def test_sides_where_sheets_come_close_are_those_of_the_whole(tmp_path):
    rng = np.random.default_rng(1)
    along, angle = rng.uniform(0.0, LENGTH, 3000), rng.uniform(0.0, 2.0 * np.pi, 3000)
    points = np.column_stack([along, 0.25 * np.cos(angle), 0.05 * np.sin(angle)])  # a flat tube
    found = agreed_on(survey(tmp_path / "store", points, 4, until="areas")).side
    wanted = core.build_laplacian(points).agreed
    on = wanted.side.any(axis=1)
    assert np.mean(on) > 0.99
    assert np.all(np.einsum("ij,ij->i", found, wanted.side)[on] > 0.0)


def test_curves_are_no_surface_in_tiles_either(tmp_path):
    angle = np.linspace(0.0, 2.0 * np.pi, 3000, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle), 0.2 * np.sin(3.0 * angle)])
    with pytest.raises(core.NotASurfaceError, match="along a curve"):
        survey(tmp_path / "store", circle, 3, 10.0)


def test_one_smoothing_length_is_that_of_the_whole(tmp_path):
    options = core.LaplacianOptions(bandwidth="global", neighbors=30, bandwidth_factor=0.5)
    points = rods("several")[COUNT * 3 // 4 :]  # a quarter of the long one, and all else
    laplacian = core.build_laplacian(points, options=options)
    store = survey(tmp_path / "store", points, 2, options=options)
    np.testing.assert_allclose(store.record["length"], laplacian.agreed.length, rtol=1e-12)
    core.tiles.run_steps(store)
    same(in_order(store, "areas"), laplacian.areas, 1e-6)
    same(in_order(store, "mean_curvature"), core.measure.mean_curvature(laplacian), 1e-6)


def test_halos_are_as_wide_as_kernels_ask_for():
    kernels = {"adaptive": 1.0, "local": (9.0 * 100 / 60) ** 0.5}
    for bandwidth, width in kernels.items():
        for factor in (1.0, 2.0):
            options = core.LaplacianOptions(bandwidth=bandwidth, bandwidth_factor=factor)
            np.testing.assert_allclose(core.tiles.halo_of(options), core.tiles.HALO * factor * width)
    assert core.tiles.halo_of(core.LaplacianOptions(bandwidth_factor=0.9)) == core.tiles.HALO
