"""Files from anywhere: whatever is in them, they are read or refused by a text that says what to do."""

import io
import pickle
import re
import time
import tracemalloc
import zipfile

import laspy
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from core import NotEnoughMemoryError, PointCloudError
from core.files import READABLE, choose_origin, is_coarse, read_points
from tests.core import e57_files

POINTS = np.round(np.random.default_rng(0).uniform(0.0, 100.0, (30, 3)), 3)
NUMBERS = [  # in place of others
    "-1",
    "0",
    "1e12",
    "1000000000000",
    "99999999999999999999",
    "nan",
    "-inf",
    "1e300",
    "-1e39",
    "5e-324",
    "1_0",
    "3//c",
    "0x10",
    "1,5",
    ";",
    "#",
    "٣",
    "²",
    "\0",
    "1\0",
    "'1'",
    "1e",
]
WORDS = ["", "9" * 5000, "(" * 300, "list uchar int", "double", "end_header", "#", "v", "\ufeff", "\u2028", *NUMBERS]


KINDS = ("f4", "f8", "f4", "u1", "u1", "u1", "i4", "f4", "f4", "f4")  # of the columns of PLY files


def make_rows(form, extra=""):
    return "".join(form.format(*point) + extra + "\n" for point in POINTS)


def make_ply(order):
    code = {"little": "<", "big": ">"}.get(order)
    head = (
        f"ply\nformat {f'binary_{order}_endian' if code else order} 1.0\ncomment a scan\nelement camera 2\n"
        "property short a\nelement vertex 30\nproperty float x\nproperty double y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty int label\nproperty float nx\n"
        "property float ny\nproperty float nz\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if not code:
        return head + b"1\n2\n" + make_rows("{} {} {}", " 255 0 128 7 0 0 1").encode() + b"3 0 1 2\n"
    rows = np.ones(30, [(str(i), code + kind) for i, kind in enumerate(KINDS)])
    rows["0"], rows["1"], rows["2"] = POINTS.T
    return head + bytes(4) + rows.tobytes() + b"\x03" + np.arange(3, dtype=code + "i4").tobytes()


def make_array(values=POINTS):
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


def make_archive(member, compression=zipfile.ZIP_DEFLATED, name="points.npy"):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression) as archive:
        archive.writestr("areas.npy", make_array(np.ones(30)))
        archive.writestr(name, member)
    return file.getvalue()


def make_las(packed, point_format=7):
    las = laspy.LasData(laspy.LasHeader(point_format=point_format, version="1.4"))
    las.x, las.y, las.z = POINTS.T
    las.red = las.intensity = np.arange(30)
    file = io.BytesIO()
    las.write(file, do_compress=packed)
    return file.getvalue()


def make_pcd(kind):
    head = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 8 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 30\nHEIGHT 1\n"
    head = f"{head}VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 30\nDATA {kind}\n".encode()
    if kind == "ascii":
        return head + make_rows("{} {} {}", " 16711680").encode()
    columns = [column.astype(code) for column, code in zip(POINTS.T, ("f4", "f8", "f4"), strict=True)]
    columns.append(np.full(30, 0xFF00FF, "u4"))
    if kind == "binary":
        return head + b"".join(value.tobytes() for row in zip(*columns, strict=True) for value in row)
    data = b"".join(column.tobytes() for column in columns[:3]) + bytes(4)  # the colors repeat those four bytes
    runs = b"".join(bytes([len(data[i : i + 32]) - 1]) + data[i : i + 32] for i in range(0, len(data), 32))
    runs += b"\xe0" + bytes([30 * 4 - 4 - 9]) + b"\x03"
    return head + len(runs).to_bytes(4, "little") + (30 * 20).to_bytes(4, "little") + runs


def make_e57(count=30):
    """Make a file of two scans, before it is sealed; the first may claim to have more points."""
    fields = e57_files.points(POINTS) | {"intensity": e57_files.integer(range(30), -5, 99)}
    fields |= {"cartesianInvalidState": e57_files.integer(30 * [0], 0, 2)}
    fields |= {f"color{name}": e57_files.integer(range(30), 0, 255) for name in ("Red", "Green", "Blue")}
    other = {f"spherical{name}": e57_files.real(range(30), "f4") for name in ("Range", "Azimuth", "Elevation")}
    pose = e57_files.pose((0.5, 0.5, 0.5, 0.5), (1.0, 2.0, 3.0))
    return e57_files.make_e57((fields, count, pose), (other, 30, pose), sizes=(300, 41))


