"""Depth cameras whose steps of depth are about as large as their pixels: no strays, and areas within what is told."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import core
from benchmarks.surveys import in_order, survey
from core.geometry import find_nearest
from core.geometry.rounding import find_rounding, smooth_rounded

_TURNED = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
_DISTANCE, _RADIUS = 0.6, 0.04


def _seen(depth, rays, step, noise, seed=0):
    """Return places along rays at depths with noise, rounded to steps, in coordinates turned against the camera."""
    depth = depth + np.random.default_rng(seed).normal(0.0, noise, len(depth))
    return rays * (np.round(depth / step) * step if step else depth)[:, None] @ _TURNED.T


def _rays(focal):
    u, v = np.meshgrid(np.arange(-160, 160) / focal, np.arange(-120, 120) / focal)
    return np.column_stack([u.ravel(), v.ravel(), np.ones(u.size)])


def _sheet(tilt, step=1e-3, noise=3.6e-4, focal=600.0, width=0.07):
    """Return what a camera sees of a sheet 0.7 times as high as wide, turned about the vertical axis by degrees."""
    rays, turned = _rays(focal), np.radians(tilt)
    normal, along = np.array([np.sin(turned), 0.0, -np.cos(turned)]), np.array([np.cos(turned), 0.0, np.sin(turned)])
    depth = -np.cos(turned) * _DISTANCE / (rays @ normal)
    places = rays * depth[:, None] - [0.0, 0.0, _DISTANCE]
    inside = (np.abs(places @ along) < 0.5 * width) & (np.abs(places[:, 1]) < 0.35 * width)
    return _seen(depth[inside], rays[inside], step, noise)


def _ball(step):
    """Return what it sees of a ball of 40 mm, up to 45 degrees from the middle."""
    rays = _rays(600.0)
    middle, square = _DISTANCE, np.sum(rays**2, axis=1)
    root = middle**2 - square * (middle**2 - _RADIUS**2)
    seen = root > 0.0
    depth = (middle - np.sqrt(root[seen])) / square[seen]
    inside = np.linalg.norm(rays[seen, :2] * depth[:, None], axis=1) < np.sqrt(0.5) * _RADIUS
    return _seen(depth[inside], rays[seen][inside], step, 3.6e-4)


@pytest.mark.parametrize(
    ("tilt", "step", "noise", "focal", "width"),
    [
        (0.0, 1e-3, 3.6e-4, 600.0, 0.07),
        (2.0, 1e-3, 3.6e-4, 600.0, 0.07),
        (10.0, 1e-3, 3.6e-4, 600.0, 0.07),
        (40.0, 1e-3, 3.6e-4, 600.0, 0.07),
        (5.0, 2e-3, 3.6e-4, 600.0, 0.07),
        (5.0, 5e-4, 3.6e-4, 600.0, 0.07),
        (5.0, 1e-3, 7e-4, 600.0, 0.1),  # smaller, their rims are more of them
        (2.0, 1.5e-3, 3e-4, 400.0, 0.1),
    ],
)
def test_sheets_by_depth_cameras_keep_their_points_and_area(tilt, step, noise, focal, width):
    points, area = _sheet(tilt, step, noise, focal, width), 0.7 * width**2
    laplacian = core.build_laplacian(points)
    parts = core.measure.measure_parts(laplacian)
    assert core.clean.stray_points(points).mean() <= 0.01
    assert (laplacian.component < 0).mean() <= 0.01
    assert abs(parts.areas.sum() - area) <= parts.area_uncertainties.sum()
    assert parts.area_uncertainties.sum() < 0.09 * area
    assert any("Depth is rounded in steps" in text for text in laplacian.notices)


@pytest.mark.parametrize("step", [1e-3, 2e-3])
def test_a_ball_by_a_depth_camera_keeps_its_points_and_area(step):
    points = _ball(step)
    laplacian = core.build_laplacian(points)
    parts = core.measure.measure_parts(laplacian)
    true = 2.0 * np.pi * _RADIUS**2 * (1.0 - np.sqrt(0.5))
    assert core.clean.stray_points(points).mean() <= 0.01
    assert abs(parts.areas.sum() - true) <= parts.area_uncertainties.sum()


def test_the_direction_is_that_of_the_camera():
    found = find_rounding(cKDTree(_sheet(10.0)))
    length = np.linalg.norm(found)
    assert abs(found @ _TURNED[:, 2]) > (1.0 - 1e-6) * length
    assert abs(length - 0.9) < 0.1


def test_points_are_moved_along_the_direction_to_where_the_sheet_is():
    points, normal = _sheet(5.0), _TURNED @ [np.sin(np.radians(5.0)), 0.0, -np.cos(np.radians(5.0))]
    moved = smooth_rounded(find_nearest(points)).nearest.points
    before, after = ((places - _TURNED @ [0.0, 0.0, _DISTANCE]) @ normal for places in (points, moved))
    assert np.linalg.norm(after) < 0.35 * np.linalg.norm(before)
    assert np.abs(np.cross(moved - points, _TURNED[:, 2])).max() < 1e-9


def test_points_far_off_stay_strays():
    points = _sheet(2.0)
    chosen = np.arange(100, len(points), 400)
    points[chosen] += 6e-3 * _TURNED[:, 2]
    assert core.clean.stray_points(points)[chosen].mean() > 0.95


def test_points_that_noise_lifts_by_one_step_only_now_and_then_are_no_strays():
    points = _sheet(0.0, noise=2e-4)
    assert core.clean.stray_points(points).mean() <= 0.001


def test_tiles_agree_on_the_direction(tmp_path):
    """Those on which all points are on one level, too, which alone would not be known to be rounded."""
    points, level = _sheet(0.0), _sheet(0.0, noise=0.0)
    quiet = level @ _TURNED[:, 0] < -0.003
    points[quiet] = level[quiet]
    whole = core.build_laplacian(points)
    rounded = survey(tmp_path / "narrow", points, 8, 5.0, until="spacing")
    parts = [rounded.part(number).points for number in range(rounded.count)]
    assert not all(find_rounding(cKDTree(part)).any() for part in parts)
    assert abs(rounded.record["rounded"] @ _TURNED[:, 2]) > 0.8
    store = survey(tmp_path / "wide", points, 4)
    core.tiles.run_steps(store)
    areas = in_order(store, "areas")
    assert abs(areas.sum() / whole.areas.sum() - 1.0) < 5e-5
    np.testing.assert_allclose(areas, whole.areas, rtol=0.0, atol=5e-3 * whole.areas.max())


def _grid(size):
    return np.stack(np.meshgrid(np.arange(size), np.arange(size)), axis=-1).reshape(-1, 2).astype(float)


@pytest.mark.parametrize(
    "points",
    [
        np.column_stack([_grid(60), np.floor(_grid(60)[:, 0] / 10.0)]),
        np.column_stack([_grid(60), np.zeros(3600)]),
        np.column_stack([np.tile(_grid(60), (2, 1)), np.repeat([0.0, 1.2], 3600)]),
        np.column_stack([np.random.default_rng(0).uniform(0.0, 60.0, (7200, 2)), np.repeat([0.0, 1.0], 3600)]),
        _sheet(5.0, 0.0),
        core.example_sphere(),
    ],
    ids=["stairs", "sheet", "two grids", "two random sheets", "not rounded", "sphere"],
)
def test_what_is_not_rounded_stays_as_it_is(points):
    smoothed = smooth_rounded(find_nearest(points))
    assert smoothed.step == 0.0
    assert np.array_equal(smoothed.nearest.points, points)
