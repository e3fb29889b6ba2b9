"""Values taken from the surface of other points, across no gap and no contact."""

import numpy as np
import pytest

import core
from benchmarks.samplings import fibonacci_sphere, square_grid

GIVEN = np.random.default_rng(3)


def turned(points, seed=0):
    """The same surface of revolution sampled anew."""
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return points @ turn.T


@pytest.fixture(scope="module")
def ball():
    return core.build_laplacian(fibonacci_sphere(1500))


@pytest.fixture(scope="module")
def anew():
    return core.build_laplacian(turned(fibonacci_sphere(1000)))


class TestMatch:
    def test_two_samples_of_one_surface_lie_on_each_other(self, ball, anew):
        match = core.rig.match_surface(anew, ball)
        assert match.known.all()
        assert match.distance.max() < 1e-3
        assert np.allclose(match.weights.sum(axis=1), 1.0, atol=1e-12)
        assert np.linalg.norm(ball.points[match.nearest] - anew.points, axis=1).max() < 0.11

    def test_points_are_their_own_places(self, ball):
        match = core.rig.match_surface(ball, ball)
        assert np.array_equal(match.nearest, np.arange(1500))
        assert np.abs(match.weights @ ball.points - ball.points).max() < 1e-3

    def test_linear_functions_stay_linear(self):
        source = core.build_laplacian(square_grid(20))
        target = core.build_laplacian(np.column_stack([GIVEN.uniform(0.1, 0.9, (600, 2)), np.zeros(600)]))
        match = core.rig.match_surface(target, source)
        assert match.known.all()
        assert np.abs(match.weights @ source.points - target.points).max() < 2e-3

    def test_distance_and_offsets(self, ball):
        """A sphere of radius 1.1 is 0.1 away, wherever both stand."""
        target = core.build_laplacian(1.1 * turned(fibonacci_sphere(1000)) + [5.0, 0.0, 0.0])
        match = core.rig.match_surface(target, ball, offsets=[[5.0, 0.0, 0.0]], distance=0.2)
        assert match.known.all()
        assert match.distance == pytest.approx(0.1, abs=2e-3)
        assert not core.rig.match_surface(target, ball, offsets=[[5.0, 0.0, 0.0]], distance=0.09).known.any()
        assert not core.rig.match_surface(target, ball).known.any()

    def test_normals_that_turn_away_do_not_agree(self, ball):
        """On an ellipsoid through the poles of the sphere normals differ the more the farther down."""
        points = fibonacci_sphere(1500) * [1.0, 1.0, 2.0] + [0.0, 0.0, -1.0]
        target = core.build_laplacian(points)
        narrow, wide = (core.rig.match_surface(target, ball, distance=0.5, angle=angle).known for angle in (0.2, 1.0))
        assert 0 < np.count_nonzero(narrow) < np.count_nonzero(wide) < 1500
        assert (wide | ~narrow).all()

    def test_points_beyond_an_open_end_have_no_place(self, anew):
        points = fibonacci_sphere(2000)
        half = core.build_laplacian(points[points[:, 2] > 0.0])
        match = core.rig.match_surface(anew, half, distance=0.2)
        height = anew.points[:, 2]
        assert match.known[height > 0.0].all()
        assert not match.known[height < -0.4].any()

    def test_reversed_normals_of_open_surfaces_agree(self):
        source, target = square_grid(20), np.column_stack([GIVEN.uniform(0.1, 0.9, (600, 2)), np.full(600, 0.01)])
        up = np.tile([0.0, 0.0, 1.0], (600, 1))
        for normals in (up, -up):
            match = core.rig.match_surface(core.build_laplacian(target, normals=normals), core.build_laplacian(source))
            assert match.known.all()

    def test_the_nearest_of_several_sources_counts(self, ball, anew):
        far = core.build_laplacian(1.1 * ball.points)
        match = core.rig.match_surface(anew, [far, ball], distance=0.5)
        assert (match.nearest >= 1500).all()
        values = np.repeat([1.0, 0.0], 1500)
        assert np.abs(core.rig.transfer_values(anew, match, values)).max() < 1e-12

    def test_places_among_points_without_a_value_teach_nothing(self, ball, anew):
        members = ball.points[:, 2] > 0.0
        known = core.rig.match_surface(anew, ball, members=[members]).known
        assert not known[anew.points[:, 2] < 0.0].any()
        assert known[anew.points[:, 2] > 0.2].all()


