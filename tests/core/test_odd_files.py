"""Files as programs write them beside the rules of their formats: read rightly, or told as what they are."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import ConvexHull, Delaunay
from scipy.spatial.transform import Rotation

import core
from core import PointCloudError
from core.files import chunks, join_pieces, read_points
from tests.core import e57_files

COUNT = 8_000  # lines of more than one block
POINTS = np.round(np.random.default_rng(0).uniform(-5.0, 5.0, (COUNT, 3)), 3)
NORMALS = np.random.default_rng(1).normal(size=(COUNT, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1)[:, None]
COLORS = np.random.default_rng(2).integers(0, 256, (COUNT, 3))


def in_pieces(path, size=1500):
    pieces = chunks(path, size)
    table = join_pieces([*pieces], path, pieces.single, pieces.degrees)
    table.notices = pieces.notices + table.notices
    return table


def both_ways(path):
    """Return the table of a file, which is that of its pieces."""
    table, other = read_points(path), in_pieces(path)
    assert_array_equal(table.points, other.points)
    if table.colors is None:
        assert other.colors is None
    else:
        assert_array_equal(table.colors, other.colors)
    for name, values in table.attributes.items():
        assert_array_equal(values, other.attributes[name])
    assert [text for text in table.notices if text not in other.notices] == []
    return table


class TestPly:
    def make(self, kind, properties, *elements, end="\n", count=COUNT):
        lines = ["ply", f"format {kind} 1.0", "comment made", f"element vertex {count}"]
        return end.join([*lines, *(f"property {text}" for text in properties), *elements, "end_header", ""]).encode()

    @pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
    @pytest.mark.parametrize("end", ["\r", "\n", "\r\n", "\r\r\n"])
    def test_ends_of_lines(self, tmp_path, kind, end):
        """Rhino ends lines by a carriage return alone, behind which the first byte may be that of a new line."""
        places = POINTS.copy()
        places[0, 0] = np.frombuffer(b"\n\0\0\0\0\0\xe0\x3f", "<f8" if "little" in kind else ">f8")[0]
        rows = np.concatenate([places, COLORS], axis=1)
        order = ">" if "big" in kind else "<"
        record = np.dtype([(name, order + "f8") for name in "xyz"] + [(name, "u1") for name in ("r", "g", "b")])
        if kind == "ascii":
            data = "".join("{!r} {!r} {!r} {:.0f} {:.0f} {:.0f}{}".format(*row, end) for row in rows.tolist()).encode()
        else:
            data = np.array([*map(tuple, rows)], record).tobytes()
        names = [*(f"double {axis}" for axis in "xyz"), *(f"uchar {name}" for name in ("red", "green", "blue"))]
        (tmp_path / "a.ply").write_bytes(self.make(kind, names, end=end) + data)
        table = both_ways(tmp_path / "a.ply")
        assert_array_equal(table.points, places)
        assert_allclose(table.colors[:, :3], COLORS / 255.0, atol=1e-7)
        assert table.notices == []

    @pytest.mark.parametrize("parts", [(3, 3, 3), (3, 6), (6, 3), (2, 4, 3), (9,)])
    @pytest.mark.parametrize("faces", [0, 2])
    def test_a_point_on_several_lines(self, tmp_path, parts, faces):
        names = [f"float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
        names += [f"uchar {name}" for name in ("red", "green", "blue")]
        more = [f"element face {faces}", "property list uchar int vertex_indices"] if faces else []
        words = [
            [*map(repr, row[:6]), *(f"{value:.0f}" for value in row[6:])]
            for row in np.concatenate([POINTS, NORMALS, COLORS], axis=1).tolist()
        ]
        ends = [0, *np.cumsum(parts)]
        lines = (" ".join(row[a:b]) + " \n" for row in words for a, b in pairwise(ends))
        data = "".join(lines) + "3 0 1 2 \n" * faces
        (tmp_path / "a.ply").write_bytes(self.make("ascii", names, *more) + data.encode())
        table = both_ways(tmp_path / "a.ply")
        assert_array_equal(table.points, POINTS)
        assert_array_equal(table.attributes["normal"], NORMALS)
        assert_allclose(table.colors[:, :3], COLORS / 255.0, atol=1e-7)

    @pytest.mark.parametrize("line", ["1 2 3 4", "1 2 3 4 5", "1 2 3"])
    def test_rows_without_some_of_the_numbers_are_no_points_on_several_lines(self, tmp_path, line):
        names = [f"float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
        more = ("element face 9", "property list uchar int vertex_indices")
        data = (line + "\n") * 10 + "4 0 1 2 3\n" * 9
        (tmp_path / "a.ply").write_bytes(self.make("ascii", names, *more, count=10) + data.encode())
        with pytest.raises(PointCloudError, match="Correct the file|Copy or save it again"):
            read_points(tmp_path / "a.ply")

    @pytest.mark.parametrize("order", ["<", ">"])
    @pytest.mark.parametrize("longer", [2, 4, 8])
    @pytest.mark.parametrize("faces", [0, 5])
    def test_points_longer_than_the_header_names_are_refused(self, tmp_path, order, longer, faces):
        rows = np.zeros(300, [("place", order + "f4", 3), ("more", "u1", longer)])
        rows["place"], rows["more"] = POINTS[:300], 63
        more = [f"element face {faces}", "property list uchar uint vertex_indices"] if faces else []
        kind = "binary_little_endian" if order == "<" else "binary_big_endian"
        head = self.make(kind, [f"float {axis}" for axis in "xyz"], *more, count=300)
        corners = (bytes([3]) + np.arange(3, dtype=order + "u4").tobytes()) * faces
        (tmp_path / "a.ply").write_bytes(head + rows.tobytes() + corners)
        for read in (read_points, in_pieces):
            with pytest.raises(PointCloudError, match="places would be wrong"):
                read(tmp_path / "a.ply")
        (tmp_path / "a.ply").write_bytes(head + rows["place"].tobytes() + corners)
        assert_array_equal(both_ways(tmp_path / "a.ply").points, rows["place"])

    def test_strips_of_triangles(self, tmp_path):
        """As VripPack writes them, each ending in -1."""
        head = self.make(
            "binary_big_endian",
            [f"float {axis}" for axis in "xyz"],
            "element tristrips 1",
            "property list int int vertex_indices",
            count=300,
        )
        strips = np.array([9, 0, 1, 2, 3, -1, 4, 5, 299, -1], ">i4")
        (tmp_path / "a.ply").write_bytes(head + POINTS[:300].astype(">f4").tobytes() + strips.tobytes())
        assert_allclose(both_ways(tmp_path / "a.ply").points, POINTS[:300], atol=1e-6)

    @pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
    def test_more_points_than_the_header_names_are_told(self, tmp_path, kind):
        rows = POINTS[:300].astype("<f4")
        data = (
            rows.tobytes() if kind != "ascii" else "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in rows.tolist()).encode()
        )
        (tmp_path / "a.ply").write_bytes(self.make(kind, [f"float {axis}" for axis in "xyz"], count=290) + data)
        table = both_ways(tmp_path / "a.ply")
        assert_array_equal(table.points.astype(np.float32), rows[:290])
        [notice] = table.notices
        assert "of the 290 points that its header names" in notice
        assert "correct their number in the header" in notice
        (tmp_path / "a.ply").write_bytes(
            self.make(kind, [f"float {axis}" for axis in "xyz"], count=300) + data + b"\r\n"
        )
        assert both_ways(tmp_path / "a.ply").notices == []


@pytest.mark.parametrize("word", ["-nan(ind)", "nan(snan)", "-nan", "1.#QNAN", "-1.#IND00"])
@pytest.mark.parametrize("kind", ["ply", "pcd", "xyz"])
def test_nan_as_visual_c_writes_it(tmp_path, kind, word):
    names = ("x", "y", "z", "nx", "ny", "nz")
    if kind == "ply":
        head = TestPly().make("ascii", [f"float {name}" for name in names]).decode()
    elif kind == "pcd":
        names = ("x", "y", "z", "normal_x", "normal_y", "normal_z")
        head = f"VERSION 0.7\nFIELDS {' '.join(names)}\nSIZE 4 4 4 4 4 4\nTYPE F F F F F F\n"
        head += f"WIDTH {COUNT}\nHEIGHT 1\nPOINTS {COUNT}\nDATA ascii\n"
    else:
        head = " ".join(names) + "\n"
    rows = [
        "{!r} {!r} {!r}".format(*row) + (f" {word}" * 3 if index % 50 == 3 else " 0 0 1")
        for index, row in enumerate(POINTS.tolist())
    ]
    (tmp_path / f"a.{kind}").write_text(head + "\n".join(rows) + "\n")
    table = both_ways(tmp_path / f"a.{kind}")
    assert_array_equal(table.points, POINTS)
    missing = np.arange(COUNT) % 50 == 3
    assert np.isnan(table.attributes["normal"][missing]).all()
    assert_array_equal(table.attributes["normal"][~missing], np.tile([0.0, 0.0, 1.0], (np.count_nonzero(~missing), 1)))


@pytest.mark.parametrize("names", ["normalx normaly normalz", "NormalX NormalY NormalZ", "nx ny nz"])
@pytest.mark.parametrize("suffix", [".ply", ".csv", ".pcd"])
def test_names_of_normals(tmp_path, names, suffix):
    count, rows = 200, np.concatenate([POINTS, NORMALS], axis=1)[:200]
    words = ("x", "y", "z", *names.split())
    head = {
        ".ply": TestPly().make("ascii", [f"double {name}" for name in words], count=count).decode(),
        ".csv": " ".join(words) + "\n",
        ".pcd": f"FIELDS {' '.join(words)}\nSIZE{6 * ' 8'}\nTYPE{6 * ' F'}\nPOINTS {count}\nDATA ascii\n",
    }
    text = head[suffix] + "".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist())
    (tmp_path / f"a{suffix}").write_text(text)
    table = both_ways(tmp_path / f"a{suffix}")
    assert_array_equal(table.attributes["normal"], NORMALS[:count])
    assert [*table.attributes] == ["normal"]


class TestGrids:
    """Heights by rows and columns, of which every seventh has no data."""

    COLUMNS, ROWS = 4001, 7  # rows of more than one block, and more characters than any line of points
    HEIGHTS = np.round(np.random.default_rng(3).uniform(-9.0, 900.0, (ROWS, COLUMNS)), 12)
    GAPS = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS) % 7 == 3

    def rows(self, missing, upwards=False, wrap=None):
        words = [
            missing if gap else repr(float(height))
            for height, gap in zip(self.HEIGHTS.flat, self.GAPS.flat, strict=True)
        ]
        wrap = wrap or self.COLUMNS
        rows = [" ".join(words[index : index + wrap]) for index in range(0, len(words), wrap)]
        return "\n".join(rows[::-1] if upwards else rows) + "\n"

    def check(self, path, west, north, step):
        table = both_ways(path)
        row, column = np.nonzero(~self.GAPS)
        expected = {
            (west + step * x, north - step * y): height
            for x, y, height in zip(column.tolist(), row.tolist(), self.HEIGHTS[~self.GAPS].tolist(), strict=True)
        }
        assert {(x, y): z for x, y, z in table.points.tolist()} == expected
        assert table.attributes == {}
        [notice] = table.notices
        assert f"{self.COLUMNS} x {self.ROWS} heights" in notice
        assert f"left out {np.count_nonzero(self.GAPS):,} without data" in notice

    @pytest.mark.parametrize(
        ("suffix", "place"), [("asc", "corner"), ("txt", "center"), ("xyz", "corner"), ("grd", "center")]
    )
    @pytest.mark.parametrize(
        ("missing", "word"), [("-9999", "-9999"), ("-9999", "-9999.00"), ("nan", "nan"), (None, "-9999")]
    )
    def test_esri(self, tmp_path, suffix, place, missing, word):
        head = [f"NCOLS\t{self.COLUMNS}", f"nrows {self.ROWS}", f"xll{place} 350000.5", f"YLL{place.upper()} 5600000"]
        head += ["dx 2", "dy 2"] if suffix == "txt" else ["cellsize 2.0"]
        head += [f"NODATA_value {missing}"] if missing else []
        (tmp_path / f"a.{suffix}").write_text("\r\n".join([*head, self.rows(word)]))
        half = 1.0 if place == "corner" else 0.0
        self.check(tmp_path / f"a.{suffix}", 350000.5 + half, 5600000 + half + 2.0 * (self.ROWS - 1), 2.0)

    def test_rows_that_are_divided_and_decimal_commas(self, tmp_path):
        head = f"ncols {self.COLUMNS}\nnrows {self.ROWS}\nxllcenter -3,5\nyllcenter 4\ncellsize 0,5\n"
        (tmp_path / "a.asc").write_text(head + self.rows("-9999", wrap=13).replace(".", ","))
        self.check(tmp_path / "a.asc", -3.5, 4.0 + 0.5 * (self.ROWS - 1), 0.5)

    def test_surfer(self, tmp_path):
        ends = f"-8 {-8 + 0.25 * (self.COLUMNS - 1)}\n4 {4 + 0.25 * (self.ROWS - 1)}\n-9 900\n"
        rows = self.rows("1.70141e+038", upwards=True)
        (tmp_path / "a.grd").write_text(f"DSAA\n{self.COLUMNS} {self.ROWS}\n{ends}{rows}")
        self.check(tmp_path / "a.grd", -8.0, 4.0 + 0.25 * (self.ROWS - 1), 0.25)

    HEAD = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n"

    @pytest.mark.parametrize(
        ("text", "told"),
        [
            (HEAD + "1 2 3\n4 5\n", "ends after 5 of its 6 heights"),
            (HEAD + "1 2 3\n4 5 6 7\n", "more heights than those of its 3 columns and 2 rows"),
            (HEAD + "1 2 3\n4 x 6\n", "is broken.*'x'"),
            (HEAD + "1 2 3\n4" + "x" * 200_000, "text among its heights"),
            (HEAD + "-9999 -9999 -9999\n-9999 -9999 -9999\n", "has no points"),
            (HEAD.replace("cellsize 1\n", "") + "1 2 3\n4 5 6\n", "without a number dx or cellsize"),
            (
                HEAD.replace("xllcorner 0", "xllcorner inf") + "1 2 3\n4 5 6\n",
                "without a number xllcorner or xllcenter",
            ),
            (HEAD.replace("ncols 3", "ncols -3") + "1 2 3\n4 5 6\n", "grid of -3 columns and 2 rows"),
            ("DSAA\n3 2\n0 2\n0 1\n0\n1 2 3\n4 5 6\n", "two numbers each"),
            ("DSBB\3\0\2\0", "binary grid of heights, as Surfer"),
            ("CDF\1\0\0", "binary grid of heights, as NetCDF"),
        ],
    )
    def test_grids_that_are_not_read(self, tmp_path, text, told):
        (tmp_path / "a.grd").write_text(text)
        for read in (read_points, in_pieces):
            with pytest.raises(PointCloudError, match=told):
                read(tmp_path / "a.grd")

    def test_columns_called_asc(self, tmp_path):
        """As scanners and CloudCompare call them, with the number of points."""
        rows = "".join(f"{x} {y} {z} 200 100 {index % 256}\n" for index, (x, y, z) in enumerate(POINTS.tolist()))
        (tmp_path / "a.asc").write_text(f"//X Y Z R G B\n{COUNT}\n" + rows)
        table = both_ways(tmp_path / "a.asc")
        assert_array_equal(table.points, POINTS)
        assert_allclose(table.colors[:, 2], np.arange(COUNT) % 256 / 255.0, atol=1e-7)
        assert table.notices == []


class TestViewpoints:
    POSES = (((5.0, 0.0, 0.0), (0.5**0.5, 0.0, 0.0, 0.5**0.5)), ((1.5, -2.0, 300.0), (0.2, -0.4, 0.8, 1.6)))

    def make(self, viewpoint, points, normals, kind="f4"):
        names = ("x", "y", "z", "normal_x", "normal_y", "normal_z")
        head = f"FIELDS {' '.join(names)}\nSIZE {' '.join(kind[1] * 6)}\nTYPE {' '.join('F' * 6)}\n"
        rows = np.concatenate([points, normals], axis=1).astype(f"<{kind}")
        head += f"WIDTH {len(rows)}\nHEIGHT 1\nVIEWPOINT {viewpoint}\nPOINTS {len(rows)}\nDATA binary\n"
        return head.encode() + rows.tobytes()

    @pytest.mark.parametrize("position", POSES)
    @pytest.mark.parametrize("length", [1.0, 3.0])
    def test_one_wall_from_two_places(self, tmp_path, position, length):
        """The points as the sensor sees them are those of the wall, moved and turned back."""
        place, quaternion = np.array(position[0]), np.array(position[1])
        rotation = Rotation.from_quat(np.roll(quaternion, -1))
        words = " ".join(map(repr, [*place.tolist(), *(length * quaternion).tolist()]))
        seen = rotation.inv().apply(POINTS - place)
        (tmp_path / "a.pcd").write_bytes(self.make(words, seen, rotation.inv().apply(NORMALS), "f8"))
        table = both_ways(tmp_path / "a.pcd")
        assert_allclose(table.points, POINTS, atol=1e-9)
        assert_allclose(table.attributes["normal"], NORMALS, atol=1e-6)
        assert_array_equal(table.attributes["scanner"], np.tile(place, (COUNT, 1)))
        [notice] = table.notices
        assert f"moved its points by VIEWPOINT {words}"[:90] in notice

    @pytest.mark.parametrize("words", ["0 0 0 1 0 0 0", "0.0 0 0 1.0 0 -0 0"])
    def test_a_sensor_that_no_one_placed(self, tmp_path, words):
        (tmp_path / "a.pcd").write_bytes(self.make(words, POINTS, NORMALS, "f8"))
        table = both_ways(tmp_path / "a.pcd")
        assert_array_equal(table.points, POINTS)
        assert [*table.attributes] == ["normal"]
        assert table.notices == []

    @pytest.mark.parametrize("words", ["1 2 3", "1 2 3 0 0 0 0", "1 2 3 nan 0 0 1", "here 0 0 1 0 0 0"])
    def test_no_viewpoint(self, tmp_path, words):
        (tmp_path / "a.pcd").write_bytes(self.make(words, POINTS, NORMALS, "f8"))
        table = both_ways(tmp_path / "a.pcd")
        assert_array_equal(table.points, POINTS)
        [notice] = table.notices
        assert f"VIEWPOINT {words} is no position with a rotation, and not used" in notice


@pytest.mark.parametrize("kind", ["integer", "scaled", "f4", "f8"])
def test_e57_of_whole_numbers_may_be_in_millimeters(tmp_path, kind):
    places = np.round(1000.0 * POINTS)
    for factor, told in ((1.0, True), (0.001, False)):
        if kind in ("f4", "f8"):
            fields = e57_files.points(places * factor, kind)
        else:
            make = {"integer": e57_files.integer, "scaled": e57_files.scaled}["scaled" if factor < 1.0 else kind]
            limits = (-6000, 6000) if make is e57_files.integer else (-6000, 6000, factor, 0.0)
            fields = {
                f"cartesian{axis}": make(column.astype(int), *limits)
                for axis, column in zip("XYZ", places.T, strict=True)
            }
        (tmp_path / "a.e57").write_bytes(e57_files.seal(e57_files.make_e57((fields, COUNT, ""))))
        table = both_ways(tmp_path / "a.e57")
        assert_allclose(table.points, places * factor, rtol=1e-6)
        assert any("If they are millimeters, scale the points by 0.001" in text for text in table.notices) == told
        assert len(table.notices) == told


class TestTriangles:
    """Lists of the corners of triangles, which are no points."""

    def told(self, tmp_path, rows, header=""):
        rows = np.random.default_rng(0).permutation(np.asarray(rows))
        np.savetxt(tmp_path / "a.txt", rows, "%d", header=header, comments="")
        pieces = chunks(tmp_path / "a.txt", 50)
        read = [points for points, _ in pieces]
        table = read_points(tmp_path / "a.txt")
        assert list(pieces.notices) == table.notices
        assert len(table.points) == sum(map(len, read)) == len(rows)
        return ["indices of their corners" in notice for notice in table.notices] == [True]

    @pytest.mark.parametrize("first", [0, 1])
    def test_of_closed_and_open_meshes_are_told(self, tmp_path, first):
        hull = ConvexHull(core.example_sphere()).simplices
        flat = Delaunay(np.random.default_rng(1).random((60, 2))).simplices
        for triangles in (hull, flat, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]):
            assert self.told(tmp_path, np.asarray(triangles) + first)
        assert not self.told(tmp_path, hull, "x y z")

    @pytest.mark.parametrize("low", [[0, 0, 0], [0, 40, 80], [7, 10, 30]])
    def test_whole_points_are_not(self, tmp_path, low):
        """Voxels of a volume, of planes, and of a shell, in two of which most pairs are; and millimeters of a scan."""
        voxels = np.stack(np.meshgrid(*[np.arange(21)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        radius = np.linalg.norm(voxels - 10.0, axis=1)
        for kept in (slice(None), voxels[:, 2] == 3, voxels @ [1, 1, 1] == 20, abs(radius - 9.0) < 0.5):
            assert not self.told(tmp_path, voxels[kept] + low)
        scan = np.rint(1000.0 * (core.example_sphere() + 1.5)).astype(int)
        assert not self.told(tmp_path, scan + low)


def test_e57_of_a_few_meters_is_no_scan_in_millimeters(tmp_path):
    fields = e57_files.points(np.arange(30).reshape(-1, 3))
    (tmp_path / "a.e57").write_bytes(e57_files.seal(e57_files.make_e57((fields, 10, ""))))
    assert both_ways(tmp_path / "a.e57").notices == []


@pytest.mark.parametrize("scanned", [False, True])
@pytest.mark.parametrize("start", [0, 3])
def test_normals_in_pts(tmp_path, scanned, start):
    """Of six or seven columns without names; the first normals are zero, or have no number below."""
    normals = NORMALS.copy()
    normals[:150] = np.abs(normals[:150]) if start else 0.0
    rows = [f"{x!r} {y!r} {z!r}" for x, y, z in POINTS.tolist()]
    between = [f" {-index % 2000}" if scanned else "" for index in range(COUNT)]
    parts = zip(rows, between, normals.tolist(), strict=True)
    text = "".join("{}{} {:.6f} {:.6f} {:.6f}\n".format(row, more, *normal) for row, more, normal in parts)
    (tmp_path / "a.pts").write_text(f"{COUNT}\n{text}")
    table = both_ways(tmp_path / "a.pts")
    assert_array_equal(table.points, POINTS)
    assert table.colors is None
    assert_allclose(table.attributes.pop("normal"), normals, atol=1e-6)
    assert [*table.attributes] == (["intensity"] if scanned else [])
    assert "column_6 as normals" in table.notices[0] or "column_7 as normals" in table.notices[0]


@pytest.mark.parametrize("full", [1.0, 255.0])
@pytest.mark.parametrize("dark", [0, 1, 500])
def test_colors_in_pts_are_no_normals(tmp_path, full, dark):
    """Nor where the first ones are black, or shares of one."""
    colors = np.random.default_rng(4).integers(0, 10_000, (COUNT, 3)) / 1e4 if full == 1.0 else COLORS.astype(float)
    colors[:dark] = 0.0
    rows = zip(POINTS.tolist(), colors.tolist(), strict=True)
    text = "".join("{!r} {!r} {!r} {:g} {:g} {:g}\n".format(*place, *color) for place, color in rows)
    (tmp_path / "a.pts").write_text(f"{COUNT}\n{text}")
    table = both_ways(tmp_path / "a.pts")
    assert_allclose(table.colors[:, :3], colors / full, atol=1e-6)
    assert table.attributes == {}
    assert table.notices == []


@pytest.mark.parametrize("first", ["bare", "colored", "late"])
@pytest.mark.parametrize("weight", ["", " 1.0"])
def test_obj_with_some_colors(tmp_path, first, weight):
    """Wherever the first vertex with a color, or without one, is."""
    colored = {"bare": np.arange(COUNT) > 0, "colored": np.arange(COUNT) < 1, "late": np.arange(COUNT) > 5000}[first]
    colored[1000:3000:7] = first != "late"
    rows = zip(POINTS.tolist(), (COLORS / 255.0).tolist(), colored.tolist(), strict=True)
    text = "".join(
        "v {!r} {!r} {!r}".format(*place) + weight + (" {:.6f} {:.6f} {:.6f}".format(*color) if there else "") + end
        for (place, color, there), end in zip(rows, ["\n", " \n", " # v\n", "\nvn 0 0 1\n"] * (COUNT // 4), strict=True)
    )
    (tmp_path / "a.obj").write_text(text + "f 1 2 3\n")
    table = both_ways(tmp_path / "a.obj")
    assert_array_equal(table.points, POINTS)
    assert_allclose(table.colors[:, :3], colored[:, None] * COLORS / 255.0, atol=1e-5)
    assert_array_equal(table.colors[:, 3], 1.0)
    assert table.attributes == {}
    bare = np.count_nonzero(~colored)
    assert table.notices == [
        f"a.obj: {bare:,} of {COUNT:,} vertices have no color. They are black.",
        "a.obj: left out 1 faces and lines. Only points are read.",
    ]
