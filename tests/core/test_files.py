"""Point files: what is written is read again, coordinates keep their digits, and broken files are refused."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from core import Cancelled, PointCloudError
from core.files import PointTable, choose_origin, is_coarse, read_points, replacing, whole, write_points

FAR = np.array([446_000.0, 4_000_000.0, 120.0])
POINTS = np.round(np.random.default_rng(0).uniform(0.0, 100.0, (200, 3)), 3) + FAR


def header(*properties, count=2, order="ascii", after=""):
    lines = "\n".join(f"property {text}" for text in properties)
    return f"ply\nformat {order} 1.0\ncomment a scan\nelement vertex {count}\n{lines}\n{after}end_header\n".encode()


XYZ = ("double x", "double y", "double z")


@pytest.mark.parametrize("name", ["a.ply", "a.xyz", "a.csv"])
def test_what_is_written_is_read_again(tmp_path, name):
    random = np.random.default_rng(1)
    given = PointTable(
        POINTS,
        {
            "normal": random.normal(size=(200, 3)).astype(np.float32),
            "lb_area": random.uniform(size=200).astype(np.float32),
            "lb_component": random.integers(-1, 3, 200).astype(np.int32),
            "lb_boundary": random.uniform(size=200) < 0.5,
            "flow": random.normal(size=(200, 3)).astype(np.float32),
        },
        random.integers(0, 256, (200, 4)).astype(np.float32) / 255.0,
    )
    write_points(tmp_path / name, given)
    read = read_points(tmp_path / name)
    assert_allclose(read.points, POINTS, rtol=0.0, atol=1e-9)
    assert not read.single
    assert_allclose(read.colors, given.colors, atol=1e-6)
    assert read.attributes.keys() == given.attributes.keys()
    for key, values in given.attributes.items():
        assert_allclose(read.attributes[key], values, rtol=1e-7)
    assert read.notices == []
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a.ply", "a.xyz", "a.csv"])
def test_attributes_named_like_coordinates_and_normals(tmp_path, name):
    """They must not take the place of those."""
    values = np.arange(200.0)
    names = ("x", "flow_z", "red", "normal", "Höhe")
    vectors = {"flow": np.ones((200, 3), np.float32)}
    table = PointTable(POINTS, {**vectors, **dict.fromkeys(names, values)}, np.ones((200, 4), np.float32))
    write_points(tmp_path / name, table)
    read = read_points(tmp_path / name)
    assert_allclose(read.points, POINTS, rtol=0.0, atol=1e-9)
    assert_allclose(read.colors, 1.0)
    height = "Hoehe" if name == "a.ply" else "Höhe"  # headers of PLY are ASCII
    assert read.attributes.keys() == {"flow", "x_2", "flow_z_2", "red_2", "normal", height}
    assert_allclose(read.attributes["flow"], 1.0)
    assert_allclose(read.attributes["x_2"], values)


def test_single_precision_by_choice(tmp_path):
    near = (POINTS - FAR).astype(np.float32).astype(np.float64)
    write_points(tmp_path / "a.ply", PointTable(near), double=False)
    assert b"property float x\n" in (tmp_path / "a.ply").read_bytes()
    assert_array_equal(read_points(tmp_path / "a.ply").points, near)
    write_points(tmp_path / "a.xyz", PointTable(near), double=False)
    assert_array_equal(read_points(tmp_path / "a.xyz").points.astype(np.float32), near)


class TestPly:
    @pytest.mark.parametrize("order", ["<", ">"])
    def test_binary(self, tmp_path, order):
        rows = np.zeros(200, [("x", order + "f8"), ("y", order + "f8"), ("z", order + "f8"), ("i", order + "u2")])
        for axis, column in zip("xyz", POINTS.T, strict=True):
            rows[axis] = column
        rows["i"] = np.arange(200) * 300
        name = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
        faces = "element face 1\nproperty list uchar int vertex_indices\n"
        data = header(*XYZ, "ushort intensity", count=200, order=name, after=faces) + rows.tobytes()
        (tmp_path / "a.ply").write_bytes(data + b"\x03" + np.arange(3, dtype=order + "i4").tobytes())
        table = read_points(tmp_path / "a.ply")
        assert_array_equal(table.points, POINTS)
        assert_array_equal(table.attributes["intensity"], rows["i"])
        assert table.attributes["intensity"].dtype == np.uint16
        assert table.notices == ["a.ply: left out 1 face elements. Only points are read."]

    def test_text_with_windows_lines_keeps_the_digits_that_float_would_lose(self, tmp_path):
        rows = "".join(f"{x:.3f} {y:.3f} {z:.3f} 255 0 128\r\n" for x, y, z in POINTS)
        colors = ("uchar red", "uchar green", "uchar blue")
        head = header("float x", "float y", "float z", *colors, count=200).replace(b"\n", b"\r\n")
        (tmp_path / "a.ply").write_bytes(head + rows.encode())
        table = read_points(tmp_path / "a.ply")
        assert_allclose(table.points, POINTS, rtol=0.0, atol=1e-9)
        assert_allclose(table.colors[0], [1.0, 0.0, 128 / 255, 1.0])

    def test_elements_before_the_points_are_passed_over(self, tmp_path):
        start = "ply\nformat {} 1.0\nelement camera 2\nproperty short a\nproperty float b\nelement vertex 1\n"
        rest = "property float32 x\nproperty float32 y\nproperty float32 z\nend_header\n"
        (tmp_path / "a.ply").write_text(start.format("ascii") + rest + "1 2\n3 4\n5 6 7\n")
        assert read_points(tmp_path / "a.ply").points.tolist() == [[5.0, 6.0, 7.0]]
        data = (start.format("binary_little_endian") + rest).encode() + bytes(12)
        (tmp_path / "a.ply").write_bytes(data + np.array([5.0, 6.0, 7.0], "<f4").tobytes())
        assert read_points(tmp_path / "a.ply").points.tolist() == [[5.0, 6.0, 7.0]]

    @pytest.mark.parametrize("order", ["ascii", "binary_little_endian"])
    def test_an_empty_element_of_lists_before_the_points(self, tmp_path, order):
        start = f"ply\nformat {order} 1.0\nelement face 0\nproperty list uchar int vertex_indices\n"
        head = f"{start}element vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n".encode()
        data = b"5 6 7\n" if order == "ascii" else np.array([5.0, 6.0, 7.0], "<f4").tobytes()
        (tmp_path / "a.ply").write_bytes(head + data)
        assert read_points(tmp_path / "a.ply").points.tolist() == [[5.0, 6.0, 7.0]]

    @pytest.mark.parametrize(
        ("data", "text"),
        [
            (b"", "first line is not 'ply'"),
            (b"this is no PLY", "first line is not 'ply'"),
            (b"ply\nformat ascii 1.0\n", "line 3: '' is not valid"),
            (b"ply\nformat zip 1.0\nend_header\n", "line 2: 'format zip 1.0' is not valid"),
            (b"ply\nelement vertex 1\nproperty float x\nend_header\n", "text or binary"),
            (b"ply\nformat ascii 1.0\nend_header\n", "has no vertices, only nothing"),
            (header("float x", "float y") + b"1 2\n3 4\n", "no z among its columns x, y"),
            (header(*XYZ, count=0), "has no points"),
            (header(*XYZ) + b"1 2 3\n", "ends after 1 of the 2 points"),
            (header(*XYZ) + b"1 2 3\n4 five 6\n", "point 2: could not convert string to float: 'five'"),
            (header(*XYZ) + b"1 2 3\n4 5\n", "point 2: 2 numbers where the header names 3"),
            (header(*XYZ) + b"1 2 3 4\n5 6 7 8\n", "point 1: 4 numbers where the header names 3"),
            (header(*XYZ) + b"nan 2 3\n4 nan 6\n", "has no points: all 2 have no valid coordinates .NaN."),
            (header(*XYZ, order="binary_little_endian") + bytes(47), "ends after 1 of the 2 points"),
            (header(*XYZ, order="binary_big_endian", count=10**12) + bytes(48), "ends after 2 of the 1000000000000"),
            (header(*XYZ, count=10**12) + b"1 2 3\n", "ends after 1 of the 1000000000000 points"),
            (header(*XYZ, count=10**20), "line 4: 'element vertex 1000.*' is not valid"),
            (b"ply\nformat binary_little_endian 1.0\nelement vertex 2\nend_header\n12", "has no x y z among"),
            (header(*XYZ) + b"1 2 3\n4 \xff 6\n", "point 2: could not convert"),
            (
                header(*XYZ, "list uchar int many") + b"1 2 3 1 4\n1 2 3 2 4\n",
                "point 2: 5 numbers, which are not those",
            ),
        ],
    )
    def test_broken_files(self, tmp_path, data, text):
        (tmp_path / "a.ply").write_bytes(data)
        with pytest.raises(PointCloudError, match=text) as error:
            read_points(tmp_path / "a.ply")
        assert str(tmp_path / "a.ply") in str(error.value)


class TestText:
    @pytest.mark.parametrize(
        "text",
        [
            "1.5 2 3\n4 5 6\n",
            "1.5, 2, 3\n4, 5, 6\n",
            "1.5,2,3,\n4,5,6,\n",
            "1,5;2;3\n4;5;6\n",
            "1,5\t2,0\t3,0\n4\t5\t6\n",
            "1,5 2,0 3,0\n4,0 5,0 6,0\n",
            "\ufeff# exported\n\nx y z\n1.5 2 3 # first\n\n4 5 6",
            "//X Y Z\n1.5 2 3\n4 5 6\n",
            "2\n1.5 2 3\n4 5 6\n",
        ],
    )
    def test_delimiters_decimals_and_headers(self, tmp_path, text):
        (tmp_path / "a.txt").write_text(text, encoding="utf-8")
        table = read_points(tmp_path / "a.txt")
        assert table.points.tolist() == [[1.5, 2.0, 3.0], [4.0, 5.0, 6.0]]
        assert (table.attributes, table.colors, table.notices) == ({}, None, [])

    @pytest.mark.parametrize(
        ("text", "error"),
        [
            ("", "does not hold columns of numbers x y z: there are none"),
            ("x,y,z\n", "there are none"),
            ("x,y\n1,2\n3,4\n", "there are none"),
            ("1 2 3\n4 5 x\n", "line 2 has 'x' where a number should be"),
            ("x y z\n\n1 2 3\n\n4 5\n", "line 5 has 2 columns only"),
            ("1 2 inf\n3 -inf 4\n", "all 2 have no valid coordinates .NaN or infinity."),
            ("\0\1\2 binary", "there are none"),
            ("word\n" * 30 + "1 2 3\n", "there are none in its first 20 lines"),
        ],
    )
    def test_broken_files(self, tmp_path, text, error):
        (tmp_path / "a.csv").write_text(text)
        with pytest.raises(PointCloudError, match=error):
            read_points(tmp_path / "a.csv")

    @pytest.mark.parametrize("columns", [3, 4, 6, 7])
    def test_scans_of_pts(self, tmp_path, columns):
        row = " ".join(["1", "2", "3", *{3: "", 4: "-99", 6: "255 0 0", 7: "-99 255 0 0"}[columns].split()])
        (tmp_path / "a.pts").write_text(f"2\n{row}\n{row}\n1\n{row}\n")
        table = read_points(tmp_path / "a.pts")
        assert table.points.tolist() == 3 * [[1.0, 2.0, 3.0]]
        assert list(table.attributes) == (["intensity"] if columns in (4, 7) else [])
        assert (table.colors is not None) == (columns > 5)
        assert table.notices == []

    @pytest.mark.parametrize(
        ("text", "error"),
        [
            ("3\n1 2 3\n4 5 6\n", "announces 3 points, but 2 lines follow"),
            ("1\n1 2 3\n\n4 5 6\n", "beyond is in line 4"),
            ("2\n1 2 3\n4 5\n", "line 3 has 2 columns only"),
            ("0\n", "there are none"),
        ],
    )
    def test_pts_with_wrong_counts(self, tmp_path, text, error):
        (tmp_path / "a.pts").write_text(text)
        with pytest.raises(PointCloudError, match=error):
            read_points(tmp_path / "a.pts")


class TestObj:
    @pytest.mark.parametrize(
        ("text", "error"),
        [("vn 0 0 1\n", "no vertices"), ("v 1 2 3\n\nv 4 x 6\n", "line 3 has 'x'"), ("", "no vertices")],
    )
    def test_broken_files(self, tmp_path, text, error):
        (tmp_path / "a.obj").write_text(text)
        with pytest.raises(PointCloudError, match=error):
            read_points(tmp_path / "a.obj")


class TestArrays:
    def test_under_the_name_of_the_other_kind(self, tmp_path):
        np.save(tmp_path / "a.npy", POINTS)
        (tmp_path / "a.npy").rename(tmp_path / "b.npz")
        np.savez(tmp_path / "a.npz", points=POINTS)
        (tmp_path / "a.npz").rename(tmp_path / "b.npy")
        for name in ("b.npy", "b.npz"):
            assert_array_equal(read_points(tmp_path / name).points, POINTS)

    def test_others(self, tmp_path):
        np.save(tmp_path / "a.npy", POINTS[:, :2])
        np.savez(tmp_path / "a.npz", areas=np.ones(200))
        (tmp_path / "b.npy").write_text("no array")
        (tmp_path / "b.npz").write_text("no arrays")
        np.save(tmp_path / "c.npy", np.zeros(9, [("x", "f4"), ("y", "f4"), ("z", "f4")]))
        for name, text in (
            ("a.npy", "shape"),
            ("a.npz", "points is not"),
            ("b.npy", "no array"),
            ("b.npz", "no array"),
            ("c.npy", "records of named numbers"),
        ):
            with pytest.raises(PointCloudError, match=text):
                read_points(tmp_path / name)


def holed(kind, missing):
    """Return a small file with colors, whose second point has no place."""
    rows = [f"{x} {y} {z}" for x, y, z in ((1, 2, 3), (4, missing, 6), (7, 8, 9))]
    match kind:
        case "ply":
            colors = ("uchar red", "uchar green", "uchar blue", "int number")
            return (
                header(*XYZ, *colors, count=3) + "".join(f"{row} {i} 0 0 {i}\n" for i, row in enumerate(rows)).encode()
            )
        case "obj":
            return "".join(f"v {row} 0.{i} 0 0\n" for i, row in enumerate(rows)).encode()
        case "pts":
            return b"3\n" + "".join(f"{row} {i} {i} 0 0\n" for i, row in enumerate(rows)).encode()
    return b"x y z r g b number\n" + "".join(f"{row} {i} 0 0 {i}\n" for i, row in enumerate(rows)).encode()


@pytest.mark.parametrize("missing", ["nan", "inf"])
@pytest.mark.parametrize("kind", ["ply", "xyz", "csv", "txt", "pts", "obj"])
def test_points_without_a_place_are_left_out(tmp_path, kind, missing):
    (tmp_path / f"a.{kind}").write_bytes(holed(kind, missing))
    table = read_points(tmp_path / f"a.{kind}")
    assert table.points.tolist() == [[1.0, 2.0, 3.0], [7.0, 8.0, 9.0]]
    assert len(table.colors) == 2
    assert table.colors[0, 0] < table.colors[1, 0]
    assert {name: values.tolist() for name, values in table.attributes.items()} in (
        {},
        {"number": [0, 2]},
        {"intensity": [0, 2]},
    )
    what = "NaN" if missing == "nan" else "NaN or infinity"
    assert table.notices == [f"a.{kind}: left out 1 points that the sensor missed ({what})."]


@pytest.mark.parametrize(
    ("name", "text"),
    [("a.dxf", "not a file with points"), ("b.dxf", "There is no file"), ("b.ply", "There is no file")],
)
def test_files_that_are_not_read(tmp_path, name, text):
    (tmp_path / "a.dxf").touch()
    with pytest.raises(PointCloudError, match=text):
        read_points(tmp_path / name)


def test_large_coordinates_that_were_single_all_along_get_a_notice(tmp_path):
    write_points(tmp_path / "a.ply", PointTable(POINTS), double=False)
    assert "in steps of 0.25. Export it in double" in read_points(tmp_path / "a.ply").notices[0]


class TestOrigin:
    def test_near_points_stay(self):
        for points in (POINTS - FAR, POINTS - FAR + 1000.0, 1e-3 * (POINTS - FAR), np.zeros((1, 3))):
            assert choose_origin(points).tolist() == [0.0, 0.0, 0.0]

    def test_far_points_keep_their_precision(self):
        for scale in (1e-2, 1.0, 1e3):
            points = scale * (POINTS - FAR) + FAR
            origin = choose_origin(points)
            local = (points - origin).astype(np.float32)
            size = np.ptp(points, axis=0).max()
            assert np.abs(local).max() <= size
            assert np.abs(local + origin - points).max() <= np.spacing(np.float32(size))
            assert is_coarse(points)
            assert scale > 1.0 or not is_coarse(points - origin)

    def test_small_far_points(self):
        points = 1e-2 * (POINTS - FAR) + 1000.0
        assert choose_origin(points).tolist() != [0.0, 0.0, 0.0]

    def test_points_closer_than_single_precision_tells_are_at_one_place(self):
        points = np.array([[0.0, 0.0, 0.0], [5e-324, 1e-310, 1e-40]])
        assert choose_origin(points).tolist() == [0.0, 0.0, 0.0]
        assert choose_origin(points + FAR).tolist() == FAR.tolist()

    def test_one_point_far_away(self):
        assert choose_origin(FAR[None]).tolist() == FAR.tolist()

    def test_neighbours_share_an_origin(self):
        origin = choose_origin(POINTS)
        assert choose_origin(POINTS + 500.0, known=origin).tolist() == origin.tolist()
        other = choose_origin(POINTS + 1e6, known=origin)
        assert np.abs(POINTS + 1e6 - other).max() <= 100.0
        assert choose_origin(POINTS - FAR, known=origin).tolist() == [0.0, 0.0, 0.0]


def test_a_failed_writer_leaves_the_file(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("before")

    def fail():
        with replacing(path) as part:
            part.write_text("half")
            raise OSError("disk full")

    with pytest.raises(PointCloudError, match="a.csv cannot be written: No space left"):
        fail()
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [Path(path)]


def test_a_writer_that_is_stopped_leaves_the_file_and_nothing_else(tmp_path):
    (tmp_path / "a.npz").write_text("before")
    for fault in (KeyboardInterrupt, Cancelled, ZeroDivisionError):

        def write(fault=fault):
            with replacing(tmp_path / "a.npz") as part:
                part.write_text("half")
                raise fault

        with pytest.raises(fault):
            write()
        assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("a.npz", "before")]


KILLED = """
import os, pathlib, sys
from core.files import replacing
with replacing(pathlib.Path(sys.argv[1])) as part:
    part.write_text("half")
    os._exit(9)  # which does what a kill does: nothing more
