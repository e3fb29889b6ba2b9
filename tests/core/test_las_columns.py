"""All columns of LAS and LAZ, and what their headers state, survive whatever the program does with the points."""

import json

import laspy
import numpy as np
import pytest

from core.files import LasChoices, LasForm, read_points, write_points
from tests.core.las_files import RECORDS, STATED, WAVEFORMS, WKT, check_same, records, save, write_all

NORMALS = ("NormalX", "NormalY", "NormalZ")  # which an analysis replaces


def joined(paths):
    """Return the points of several files as of one."""
    files = [laspy.read(path) for path in paths]
    header = files[0].header
    las = laspy.LasData(header)
    las.points = laspy.ScaleAwarePointRecord(
        np.concatenate([file.points.array for file in files]), header.point_format, header.scales, header.offsets
    )
    return las


@pytest.mark.parametrize("kind", range(11))
class TestEveryPointFormat:
    @pytest.mark.parametrize("names", ["a.las b.laz", "a.laz b.las"])
    def test_convert(self, run, tmp_path, kind, names):
        source, target = (tmp_path / name for name in names.split())
        given = write_all(source, kind)
        code, [line] = run("convert", source, "--out", target)
        assert code == 0
        check_same(laspy.read(target), given)
        assert len(line["notices"]) == (kind in WAVEFORMS)
        assert all("left out the waveforms" in notice for notice in line["notices"])

    def test_analyze(self, run, tmp_path, kind):
        given = write_all(tmp_path / "a.las", kind)
        assert run("analyze", tmp_path / "a.las", "--out", tmp_path / "b.laz")[0] == 0
        found = laspy.read(tmp_path / "b.laz")
        check_same(found, given, NORMALS)
        assert (found["lb_area"] > 0.0).all()
        assert (found["NormalZ"] ** 2 > 0.5).all()

    def test_tiles(self, run, tmp_path, kind):
        given = write_all(tmp_path / "a.laz", kind)
        out = tmp_path / "out"
        arguments = ("--tile-points", 120, "--format", "laz", "--one-file", tmp_path / "one.las")
        assert run("tiles", "run", tmp_path / "a.laz", "--out-dir", out, *arguments)[0] == 0
        tiles = sorted(out.glob("*.laz"))
        assert len(tiles) == 2
        check_same(joined(tiles), given, NORMALS)
        check_same(laspy.read(tmp_path / "one.las"), given, NORMALS)

    def test_fewer_points(self, run, tmp_path, kind):
        given = write_all(tmp_path / "a.las", kind, withheld=True)
        code, _ = run(
            "thin-out", tmp_path / "a.las", "--withheld", "--count", 50, "--by", "NUMBER", "--out", tmp_path / "b.las"
        )
        assert code == 0
        found = laspy.read(tmp_path / "b.las")
        rows = np.flatnonzero(np.isin(given.points.array[["X", "Y", "Z"]], found.points.array[["X", "Y", "Z"]]))
        given.points = given.points[rows]
        check_same(found, given)


@pytest.mark.parametrize("full", [1, 255, 1023, 65535])
def test_colors_keep_their_range(tmp_path, full):
    given = write_all(tmp_path / "a.las", 7, full=full)
    write_points(tmp_path / "b.laz", read_points(tmp_path / "a.las"))
    check_same(laspy.read(tmp_path / "b.laz"), given)


def test_columns_and_systems_that_other_files_know_nothing_of(run, tmp_path):
    """What is zero everywhere is no column, and written as zeros again."""
    las = laspy.LasData(laspy.LasHeader(point_format=1, version="1.2"))
    las.x = las.y = las.z = np.arange(10.0)
    las.user_data = np.arange(10)
    las.write(str(tmp_path / "a.las"))
    table = read_points(tmp_path / "a.las")
    assert list(table.attributes) == ["intensity", "classification", "return_number", "user_data"]
    write_points(tmp_path / "b.las", table)
    found = laspy.read(tmp_path / "b.las")
    assert found.points.array.tobytes() == las.points.array.tobytes()


def test_a_column_of_another_format_is_not_lost(tmp_path):
    write_all(tmp_path / "a.las", 0)
    table = read_points(tmp_path / "a.las")
    table.attributes["gps_time"] = np.linspace(0.0, 1.0, len(table.points))
    table.colors = np.ones((len(table.points), 4), np.float32)
    table.attributes["user_data"] = np.full(len(table.points), 256)
    [notice] = write_points(tmp_path / "b.las", table)
    assert "user_data is written as user_data_2" in notice
    found = laspy.read(tmp_path / "b.las")
    assert found.point_format.id == 3
    np.testing.assert_array_equal(found.gps_time, table.attributes["gps_time"])
    assert (found.red == 65535).all()
    assert (found["user_data_2"] == 256).all()


