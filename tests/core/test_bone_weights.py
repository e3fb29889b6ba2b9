"""How much points follow bones, against a cylinder's answer and invariants."""

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere
from tests.core.rods import axis_of

GIVEN = np.random.default_rng(4)


def turned(axis, angle, shift=(0.0, 0.0, 0.0), about=(0.0, 0.0, 0.0)):
    """Matrix of a rotation by an angle around an axis through a place, and a shift, (3, 4)."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.cross(np.eye(3), axis)
    rotation = np.eye(3) + np.sin(angle) * cross.T @ np.eye(3) * -1.0 + (1 - np.cos(angle)) * cross @ cross
    return np.column_stack([rotation, np.asarray(shift) + about - rotation @ about])


def two_bones(points):
    middle, axis, half = axis_of(points)
    return (
        np.array([middle - 0.9 * half * axis, middle]),
        np.array([middle, middle + 0.9 * half * axis]),
    )


class TestBoneWeights:
    def test_lie_between_zero_and_one_and_sum_to_one(self, bar):
        points, laplacian = bar
        weights = core.bone_weights(laplacian, *two_bones(points))
        assert weights.min() >= 0.0
        assert np.abs(weights.sum(axis=1) - 1.0).max() < 1e-12

    def test_are_those_of_a_cylinder(self, bar):
        """Around a bone along the axis, at the distance r: ``w'' = 2 (w - p) / r^2``."""
        points, laplacian = bar
        middle, axis, half = axis_of(points)
        along = (points - middle) @ axis
        radius = np.sqrt(np.sum((points - middle) ** 2, axis=1) - along**2)
        inner = np.abs(along) < 0.5 * half
        tail = 0.5 * np.exp(-np.sqrt(2.0) * np.abs(along) / radius[inner].mean())
        exact = np.where(along > 0.0, 1.0 - tail, tail)
        weights = core.bone_weights(laplacian, *two_bones(points))
        assert weights[inner, 1] == pytest.approx(exact[inner], abs=0.02)

    def test_follow_a_rotation_a_shift_a_scale_and_the_order_of_points(self, bar):
        points, laplacian = bar
        heads, tails = two_bones(points)
        weights = core.bone_weights(laplacian, heads, tails)
        matrix, order = turned((1, 2, 3), 0.7), GIVEN.permutation(len(points))

        def moved(places):
            return 20.0 * places @ matrix[:, :3].T + 7.0

        other = core.bone_weights(core.build_laplacian(moved(points)[order]), moved(heads), moved(tails))
        assert other == pytest.approx(weights[order], abs=0.02)  # the grid of winding numbers lies differently

    def test_agree_between_samplings(self):
        middle = [[0.0, 0.0, 0.0]]
        ends = np.concatenate([0.8 * np.eye(3), -0.8 * np.eye(3)])
        found = []
        for points in (fibonacci_sphere(3000), random_sphere(6000)):
            laplacian = core.build_laplacian(points)
            weights = core.bone_weights(laplacian, np.repeat(middle, 6, axis=0), ends)
            strongest = np.abs(weights - core.bone_weights(laplacian, np.zeros((6, 3)), ends)[:, [1, 2, 0, 4, 5, 3]])
            assert strongest.max() > 0.5  # it does matter which bone is which
            found.append(core.Prolongation(np.concatenate([points, ends]), np.arange(len(points)), laplacian.normals))
            found.append(weights)
        assert found[0].interpolate(found[1])[-6:] == pytest.approx(found[2].interpolate(found[3])[-6:], abs=0.03)

    def test_no_bone_warms_what_it_does_not_see(self):
        """Two balls beside each other, a bone in each: the half of a ball that is nearer to the other's bone is not."""
        ball = fibonacci_sphere(1500)
        points = np.concatenate([ball, ball + [2.3, 0, 0]])
        laplacian = core.build_laplacian(points)
        heads, tails = [[-0.9, 0, 0], [1.5, 0, 0]], [[-0.8, 0, 0], [3.2, 0, 0]]
        seen = core.bone_weights(laplacian, heads, tails)
        assert seen[:1500, 1].max() < 1e-3
        assert seen[1500:, 0].max() < 1e-3
        assert core.bone_weights(laplacian, heads, tails, visible=False)[:1500, 1].max() > 0.5

    def test_bones_outside_still_move_points(self):
        points = fibonacci_sphere(1500)
        weights = core.bone_weights(core.build_laplacian(points), [[3, 0, 0], [-3, 0, 0]], [[4, 0, 0], [-4, 0, 0]])
        assert np.abs(weights.sum(axis=1) - 1.0).max() < 1e-12
        assert weights[points[:, 0] > 0.7, 0].min() > 0.5

    def test_wider_falloff_blends_wider(self, bar):
        points, laplacian = bar
        narrow, wide = (core.bone_weights(laplacian, *two_bones(points), falloff=width) for width in (0.5, 2.0))
        assert np.mean(1.0 - wide.max(axis=1)) > 3.0 * np.mean(1.0 - narrow.max(axis=1))

    def test_influences_and_the_least_weight_are_kept(self):
        points = fibonacci_sphere(1500)
        laplacian = core.build_laplacian(points)
        ends = np.zeros((6, 3)), np.concatenate([0.8 * np.eye(3), -0.8 * np.eye(3)])
        every = core.bone_weights(laplacian, *ends)
        assert np.count_nonzero(every, axis=1).max() == 6
        few = core.bone_weights(laplacian, *ends, influences=2, least=0.1)
        assert np.count_nonzero(few, axis=1).max() == 2
        assert few[few > 0.0].min() >= 0.1
        assert np.abs(few.sum(axis=1) - 1.0).max() < 1e-12
        rows = np.arange(len(points))
        assert (few[rows, every.argmax(axis=1)] > 0.0).all()

    def test_points_left_out_follow_the_nearest(self):
        points = np.concatenate([fibonacci_sphere(1500), [[0.0, 0.0, 4.0]]])
        laplacian = core.build_laplacian(points)
        assert laplacian.component[-1] < 0
        weights = core.bone_weights(laplacian, np.zeros((2, 3)), [[0, 0, 0.8], [0, 0, -0.8]])
        assert weights[-1, 0] > 0.9
        assert weights[-1].sum() == pytest.approx(1.0, abs=1e-12)

    @pytest.mark.parametrize(
        ("heads", "tails", "options", "text"),
        [
            ([], [], {}, "Heads have the shape"),
            (np.zeros((0, 3)), np.zeros((0, 3)), {}, "There are no bones"),
            ([[0, 0, 0]], [[0, 0, np.nan]], {}, "1 of 1 tails are not finite"),
            ([[0, 0, 0]], [[0, 0, 1], [1, 0, 0]], {}, "Tails have the shape"),
            ([[0, 0, 0]], [[0, 0, 1]], {"falloff": 0.0}, "falloff"),
            ([[0, 0, 0]], [[0, 0, 1]], {"influences": 0}, "at least one"),
            ([[0, 0, 0]], [[0, 0, 1]], {"least": 1.0}, "less than 1"),
            ([[0, 0, 0]], [[0, 0, 1]], {"visible": 3}, "True or False"),
        ],
    )
    def test_bad_input_is_refused(self, bar, heads, tails, options, text):
        with pytest.raises(core.PointCloudError, match=text):
            core.bone_weights(bar[1], heads, tails, **options)
