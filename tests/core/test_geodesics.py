import weakref

import numpy as np
import pytest

import core
from benchmarks.samplings import disc_random, fibonacci_sphere, grid_points


def on_sphere(points, sources):
    return np.arccos(np.clip(points @ points[sources].T, -1.0, 1.0)).min(axis=1)


def mean_error(found, exact):
    return np.abs(found - exact).mean() / exact.mean()


@pytest.mark.parametrize("name", ["even sphere", "random sphere", "marching cubes", "density jump"])
@pytest.mark.parametrize("sources", [[5], [0, 500, 1000, 1500, 2000]], ids=["one", "five"])
def test_great_circles(operators, name, sources):
    laplacian = operators(name)
    exact = on_sphere(laplacian.points, sources)
    found = core.distance.geodesic_distance(laplacian, sources)
    assert mean_error(found, exact) < 2e-3
    assert np.abs(found - exact).max() < 2.5e-2  # next to single points where they are few
    np.testing.assert_array_equal(found[sources], 0.0)


def test_meridians_of_the_torus(operators):
    laplacian = operators("fine torus")
    points = laplacian.points
    radius = np.hypot(points[:, 0], points[:, 1])
    theta, phi = np.arctan2(points[:, 2], radius - 1.0), np.arctan2(points[:, 1], points[:, 0])
    source = int(np.argmin(np.hypot(theta, phi)))
    apart = np.abs(np.angle(np.exp(1j * (phi - phi[source]))))
    # Meridians are shortest ways; next to them the distance differs by second order only.
    meridian = (apart < 0.02) & (np.abs(theta) > 0.5)
    assert np.count_nonzero(meridian) > 20
    exact = 0.4 * np.abs(theta - theta[source])
    np.testing.assert_allclose(
        core.distance.geodesic_distance(laplacian, [source])[meridian], exact[meridian], rtol=1e-2
    )


@pytest.mark.parametrize("sources", [[0], [1770], [0, 59, 1770]], ids=["corner", "middle", "several"])
def test_flat_square_with_its_boundary(operators, sources):
    laplacian = operators("square grid")
    points = laplacian.points
    found = core.distance.geodesic_distance(laplacian, sources)
    exact = np.linalg.norm(points[:, None] - points[None, sources], axis=2).min(axis=1)
    assert mean_error(found, exact) < 1e-3
    assert np.all(found >= exact - 0.5 / 59)  # half a spacing, where the fronts of several sources meet


def scan_lines(across, jitter, along=None, lines=16, seed=0):
    """Points one apart along lines that are some apart, each moved by a share of the spacing, in the plane."""
    along = along or max(60, 12 * across)
    x, y = (part.ravel() for part in np.meshgrid(np.arange(along), across * np.arange(lines), indexing="ij"))
    points = np.column_stack([x, y, np.zeros(len(x))]).astype(float)
    points[:, :2] += jitter * np.random.default_rng(seed).normal(size=(len(x), 2))
    return points, {"corner": 0, "side": along // 2 * lines, "end": lines // 2, "inside": (along // 2) * lines + 7}


@pytest.mark.parametrize(("jitter", "noise"), [(0.0, 0.0), (0.1, 0.0), (0.0, 0.05)])
@pytest.mark.parametrize("across", [1, 3, 5, 8, 12])
def test_scan_lines(across, jitter, noise):
    points, sources = scan_lines(across, jitter, lines=12)
    points[:, 2] = noise * np.random.default_rng(2).normal(size=len(points))
    points = points @ np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0] + [3e5, 5e6, 200.0]
    laplacian = core.build_laplacian(points)
    for source in sources.values():
        exact = np.linalg.norm(points - points[source], axis=1)
        far = exact > 0.999 * across
        found = core.distance.geodesic_distance(laplacian, [source])
        assert np.mean(np.abs(found / np.maximum(exact, 1e-300) - 1.0)[far]) < 2e-3
        assert np.abs(found - exact)[far].max() < 0.15 * across
        at = core.distance.logarithmic_map(laplacian, source)
        chords = np.linalg.norm(at - at[[sources["inside"]]], axis=1)  # a flat surface is mapped as it is
        away = np.linalg.norm(points - points[sources["inside"]], axis=1)
        assert np.mean(np.abs(chords - away)[far] / exact[far]) < 1e-2
        assert np.max(np.abs(chords - away)[far] / exact[far]) < 0.15