def test_numbers_that_extra_bytes_do_not_hold_get_another_type(tmp_path):
    write_all(tmp_path / "a.las", 6)
    table = read_points(tmp_path / "a.las")
    count = len(table.points)
    table.attributes |= {"Deviation": np.full(count, -1), "Amplitude": np.full(count, 1e4)}
    assert write_points(tmp_path / "b.las", table) == []
    found = laspy.read(tmp_path / "b.las")
    assert (found["Deviation"] == -1).all()
    assert (found["Amplitude"] == 1e4).all()


class TestRecords:
    def test_of_some_files_are_those_of_all(self, run, tmp_path):
        write_all(tmp_path / "a.las", 6)
        given = write_all(tmp_path / "b.las", 6)
        given.header.file_source_id = 18
        given.header.vlrs.pop(given.header.vlrs.index("VLR"))  # the first one that laspy has no class of its own for
        given.header.vlrs.append(laspy.VLR("someone", 8, "", b"x"))
        given.header.system_identifier = "other"
        save(given, tmp_path / "b.las")
        sources, out = (tmp_path / "a.las", tmp_path / "b.las"), tmp_path / "out"
        _, [line] = run("tiles", "run", *sources, "--out-dir", out, "--tile-points", 500, "--format", "laz")
        assert (
            "Left out records of headers that are not the same in all files: LASF_Spec 3, someone 8." in line["notices"]
        )
        found = laspy.read(out / "tile_000000.laz")
        assert [(user, number) for user, number, *_ in records(found)] == [("LASF_Spec", 0), ("someone", 7)]
        assert (found.header.file_source_id, found.header.system_identifier) == (0, "OTHER")
        assert found.header.creation_date == STATED["creation_date"]

    def test_of_the_points_alone_are_told(self, tmp_path):
        """Where points are in the file, a histogram, and what is longer than a record before the points may be."""
        given = write_all(tmp_path / "a.las", 6)
        given.header.vlrs.append(laspy.VLR("LAStools", 30, "", bytes(9)))
        given.header.vlrs.append(laspy.VLR("LASF_Spec", 2, "", bytes(9)))
        given.evlrs = laspy.vlrs.vlrlist.VLRList([laspy.VLR("someone", 9, "", bytes(70_000))])
        given.evlrs.append(laspy.VLR("someone", 10, "after", b"points"))
        save(given, tmp_path / "a.las")
        table = read_points(tmp_path / "a.las")
        [notice] = table.notices
        assert "left out records of its header, LAStools 30, LASF_Spec 2, someone 9," in notice
        assert write_points(tmp_path / "b.laz", table) == []
        found = records(laspy.read(tmp_path / "b.laz"))
        assert [record[:2] for record in found] == [*(record[:2] for record in RECORDS), ("someone", 10)]
        assert found[-1][2:] == ("after", b"points")

    def test_are_what_a_second_file_has_of_the_first(self, tmp_path):
        """Through JSON, as Blender and the folders of tiles keep them."""
        given = write_all(tmp_path / "a.las", 7)
        table = read_points(tmp_path / "a.las")
        table.las = LasForm(**json.loads(json.dumps(table.las.to_json())))
        write_points(tmp_path / "b.laz", table)
        check_same(laspy.read(tmp_path / "b.laz"), given)


def test_the_compatible_mode_of_laszip_is_told(tmp_path):
    """Points of LAS 1.4 as of older versions, with what these lack in extra bytes, and a record that counts them."""
    given = write_all(tmp_path / "a.las", 1)
    given.add_extra_dim(laspy.ExtraBytesParams("LAS 1.4 classification", "u1"))
    given["LAS 1.4 classification"] = np.full(len(given.points), 64)
    given.header.vlrs.append(laspy.VLR("lascompatible", 22204, "", bytes(156)))
    save(given, tmp_path / "a.las")
    table = read_points(tmp_path / "a.las")
    assert (table.attributes["LAS 1.4 classification"] == 64).all()
    lost, told = table.notices
    assert "lascompatible 22204" in lost
    assert "classes above 31" in told
    write_points(tmp_path / "b.las", table)
    found = laspy.read(tmp_path / "b.las")
    assert (found["LAS 1.4 classification"] == 64).all()
    assert "lascompatible" not in {user for user, *_ in records(found)}