PTX_HEAD = b"1\n30\n5 6 7\n1 0 0\n0 1 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n5 6 7 1\n"


def make_heights():
    """Thirty of them, in five rows."""
    return "".join(
        f"{height:.2f}{chr(10) if index % 6 == 5 else ' '}" for index, height in enumerate(POINTS[:30, 2])
    ).encode()


GOOD = {
    "ascii.ply": make_ply("ascii"),
    "little.ply": make_ply("little"),
    "big.ply": make_ply("big"),
    "plain.xyz": make_rows("{} {} {}").encode(),
    "named.xyz": b"# x y z heat\n" + make_rows("{} {} {} 0.5").encode(),
    "comma.csv": b"id,x,y,z,red,green,blue\n" + make_rows("1,{},{},{},255,0,51").encode(),
    "semicolon.csv": b"x;y;z\n" + make_rows("{};{};{}").replace(".", ",").encode(),
    "tab.txt": make_rows("{}\t{}\t{}", " // tree").encode(),
    "grid.asc": b"ncols 6\nnrows 5\nxllcorner 1e5\nyllcorner 2.5\ncellsize 0.5\nNODATA_value -9999\n" + make_heights(),
    "grid.grd": b"DSAA\n6 5\n-2 3\n0 4\n1 5\n" + make_heights(),
    "scan.pts": 2 * (b"30\n" + make_rows("{} {} {}", " -99 255 0 0").encode()),
    "scan.ptx": 2 * (PTX_HEAD + make_rows("{} {} {}", " 0.25 255 0 0").encode()),
    "thing.obj": b"o Thing\n" + make_rows("v {} {} {}", " 1 0 0").encode() + b"f 1 2 3\nf 4//2 5//2 6//2\n",
    "array.npy": make_array(),
    "plain.npz": make_archive(make_array(), zipfile.ZIP_STORED),
    "small.npz": make_archive(make_array()),
    "ascii.pcd": make_pcd("ascii"),
    "binary.pcd": make_pcd("binary"),
    "packed.pcd": make_pcd("binary_compressed"),
    "plain.las": make_las(packed=False),
    "old.laz": make_las(packed=True, point_format=2),
    "layered.laz": make_las(packed=True),
    "scan.e57": e57_files.seal(make_e57()),
}


def pick(random, items):
    return items[random.integers(len(items))]


def truncate(data, random):
    """Anywhere, but often near the end or the beginning."""
    return data[: int(len(data) * pick(random, (0.01, 0.2, 0.99, random.uniform(), random.uniform())))]


def flip(data, random):
    result = np.frombuffer(data, np.uint8).copy()
    places = random.integers(min(len(data), pick(random, (60, 400, len(data)))), size=random.integers(1, 5))
    result[places] ^= random.integers(1, 256, len(places), np.uint8)
    return result.tobytes()


def patch(data, random):
    """Put bytes in, or in place of others."""
    at = int(random.integers(len(data)))
    new = pick(random, (b"\0", b"\xff\xfe", b"\n", b"\r", b"\r\n", b",", b" ", b"\x80" * 9, bytes(100), b"\xff" * 8))
    return data[:at] + new + data[at + int(pick(random, (0, 0, len(new), 50))) :]


def replace_word(data, random):
    """Replace a word, of the header more often than not."""
    words = [match.span() for match in re.finditer(rb"[^\s,;:'()]+", data)] or [(0, 0)]
    if pick(random, (True, True, False)):
        words = words[:40]
    begin, end = pick(random, words)
    return data[:begin] + pick(random, WORDS).encode() + data[end:]


def move_lines(data, random):
    """Remove, double or swap lines, of the header more often than not."""
    lines = data.split(b"\n")
    count = min(len(lines), pick(random, (20, 20, len(lines))))
    one, other = random.integers(count, size=2)
    match pick(random, ("remove", "double", "swap")):
        case "remove":
            del lines[one]
        case "double":
            lines.insert(other, lines[one])
        case "swap":
            lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def encode(data, random):
    """Store text in another encoding."""
    return data.decode("latin-1").encode(pick(random, ("utf-16", "utf-32-le", "utf-8-sig", "cp500")))


CHANGES = [truncate, flip, flip, patch, replace_word, replace_word, replace_word, move_lines, encode]


