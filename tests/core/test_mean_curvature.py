"""Mean and principal curvatures of noisy points, against those of shapes that are known."""

import functools

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere, torus_points
from core.geometry.nearest import find_nearest
from core.geometry.quadrics import fit_quadrics


def off(found, exact):
    return np.sqrt(np.mean((found - exact) ** 2))


def noisy(points, normals, level, area, seed=1):
    """Points moved along their normals by noise, a share of the spacing."""
    noise = np.random.default_rng(seed).normal(0.0, level * np.sqrt(area / len(points)), len(points))
    return points + noise[:, None] * normals


def noisy_sphere(points, level, seed=1):
    return noisy(points, points, level, 4.0 * np.pi, seed)


def torus_curvature(points):
    """Mean curvature, half the difference of principal ones, and normals."""
    radius = np.linalg.norm(points[:, :2], axis=1)
    around = (1.0 - 1.0 / radius) / 0.4
    normals = np.column_stack([points[:, :2] * ((radius - 1.0) / radius)[:, None], points[:, 2]]) / 0.4
    return 0.5 * (2.5 + around), 0.5 * (2.5 - around), normals


def bumpy_sphere(count, seed=0):
    """Random points of ``|x| = 1 + 0.07 sin 8x sin 8y sin 8z`` of the direction, their normals and mean curvature."""
    rng = np.random.default_rng(seed)

    def height(places):
        length = np.linalg.norm(places, axis=1)
        return length - 1.0 - 0.07 * np.sin(8.0 * places / length[:, None]).prod(axis=1)

    def normals_of(places):
        steps = 1e-5 * np.eye(3)
        gradient = np.stack([height(places + step) - height(places - step) for step in steps], axis=1)
        return gradient / np.linalg.norm(gradient, axis=1)[:, None]

    unit = random_sphere(4 * count, seed)
    places = unit * (1.0 - height(unit))[:, None]
    area = np.linalg.norm(places, axis=1) ** 2 / np.einsum("ij,ij->i", normals_of(places), unit)
    points = places[rng.random(len(area)) < area / area.max()][:count]
    assert len(points) == count
    steps = 1e-3 * np.eye(3)
    ahead, behind = ([normals_of(points + side * step) for step in steps] for side in (1.0, -1.0))
    divergence = sum((ahead[axis][:, axis] - behind[axis][:, axis]) / 2e-3 for axis in range(3))
    return points, normals_of(points), 0.5 * divergence, 4.0 * np.pi * area.mean()


@functools.cache
def operator_of_noise(level):
    """The operator on noisy random points of the sphere."""
    return core.build_laplacian(noisy_sphere(random_sphere(4000), level))


class TestOnSpheres:
    @pytest.mark.parametrize(("level", "most"), [(0.0, 0.008), (0.01, 0.02), (0.02, 0.03), (0.1, 0.05), (0.2, 0.1)])
    def test_random_points(self, level, most):
        assert off(core.measure.mean_curvature(operator_of_noise(level)), 1.0) < most

    @pytest.mark.parametrize(("level", "most"), [(0.0, 3e-4), (0.01, 0.02), (0.02, 0.04), (0.1, 0.06), (0.2, 0.12)])
    def test_even_points(self, level, most):
        found = core.measure.mean_curvature(core.build_laplacian(noisy_sphere(fibonacci_sphere(4000), level)))
        assert off(found, 1.0) < most

    def test_scatter_is_what_noise_leaves(self):
        for level in (0.02, 0.1, 0.2):
            found = core.measure.measure_mean_curvature(operator_of_noise(level))
            assert 0.5 < off(found.values, 1.0) / np.sqrt(np.mean(found.scatter**2)) < 2.0

    def test_half_the_difference_does_not_add_up_from_noise(self):
        found = core.measure.principal_curvatures(operator_of_noise(0.1))
        assert 0.5 * np.mean(found.first - found.second) < 0.04
        assert off(found.curvedness, 1.0) < 0.05
        assert found.shape_index.min() > 0.9


