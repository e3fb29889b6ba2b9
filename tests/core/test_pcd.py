"""PCD files in all three kinds of data give what was written, and broken ones are refused."""

import struct
import tracemalloc
from itertools import chain

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from core import PointCloudError
from core.files import read_points

COUNT = 300
KINDS = ("ascii", "binary", "binary_compressed")
POINTS = np.round(np.random.default_rng(0).uniform(-5.0, 5.0, (COUNT, 3)), 3)
RED, GREEN, BLUE = np.random.default_rng(1).integers(0, 256, (3, COUNT), np.uint32)


def pack(data):
    """Pack by LZF, greedily: what came before and is repeated, to itself too, is named by its place."""
    result, literals, seen, place = bytearray(), bytearray(), {}, 0

    def flush():
        for begin in range(0, len(literals), 32):
            part = literals[begin : begin + 32]
            result.append(len(part) - 1)
            result.extend(part)
        literals.clear()

    while place < len(data):
        key = data[place : place + 3]
        before = seen.get(key, -(10**9))
        seen[key] = place
        if len(key) == 3 and place - before <= 8192:
            run = 3
            while run < 264 and place + run < len(data) and data[before + run] == data[place + run]:
                run += 1
            flush()
            back, length = place - before - 1, run - 2
            result.append((min(length, 7) << 5) | (back >> 8))
            if length >= 7:
                result.append(length - 7)
            result.append(back & 255)
            place += run
        else:
            literals.append(data[place])
            place += 1
    flush()
    return bytes(result)


def make_pcd(kind, columns, head=""):
    """Make a file of columns, each an array (n,) or (n, k)."""
    columns = {name: np.asarray(values) for name, values in columns.items()}
    count = len(next(iter(columns.values())))
    lines = {
        "FIELDS": columns,
        "SIZE": [values.dtype.itemsize for values in columns.values()],
        "TYPE": [values.dtype.kind.upper() for values in columns.values()],
        "COUNT": [values[0].size for values in columns.values()],
    }
    text = "# .PCD v0.7\nVERSION 0.7\n" + "".join(f"{key} {' '.join(map(str, row))}\n" for key, row in lines.items())
    text += f"WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\n{head}DATA {kind}\n"
    if kind == "ascii":
        rows = zip(*(values.reshape(count, -1).tolist() for values in columns.values()), strict=True)
        data = "".join(" ".join(map(repr, chain(*row))) + "\n" for row in rows).encode()
    elif kind == "binary":
        rows = np.empty(count, [(f"{i}", v.dtype, v.shape[1:]) for i, v in enumerate(columns.values())])
        for index, values in enumerate(columns.values()):
            rows[f"{index}"] = values
        data = rows.tobytes()
    else:
        whole = b"".join(values.tobytes() for values in columns.values())
        packed = pack(whole)
        data = struct.pack("<II", len(packed), len(whole)) + packed
    return text.encode() + data


def xyz(kind=np.float64, points=POINTS):
    return dict(zip("xyz", points.astype(kind).T, strict=True))


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_is_read(tmp_path, kind):
    label, heat = np.arange(COUNT, dtype=np.uint16), np.linspace(-1.0, 1.0, COUNT, dtype=np.float32)
    columns = xyz() | {
        f"normal_{axis}": np.full(COUNT, value, np.float32) for axis, value in zip("xyz", (0, 0, 1), strict=True)
    }
    columns |= {"label": label, "heat": heat, "constant": np.zeros(COUNT, np.int8)}
    (tmp_path / "a.pcd").write_bytes(make_pcd(kind, columns))
    table = read_points(tmp_path / "a.pcd")
    assert_array_equal(table.points, POINTS)
    assert list(table.attributes) == ["normal", "label", "heat", "constant"]
    assert_array_equal(table.attributes["normal"], np.tile([0.0, 0.0, 1.0], (COUNT, 1)))
    assert_array_equal(table.attributes["label"], label)
    assert table.attributes["label"].dtype == np.uint16
    assert_array_equal(table.attributes["heat"], heat)
    assert table.attributes["constant"].dtype == np.int8
    assert (table.colors, table.single, table.notices) == (None, False, [])


@pytest.mark.parametrize("kind", KINDS)
def test_coordinates_of_single_precision(tmp_path, kind):
    (tmp_path / "a.pcd").write_bytes(make_pcd(kind, xyz(np.float32)))
    table = read_points(tmp_path / "a.pcd")
    assert_allclose(table.points, POINTS, atol=1e-6)
    assert table.single == (kind != "ascii")  # text may hold more digits


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["rgb", "rgba"])
@pytest.mark.parametrize("packed", [np.float32, np.uint32])
def test_colors_in_the_bytes_of_one_number(tmp_path, kind, name, packed):
    bits = RED << 16 | GREEN << 8 | BLUE
    if name == "rgba":
        bits |= np.uint32(128 << 24) if packed == np.uint32 else np.uint32(64 << 24)
    (tmp_path / "a.pcd").write_bytes(make_pcd(kind, xyz() | {name: bits.view(packed)}))
    table = read_points(tmp_path / "a.pcd")
    assert_allclose(table.colors[:, :3], np.stack([RED, GREEN, BLUE], axis=1) / 255.0, atol=1e-6)
    alpha = 1.0 if name == "rgb" else (128 if packed == np.uint32 else 64) / 255.0
    assert_allclose(table.colors[:, 3], alpha, atol=1e-6)
    assert table.attributes == {}


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_sensor_missed_is_left_out(tmp_path, kind):
    points = POINTS.copy()
    points[::3] = np.nan
    (tmp_path / "a.pcd").write_bytes(make_pcd(kind, xyz(np.float32, points) | {"i": np.arange(COUNT, dtype=np.int32)}))
    table = read_points(tmp_path / "a.pcd")
    kept = np.flatnonzero(np.arange(COUNT) % 3)
    assert_allclose(table.points, POINTS[kept], atol=1e-6)
    assert_array_equal(table.attributes["i"], kept)
    assert table.notices == ["a.pcd: left out 100 points that the sensor missed (NaN)."]