@pytest.mark.parametrize("across", [3, 8])
def test_cells_and_sides_on_scan_lines(across):
    points, sources = scan_lines(across, 0.1)
    laplacian = core.build_laplacian(points)
    index = list(sources.values())
    apart = np.linalg.norm(points[:, None] - points[None, index], axis=2)
    label = core.distance.nearest_source(laplacian, index)
    assert np.all(apart[np.arange(len(points)), label] < 1.01 * apart.min(axis=1) + 0.5)
    first, last = sources["side"], sources["side"] + 15
    way = (points[last] - points[first]) / np.linalg.norm(points[last] - points[first])
    exact = np.cross(way, points - points[first])[:, 2] * np.sign(laplacian.normals[0, 2])
    found = core.distance.signed_distance(laplacian, [first, last])
    far = np.abs(exact) > across
    assert np.mean(np.abs(found - exact)[far] / np.abs(exact[far])) < 2e-2
    assert np.max(np.abs(found - exact)[far] / np.abs(exact[far])) < 0.15


@pytest.mark.parametrize("lines", [8, 20])
def test_circles_of_latitude(lines):
    """Ten times and four times as many points along as across."""
    rise, turn = np.meshgrid((np.arange(lines) + 0.5) * np.pi / lines, np.arange(160) * np.pi / 80, indexing="ij")
    points = np.stack([np.sin(rise) * np.cos(turn), np.sin(rise) * np.sin(turn), np.cos(rise)], axis=2).reshape(-1, 3)
    source = len(points) // 2 + 17
    exact = on_sphere(points, [source])
    found = core.distance.geodesic_distance(core.build_laplacian(points), [source])
    assert mean_error(found, exact) < 8e-3


def test_rings_whose_gaps_grow_with_the_range():
    radius, turn = np.meshgrid(4.0 * 1.1 ** np.arange(14), np.arange(160) * np.pi / 80, indexing="ij")
    points = np.column_stack([part.ravel() for part in (radius * np.cos(turn), radius * np.sin(turn), 0.0 * turn)])
    source = 160 * 7
    exact = np.linalg.norm(points - points[source], axis=1)
    seen = (points @ points[source] > 0.0) & (exact > 0.8)  # the way to others leads around the scanner
    found = core.distance.geodesic_distance(core.build_laplacian(points), [source])
    np.testing.assert_allclose(found[seen], exact[seen], rtol=0.15)
    assert mean_error(found[seen], exact[seen]) < 1e-2


def test_the_way_leads_around_a_hole():
    points = disc_random(2100, 0)[0]
    radius = np.hypot(points[:, 0], points[:, 1])
    points, radius = points[radius > 0.3], radius[radius > 0.3]
    source = int(np.argmin(np.hypot(points[:, 0] + 0.8, points[:, 1])))
    angle = np.arctan2(points[:, 1], points[:, 0])
    turn = np.abs(np.angle(np.exp(1j * (angle - angle[source]))))
    own, other = np.arccos(0.3 / radius[source]), np.arccos(0.3 / radius)
    hidden = turn > own + other
    tangents = np.sqrt(radius[source] ** 2 - 0.09) + np.sqrt(radius**2 - 0.09)
    exact = np.where(hidden, tangents + 0.3 * (turn - own - other), np.linalg.norm(points - points[source], axis=1))
    found = core.distance.geodesic_distance(core.build_laplacian(points), [source])
    assert np.count_nonzero(hidden) > 150
    assert mean_error(found[hidden], exact[hidden]) < 1.2e-2
    assert mean_error(found, exact) < 6e-3


