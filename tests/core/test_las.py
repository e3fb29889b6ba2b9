"""LAS and LAZ files: coordinates in double precision, and what else scanners write."""

import sys

import laspy
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from core import PointCloudError
from core.files import read_points

POINTS = np.round(np.random.default_rng(0).uniform(0.0, 100.0, (500, 3)), 3) + [446_000.0, 4_000_000.0, 120.0]


def write_las(path, points=POINTS, kind=2, version="1.2", full=65535):
    header = laspy.LasHeader(point_format=kind, version=version)
    header.offsets, header.scales = np.floor(POINTS.min(axis=0)), np.full(3, 0.001)
    header.add_extra_dim(laspy.ExtraBytesParams("height", np.float32))
    header.add_extra_dim(laspy.ExtraBytesParams("way", "3f8"))
    header.add_extra_dim(laspy.ExtraBytesParams("pair", "2u1"))
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.intensity = np.arange(len(points))
    las.classification = np.full(len(points), 2)
    if "red" in las.point_format.dimension_names:
        las.red, las.green, las.blue = np.tile([[full], [0], [(full + 1) // 2]], len(points))
    las.height = np.linspace(0.0, 1.0, len(points))
    las.way = 2.0 * points
    las.write(str(path))


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize(
    ("kind", "version"), [(0, "1.2"), (1, "1.2"), (2, "1.2"), (3, "1.2"), (6, "1.4"), (7, "1.4"), (8, "1.4")]
)
def test_coordinates_and_columns_survive(tmp_path, suffix, kind, version):
    path = tmp_path / f"a{suffix}"
    write_las(path, kind=kind, version=version)
    table = read_points(path)
    assert_allclose(table.points, POINTS, rtol=0.0, atol=1e-6)
    assert not table.single
    assert_array_equal(table.attributes["intensity"], np.arange(500))
    assert_array_equal(table.attributes["classification"], np.full(500, 2))
    assert_allclose(table.attributes["height"], np.linspace(0.0, 1.0, 500), atol=1e-6)
    assert_allclose(table.attributes["way"], 2.0 * POINTS)
    assert "pair" not in table.attributes
    if kind in (2, 3, 7, 8):
        assert_allclose(table.colors, np.tile([1.0, 0.0, 0.5, 1.0], (500, 1)), atol=0.01)
    else:
        assert table.colors is None


def test_colors_of_eight_bits(tmp_path):
    write_las(tmp_path / "a.las", full=255)
    assert_allclose(read_points(tmp_path / "a.las").colors[0], [1.0, 0.0, 0.5, 1.0], atol=0.01)


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_more_points_than_one_block(monkeypatch, tmp_path, name):
    write_las(tmp_path / name)
    monkeypatch.setattr("core.files.las._BLOCK", 64)
    table = read_points(tmp_path / name)
    assert_allclose(table.points, POINTS, rtol=0.0, atol=1e-6)
    assert_array_equal(table.attributes["intensity"], np.arange(500))


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_a_header_that_names_too_many_points(tmp_path, name):
    """They are refused before there is memory for them."""
    write_las(tmp_path / name)
    data = bytearray((tmp_path / name).read_bytes())
    data[107:111] = b"\xff\xff\xff\x7f"  # their number
    (tmp_path / name).write_bytes(data)
    with pytest.raises(PointCloudError, match="too short for the 2,147,483,647 points .* Copy it again"):
        read_points(tmp_path / name)


def test_no_points(tmp_path):
    write_las(tmp_path / "a.laz", POINTS[:0])
    with pytest.raises(PointCloudError, match="no points"):
        read_points(tmp_path / "a.laz")


def test_without_laspy(monkeypatch, tmp_path):
    write_las(tmp_path / "a.las")
    monkeypatch.setitem(sys.modules, "lazrs", None)
    with pytest.raises(PointCloudError, match="read by laspy and lazrs, which are not there .* Install both"):
        read_points(tmp_path / "a.las")


def test_more_chunks_than_the_file_can_hold(tmp_path):
    """Lazrs would end the process."""
    path = tmp_path / "a.laz"
    write_las(path)
    data = bytearray(path.read_bytes())
    begin = int.from_bytes(data[96:100], "little")
    table = int.from_bytes(data[begin : begin + 8], "little")
    data[table + 4 : table + 8] = b"\xff" * 4
    path.write_bytes(data)
    with pytest.raises(PointCloudError, match="too short for the chunks"):
        read_points(path)


def test_what_lazrs_does_not_expect(tmp_path):
    path = tmp_path / "a.laz"
    write_las(path)
    data = path.read_bytes()
    items = data.index(b"laszip encoded") + 52 + 32  # how many parts a point has, in the record of that name
    path.write_bytes(data[:items] + bytes(2) + data[items + 2 :])
    with pytest.raises(PointCloudError, match="is a broken LA. file"):
        read_points(path)