class TestTimesThatBeginElsewhere:
    """LAS 1.5, whose times count from a number of millions of seconds."""

    def test_are_kept_and_told(self, run, tmp_path):
        given = write_all(tmp_path / "a.las", 7, begin=1400)
        assert (str(given.header.version), given.header.gps_time_offset) == ("1.5", 1400)
        code, [line] = run("convert", tmp_path / "a.las", "--out", tmp_path / "b.laz")
        [notice] = line["notices"]
        assert (code, "GPS times begin 1400 million seconds after the begin of GPS time" in notice) == (0, True)
        check_same(laspy.read(tmp_path / "b.laz"), given)

    def test_of_some_files_are_told(self, run, tmp_path):
        write_all(tmp_path / "a.las", 7, begin=1400)
        write_all(tmp_path / "b.las", 7)
        sources, out = (tmp_path / "a.las", tmp_path / "b.las"), tmp_path / "out"
        _, [line] = run("tiles", "run", *sources, "--out-dir", out, "--tile-points", 500, "--format", "laz")
        assert any("The GPS times of some files count from another begin" in notice for notice in line["notices"])
        assert not laspy.read(out / "tile_000000.laz").header.global_encoding.gps_time_offset


class TestSystem:
    def test_does_not_hold_for_other_units(self, tmp_path):
        feet = 'PROJCS["a",GEOGCS["b"],UNIT["foot",0.3048]]'
        given = write_all(tmp_path / "a.las", 6, wkt=feet)
        table = read_points(tmp_path / "a.las", las=LasChoices(meters=True))
        assert any("Its coordinate system does not hold for these, and is not kept" in text for text in table.notices)
        write_points(tmp_path / "b.las", table)
        found = laspy.read(tmp_path / "b.las")
        assert not found.header.vlrs.get("WktCoordinateSystemVlr")
        np.testing.assert_array_equal(found.X, given.X)
        np.testing.assert_allclose(found.xyz, 0.3048 * given.xyz, rtol=1e-12)

    def test_may_follow_the_points(self, tmp_path):
        given = write_all(tmp_path / "a.las", 6)
        record = given.header.vlrs.extract("WktCoordinateSystemVlr")[0]
        given.evlrs = laspy.vlrs.vlrlist.VLRList([laspy.VLR("someone", 1, "", bytes(70_000)), record])
        for name in ("b.las", "b.laz"):
            save(given, tmp_path / name)
            table = read_points(tmp_path / name)
            write_points(tmp_path / "c.laz", table)
            [found] = laspy.read(tmp_path / "c.laz").header.vlrs.get("WktCoordinateSystemVlr")
            assert found.record_data_bytes() == record.record_data_bytes()

    def test_of_some_files_is_that_of_all(self, run, tmp_path):
        write_all(tmp_path / "a.las", 6, wkt="")
        write_all(tmp_path / "b.las", 6)
        out = tmp_path / "out"
        sources = (tmp_path / "a.las", tmp_path / "b.las")
        _, [line] = run("tiles", "run", *sources, "--out-dir", out, "--tile-points", 500, "--format", "laz")
        assert "1 of the files state no coordinate system. That of the others is kept." in line["notices"]
        [record] = laspy.read(out / "tile_000000.laz").header.vlrs.get("WktCoordinateSystemVlr")
        assert record.string == WKT

    def test_of_files_that_differ_is_told_and_not_written(self, run, tmp_path):
        write_all(tmp_path / "a.las", 6, scale=0.001)
        write_all(tmp_path / "b.las", 7, scale=0.0001, wkt='PROJCS["other",GEOGCS["b"],UNIT["metre",1]]', time=0)
        out = tmp_path / "out"
        sources = (tmp_path / "a.las", tmp_path / "b.las")
        code, [line] = run("tiles", "run", *sources, "--out-dir", out, "--tile-points", 500, "--format", "laz")
        assert code == 0
        told = " ".join(line["notices"])
        assert "The files state different coordinate systems" in told
        assert "The GPS times of some files count from another begin" in told
        found = laspy.read(out / "tile_000000.laz")
        assert not found.header.vlrs.get("WktCoordinateSystemVlr")
        assert (found.point_format.id, found.header.scales[0]) == (7, 0.0001)
        assert (np.array(found.number_of_returns) >= np.array(found.return_number)).all()


def test_normals_of_other_programs(tmp_path):
    for names in (("NormalX", "NormalY", "NormalZ"), ("nx", "ny", "nz"), ("normalx", "normaly", "normalz")):
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.add_extra_dims([laspy.ExtraBytesParams(name, "f4") for name in names])
        las = laspy.LasData(header)
        las.x = las.y = las.z = np.arange(3.0)
        for name, values in zip(names, np.eye(3), strict=True):
            las[name] = values
        las.write(str(tmp_path / "a.las"))
        table = read_points(tmp_path / "a.las")
        np.testing.assert_array_equal(table.attributes["normal"], np.eye(3))
        assert not {*names} & {*table.attributes}
        write_points(tmp_path / "b.las", table)
        assert tuple(laspy.read(tmp_path / "b.las").point_format.extra_dimension_names) == names
