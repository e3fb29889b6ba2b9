"""PCD files: text, binary and compressed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from core import PointCloudError
from core.files import read_points

POINTS = np.random.default_rng(0).normal(size=(300, 3)).astype(np.float32)
FIELDS = {
    "x": "f4",
    "y": "f4",
    "z": "f4",
    "rgb": "u4",
    "label": "u2",
    "normal_x": "f8",
    "normal_y": "f8",
    "normal_z": "f8",
}


def rows(points=POINTS):
    result = np.zeros(len(points), list(FIELDS.items()))
    result["x"], result["y"], result["z"] = points.T
    result["rgb"] = 0xFF8000
    result["label"] = np.arange(len(points)) // 7
    result["normal_z"] = 1.0
    return result


def compress(data):
    """Pack bytes as LZF does: a run of one byte as itself and a copy of it, all else as it is."""
    packed, place = bytearray(), 0
    while place < len(data):
        run = 1
        while run < 200 and data[place : place + run + 1] == data[place : place + 1] * (run + 1):
            run += 1
        if run > 12:
            packed += bytes([0, data[place], 7 << 5, run - 1 - 9, 0])
            place += run
        else:
            piece = data[place : place + 20]
            packed += bytes([len(piece) - 1]) + piece
            place += len(piece)
    return bytes(packed)


def head(records, data, more=""):
    kinds = {name: record for name, (record, _) in records.dtype.fields.items()}
    lines = {
        "VERSION": "0.7",
        "FIELDS": " ".join(kinds),
        "SIZE": " ".join(str(kind.itemsize) for kind in kinds.values()),
        "TYPE": " ".join(kind.kind.upper() for kind in kinds.values()),
        "COUNT": " ".join("1" for _ in kinds),
        "WIDTH": len(records),
        "HEIGHT": 1,
        "VIEWPOINT": "0 0 0 1 0 0 0",
        "POINTS": len(records),
        "DATA": data,
    }
    return ("# .PCD v0.7\n" + "".join(f"{key} {value}\n" for key, value in lines.items()) + more).encode()


def make_pcd(data, records):
    if data == "ascii":
        return head(records, data) + "\n".join(" ".join(f"{value:.9g}" for value in row) for row in records).encode()
    if data == "binary":
        return head(records, data) + records.tobytes()
    columns = b"".join(records[name].tobytes() for name in records.dtype.names)
    packed = compress(columns)
    return head(records, data) + np.array([len(packed), len(columns)], "<u4").tobytes() + packed


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.pcd"


@pytest.mark.parametrize("data", ["ascii", "binary", "binary_compressed"])
def test_all_fields_are_read(path, data):
    path.write_bytes(make_pcd(data, rows()))
    table = read_points(path)
    assert_allclose(table.points, POINTS, rtol=1e-7)
    assert_allclose(table.colors, np.tile([1.0, 128.0 / 255.0, 0.0, 1.0], (300, 1)), atol=1e-6)
    assert_array_equal(table.attributes["label"], np.arange(300) // 7)
    assert_array_equal(table.attributes["normal"], np.tile([0.0, 0.0, 1.0], (300, 1)))


def test_colors_packed_as_a_float(path):
    records = rows().astype([(name, "f4" if name == "rgb" else kind) for name, kind in FIELDS.items()])
    records["rgb"] = np.full(300, 0xFF8000, np.uint32).view(np.float32)
    path.write_bytes(make_pcd("binary", records))
    assert_allclose(read_points(path).colors[0], [1.0, 128.0 / 255.0, 0.0, 1.0], atol=1e-6)


@pytest.mark.parametrize("data", ["ascii", "binary"])
def test_pixels_without_a_place_are_left_out(path, data):
    points = POINTS.copy()
    points[::3] = np.nan
    path.write_bytes(make_pcd(data, rows(points)))
    table = read_points(path)
    assert_allclose(table.points, POINTS[np.arange(300) % 3 > 0], rtol=1e-7)
    assert_array_equal(table.attributes["label"], (np.arange(300) // 7)[np.arange(300) % 3 > 0])
    assert "left out 100 points without a place" in table.notices[0]


def test_fields_of_several_numbers(path):
    text = "FIELDS x y z fpfh _\nSIZE 4 4 4 4 1\nTYPE F F F F U\nCOUNT 1 1 1 2 3\nWIDTH 2\nHEIGHT 1\nDATA ascii\n"
    path.write_text(text + "1 2 3 4 5 0 0 0\n6 7 8 9 10 0 0 0\n")
    table = read_points(path)
    assert_array_equal(table.points, [[1.0, 2.0, 3.0], [6.0, 7.0, 8.0]])
    assert sorted(table.attributes) == ["fpfh_0", "fpfh_1"]


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (b"POINTS 300", b"POINTS 301", "ends after 300 of the 301 points"),
        (b"POINTS 300", b"POINTS 999999999999", "ends after 300 of the 999999999999 points"),
        (b"POINTS 300", b"POINTS -1", "do not fit"),
        (b"SIZE 4 4 4", b"SIZE 4 4 3", "do not fit"),
        (b"TYPE F", b"TYPE Q", "incomplete"),
        (b"COUNT 1", b"COUNT 0", "no numbers"),
        (b"COUNT 1", b"COUNT 99999999", "too many"),
        (b"DATA binary", b"DATA zipped", "holds zipped data"),
        (b"FIELDS x", b"FIELDS u", "has no x"),
        (b"DATA", b"DADA", "does not end with a line DATA"),
    ],
)
def test_broken_headers(path, old, new, text):
    path.write_bytes(make_pcd("binary", rows()).replace(old, new, 1))
    with pytest.raises(PointCloudError, match=text):
        read_points(path)


@pytest.mark.parametrize(
    ("size", "text"),
    [(9_000_000, "does not hold the 300 points"), (None, "ends before its points")],
)
def test_broken_compression(path, size, text):
    data = bytearray(make_pcd("binary_compressed", rows()))
    place = data.index(b"binary_compressed\n") + len(b"binary_compressed\n")
    if size:
        data[place + 4 : place + 8] = size.to_bytes(4, "little")
    else:
        del data[-10:]
    path.write_bytes(bytes(data))
    with pytest.raises(PointCloudError, match=text):
        read_points(path)