def test_around_the_edges_of_a_cube():
    side = np.linspace(-1.0, 1.0, 31)
    points = grid_points(side, side, side)
    points = points[np.abs(points).max(axis=1) == 1.0]
    top = int(np.argmin(np.linalg.norm(points - [0.0, 0.0, 1.0], axis=1)))
    found = core.distance.geodesic_distance(core.build_laplacian(points), [top])
    middle = np.abs(points[:, 0]) < 1e-9
    side = middle & (points[:, 1] == 1.0) & (np.abs(points[:, 2]) < 0.9)
    np.testing.assert_allclose(found[side], 2.0 - points[side, 2], rtol=0.05)


@pytest.mark.parametrize(("rings", "tolerance"), [(5, np.inf), (7, 0.1)])
def test_the_poles_of_few_points_are_reached(rings, tolerance):
    turn, rise = np.meshgrid(np.arange(10) * 0.2 * np.pi, np.linspace(0.0, np.pi, rings))
    points = np.stack([np.sin(rise) * np.cos(turn), np.sin(rise) * np.sin(turn), np.cos(rise)], axis=-1).reshape(-1, 3)
    laplacian = core.build_laplacian(
        points, options=core.LaplacianOptions(bandwidth="local", neighbors=20, bandwidth_factor=1.0 / 3.0)
    )
    distance = core.distance.geodesic_distance(laplacian, [0])
    assert np.isfinite(distance).all()
    assert np.abs(distance - rise.ravel()).max() < tolerance


def test_points_left_out():
    points = np.concatenate([fibonacci_sphere(900), [[20.0, 0.0, 0.0]]])
    laplacian = core.build_laplacian(points)
    assert np.isinf(core.distance.geodesic_distance(laplacian, [0])[900])
    np.testing.assert_array_equal(core.distance.geodesic_distance(laplacian, [0, 900])[[0, 900]], 0.0)
    with pytest.raises(core.InvalidPointsError, match="All 1 sources are points that the operator left out"):
        core.distance.geodesic_distance(laplacian, [900])


def test_masks_are_sets_too(operators):
    laplacian = operators("even sphere")
    mask = laplacian.points[:, 2] > 0.9
    found = core.distance.geodesic_distance(laplacian, mask)
    np.testing.assert_array_equal(found, core.distance.geodesic_distance(laplacian, np.flatnonzero(mask)[::-1]))
    assert np.all(found[~mask] > 0.0)


def test_lengths_are_made_once_for_all_along_a_surface(operators, monkeypatch):
    laplacian = operators("even sphere")
    laplacian.release()
    ways = [
        lambda: core.distance.geodesic_distance(laplacian, [3, 1500]),
        lambda: core.distance.nearest_source(laplacian, [3, 1500]),
        lambda: core.distance.signed_distance(laplacian, [3, 1500]),
        lambda: core.distance.geodesic_path(laplacian, 3, 1500),
        lambda: core.distance.logarithmic_map(laplacian, 3),
        lambda: core.distance.grow(laplacian, [3], 0.1),
    ]
    found = []
    for way in ways:
        laplacian.release()
        found.append(way())
    monkeypatch.setattr(core.distance.geodesics, "_lengths_of_pairs", lambda *_: pytest.fail("made again"))
    for way, expected in zip(ways, found, strict=True):
        np.testing.assert_array_equal(way(), expected)


def test_an_operator_is_freed_with_what_it_keeps():
    laplacian = core.build_laplacian(core.example_sphere())
    core.distance.logarithmic_map(laplacian, 3)
    alive = weakref.ref(laplacian)
    del laplacian
    assert alive() is None


@pytest.mark.parametrize(("sources", "text"), [([], "no sources"), ([2500], "below 2500"), ([0.5], "whole numbers")])
def test_bad_sources(operators, sources, text):
    with pytest.raises(core.InvalidPointsError, match=text):
        core.distance.geodesic_distance(operators("even sphere"), sources)
