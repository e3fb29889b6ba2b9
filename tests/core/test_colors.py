"""Colors of files are from 0 to 1 whatever their range was: by the type of bytes, and otherwise by the numbers."""

import struct

import laspy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from core.files import read_points
from tests.core import e57_files

PURE = np.array([[1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 0]])  # red, green, yellow, black
NAMES = "red", "green", "blue"


def write_ply(path, colors, order="<"):
    rows = np.zeros(len(colors), [(axis, f"{order}f4") for axis in "xyz"] + [(name, colors.dtype) for name in NAMES])
    rows["x"] = np.arange(len(colors))
    for name, values in zip(NAMES, colors.T, strict=True):
        rows[name] = values
    kinds = {"f4": "float", "f8": "double", "u1": "uchar", "i1": "char", "u2": "ushort", "i4": "int", "u4": "uint"}
    lines = [f"property float {axis}" for axis in "xyz"]
    lines += [f"property {kinds[colors.dtype.str[1:]]} {name}" for name in NAMES]
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(colors)}", *lines, "end_header\n"]
    path.write_bytes("\n".join(head).encode() + rows.tobytes())


def write_pcd(path, colors):
    kind, size = colors.dtype.kind.upper(), colors.dtype.itemsize
    head = f"FIELDS x y z r g b\nSIZE 4 4 4{3 * f' {size}'}\nTYPE F F F{3 * f' {kind}'}\nCOUNT 1 1 1 1 1 1\n"
    head += f"WIDTH {len(colors)}\nHEIGHT 1\nDATA binary\n"
    data = b"".join(struct.pack("<3f", number, 0.0, 0.0) + row.tobytes() for number, row in enumerate(colors))
    path.write_bytes(head.encode() + data)


def write_las(path, colors):
    las = laspy.LasData(laspy.LasHeader(point_format=2, version="1.2"))
    las.x = las.y = las.z = np.arange(float(len(colors)))
    las.red, las.green, las.blue = colors.T
    las.write(str(path))


def write_e57(path, colors):
    if colors.dtype.kind == "f":
        channels = [e57_files.real(values, colors.dtype.str[1:]) for values in colors.T]
    else:
        channels = [e57_files.integer(values.tolist(), 0, np.iinfo(colors.dtype).max) for values in colors.T]
    fields = {f"cartesian{axis}": e57_files.real(np.arange(len(colors))) for axis in "XYZ"}
    fields |= {f"color{name.title()}": channel for name, channel in zip(NAMES, channels, strict=True)}
    path.write_bytes(e57_files.seal(e57_files.make_e57((fields, len(colors), ""))))


def write_text(path, colors):
    rows = np.hstack([np.arange(3.0 * len(colors)).reshape(-1, 3), colors])
    np.savetxt(path, rows, "%.6g", ",", header="x,y,z,r,g,b", comments="")


def write_obj(path, colors):
    path.write_text("".join(f"v {number} 0 0 {r:g} {g:g} {b:g}\n" for number, (r, g, b) in enumerate(colors.tolist())))


WRITERS = {
    "ply": write_ply,
    "pcd": write_pcd,
    "las": write_las,
    "e57": write_e57,
    "csv": write_text,
    "obj": write_obj,
}


def read(path, kind, colors):
    WRITERS[kind](path / f"a.{kind}", colors)
    return read_points(path / f"a.{kind}").colors[:, :3]


@pytest.mark.parametrize("kind", ["ply", "pcd", "e57", "csv", "obj"])
@pytest.mark.parametrize("full", [1.0, 255.0, 65535.0])
def test_floats_are_pure_in_every_range(tmp_path, kind, full):
    for dtype in (np.float32, np.float64):
        assert_allclose(read(tmp_path, kind, (full * PURE).astype(dtype)), PURE, atol=1e-6)


@pytest.mark.parametrize("kind", ["ply", "pcd", "las", "e57"])
def test_8_bits_in_types_of_16(tmp_path, kind):
    low = np.array([[39, 120, 249], [255, 0, 51]], np.uint16)
    assert_allclose(read(tmp_path, kind, low), low / 255.0, atol=1e-6)
    high = low * np.uint16(257)
    assert_allclose(read(tmp_path, kind, high), low / 255.0, atol=1e-6)


