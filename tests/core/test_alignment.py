"""Clouds moved onto each other, against motions that are known."""

import numpy as np
import pytest

import core
from benchmarks.alignment import aligned, case, errors, turned
from benchmarks.samplings import fibonacci_sphere, random_sphere, square_random
from core.measure import alignment

SPACING = 0.08  # of 1,500 points


def blob(directions):
    """Points of an ellipsoid with bumps, which no motion maps onto itself."""
    x, y, z = directions.T
    radius = 1.0 + 0.15 * np.sin(3.0 * x + 1.0) * np.cos(2.0 * y) + 0.1 * np.sin(4.0 * z + 2.0 * x)
    return radius[:, None] * directions * [1.0, 0.8, 0.65]


def motion(degrees=10.0, shift=(0.1, -0.15, 0.05), size=1.0):
    matrix = np.eye(4)
    matrix[:3, :3] = size * turned(np.array([2.0, 1.0, -2.0]) / 3.0, np.radians(degrees))
    matrix[:3, 3] = shift
    return matrix


def moved(matrix, points):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def angle(matrix):
    linear = matrix[:3, :3] / np.cbrt(np.linalg.det(matrix[:3, :3]))
    return np.degrees(2.0 * np.arcsin(np.linalg.norm(linear - np.eye(3)) / np.sqrt(8.0)))


@pytest.fixture(scope="module")
def clouds():
    """Two samples of one surface that share no point."""
    return blob(fibonacci_sphere(1500)), blob(random_sphere(1500, 3))


def test_a_cloud_is_on_itself(clouds):
    found = core.measure.align(clouds[0], clouds[0])
    assert found.converged
    assert (found.reason, found.notices) == ("", [])
    assert found.overlap == 1.0
    np.testing.assert_allclose(found.matrix, np.eye(4), atol=1e-9)
    np.testing.assert_allclose(found.residual, 0.0, atol=1e-4)


def test_a_copy_is_brought_back_exactly(clouds):
    found = core.measure.align(moved(motion(), clouds[0]), clouds[0])
    assert found.converged
    np.testing.assert_allclose(found.matrix @ motion(), np.eye(4), atol=1e-6)


def test_another_sample_is_brought_back(clouds):
    found = core.measure.align(moved(motion(), clouds[1]), clouds[0])
    assert found.converged
    np.testing.assert_allclose(found.matrix[:3, :3] @ found.matrix[:3, :3].T, np.eye(3), atol=1e-9)
    off = moved(found.matrix @ motion(), clouds[1]) - clouds[1]
    assert np.linalg.norm(off, axis=1).max() < 0.02 * SPACING
    assert np.median(found.residual) < 0.02 * SPACING


def test_parts_with_noise_and_outliers():
    rng = np.random.default_rng(8)
    first, second = (blob(random_sphere(4000, seed)) for seed in (1, 2))
    spacing = SPACING * np.sqrt(1500 / 4000)
    parts = [first[first[:, 0] < 0.35], second[second[:, 0] > -0.35]]
    parts = [
        np.concatenate([part + 0.1 * spacing * rng.standard_normal(part.shape), rng.uniform(-1.2, 1.2, (60, 3))])
        for part in parts
    ]
    found = core.measure.align(moved(motion(), parts[0]), parts[1])
    assert found.converged
    assert 0.4 < found.overlap < 0.7
    assert angle(found.matrix @ motion()) < 0.5
    assert np.linalg.norm(moved(found.matrix @ motion(), parts[0]) - parts[0], axis=1).mean() < 0.2 * spacing


def test_the_motion_composes_with_those_of_either_cloud(clouds):
    before, after = motion(3.0, (5.0, 0.0, -2.0)), motion(40.0, (-7.0, 2.0, 1.0))
    plain = core.measure.align(clouds[1], clouds[0])
    found = core.measure.align(moved(before, clouds[1]), moved(after, clouds[0]), start=after @ np.linalg.inv(before))
    np.testing.assert_allclose(found.matrix @ before, after @ plain.matrix, atol=2e-2 * SPACING)


def test_the_order_of_the_points_makes_no_difference(clouds):
    rng, points = np.random.default_rng(0), moved(motion(), clouds[1])
    order = rng.permutation(len(points))
    first = core.measure.align(points, clouds[0])
    second = core.measure.align(points[order], clouds[0][rng.permutation(len(clouds[0]))])
    np.testing.assert_allclose(second.matrix, first.matrix, atol=1e-9)
    np.testing.assert_allclose(second.residual, first.residual[order], atol=1e-9)


