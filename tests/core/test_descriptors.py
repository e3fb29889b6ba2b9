import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere, sphere_eigenvalues


@pytest.fixture(scope="module")
def laplacian():
    return core.build_laplacian(fibonacci_sphere(2000))


@pytest.fixture(scope="module")
def spectrum(laplacian):
    return laplacian.eigenpairs(64)


@pytest.fixture(scope="module")
def ellipsoid():
    return core.build_laplacian(fibonacci_sphere(1500) * [1.0, 0.8, 0.6])


def test_heat_on_the_sphere(spectrum):
    times = np.array([0.05, 0.2, 1.0])
    exact = np.exp(-np.outer(times, sphere_eigenvalues(64))).sum(axis=1) / (4.0 * np.pi)
    found = core.spectral.heat_kernel_signature(spectrum, times)
    np.testing.assert_allclose(found, np.tile(exact, (2000, 1)), rtol=1e-2)


def test_wave_on_the_sphere_is_even(spectrum):
    found = core.spectral.wave_kernel_signature(spectrum, count=20)
    assert found.shape == (2000, 20)
    np.testing.assert_allclose(found, 1.0 / (4.0 * np.pi), rtol=2e-2)


def test_wave_by_its_definition(ellipsoid):
    spectrum = ellipsoid.eigenpairs(20)
    logarithms, squares = np.log(spectrum.eigenvalues[1:]), spectrum.eigenvectors[:, 1:] ** 2
    energies = np.linspace(logarithms[0], logarithms[-1], 7)
    window = 0.07 * np.ptp(logarithms)
    for energy, found in zip(energies, core.spectral.wave_kernel_signature(spectrum, energies).T, strict=True):
        weights = np.exp(-0.5 * ((energy - logarithms) / window) ** 2)
        np.testing.assert_allclose(found, squares @ weights / weights.sum(), rtol=1e-9, atol=1e-15)


def test_short_times_tell_curvature(ellipsoid):
    # The heat kernel on its diagonal is 1 / (4 pi t) (1 + t K / 3 + ...).
    spectrum = ellipsoid.eigenpairs(80)
    found = core.spectral.heat_kernel_signature(spectrum, [0.1])[:, 0] * (4.0 * np.pi * 0.1)
    expected = 1.0 + 0.1 * ellipsoid.gaussian_curvature / 3.0
    assert np.corrcoef(found, expected)[0, 1] > 0.95
    np.testing.assert_allclose(found, expected, rtol=4e-2)


def test_integrals_over_the_surface(laplacian, spectrum):
    heat = core.spectral.heat_kernel_signature(spectrum, count=10)
    decay = np.exp(-np.outer(core.spectral.signature_times(spectrum, 10), spectrum.eigenvalues)).sum(axis=1)
    np.testing.assert_allclose(laplacian.areas @ heat, decay, rtol=1e-9)
    normalized = core.spectral.heat_kernel_signature(spectrum, count=10, normalized=True)
    np.testing.assert_allclose(laplacian.areas @ normalized, 1.0, rtol=1e-9)
    np.testing.assert_allclose(laplacian.areas @ core.spectral.wave_kernel_signature(spectrum), 1.0, rtol=1e-9)


def test_energies_choose_the_modes_around_them(ellipsoid):
    spectrum = ellipsoid.eigenpairs(20)
    value = spectrum.eigenvalues[1]
    found = core.spectral.wave_kernel_signature(spectrum, [np.log(value) - 2.0])[:, 0]
    np.testing.assert_allclose(found, spectrum.eigenvectors[:, 1] ** 2, atol=1e-3)


def test_default_times_and_energies(spectrum):
    times = core.spectral.signature_times(spectrum, 7)
    assert len(times) == 7
    np.testing.assert_allclose(np.exp(-times[[0, -1]] * spectrum.eigenvalues[[-1, 1]]), 1e-4, rtol=1e-6)
    energies = core.spectral.signature_energies(spectrum)
    assert len(energies) == 100
    assert np.log(spectrum.eigenvalues[1]) < energies[0] < energies[-1] < np.log(spectrum.eigenvalues[-1])
    assert len(core.spectral.signature_times(spectrum, 1)) == len(core.spectral.signature_energies(spectrum, 1)) == 1


def test_parts_and_points_left_out():
    points = np.concatenate([random_sphere(900), 0.5 * random_sphere(700, 1) + [6.0, 0.0, 0.0], [[0.0, 80.0, 0.0]]])
    laplacian = core.build_laplacian(points)
    spectrum = laplacian.eigenpairs(50)
    times = core.spectral.signature_times(spectrum)
    assert times[-1] < 10.0  # the constants of the two parts do not count as the lowest modes
    for signature in (core.spectral.heat_kernel_signature(spectrum), core.spectral.wave_kernel_signature(spectrum)):
        assert np.isfinite(signature).all()
        assert np.all(signature[laplacian.component < 0] == 0.0)
        assert np.all(signature[laplacian.component >= 0] >= 0.0)
    late = core.spectral.heat_kernel_signature(spectrum, [50.0])[:, 0]
    for part in (0, 1):
        inside = laplacian.component == part
        np.testing.assert_allclose(late[inside], 1.0 / laplacian.areas[inside].sum(), rtol=1e-6)


@pytest.mark.parametrize("given", [[], [np.nan], [[1.0]], ["a"], 3.0])
def test_bad_times_and_energies(spectrum, given):
    with pytest.raises(core.PointCloudError, match="(Times|times) .*Give a row|no times"):
        core.spectral.heat_kernel_signature(spectrum, given)
    with pytest.raises(core.PointCloudError, match="(Energies|energies) .*Give a row|no energies"):
        core.spectral.wave_kernel_signature(spectrum, given)


def test_negative_times(spectrum):
    with pytest.raises(core.PointCloudError, match="1 of 2 times are negative"):
        core.spectral.heat_kernel_signature(spectrum, [1.0, -1.0])


@pytest.mark.parametrize("count", [0, 2.5, -1])
def test_bad_counts(spectrum, count):
    for signature in (core.spectral.heat_kernel_signature, core.spectral.wave_kernel_signature):
        with pytest.raises(core.PointCloudError, match="a whole number from 1"):
            signature(spectrum, count=count)


def test_spectra_that_tell_nothing(laplacian):
    constant = laplacian.eigenpairs(1)
    for signature in (core.spectral.heat_kernel_signature, core.spectral.wave_kernel_signature):
        with pytest.raises(core.PointCloudError, match="Compute more modes"):
            signature(constant)
    with pytest.raises(core.PointCloudError, match="same eigenvalue"):
        core.spectral.wave_kernel_signature(laplacian.eigenpairs(2))
