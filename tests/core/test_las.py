"""LAS and LAZ files give what laspy wrote, and those that lie about themselves are refused at once."""

import builtins
import struct
import subprocess
import sys
import tracemalloc
from pathlib import Path

import laspy
import lazrs
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from core import PointCloudError
from core.files import LasChoices, parse_classes, read_points, write_points

ROOT = Path(__file__).parents[2]
COUNT = 500
FORMATS = [(0, "1.2"), (1, "1.2"), (2, "1.2"), (3, "1.2"), (6, "1.4"), (7, "1.4"), (8, "1.4")]
COLORED = {2, 3, 5, 7, 8, 10}
FAR = np.array([446_000.0, 4_000_000.0, 120.0])


def write_las(path, point_format=2, version="1.2", count=COUNT, colors=(65535, 0, 32768), extra=(), packed=None):
    """Write a scan and return its coordinates."""
    points = FAR + np.round(np.random.default_rng(0).uniform(0.0, 100.0, (count, 3)), 3)
    header = laspy.LasHeader(point_format=point_format, version=version)
    header.offsets, header.scales = FAR, np.full(3, 0.001)
    for name, kind in (("height", np.float32), *extra):
        header.add_extra_dim(laspy.ExtraBytesParams(name, kind))
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.intensity = np.arange(count) % 65536
    las.classification = np.arange(count) % 20
    las.return_number = 1 + np.arange(count) % 5
    if point_format in COLORED:
        las.red, las.green, las.blue = np.tile(np.reshape(colors, (3, 1)), count)
    if point_format in (8, 10):
        las.nir = np.arange(count) % 7
    las.height = np.linspace(0.0, 1.0, count)
    las.write(str(path), do_compress=path.suffix == ".laz" if packed is None else packed)
    return points


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
@pytest.mark.parametrize(("point_format", "version"), FORMATS)
def test_what_laspy_writes_is_read(tmp_path, name, point_format, version):
    points = write_las(tmp_path / name, point_format, version)
    with laspy.open(tmp_path / name) as reader:
        assert reader.header.are_points_compressed == (name == "a.laz")
    table = read_points(tmp_path / name)
    assert_allclose(table.points, points, rtol=0.0, atol=1e-6)
    expected = ["intensity", "classification", "return_number", *(["nir"] if point_format == 8 else []), "height"]
    assert list(table.attributes) == expected
    assert_array_equal(table.attributes["intensity"], np.arange(COUNT))
    assert_array_equal(table.attributes["classification"], np.arange(COUNT) % 20)
    assert_array_equal(table.attributes["return_number"], 1 + np.arange(COUNT) % 5)
    assert_array_equal(table.attributes["height"], np.linspace(0.0, 1.0, COUNT, dtype=np.float32))
    if point_format == 8:
        assert_array_equal(table.attributes["nir"], np.arange(COUNT) % 7)
    if point_format in COLORED:
        assert_allclose(table.colors, np.tile([1.0, 0.0, 32768 / 65535, 1.0], (COUNT, 1)), atol=1e-6)
    else:
        assert table.colors is None
    assert (table.single, table.notices) == (False, [])


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_blocks_and_chunks_follow_each_other(tmp_path, name):
    """Points are read 65,536 at once, and packed 50,000 in a chunk."""
    points = write_las(tmp_path / name, 7, "1.4", count=140_000)
    table = read_points(tmp_path / name)
    assert_allclose(table.points, points, rtol=0.0, atol=1e-6)
    assert_array_equal(table.attributes["intensity"], np.arange(140_000) % 65536)
    assert_allclose(table.colors[[0, -1]], 2 * [[1.0, 0.0, 0.5, 1.0]], atol=1e-4)