def change(name, random):
    """Return a broken variant of a good file; half of the time only what an archive or checksums are made of."""
    data, packed = GOOD[name], name.endswith(("npz", "e57")) and pick(random, (True, False))
    if packed:
        data = make_e57() if name.endswith("e57") else make_array()
    for _ in range(pick(random, (1, 1, 1, 2, 3))):
        data = pick(random, CHANGES)(data, random) or b"\n"
    if packed and name.endswith("e57"):
        return e57_files.seal(data)
    return make_archive(data, pick(random, (0, 8))) if packed else data


def read_or_refuse(path):
    """Read a file, and return the text of the error, if there is one; any other error goes on."""
    try:
        table = read_points(path)
    except PointCloudError as error:
        text = str(error)
        assert str(path) in text
        assert re.search(r"\. [A-Z].*\.$|no points\.$", text), text  # it says what is wrong, and what to do
        assert len(text) < len(str(path)) + 700, text
        return text
    assert table.points.dtype == np.float64
    assert table.points.shape[1] == 3
    assert np.isfinite(table.points).all()
    assert {len(values) for values in table.attributes.values()} <= {len(table.points)}
    assert table.colors is None or ((table.colors >= 0.0) & (table.colors <= 1.0)).all()
    is_coarse(table.points - choose_origin(table.points))
    return ""


@pytest.mark.parametrize("name", GOOD)
def test_what_is_broken_is_read_or_refused(tmp_path, name):
    """All warnings are errors here, too."""
    path = tmp_path / name
    path.write_bytes(GOOD[name])
    assert read_or_refuse(path) == ""
    refused = 0
    for seed in range(60):
        path.write_bytes(change(name, np.random.default_rng(seed)))
        refused += bool(read_or_refuse(path))
    assert refused > 10


def test_good_files_are_of_all_kinds():
    assert {f".{name.split('.')[1]}" for name in GOOD} == set(READABLE)


def ply_head(order, count, kind="double", more=""):
    names = "".join(f"property {kind} {axis}\n" for axis in "xyz")
    return f"ply\nformat {order} 1.0\n{more}element vertex {count}\n{names}end_header\n".encode()


def array_head(shape="(2, 3)", kind="<f8", version=1, rest=""):
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, {rest}}}\n".encode()
    return b"\x93NUMPY" + bytes([version, 0]) + len(text).to_bytes(2 if version == 1 else 4, "little") + text


def claim(member, offset, value):
    """Return an archive that holds a member, with another number in the list at its end."""
    data = bytearray(make_archive(member))
    data[data.rindex(b"PK\1\2") + offset] = value
    return bytes(data)


def patch_las(data, place, value, length=8):
    """Return a file with another number in its header."""
    return data[:place] + value.to_bytes(length, "little") + data[place + length :]


LITTLE = "binary_little_endian"
HUGE = 2 * ("element camera 999999999999999\n" + 400 * "property double a\n")


