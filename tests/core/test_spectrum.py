import numpy as np
import pytest
from scipy import sparse

import core
from benchmarks.samplings import (
    disc_random,
    fibonacci_sphere,
    icosahedral_sphere,
    marching_cubes_sphere,
    random_sphere,
    sphere_eigenvalues,
)
from core.algebra import lift_lowest


@pytest.fixture(scope="module")
def laplacian():
    return core.build_laplacian(fibonacci_sphere(1000) * [1.0, 0.9, 0.75])


@pytest.fixture(scope="module")
def spectrum(laplacian):
    return laplacian.eigenpairs(20)


def test_known_eigenvalues():
    np.testing.assert_array_equal(sphere_eigenvalues(10), [0, 2, 2, 2, 6, 6, 6, 6, 6, 12])


@pytest.mark.parametrize(
    ("name", "factor", "bound"),
    [
        ("even sphere", 1.0, 6e-3),
        ("random sphere", 1.0, 9e-3),
        ("marching cubes", 1.0, 1.5e-2),
        # Whoever wants a sphere's digits takes a wide kernel.
        ("even sphere", 1.7, 4e-4),
        ("random sphere", 1.7, 1e-2),
        ("marching cubes", 1.7, 1e-3),
    ],
)
def test_first_99_eigenvalues_of_the_sphere(eigenvalues, name, factor, bound):
    values = eigenvalues(name, 100, factor)
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
    exact = all_eigenvalues(laplacian)[:20]
    np.testing.assert_allclose(laplacian.eigenpairs(20, raw=True).eigenvalues, exact, rtol=1e-8, atol=1e-9)


def test_ascending_from_the_constant(spectrum):
    assert np.all(np.diff(spectrum.eigenvalues) >= 0.0)
    assert spectrum.eigenvectors[:, 0].std() < 1e-9 * np.abs(spectrum.eigenvectors[:, 0]).mean()


def two_spheres():
    return np.concatenate([random_sphere(1500), 0.5 * random_sphere(700, 1) + [3.0, 0.0, 0.0]])


def cube():
    rng = np.random.default_rng(0)
    points, face = rng.random((1500, 3)), rng.integers(0, 6, 1500)
    points[np.arange(1500), face % 3] = face // 3
    return points


def bar():
    return cube() * [1.0, 0.15, 0.15]