@pytest.mark.parametrize("kind", ["ply", "pcd", "e57"])
def test_bytes_are_bytes_however_dark(tmp_path, kind):
    assert_allclose(read(tmp_path, kind, PURE.astype(np.uint8)), PURE / 255.0, atol=1e-6)


@pytest.mark.parametrize("full", [1, 255, 65535, 2**32 - 1])
def test_whole_numbers_of_32_bits_tell_their_range_themselves(tmp_path, full):
    assert_allclose(read(tmp_path, "ply", (full * PURE).astype(np.uint32)), PURE, atol=1e-6)


def test_bytes_with_a_sign_are_bytes(tmp_path):
    colors = np.array([[0, 127, 128], [200, 255, 1]], np.uint8)
    assert_allclose(read(tmp_path, "ply", colors.view(np.int8)), colors / 255.0, atol=1e-6)


def test_floats_a_little_brighter_than_white_are_white(tmp_path):
    bright = np.array([[0.5, 1.3, 0.0], [0.25, 0.0, 1.0]], np.float32)
    assert_allclose(read(tmp_path, "ply", bright), np.minimum(bright, 1.0), atol=1e-6)


def test_points_without_a_color_are_black_and_leave_the_others_as_they_are(tmp_path):
    colors = np.array([[np.nan, np.nan, np.nan], [0.2, 0.4, 1.0]], np.float32)
    assert_allclose(read(tmp_path, "ply", colors), [[0.0, 0.0, 0.0], [0.2, 0.4, 1.0]], atol=1e-6)


def test_opacity_has_a_range_of_its_own(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z,r,g,b,alpha\n0,0,0,255,0,51,1\n1,0,0,0,0,0,0.5\n")
    assert_allclose(read_points(tmp_path / "a.csv").colors, [[1.0, 0.0, 0.2, 1.0], [0.0, 0.0, 0.0, 0.5]], atol=1e-6)
    (tmp_path / "a.csv").write_text("x,y,z,r,g,b,alpha\n0,0,0,1,0,0.2,255\n1,0,0,0,0,0,51\n")
    assert_allclose(read_points(tmp_path / "a.csv").colors, [[1.0, 0.0, 0.2, 1.0], [0.0, 0.0, 0.0, 0.2]], atol=1e-6)


@pytest.mark.parametrize("bits", [10, 12])
@pytest.mark.parametrize("ending", ["ply", "pcd", "las", "csv"])
def test_colors_of_ten_and_twelve_bits_are_bright_and_told(tmp_path, ending, bits):
    full = 2**bits - 1
    colors = np.array([[full, 0, 0], [full - 3, full // 2, 5]], np.uint16)
    path = tmp_path / f"a.{ending}"
    {"ply": write_ply, "pcd": write_pcd, "las": write_las, "csv": write_text}[ending](path, colors)
    table = read_points(path)
    assert_allclose(table.colors[:, :3], colors / full, atol=1e-6)
    assert any(f"range is taken as 0 to {full}" in notice for notice in table.notices)


@pytest.mark.parametrize(
    "names", ["r,g,b,a", "R,G,B,A", "Rf,Gf,Bf,Af", "Color_R,Color_G,Color_B,Color_A", "Rot,Grün,Blau,A"]
)
def test_alpha_by_its_letter_beside_colors_is_alpha(tmp_path, names):
    (tmp_path / "a.csv").write_text(f"x,y,z,{names}\n1,2,3,1,0.5,0,0.25\n4,5,6,0,0,0.5,1\n", encoding="utf-8")
    table = read_points(tmp_path / "a.csv")
    assert_allclose(table.colors, [[1.0, 0.5, 0.0, 0.25], [0.0, 0.0, 0.5, 1.0]])
    assert not table.attributes


def test_a_without_colors_is_an_attribute(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z,nx,ny,nz,a\n1,2,3,0,0,1,7\n")
    assert read_points(tmp_path / "a.csv").attributes["a"].tolist() == [7.0]
