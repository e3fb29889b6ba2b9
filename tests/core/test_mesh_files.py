"""Files of meshes: vertices with what they hold and faces of any number of corners, as other programs read them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from core import PointCloudError
from core.files import PointTable, read_points, write_mesh
from core.files.polygons import triangles

FAR = np.array([446_000.0, 4_000_000.0, 120.0])
# A cube whose top is one square, whose sides are squares, and whose bottom is two triangles.
CORNERS = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
SQUARES = np.array([[4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]])
TRIANGLES = np.array([[0, 2, 3], [0, 3, 1]])


def cube(points=CORNERS):
    heights = points[:, 2] - points[0, 2]
    colors = np.stack([0.2 + 0.6 * heights, 0.0 * heights, 1.0 - heights, 1.0 + 0.0 * heights], axis=1).astype(
        np.float32
    )
    return PointTable(points, {"height": heights.astype(np.float32)}, colors)


def faces_of_ply(path):
    """Read the lists after the vertices, one by one."""
    head, data = path.read_bytes().split(b"end_header\n", 1)
    lines = head.decode().splitlines()
    sizes = {"float": 4, "double": 8, "uchar": 1}
    row = sum(sizes[line.split()[1]] for line in lines if line.startswith("property") and "list" not in line)
    assert "property list uchar int vertex_indices" in lines
    [count] = [int(line.split()[2]) for line in lines if line.startswith("element face")]
    data, faces = data[8 * row :], []
    for _ in range(count):
        faces.append(np.frombuffer(data, "<i4", data[0], 1).tolist())
        data = data[1 + 4 * data[0] :]
    assert not data
    return faces


def test_ply(tmp_path):
    assert write_mesh(tmp_path / "a.ply", cube(CORNERS + FAR), [SQUARES]) == []
    table = read_points(tmp_path / "a.ply")
    assert_array_equal(table.points, CORNERS + FAR)
    assert_array_equal(table.attributes["height"], CORNERS[:, 2])
    assert_allclose(table.colors, cube().colors)
    assert table.notices == ["a.ply: left out 5 face elements. Only points are read."]
    assert faces_of_ply(tmp_path / "a.ply") == SQUARES.tolist()


def records_of_ply(path):
    """Read the lists after the vertices all at once, as long as the first of them: how trimesh reads binary files."""
    head, data = path.read_bytes().split(b"end_header\n", 1)
    sizes = {"float": 4, "double": 8, "uchar": 1}
    lines = [line.split() for line in head.decode("ascii").splitlines()]
    [[_, _, vertices], [_, _, faces]] = [line for line in lines if line[0] == "element"]
    row = sum(sizes[line[1]] for line in lines if line[0] == "property" and line[1] != "list")
    lists = data[int(vertices) * row :]
    rows = np.frombuffer(lists, [("count", "u1"), ("corners", "<i4", lists[0])])
    assert len(rows) == int(faces)
    assert (rows["count"] == lists[0]).all()
    return rows["corners"]


def test_a_ply_of_quads_and_triangles_has_lists_of_one_length(tmp_path):
    """Its triangles are the cube: their volume by the divergence theorem."""
    notices = write_mesh(tmp_path / "a.ply", cube(), [SQUARES, np.zeros((0, 5), int), TRIANGLES])
    assert "divided into triangles" in notices[0]
    faces = records_of_ply(tmp_path / "a.ply")
    assert faces.shape == (12, 3)
    assert np.linalg.det(CORNERS[faces]).sum() / 6.0 == pytest.approx(1.0)
    write_mesh(tmp_path / "b.ply", cube(), [SQUARES])
    assert records_of_ply(tmp_path / "b.ply").tolist() == SQUARES.tolist()


def test_quads_are_divided_along_their_shorter_diagonal(tmp_path):
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.0], [3.0, 0.0, 0.0], [1.0, -0.2, 0.0]])
    for turn in range(4):
        quads = np.roll([[0, 1, 2, 3]], turn, axis=1)
        found = triangles(quads, points)
        assert all({1, 3} <= set(face) for face in found.tolist())
        areas = np.cross(points[found[:, 1]] - points[found[:, 0]], points[found[:, 2]] - points[found[:, 0]])[:, 2]
        assert areas.max() < 0.0  # both as the quad is turned


def test_obj(tmp_path):
    write_mesh(tmp_path / "a.obj", cube(CORNERS + FAR), [SQUARES, TRIANGLES])
    table = read_points(tmp_path / "a.obj")
    assert_array_equal(table.points, CORNERS + FAR)
    assert_allclose(table.colors, cube().colors)
    lines = (tmp_path / "a.obj").read_text().splitlines()
    faces = [[int(word) - 1 for word in line.split()[1:]] for line in lines if line.startswith("f ")]
    assert faces == [*SQUARES.tolist(), *TRIANGLES.tolist()]


def test_stl(tmp_path):
    """Its triangles are the cube: their volume by the divergence theorem, and their normals, which point outwards."""
    write_mesh(tmp_path / "a.stl", cube(), [SQUARES, TRIANGLES])
    data = (tmp_path / "a.stl").read_bytes()
    assert int.from_bytes(data[80:84], "little") == 12
    rows = np.frombuffer(data[84:], [("normal", "<f4", 3), ("places", "<f4", (3, 3)), ("unused", "<u2")])
    places = rows["places"].astype(np.float64)
    assert np.linalg.det(places).sum() / 6.0 == pytest.approx(1.0)
    assert_allclose(np.linalg.norm(rows["normal"], axis=1), 1.0)
    assert ((places.mean(axis=1) - 0.5) * rows["normal"]).sum(axis=1).min() > 0.0


def test_polygons_of_many_corners_become_triangles(tmp_path):
    angles = 2.0 * np.pi * np.arange(7) / 7.0
    ring = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    write_mesh(tmp_path / "a.stl", PointTable(ring), [np.arange(7)[None]])
    rows = np.frombuffer((tmp_path / "a.stl").read_bytes()[84:], [("numbers", "<f4", 12), ("unused", "<u2")])
    places = rows["numbers"][:, 3:].reshape(-1, 3, 3).astype(np.float64)
    areas = np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0])[:, 2] / 2.0
    assert len(areas) == 5
    assert areas.sum() == pytest.approx(3.5 * np.sin(2.0 * np.pi / 7.0))


def test_stl_is_refused_where_single_precision_does_not_do(tmp_path):
    (tmp_path / "a.stl").write_text("before")
    with pytest.raises(PointCloudError, match=r"Write \.ply or \.obj"):
        write_mesh(tmp_path / "a.stl", cube(0.01 * CORNERS + FAR), [SQUARES])
    assert [path.name for path in tmp_path.iterdir()] == ["a.stl"]
    assert (tmp_path / "a.stl").read_text() == "before"


def test_other_endings_are_refused(tmp_path):
    with pytest.raises(PointCloudError, match=r"\.ply, \.obj, \.stl"):
        write_mesh(tmp_path / "a.fbx", cube(), [SQUARES])
