import functools

import numpy as np
import pytest

import core


@pytest.mark.parametrize("height", [-0.3, 0.0, 0.5])
def test_the_volume_of_a_cap_above_its_rim(operators, height):
    laplacian = operators("random sphere")
    found = core.measure.pile_volume(laplacian, laplacian.points[:, 2] > height)
    rise = 1.0 - height
    volume = np.pi * rise**2 * (3.0 - rise) / 3.0
    assert found.above == pytest.approx(volume, rel=0.03)
    assert abs(found.above - found.below - volume) < found.uncertainty < 0.15 * volume
    assert found.below < 0.01 * volume


def test_a_wave_has_as_much_above_the_plane_of_its_rim_as_below():
    """A smooth wave of one period on flat ground: 0.1 sin(2 pi u) sin(pi u)^2 sin(pi v)^2, 0.025 / pi on both sides."""
    u, v = np.meshgrid(np.linspace(-0.5, 1.5, 81), np.linspace(-0.5, 1.5, 81), indexing="ij")
    inside = (np.abs(u - 0.5) < 0.5) & (np.abs(v - 0.5) < 0.5)
    ends = np.where(inside, np.sin(np.pi * u) ** 2 * np.sin(np.pi * v) ** 2, 0.0)
    points = np.column_stack([u.ravel(), v.ravel(), (0.1 * np.sin(2.0 * np.pi * u) * ends).ravel()])
    found = core.measure.pile_volume(core.build_laplacian(points), inside.ravel())
    np.testing.assert_allclose([found.above, found.below], 0.025 / np.pi, rtol=0.03)


def test_piles_turn_and_scale(operators):
    laplacian = operators("even sphere")
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    chosen = laplacian.points[:, 0] > 0.2
    one = core.measure.pile_volume(laplacian, chosen)
    other = core.measure.pile_volume(core.build_laplacian(2.0 * laplacian.points @ turn.T), chosen)
    assert other.above == pytest.approx(8.0 * one.above, rel=1e-4)
    assert other.uncertainty == pytest.approx(8.0 * one.uncertainty, rel=1e-4)


def test_what_ends_nowhere_has_no_rim(operators):
    laplacian = operators("even sphere")
    with pytest.raises(core.InvalidPointsError, match="The part of 2500 points has 0 points at its rim"):
        core.measure.pile_volume(laplacian, np.ones(2500, dtype=bool))


@pytest.mark.parametrize("place", [-1.0, 0.5, 0.8])
def test_a_plane_that_is_chosen_has_a_sign(operators, place):
    """The cap above 0.5, against planes below it, through its rim and within it."""
    laplacian = operators("random sphere")
    cap = laplacian.points[:, 2] > 0.5
    up, down = (
        core.measure.pile_volume(laplacian, cap, plane=([3.0, 1.0, place], [0.0, 0.0, 2.0 * sign])) for sign in (1, -1)
    )
    # By the integral of pi (1 - z^2) over heights, of the whole base below the rim.
    low = max(place, 0.5)
    above = np.pi * (2.0 / 3.0 - low + low**3 / 3.0) + 0.75 * np.pi * (low - place)
    below = np.pi * (low - 0.5) * 0.75 - np.pi * ((low - low**3 / 3.0) - (0.5 - 0.125 / 3.0))
    assert (up.above, up.below) == (down.below, down.above)
    assert abs(up.above - above) < up.uncertainty
    assert abs(up.below - below) < up.uncertainty < 0.06 * (above + below)


def test_what_is_measured_against_a_plane_follows_rotation_and_scale(operators):
    laplacian = operators("even sphere")
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    chosen, place, across = laplacian.points[:, 0] > 0.2, np.array([0.1, 0.0, -0.3]), np.array([0.3, 0.1, 1.0])
    one = core.measure.pile_volume(laplacian, chosen, plane=(place, across))
    moved = core.build_laplacian(2.0 * laplacian.points @ turn.T)
    other = core.measure.pile_volume(moved, chosen, plane=(2.0 * turn @ place, turn @ across))
    assert [other.above, other.below] == pytest.approx([8.0 * one.above, 8.0 * one.below], rel=1e-4)
    assert other.uncertainty == pytest.approx(8.0 * one.uncertainty, rel=1e-3)


@pytest.mark.parametrize(
    ("members", "plane", "text"),
    [
        ([0], ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]), "normal of the plane has length 0"),
        ([0], [0.0, 0.0, 1.0], "plane is no pair"),
        ([0], 3.0, "plane is no pair"),
        ([0], ([0.0, np.nan, 0.0], [0.0, 0.0, 1.0]), "point of the plane"),
        ([], None, "None of the 2500 points"),
    ],
)
def test_what_is_no_plane_or_no_part_is_refused(operators, members, plane, text):
    with pytest.raises(core.InvalidPointsError, match=text):
        core.measure.pile_volume(operators("even sphere"), np.array(members, dtype=int), plane=plane)


def heap(count, half=1.6, seed=2):
    """Return random points of a cone of radius 1 and height 0.5 on the ground: its volume is pi / 6."""
    places = np.random.default_rng(seed).uniform(-half, half, (count, 2))
    return np.column_stack([places, np.maximum(0.5 * (1.0 - np.hypot(*places.T)), 0.0)])


