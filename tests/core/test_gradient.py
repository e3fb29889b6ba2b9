"""The gradient and the divergence as sparse matrices: exact in the plane, adjoint, and right on the sphere."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere, square_random


def vectors(gradient, f):
    return (gradient @ f).reshape(-1, 3)


def harmonic(points):
    """x y z on the unit sphere, its gradient along it, and its eigenvalue."""
    x, y, z = points.T
    f = x * y * z
    return f, np.stack([y * z, x * z, x * y], axis=1) - 3.0 * f[:, None] * points, 12.0


@pytest.fixture(scope="module")
def two():
    """Operator of a sphere and, far off, a part of one with a boundary; one point is left out."""
    points = random_sphere(1500)
    open_ = random_sphere(1200, 3)
    return core.build_laplacian(np.vstack([points, open_[open_[:, 2] > -0.2] + [9.0, 0.0, 0.0], [[4.5, 0.0, 0.0]]]))


@pytest.mark.parametrize("turn", [[0.0, 0.0, 0.0], [0.4, -1.1, 0.7]])
@pytest.mark.parametrize("place", [0.0, 1e4])
def test_linear_functions_in_a_plane(turn, place):
    turned = Rotation.from_rotvec(turn)
    points = turned.apply(square_random(1500)) + place
    laplacian = core.build_laplacian(points)
    slope = turned.apply([2.0, -1.0, 0.0])  # in the plane
    found = vectors(core.gradient_matrix(laplacian), (points - points.mean(axis=0)) @ slope)
    assert laplacian.boundary.any()  # there, too
    np.testing.assert_allclose(found, np.broadcast_to(slope, found.shape), rtol=0.0, atol=1e-11 * (1.0 + place))
    across = vectors(core.gradient_matrix(laplacian), (points - points.mean(axis=0)) @ turned.apply([0.0, 0.0, 1.0]))
    assert np.abs(across).max() < 1e-10 * (1.0 + place)


def test_constants_and_normals(two):
    gradient = core.gradient_matrix(two)
    assert np.abs(gradient @ np.ones(len(two.areas))).max() < 1e-11 * np.abs(gradient).max()
    found = vectors(gradient, np.random.default_rng(0).normal(size=len(two.areas)))
    size = np.linalg.norm(found, axis=1)
    assert np.all(np.abs(np.einsum("ij,ij->i", found, two.normals)) <= 1e-12 * size.max())
    assert two.component[-1] == -1
    assert size[-1] == 0.0 < size[:-1].min()


def test_adjoint_to_round_off(two):
    rng = np.random.default_rng(1)
    f, v = rng.normal(size=len(two.areas)), rng.normal(size=(len(two.areas), 3))
    gradient, divergence = core.gradient_matrix(two), core.divergence_matrix(two)
    terms = two.areas[:, None] * vectors(gradient, f) * v
    assert abs(two.areas @ (f * (divergence @ v.ravel())) + terms.sum()) < 1e-12 * np.abs(terms).sum()
    flow = two.areas * (divergence @ v.ravel())
    for component in (0, 1):
        own = flow[two.component == component]
        assert abs(own.sum()) < 1e-11 * np.abs(own).sum()
    normal = divergence @ two.normals.ravel()
    assert np.abs(normal).max() < 1e-11 * np.abs(divergence).max()


@pytest.mark.parametrize(("count", "tolerance"), [(800, 0.04), (8000, 0.005)])
def test_on_the_sphere(count, tolerance):
    points = fibonacci_sphere(count)
    laplacian = core.build_laplacian(points)
    gradient, divergence = core.gradient_matrix(laplacian), core.divergence_matrix(laplacian)
    f, exact, eigenvalue = harmonic(points)
    found = vectors(gradient, f)
    assert np.linalg.norm(found - exact) < tolerance * np.linalg.norm(exact)
    for field in (exact, found):
        change = divergence @ field.ravel() + eigenvalue * f
        assert np.linalg.norm(change) < 2.0 * tolerance * eigenvalue * np.linalg.norm(f)
    # In the weak sense the divergence of the gradient is -K / areas.
    energy = laplacian.areas @ (found**2).sum(axis=1)
    assert energy == pytest.approx(f @ laplacian.stiffness @ f, rel=1.5 * tolerance)
    assert energy == pytest.approx(-laplacian.areas @ (f * (divergence @ (gradient @ f))), rel=1e-10)


def test_units():
    points = random_sphere(600)
    near, far = (core.gradient_matrix(core.build_laplacian(size * points)) for size in (1.0, 1000.0))
    f = points[:, 0]
    np.testing.assert_allclose(1000.0 * (far @ f), near @ f, atol=1e-9)


def test_points_at_one_place_have_one_gradient():
    points = fibonacci_sphere(400)
    laplacian = core.build_laplacian(np.concatenate([points, points[:7]]))
    found = vectors(core.gradient_matrix(laplacian), laplacian.points[:, 2])
    np.testing.assert_allclose(found[:7], found[400:], atol=1e-12)
