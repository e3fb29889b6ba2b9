"""How much points follow bones, against a cylinder's answer and invariants."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

import core
from benchmarks.samplings import fibonacci_sphere, random_sphere
from tests.core.rods import axis_of
from tests.core.test_skinning import turned, volume

GIVEN = np.random.default_rng(4)


def touching_balls(count=700):
    """Two unit balls beside each other that touch, and which points are those of the first."""
    ball = random_sphere(count)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    return np.concatenate([ball, ball @ turn + [2.0, 0.0, 0.0]]), np.arange(2 * count) < count


def two_bones(points):
    middle, axis, half = axis_of(points)
    return (
        np.array([middle - 0.9 * half * axis, middle]),
        np.array([middle, middle + 0.9 * half * axis]),
    )


class TestBoneWeights:
    def test_lie_between_zero_and_one_and_sum_to_one(self, bar):
        points, laplacian = bar
        weights = core.rig.bone_weights(laplacian, *two_bones(points))
        assert weights.min() >= 0.0
        assert np.abs(weights.sum(axis=1) - 1.0).max() < 1e-12

    def test_sum_to_one_where_the_solver_leaves_negative_ones(self, bar, monkeypatch):
        points, laplacian = bar
        module = sys.modules[core.rig.bone_weights.__module__]
        exact = module.solve_columns
        monkeypatch.setattr(module, "solve_columns", lambda *given: exact(*given) - 1e-4)
        weights = core.rig.bone_weights(laplacian, *two_bones(points))
        assert weights.min() == 0.0
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
        weights = core.rig.bone_weights(laplacian, *two_bones(points))
        assert weights[inner, 1] == pytest.approx(exact[inner], abs=0.02)

    def test_follow_a_rotation_a_shift_a_scale_and_the_order_of_points(self, bar):
        points, laplacian = bar
        heads, tails = two_bones(points)
        weights = core.rig.bone_weights(laplacian, heads, tails)
        matrix, order = turned((1, 2, 3), 0.7), GIVEN.permutation(len(points))

        def moved(places):
            return 20.0 * places @ matrix[:, :3].T + 7.0

        other = core.rig.bone_weights(core.build_laplacian(moved(points)[order]), moved(heads), moved(tails))
        assert other == pytest.approx(weights[order], abs=0.02)  # the grid of winding numbers lies differently

    def test_agree_between_samplings(self):
        middle = [[0.0, 0.0, 0.0]]
        ends = np.concatenate([0.8 * np.eye(3), -0.8 * np.eye(3)])
        found = []
        for points in (fibonacci_sphere(3000), random_sphere(6000)):
            laplacian = core.build_laplacian(points)
            weights = core.rig.bone_weights(laplacian, np.repeat(middle, 6, axis=0), ends)
            strongest = np.abs(
                weights - core.rig.bone_weights(laplacian, np.zeros((6, 3)), ends)[:, [1, 2, 0, 4, 5, 3]]
            )
            assert strongest.max() > 0.5  # it does matter which bone is which
            found.append(
                core.clean.Prolongation(np.concatenate([points, ends]), np.arange(len(points)), laplacian.normals)
            )
            found.append(weights)
        assert found[0].interpolate(found[1])[-6:] == pytest.approx(found[2].interpolate(found[3])[-6:], abs=0.03)

    def test_no_bone_warms_what_it_does_not_see(self):
        """Two balls beside each other, a bone in each: the half of a ball that is nearer to the other's bone is not."""
        ball = fibonacci_sphere(1500)
        points = np.concatenate([ball, ball + [2.3, 0, 0]])
        laplacian = core.build_laplacian(points)
        heads, tails = [[-0.9, 0, 0], [1.5, 0, 0]], [[-0.8, 0, 0], [3.2, 0, 0]]
        seen = core.rig.bone_weights(laplacian, heads, tails)
        assert seen[:1500, 1].max() < 1e-3
        assert seen[1500:, 0].max() < 1e-3
        assert core.rig.bone_weights(laplacian, heads, tails, visible=False)[:1500, 1].max() > 0.5

    @pytest.mark.parametrize("gap", [1.0, 0.7])
    def test_no_bone_reaches_across_the_gap_between_two_bodies(self, gap):
        """A flat hand on a hip: the bone of the hand is nearer to the skin of the hip below it than that of the hip.

        At less than a spacing some normals in the contact are wrong.
        """

        def slab(count, half):
            ball = fibonacci_sphere(count)
            return ball / np.sum(np.abs(ball / half) ** 6, axis=1)[:, None] ** (1.0 / 6.0)

        hip, hand = slab(2000, [1.0, 1.0, 0.6]), slab(700, [0.5, 0.5, 0.15])
        spacing = np.sqrt(core.build_laplacian(hip).areas.mean())
        height = 0.75 + gap * spacing
        hand += [0.0, 0.0, height]
        laplacian = core.build_laplacian(np.concatenate([hip, hand]))
        weights = core.rig.bone_weights(laplacian, [[-0.8, 0, 0], [-0.4, 0, height]], [[0.8, 0, 0], [0.4, 0, height]])
        wrong = np.concatenate([weights[:2000, 1], weights[2000:, 0]])
        away = np.concatenate([cKDTree(hand).query(hip)[0], cKDTree(hip).query(hand)[0]])
        assert wrong[away > (gap + 2.0) * spacing].max() < 1e-3
        assert np.mean(wrong > 1e-3) < 0.005

    def test_no_bone_reaches_into_a_body_that_touches_at_a_point(self):
        """Nothing there tells two outsides from one surface, so that the operator's normals of one may be reversed."""
        points, first = touching_balls()
        laplacian = core.build_laplacian(points)
        assert np.einsum("ij,ij->i", laplacian.normals[~first], points[~first] - [2.0, 0.0, 0.0]).mean() < -0.9
        heads, tails = [[0, 0, -0.5], [2, 0, -0.5]], [[0, 0, 0.5], [2, 0, 0.5]]
        notices = []
        weights = core.rig.bone_weights(laplacian, heads, tails, notices=notices)
        wrong = np.where(first, weights[:, 1], weights[:, 0])
        assert wrong[np.linalg.norm(points - [1.0, 0.0, 0.0], axis=1) > 0.3].max() < 1e-3
        assert np.mean(wrong > 1e-3) < 0.008
        assert notices == []

    def test_no_weight_jumps_between_neighbors_where_bones_lie_close_below_the_surface(self):
        points = random_sphere(2000)
        laplacian = core.build_laplacian(points)
        ends = 0.98 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
        weights = core.rig.bone_weights(laplacian, ends[:2], ends[1:])
        near = cKDTree(points).query(points, k=7)[1][:, 1:]
        assert np.abs(weights[near, 0] - weights[:, :1]).max() < 0.35
        assert weights[:, 0].max() > 0.9

    def test_points_with_reversed_normals_follow_those_around(self, bar):
        points, laplacian = bar
        weights = core.rig.bone_weights(laplacian, *two_bones(points))
        wrong = np.arange(0, len(points), 50)
        normals = laplacian.normals.copy()
        normals[wrong] *= -1.0
        found = core.rig.bone_weights(replace(laplacian, normals=normals), *two_bones(points))
        assert found[wrong] == pytest.approx(weights[wrong], abs=0.05)

    def test_an_elbow_keeps_its_volume_by_screws(self):
        angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        points = np.array([[x, 0.3 * np.cos(a), 0.3 * np.sin(a)] for x in np.linspace(-2, 2, 61) for a in angle])
        weights = core.rig.bone_weights(
            core.build_laplacian(points), [[-1.9, 0, 0], [0, 0, 0]], [[0, 0, 0], [1.9, 0, 0]]
        )
        pose = [turned((0, 1, 0), 0.0), turned((0, 1, 0), np.pi / 2)]
        bent = core.rig.skin(points, weights, pose, dual_quaternions=True)
        assert volume(bent, 24) == pytest.approx(volume(points, 24), rel=0.01)

    def test_bones_outside_still_move_points(self):
        points = fibonacci_sphere(1500)
        weights = core.rig.bone_weights(core.build_laplacian(points), [[3, 0, 0], [-3, 0, 0]], [[4, 0, 0], [-4, 0, 0]])
        assert np.abs(weights.sum(axis=1) - 1.0).max() < 1e-12
        assert weights[points[:, 0] > 0.7, 0].min() > 0.5

    def test_wider_falloff_blends_wider(self, bar):
        points, laplacian = bar
        narrow, wide = (core.rig.bone_weights(laplacian, *two_bones(points), falloff=width) for width in (0.5, 2.0))
        assert np.mean(1.0 - wide.max(axis=1)) > 3.0 * np.mean(1.0 - narrow.max(axis=1))

    def test_influences_and_the_least_weight_are_kept(self):
        points = fibonacci_sphere(1500)
        laplacian = core.build_laplacian(points)
        ends = np.zeros((6, 3)), np.concatenate([0.8 * np.eye(3), -0.8 * np.eye(3)])
        every = core.rig.bone_weights(laplacian, *ends)
        assert np.count_nonzero(every, axis=1).max() == 6
        few = core.rig.bone_weights(laplacian, *ends, influences=2, least=0.1)
        assert np.count_nonzero(few, axis=1).max() == 2
        assert few[few > 0.0].min() >= 0.1
        assert np.abs(few.sum(axis=1) - 1.0).max() < 1e-12
        rows = np.arange(len(points))
        assert (few[rows, every.argmax(axis=1)] > 0.0).all()

    def test_points_left_out_follow_the_nearest(self):
        points = np.concatenate([fibonacci_sphere(1500), [[0.0, 0.0, 4.0]]])
        laplacian = core.build_laplacian(points)
        assert laplacian.component[-1] < 0
        weights = core.rig.bone_weights(laplacian, np.zeros((2, 3)), [[0, 0, 0.8], [0, 0, -0.8]])
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
            core.rig.bone_weights(bar[1], heads, tails, **options)
