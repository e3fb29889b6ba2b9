"""Modes matched between frames: signs, order, and the basis of equal eigenvalues."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere
from core import Spectrum

COUNT = 9  # constants, three linear and five quadratic harmonics of the sphere
RADIANS = 0.2


@pytest.fixture(scope="module")
def sphere():
    points = fibonacci_sphere(1500)
    laplacian = core.build_laplacian(points)
    return points, laplacian.areas, laplacian.eigenpairs(COUNT)


def turned(points, angle=RADIANS):
    cosine, sine = np.cos(angle), np.sin(angle)
    return points @ np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]).T


def box_modes(points, lengths):
    """Cosines on a rectangle: the exact modes of a flat plate, in ascending order."""
    first, second = np.divmod(np.arange(16), 4)
    values = np.pi**2 * ((first / lengths[0]) ** 2 + (second / lengths[1]) ** 2)
    waves = np.cos(np.pi * first * points[:, :1] / lengths[0]) * np.cos(np.pi * second * points[:, 1:2] / lengths[1])
    order = np.argsort(values, kind="stable")[:6]
    vectors = waves[:, order] / np.sqrt(np.mean(waves[:, order] ** 2, axis=0) * np.prod(lengths))
    return Spectrum(values[order], vectors), list(zip(first[order], second[order], strict=True))


def plate(lengths, n=40):
    steps = (np.arange(n) + 0.5) / n
    x, y = np.meshgrid(lengths[0] * steps, lengths[1] * steps, indexing="ij")
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(n * n)])


def test_signs_and_order_of_shuffled_points_come_back(sphere):
    points, areas, spectrum = sphere
    random = np.random.default_rng(0)
    order, signs = random.permutation(len(points)), random.choice([-1.0, 1.0], COUNT)
    shuffled = Spectrum(spectrum.eigenvalues, (spectrum.eigenvectors * signs)[order])
    matched = core.spectral.match_modes(shuffled, areas[order], points[order], spectrum, points, tolerance=0.0)
    assert_allclose(matched.spectrum.eigenvectors, spectrum.eigenvectors[order], atol=1e-12)
    assert_allclose(matched.spectrum.eigenvalues, spectrum.eigenvalues, rtol=1e-12, atol=1e-12)
    assert_allclose(matched.overlaps, 1.0, atol=1e-12)


def test_any_basis_of_equal_eigenvalues_is_turned_back(sphere):
    points, areas, spectrum = sphere
    basis = np.eye(COUNT)
    random = np.random.default_rng(1)
    for start, stop in ((1, 4), (4, 9)):
        basis[start:stop, start:stop] = np.linalg.qr(random.normal(size=(stop - start, stop - start)))[0]
    mixed = Spectrum(spectrum.eigenvalues, spectrum.eigenvectors @ basis)
    matched = core.spectral.match_modes(mixed, areas, points, spectrum, points, tolerance=0.05)
    assert_allclose(matched.spectrum.eigenvectors, spectrum.eigenvectors, atol=1e-10)


def test_harmonics_of_a_turned_and_resampled_sphere_stay_in_place(sphere):
    """The modes before are made the coordinates; a sphere of other points, turned on, must show them again."""
    points, areas, _ = sphere
    other = turned(random_sphere(1200))
    laplacian = core.build_laplacian(other)
    x, y, z = points.T
    harmonics = np.column_stack([np.ones(len(x)), x, y, z, x * y, y * z, z * x, x**2 - y**2, 3 * z**2 - 1])
    harmonics /= np.sqrt(np.sum(areas[:, None] * harmonics**2, axis=0))
    before = Spectrum(np.array([0.0, *[2.0] * 3, *[6.0] * 5]), harmonics)
    matched = core.spectral.match_modes(
        laplacian.eigenpairs(COUNT), laplacian.areas, other, before, points, tolerance=0.1
    )
    assert matched.overlaps.min() > 0.99
    x, y, z = other.T
    for mode, values in enumerate((x, y, z), start=1):
        assert np.corrcoef(matched.spectrum.eigenvectors[:, mode], values)[0, 1] > 0.995
    gram = matched.spectrum.eigenvectors.T @ (laplacian.areas[:, None] * matched.spectrum.eigenvectors)
    assert_allclose(gram, np.eye(COUNT), atol=1e-8)


def test_modes_that_cross_keep_their_places():
    """A plate that grows longer one way than the other: its first two waves change places on the way."""
    start = (1.0, 1.12)
    points, (spectrum, named) = plate(start), box_modes(plate(start), start)
    orders = set()
    for length in np.linspace(1.0, 1.24, 9)[1:]:
        lengths = (length, 1.12)
        now = plate(lengths)
        exact, names = box_modes(now, lengths)
        orders.add(tuple(names))
        areas = np.full(len(now), np.prod(lengths) / len(now))
        matched = core.spectral.match_modes(exact, areas, now, spectrum, points, tolerance=1e-3)
        assert matched.overlaps[:3].min() > 0.97
        points, spectrum = now, matched.spectrum
        expected = np.pi**2 * np.array([(m / lengths[0]) ** 2 + (k / lengths[1]) ** 2 for m, k in named[:3]])
        assert_allclose(spectrum.eigenvalues[:3], expected, rtol=2e-3, atol=1e-9)
    assert len({names[1] for names in orders}) == 2  # they did cross


def test_an_ellipsoid_whose_axes_change_places_keeps_its_modes():
    """Modes of the operator itself: the one along x stays it, while its eigenvalue passes that of the one along y."""
    sphere, before, ranks = fibonacci_sphere(750), None, []
    for length in (0.85, 0.95, 1.05, 1.15):
        points = sphere * [length, 1.0, 0.6]
        laplacian = core.build_laplacian(points)
        spectrum = laplacian.eigenpairs(4)
        ranks.append(abs(np.corrcoef(spectrum.eigenvectors[:, 1], points[:, 0])[0, 1]) > 0.9)
        if before is not None:
            matched = core.spectral.match_modes(spectrum, laplacian.areas, points, *before)
            assert matched.overlaps.min() > 0.95
            spectrum = matched.spectrum
        else:
            along = [int(np.argmax(np.abs(points.T @ spectrum.eigenvectors[:, mode]))) for mode in (1, 2, 3)]
        assert [int(np.argmax(np.abs(points.T @ spectrum.eigenvectors[:, mode]))) for mode in (1, 2, 3)] == along
        before = spectrum, points
    assert ranks[0] != ranks[-1]  # they did cross


def test_scale_and_turn_of_both_frames_change_nothing(sphere):
    points, areas, spectrum = sphere
    flipped = Spectrum(spectrum.eigenvalues, -spectrum.eigenvectors)
    moved = 7.0 * turned(points) + [3.0, -2.0, 5.0]
    far = Spectrum(spectrum.eigenvalues / 49.0, spectrum.eigenvectors / 7.0)
    far_flipped = Spectrum(far.eigenvalues, -far.eigenvectors)
    here = core.spectral.match_modes(flipped, areas, points, spectrum, points)
    there = core.spectral.match_modes(far_flipped, 49.0 * areas, moved, far, moved)
    assert_allclose(7.0 * there.spectrum.eigenvectors, here.spectrum.eigenvectors, atol=1e-12)
    assert_allclose(there.overlaps, here.overlaps)


def test_high_modes_are_not_all_taken_for_one():
    """Eigenvalues grow evenly: each is within the tolerance of the next, but not all of all."""
    values = np.arange(400.0)
    vectors = np.linalg.qr(np.random.default_rng(2).normal(size=(1200, 400)))[0]
    points = np.random.default_rng(3).uniform(size=(1200, 3))
    spectrum = Spectrum(values, vectors)
    matched = core.spectral.match_modes(Spectrum(values, -vectors), np.ones(1200), points, spectrum, points)
    assert_allclose(matched.spectrum.eigenvectors, vectors, atol=1e-9)
    assert_allclose(matched.spectrum.eigenvalues, values, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "error", "text"),
    [
        ({"areas": np.ones(3)}, core.InvalidPointsError, "each of 1500 points"),
        ({"points": np.full((1500, 3), np.nan)}, core.InvalidPointsError, "not finite"),
        ({"points_before": np.eye(3)}, core.InvalidPointsError, "earlier frame"),
        ({"spectrum_before": Spectrum(np.zeros(2), np.zeros((1500, 2)))}, core.PointCloudError, "Compute as many"),
        ({"tolerance": 1.0}, core.PointCloudError, "tolerance"),
    ],
)
def test_what_does_not_fit_is_told(sphere, change, error, text):
    points, areas, spectrum = sphere
    given = {"spectrum": spectrum, "areas": areas, "points": points} | {
        "spectrum_before": spectrum,
        "points_before": points,
    }
    with pytest.raises(error, match=text):
        core.spectral.match_modes(**given | change)