@pytest.mark.parametrize(
    ("name", "data", "text"),
    [
        ("a.ply", ply_head(LITTLE, 10**12) + bytes(99), "ends after 4 of the 1000000000000 points"),
        ("a.ply", ply_head("ascii", 10**12) + b"1 2 3\n", "ends after 1 of the 1000000000000 points"),
        ("a.ply", ply_head(LITTLE, 1, more=HUGE), "ends after 0 of the 1 points"),
        ("a.ply", ply_head(LITTLE, 0, more=HUGE), "has no points|cannot be read"),
        ("a.ply", ply_head("ascii", 1) + b"1_0 2 3\n", "point 1: could not convert string to float: '1_0'"),
        ("a.ply", ply_head("ascii", 2) + b"1 2 3\n1 2 \0\n", "point 2: could not convert"),
        ("a.ply", ply_head("ascii", 1) + b"1 2 " + b"9" * 300 + b"x\n", "'9{100}...'. Correct"),
        (
            "a.ply",
            ply_head("ascii", 1) + b"1 " * 100_000,
            "line of 100,000 characters or more, which is not a point. Exp",
        ),
        ("a.ply", ply_head("ascii", 1) + b"1 2 1e300\n", "1 of 1 points .* beyond 1e.30, the first of them is point 1"),
        (
            "a.ply",
            ply_head(LITTLE, 1, "float") + b"\x01\x00\xa0\x7f" * 3,
            "all 1 have no valid coordinates .NaN.. Export it again",
        ),
        ("a.xyz", b"1 2 3\n1_0 2 3\n", "line 2 has '1_0' where a number"),
        ("a.xyz", "1 2 3\n٣ 2 3\n".encode(), "line 2 has '٣' where a number"),
        ("a.xyz", b"1 2 3\n4\0 5 6\n", "line 2 has '4.x00' where a number"),
        ("a.xyz", b"1 2 3\n4 5 6//c 7\n8 9", "line 3 has 2 columns only"),
        ("a.xyz", b"1 2 1e300\n4 5 1e300\n", "2 of 2 points .* beyond 1e.30, the first of them is point 1"),
        ("a.csv", "x,y,z\n1,2,3\n".encode("utf-16-le"), "there are none"),
        ("a.ptx", b"1 2 3\n", "is no PTX file"),
        ("a.ptx", PTX_HEAD.replace(b"30", b"3") + b"1 2 3 0\n1 2 3 0", "announces 3 points in scan 1, but 2 follow"),
        ("a.ptx", PTX_HEAD.replace(b"30", b"999999999") + b"1 2 3 0\n", "announces 999999999 points in scan 1, but 1"),
        (
            "a.ptx",
            PTX_HEAD.replace(b"30", b"1") + b"1 2 3 0\n4 5 6 0\n",
            "line 12: '4 5 6 0' does not begin a scan: scan 1 has",
        ),
        ("a.ptx", PTX_HEAD.replace(b"30", b"2") + b"1 2 3 0\n4 x 6 0\n", "scan 1, near line 12: could not convert"),
        ("a.ptx", PTX_HEAD.replace(b"30", b"2") + b"1 2 3 0\n4 5 6\n", "scan 1, near line 12: the number of columns"),
        ("a.ptx", PTX_HEAD.replace(b"30", b"1") + b"1 2\n", "has 2 numbers per point in scan 1"),
        ("a.ptx", PTX_HEAD.replace(b"30", b"1") + b"0 0 0 0\n", "has no points"),
        ("a.xyz", b"1 " * 10_000_000, "line of 100,000 characters or more"),
        ("a.csv", b"1 2 3\n" + b"1," * 100_000, "line of 100,000 characters or more"),
        ("a.txt", b"\n" * 200_000, "there are none"),
        ("a.pts", b"9" * 5000 + b"\n1 2 3\n", "announces 9{15} points, but 1 lines"),
        ("a.pts", b"1000000000000\n1 2 3\n", "announces 1000000000000 points, but 1 lines follow"),
        ("a.obj", b"v 1 2 3\nv 1 2 1_0\n", "line 2 has '1_0'"),
        ("a.obj", b"v\nv \nv # none\n", "has no vertices"),
        ("a.obj", b"v 1 2 3\nv " + b"1 " * 100_000, "line of 100,000 characters or more"),
        ("a.npy", array_head("(1000000000000, 3)") + bytes(48), "it ends after 2 of 1000000000000 points"),
        ("a.npy", array_head("(-1, 3)") + bytes(48), "the shape .-1, 3.. Points are numbers"),
        ("a.npy", array_head("(" + 5000 * "9" + ", 3)"), "the shape .9+\\.\\.\\.. Points"),
        ("a.npy", array_head("(2, 3", rest="((") + bytes(48), "holds no array of points. Save"),
        ("a.npy", array_head(kind="<f3") + bytes(48), "type '<f3' and the shape .2, 3.. Points"),
        ("a.npy", array_head(kind="|O") + pickle.dumps(6 * [0]), "type '.O' and"),
        ("a.npy", b"\x93NUMPY\2\0" + b"\xff" * 9, "holds no array of points"),
        ("a.npz", make_archive(b"points"), "holds no array of points"),
        ("a.npz", make_archive(array_head("(3, 3)") + bytes(48)), "it ends after 2 of 3 points"),
        ("a.npz", make_archive(make_array(), name="others.npy"), "points is not among its arrays"),
        ("a.npz", claim(make_array(), 8, 1), "is broken: .* encrypted, password required"),
        ("a.npz", claim(make_array(), 10, 99), "uses a compression that numpy does not support"),
        ("a.npz", make_archive(make_array(), zipfile.ZIP_BZIP2), "uses a compression that numpy does not support"),
        ("a.npz", claim(make_array(), 16, 7), "is broken: Bad CRC-32"),
        ("a.npz", make_archive(make_array())[:-30], "is broken: File is not a zip file"),
    ],
)
def test_broken_files(tmp_path, name, data, text):
    (tmp_path / name).write_bytes(data)
    begin = time.perf_counter()
    assert re.search(text, read_or_refuse(tmp_path / name))
    assert time.perf_counter() - begin < 2.0


def bomb(megabytes, head=b""):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("points.npy", "w") as member:
        member.write(head)
        for _ in range(megabytes):
            member.write(bytes(1_000_000))
    return file.getvalue()


