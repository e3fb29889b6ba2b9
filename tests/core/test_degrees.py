"""Each axis keeps the digits that it needs: degrees beside heights in metres, and thin things far from the origin."""

import numpy as np
import pytest

from core.files import PointTable, choose_origin, is_coarse, read_points, write_points

SHARE = np.random.default_rng(0).random((500, 3))
DEGREES = np.array([-94.683, 31.037, 39.0]) + SHARE * [0.0228, 0.0106, 39.0]


def error(points, origin):
    """Largest difference along each axis after the way through single precision."""
    return np.abs((points - origin).astype(np.float32) + origin - points).max(axis=0)


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 0, 2]])
def test_degrees_in_either_order(order):
    points = DEGREES[:, order]
    origin = choose_origin(points)
    assert error(points, origin)[:2].max() < 1e-8  # a millimetre
    assert origin[2] == 0.0  # heights do well without
    assert is_coarse(points)
    assert not is_coarse(points - origin)


def test_degrees_that_are_known_but_do_not_look_like_it():
    points = np.array([-95.0, 30.0, 0.0]) + SHARE * [2.0, 2.0, 5.0]
    assert not choose_origin(points).any()
    assert error(points, choose_origin(points, degrees=True))[:2].max() < 1e-7


def test_tiles_in_degrees_share_an_origin():
    origin = choose_origin(DEGREES)
    assert choose_origin(DEGREES + [0.02, 0.0, 0.0], origin).tolist() == origin.tolist()
    assert error(DEGREES + [0.02, 0.0, 0.0], origin)[:2].max() < 1e-8
    far = choose_origin(DEGREES + [40.0, 0.0, 0.0], origin)
    assert error(DEGREES + [40.0, 0.0, 0.0], far)[:2].max() < 1e-8
    survey = np.array([446_120.0, 4_000_460.0, 80.0])
    assert choose_origin(DEGREES, survey).tolist() == origin.tolist()


def test_one_axis_of_another_unit():
    points = np.array([0.0, 0.0, 1.7e5]) + SHARE * [1e5, 1e5, 0.2]  # hours of a day, say
    origin = choose_origin(points)
    assert error(points, origin)[2] < 1e-7


def test_things_near_the_origin_stay_where_they_are():
    for points in (
        SHARE * [10.0, 10.0, 0.05] + [0.0, 0.0, 5.0],  # a floor
        SHARE * [0.2, 0.2, 10.0] + [20.0, 30.0, 0.0],  # a pole
        SHARE * [10.0, 10.0, 0.0] + [0.0, 0.0, 1.0 / 3.0],  # a plane
        SHARE * [10.0, 10.0, 1e-15] + [0.0, 0.0, 1.0 / 3.0],  # and one that was computed
        SHARE * [360.0, 180.0, 3000.0] - [180.0, 90.0, 0.0],  # the whole earth
        DEGREES.astype(np.float32) * [0.0, 1.0, 1.0],
    ):
        assert not choose_origin(points).any()


def test_degrees_are_told(tmp_path):
    np.savetxt(tmp_path / "a.xyz", DEGREES, "%.9f")
    notices = read_points(tmp_path / "a.xyz").notices
    assert len(notices) == 1
    assert "look like degrees" in notices[0]


def test_degrees_of_single_precision_are_told(tmp_path):
    write_points(tmp_path / "a.ply", PointTable(DEGREES), double=False)
    notices = read_points(tmp_path / "a.ply").notices
    assert any("kept in single precision" in notice for notice in notices)
