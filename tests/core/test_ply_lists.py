"""PLY files with lists among the properties of their vertices, or in elements before them, as OpenMVS writes them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from core import PointCloudError
from core.files import read_points

RANDOM = np.random.default_rng(0)
CODES = {"char": "i1", "uchar": "u1", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4", "double": "f8"}
ORDERS = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}
OPENMVS = [
    *("float x", "float y", "float z", "uchar red", "uchar green", "uchar blue", "float nx", "float ny", "float nz"),
    *("list uchar uint view_indices", "list uchar float view_weights"),
]


def make_ply(kind, *elements):
    """Return the bytes of a file of elements: name, properties, and rows of numbers and lists."""
    order, head, data = ORDERS[kind], ["ply", f"format {kind} 1.0"], []
    for name, properties, rows in elements:
        head += [f"element {name} {len(rows)}", *(f"property {text}" for text in properties)]
        for row in rows:
            for text, value in zip(properties, row, strict=True):
                numbers = [value]
                codes = [text.split()[0]]
                if codes == ["list"]:
                    numbers, codes = [len(value), *value], [text.split()[1], *[text.split()[2]] * len(value)]
                for number, code in zip(numbers, codes, strict=True):
                    data.append(np.array(number, f"{order or '<'}{CODES[code]}").tobytes() if order else f"{number!r} ")
            data.append(b"" if order else "\n")
    body = b"".join(data) if order else "".join(data).encode()
    return "\n".join([*head, "end_header\n"]).encode() + body


def rows_of(count, lengths):
    """Return rows for `OPENMVS` whose lists have these lengths."""
    places = RANDOM.random((count, 3)).round(3)
    return places, [
        [*place, 255, 0, number % 256, 0.0, 0.0, 1.0, [*range(length)], [0.5] * length]
        for number, (place, length) in enumerate(zip(places.tolist(), lengths, strict=True))
    ]


@pytest.mark.parametrize("kind", ORDERS)
@pytest.mark.parametrize("lengths", ["equal", "varying", "none"])
def test_lists_of_views_are_passed_over(tmp_path, kind, lengths):
    count = 300
    lengths = {"equal": [3] * count, "varying": RANDOM.integers(0, 20, count).tolist(), "none": [0] * count}[lengths]
    places, rows = rows_of(count, lengths)
    (tmp_path / "a.ply").write_bytes(make_ply(kind, ("vertex", OPENMVS, rows)))
    table = read_points(tmp_path / "a.ply")
    assert_allclose(table.points, places, atol=1e-7)
    assert_allclose(table.colors[:, 2], np.arange(count) % 256 / 255.0, atol=1e-6)
    assert_array_equal(table.attributes["normal"], np.tile([0.0, 0.0, 1.0], (count, 1)))
    assert table.attributes.keys() == {"normal"}
    assert table.notices == ["a.ply: left out view_indices, view_weights, lists of numbers at each point."]


@pytest.mark.parametrize("kind", ORDERS)
@pytest.mark.parametrize("length", ["uchar", "ushort", "int", "uint"])
def test_lists_anywhere_with_lengths_of_any_type(tmp_path, kind, length):
    properties = [f"list {length} double a", "double x", "double y", f"list {length} char b", "double z", "int after"]
    rows = [[[0.5] * (number % 4), 1.0 * number, 2.0, [1] * (number % 3), 3.0, 7 * number] for number in range(50)]
    (tmp_path / "a.ply").write_bytes(make_ply(kind, ("vertex", properties, rows)))
    table = read_points(tmp_path / "a.ply")
    assert_array_equal(table.points, [[number, 2.0, 3.0] for number in range(50)])
    assert_array_equal(table.attributes["after"], 7 * np.arange(50))


@pytest.mark.parametrize("kind", ORDERS)
def test_faces_before_the_points(tmp_path, kind):
    faces = ("face", ["list uchar int vertex_indices", "uchar flag"], [[[0, 1, 2], 1], [[0, 1, 2, 0], 0]])
    places = ("vertex", ["float x", "float y", "float z"], [[5.0, 6.0, 7.0], [1.0, 2.0, 3.0], [0.0, 0.0, 1.0]])
    (tmp_path / "a.ply").write_bytes(make_ply(kind, faces, places))
    table = read_points(tmp_path / "a.ply")
    assert table.points.tolist() == places[2]
    assert table.notices == ["a.ply: left out 2 face elements. Only points are read."]


def test_many_blocks(tmp_path):
    """Written by numpy, since one by one would take long."""
    count, lengths = 150_000, RANDOM.integers(0, 5, 150_000)
    row = np.dtype([("place", "<f4", 3), ("length", "u1")])
    starts = np.concatenate([[0], np.cumsum(row.itemsize + 4 * lengths)])
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n"
    head += "property float z\nproperty list uchar uint views\nend_header\n"
    data = np.zeros(starts[-1], np.uint8)
    rows = np.zeros(count, row)
    rows["place"], rows["length"] = RANDOM.random((count, 3)), lengths
    data[starts[:-1, None] + np.arange(row.itemsize)] = rows.view(np.uint8).reshape(count, -1)
    (tmp_path / "a.ply").write_bytes(head.encode() + data.tobytes())
    assert_array_equal(read_points(tmp_path / "a.ply").points, rows["place"])


@pytest.mark.parametrize("lengths", [[3] * 20, [*range(20)]])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
@pytest.mark.parametrize("kind", ORDERS)
def test_files_that_are_cut_off(tmp_path, kind, share, lengths):
    data = make_ply(kind, ("vertex", OPENMVS, rows_of(20, lengths)[1]))
    begin = data.index(b"end_header\n") + 11
    (tmp_path / "a.ply").write_bytes(data[: begin + int(share * (len(data) - begin))])
    with pytest.raises(PointCloudError, match=r"ends after \d+ of the 20 points|not those of its properties and lists"):
        read_points(tmp_path / "a.ply")


@pytest.mark.parametrize("count", [3, 10**12])
def test_lists_that_lie(tmp_path, count):
    for kind, data in (
        ("binary_little_endian", np.array([-5, 0, 0, 0, 0], "<i4").tobytes()),
        ("binary_big_endian", b"\x7f\xff\xff\xff"),
        ("ascii", b"-5 0 0 0\n"),
        ("ascii", b"99999999999999999999 0 0 0\n"),
        ("ascii", b"x 0 0 0\n"),
    ):
        head = f"ply\nformat {kind} 1.0\nelement vertex {count}\nproperty list int char a\n"
        head += "property float x\nproperty float y\nproperty float z\nend_header\n"
        (tmp_path / "a.ply").write_bytes(head.encode() + data)
        with pytest.raises(PointCloudError, match="a.ply"):
            read_points(tmp_path / "a.ply")