@pytest.mark.parametrize(
    ("points", "components"), [(random_sphere(1000), 1), (two_spheres(), 2), (cube(), 1), (bar(), 1)]
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
    sizes = np.abs(spectrum.eigenvectors)
    largest = spectrum.eigenvectors.max(axis=0)
    assert np.all(largest >= (1.0 - 1e-4) * sizes.max(axis=0))  # one of the largest is positive


def test_correction_raises_the_eigenvalues_of_the_same_vectors(laplacian, spectrum):
    raw = laplacian.eigenpairs(20, raw=True)
    np.testing.assert_array_equal(raw.eigenvectors, spectrum.eigenvectors)
    assert np.all(raw.eigenvalues[1:] < spectrum.eigenvalues[1:])


def test_a_kernel_that_is_far_too_wide_still_has_its_spectrum():
    # Weyl's estimate is far below these eigenvalues, so the solver's first cut is too low.
    laplacian = core.paper.build_laplacian(fibonacci_sphere(500))
    assert any("too wide" in notice for notice in laplacian.notices)
    exact = all_eigenvalues(laplacian)[:4]
    np.testing.assert_allclose(laplacian.eigenpairs(4).eigenvalues, exact, rtol=1e-8, atol=1e-9)


def test_the_paper_setting_is_raw():
    laplacian = core.paper.build_laplacian(fibonacci_sphere(1000), neighbors=30)
    assert laplacian.notices == []
    np.testing.assert_array_equal(laplacian.eigenpairs(4).eigenvalues, laplacian.eigenpairs(4, raw=True).eigenvalues)


def test_order_of_the_points_does_not_matter(laplacian, spectrum):
    order = np.random.default_rng(0).permutation(1000)
    moved = core.build_laplacian(laplacian.points[order]).eigenpairs(20)
    np.testing.assert_allclose(moved.eigenvalues[1:], spectrum.eigenvalues[1:], rtol=1e-6)
    # A single mode of an ellipsoid with three different axes, up to sign.
    overlap = moved.eigenvectors[:, 1] @ (laplacian.areas * spectrum.eigenvectors[:, 1])[order]
    assert abs(overlap) == pytest.approx(1.0, abs=1e-6)


def test_unresolved_modes_are_refused_with_the_number_that_is_resolved():
    wide = core.LaplacianOptions(bandwidth_factor=1.7)
    laplacian = core.build_laplacian(fibonacci_sphere(400) * [1.0, 0.9, 0.75], options=wide)
    with pytest.raises(core.UnresolvedModesError, match="on 400 points") as caught:
        laplacian.eigenpairs(130)
    resolved = caught.value.resolved
    assert 15 < resolved < 130
    assert f"at most {resolved}" in str(caught.value)
    assert len(laplacian.eigenpairs(resolved).eigenvalues) == resolved
    assert len(laplacian.eigenpairs(130, raw=True).eigenvalues) == 130


@pytest.mark.parametrize("count", [0, -3, 2.5, 999])
def test_impossible_counts(laplacian, count):
    with pytest.raises(core.TooFewPointsError, match="modes were asked for"):
        laplacian.eigenpairs(count)


def test_progress_is_reported(laplacian):
    calls = []
    laplacian.release()
    laplacian.eigenpairs(5, progress=lambda stage, fraction: calls.append((stage, fraction)))
    assert {stage for stage, _ in calls} == {"Spectrum"}
    assert all(0.0 <= fraction < 1.0 for _, fraction in calls[:-1])
    assert calls[-1] == ("Spectrum", 1.0)


def test_a_small_dense_part_beside_a_large_one():
    # The largest eigenvalue is a thousand times that of an even cloud: a polynomial of low degree tells nothing apart.
    sphere = fibonacci_sphere(600)
    laplacian = core.build_laplacian(np.concatenate([sphere, 0.03 * sphere + [3.0, 0.0, 0.0]]))
    eigenvalues = laplacian.eigenpairs(21).eigenvalues
    exact = np.append(0.0, sphere_eigenvalues(20))  # those of the small one lie far above
    np.testing.assert_allclose(eigenvalues[:17], exact[:17], rtol=2e-2, atol=1e-8)


def all_eigenvalues(laplacian, dirichlet=False):
    root = 1.0 / np.sqrt(laplacian.areas)
    stiffness = laplacian.dirichlet[0] if dirichlet else laplacian.stiffness
    return np.linalg.eigvalsh(root[:, None] * stiffness.toarray() * root)


def islands(count):
    """Eight spheres at the corners of a cube."""
    corners = 3.0 * np.stack(np.meshgrid([0, 1], [0, 1], [0, 1]), axis=-1).reshape(-1, 1, 3)
    return (fibonacci_sphere(count) + corners).reshape(-1, 3)


def torus_grid():
    """A torus with 54 by 20 points in rows, all of whose eigenvalues but a few come twice or more often."""
    u, v = np.meshgrid(2.0 * np.pi * np.arange(54) / 54, 2.0 * np.pi * np.arange(20) / 20)
    ring = 1.0 + 0.4 * np.cos(v)
    return np.stack([ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)], axis=-1).reshape(-1, 3)


CLOUDS = {
    "islands": lambda: islands(130),
    "twins": lambda: np.concatenate([fibonacci_sphere(520), fibonacci_sphere(520) + [3.0, 0.0, 0.0]]),
    "torus grid": torus_grid,
    "cubic": lambda: marching_cubes_sphere(18),
    "icosahedral": lambda: icosahedral_sphere(11),
    "random": lambda: random_sphere(1040),
    "disc": lambda: disc_random(1040)[0],
}