"""


def test_a_writer_that_is_killed_leaves_the_file(tmp_path, monkeypatch):
    path = tmp_path / "a.ply"
    write_points(path, PointTable(POINTS))
    done = subprocess.run([sys.executable, "-c", KILLED, str(path)], cwd=Path(__file__).parents[2])
    assert done.returncode == 9
    assert_array_equal(read_points(path).points, POINTS)
    monkeypatch.setattr(whole, "_cleaned", set())  # as of a process that begins
    write_points(path, PointTable(POINTS[:3]))
    assert len(read_points(path).points) == 3
    assert list(tmp_path.iterdir()) == [path]  # what the other left is gone, too


@pytest.mark.parametrize("name", ["a.ply", "a.xyz", "a.csv"])
def test_a_full_disk_leaves_the_file(tmp_path, name):
    resource = pytest.importorskip("resource")
    path = tmp_path / name
    write_points(path, PointTable(POINTS))
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))  # fails in the midst of writing, as a full disk
    try:
        with pytest.raises(PointCloudError, match="cannot be written: .*. Choose another place."):
            write_points(path, PointTable(np.tile(POINTS, (10, 1))))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert_allclose(read_points(path).points, POINTS, rtol=0.0, atol=1e-9)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(sys.platform == "win32", reason="making links needs rights there")
def test_a_link_in_place_of_the_temporary_file_is_not_followed(tmp_path, monkeypatch):
    monkeypatch.setattr("secrets.token_hex", lambda size: "0" * 2 * size)  # whoever could tell the name
    (tmp_path / "other").write_text("other")
    (tmp_path / f".a.{os.getpid()}-00000000.part.ply").symlink_to(tmp_path / "other")
    with pytest.raises(PointCloudError, match="cannot be written"):
        write_points(tmp_path / "a.ply", PointTable(POINTS))
    assert (tmp_path / "other").read_text() == "other"
    assert not (tmp_path / "a.ply").exists()


def test_places_that_cannot_be_written_or_read(tmp_path):
    (tmp_path / "a").write_text("")
    with pytest.raises(PointCloudError, match="cannot be written"):
        write_points(tmp_path / "a" / "b.ply", PointTable(POINTS))
    (tmp_path / "c.ply").mkdir()
    with pytest.raises(PointCloudError, match="cannot be written"):
        write_points(tmp_path / "c.ply", PointTable(POINTS))
    with pytest.raises(PointCloudError, match="no file"):
        read_points(tmp_path / "c.ply")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "c.ply"]
