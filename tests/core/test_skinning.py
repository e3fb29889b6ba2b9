"""Points that follow bones."""

import numpy as np
import pytest
from scipy import sparse

import core

GIVEN = np.random.default_rng(4)


def turned(axis, angle, shift=(0.0, 0.0, 0.0), about=(0.0, 0.0, 0.0)):
    """Matrix of a rotation by an angle around an axis through a place, and a shift, (3, 4)."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.cross(np.eye(3), axis)
    rotation = np.eye(3) + np.sin(angle) * cross.T @ np.eye(3) * -1.0 + (1 - np.cos(angle)) * cross @ cross
    return np.column_stack([rotation, np.asarray(shift) + about - rotation @ about])


class TestSkin:
    points = GIVEN.standard_normal((200, 3))
    weights = GIVEN.dirichlet([0.4, 0.4, 0.4], 200)

    @pytest.mark.parametrize("dual", [False, True])
    def test_a_pose_that_is_rigid_as_a_whole_is_that_of_all_points(self, dual):
        matrix = turned((1, 2, -1), 2.6, (4, 5, 6))
        moved, gradients = core.rig.skin(self.points, self.weights, [matrix] * 3, dual_quaternions=dual, gradients=True)
        assert moved == pytest.approx(self.points @ matrix[:, :3].T + matrix[:, 3], abs=1e-12)
        assert gradients == pytest.approx(np.broadcast_to(matrix[:, :3], (200, 3, 3)), abs=1e-12)

    @pytest.mark.parametrize("dual", [False, True])
    def test_a_point_of_one_bone_follows_it_stretch_and_all(self, dual):
        matrices = GIVEN.standard_normal((3, 3, 4))
        matrices[:, :, :3] = [turned(GIVEN.standard_normal(3), 3.0)[:, :3] @ np.diag([1.0, 2.0, 0.5]) for _ in range(3)]
        bone = GIVEN.integers(0, 3, 200)
        moved = core.rig.skin(self.points, np.eye(3)[bone], matrices, dual_quaternions=dual)
        assert moved == pytest.approx(
            np.einsum("nij,nj->ni", matrices[bone, :, :3], self.points) + matrices[bone, :, 3], abs=1e-10
        )

    def test_half_of_a_screw_turns_by_half(self):
        whole = turned((0, 0, 1), 1.2, (0, 0, 0.6))
        still = turned((0, 0, 1), 0.0)
        half = turned((0, 0, 1), 0.6, (0, 0, 0.3))
        moved = core.rig.skin(self.points, np.full((200, 2), 0.5), [whole, still], dual_quaternions=True)
        assert moved == pytest.approx(self.points @ half[:, :3].T + half[:, 3], abs=1e-12)
        assert core.rig.skin(self.points, np.full((200, 1), 0.5), [whole], dual_quaternions=True) == pytest.approx(
            moved
        )

    @pytest.mark.parametrize("dual", [False, True])
    def test_gradients_are_slopes_of_the_motion(self, dual):
        matrices = np.array(
            [turned((1, 0, 1), 0.8, (1, 0, 0)), turned((0, 1, 0), -0.9), turned((1, 1, 1), 2.0, (0, 0, 3))]
        )
        matrices[1, :, :3] *= 1.3, 0.8, 1.0
        _, gradients = core.rig.skin(self.points, self.weights, matrices, dual_quaternions=dual, gradients=True)
        for axis in np.eye(3):
            ahead, behind = (
                core.rig.skin(self.points + step * axis, self.weights, matrices, dual_quaternions=dual)
                for step in (1e-4, -1e-4)
            )
            assert (ahead - behind) / 2e-4 == pytest.approx(gradients @ axis, abs=1e-8)

    @pytest.mark.parametrize("dual", [False, True])
    def test_it_does_not_matter_where_the_origin_is(self, dual):
        matrices = np.array([turned((1, 0, 1), 0.8, (1, 0, 0)), turned((0, 1, 0), -0.9), turned((1, 1, 1), 2.0)])
        matrices[:, :, :3] *= np.array([[1.5], [0.7], [1.0]])[:, None]
        origin = np.array([5.0, -3.0, 8.0])
        beside = matrices.copy()
        beside[:, :, 3] += origin - matrices[:, :, :3] @ origin
        moved = core.rig.skin(self.points, self.weights, matrices, dual_quaternions=dual)
        found = core.rig.skin(self.points + origin, self.weights, beside, dual_quaternions=dual)
        assert found - origin == pytest.approx(moved, abs=1e-12)

    def test_a_stretch_that_all_bones_share_stretches_all(self):
        stretch = np.column_stack([np.diag([2.0, 1.0, 0.5]), np.zeros(3)])
        moved = core.rig.skin(self.points, self.weights, [stretch] * 3, dual_quaternions=True)
        assert moved == pytest.approx(self.points * (2.0, 1.0, 0.5), abs=1e-12)

    @pytest.mark.parametrize("dual", [False, True])
    def test_what_is_prepared_moves_points_again_as_the_first_time(self, dual):
        poses = [
            [turned((1, 0, 1), angle, (1, 0, 0)), turned((0, 1, 0), -angle), turned((1, 1, 1), 2.0 * angle)]
            for angle in (0.3, 3.0, 0.3)
        ]
        skinner = core.rig.Skinner(self.weights)
        found = [skinner.move(self.points, pose, dual_quaternions=dual) for pose in poses]
        expected = [core.rig.skin(self.points, self.weights, pose, dual_quaternions=dual) for pose in poses]
        assert np.array_equal(found, expected)
        with pytest.raises(core.InvalidPointsError, match="matrices of 2"):
            skinner.move(self.points, poses[0][:2])

    def test_stretches_by_rounding_are_left_out_only_where_asked_for(self):
        matrices = np.array([turned((1, 0, 1), 0.8), turned((0, 1, 0), -0.9), turned((1, 1, 1), 2.0)])
        skinner = core.rig.Skinner(np.eye(3)[np.arange(200) % 3])
        rigid = skinner.move(self.points, matrices, dual_quaternions=True)
        matrices[:, :, :3] *= 1.0 + 1e-6
        found = skinner.move(self.points, matrices, dual_quaternions=True)
        assert found == pytest.approx((1.0 + 1e-6) * rigid, abs=1e-12)
        assert skinner.move(self.points, matrices, dual_quaternions=True, rounding=2e-6) == pytest.approx(
            rigid, abs=1e-12
        )

    def test_named_bones_are_the_columns_of_a_table(self):
        matrices = [turned((1, 0, 1), 0.8), turned((0, 1, 0), -0.9), turned((1, 1, 1), 2.0)]
        order = np.argsort(self.weights, axis=1)
        named = core.rig.Skinner(np.take_along_axis(self.weights, order, axis=1), order)
        assert named.move(self.points, matrices) == pytest.approx(core.rig.skin(self.points, self.weights, matrices))
        with pytest.raises(core.InvalidPointsError, match="There are 2 bones"):
            core.rig.Skinner(self.weights, order, 2)

    def test_the_arrays_of_the_caller_stay_as_they_are(self):
        weights, bones = np.array([[1.0, 0.0], [0.0, 1.0], [0.4, 0.6]]), np.array([[0, 1], [1, 2], [0, 2]])
        given = weights.copy(), bones.copy()
        core.rig.Skinner(weights, bones)
        assert np.array_equal(weights, given[0])
        assert np.array_equal(bones, given[1])
        twice = sparse.csr_array((np.array([0.25, 0.75, 1.0]), np.array([1, 1, 0]), np.array([0, 2, 3])), shape=(2, 2))
        core.rig.Skinner(twice)
        assert np.array_equal(twice.data, [0.25, 0.75, 1.0])

    def test_a_bent_bar_keeps_its_volume_by_screws(self):
        """A quarter of a turn about y: linear blending halves the cross section in the bend, screws do not."""
        angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
        x = np.linspace(-2, 2, 81)
        points = np.array([[t, 0.3 * np.cos(a), 0.3 * np.sin(a)] for t in x for a in angle])
        share = np.clip(0.5 + points[:, 0] / 1.2, 0, 1)
        matrices = [turned((0, 1, 0), 0.0), turned((0, 1, 0), np.pi / 2)]
        twist = [turned((1, 0, 0), 0.0), turned((1, 0, 0), 0.9 * np.pi)]
        weights = np.column_stack([1 - share, share])
        for pose, most in ((matrices, 0.05), (twist, 0.05)):
            volumes = [
                volume(core.rig.skin(points, weights, pose, dual_quaternions=dual), 40) / volume(points, 40)
                for dual in (False, True)
            ]
            assert abs(volumes[1] - 1.0) < most
            assert abs(volumes[0] - 1.0) > abs(volumes[1] - 1.0)

    def test_sparse_weights_are_the_same(self):
        matrices = [turned((1, 0, 1), 0.8), turned((0, 1, 0), -0.9), turned((1, 1, 1), 2.0)]
        found = core.rig.skin(self.points, sparse.csr_array(self.weights), matrices)
        assert np.array_equal(found, core.rig.skin(self.points, self.weights, matrices))

    @pytest.mark.parametrize(
        ("weights", "matrices", "text"),
        [
            (np.ones((200, 2)), np.zeros((3, 3, 4)), "Weights have the shape"),
            (np.ones((200, 1)), np.zeros((1, 3, 3)), "Matrices have the shape"),
            (np.full((200, 1), np.nan), np.zeros((1, 3, 4)), "not finite"),
        ],
    )
    def test_bad_input_is_refused(self, weights, matrices, text):
        with pytest.raises(core.InvalidPointsError, match=text):
            core.rig.skin(self.points, weights, matrices)


class TestEnvelopes:
    def test_a_cone_with_round_ends(self):
        points = np.array([[0, 0, -1.2], [0, 0, 2.7], [1.4, 0, 1.0], [1.9, 0, 1.0], [2.1, 0, 1.0], [2.6, 0, 1.0]])
        radii = np.ones(6), np.full(6, 2.0)
        heads, tails = np.zeros((6, 3)), np.tile([0.0, 0.0, 2.0], (6, 1))
        found = core.rig.envelope_share(points, heads, tails, *radii, np.ones(6))
        assert found == pytest.approx([1 - 0.2**2, 1, 1, 1 - 0.4**2, 1 - 0.6**2, 0])

    def test_without_a_distance_it_ends_at_once_and_a_bone_without_length_is_a_ball(self):
        points, origin = np.array([[0.9, 0, 0], [1.1, 0, 0]]), np.zeros((2, 3))
        found = core.rig.envelope_share(points, origin, origin, np.ones(2), np.ones(2), np.zeros(2))
        assert found.tolist() == [1.0, 0.0]

    def test_bad_input_is_refused(self):
        ends, ones = np.zeros((2, 3)), np.ones(2)
        with pytest.raises(core.InvalidPointsError, match="Radii"):
            core.rig.envelope_share(ends, ends, ends, ones[:1], ones, ones)
        with pytest.raises(core.InvalidPointsError, match="not finite|NaN|finite"):
            core.rig.envelope_share(ends, ends, ends, ones, ones * np.nan, ones)


def volume(points, around):
    """Volume of a tube of rings of so many points, by the divergence theorem over its triangles and two end discs."""
    rings = points.reshape(-1, around, 3)
    a, b = rings[:-1], rings[1:]
    c, d = np.roll(a, -1, axis=1), np.roll(b, -1, axis=1)
    total = sum(np.einsum("rpi,rpi->", p, np.cross(q, r)) for p, q, r in ((a, b, c), (b, d, c)))
    for ring, sign in ((rings[0], -1.0), (rings[-1], 1.0)):
        total += sign * np.einsum("pi,pi->", ring, np.cross(np.roll(ring, -1, axis=0), ring.mean(axis=0)[None]) * -1.0)
    return abs(total) / 6.0
