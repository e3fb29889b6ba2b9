import numpy as np
import pytest

import core
from benchmarks.samplings import (
    fibonacci_sphere,
    icosahedral_sphere,
    marching_cubes_sphere,
    random_sphere,
    sphere_eigenvalues,
)


@pytest.fixture(scope="module")
def laplacian():
    return core.build_laplacian(fibonacci_sphere(2000) * [1.0, 0.9, 0.75])


@pytest.fixture(scope="module")
def spectrum(laplacian):
    return laplacian.eigenpairs(20)


def test_known_eigenvalues():
    np.testing.assert_array_equal(sphere_eigenvalues(10), [0, 2, 2, 2, 6, 6, 6, 6, 6, 12])


@pytest.mark.parametrize(("name", "bound"), [("even sphere", 2e-3), ("random sphere", 5e-3), ("marching cubes", 5e-3)])
def test_first_99_eigenvalues_of_the_sphere(eigenvalues, name, bound):
    values = eigenvalues(name, 100)
    assert values[0] < 1e-9
    np.testing.assert_allclose(values[1:], sphere_eigenvalues(100)[1:], rtol=bound)


def test_eigenvalues_survive_a_density_jump(eigenvalues):
    values = eigenvalues("density jump", 16)
    np.testing.assert_allclose(values[1:], sphere_eigenvalues(16)[1:], rtol=2e-2)


def test_orthonormal_for_the_areas(laplacian, spectrum):
    gram = spectrum.eigenvectors.T @ (laplacian.areas[:, None] * spectrum.eigenvectors)
    np.testing.assert_allclose(gram, np.eye(20), atol=1e-9)


def test_pairs_satisfy_the_equation(laplacian):
    spectrum = laplacian.eigenpairs(20, raw=True)
    vectors = spectrum.eigenvectors
    residual = laplacian.apply(vectors, raw=True) + spectrum.eigenvalues * vectors
    assert np.abs(residual).max() < 1e-5 * spectrum.eigenvalues[-1] * np.abs(vectors).max()


def test_the_lowest_are_found(laplacian):
    root = 1.0 / np.sqrt(laplacian.areas)
    dense = np.linalg.eigvalsh(root[:, None] * laplacian.stiffness.toarray() * root)
    np.testing.assert_allclose(laplacian.eigenpairs(20, raw=True).eigenvalues, dense[:20], rtol=1e-8, atol=1e-9)


def test_ascending_from_the_constant(spectrum):
    assert np.all(np.diff(spectrum.eigenvalues) >= 0.0)
    assert spectrum.eigenvectors[:, 0].std() < 1e-9 * np.abs(spectrum.eigenvectors[:, 0]).mean()


def two_spheres():
    return np.concatenate([random_sphere(1500), 0.5 * random_sphere(700, 1) + [3.0, 0.0, 0.0]])


def cube():
    rng = np.random.default_rng(0)
    points, face = rng.random((2500, 3)), rng.integers(0, 6, 2500)
    points[np.arange(2500), face % 3] = face // 3
    return points


def bar():
    return cube() * [1.0, 0.15, 0.15]


@pytest.mark.parametrize(
    ("points", "components"), [(random_sphere(2000), 1), (two_spheres(), 2), (cube(), 1), (bar(), 1)]
)
def test_no_mode_but_the_constant_of_each_component_is_zero_and_none_lives_on_few_points(points, components):
    laplacian = core.build_laplacian(points)
    spectrum = laplacian.eigenpairs(20, raw=True)
    assert laplacian.component.max() + 1 == components
    assert np.count_nonzero(spectrum.eigenvalues < 1e-6 * spectrum.eigenvalues[-1]) == components
    participation = 1.0 / (laplacian.areas @ spectrum.eigenvectors**4) / laplacian.areas.sum()
    assert participation.min() > 0.01


def test_signs_are_deterministic(laplacian, spectrum):
    again = laplacian.eigenpairs(20)
    np.testing.assert_array_equal(again.eigenvectors, spectrum.eigenvectors)
    largest = np.argmax(np.abs(spectrum.eigenvectors), axis=0)
    assert np.all(spectrum.eigenvectors[largest, np.arange(20)] > 0.0)


def test_correction_raises_the_eigenvalues_of_the_same_vectors(laplacian, spectrum):
    raw = laplacian.eigenpairs(20, raw=True)
    np.testing.assert_array_equal(raw.eigenvectors, spectrum.eigenvectors)
    assert np.all(raw.eigenvalues[1:] < spectrum.eigenvalues[1:])