@pytest.mark.parametrize(
    ("level", "count", "mean", "half"),
    [
        (0.0, 20_000, 0.011, 0.02),  # fewer miss the bound
        (0.02, 10_000, 0.03, 0.04),
        (0.1, 10_000, 0.06, 0.09),
    ],
)
def test_torus(level, count, mean, half):
    points = torus_points(count)
    exact, difference, normals = torus_curvature(points)
    laplacian = core.build_laplacian(noisy(points, normals, level, 1.6 * np.pi**2))
    found = core.measure.principal_curvatures(laplacian)
    np.testing.assert_allclose(0.5 * (found.first + found.second), core.measure.mean_curvature(laplacian), atol=1e-9)
    assert off(core.measure.mean_curvature(laplacian), exact) < mean
    assert off(0.5 * (found.first - found.second), difference) < half
    assert found.notices == []


@pytest.mark.parametrize(("level", "most"), [(0.0, 0.1), (0.02, 0.22), (0.1, 0.36), (0.2, 0.53)])
def test_bumps_are_not_averaged_away(level, most):
    points, normals, exact, area = bumpy_sphere(12_000)  # in fewer the bumps are lost
    laplacian = core.build_laplacian(noisy(points, normals, level, area))
    on = laplacian.component >= 0
    assert off(core.measure.mean_curvature(laplacian)[on], exact[on]) < most


def test_edges_keep_their_curvature():
    # The faces of a cube of 45 points a side, and its edges; noise of a twentieth of the spacing.
    side = np.arange(45) / 44.0 - 0.5
    u, v = (each.ravel() for each in np.meshgrid(side, side))
    faces = [
        np.roll(np.column_stack([u, v, np.full(len(u), end)]), axis, axis=1) for axis in range(3) for end in (-0.5, 0.5)
    ]
    points = np.unique(np.round(np.concatenate(faces), 9), axis=0)
    points = points + np.random.default_rng(0).normal(0.0, 0.05 / 44.0, points.shape)
    laplacian = core.build_laplacian(points)
    found = np.abs(core.measure.mean_curvature(laplacian))
    depth = np.sort(0.5 - np.abs(points), axis=1)[:, 1] * 44.0  # spacings from the nearest edge
    corners = np.sort(0.5 - np.abs(points), axis=1)[:, 2] * 44.0 < 8.0
    edges, inner = found[(depth < 0.5) & ~corners], found[depth > 12.0]
    quadric = np.abs(laplacian.quadric_mean_curvature)
    assert np.median(edges) > 0.7 * np.median(quadric[(depth < 0.5) & ~corners])
    assert np.median(inner) < 0.2 * np.median(quadric[depth > 12.0])
    assert np.median(edges) > 20.0 * np.median(inner)


class TestPrincipalCurvaturesOfNoisySheets:
    """Those of ``z = (k1 x^2 + k2 y^2) / 2`` with noise of an eighth of the spacing, away from the boundary."""

    @staticmethod
    @functools.cache
    def off(first, second, factor):
        rng = np.random.default_rng(9)
        x, y = rng.uniform(-1.0, 1.0, (2, 4096))
        z = 0.5 * (first * x**2 + second * y**2) + rng.normal(0.0, 0.0039, len(x))
        tilt = 1.0 + (first * x) ** 2 + (second * y) ** 2
        mean = ((1.0 + (second * y) ** 2) * first + (1.0 + (first * x) ** 2) * second) / (2.0 * tilt**1.5)
        half = np.sqrt(np.maximum(mean**2 - first * second / tilt**2, 0.0))
        options = core.LaplacianOptions(bandwidth_factor=factor)
        found = core.measure.principal_curvatures(core.build_laplacian(np.column_stack([x, y, z]), options=options))
        inner = np.maximum(np.abs(x), np.abs(y)) < 0.85
        return off(0.5 * (found.first - found.second)[inner], half[inner]), found, inner

    @pytest.mark.parametrize(("first", "second", "most"), [(1.0, 0.0, 0.05), (3.0, -2.0, 0.065)])
    def test_difference(self, first, second, most):
        error, found, _ = self.off(first, second, 1.0)
        assert error < most
        assert found.notices == []

    def test_a_wider_kernel_averages_over_more_points(self):
        errors = [self.off(1.0, 0.0, factor)[0] for factor in (1.0, 1.7)]
        assert errors[1] < 0.8 * errors[0]

    def test_direction(self):
        _, found, inner = self.off(-1.0, 0.0, 1.0)
        assert np.mean(np.abs(found.direction[inner, 1]) < np.sin(np.radians(15.0))) > 0.95


