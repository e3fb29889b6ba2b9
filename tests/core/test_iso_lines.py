"""Iso lines on meshes: of the right length, joined as far as they can be, none where values are unknown."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import core
from benchmarks.samplings import random_sphere


def length(line):
    points = np.vstack([line.points, line.points[:1]]) if line.closed else line.points
    return np.linalg.norm(np.diff(points, axis=0), axis=1).sum()


def grid(count):
    """A square of triangles from -1 to 1."""
    side = np.linspace(-1.0, 1.0, count)
    x, y = (values.ravel() for values in np.meshgrid(side, side))
    corner = np.arange(count * (count - 1)).reshape(count - 1, count)[:, :-1].ravel()
    quads = np.column_stack([corner, corner + 1, corner + count + 1, corner + count])
    return np.column_stack([x, y, 0.0 * x]), quads


@pytest.fixture(scope="module")
def sphere():
    laplacian = core.build_laplacian(random_sphere(2100))
    mesh = core.surface.mesh_surface(laplacian)
    carrying = core.surface.values_on_mesh(laplacian, mesh.vertices)
    return mesh, carrying.interpolate(laplacian.points[:, 2])[-len(mesh.vertices) :]


@pytest.mark.parametrize("height", [-0.9, -0.4, 0.0, 0.3, 0.8])
def test_lines_of_height_on_a_sphere_are_circles_of_the_right_length(sphere, height):
    mesh, values = sphere
    (line,) = core.measure.iso_lines(*mesh, values, [height])
    assert line.closed
    assert line.level == height
    assert_allclose(length(line), 2.0 * np.pi * np.sqrt(1.0 - height**2), rtol=0.02)
    assert_allclose(np.linalg.norm(line.points, axis=1), 1.0, atol=0.01)
    assert_allclose(line.points[:, 2], height, atol=0.01)


def test_all_levels_come_one_after_the_other(sphere):
    levels = [-0.5, 0.0, 0.5, 3.0]
    assert [line.level for line in core.measure.iso_lines(*sphere[0], sphere[1], levels)] == levels[:3]


def test_lines_end_at_the_boundary():
    vertices, quads = grid(20)
    (line,) = core.measure.iso_lines(vertices, quads, vertices[:, 0], [0.13])
    assert not line.closed
    assert_allclose(length(line), 2.0)
    assert_allclose(np.sort(line.points[[0, -1], 1]), [-1.0, 1.0])
    assert_allclose(line.points[:, 0], 0.13)


def test_corners_follow_each_other():
    vertices, quads = grid(60)
    lines = core.measure.iso_lines(
        vertices, quads, np.sin(7.0 * vertices[:, 0]) * np.cos(9.0 * vertices[:, 1]), [0.3, -0.2]
    )
    assert len(lines) > 20
    assert {line.closed for line in lines} == {True, False}
    for line in lines:
        points = np.vstack([line.points, line.points[:1]]) if line.closed else line.points
        assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() < 1.5 * 2.0 / 59.0


def test_levels_that_vertices_have_break_no_line():
    vertices, quads = grid(21)
    (line,) = core.measure.iso_lines(vertices, quads, vertices[:, 0], [0.0])
    assert_allclose(length(line), 2.0)
    assert not core.measure.iso_lines(vertices, quads, 0.0 * vertices[:, 0], [0.0])


def test_across_unknown_values_there_are_none():
    vertices, quads = grid(21)
    values = np.where(np.abs(vertices[:, 1]) < 0.25, np.nan, vertices[:, 0])
    lines = core.measure.iso_lines(vertices, quads, values, [0.03])
    assert [line.closed for line in lines] == [False, False]
    assert_allclose(sum(map(length, lines)), 2.0 - 0.6, atol=1e-6)


def test_where_three_sheets_meet_lines_end():
    vertices = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.0, 1, 0], [0.0, -1, 0], [0.0, 0, 1]])
    faces = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    lines = core.measure.iso_lines(vertices, faces, vertices[:, 0], [0.5])
    assert len(lines) == 3
    assert not any(line.closed for line in lines)
    assert_allclose([length(line) for line in lines], 0.5)


@pytest.mark.parametrize(
    ("faces", "values", "levels", "text"),
    [
        ([[0, 1]], [0.0, 1.0, 2.0], [0.5], "three or four"),
        ([[0, 1, 3]], [0.0, 1.0, 2.0], [0.5], "there are 3"),
        ([[0, 1, 2]], [0.0, 1.0], [0.5], "each of 3 vertices"),
        ([[0, 1, 2]], [0.0, 1.0, 2.0], [np.nan], "finite"),
    ],
)
def test_wrong_arrays_are_refused(faces, values, levels, text):
    with pytest.raises(core.PointCloudError, match=text):
        core.measure.iso_lines(np.eye(3), np.array(faces), np.array(values), levels)