@pytest.mark.parametrize("kind", KINDS)
def test_fields_of_several_numbers_and_those_that_fill(tmp_path, kind):
    columns = {"_": np.zeros((COUNT, 4), np.uint8), **xyz(), "fpfh": np.ones((COUNT, 33), np.float32)}
    columns["after"] = np.arange(COUNT, dtype=np.int32)
    (tmp_path / "a.pcd").write_bytes(make_pcd(kind, columns))
    table = read_points(tmp_path / "a.pcd")
    assert_array_equal(table.points, POINTS)
    assert_array_equal(table.attributes["after"], np.arange(COUNT))
    assert table.notices == ["a.pcd: left out fpfh, with several numbers per point."]


def test_without_counts_and_with_a_raster(tmp_path):
    data = make_pcd("binary", xyz()).replace(b"COUNT 1 1 1\n", b"").replace(b"POINTS 300\n", b"")
    (tmp_path / "a.pcd").write_bytes(data.replace(b"WIDTH 300\nHEIGHT 1", b"WIDTH 20\nHEIGHT 15"))
    assert_array_equal(read_points(tmp_path / "a.pcd").points, POINTS)


def test_repetitions_of_all_lengths_and_distances(tmp_path):
    """Whole numbers repeat at many distances; a constant column repeats itself byte by byte."""
    count = 30_000
    points = np.random.default_rng(2).integers(0, 40, (count, 3)).astype(np.float64)
    columns = xyz(points=points) | {"one": np.ones(count, np.uint8)}
    data = make_pcd("binary_compressed", columns)
    assert len(data) < 25 * count / 3
    (tmp_path / "a.pcd").write_bytes(data)
    table = read_points(tmp_path / "a.pcd")
    assert_array_equal(table.points, points)
    assert_array_equal(table.attributes["one"], np.ones(count))


GOOD = make_pcd("binary_compressed", xyz())
AT = GOOD.index(b"DATA") + len(b"DATA binary_compressed\n")


def claim(packed, length, data=b""):
    return GOOD[:AT] + struct.pack("<II", packed, length) + data


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "no header of a PCD file"),
        (b"# .PCD\n", "no header of a PCD file"),
        (b"\n" * 500, "no header of a PCD file"),
        (b"ply\n", "line 1: 'ply' is not valid in the header of a PCD file"),
        (GOOD.replace(b"SIZE 8 8 8", b"SIZE 8 8"), "FIELDS, SIZE, TYPE and COUNT do not fit"),
        (GOOD.replace(b"SIZE 8 8 8", b"SIZE 8 8 3"), "do not fit"),
        (GOOD.replace(b"TYPE F F F", b"TYPE F F Q"), "do not fit"),
        (GOOD.replace(b"COUNT 1 1 1", b"COUNT 1 1 999999999"), "do not fit"),
        (GOOD.replace(b"COUNT 1 1 1", b"COUNT 1 1 -1"), "do not fit"),
        (GOOD.replace(b"FIELDS x y z", b"FIELDS x y w"), "has no z among its columns"),
        (GOOD.replace(b"POINTS 300", b"POINTS 3e2"), "line 10: 'POINTS 3e2' is not valid"),
        (GOOD.replace(b"POINTS 300", b"POINTS 301"), "of the 301 points"),
        (GOOD.replace(b"POINTS 300", b"POINTS 0").replace(b"binary_compressed", b"binary"), "has no points"),
        (GOOD.replace(b"POINTS 300", b"POINTS 0").replace(b"binary_compressed", b"ascii"), "has no points"),
        (GOOD.replace(b"binary_compressed", b"zip"), "'DATA zip' is not valid"),
        (GOOD[:-1], "of the 300 points"),
        (GOOD[:AT], "ends after 0 of the 300 points"),
        (claim(2**32 - 1, 7200), "of the 300 points"),
        (claim(9, 7200, bytes(9)), "of the 300 points"),
        (claim(200, 7200, bytes(200)), "is broken: its compressed data are shorter"),
        (claim(200, 7200, b"\xff" * 200), "is broken: its compressed data refer to bytes before the start"),
        (claim(200, 7200, bytes(198) + b"\x1f\0"), "is broken: its compressed data are longer .* or truncated"),
        (claim(200, 7200, bytes(198) + b"\xe0\x09"), "is broken: its compressed data are truncated"),
        (claim(200, 7200, bytes(2) + b"\xe0\xff\x00" * 66), "is broken: its compressed data are longer"),
        (make_pcd("ascii", xyz())[:-400], "point 29.: . numbers where|ends after"),
        (make_pcd("binary", xyz())[:-1], "ends after 299 of the 300 points"),
        (make_pcd("binary", xyz(points=np.full((9, 3), np.nan))), "has no points"),
        (make_pcd("binary", xyz(points=np.full((9, 3), np.inf))), "all 9 have no valid coordinates .NaN or inf"),
    ],
)
def test_broken_files(tmp_path, data, text):
    (tmp_path / "a.pcd").write_bytes(data)
    tracemalloc.start()
    try:
        with pytest.raises(PointCloudError, match=text):
            read_points(tmp_path / "a.pcd")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 1e6
