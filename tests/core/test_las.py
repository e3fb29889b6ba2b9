"""LAS and LAZ files become PLY files that keep their coordinates, outside Blender."""

import subprocess
import sys
from pathlib import Path

import laspy
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import las_to_ply
from core.files import read_points

ROOT = Path(__file__).parents[2]
POINTS = np.round(np.random.default_rng(0).uniform(0.0, 100.0, (500, 3)), 3) + [446_000.0, 4_000_000.0, 120.0]


def write_las(path, points=POINTS):
    header = laspy.LasHeader(point_format=2, version="1.2")
    header.offsets, header.scales = np.floor(POINTS.min(axis=0)), np.full(3, 0.001)
    header.add_extra_dim(laspy.ExtraBytesParams("height", np.float32))
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.intensity = np.arange(len(points))
    las.classification = np.full(len(points), 2)
    las.red, las.green, las.blue = np.tile([[65535], [0], [32768]], len(points))
    las.height = np.linspace(0.0, 1.0, len(points))
    las.write(str(path))


@pytest.fixture
def convert(monkeypatch):
    def run(*paths):
        monkeypatch.setattr(sys, "argv", ["las_to_ply.py", *map(str, paths)])
        las_to_ply.main()

    return run


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_coordinates_and_columns_survive(convert, capsys, tmp_path, name):
    write_las(tmp_path / name)
    convert(tmp_path / name)
    printed = capsys.readouterr()
    assert "500 points, intensity, classification" in printed.out
    assert printed.err == ""
    table = read_points(tmp_path / "a.ply")
    assert_allclose(table.points, POINTS, rtol=0.0, atol=1e-6)
    assert_array_equal(table.attributes["intensity"], np.arange(500))
    assert_array_equal(table.attributes["classification"], np.full(500, 2))
    assert_allclose(table.attributes["height"], np.linspace(0.0, 1.0, 500), atol=1e-6)
    assert_allclose(table.colors[0], [1.0, 0.0, 0.5, 1.0], atol=0.01)
    with pytest.raises(SystemExit, match="exists already"):
        convert(tmp_path / name)


def test_as_a_program(tmp_path):
    write_las(tmp_path / "a.las")
    command = [sys.executable, "-m", "scripts.las_to_ply", str(tmp_path / "a.las")]
    first, again = (subprocess.run(command, cwd=ROOT, capture_output=True, text=True) for _ in range(2))
    assert (first.returncode, first.stderr) == (0, "")
    assert "500 points" in first.stdout
    assert again.returncode == 1
    assert "exists already" in again.stderr
    assert "Traceback" not in again.stderr


def test_broken_files(convert, tmp_path):
    (tmp_path / "a.las").write_bytes(b"LASF, but no more")
    write_las(tmp_path / "b.laz", POINTS[:0])
    for name, text in (("a.las", "cannot be read"), ("b.laz", "no points"), ("c.las", "cannot be read")):
        with pytest.raises(SystemExit, match=text):  # said, without a traceback
            convert(tmp_path / name)
    assert not list(tmp_path.glob("*.ply"))


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_a_header_that_names_too_many_points(convert, tmp_path, name):
    """They are refused before there is memory for them."""
    write_las(tmp_path / name)
    data = bytearray((tmp_path / name).read_bytes())
    data[107:111] = b"\xff\xff\xff\x7f"  # their number
    (tmp_path / name).write_bytes(data)
    with pytest.raises(SystemExit, match="too short for the 2,147,483,647 points .* Copy it again"):
        convert(tmp_path / name)
