"""The default operator is the same in any unit, place, direction and order of the points.

So are the sides of normals, but for those of a sheet that neither bulges nor overhangs: its outer side is above.
"""

from types import SimpleNamespace

import numpy as np
import pytest

import core
from benchmarks.samplings import (
    hemisphere_random,
    noisy_sphere,
    random_sphere,
    sausage,
    square_grid,
    square_random,
    torus_points,
    uneven_sphere,
)

CLOUDS = {
    "hemisphere": lambda: hemisphere_random(600),
    "square": lambda: square_random(600),
    "components": lambda: np.concatenate([random_sphere(500), 0.6 * random_sphere(300, 1) + [4, 0, 0], [[0, 9.0, 0]]]),
    "noisy sphere": lambda: noisy_sphere(600, 0.3),
    "density jump": lambda: uneven_sphere(700),
}
TURN = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
CHANGES = {
    "turned and moved": (1.0, TURN, np.array([3.0, -2.0, 5.0]), False),
    "in another order and unit": (7e3, np.eye(3), np.zeros(3), True),
}


@pytest.fixture(scope="module", params=CLOUDS)
def cloud(request):
    points = CLOUDS[request.param]()
    laplacian = core.build_laplacian(points)
    function = np.sin(3.0 * points[:, 0]) * points[:, 2] + points[:, 1] ** 2
    return SimpleNamespace(
        name=request.param,
        laplacian=laplacian,
        function=function,
        applied=laplacian.apply(function),
        eigenvalues=laplacian.eigenpairs(10).eigenvalues,
    )


@pytest.mark.parametrize("change", CHANGES)
def test_the_operator_moves_with_the_points(cloud, change):
    scale, turn, shift, shuffled = CHANGES[change]
    before = cloud.laplacian
    order = np.arange(len(before.points))
    if shuffled:
        np.random.default_rng(1).shuffle(order)
    after = core.build_laplacian((scale * before.points @ turn + shift)[order])

    np.testing.assert_array_equal(after.component, before.component[order])
    np.testing.assert_array_equal(after.boundary, before.boundary[order])
    assert len(after.notices) == len(before.notices)
    kept = after.component >= 0
    known = order[kept]
    np.testing.assert_allclose(after.smoothing_lengths, scale * before.smoothing_lengths[order], rtol=1e-8)
    np.testing.assert_allclose(after.areas[kept], scale**2 * before.areas[known], rtol=1e-7)
    cosine = np.einsum("ij,ij->i", after.normals[kept], before.normals[known] @ turn)
    if cloud.name == "square":
        np.testing.assert_allclose(np.abs(cosine), 1.0, rtol=1e-9)
        assert (before.normals[:, 2] > 0.0).all()
        assert (after.normals[:, 2] > 0.0).all()
    else:
        np.testing.assert_allclose(cosine, 1.0, rtol=1e-9)
    size = np.abs(before.gaussian_curvature).max() + 1.0
    np.testing.assert_allclose(scale**2 * after.gaussian_curvature, before.gaussian_curvature[order], atol=1e-9 * size)
    size = np.abs(cloud.applied).max()
    exact = 1e-6 if turn is TURN else 1e-7  # weights are worked out along axes in the tangent plane, in seven digits
    np.testing.assert_allclose(
        scale**2 * after.apply(cloud.function[order]), cloud.applied[order], rtol=0.0, atol=exact * size
    )
    difference = after.stiffness - before.stiffness[order][:, order]
    assert abs(difference).max() < 1e-7 * abs(before.stiffness).max()
    if change == "turned and moved":
        values = scale**2 * after.eigenpairs(10).eigenvalues
        np.testing.assert_allclose(values, cloud.eigenvalues, rtol=1e-7, atol=1e-9)


@pytest.fixture(scope="module", params=["grid", "bent capsule"])
def even(request):
    return core.build_laplacian(square_grid(36) if request.param == "grid" else sausage(2000, bent=True)[0])


@pytest.mark.parametrize("change", CHANGES)
def test_where_neighbors_are_equally_far_the_operator_hardly_changes(even, change):
    # Which of several neighbours at one distance is taken is left to rounding: the results agree to the errors that
    # the operator makes anyway, not to rounding.
    scale, turn, _, shuffled = CHANGES[change]
    before, points = even, even.points
    order = np.random.default_rng(1).permutation(len(points)) if shuffled else np.arange(len(points))
    after = core.build_laplacian((scale * points @ turn)[order])
    np.testing.assert_array_equal(after.boundary, before.boundary[order])
    np.testing.assert_allclose(after.smoothing_lengths, scale * before.smoothing_lengths[order], rtol=0.1)
    assert after.areas.sum() == pytest.approx(scale**2 * before.areas.sum(), rel=1e-2)
    values = scale**2 * after.eigenpairs(8).eigenvalues
    np.testing.assert_allclose(values, before.eigenpairs(8).eigenvalues, rtol=1e-2, atol=1e-9)


@pytest.mark.parametrize("points", [hemisphere_random(800), torus_points(900)], ids=["hemisphere", "torus"])
def test_given_normals_may_have_any_signs(points):
    normals = core.estimate_normals(points)
    signs = np.where(np.random.default_rng(0).random(len(points)) < 0.5, -1.0, 1.0)[:, None]
    before, after = core.build_laplacian(points, normals), core.build_laplacian(points, signs * normals)
    np.testing.assert_allclose(after.areas, before.areas, rtol=1e-7)
    assert abs(after.stiffness - before.stiffness).max() < 1e-7 * abs(before.stiffness).max()