@pytest.mark.parametrize(("point_format", "version"), [(2, "1.2"), (7, "1.4")])
def test_full_chunks(tmp_path, point_format, version):
    points = write_las(tmp_path / "a.laz", point_format, version, count=100_000)
    assert_allclose(read_points(tmp_path / "a.laz").points, points, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(("point_format", "version"), [(2, "1.2"), (7, "1.4")])
def test_chunks_of_different_sizes(tmp_path, point_format, version):
    """As those of cloud optimized point clouds; the last one is empty."""
    points = write_las(tmp_path / "a.las", point_format, version)
    write_las(tmp_path / "a.laz", point_format, version)
    with laspy.open(tmp_path / "a.las") as reader:
        header = reader.header
    rows = (tmp_path / "a.las").read_bytes()[header.offset_to_point_data :]
    size = header.point_format.size
    begin, at = begin_of(tmp_path / "a.laz"), items_of(tmp_path / "a.laz")
    kind = lazrs.LazVlr.new_for_compression(point_format, header.point_format.num_extra_bytes, True)
    head = bytearray((tmp_path / "a.laz").read_bytes()[:begin])
    head[at : at + len(kind.record_data())] = kind.record_data()
    with open(tmp_path / "a.laz", "wb") as file:
        file.write(head)
        packer = lazrs.LasZipCompressor(file, kind)
        for first, last in ((0, 1), (1, 200), (200, COUNT)):
            packer.compress_many(rows[first * size : last * size])
            packer.finish_current_chunk()
        packer.done()
    assert_allclose(read_points(tmp_path / "a.laz").points, points, rtol=0.0, atol=1e-6)


def test_what_a_file_is_called_does_not_matter(tmp_path):
    points = write_las(tmp_path / "a.las", 6, "1.4", packed=True)
    assert_allclose(read_points(tmp_path / "a.las").points, points, rtol=0.0, atol=1e-6)


def test_colors_of_a_scanner_without_a_camera_are_none(tmp_path):
    write_las(tmp_path / "a.las", colors=(0, 0, 0))
    assert read_points(tmp_path / "a.las").colors is None


def test_columns_that_a_maker_added(tmp_path):
    write_las(tmp_path / "a.laz", extra=[("wave", "3f8"), ("four", "4u1"), ("two\nlines", "u2")])
    table = read_points(tmp_path / "a.laz")
    assert table.attributes["wave"].shape == (COUNT, 3)
    assert table.attributes["two lines"].dtype == np.uint16
    assert table.notices == ["a.laz: left out four, which has 4 numbers per point."]


def test_a_scan_becomes_a_ply_with_all_digits(tmp_path):
    points = write_las(tmp_path / "a.laz")
    write_points(tmp_path / "a.ply", read_points(tmp_path / "a.laz"))
    table = read_points(tmp_path / "a.ply")
    assert_allclose(table.points, points, rtol=0.0, atol=1e-6)
    assert_array_equal(table.attributes["intensity"], np.arange(COUNT))


@pytest.mark.parametrize(("point_format", "version"), [(0, "1.2"), (3, "1.2"), (7, "1.4")])
def test_memory_is_that_of_the_result(tmp_path, point_format, version):
    """At most four times the file, as laspy itself would need to read it at once and to scale it."""
    write_las(tmp_path / "a.las", point_format, version, count=500_000)
    read_points(tmp_path / "a.las")
    tracemalloc.start()
    try:
        read_points(tmp_path / "a.las")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 4 * (tmp_path / "a.las").stat().st_size


def test_laspy_is_missing(tmp_path, monkeypatch):
    real = builtins.__import__

    def fail(name, *arguments, **options):
        if name == "lazrs":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return real(name, *arguments, **options)

    write_las(tmp_path / "a.las")
    monkeypatch.setattr(builtins, "__import__", fail)
    with pytest.raises(PointCloudError, match="lazrs is missing. Install both, or take another format, such as PLY"):
        read_points(tmp_path / "a.las")


def test_laspy_is_imported_for_las_only():
    code = "import sys, core, core.files; sys.exit('laspy' in sys.modules or 'lazrs' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def begin_of(path):
    return struct.unpack_from("<I", path.read_bytes(), 96)[0]


def table_of(path):
    return struct.unpack_from("<q", path.read_bytes(), begin_of(path))[0]


def items_of(path):
    """Return where the description of packed points lies."""
    return path.read_bytes().index(b"laszip encoded\0") + 16 + 2 + 2 + 32


BROKEN = {  # what is written where in a LAZ file of format 7, and what the error says
    "points": (lambda path: 247, "<Q", 2**40, "shorter than the 1,099,511,627,776 points .* Copy it again"),
    "records": (lambda path: 100, "<I", 2**32 - 1, "shorter than its header states: 4294967295 records"),
    "begin": (lambda path: 96, "<I", 2**32 - 1, "shorter than its header states"),
    "header": (lambda path: 94, "<H", 65535, "shorter than its header states"),
    "table far": (begin_of, "<q", 2**62, "compressed points do not match its header"),
    "table before": (begin_of, "<q", -2, "compressed points do not match its header"),
    "chunks": (lambda path: table_of(path) + 4, "<I", 2**32 - 1, "compressed points do not match its header"),
    "layer": (lambda path: begin_of(path) + 8 + 40 + 4, "<I", 2**32 - 1, "compressed points do not match its header"),
    "kind": (items_of, "<H", 1, "uses an unknown compression"),
    "item": (lambda path: items_of(path) + 36, "<H", 65535, "uses an unknown compression"),
    "item kind": (lambda path: items_of(path) + 34, "<H", 99, "uses an unknown compression"),
    "item version": (
        lambda path: items_of(path) + 38,
        "<H",
        4,
        "uses an unknown compression. Save it again as LAS .* by LASzip: it is of version 4",
    ),
    "items": (lambda path: items_of(path) + 32, "<H", 65535, "is broken"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_files_that_lie(tmp_path, what):
    """Of each of these lazrs or laspy would take gigabytes or minutes, or end the program."""
    find, code, value, text = BROKEN[what]
    path = tmp_path / "a.laz"
    write_las(path, 7, "1.4")
    assert read_points(path).colors is not None
    data = bytearray(path.read_bytes())
    struct.pack_into(code, data, find(path), value)
    path.write_bytes(data)
    tracemalloc.start()
    try:
        with pytest.raises(PointCloudError, match=text):
            read_points(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 2e6


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_files_that_are_cut_off(tmp_path, name, share):
    write_las(tmp_path / name)
    data = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(data[: int(share * len(data))])
    with pytest.raises(PointCloudError, match="Export it again|Copy it again|Copy or export it again"):
        read_points(tmp_path / name)


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_files_without_points(tmp_path, name):
    write_las(tmp_path / name, count=0)
    with pytest.raises(PointCloudError, match="has no points"):
        read_points(tmp_path / name)


def test_a_small_file_of_many_equal_points(tmp_path):
    """They are packed better than a hundred to one."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    las = laspy.LasData(header)
    las.x = las.y = las.z = np.zeros(200_000)
    las.write(str(tmp_path / "a.laz"))
    assert (tmp_path / "a.laz").stat().st_size < 60_000
    assert len(read_points(tmp_path / "a.laz").points) == 200_000


def write_flagged(path, point_format=6, withheld=(False, True, False, False, True), classes=(2, 2, 5, 7, 18)):
    """Write points at the heights 0, 1, ..., with flags and classes."""
    las = laspy.LasData(laspy.LasHeader(point_format=point_format, version="1.4" if point_format >= 6 else "1.2"))
    las.x = las.y = las.z = np.arange(float(len(classes)))
    las.classification, las.withheld = np.array(classes), np.array(withheld)
    las.synthetic = las.key_point = np.ones(len(classes), bool)  # which say nothing against a point
    las.write(str(path))


class TestWhatIsChosen:
    @pytest.mark.parametrize("point_format", [0, 3, 6, 7])
    @pytest.mark.parametrize("name", ["a.las", "a.laz"])
    def test_withheld_points_are_left_out(self, tmp_path, name, point_format):
        write_flagged(tmp_path / name, point_format)
        table = read_points(tmp_path / name)
        assert table.points[:, 2].tolist() == [0.0, 2.0, 3.0]
        assert table.attributes["classification"].tolist() == [2, 5, 7]
        assert len(table.notices) == 1
        assert "left out 2 withheld points" in table.notices[0]

    def test_or_kept_with_their_flag(self, tmp_path):
        write_flagged(tmp_path / "a.las")
        table = read_points(tmp_path / "a.las", las=LasChoices(withheld=True))
        assert table.points[:, 2].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
        assert table.attributes["withheld"].tolist() == [0, 1, 0, 0, 1]
        assert "2 points are withheld" in table.notices[0]

    def test_without_any_nothing_is_told(self, tmp_path):
        write_flagged(tmp_path / "a.las", withheld=np.zeros(5, bool))
        table = read_points(tmp_path / "a.las")
        assert ("withheld" in table.attributes, table.notices) == (False, [])

    def test_classes(self, tmp_path):
        write_flagged(tmp_path / "a.las")
        table = read_points(tmp_path / "a.las", las=LasChoices(parse_classes("2, 5")))
        assert table.points[:, 2].tolist() == [0.0, 2.0]
        assert "left out 1 points of other classes" in table.notices[1]

    def test_options_of_the_command_line(self, run, tmp_path):
        write_flagged(tmp_path / "a.las")
        for options, count in ((["--classes", "2"], 1), (["--classes", "2", "--withheld"], 2), ([], 3)):
            code, [line] = run("info", tmp_path / "a.las", *options)
            assert (code, line.get("points")) == (0, count), line
        code, [line] = run("info", tmp_path / "a.las", "--classes", "ground")
        assert (code, "no class of LAS" in line["error"]) == (1, True)

    def test_classes_in_many_blocks(self, tmp_path):
        count = 2**17 + 10
        classes = np.arange(count) % 7
        write_flagged(tmp_path / "a.las", 7, np.arange(count) % 10 == 0, classes)
        table = read_points(tmp_path / "a.las", las=LasChoices(parse_classes("3-4")))
        kept = np.flatnonzero(np.isin(classes, [3, 4]) & (np.arange(count) % 10 > 0))
        assert_array_equal(table.points[:, 0], kept)
        assert_array_equal(table.attributes["classification"], classes[kept])

    def test_colors_go_with_their_points(self, tmp_path):
        las = laspy.LasData(laspy.LasHeader(point_format=2, version="1.2"))
        las.x = las.y = las.z = np.arange(3.0)
        las.red, las.withheld = np.array([65535, 256, 0]), np.array([False, True, False])
        las.write(str(tmp_path / "a.las"))
        assert read_points(tmp_path / "a.las").colors[:, 0].tolist() == [1.0, 0.0]

    def test_when_nothing_is_left_it_says_what_there_is(self, tmp_path):
        write_flagged(tmp_path / "a.las")
        with pytest.raises(PointCloudError, match="no points of the classes 9. Choose some of 2 .1 points., 5"):
            read_points(tmp_path / "a.las", las=LasChoices(parse_classes("9")))
        write_flagged(tmp_path / "a.las", withheld=np.ones(5, bool))
        with pytest.raises(PointCloudError, match="no points but 5 withheld points"):
            read_points(tmp_path / "a.las")

    @pytest.mark.parametrize(
        ("text", "classes"), [("", []), (" ", []), ("2 5", [2, 5]), ("2,5; 9", [2, 5, 9]), ("3-5 2", [2, 3, 4, 5])]
    )
    def test_classes_are_given_as_text(self, text, classes):
        assert sorted(parse_classes(text)) == classes

    @pytest.mark.parametrize("text", ["ground", "256", "5-3", "-1", "2.5", "\u0662"])
    def test_what_is_no_class_is_told(self, text):
        with pytest.raises(PointCloudError, match="is no class of LAS"):
            parse_classes(text)


class TestDegrees:
    PLACES = np.array([[-94.683, 31.037, 39.0], [-94.66, 31.04, 78.0], [-94.67, 31.047, 50.0]])

    def write(self, path, details, places):
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.offsets, header.scales = places[0], np.full(3, 1e-6)
        header.vlrs.extend(details)
        las = laspy.LasData(header)
        las.x, las.y, las.z = places.T
        las.write(str(path))

    def words(self, text):
        return laspy.vlrs.known.WktCoordinateSystemVlr(text)

    def keys(self, model):
        detail = laspy.vlrs.known.GeoKeyDirectoryVlr()
        detail.parse_record_data(struct.pack("<8H", 1, 1, 0, 1, 1024, 0, 1, model))
        return detail

    def test_are_told_by_the_file(self, tmp_path):
        wide = self.PLACES * (1.0, 1.0, 0.0)  # nobody could tell by the numbers
        for detail, degrees in (
            (self.words('GEOGCS["WGS 84"]'), True),
            (self.words('COMPD_CS["a", PROJCS["b", GEOGCS["WGS 84"]]]'), False),
            (self.words('GEOGCRS["WGS 84"]'), True),
            (self.keys(2), True),
            (self.keys(1), False),
        ):
            self.write(tmp_path / "a.las", [detail], wide)
            table = read_points(tmp_path / "a.las")
            assert table.degrees == degrees
            assert sum("are degrees" in notice for notice in table.notices) == degrees

    def test_are_not_what_is_beyond_them(self, tmp_path):
        self.write(tmp_path / "a.las", [self.keys(2)], 10.0 * self.PLACES)
        table = read_points(tmp_path / "a.las")
        assert (table.degrees, table.notices) == (False, [])


@pytest.mark.parametrize(("point_format", "version"), [(1, "1.2"), (3, "1.2"), (6, "1.4"), (7, "1.4")])
def test_times_keep_their_digits_and_are_absent_where_all_are_zero(tmp_path, point_format, version):
    las = laspy.LasData(laspy.LasHeader(point_format=point_format, version=version))
    las.x = las.y = las.z = np.arange(3.0)
    las.write(str(tmp_path / "a.las"))
    assert "gps_time" not in read_points(tmp_path / "a.las").attributes
    las.gps_time = np.array([3e8, 3e8 + 1e-6, 3e8 + 2e-6])
    las.write(str(tmp_path / "b.las"))
    assert read_points(tmp_path / "b.las").attributes["gps_time"].tolist() == las.gps_time.tolist()
