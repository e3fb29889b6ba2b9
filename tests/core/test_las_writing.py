"""LAS files written: what is read back is what was given."""

import numpy as np
import pytest

from core import InvalidPointsError
from core.files import PointTable, read_points, write_pieces

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
    for name in ("classification", "intensity", "lb_area", "lb_boundary", "lb_component"):
        np.testing.assert_array_equal(table.attributes[name], attributes[name])
    for name, values in zip("xyz", attributes["normal"].T, strict=True):
        np.testing.assert_array_equal(table.attributes[f"n{name}"], values)


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