@pytest.fixture(scope="module", params=["icosahedral", "cubic"])
def symmetric_sphere(request):
    """Operator of a sphere with the symmetry of its points, and all of its eigenvalues."""
    laplacian = core.build_laplacian(
        icosahedral_sphere(8) if request.param == "icosahedral" else marching_cubes_sphere(16)
    )
    root = 1.0 / np.sqrt(laplacian.areas)
    return laplacian, np.linalg.eigvalsh(root[:, None] * laplacian.stiffness.toarray() * root)


@pytest.mark.parametrize("count", [5, 12, 33, 60])
def test_no_copy_of_a_multiple_eigenvalue_is_missed(symmetric_sphere, count):
    laplacian, dense = symmetric_sphere
    np.testing.assert_allclose(laplacian.eigenpairs(count, raw=True).eigenvalues, dense[:count], rtol=1e-8, atol=1e-9)


def test_a_kernel_that_is_far_too_wide_still_has_its_spectrum():
    # Weyl's estimate is far below these eigenvalues, so the solver's first cut is too low.
    laplacian = core.build_laplacian(fibonacci_sphere(500), options=core.LaplacianOptions.paper())
    assert any("too wide" in notice for notice in laplacian.notices)
    root = 1.0 / np.sqrt(laplacian.areas)
    dense = np.linalg.eigvalsh(root[:, None] * laplacian.stiffness.toarray() * root)
    np.testing.assert_allclose(laplacian.eigenpairs(4).eigenvalues, dense[:4], rtol=1e-8, atol=1e-9)


def test_the_paper_setting_is_raw():
    laplacian = core.build_laplacian(fibonacci_sphere(3000), options=core.LaplacianOptions.paper())
    assert laplacian.notices == []
    np.testing.assert_array_equal(laplacian.eigenpairs(4).eigenvalues, laplacian.eigenpairs(4, raw=True).eigenvalues)


def test_order_of_the_points_does_not_matter(laplacian, spectrum):
    order = np.random.default_rng(0).permutation(2000)
    moved = core.build_laplacian(laplacian.points[order]).eigenpairs(20)
    np.testing.assert_allclose(moved.eigenvalues[1:], spectrum.eigenvalues[1:], rtol=1e-6)
    # A single mode of an ellipsoid with three different axes, up to sign.
    overlap = moved.eigenvectors[:, 1] @ (laplacian.areas * spectrum.eigenvectors[:, 1])[order]
    assert abs(overlap) == pytest.approx(1.0, abs=1e-6)


def test_unresolved_modes_are_refused_with_the_number_that_is_resolved(laplacian):
    with pytest.raises(core.UnresolvedModesError, match="on 2000 points") as caught:
        laplacian.eigenpairs(600)
    resolved = caught.value.resolved
    assert 50 < resolved < 600
    assert f"at most {resolved}" in str(caught.value)
    assert len(laplacian.eigenpairs(resolved).eigenvalues) == resolved
    assert len(laplacian.eigenpairs(600, raw=True).eigenvalues) == 600


@pytest.mark.parametrize("count", [0, -3, 2.5, 1999])
def test_impossible_counts(laplacian, count):
    with pytest.raises(core.TooFewPointsError, match="modes were asked for"):
        laplacian.eigenpairs(count)


def test_progress_is_reported(laplacian):
    calls = []
    laplacian.eigenpairs(5, progress=lambda stage, fraction: calls.append((stage, fraction)))
    assert {stage for stage, _ in calls} == {"Spectrum"}
    assert all(0.0 <= fraction < 1.0 for _, fraction in calls)


def test_a_small_dense_part_beside_a_large_one():
    # The largest eigenvalue is a thousand times that of an even cloud: a polynomial of low degree tells nothing apart.
    sphere = fibonacci_sphere(1200)
    laplacian = core.build_laplacian(np.concatenate([sphere, 0.03 * sphere + [3.0, 0.0, 0.0]]))
    eigenvalues = laplacian.eigenpairs(21).eigenvalues
    exact = np.append(0.0, sphere_eigenvalues(20))  # those of the small one lie far above
    np.testing.assert_allclose(eigenvalues[:17], exact[:17], rtol=2e-2, atol=1e-8)
