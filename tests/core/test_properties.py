"""What holds for any cloud, however it is sampled, scaled and placed: invariants, or an error that users can read."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import core

SHAPES = {
    "sphere": lambda u, v: np.stack([np.sqrt(1 - v**2) * np.cos(u), np.sqrt(1 - v**2) * np.sin(u), v], axis=1),
    "patch": lambda u, v: np.stack([u / np.pi, v, 0.2 * np.sin(u) * v], axis=1),
    "cylinder": lambda u, v: np.stack([np.cos(u), np.sin(u), v], axis=1),
    "cube": lambda u, v: np.stack([u / np.pi - 1.0, v, np.sin(40.0 * u * v)], axis=1),  # hardly a surface
    "line": lambda u, v: np.stack([u, 2.0 * u, -u], axis=1),
}


@st.composite
def clouds(draw):
    """Random points on a shape, stretched, noisy and partly doubled, in some unit and place."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.integers(110, 220) | st.integers(110, 220) | st.integers(110, 220) | st.integers(1, 110))
    u, v = random.uniform(0.0, 2.0 * np.pi, count), random.uniform(-1.0, 1.0, count)
    points = SHAPES[draw(st.sampled_from(list(SHAPES)))](u, v)
    points *= draw(st.tuples(*[st.sampled_from([0.3, 1.0, 1.0, 2.0])] * 3))
    points += draw(st.sampled_from([0.0, 0.0, 0.01, 0.1])) * random.standard_normal(points.shape)
    doubled = draw(st.integers(0, 80))
    return np.concatenate([points, points[random.integers(0, count, doubled)]])


@st.composite
def changes(draw):
    """A unit, a rotation and a place."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    turn = np.linalg.qr(random.standard_normal((3, 3)))[0]
    return 10.0 ** draw(st.integers(-6, 6)), turn, draw(st.sampled_from([0.0, 1.0, 100.0])) * random.standard_normal(3)


def build(points):
    """Return the operator, or the kind of error that refuses these points."""
    try:
        return core.build_laplacian(points)
    except core.PointCloudError as error:
        return type(error)


def check_structure(laplacian, points):
    """Assert what an operator is for any points."""
    taken = laplacian.component >= 0
    assert taken.any()
    assert np.isfinite(laplacian.areas).all()
    assert np.all(laplacian.areas[taken] > 0.0)
    stiffness = laplacian.stiffness
    assert abs(stiffness - stiffness.T).max() <= 1e-15 * abs(stiffness).max()
    assert np.all(np.abs(stiffness.sum(axis=1)) <= 1e-9 * stiffness.diagonal().max())
    pairs = stiffness.tocoo()
    assert np.all(pairs.data[pairs.row != pairs.col] <= 0.0)
    np.testing.assert_allclose(np.linalg.norm(laplacian.normals[taken], axis=1), 1.0, rtol=1e-9)
    assert np.isfinite(laplacian.apply(points[:, 0])).all()
    assert np.abs(laplacian.apply(np.ones(len(points)))[taken]).max() <= 1e-7 * np.max(
        stiffness.diagonal()[taken] / laplacian.areas[taken]
    )


@pytest.mark.filterwarnings("error")
@settings(derandomize=True, deadline=None, max_examples=25, suppress_health_check=[HealthCheck.too_slow])
@given(points=clouds(), change=changes(), seed=st.integers(0, 2**32 - 1))
def test_any_cloud_has_an_operator_that_moves_with_it_or_is_refused(points, change, seed):
    scale, turn, shift = change
    order = np.random.default_rng(seed).permutation(len(points))
    before = build(points)
    after = build(scale * (points @ turn + shift)[order])
    if isinstance(before, type) or isinstance(after, type):
        assert before is after
        return
    check_structure(before, points)
    check_structure(after, points[order])
    np.testing.assert_array_equal(after.component, before.component[order])
    np.testing.assert_array_equal(after.boundary, before.boundary[order])
    np.testing.assert_allclose(after.areas, scale**2 * before.areas[order], rtol=1e-5)
    np.testing.assert_allclose(after.smoothing_lengths, scale * before.smoothing_lengths[order], rtol=1e-6)
    values = np.sin(3.0 * np.arange(len(points)))
    size = np.abs(before.apply(values)).max()
    np.testing.assert_allclose(
        scale**2 * after.apply(values[order]), before.apply(values)[order], rtol=0.0, atol=1e-4 * size
    )