class TestSheets:
    @pytest.mark.parametrize("gap", [0.2, 0.35])  # the spacing is 0.13 and 0.16
    def test_nothing_crosses_between_nested_shells(self, gap):
        """Two socks in one object, one around the other."""
        ball = fibonacci_sphere(700)
        source = core.build_laplacian(np.concatenate([ball, (1.0 + gap) * turned(ball)]))
        target = core.build_laplacian(np.concatenate([turned(ball, 1), (1.0 + gap) * turned(ball, 2)]))
        inner = np.arange(1400) < 700
        match = core.rig.match_surface(target, source)
        assert match.known.all()
        found = core.rig.transfer_values(target, match, inner.astype(float))
        assert np.abs(found - inner).max() <= 1e-3

    @pytest.mark.parametrize("shift", [2.0, 2.05, 2.3])
    def test_nothing_crosses_where_two_shells_touch(self, shift):
        """Two socks in one object, side by side, of which a third is known."""
        ball = fibonacci_sphere(700)
        pair = np.concatenate([ball, ball + [shift, 0.0, 0.0]])
        source = core.build_laplacian(pair)
        again = np.concatenate([turned(ball, 1), turned(ball, 2) + [shift, 0.0, 0.0]])
        target = core.build_laplacian(again)
        left = np.arange(1400) < 700
        members = np.abs(pair[:, 2]) > 0.7
        match = core.rig.match_surface(target, source, members=[members])
        assert 0.1 < match.known.mean() < 0.4
        # Within about a spacing of the contact the sheets are one for any method.
        beyond = np.linalg.norm(target.points - [0.5 * shift, 0.0, 0.0], axis=1) > 0.2
        found = core.rig.transfer_values(target, match, left.astype(float))
        assert np.abs(found - left)[beyond].max() <= 1e-3
        labels = core.rig.transfer_labels(target, match, left)
        assert np.array_equal(labels[beyond], left[beyond])


