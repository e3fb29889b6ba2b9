"""Points that crowd along rows, and curves, which are none of a surface."""

import numpy as np
import pytest

import core
from benchmarks.samplings import grid_points, random_sphere, torus_eigenvalues
from core.geometry.nearest import find_nearest
from core.geometry.rows import look_across_rows


def rings(count=8, sides=600):
    """A plane as a turning lidar sees it, and its area: rings 8 to 19 times as far apart as their points."""
    radius = 10.0 * 1.15 ** np.arange(count)
    angle = np.arange(sides) * 2.0 * np.pi / sides
    flat = radius[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    area = np.pi * (radius[-1] ** 2 - radius[0] ** 2)
    return np.concatenate([flat.reshape(-1, 2), np.zeros((count * sides, 1))], axis=1), area


def torus_of_circles(circles=24, sides=136):
    """A torus in circles that are fourteen times as far apart as their points."""
    u, v = np.meshgrid(np.arange(circles) * 2.0 * np.pi / circles, np.arange(sides) * 2.0 * np.pi / sides)
    radius = 1.0 + 0.4 * np.cos(v)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), 0.4 * np.sin(v)], axis=2)
    return points.reshape(-1, 3), 1.6 * np.pi**2


def helix():
    angle = np.linspace(0.0, 10.0 * np.pi, 3000)
    return np.column_stack([np.cos(angle), np.sin(angle), 0.05 * angle])


def circle():
    angle = np.arange(900) * np.pi / 450.0
    return np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])


def noisy_line():
    return np.arange(2000.0)[:, None] * [1.0, 0.0, 0.0] + 0.2 * np.random.default_rng(0).standard_normal((2000, 3))


@pytest.mark.parametrize(("cloud", "at_boundary"), [(rings(), 1200), (torus_of_circles(), 0)], ids=["rings", "torus"])
def test_a_surface_in_rows_is_measured(cloud, at_boundary):
    points, area = cloud
    laplacian = core.build_laplacian(points)
    assert laplacian.areas.sum() == pytest.approx(area, rel=2e-3)
    assert np.all(laplacian.component == 0)
    assert np.count_nonzero(laplacian.boundary) == at_boundary


@pytest.mark.parametrize("minor", [0.35, 0.4, 0.526])
def test_circles_that_come_nearer_to_each_other_are_measured(minor):
    """Points crowd along them outside the torus's ring, and no more within it."""
    around, tube = (2.0 * np.pi * np.arange(count) / count for count in (40, 160))
    radius = 1.0 + minor * np.cos(tube)
    flat = [radius[:, None] * np.cos(around), radius[:, None] * np.sin(around)]
    points = np.stack([*flat, np.repeat(minor * np.sin(tube)[:, None], 40, axis=1)], axis=-1).reshape(-1, 3)
    laplacian = core.build_laplacian(points)
    exact = np.repeat(4.0 * np.pi**2 * minor * radius / (40 * 160), 40)
    np.testing.assert_allclose(laplacian.areas / exact, 1.0, atol=0.15)
    values = laplacian.eigenpairs(21).eigenvalues[1:] / torus_eigenvalues(21, 1.0, minor)[1:]
    assert np.abs(values - 1.0).mean() < 6e-3  # in fewer points they are not as close


@pytest.mark.parametrize("across", [7, 8, 9, 9.7, 10])
def test_closed_rings_are_one_surface(across):
    """A cylinder whose rings are that many times as far apart as their points: no edge is a gap at their ends."""
    angle, height = (
        part.ravel()
        for part in np.meshgrid(np.arange(int(24 * across)) * 2.0 * np.pi / int(24 * across), np.arange(9) * np.pi / 12)
    )
    laplacian = core.build_laplacian(np.column_stack([np.cos(angle), np.sin(angle), height]))
    assert np.all(laplacian.component == 0)
    turn = np.minimum(angle, 2.0 * np.pi - angle)
    exact = np.hypot(turn, height - height[0])
    np.testing.assert_allclose(core.distance.geodesic_distance(laplacian, [0]), exact, rtol=1e-2, atol=1e-2)


@pytest.mark.parametrize("radius", [np.inf, 40.0])
@pytest.mark.parametrize("across", [6, 8, 9, 12])
def test_normals_where_only_two_rows_are_near(across, radius):
    """Any slope across fits the last two of some rows, of a plane or bent along them: the least bent quadric counts."""
    along, row = (part.ravel() for part in np.meshgrid(np.arange(120.0), np.arange(12), indexing="ij"))
    noise = 0.05 * np.random.default_rng(0).normal(size=len(along))
    points, exact = np.column_stack([along, across * row, noise]), np.tile([0.0, 0.0, 1.0], (len(along), 1))
    if np.isfinite(radius):
        exact = np.column_stack([np.cos(along / radius), np.zeros(len(along)), np.sin(along / radius)])
        points = (radius + noise)[:, None] * exact + across * row[:, None] * [0.0, 1.0, 0.0]
    normals = core.build_laplacian(points).normals
    angle = np.degrees(np.arccos(np.minimum(np.abs(np.einsum("ij,ij->i", normals, exact)), 1.0)))
    assert angle.max() < 5.0
    assert angle[(row == 0) | (row == 11)].mean() < 1.0