class TestNotices:
    @staticmethod
    def plate(noise):
        rng = np.random.default_rng(4)
        flat = rng.random((3000, 2))
        return np.column_stack([flat, rng.normal(0.0, noise * np.sqrt(1.0 / 3000), 3000)])

    def test_noise_decides_on_a_plate(self):
        laplacian = core.build_laplacian(self.plate(0.1))
        for found in (core.measure.measure_mean_curvature(laplacian), core.measure.principal_curvatures(laplacian)):
            [notice] = found.notices
            assert notice.startswith("Noise decides the ")
            assert "bandwidth_factor" in notice

    def test_nothing_does_on_an_exact_one(self):
        laplacian = core.build_laplacian(self.plate(0.0))
        assert core.measure.measure_mean_curvature(laplacian).notices == []
        assert core.measure.principal_curvatures(laplacian).notices == []

    @pytest.mark.parametrize("level", [0.0, 0.1, 0.2])
    def test_nor_on_a_sphere(self, level):
        laplacian = core.build_laplacian(noisy_sphere(random_sphere(3000), level))
        assert core.measure.measure_mean_curvature(laplacian).notices == []
        assert core.measure.principal_curvatures(laplacian).notices == []


@functools.cache
def noisy_torus():
    """The operator on noisy points of a torus, and its principal curvatures."""
    points = torus_points(4000)
    laplacian = core.build_laplacian(noisy(points, torus_curvature(points)[2], 0.1, 1.6 * np.pi**2))
    return laplacian, core.measure.principal_curvatures(laplacian)


class TestInvariance:
    def test_turned_scaled_moved_and_reordered(self):
        laplacian, known = noisy_torus()
        points = laplacian.points
        order = np.random.default_rng(0).permutation(len(points))
        turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        found = core.measure.principal_curvatures(core.build_laplacian(1e3 * (points @ turn.T)[order] + 5e3))
        for name in ("first", "second", "scatter"):
            np.testing.assert_allclose(1e3 * getattr(found, name), getattr(known, name)[order], atol=1e-6)

    def test_sign_of_normals(self):
        laplacian, known = noisy_torus()
        found = core.measure.principal_curvatures(laplacian.toward(-laplacian.normals))
        np.testing.assert_allclose(found.first, -known.second, atol=1e-9)
        np.testing.assert_allclose(found.second, -known.first, atol=1e-9)

    def test_normals_of_mixed_signs(self):
        laplacian, known = noisy_torus()
        side = np.where(np.arange(len(laplacian.points)) % 3 == 0, -1.0, 1.0)[:, None]
        found = core.measure.mean_curvature(laplacian.toward(side * laplacian.normals))
        np.testing.assert_allclose(side[:, 0] * found, 0.5 * (known.first + known.second), atol=1e-9)


@pytest.mark.parametrize("sample", [fibonacci_sphere, random_sphere])
def test_scatter_of_quadrics_is_that_of_their_mean_curvature(sample):
    points = sample(4000)
    nearest = find_nearest(points)
    known = nearest.quadrics
    sum_, count, noise = np.zeros(len(points)), 12, 1e-4
    for seed in range(count):
        moved = points * (1.0 + noise * np.random.default_rng(seed).normal(size=(len(points), 1)))
        fitted = fit_quadrics(moved, nearest.index, nearest.weight)
        change = np.trace(fitted.shape_operator, axis1=1, axis2=2) * np.sign(
            np.einsum("ij,ij->i", fitted.normals, known.normals)
        ) - np.trace(known.shape_operator, axis1=1, axis2=2)
        sum_ += (0.5 * change) ** 2
    ratio = np.sqrt(sum_ / count) / (noise * known.scatter)
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1.0, abs=0.08)
