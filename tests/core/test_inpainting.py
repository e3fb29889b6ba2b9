"""Functions that are filled in, and weights that are smoothed."""

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere
from tests.core.rods import axis_of

GIVEN = np.random.default_rng(4)


class TestInpaint:
    def test_constants_stay_and_known_values_are_exact(self, bar):
        points, laplacian = bar
        known = GIVEN.choice(len(points), 60, replace=False)
        values = np.column_stack([np.full(60, 0.3), GIVEN.random(60)])
        values = np.column_stack([values, 1.0 - values.sum(axis=1)])
        for biharmonic in (True, False):
            found = core.rig.inpaint(laplacian, known, values, biharmonic=biharmonic)
            assert np.array_equal(found[known], values)
            assert np.abs(found[:, 0] - 0.3).max() < 1e-12
            assert np.abs(found.sum(axis=1) - 1.0).max() < 1e-10

    def test_without_slopes_no_value_leaves_the_range(self, bar):
        points, laplacian = bar
        known = GIVEN.choice(len(points), 30, replace=False)
        values = GIVEN.random(30)
        found = core.rig.inpaint(laplacian, known, values, biharmonic=False)
        assert found.min() >= values.min() - 1e-12
        assert found.max() <= values.max() + 1e-12

    def test_slopes_go_on(self, bar):
        """Along a bar whose height is known at two short pieces, biharmonic values reach farther than harmonic ones."""
        points, laplacian = bar
        middle, axis, half = axis_of(points)
        along = (points - middle) @ axis / half
        known = (np.abs(along) > 0.1) & (np.abs(along) < 0.3)
        smooth, flat = (core.rig.inpaint(laplacian, known, along[known], biharmonic=kind) for kind in (True, False))
        ends = np.abs(along) > 0.6
        assert np.abs(smooth - along)[ends].mean() < 0.5 * np.abs(flat - along)[ends].mean()

    def test_nothing_crosses_from_one_component_to_another(self):
        ball = fibonacci_sphere(800)
        laplacian = core.build_laplacian(np.concatenate([ball, ball + [3.0, 0, 0]]))
        known = np.array([0, 400, 800, 1200])
        found = core.rig.inpaint(laplacian, known, [0.0, 0.0, 1.0, 1.0])
        assert np.abs(found[:800]).max() < 1e-12
        assert np.abs(found[800:] - 1.0).max() < 1e-12
        assert core.rig.inpaint(laplacian, known[:2], [2.0, 2.0]) == pytest.approx(2.0)  # from the nearest known one

    @pytest.mark.parametrize(
        ("known", "values", "text"),
        [([0, 1], [1.0], "Known values have"), ([0], [np.nan], "not finite"), ([], [], "No known point")],
    )
    def test_bad_input_is_refused(self, bar, known, values, text):
        with pytest.raises(core.PointCloudError, match=text):
            core.rig.inpaint(bar[1], known, values)


class TestSmoothWeights:
    def test_keeps_sums_and_range(self, bar):
        points, laplacian = bar
        hard = np.eye(3)[GIVEN.integers(0, 3, len(points))]
        soft = core.rig.smooth_weights(laplacian, hard, 0.5)
        assert soft.min() >= 0.0
        assert np.abs(soft.sum(axis=1) - 1.0).max() < 1e-9
        assert soft.std() < 0.5 * hard.std()

    def test_locked_groups_stay_and_the_others_share_the_rest(self, bar):
        points, laplacian = bar
        hard = np.eye(3)[GIVEN.integers(0, 3, len(points))]
        hard[:, 0], hard[:, 1:] = 0.25, 0.75 * hard[:, 1:] / np.maximum(hard[:, 1:].sum(axis=1, keepdims=True), 1e-9)
        hard[hard[:, 1:].sum(axis=1) == 0, 1] = 0.75
        soft = core.rig.smooth_weights(laplacian, hard, 0.5, locked=[0])
        assert np.array_equal(soft[:, 0], hard[:, 0])
        assert np.abs(soft.sum(axis=1) - 1.0).max() < 1e-9
        assert np.abs(soft[:, 1] - hard[:, 1]).max() > 0.1

    def test_points_without_weights_are_filled(self, bar):
        points, laplacian = bar
        weights = np.tile([0.25, 0.75], (len(points), 1))
        weights[GIVEN.choice(len(points), 50, replace=False)] = 0.0
        assert core.rig.smooth_weights(laplacian, weights, 0.0) == pytest.approx(
            np.tile([0.25, 0.75], (len(points), 1))
        )

    @pytest.mark.parametrize(
        ("change", "length", "text"),
        [(-1.0, 0.1, "1 points have negative"), (np.nan, 0.1, "not finite"), (1.0, -1.0, "length")],
    )
    def test_bad_input_is_refused(self, bar, change, length, text):
        weights = np.ones((len(bar[0]), 2))
        weights[0, 0] = change
        with pytest.raises(core.PointCloudError, match=text):
            core.rig.smooth_weights(bar[1], weights, length)