class TestTransfer:
    def test_smooth_values_come_over(self, ball, anew):
        """The harmonic function x y, exact on the sphere."""
        match = core.rig.match_surface(anew, ball)
        values = np.column_stack([ball.points[:, 0] * ball.points[:, 1], np.ones(1500)])
        found = core.rig.transfer_values(anew, match, values)
        assert np.abs(found[:, 0] - anew.points[:, 0] * anew.points[:, 1]).max() < 0.01
        assert np.abs(found[:, 1] - 1.0).max() < 1e-12

    def test_a_third_of_the_points_is_enough(self, ball, anew):
        members = GIVEN.random(1500) < 0.85  # a place needs nine such neighbours
        match = core.rig.match_surface(anew, ball, members=[members])
        assert 0.1 < match.known.mean() < 0.5
        found = core.rig.transfer_values(anew, match, ball.points[:, 0])
        error = np.abs(found - anew.points[:, 0])
        assert error.mean() <= 0.01
        assert error.max() <= 0.1

    def test_values_stay_in_their_range(self, ball, anew):
        match = core.rig.match_surface(anew, ball, members=[np.abs(ball.points[:, 0]) < 0.8])
        given = (ball.points[:, 0] > 0.0).astype(float)
        found = core.rig.transfer_values(anew, match, given)
        assert found.min() >= 0.0
        assert found.max() <= 1.0

    def test_labels_are_not_averaged(self, ball, anew):
        labels = np.where(ball.points[:, 2] > 0.0, 7, -100)
        match = core.rig.match_surface(anew, ball)
        found = core.rig.transfer_labels(anew, match, labels)
        assert found.dtype == labels.dtype
        assert set(found) == {7, -100}
        sure = np.abs(anew.points[:, 2]) > 0.1
        assert np.array_equal((found == 7)[sure], (anew.points[:, 2] > 0.0)[sure])

    @pytest.mark.parametrize(
        ("settings", "text"),
        [
            ({"distance": 0.0}, "distance is"),
            ({"distance": np.nan}, "distance is"),
            ({"angle": 2.0}, "right angle"),
            ({"offsets": [1.0]}, "Offsets have"),
            ({"members": []}, "members of 0 sources"),
        ],
    )
    def test_bad_settings_are_refused(self, ball, settings, text):
        with pytest.raises(core.PointCloudError, match=text):
            core.rig.match_surface(ball, ball, **settings)

    def test_bad_input_is_refused(self, ball, anew):
        with pytest.raises(core.PointCloudError, match="no source"):
            core.rig.match_surface(ball, [])
        match = core.rig.match_surface(anew, ball)
        with pytest.raises(core.PointCloudError, match="Values have"):
            core.rig.transfer_values(anew, match, [1.0])
        with pytest.raises(core.PointCloudError, match="not finite"):
            core.rig.transfer_values(anew, match, np.full(1500, np.nan))
        with pytest.raises(core.PointCloudError, match="match is of 1000 points"):
            core.rig.transfer_values(ball, match, np.ones(1500))
        away = core.build_laplacian(anew.points + 9.0)
        with pytest.raises(core.PointCloudError, match="Move one onto the other"):
            core.rig.transfer_labels(away, core.rig.match_surface(away, ball), np.ones(1500))


class TestMix:
    BEFORE, TAKEN = np.array([[0.2, 0.3, 0.5], [1.0, 0.0, 0.0]]), np.array([[0.6, 0.4, 0.0], [0.0, 0.5, 0.5]])

    def test_replaces_or_mixes(self):
        assert np.array_equal(core.rig.mix_weights(self.BEFORE, self.TAKEN), self.TAKEN)
        assert np.array_equal(core.rig.mix_weights(self.BEFORE, self.TAKEN, mix=0.0), self.BEFORE)
        half = core.rig.mix_weights(self.BEFORE, self.TAKEN, mix=0.5)
        assert np.allclose(half, 0.5 * (self.BEFORE + self.TAKEN))

    def test_locked_columns_stay_and_the_others_fill_the_rest(self):
        found = core.rig.mix_weights(self.BEFORE, self.TAKEN, locked=[0], normalize=True)
        assert np.array_equal(found[:, 0], self.BEFORE[:, 0])
        assert np.allclose(found, [[0.2, 0.8, 0.0], [1.0, 0.0, 0.0]])

    def test_kept_columns_give_way(self):
        found = core.rig.mix_weights(self.BEFORE, self.TAKEN, kept=[1, 2], normalize=True)
        assert np.allclose(found, [[0.6, 0.4 * 0.3 / 0.8, 0.4 * 0.5 / 0.8], [0.0, 0.0, 0.0]])

    def test_sums(self):
        taken = 3.0 * GIVEN.random((50, 4))
        found = core.rig.mix_weights(np.zeros((50, 4)), taken, normalize=True)
        assert np.abs(found.sum(axis=1) - 1.0).max() < 1e-12
        assert core.rig.are_normalized(found)
        assert not core.rig.are_normalized(taken)
        assert not core.rig.are_normalized(np.zeros((3, 2)))

    @pytest.mark.parametrize(
        ("taken", "mix", "text"),
        [
            ([[1.0]], 1.0, "Weights have"),
            ([[-1.0, 0.0, 0.0]] * 2, 1.0, "2 points have negative"),
            (TAKEN, 1.5, "mix is"),
        ],
    )
    def test_bad_input_is_refused(self, taken, mix, text):
        with pytest.raises(core.PointCloudError, match=text):
            core.rig.mix_weights(self.BEFORE, taken, mix=mix)