@pytest.mark.parametrize("size", [1e-4, 1e5])
def test_lengths_scale_with_the_unit(clouds, size):
    points = moved(motion(), clouds[1])
    plain, scaled = core.measure.align(points, clouds[0]), core.measure.align(size * points, size * clouds[0])
    np.testing.assert_allclose(scaled.matrix[:3, :3], plain.matrix[:3, :3], atol=1e-6)
    np.testing.assert_allclose(scaled.matrix[:3, 3], size * plain.matrix[:3, 3], atol=1e-6 * size)
    np.testing.assert_allclose(scaled.residual, size * plain.residual, atol=1e-4 * SPACING * size)


def test_far_from_the_origin(clouds):
    far = np.array([4e6, -5e5, 100.0])
    found = core.measure.align(moved(motion(), clouds[1]) + far, clouds[0] + far)
    assert found.converged
    back = moved(found.matrix, moved(motion(), clouds[1]) + far) - far
    assert np.linalg.norm(back - clouds[1], axis=1).max() < 0.03 * SPACING


@pytest.mark.parametrize("size", [0.85, 1.2])
def test_one_scale_factor(clouds, size):
    points = moved(motion(size=size), clouds[1])
    found = core.measure.align(points, clouds[0], scale=True)
    assert found.converged
    assert np.cbrt(np.linalg.det(found.matrix[:3, :3])) * size == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    "cloud",
    [
        lambda seed: random_sphere(1500, seed),
        lambda seed: square_random(1500, seed),
        lambda seed: random_sphere(1500, seed) * [1.0, 1.0, 2.0],
    ],
    ids=["sphere", "plane", "spheroid"],
)
def test_surfaces_that_slide_on_themselves_are_told(cloud):
    found = core.measure.align(cloud(0), cloud(1))
    assert not found.converged
    assert "slide" in found.reason


def test_another_surface_is_told(clouds):
    found = core.measure.align(clouds[0][::3], clouds[0][::3, ::-1] * [1.0, -2.0, 0.3])
    assert not found.converged
    assert "of the points lie on the target's surface" in found.reason


def test_the_residual_is_the_distance_from_the_surface(clouds):
    """Points of a plane with a hill, lifted by known heights, and one beside the plane."""
    square = square_random(3000, 4)

    def hill(points):
        x, y = points[:, 0], points[:, 1]
        return np.column_stack([x, y, 0.15 * np.sin(5.0 * x) * np.sin(4.0 * y + 1.0) + 0.1 * x * y])

    target = hill(square)
    normals = core.estimate_normals(target)
    lifted = np.flatnonzero(np.abs(square[:, :2] - 0.5).max(axis=1) < 0.4)[::40]
    extra = np.concatenate([target[lifted] + 0.1 * normals[lifted], [[1.5, 0.5, target[:, 2].mean()]]])
    found = core.measure.align(np.concatenate([hill(square_random(3000, 5)), extra]), target)
    assert found.converged
    np.testing.assert_allclose(found.residual[3000:-1], 0.1, rtol=0.1)
    assert found.residual[-1] == pytest.approx(0.5, abs=0.1)
    assert np.median(found.residual[:3000]) < 1e-3


def test_a_start_that_is_far_is_needed_and_enough(clouds):
    far = np.diag([1.0, -1.0, -1.0, 1.0])
    far[:3, 3] = 3.0, 1.0, -2.0
    points = moved(far, clouds[1])
    assert not core.measure.align(points[::3], clouds[0][::3]).converged
    places = [7, 400, 900, 1300]
    start = core.measure.match_places(points[places], clouds[1][places] + 0.03)
    found = core.measure.align(points, clouds[0], start=start)
    assert found.converged
    np.testing.assert_allclose(found.matrix @ far, np.eye(4), atol=0.02 * SPACING)