def test_eigenvalues_of_a_rectangle_in_rows():
    # They are twenty times as far apart as their points, and leave the last gap of the unit square out.
    points = grid_points(np.arange(300) / 300.0, np.arange(15) / 15.0, [0.0])
    values = core.build_laplacian(points).eigenpairs(6).eigenvalues
    exact = np.sort([(i * i + (j * 15.0 / 14.0) ** 2) * np.pi**2 for i in range(4) for j in range(4)])[1:6]
    np.testing.assert_allclose(values[1:], exact, rtol=3e-2)


@pytest.mark.parametrize("points", [helix(), circle(), noisy_line()], ids=["helix", "circle", "noisy line"])
def test_a_curve_is_refused(points):
    with pytest.raises(core.NotASurfaceError, match="along a curve"):
        core.build_laplacian(points)


def test_few_wires_are_told_and_many_refused():
    def with_wire(count):
        along = np.linspace(0.0, 1.5, count)
        wire = np.column_stack([0.5 + 0.2 * np.cos(4.0 * along), 0.5 + 0.2 * np.sin(4.0 * along), along])
        return np.concatenate([square, wire])

    square = np.column_stack([np.random.default_rng(0).random((2000, 2)), np.zeros(2000)])
    laplacian = core.build_laplacian(with_wire(150))
    assert np.median(laplacian.trust[2000:]) < 0.5 < np.median(laplacian.trust[:2000])
    assert any("points lie in rows" in notice for notice in laplacian.notices)
    with pytest.raises(core.NotASurfaceError, match="along a curve"):
        core.build_laplacian(with_wire(1000))


def test_neighbors_lie_all_around():
    points = grid_points(np.arange(400.0), 50.0 * np.arange(9), [0.0])
    middle = 4 * 400 + 200 if points[1, 0] == 1.0 else 200 * 9 + 4
    nearest = look_across_rows(find_nearest(points))
    offset = points[nearest.index[middle]] - points[middle]
    assert np.all(np.diff(nearest.distance[middle]) >= 0.0)
    np.testing.assert_allclose(np.linalg.norm(offset, axis=1), nearest.distance[middle])
    assert [np.count_nonzero(offset[:, 1] == row) for row in (-50.0, 0.0, 50.0)] == [15, 11, 15]
    assert len(np.unique(nearest.index[middle])) == len(offset)
    assert np.all(nearest.in_row)


def test_nothing_changes_where_points_lie_in_no_rows():
    nearest = find_nearest(random_sphere(1500))
    assert look_across_rows(nearest) is nearest


def test_a_curve_keeps_its_neighbors():
    nearest = find_nearest(circle())
    np.testing.assert_array_equal(look_across_rows(nearest).index, nearest.index)
    assert not np.any(look_across_rows(nearest).in_row)


def test_neighbors_across_rows_are_the_nearest_in_each_direction():
    """Those looked at first are enough for some points, and not for others."""
    count, sides = 12, 900
    points = rings(count, sides)[0]
    points += 0.01 * np.random.default_rng(3).standard_normal(points.shape) * [1.0, 1.0, 0.0]
    found = look_across_rows(find_nearest(points))
    ring = np.repeat(np.arange(count), sides)
    rows = np.arange(40, count * sides, 611)
    assert found.in_row[rows].all()
    for row in rows:
        offset = points - points[row]
        distance = np.linalg.norm(offset, axis=1)
        order = np.argsort(distance)[1:656]
        along = offset[order[7]]
        beside = (ring[order] != ring[row]) & (
            np.abs(offset[order] @ along) < 0.7 * distance[order] * distance[order[7]]
        )
        ahead = along / np.linalg.norm(along)
        left = np.cross([0.0, 0.0, 1.0], ahead)
        left *= np.sign(offset[order[beside.argmax()]] @ left)
        angle = np.arctan2(offset[order] @ left, offset[order] @ ahead)
        eighth = np.round(angle * 4.0 / np.pi) % 8
        turn = np.array([np.count_nonzero(eighth[:place] == each) for place, each in enumerate(eighth)])
        chosen = order[np.argsort(turn, kind="stable")[:40]]
        assert set(found.index[row]) == {row, *chosen}
