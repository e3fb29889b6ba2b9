"""Nodal domains and segments: known divisions, and what must not change them."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import pdist

import core
from benchmarks.labels import agreement
from benchmarks.samplings import (
    fibonacci_sphere,
    grid_points,
    parabolic_cylinder,
    parallel_sheets,
    random_sphere,
    sausage,
    square_random,
    trimmed_star,
)
from core.operator.graph import near_graph
from core.spectral.segmentation import _signature

TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])

WIDE = core.LaplacianOptions(bandwidth_factor=1.7)


def limbs(count=2400, seed=0):
    """Return random points on four spheres of different sizes that reach into a large one, and their number, 0 to 4."""
    centers = np.array([[0.0, 0, 0], [1.7, 0, 0.1], [-1.75, 0.2, 0], [0.1, 1.8, 0.3], [0, -1.6, 0.6]])
    radii = np.array([1.0, 0.9, 0.85, 0.95, 0.8])
    points = np.concatenate(
        [c + r * random_sphere(count // 4, 5 * seed + i) for i, (c, r) in enumerate(zip(centers, radii, strict=True))]
    )
    owner = np.repeat(np.arange(5), count // 4)
    away = np.linalg.norm(points[:, None] - centers, axis=2) - radii
    away[np.arange(len(points)), owner] = np.inf
    outside = away.min(axis=1) > 0.0
    return points[outside], owner[outside]


@pytest.fixture(scope="module")
def body():
    points, owner = limbs()
    laplacian = core.build_laplacian(points)
    return SimpleNamespace(points=points, owner=owner, laplacian=laplacian, labels=core.spectral.segment(laplacian, 5))


@pytest.fixture(scope="module")
def rectangle():
    return core.build_laplacian(parabolic_cylinder(0.0))


@pytest.fixture(scope="module")
def square(operators):
    return operators("random square")


@pytest.fixture(scope="module")
def two_spheres():
    """A small sphere before a large one, and three lone points between them."""
    lone = [[0.0, 9.0, 0.0], [0.0, -9.0, 0.0], [9.0, 0.0, 9.0]]
    return core.build_laplacian(
        np.concatenate([0.6 * fibonacci_sphere(600) + [4.0, 0.0, 0.0], lone, fibonacci_sphere(1500)])
    )


def pieces(labels, laplacian):
    """Return the number of connected pieces of every label."""
    graph = near_graph(laplacian, 8)
    label = labels[graph.first]
    counts = []
    for number in range(labels.max() + 1):
        own = np.flatnonzero(label == number)
        counts.append(connected_components(graph.lengths[own][:, own], directed=False)[0])
    return counts


class TestNearGraph:
    def test_symmetric_with_the_distances_of_the_points(self, square):
        graph = near_graph(square, 8)
        assert abs(graph.lengths - graph.lengths.T).max() == 0.0
        edges = graph.lengths.tocoo()
        x = square.points[graph.first]
        np.testing.assert_allclose(edges.data, np.linalg.norm(x[edges.row] - x[edges.col], axis=1))
        assert np.bincount(edges.row).min() >= 8

    def test_does_not_cross_to_a_close_sheet(self):
        points, sheet, _ = parallel_sheets(20, 1.5)
        graph = near_graph(core.build_laplacian(points), 8)
        edges = graph.lengths.tocoo()
        np.testing.assert_array_equal(sheet[graph.first][edges.row], sheet[graph.first][edges.col])

    def test_points_at_one_place_are_one(self):
        points = fibonacci_sphere(600)
        graph = near_graph(core.build_laplacian(np.repeat(points, 3, axis=0)), 8)
        assert graph.lengths.shape == (600, 600)
        assert np.all(graph.place.reshape(600, 3) == graph.place.reshape(600, 3)[:, :1])
        assert 8 <= graph.lengths.nnz / 600 < 11

    def test_a_point_that_the_stiffness_leaves_alone_is_joined_to_the_nearest(self, square):
        stiffness = square.stiffness.tolil()
        stiffness[7], stiffness[:, 7] = 0.0, 0.0
        fields = ("points", "surface_points", "component", "areas")
        cut = SimpleNamespace(stiffness=stiffness.tocsr(), **{name: getattr(square, name) for name in fields})
        graph = near_graph(cut, 8)
        assert connected_components(graph.lengths, directed=False)[0] == 1
        row = graph.place[7]
        nearest = np.sort(np.linalg.norm(square.points - square.points[7], axis=1))[1]
        np.testing.assert_allclose(graph.lengths[[row]].data, [nearest])

    def test_parts_stay_apart(self, two_spheres):
        graph = near_graph(two_spheres, 8)
        assert connected_components(graph.lengths, directed=False)[0] == 2
        np.testing.assert_array_equal(np.flatnonzero(graph.place < 0), [600, 601, 602])


class TestNodalDomains:
    def test_stripes(self, square):
        wave = np.cos(3.0 * np.pi * square.points[:, 0])
        domains = core.spectral.nodal_domains(square, wave)
        stripe = np.floor(3.0 * square.points[:, 0] + 0.5).astype(int)
        assert domains.max() == 3
        np.testing.assert_array_equal(np.unique(np.column_stack([domains, stripe]), axis=0)[:, 0], [0, 1, 2, 3])

    def test_a_checkerboard_holds_at_its_crossings(self, square):
        wave = np.prod(np.cos(3.0 * np.pi * square.points[:, :2]), axis=1)
        field = (np.floor(3.0 * square.points[:, :2] + 0.5) @ [4, 1]).astype(int)
        sure = np.abs(wave) > 0.1
        for lift in (0.0, 0.03, -0.03):  # which opens a way between half of the fields at every crossing
            domains = core.spectral.nodal_domains(square, wave + lift)
            assert domains.max() == 15
            assert agreement(domains[sure], field[sure]) == 1.0

    def test_a_thin_lobe_keeps_those_beside_it_apart(self):
        points = square_random(1500, 3)
        laplacian = core.build_laplacian(points, options=WIDE)
        spacing = 1.0 / np.sqrt(len(points))
        assert 3.0 * laplacian.smoothing_lengths.min() > 5.0 * spacing  # the kernel reaches across
        domains = core.spectral.nodal_domains(laplacian, np.abs(points[:, 0] - 0.5) - spacing)
        left, right = domains[points[:, 0] < 0.4], domains[points[:, 0] > 0.6]
        assert len(np.unique(left)) == len(np.unique(right)) == 1
        assert left[0] != right[0]

    def test_a_low_bridge_and_a_high_one(self, square):
        x = square.points[:, 0]
        hills = np.exp(-0.5 * ((x - 0.25) / 0.08) ** 2) + 0.5 * np.exp(-0.5 * ((x - 0.75) / 0.08) ** 2)
        assert core.spectral.nodal_domains(square, hills + 0.01).max() == 1
        assert core.spectral.nodal_domains(square, hills + 0.01, bridge=0.0).max() == 0
        assert core.spectral.nodal_domains(square, hills + 0.2).max() == 0

    def test_specks_and_zeros_join_what_surrounds_them(self, square):
        x = square.points[:, 0] - 0.5
        expected = core.spectral.nodal_domains(square, x)
        spoiled = x.copy()
        deep = np.flatnonzero(np.abs(x) > 0.2)[::97]
        spoiled[deep] = -x[deep]
        spoiled[np.flatnonzero(np.abs(x) > 0.2)[50::97]] = 0.0
        np.testing.assert_array_equal(core.spectral.nodal_domains(square, spoiled), expected)

    def test_larger_first_then_the_higher_mean(self, rectangle):
        x = rectangle.points[:, 0] / 0.6
        np.testing.assert_array_equal(core.spectral.nodal_domains(rectangle, x + 0.37) == 0, x > -0.37)
        np.testing.assert_array_equal(core.spectral.nodal_domains(rectangle, -x - 0.37) == 0, x > -0.37)
        even = core.build_laplacian(grid_points(np.arange(20.0), np.arange(17.0), [0.0]))
        for sign in (1.0, -1.0):
            values = sign * (even.points[:, 0] - 9.5)
            np.testing.assert_array_equal(core.spectral.nodal_domains(even, values), (values < 0.0).astype(int))

    def test_sign_and_size_of_the_values_do_not_matter(self, square):
        values = np.sin(7.0 * square.points[:, 0]) + np.cos(5.0 * square.points[:, 1])
        domains = core.spectral.nodal_domains(square, values)
        np.testing.assert_array_equal(core.spectral.nodal_domains(square, 1e-9 * values), domains)
        assert agreement(core.spectral.nodal_domains(square, -values), domains) == 1.0

    def test_components_and_points_left_out(self, two_spheres):
        z = two_spheres.points[:, 2].copy()
        domains = core.spectral.nodal_domains(two_spheres, z)
        np.testing.assert_array_equal(domains[600:603], -1)
        assert domains.max() == 3
        np.testing.assert_array_equal(np.unique(domains[603:]), [0, 1])
        z[:600] = 0.0  # the mode of another part
        domains = core.spectral.nodal_domains(two_spheres, z)
        assert domains.max() == 2
        assert len(np.unique(domains[:600])) == 1

    def test_no_sign_at_all(self, square):
        assert np.all(core.spectral.nodal_domains(square, np.zeros(2500)) == 0)
        assert np.all(core.spectral.nodal_domains(square, np.full(2500, -3)) == 0)

    @pytest.mark.parametrize(("mode", "count"), [(4, 4), (10, 9)])
    def test_isometric_surfaces_have_the_same_domains(self, rectangle, mode, count):
        flat = rectangle.eigenpairs(11).eigenvectors[:, mode - 1]
        bent = core.build_laplacian(parabolic_cylinder(1.0))
        sure = np.abs(flat) > 0.02 * np.abs(flat).max()
        first = core.spectral.nodal_domains(rectangle, flat)
        second = core.spectral.nodal_domains(bent, bent.eigenpairs(11).eigenvectors[:, mode - 1])
        assert first.max() + 1 == count
        assert agreement(first[sure], second[sure]) >= 0.97

    def test_noise_does_not_change_those_of_a_trimmed_star(self):
        points = trimmed_star(1500)  # an even sample
        laplacian = core.build_laplacian(points)
        noise = 0.03 * np.sqrt(laplacian.areas.sum() / 1500) * np.random.default_rng(1).standard_normal((1500, 3))
        rough = core.build_laplacian(points + noise)
        clean, noisy = (
            core.spectral.nodal_domains(each, each.eigenpairs(7).eigenvectors[:, 5]) for each in (laplacian, rough)
        )
        assert clean.max() == 5
        assert agreement(clean, noisy) > 0.93

    @pytest.mark.parametrize("bent", [False, True])
    def test_the_second_mode_halves_a_sausage(self, bent):
        points, along = sausage(2000, bent)
        laplacian = core.build_laplacian(points)
        domains = core.spectral.nodal_domains(laplacian, laplacian.eigenpairs(2).eigenvectors[:, 1])
        assert domains.max() == 1
        assert agreement(domains, (along > 3.0).astype(int)) > 0.97

    @pytest.mark.parametrize(
        ("values", "match"),
        [
            (np.ones(7), "Give one real number for each of 2500 points"),
            (np.ones((2500, 2)), "Give one real number for each of 2500 points"),
            (np.full(2500, "a"), "Give one real number for each of 2500 points"),
            (np.where(np.arange(2500) < 3, np.nan, 1.0), "3 of 2500 values are not finite"),
        ],
    )
    def test_values_that_make_no_sense(self, square, values, match):
        with pytest.raises(core.InvalidPointsError, match=match):
            core.spectral.nodal_domains(square, values)

    @pytest.mark.parametrize("settings", [{"threshold": 1.0}, {"bridge": -0.1}, {"smallest": 0}])
    def test_settings_that_make_no_sense(self, square, settings):
        with pytest.raises(core.PointCloudError, match="nodal domain"):
            core.spectral.nodal_domains(square, np.ones(2500), **settings)


class TestSegment:
    def test_limbs_are_parts(self, body):
        assert agreement(body.labels, body.owner) > 0.93
        assert np.all(np.diff(np.bincount(body.labels)) <= 0)

    @pytest.mark.parametrize("parts", [1, 2, 3, 7, 12])
    def test_all_parts_are_there_and_connected(self, body, parts):
        labels = core.spectral.segment(body.laplacian, parts)
        np.testing.assert_array_equal(np.unique(labels), np.arange(parts))
        assert pieces(labels, body.laplacian) == [1] * parts

    def test_signs_do_not_matter(self, body, monkeypatch):
        spectrum = body.laplacian.eigenpairs(core.spectral.modes_needed(body.laplacian, 5))
        signs = np.where(np.arange(len(spectrum.eigenvalues)) % 2, 1.0, -1.0)
        turned = core.Spectrum(spectrum.eigenvalues, spectrum.eigenvectors * signs)
        monkeypatch.setattr(core.LaplaceBeltrami, "eigenpairs", lambda *_, **__: turned)
        np.testing.assert_array_equal(core.spectral.segment(body.laplacian, 5), body.labels)

    def test_a_basis_of_modes_of_one_eigenvalue_does_not_matter(self, body, monkeypatch):
        count = core.spectral.modes_needed(body.laplacian, 5)
        spectrum = body.laplacian.eigenpairs(count)
        values, vectors = spectrum.eigenvalues.copy(), spectrum.eigenvectors.copy()
        values[1:4] = values[1:4].mean()
        values[-3:] = values[-1]  # the last ones are cut off in the middle of their space
        plain = core.Spectrum(values, vectors.copy())
        vectors[:, 1:4] = vectors[:, 1:4] @ TURN
        vectors[:, -3:] = vectors[:, -3:] @ TURN
        turned = core.Spectrum(values, vectors)
        away, labels = [], []
        for spectrum in (plain, turned):
            monkeypatch.setattr(core.LaplaceBeltrami, "eigenpairs", lambda *_, known=spectrum, **__: known)
            away.append(pdist(_signature(body.laplacian, 5, None)[::20]))
            labels.append(core.spectral.segment(body.laplacian, 5))
        np.testing.assert_allclose(*away, rtol=1e-9)
        # The longest axis of all points is ambiguous then: k-means may end some border points apart.
        assert agreement(*labels) > 0.99

    def test_modes_that_are_kept_give_the_same(self, body):
        for known in (4, core.spectral.modes_needed(body.laplacian, 5) + 9):
            body.laplacian.release()
            body.laplacian.eigenpairs(known)
            assert agreement(core.spectral.segment(body.laplacian, 5), body.labels) > 0.999

    @pytest.mark.parametrize("parts", [2, 5, 12])
    def test_the_modes_of_a_sphere_do_not_make_it_fail(self, operators, parts):
        laplacian = operators("even sphere")
        labels = core.spectral.segment(laplacian, parts)
        size = np.bincount(labels)
        assert pieces(labels, laplacian) == [1] * parts
        assert size.min() > 0.5 * size.mean()

    def test_density_does_not_matter(self, body):
        more = limbs(900, 1)[0]
        uneven = core.build_laplacian(np.concatenate([body.points, more[more[:, 0] > 0.0]]))
        labels = core.spectral.segment(uneven, 5)[: len(body.points)]
        assert agreement(labels, body.labels) > 0.95

    def test_components_get_parts_by_their_areas(self, two_spheres):
        labels = core.spectral.segment(two_spheres, 2)
        np.testing.assert_array_equal(labels, np.repeat([1, -1, 0], [600, 3, 1500]))
        labels = core.spectral.segment(two_spheres, 6)
        np.testing.assert_array_equal(labels[600:603], -1)
        small, large = np.unique(labels[:600]), np.unique(labels[603:])
        assert (len(small), len(large)) == (2, 4)  # of areas 0.36 and 1
        assert pieces(labels, two_spheres) == [1] * 6
        assert len(np.unique(core.spectral.segment(two_spheres, 12)[:600])) == 3

    def test_fewer_modes_are_resolved_than_wanted(self):
        parts, rectangle = 35, core.build_laplacian(parabolic_cylinder(0.0), options=WIDE)
        with pytest.raises(core.UnresolvedModesError):
            rectangle.eigenpairs(core.spectral.modes_needed(rectangle, parts))
        assert pieces(core.spectral.segment(rectangle, parts), rectangle) == [1] * parts

    @pytest.mark.parametrize(
        ("parts", "error", "match"),
        [
            (0, core.TooFewPointsError, "0 parts were asked for"),
            (2.5, core.TooFewPointsError, "2.5 parts"),
            (True, core.TooFewPointsError, "True parts"),
            (1, core.ComponentError, "2 components"),
            (900, core.TooFewPointsError, "900 parts need"),
            (10**30, core.TooFewPointsError, "parts need"),
        ],
    )
    def test_impossible_numbers_of_parts(self, two_spheres, parts, error, match):
        with pytest.raises(error, match=match):
            core.spectral.segment(two_spheres, parts)

    def test_stages_are_reported(self, body):
        stages = []
        body.laplacian.release()
        core.spectral.segment(body.laplacian, 3, progress=lambda stage, fraction: stages.append(stage))
        assert set(stages) == {"Spectrum", "Parts"}