@pytest.mark.parametrize("count", [3, 4])
def test_pairs_in_any_order(clouds, count):
    far = np.diag([1.0, -1.0, -1.0, 1.0])
    far[:3, 3] = 3.0, 1.0, -2.0
    points = moved(far, clouds[1])
    rows = np.array([7, 400, 900, 1300])[:count]
    roughly = 0.05 * np.random.default_rng(1).standard_normal((count, 3))
    found = core.measure.align(points, clouds[0], pairs=(points[rows], np.roll(clouds[1][rows] + roughly, 1, axis=0)))
    assert found.converged
    np.testing.assert_allclose(found.matrix @ far, np.eye(4), atol=0.02 * SPACING)


def test_pairs_whose_distances_do_not_tell_the_order(clouds):
    """Three places at equal distances: six ways, of which one fits."""
    far = np.diag([-1.0, -1.0, 1.0, 1.0])
    points = moved(far, clouds[1])
    rows = [np.argmax(clouds[1] @ turned(np.array([0.0, 0.0, 1.0]), angle)[0]) for angle in (0.0, 2.1, 4.2)]
    middle = clouds[1][rows].mean(axis=0)
    places = middle + np.array([[1.0, 0.0, 0.0], [-0.5, np.sqrt(0.75), 0.0], [-0.5, -np.sqrt(0.75), 0.0]]) * 0.7
    for shift in range(3):
        found = core.measure.align(points, clouds[0], pairs=(moved(far, places), np.roll(places, shift, axis=0)))
        assert found.converged
        np.testing.assert_allclose(found.matrix @ far, np.eye(4), atol=0.02 * SPACING)


@pytest.mark.parametrize(("here", "there"), [(2, 2), (3, 4), (6, 6), (0, 0)])
def test_wrong_numbers_of_places(clouds, here, there):
    with pytest.raises(core.InvalidPointsError, match=f"{here} places are given on the points and {there} on the"):
        core.measure.align(*clouds, pairs=(clouds[0][:here], clouds[1][:there]))


def test_further_starts_are_tried_where_the_first_fails(clouds, monkeypatch):
    points, calls = moved(motion(), clouds[1]), []
    whole = alignment._Search.judge

    def counted(self, matrix, moved):
        calls.append(matrix)
        found = whole(self, matrix, moved)
        return found if len(calls) == 4 else found._replace(fits=len(calls) == 3, agreeing=0.3)

    monkeypatch.setattr(alignment._Search, "judge", counted)
    found = core.measure.align(points, clouds[0])
    assert found.converged
    assert found.fits
    assert len(calls) == 13  # the third fits, and the fourth better
    np.testing.assert_allclose(found.matrix @ motion(), np.eye(4), atol=0.02 * SPACING)


def test_of_many_points_a_sample_is_aligned(clouds, monkeypatch):
    monkeypatch.setattr(alignment, "_MOST", 800)
    found = core.measure.align(moved(motion(), clouds[1]), clouds[0])
    assert found.converged
    assert len(found.residual) == len(clouds[1])
    assert "more than 800 points" in found.notices[0]
    assert np.linalg.norm(moved(found.matrix @ motion(), clouds[1]) - clouds[1], axis=1).max() < 0.1 * SPACING


def test_what_is_beyond_the_overlap_has_no_say(clouds):
    """A ball beside the target is a third of the points."""
    points = np.concatenate([moved(motion(), clouds[1]), fibonacci_sphere(700) * 0.4 + [1.2, 0.0, 0.0]])
    found = core.measure.align(points, clouds[0], overlap=0.65)
    assert found.converged
    off = moved(found.matrix @ motion(), clouds[1]) - clouds[1]
    assert np.linalg.norm(off, axis=1).max() < 0.05 * SPACING


def test_it_can_be_cancelled(clouds):
    def stop(stage, fraction):
        assert stage == "Alignment"
        if fraction >= 0.5:
            raise core.Cancelled

    with pytest.raises(core.Cancelled):
        core.measure.align(clouds[0], clouds[1], progress=stop)


@pytest.mark.parametrize(
    ("points", "error", "text"),
    [
        (np.eye(3)[:2], core.TooFewPointsError, "In the points: .* needs at least 7 different points, and there are 2"),
        (np.full((40, 3), np.nan), core.InvalidPointsError, "In the points: 40 of 40 points are not finite"),
        (np.zeros((40, 2)), core.InvalidPointsError, r"In the points: .*shape \(n, 3\)"),
        (np.linspace(0, 1, 40)[:, None] * [1.0, 2.0, 3.0], core.NotASurfaceError, "In the points: .*straight line"),
    ],
)
def test_points_without_a_surface(clouds, points, error, text):
    with pytest.raises(error, match=text):
        core.measure.align(points, clouds[0])