@functools.cache
def heap_within(count, most):
    """The operator of the points of a heap up to so far from its axis, and which of them are the heap's."""
    points = heap(count)
    far = np.hypot(*points[:, :2].T)
    return core.build_laplacian(points[far < most]), far[far < most] < 1.05


@functools.cache
def heap_without_a_quadrant(count, ground, scale):
    """The same where a quadrant is missing, with its ground or without."""
    points = heap(count)
    far = np.hypot(*points[:, :2].T)
    kept = (points[:, :2] <= 0.0).any(axis=1) | (ground & (far >= 1.0))
    return core.build_laplacian(scale * points[kept]), far[kept] < 1.05


class TestMissingPieces:
    @pytest.mark.parametrize(("count", "scale"), [(1500, 1.0), (1500, 1000.0), (7000, 1000.0)])
    @pytest.mark.parametrize("plane", [None, ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])])
    def test_a_quadrant_is_told_unless_its_volume_is_known(self, count, plane, scale):
        """In few points a hole may be as wide as gaps between them: areas around it fill it."""
        for ground in True, False:
            found = core.measure.pile_volume(*heap_without_a_quadrant(count, ground, scale), plane=plane)
            known = abs(found.above - found.below - scale**3 * np.pi / 6.0) < found.uncertainty
            told = [notice.startswith("The surface ends within the part along ") for notice in found.notices]
            assert told == [True] or (known and count < 2000)

    @pytest.mark.parametrize("count", [1500, 7000])
    @pytest.mark.parametrize("plane", [None, ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])])
    def test_whole_heaps_are_not_told_of_with_ground_and_without(self, count, plane):
        for most in 9.0, 1.0:
            found = core.measure.pile_volume(*heap_within(count, most), plane=plane)
            assert found.notices == []
            assert found.above - found.below == pytest.approx(np.pi / 6.0, rel=0.02, abs=found.uncertainty)


class TestHeights:
    up = ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0])

    def over(self, laplacian, ground):
        normals = np.tile(self.up[1], (len(laplacian.points), 1))
        found = core.measure.surface_deviation(ground, laplacian.surface_points, normals)
        return np.where(found.known, found.distance, np.nan)

    def test_fill_and_cut_between_two_surveys(self):
        """A heap that was put beside a pit of the same form, on ground that slopes."""
        count = 4000
        before, after = heap(count, 3.0, 1), heap(count, 3.0, 5)
        for points, sign, x in (before, -1.0, 1.2), (after, 1.0, -1.2):
            high = np.maximum(0.5 * (1.0 - np.hypot(points[:, 0] - x, points[:, 1])), 0.0)
            points[:, 2] = sign * high + 0.2 * points[:, 0] + 0.1 * points[:, 1]
        before, after, all_ = core.build_laplacian(before), core.build_laplacian(after), np.ones(count, dtype=bool)
        found = core.measure.pile_volume(after, all_, plane=self.up, heights=self.over(after, before))
        assert found.above == pytest.approx(np.pi / 3.0, rel=0.03)
        assert found.below < 0.01
        found = core.measure.pile_volume(before, all_, plane=self.up, heights=self.over(before, after))
        assert found.below == pytest.approx(np.pi / 3.0, rel=0.03)
        assert found.above < 0.01

    def test_over_a_flat_cloud_it_is_that_over_a_plane(self):
        laplacian, _ = heap_within(3000, 9.0)
        heights = self.over(laplacian, core.build_laplacian(heap(3000, 2.0, 9) * [1.0, 1.0, 0.0]))
        within = np.hypot(*laplacian.points[:, :2].T) < 1.2
        one = core.measure.pile_volume(laplacian, within, plane=self.up)
        other = core.measure.pile_volume(laplacian, within, plane=self.up, heights=heights)
        assert [other.above, other.below] == pytest.approx([one.above, one.below], abs=1e-6)

    def test_what_has_nothing_below_is_told(self):
        laplacian, _ = heap_within(3000, 9.0)
        ground = core.build_laplacian((heap(3000, 2.0, 9) + [2.0, 0.0, 0.0]) * [1.0, 1.0, 0.0])
        heights = self.over(laplacian, ground)
        found = core.measure.pile_volume(laplacian, np.ones(3000, dtype=bool), plane=self.up, heights=heights)
        assert found.above == pytest.approx(np.pi / 12.0, rel=0.05)
        assert any("have nothing of the other surface above or below" in notice for notice in found.notices)
        with pytest.raises(core.InvalidPointsError, match="None of the 3000 points"):
            core.measure.pile_volume(laplacian, np.ones(3000, dtype=bool), plane=self.up, heights=np.full(3000, np.nan))

    def test_heights_that_cannot_be_used_are_refused(self, operators):
        laplacian = operators("even sphere")
        cap = laplacian.points[:, 2] > 0.5
        with pytest.raises(core.InvalidPointsError, match="no plane whose normal they are along"):
            core.measure.pile_volume(laplacian, cap, heights=np.zeros(2500))
        with pytest.raises(core.InvalidPointsError, match="one real number for each of 2500 points"):
            core.measure.pile_volume(laplacian, cap, plane=self.up, heights=np.zeros(3))