NOISE = np.random.default_rng(0).bytes(1_000_000)
ROWS = b"12.345678 23.456789 34.567890\n"
LARGE = {
    "bomb.npz": lambda: bomb(100, array_head("(4000000, 3)")),
    "claim.npy": lambda: array_head("(12500000, 3)") + NOISE,
    "head.npy": lambda: array_head(version=2).replace(b"\0\0{", b"\xff\xff{") + NOISE,
    "claim.ply": lambda: ply_head(LITTLE, 10**14) + NOISE,
    "nan.ply": lambda: ply_head(LITTLE, 40_000) + 960_000 * b"\xff",
    "last.ply": lambda: ply_head("ascii", 30_001) + 30_000 * ROWS + b"1 2 x\n",
    "short.ply": lambda: ply_head("ascii", 30_002) + 30_000 * ROWS + b"1 2 3\n",
    "last.xyz": lambda: 30_000 * ROWS + b"1 2 x\n",
    "wide.xyz": lambda: "# \N{GRINNING FACE}\n".encode() + 30_000 * ROWS + b"1 2 x\n",
    "columns.xyz": lambda: 500_000 * b"1 ",
    "lines.xyz": lambda: b"1 2 3\n" + 500_000 * b"1\n",
    "empty.xyz": lambda: b"1 2 3\n" + 300_000 * b"\n" + b"1 2 x",
    "last.pts": lambda: b"30001\n" + 30_000 * ROWS,
    "last.ptx": lambda: PTX_HEAD.replace(b"30", b"30001") + 30_000 * ROWS,
    "last.obj": lambda: 30_000 * (b"v " + ROWS) + b"v 1 2 x\n",
    **{f"noise{suffix}": lambda: NOISE for suffix in READABLE},
    "claim.pcd": lambda: make_pcd("binary").replace(b"POINTS 30", b"POINTS 99999999999") + NOISE,
    "packed.pcd": lambda: make_pcd("binary_compressed").replace(b"POINTS 30", b"POINTS 214748364") + NOISE,
    "claim.las": lambda: patch_las(make_las(packed=False), 247, 10**12) + NOISE,
    "claim.laz": lambda: patch_las(make_las(packed=True), 247, 10**12) + NOISE,
    "records.las": lambda: patch_las(make_las(packed=False), 100, 2**32 - 1, 4) + NOISE,
    "claim.e57": lambda: e57_files.seal(make_e57(10**14)) + NOISE,
    "short.e57": lambda: e57_files.seal(make_e57(10**5)) + NOISE,
    "zip.npz": lambda: b"PK\3\4" + NOISE,
    "nul.obj": lambda: b"v 1 2 3" + bytes(1_000_000),
}


@pytest.mark.parametrize("name", LARGE)
def test_what_is_refused_takes_little_memory(tmp_path, name):
    """At most four times the file, and a little for those that are small."""
    data = LARGE[name]()
    (tmp_path / name).write_bytes(data)
    limit, peaks = 4 * len(data) + 5e5, []
    while len(peaks) < 2 and min(peaks, default=limit) >= limit:  # a thread may do something else for once
        tracemalloc.start()
        try:
            assert read_or_refuse(tmp_path / name)
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
    assert min(peaks) < limit


def test_too_little_memory_is_said(tmp_path, monkeypatch):
    def fail(*_, **__):
        raise MemoryError

    (tmp_path / "a.xyz").write_bytes(GOOD["plain.xyz"])
    monkeypatch.setattr(np, "loadtxt", fail)
    with pytest.raises(NotEnoughMemoryError, match="a.xyz needs more memory than is free. Divide the file"):
        read_points(tmp_path / "a.xyz")


class Trap:
    """What an attacker would pickle."""

    def __reduce__(self):
        return open, ("trapped", "w")


def test_nothing_in_a_file_is_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    trap = make_array(np.array([[Trap()] * 3], dtype=object))
    for name, data in (("a.npy", trap), ("b.npy", pickle.dumps(Trap())), ("c.npz", make_archive(trap))):
        (tmp_path / name).write_bytes(data)
        assert read_or_refuse(tmp_path / name)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npy", "b.npy", "c.npz"]


@pytest.mark.parametrize("name", ["a" * 300 + ".ply", "nul\0.ply", "folder/of/none.xyz", "a.npy/b.npy"])
def test_names_that_no_file_can_have(tmp_path, name):
    (tmp_path / "a.npy").write_bytes(b"")
    with pytest.raises(PointCloudError, match="There is no file .* Check its name and folder."):
        read_points(tmp_path / name)