def test_a_target_without_a_surface_is_named(clouds):
    with pytest.raises(core.TooFewPointsError, match="In the target"):
        core.measure.align(clouds[0], np.eye(3))
    with pytest.raises(core.InvalidPointsError, match="In the target: 1 of 1500 points are not finite"):
        core.measure.align(clouds[0], np.where(np.arange(1500)[:, None] == 7, np.inf, clouds[1]))


@pytest.mark.parametrize("overlap", [0.0, -1.0, 1.5, np.nan, "half"])
def test_wrong_overlap(clouds, overlap):
    with pytest.raises(core.PointCloudError, match="overlap is"):
        core.measure.align(*clouds, overlap=overlap)


@pytest.mark.parametrize(
    "start",
    [
        np.eye(3),
        np.full((4, 4), np.nan),
        np.diag([1.0, 1.0, -1.0, 1.0]),
        np.diag([1.0, 2.0, 1.0, 1.0]),
        np.zeros((4, 4)),
    ],
)
def test_wrong_start(clouds, start):
    with pytest.raises(core.InvalidPointsError, match=r"[Ss]tart"):
        core.measure.align(*clouds, start=start)


def test_wrong_switch(clouds):
    with pytest.raises(core.PointCloudError, match="Option scale"):
        core.measure.align(*clouds, scale="yes")


@pytest.mark.parametrize("size", [1.0, 2.5])
def test_pairs_of_places_give_the_motion(size):
    places = np.random.default_rng(2).standard_normal((3, 3))
    wanted = motion(100.0, (4.0, 5.0, 6.0), size)
    found = core.measure.match_places(places, moved(wanted, places), scale=size != 1.0)
    np.testing.assert_allclose(found, wanted, atol=1e-6)


def test_pairs_are_matched_by_least_squares_without_mirroring():
    rng = np.random.default_rng(3)
    places = rng.standard_normal((6, 3))
    others = places * [1.0, 1.0, -1.0] + 0.1 * rng.standard_normal((6, 3))
    best = core.measure.match_places(places, others)
    assert np.linalg.det(best[:3, :3]) == pytest.approx(1.0)
    least = np.sum((moved(best, places) - others) ** 2)
    for axis in np.eye(3):
        nudged = best.copy()
        nudged[:3, :3] = turned(axis, 0.01) @ best[:3, :3]
        nudged[:3, 3] = others.mean(axis=0) - nudged[:3, :3] @ places.mean(axis=0)
        assert np.sum((moved(nudged, places) - others) ** 2) > least


@pytest.mark.parametrize(
    ("places", "others", "text"),
    [
        (np.eye(3)[:2], np.eye(3)[:2], "2 pairs of places do not determine"),
        (np.zeros((0, 3)), np.zeros((0, 3)), "0 pairs of places do not determine"),
        (np.arange(9.0).reshape(3, 3), np.eye(3), "not on one line"),
        (np.eye(3), np.arange(9.0).reshape(3, 3), "not on one line"),
        (np.eye(3), np.eye(4, 3), "3 rows of 3"),
        (np.eye(3), np.full((3, 3), np.inf), "not finite"),
    ],
)
def test_wrong_pairs(places, others, text):
    with pytest.raises(core.InvalidPointsError, match=text):
        core.measure.match_places(places, others)


def test_the_cases_of_the_benchmark_are_what_it_says():
    """On the mesh of a pyramid: how far off, what is shared, and what counts as aligned."""
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.4, 0.5, 0.8]])
    faces = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    made = case(vertices, faces, 3, count=3000)
    assert errors(made.matrix, made) == (0.0, 0.0)
    assert aligned(made.matrix, made)
    degrees, spacings = errors(np.eye(4), made)
    assert degrees == pytest.approx(10.0)
    assert spacings * made.spacing > 0.05
    assert not aligned(np.eye(4), made)
    back = moved(made.matrix, made.points)
    far = np.array(
        [np.partition(np.linalg.norm(made.target - place, axis=1), 0)[0] for place in back[:: len(back) // 300]]
    )
    assert np.mean(far < 1.5 * made.spacing) == pytest.approx(0.6, abs=0.1)