@pytest.fixture(scope="module", params=CLOUDS)
def cloud(request):
    """Operator, whether to hold its boundary, and all of its eigenvalues."""
    laplacian, dirichlet = core.build_laplacian(CLOUDS[request.param]()), request.param == "disc"
    return laplacian, dirichlet, all_eigenvalues(laplacian, dirichlet)


@pytest.mark.parametrize(
    ("count", "coarse"),
    [(1, True), (3, False), (8, True), (10, False), (33, True), (40, False), (72, False), (120, True)],
)
def test_no_copy_is_lost(cloud, count, coarse, monkeypatch):
    monkeypatch.setattr("core.operator.spectrum._FEW", float(coarse))
    laplacian, dirichlet, exact = cloud
    assert len(exact) > 1000  # so that there are coarse versions
    spectrum = laplacian.eigenpairs(count, raw=True, dirichlet=dirichlet)
    np.testing.assert_allclose(spectrum.eigenvalues, exact[:count], rtol=1e-8, atol=1e-9)
    assert spectrum.residuals.shape == (count,)
    assert spectrum.residuals.max() < 2e-7


def test_no_copy_is_lost_from_any_start():
    near = 6.0 * (1.0 + 1e-5 * np.arange(5))  # with a copy of each, and only the first and its copy are asked for
    exact = np.concatenate([[0.0, 0.0], np.repeat([2.0, 2.0001, 2.0002], 2), np.repeat(near, 2)])
    above = np.concatenate([np.repeat(12.0 + 1e-3 * np.arange(14), 2), np.linspace(20.0, 180.0, 354)])
    for seed in range(100):
        values = np.random.default_rng(seed).permutation(np.concatenate([exact, above]))
        matrix = sparse.csr_array(sparse.diags_array(values))
        found, _ = lift_lowest(matrix, 10, 12.0, lambda fraction: None)
        np.testing.assert_allclose(found, exact[:10], rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-10])
def test_residuals_fall_to_the_tolerance(laplacian, tolerance):
    spectrum = laplacian.eigenpairs(20, raw=True, tolerance=tolerance)
    vectors, values = spectrum.eigenvectors, spectrum.eigenvalues
    misfit = laplacian.apply(vectors, raw=True) + values * vectors
    lengths = np.sqrt(laplacian.areas @ misfit**2) / max(values[-1], 80.0 * np.pi / laplacian.areas.sum())
    assert lengths.max() <= 1.01 * tolerance
    np.testing.assert_allclose(spectrum.residuals, lengths, rtol=1e-2, atol=1e-12)
    assert np.shares_memory(laplacian.corrected(spectrum).residuals, spectrum.residuals)


def test_the_solver_says_where_it_ends(laplacian):
    with pytest.raises(core.SolverError, match="of 20 modes on 1000 points"):
        laplacian.eigenpairs(20, tolerance=1e-17)


@pytest.mark.parametrize("count", [20, 40])  # on coarse versions first, and without
def test_the_number_of_cores_does_not_matter(laplacian, count, monkeypatch):
    found = []
    for cores in ("1", "3"):
        monkeypatch.setenv("MESHFREE_CORES", cores)
        laplacian.release()
        found.append(laplacian.eigenpairs(count).eigenvectors)
    np.testing.assert_array_equal(found[0], found[1])


def test_it_can_be_cancelled_at_any_report(laplacian):
    calls = []
    laplacian.release()
    laplacian.eigenpairs(5, progress=lambda stage, fraction: calls.append(fraction))
    assert calls == sorted(calls)
    assert len(calls) > 20

    for last in (0, 10, len(calls) // 2, len(calls) - 1):
        left = iter(range(last))

        def stop(stage, fraction, left=left):
            if next(left, None) is None:
                raise core.Cancelled

        laplacian.release()
        with pytest.raises(core.Cancelled):
            laplacian.eigenpairs(5, progress=stop)