def test_a_file_that_may_not_be_read(tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    (tmp_path / "a.ply").write_bytes(GOOD["big.ply"])
    monkeypatch.setattr("builtins.open", refuse)
    with pytest.raises(PointCloudError, match="a.ply cannot be read: Permission denied. Check the file."):
        read_points(tmp_path / "a.ply")


class TestOddFilesThatAreRead:
    def test_comments_behind_two_slashes(self, tmp_path):
        (tmp_path / "a.csv").write_text("// a scan\nx,y,z // names\n1,2,3// one\n// between\n4,5,6 //two\n")
        assert read_points(tmp_path / "a.csv").points.tolist() == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]

    def test_long_comments_and_lines_of_obj(self, tmp_path):
        long = 200_000 * " 1"
        (tmp_path / "a.obj").write_text(f"#{long}\nv 1 2 3\nl{long}\nv 4 5 6\nf{long}\nf 1 2")
        table = read_points(tmp_path / "a.obj")
        assert table.points.tolist() == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
        assert table.notices == ["a.obj: left out 3 faces and lines. Only points are read."]
        (tmp_path / "a.xyz").write_text(f"#{long}\n1 2 3\n//{long}\n4 5 6")
        assert read_points(tmp_path / "a.xyz").points.tolist() == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]

    @pytest.mark.parametrize("length", [65_535, 65_536, 99_999, 100_000, 165_535, 165_536, 165_537, 265_536])
    def test_the_line_behind_a_long_one(self, tmp_path, length):
        """At the lengths at which blocks and pieces of lines end."""
        (tmp_path / "a.obj").write_text("#" * (length - 1) + "\nv 1 2 3\nv 4 5 6\n")
        assert len(read_points(tmp_path / "a.obj").points) == 2

    def test_lines_across_blocks(self, tmp_path):
        """Text is read in blocks, whose ends fall between any two characters of these lines."""
        points = np.arange(90_000.0).reshape(-1, 3)
        rows = [f"{x:.0f} {y:.0f} {z:.0f}" for x, y, z in points]
        for name, head in (("a.xyz", ""), ("a.pts", "30000\r\n"), ("a.ply", ply_head("ascii", 30_000).decode())):
            (tmp_path / name).write_bytes((head + "\r\n".join(rows)).encode())
            assert_array_equal(read_points(tmp_path / name).points, points)

    def test_numbers_of_text_that_do_not_fit_the_type_of_the_header(self, tmp_path):
        head = ply_head("ascii", 3).replace(b"end_h", b"property uchar a\nproperty int b\nproperty char c\nend_h")
        (tmp_path / "a.ply").write_bytes(head + b"1 2 3 300 nan -128\n1 2 3 0 1 0\n4 5 6 -1 1e300 127\n")
        attributes = read_points(tmp_path / "a.ply").attributes
        assert attributes["a"].tolist() == [300.0, 0.0, -1.0]
        assert_array_equal(attributes["b"], [np.nan, 1.0, 1e300])
        assert attributes["c"].dtype == np.int8

    def test_colors_that_are_none(self, tmp_path):
        (tmp_path / "a.csv").write_text("x,y,z,r,g,b\n1,2,3,nan,1e300,-1\n1,2,3,0,65535,inf\n")
        assert read_points(tmp_path / "a.csv").colors.tolist() == [[0.0, 1.0, 0.0, 1.0], [0.0, 1.0, 1.0, 1.0]]

    @pytest.mark.parametrize("kind", ["<f2", ">f4", "<f8", ">i4", "<u2", "|i1"])
    def test_arrays_of_all_numbers(self, tmp_path, kind):
        points = np.arange(12.0).reshape(4, 3)
        for order in "CF":
            np.save(tmp_path / "a.npy", points.astype(kind, order=order))
            assert_array_equal(read_points(tmp_path / "a.npy").points, points)
        data = array_head("(4L, 3L)", kind) + points.astype(kind).tobytes()  # as Python 2 wrote it
        (tmp_path / "a.npy").write_bytes(data)
        assert_array_equal(read_points(tmp_path / "a.npy").points, points)

    def test_a_small_archive_of_many_equal_points(self, tmp_path):
        np.savez_compressed(tmp_path / "a.npz", points=np.ones((100_000, 3)))
        assert len(read_points(tmp_path / "a.npz").points) == 100_000
