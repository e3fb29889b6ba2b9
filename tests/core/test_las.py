"""LAS and LAZ files become PLY files that keep their coordinates, outside Blender."""

import subprocess
import sys
from pathlib import Path

import laspy
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

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


def convert(*paths):
    return subprocess.run(
        [sys.executable, "-m", "scripts.las_to_ply", *map(str, paths)], cwd=ROOT, capture_output=True, text=True
    )


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_coordinates_and_columns_survive(tmp_path, name):
    write_las(tmp_path / name)
    done = convert(tmp_path / name)
    assert (done.returncode, done.stderr) == (0, "")
    assert "500 points, intensity, classification" in done.stdout
    table = read_points(tmp_path / "a.ply")
    assert_allclose(table.points, POINTS, rtol=0.0, atol=1e-6)
    assert_array_equal(table.attributes["intensity"], np.arange(500))
    assert_array_equal(table.attributes["classification"], np.full(500, 2))
    assert_allclose(table.attributes["height"], np.linspace(0.0, 1.0, 500), atol=1e-6)
    assert_allclose(table.colors[0], [1.0, 0.0, 0.5, 1.0], atol=0.01)
    again = convert(tmp_path / name)
    assert again.returncode == 1
    assert "exists already" in again.stderr


def test_broken_files(tmp_path):
    (tmp_path / "a.las").write_bytes(b"LASF, but no more")
    write_las(tmp_path / "b.laz", POINTS[:0])
    for name, text in (("a.las", "cannot be read"), ("b.laz", "no points"), ("c.las", "cannot be read")):
        done = convert(tmp_path / name)
        assert done.returncode == 1
        assert text in done.stderr
        assert "Traceback" not in done.stderr
    assert not list(tmp_path.glob("*.ply"))
