"""Bones of few points, of another scale, far away, or out of sight."""

import numpy as np
import pytest

import core

LOWER, UPPER = [[0.0, 0.0, -0.8], [0.0, 0.0, 0.0]], [[0.0, 0.0, 0.0], [0.0, 0.0, 0.8]]
HEADS, TAILS = np.array([LOWER, UPPER]).transpose(1, 0, 2)


@pytest.fixture(scope="module")
def ball():
    return core.build_laplacian(core.example_sphere())


class TestNearestBones:
    def test_each_point_follows_the_nearest(self):
        points = np.array([[0.1, 0.0, 0.5], [0.3, 0.2, -0.1], [5.0, 0.0, -4.0]])
        assert core.rig.nearest_bones(points, HEADS, TAILS).tolist() == [[0.0, 1.0], [1.0, 0.0], [1.0, 0.0]]

    def test_points_beside_a_joint_are_shared(self):
        assert core.rig.nearest_bones([[1.0, 0.0, 0.0]], HEADS, TAILS).tolist() == [[0.5, 0.5]]

    def test_a_point_on_a_bone_follows_it(self):
        assert core.rig.nearest_bones([[0.0, 0.0, 0.4]], HEADS, TAILS).tolist() == [[0.0, 1.0]]

    def test_bad_input(self):
        with pytest.raises(core.PointCloudError, match="Give x, y, z"):
            core.rig.nearest_bones([[0.0, 0.0]], HEADS, TAILS)
        with pytest.raises(core.PointCloudError, match="There are no points"):
            core.rig.nearest_bones(np.empty((0, 3)), HEADS, TAILS)
        with pytest.raises(core.PointCloudError, match="There are no bones"):
            core.rig.nearest_bones([[0.0, 0.0, 0.0]], HEADS[:0], TAILS[:0])


class TestReach:
    def test_bones_farther_than_either_extends_are_refused(self, ball):
        """The ball extends over two along each axis, so that its box's diagonal is 3.46 long."""
        for away, refused in ((4.3, False), (4.6, True)):
            shift = [0.0, 0.0, away + 0.8]
            if refused:
                with pytest.raises(core.PointCloudError, match=r"The bones are 3\.6 away.*same place and scale"):
                    core.rig.bone_weights(ball, HEADS + shift, TAILS + shift)
            else:
                assert core.rig.bone_weights(ball, HEADS + shift, TAILS + shift).sum(axis=1) == pytest.approx(1.0)

    def test_small_bones_are_told(self, ball):
        notices = []
        core.rig.bone_weights(ball, 0.01 * HEADS, 0.01 * TAILS, notices=notices)
        assert any("0.016 only, the points over 3.4" in notice for notice in notices)

    def test_bones_outside_are_told_and_taken_as_they_lie(self, ball):
        notices, shift = [], [2.0, 0.0, 0.0]
        found = core.rig.bone_weights(ball, HEADS + shift, TAILS + shift, notices=notices)
        assert any("No point sees a bone" in notice for notice in notices)
        plain = []
        assert np.array_equal(
            found, core.rig.bone_weights(ball, HEADS + shift, TAILS + shift, visible=False, notices=plain)
        )
        assert plain == []

    def test_nothing_is_told_of_bones_inside(self, ball):
        notices = []
        core.rig.bone_weights(ball, HEADS, TAILS, notices=notices)
        assert notices == []

    def test_points_that_see_no_bone_are_counted(self):
        """Of two balls apart the farther one sees none."""
        points = core.example_sphere()
        both = core.build_laplacian(np.vstack([points, points + [3.0, 0.0, 0.0]]))
        notices = []
        core.rig.bone_weights(both, HEADS, TAILS, notices=notices)
        assert [notice[:19] for notice in notices] == ["800 of 1,600 points"]
