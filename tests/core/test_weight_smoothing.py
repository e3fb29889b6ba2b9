"""Weights that flow along the surface, against the answers for heat on a plane, and invariants."""

import numpy as np
import pytest
from scipy.special import erf

import core
from tests.core.test_bone_weights import touching_balls

COLUMNS, ROWS, STEP = 48, 20, 0.1


@pytest.fixture(scope="module")
def strip():
    """A flat strip along x with its middle at zero, and its operator."""
    x, y = np.meshgrid(STEP * (np.arange(COLUMNS) - 0.5 * (COLUMNS - 1)), STEP * np.arange(ROWS), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), 0.0 * x.ravel()])
    return points, core.build_laplacian(points)


@pytest.fixture
def halves(strip):
    """Weights of two bones, each on one half of the strip."""
    right = strip[0][:, 0] > 0.0
    return np.column_stack([~right, right]).astype(float)


def test_a_step_becomes_that_of_heat(strip, halves):
    """After the time ``length^2 / 4`` it is the integral of a Gaussian of the length."""
    points, laplacian = strip
    soft = core.rig.smooth_weights(laplacian, halves, 0.6)
    assert soft[:, 1] == pytest.approx(0.5 + 0.5 * erf(points[:, 0] / 0.6), abs=0.01)


def test_points_that_are_not_chosen_stay_and_flow_in(strip, halves):
    """After a long time a band between two held ends is linear, and continuous there."""
    points, laplacian = strip
    x = points[:, 0]
    soft = core.rig.smooth_weights(laplacian, halves, 20.0, chosen=np.abs(x) < 1.0)
    assert np.array_equal(soft[np.abs(x) >= 1.0], halves[np.abs(x) >= 1.0])
    assert soft[:, 1] == pytest.approx(np.clip(0.5 + 0.5 * x / 1.05, 0.0, 1.0), abs=0.03)
    assert soft.sum(axis=1) == pytest.approx(1.0, abs=1e-9)


def test_nothing_flows_between_loose_parts_that_touch(strip, halves):
    points, laplacian = strip
    index = np.arange(len(points)).reshape(COLUMNS, ROWS)
    inner = np.delete(np.arange(COLUMNS - 1), COLUMNS // 2 - 1)  # all columns but those at the gap are joined
    edges = np.concatenate(
        [
            np.column_stack([index[:, :-1].ravel(), index[:, 1:].ravel()]),
            np.column_stack([index[inner].ravel(), index[inner + 1].ravel()]),
        ]
    )
    assert core.rig.smooth_weights(laplacian, halves, 0.5, edges=edges) == pytest.approx(halves, abs=1e-9)
    joined = np.concatenate([edges, [[index[COLUMNS // 2 - 1, 0], index[COLUMNS // 2, 0]]]])
    assert np.abs(core.rig.smooth_weights(laplacian, halves, 0.5, edges=joined) - halves).max() > 0.3
    loose = core.rig.smooth_weights(laplacian, halves, 0.5, edges=np.empty((0, 2), int))
    assert loose == pytest.approx(core.rig.smooth_weights(laplacian, halves, 0.5), abs=1e-12)


def test_little_flows_between_bodies_that_touch_at_a_point():
    """Where the operator's normals of one are reversed; what flows next to the contact fades from there."""
    points, first = touching_balls(4000)  # 0.3 is five spacings: within the reach of a kernel chance decides
    hard = np.column_stack([first, ~first]).astype(float)
    change = np.abs(core.rig.smooth_weights(core.build_laplacian(points), hard, 0.3) - hard).max(axis=1)
    away = np.linalg.norm(points - [1.0, 0.0, 0.0], axis=1)
    assert change[away > 0.3].max() < 0.06
    assert change[away > 0.5].max() < 0.015


def test_empty_points_of_a_loose_part_are_filled_within_it(strip, halves):
    points, laplacian = strip
    index = np.arange(len(points)).reshape(COLUMNS, ROWS)
    inner = np.delete(np.arange(COLUMNS - 1), COLUMNS // 2 - 1)
    edges = np.column_stack([index[inner].ravel(), index[inner + 1].ravel()])
    edges = np.concatenate([edges, np.column_stack([index[:, :-1].ravel(), index[:, 1:].ravel()])])
    holes = halves.copy()
    holes[np.abs(points[:, 0]) < 0.5] = 0.0
    assert core.rig.smooth_weights(laplacian, holes, 0.0, edges=edges) == pytest.approx(halves, abs=1e-9)


def test_some_columns_are_smoothed_and_the_others_share_what_they_leave(strip):
    points, laplacian = strip
    weights = np.tile([0.2, 0.5, 0.0, 0.3], (len(points), 1))
    weights[points[:, 0] > 0.0] = [0.6, 0.0, 0.1, 0.3]
    soft = core.rig.smooth_weights(laplacian, weights, 0.4, columns=[0], locked=[3])
    alone = core.rig.smooth_weights(laplacian, weights[:, :1], 0.4)
    assert np.array_equal(soft[:, 3], weights[:, 3])
    assert soft[:, 0] == pytest.approx(alone[:, 0], abs=1e-9)
    assert soft.sum(axis=1) == pytest.approx(1.0, abs=1e-12)
    assert soft[weights[:, 1] > 0.0, 2].max() == 0.0


def test_few_influences_and_none_below_the_least_stay(strip):
    points, laplacian = strip
    weights = np.random.default_rng(0).dirichlet([0.5] * 6, len(points))
    few = core.rig.smooth_weights(laplacian, weights, 0.0, influences=3, least=0.1, locked=[5])
    assert np.count_nonzero(few[:, :5], axis=1).max() <= 2
    assert np.array_equal(few[:, 5], weights[:, 5])
    assert few.sum(axis=1) == pytest.approx(1.0, abs=1e-12)
    assert np.array_equal(few[:, :5].argmax(axis=1), weights[:, :5].argmax(axis=1))
    every = core.rig.smooth_weights(laplacian, weights, 0.0, influences=2**70, least=0.1)
    assert np.array_equal(every, core.rig.smooth_weights(laplacian, weights, 0.0, influences=6, least=0.1))
    half = core.rig.smooth_weights(laplacian, 0.5 * weights, 0.0, influences=1)
    assert half.max(axis=1) == pytest.approx(0.5, abs=1e-12)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"influences": 0}, "at least one"),
        ({"least": -0.1}, "least weight"),
        ({"edges": [[0, COLUMNS * ROWS]]}, "beyond the 960"),
        ({"edges": [0, 1]}, "Edges have the shape"),
        ({"columns": [2]}, "below 2"),
    ],
)
def test_bad_input_is_refused(strip, halves, options, text):
    with pytest.raises(core.PointCloudError, match=text):
        core.rig.smooth_weights(strip[1], halves, 0.1, **options)
