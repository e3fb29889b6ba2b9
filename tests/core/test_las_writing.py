"""LAS files written: what is read back is what was given."""

import laspy
import numpy as np
import pytest

from core import InvalidPointsError
from core.files import PointTable, read_points, write_pieces, write_points

POINTS = np.random.default_rng(0).random((50, 3)) * [300.0, 200.0, 10.0] + [400_000.0, 5_000_000.0, 100.0]


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_points_columns_and_colors_come_back(tmp_path, suffix):
    rng = np.random.default_rng(1)
    colors = np.append(rng.integers(0, 256, (50, 3)) / 255.0, np.ones((50, 1)), axis=1).astype(np.float32)
    attributes = {
        "classification": rng.integers(0, 19, 50).astype(np.uint8),
        "intensity": rng.integers(0, 60_000, 50),
        "normal": rng.normal(size=(50, 3)).astype(np.float32),
        "lb_area": rng.random(50).astype(np.float32),
        "lb_boundary": rng.random(50) < 0.5,
        "lb_component": rng.integers(-1, 300, 50),
    }
    path = tmp_path / f"a{suffix}"
    assert write_pieces(path, lambda: [PointTable(POINTS, attributes, colors)]) == []
    table = read_points(path)
    np.testing.assert_allclose(table.points, POINTS, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(table.colors, colors, atol=1e-6)
    for name in attributes:
        np.testing.assert_array_equal(table.attributes[name], attributes[name])
    extra = laspy.read(path).point_format.extra_dimension_names
    assert [name for name in extra if name.startswith("N")] == ["NormalX", "NormalY", "NormalZ"]


def test_numbers_that_a_column_does_not_hold_become_extra_ones(tmp_path):
    table = PointTable(POINTS, {"intensity": np.linspace(-1.0, 1.0, 50)})
    [notice] = write_pieces(tmp_path / "a.laz", lambda: [table])
    assert "intensity is written as intensity_2" in notice
    found = read_points(tmp_path / "a.laz").attributes
    np.testing.assert_array_equal(found["intensity_2"], table.attributes["intensity"])


def test_long_names_are_told(tmp_path):
    names = ["a column whose name is quite long " + end for end in ("1", "2")]
    notices = write_pieces(tmp_path / "a.laz", lambda: [PointTable(POINTS, {name: np.arange(50) for name in names})])
    assert len(notices) == 2
    assert len([name for name in read_points(tmp_path / "a.laz").attributes if name.startswith("a column")]) == 2


@pytest.mark.parametrize("suffix", [".las", ".laz", ".ply", ".csv", ".xyz"])
def test_pieces_are_one_file_as_of_one_table(tmp_path, suffix):
    """Steps, offsets and types are those of all, whatever the first piece would take."""
    attributes = {
        "intensity": np.append(np.arange(49), 60_000),  # the last does not fit the type of the others
        "lb_component": np.append(np.full(49, -1), 70_000),
        "hash": np.append(np.arange(49), 2**61 + 1),
        "value": np.append(np.arange(49.0), 1.0 / 3.0),
        "single": np.linspace(0.0, 1.0, 50, dtype=np.float32),
    }
    parts = [slice(0, 20), slice(20, 20), slice(20, 50)]
    colors = np.random.default_rng(0).integers(0, 256, (50, 4)).astype(np.float32) / 255.0
    tables = [
        PointTable(POINTS[rows], {name: values[rows] for name, values in attributes.items()}, colors[rows])
        for rows in parts
    ]
    whole, pieces = tmp_path / f"whole{suffix}", tmp_path / f"pieces{suffix}"
    notices = write_pieces(whole, lambda: [PointTable(POINTS, attributes, colors)])
    assert [text.replace("pieces", "whole") for text in write_pieces(pieces, lambda: iter(tables))] == notices
    found = read_points(pieces)
    if suffix in (".csv", ".xyz"):  # digits of single precision are as many as a piece needs
        wanted = read_points(whole)
        np.testing.assert_array_equal(found.points, wanted.points)
        np.testing.assert_allclose(found.attributes["single"], wanted.attributes["single"], rtol=1e-7)
    else:
        assert pieces.read_bytes() == whole.read_bytes()
    np.testing.assert_array_equal(found.attributes["intensity"], attributes["intensity"])
    np.testing.assert_array_equal(found.attributes["value"], attributes["value"])


def test_pieces_of_different_columns_are_refused(tmp_path):
    tables = [PointTable(POINTS, {"a": np.zeros(50)}), PointTable(POINTS, {"b": np.zeros(50)})]
    with pytest.raises(InvalidPointsError, match="a, b are in some only"):
        write_pieces(tmp_path / "a.ply", lambda: tables)
    assert list(tmp_path.iterdir()) == []


class TestOfOtherKindsOfFiles:
    def test_returns_are_valid(self, tmp_path):
        assert write_points(tmp_path / "a.las", PointTable(POINTS)) == []
        las = laspy.read(tmp_path / "a.las")
        assert (las.point_format.id, str(las.header.version)) == (6, "1.4")
        assert (np.array(las.return_number) == 1).all()
        assert (np.array(las.number_of_returns) == 1).all()
        assert las.header.number_of_points_by_return[0] == 50
        assert las.header.global_encoding.wkt  # as of all point formats from 6 on

    @pytest.mark.parametrize(("last", "kind"), [(604_800.0, 0), (3e8, 1)])
    def test_times_beyond_a_week_do_not_count_from_its_begin(self, tmp_path, last, kind):
        notices = write_points(tmp_path / "a.las", PointTable(POINTS, {"gps_time": np.linspace(0.0, last, 50)}))
        assert laspy.read(tmp_path / "a.las").header.global_encoding.gps_time_type == kind
        assert notices == kind * ["a.las: gps_time goes beyond a week, so it is written as standard GPS time."]

    def test_returns_of_an_unknown_number_are_told(self, tmp_path):
        table = PointTable(POINTS, {"return_number": np.arange(50) % 4})
        [notice] = write_points(tmp_path / "a.las", table)
        assert "a.las: no column tells how many returns a pulse had" in notice
        las = laspy.read(tmp_path / "a.las")
        np.testing.assert_array_equal(las.return_number, np.arange(50) % 4)
        np.testing.assert_array_equal(las.number_of_returns, np.maximum(np.arange(50) % 4, 1))

    def test_columns_choose_the_point_format(self, tmp_path):
        angle = {"scan_angle_rank": np.arange(-25, 25), "gps_time": np.linspace(0.0, 1.0, 50)}
        write_points(tmp_path / "a.las", PointTable(POINTS, angle))
        las = laspy.read(tmp_path / "a.las")
        assert (las.point_format.id, list(las.point_format.extra_dimension_names)) == (1, [])
        np.testing.assert_array_equal(las.scan_angle_rank, np.arange(-25, 25))
        infrared = {"nir": np.arange(50), "scan_angle": np.arange(-25, 25)}
        write_points(tmp_path / "b.las", PointTable(POINTS, infrared, np.ones((50, 4), np.float32)))
        las = laspy.read(tmp_path / "b.las")
        assert las.point_format.id == 8
        np.testing.assert_array_equal(las.scan_angle, np.arange(-25, 25))

    def test_transparency_is_told(self, tmp_path):
        colors = np.full((50, 4), 0.5, np.float32)
        [notice] = write_points(tmp_path / "a.las", PointTable(POINTS, {}, colors))
        assert notice == "a.las: left out the transparency of colors, which LAS does not have."


class TestSteps:
    def read(self, tmp_path, step=0.01):
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.scales, header.offsets = np.full(3, step), POINTS.mean(axis=0)
        las = laspy.LasData(header)
        las.x, las.y, las.z = POINTS.T
        las.write(str(tmp_path / "a.las"))
        return read_points(tmp_path / "a.las"), las.header

    def test_stay_where_single_precision_has_rounded_points(self, tmp_path):
        table, header = self.read(tmp_path)
        places = table.points.copy()
        local = (places - POINTS[0]).astype(np.float32)
        table.points = table.las.restored(POINTS[0] + local, np.spacing(np.abs(local).max()))
        np.testing.assert_array_equal(table.points, places)
        table.points[0] += 1e-4
        np.testing.assert_array_equal(table.las.restored(table.points, 1e-6), table.points)
        table.points[0] -= 1e-4
        assert write_points(tmp_path / "b.las", table) == []
        found = laspy.read(tmp_path / "b.las")
        np.testing.assert_array_equal(found.header.scales, header.scales)
        np.testing.assert_allclose(found.xyz, places, rtol=1e-15)

    def test_are_fine_enough_for_points_that_moved(self, tmp_path):
        table, header = self.read(tmp_path)
        table.points[:, 2] += np.linspace(0.0, 1e-3, 50)
        assert write_points(tmp_path / "b.las", table) == []
        found = laspy.read(tmp_path / "b.las")
        assert found.header.scales[2] < 1e-5
        np.testing.assert_array_equal(found.header.scales[:2], header.scales[:2])
        np.testing.assert_allclose(found.xyz, table.points, rtol=0.0, atol=1e-6)

    def test_are_coarser_where_points_reach_too_far(self, tmp_path):
        table, _ = self.read(tmp_path, 1e-6)
        table.points *= 1e4
        [notice] = write_points(tmp_path / "b.las", table)
        assert "coordinates are rounded to 0.01, not to 1e-06 as in the file that they are from" in notice
