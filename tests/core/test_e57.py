"""E57 files give what libE57Format and a writer of odd ones wrote; those that lie about themselves are refused at once.

The files in the folder data were written by pye57; the script beside them has the formulas of their values.
"""

import re
import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from core import PointCloudError
from core.files import read_points, write_points
from tests.core.data.make_e57 import COUNT, FILES
from tests.core.e57_files import checksum, integer, make_e57, points, pose, real, scaled, seal, text, unseal

DATA = Path(__file__).parent / "data"
PLACES = np.round(np.random.default_rng(0).uniform(-5.0, 5.0, (40, 3)), 3)


def read(folder, data):
    (folder / "a.e57").write_bytes(seal(data))
    return read_points(folder / "a.e57")


def stored(name, scan=0):
    """Return the values of a scan by the names of its fields."""
    return {
        field: values * limits[2] + limits[3] if kind == "scaled" else values
        for field, (kind, limits, values) in FILES[name][scan][0].items()
    }


def places_of(values):
    return np.stack([values[f"cartesian{axis}"] for axis in "XYZ"], axis=1, dtype=np.float64)


def colors_of(values, full):
    return np.stack([values[f"color{name}"] / full for name in ("Red", "Green", "Blue")], axis=1)


class TestWhatLibE57FormatWrites:
    def test_single_precision(self):
        table, values = read_points(DATA / "single.e57"), stored("single")
        assert_array_equal(table.points, places_of(values))
        assert_array_equal(table.attributes["intensity"], values["intensity"])
        assert_array_equal(table.attributes["rowIndex"], values["rowIndex"])
        assert_array_equal(table.attributes["columnIndex"], values["columnIndex"])
        assert_allclose(table.colors[:, :3], colors_of(values, 255), atol=1e-7)
        assert_array_equal(table.colors[:, 3], np.ones(COUNT))
        assert list(table.attributes) == ["intensity", "rowIndex", "columnIndex"]
        assert [values.dtype for values in table.attributes.values()] == [np.float32, np.int32, np.int32]
        assert (table.single, table.notices) == (True, [])

    def test_scaled_numbers_and_invalid_points(self):
        table, values = read_points(DATA / "scaled.e57"), stored("scaled")
        kept = values["cartesianInvalidState"] == 0
        assert_array_equal(table.points, places_of(values)[kept])
        assert_array_equal(table.attributes["intensity"], values["intensity"][kept])
        assert_array_equal(table.attributes["returnCount"], np.ones(kept.sum()))
        assert_allclose(table.colors[:, :3], colors_of(values, 1023)[kept], atol=1e-7)
        assert list(table.attributes) == ["intensity", "returnCount"]
        assert table.notices == ["scaled.e57: left out 60 points that the scanner marked as invalid."]
        assert not table.single

    def test_scans_with_poses(self):
        table, first, second = read_points(DATA / "scans.e57"), stored("scans"), stored("scans", 1)
        x, y, z = places_of(first).T
        far = np.array([446_000.125, 4_000_000.25, 120.5])
        assert_allclose(table.points[:COUNT], np.stack([z, x, y], axis=1) + far, rtol=0.0, atol=1e-9)
        x, y, z = places_of(second).T
        turned = np.stack([0.28 * x - 0.96 * y, 0.96 * x + 0.28 * y, z], axis=1)
        assert_allclose(table.points[COUNT:], turned + [10.0, -20.0, 1.5], rtol=0.0, atol=1e-12)
        attributes = table.attributes
        assert_array_equal(attributes["scan"], np.repeat([0, 1], [COUNT, 100]))
        assert_array_equal(attributes["scanner"], np.repeat([far, [10.0, -20.0, 1.5]], [COUNT, 100], axis=0))
        assert_array_equal(attributes["intensity"], [*np.zeros(COUNT), *range(100)])
        normals = np.stack([first[f"nor:normal{axis}"] for axis in "ZXY"], axis=1)
        assert_allclose(attributes["normal"], np.concatenate([normals, np.zeros((100, 3))]), atol=1e-7)
        assert set(attributes) == {"scan", "scanner", "intensity", "normal"}
        assert (table.colors, table.single, table.notices) == (None, False, [])

    def test_spherical_coordinates(self):
        table, values = read_points(DATA / "spherical.e57"), stored("spherical")
        kept = values["sphericalInvalidState"] == 0
        distance, azimuth, elevation = (
            values[f"spherical{name}"][kept].astype(np.float64) for name in ("Range", "Azimuth", "Elevation")
        )
        azimuth = azimuth + np.arccos(0.28)
        assert_allclose(np.linalg.norm(table.points, axis=1), distance, rtol=1e-14)
        assert_allclose(np.arcsin(table.points[:, 2] / distance), elevation, atol=1e-7)
        assert_allclose(
            table.points[:, :2], (distance * np.cos(elevation) * [np.cos(azimuth), np.sin(azimuth)]).T, atol=1e-14
        )
        assert_array_equal(table.attributes["timeStamp"], values["timeStamp"][kept])
        assert set(table.attributes) == {"timeStamp", "scanner"}
        assert table.notices == ["spherical.e57: left out 200 points that the scanner marked as invalid."]


def test_checksums_are_those_of_the_standard():
    assert checksum(b"123456789") == 0xE3069283
    for name in FILES:
        data = (DATA / f"{name}.e57").read_bytes()
        assert seal(unseal(data)) == data


@pytest.mark.parametrize("sizes", [(2000,), (65_000,), (1, 7, 13, 2, 0, 5), (3, 1000, 1)])
def test_numbers_of_all_bits_however_they_are_divided(tmp_path, sizes):
    """Values end within bytes and within packets, and each field gets as many bytes in a packet as it likes."""
    random, count = np.random.default_rng(1), 203
    fields, expected = points(np.ones((count, 3))), {}
    for width in range(65):
        low = max(-(2**63), -(3 ** min(width, 39))) if width < 64 else -(2**63)
        values = [low + int.from_bytes(random.bytes(8), "little") % 2**width for _ in range(count - 2)]
        expected[f"i{width}"] = [low, low + 2**width - 1, *values]
        fields[f"i{width}"] = integer(expected[f"i{width}"], low, low + 2**width - 1)
    table = read(tmp_path, make_e57((fields, count, ""), sizes=sizes))
    assert set(table.attributes) == set(expected)
    for name, values in expected.items():
        assert table.attributes[name].tolist() == values, name
    assert table.attributes["i10"].dtype == np.int32
    assert table.attributes["i64"].dtype == np.int64


@pytest.mark.parametrize("count", [1, 7, 8, 9, 3000])
def test_scaled_numbers_in_packets_of_odd_sizes(tmp_path, count):
    values = np.random.default_rng(2).integers(-(10**5), 10**6, (count, 3))
    fields = {
        f"cartesian{axis}": scaled(column, -(10**5), 10**6, 0.001, 7.5)
        for axis, column in zip("XYZ", values.T, strict=True)
    }
    table = read(tmp_path, make_e57((fields, count, ""), sizes=(501, 77, 1003)))
    assert_array_equal(table.points, values * 0.001 + 7.5)


def test_numbers_without_limits_have_64_bits(tmp_path):
    values = np.array([-(2**63), 2**63 - 1, 0, -1] * 10)
    fields = points(PLACES) | {
        "i": ('type="Integer"', values.astype("<i8").view("u8").__add__(np.uint64(2**63)).tobytes())
    }
    assert_array_equal(read(tmp_path, make_e57((fields, 40, ""))).attributes["i"], values)


@pytest.mark.parametrize("quaternion", [(1, 0, 0, 0), (0, 1, 0, 0), (2, -1, 0.5, 3), (-0.1, 0.2, 0.3, -0.4)])
def test_rotations_are_those_of_scipy(tmp_path, quaternion):
    w, *vector = quaternion
    expected = Rotation.from_quat([*vector, w]).apply(PLACES)
    table = read(tmp_path, make_e57((points(PLACES), 40, pose(quaternion, (1, -2, 4e6)))))
    assert_allclose(table.points, expected + [1, -2, 4e6], rtol=0.0, atol=1e-8)
    assert_array_equal(table.attributes["scanner"], np.tile([1, -2, 4e6], (40, 1)))


def test_a_pose_without_one_of_its_parts(tmp_path):
    """libE57Format leaves zeros out of what it writes."""
    turned = read(tmp_path, make_e57((points(PLACES), 40, "<pose><rotation><w/><x>1</x></rotation></pose>")))
    assert_allclose(turned.points, PLACES * (1, -1, -1), rtol=0.0, atol=1e-15)
    assert turned.attributes == {}
    moved = read(tmp_path, make_e57((points(PLACES), 40, "<pose><translation><z>2</z></translation></pose>")))
    assert_array_equal(moved.points, PLACES + (0, 0, 2))


def test_single_precision_about_a_far_scanner_is_fine(tmp_path):
    far = pose((1, 0, 0, 0), (4e6, 0, 0))
    assert read(tmp_path, make_e57((points(PLACES, "f4"), 40, far))).notices == []
    assert "steps of 0.25" in read(tmp_path, make_e57((points(PLACES + 4e6, "f4"), 40, ""))).notices[0]


def limits(low, high):
    ends = (
        f"<color{name}{end}>{value}</color{name}{end}>"
        for name in COLORS
        for end, value in zip(("Minimum", "Maximum"), (low, high), strict=True)
    )
    return f"<colorLimits>{''.join(ends)}</colorLimits>"


COLORS = ("Red", "Green", "Blue")


@pytest.mark.parametrize(
    ("field", "more", "expected"),
    [
        (integer([0, 51, 255, 102], 0, 255), "", [0, 0.2, 1, 0.4]),
        (integer([0, 51, 255, 102], 0, 2**16 - 1), limits(0, 255), [0, 0.2, 1, 0.4]),
        (integer([0, 13107, 65535, 26214], 0, 65535), limits("", 65535), [0, 0.2, 1, 0.4]),
        (scaled([0, 20, 100, 40], 0, 100, 0.01), "", [0, 0.2, 1, 0.4]),
        (real([0, 0.2, 1, 0.4], "f4"), "", [0, 0.2, 1, 0.4]),
        (real([-1, 0, 4, 1]), limits(-1, 4), [0, 0.2, 1, 0.4]),
        (real([np.nan, 1e300, -np.inf, 0.5]), "", [0, 1, 0, 0.5]),
        (integer([255] * 4, 255, 255), limits(255, 255), [1, 1, 1, 1]),
    ],
)
def test_colors_have_limits(tmp_path, field, more, expected):
    fields = points(PLACES[:4]) | {f"color{name}": field for name in COLORS}
    table = read(tmp_path, make_e57((fields, 4, more)))
    assert_allclose(table.colors, np.stack([expected] * 3 + [[1.0] * 4], axis=1), atol=1e-7)
    assert table.attributes == {}


def test_scans_without_what_others_have(tmp_path):
    colors = {f"color{name}": integer([0] * 40, 0, 255) for name in COLORS}
    first, second = points(PLACES) | colors, points(-PLACES) | {"heat": real(range(40))}
    table = read(tmp_path, make_e57((first, 40, ""), (points(PLACES[:0]), 0, ""), (second, 40, "")))
    assert_array_equal(table.points, np.concatenate([PLACES, -PLACES]))
    assert_array_equal(table.attributes["scan"], np.repeat([0, 1], 40))
    assert_array_equal(table.attributes["heat"], [*np.zeros(40), *range(40)])
    assert_array_equal(table.colors, np.repeat([[0, 0, 0, 1], [1, 1, 1, 1]], 40, axis=0))


def test_what_holds_no_numbers_is_left_out(tmp_path):
    fields = {"word": text(["ab", "c"] * 20)} | points(PLACES) | {"after": integer(range(40), 0, 40)}
    table = read(tmp_path, make_e57((fields, 40, ""), sizes=(11, 3)))
    assert_array_equal(table.points, PLACES)
    assert_array_equal(table.attributes["after"], np.arange(40))
    assert table.notices == ["a.e57: left out word, which holds no numbers."]


def test_places_that_are_none_are_left_out(tmp_path):
    places = PLACES.copy()
    places[::4, 1] = np.nan
    table = read(tmp_path, make_e57((points(places), 40, "")))
    assert_array_equal(table.points, PLACES[np.arange(40) % 4 > 0])
    assert table.notices == ["a.e57: left out 10 points that the scanner marked as invalid."]


def test_places_of_scanners_survive_a_ply(tmp_path):
    write_points(tmp_path / "a.ply", read_points(DATA / "scans.e57"))
    attributes = read_points(tmp_path / "a.ply").attributes
    assert_array_equal(attributes["scanner"][[0, -1]], [[446_000.125, 4_000_000.25, 120.5], [10.0, -20.0, 1.5]])


@pytest.mark.parametrize("name", FILES)
def test_a_byte_that_changed_is_found(tmp_path, name):
    data = (DATA / f"{name}.e57").read_bytes()
    path = tmp_path / "a.e57"
    for place in range(50, len(data), 997):
        changed = bytearray(data)
        changed[place] ^= 64
        path.write_bytes(changed)
        with pytest.raises(
            PointCloudError, match=f"checksum of its page {place // 1024 + 1} of 1024 bytes does not match"
        ):
            read_points(path)


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_files_that_are_cut_off(tmp_path, name, share):
    data = (DATA / f"{name}.e57").read_bytes()
    (tmp_path / "a.e57").write_bytes(data[: int(share * len(data))])
    with pytest.raises(PointCloudError, match="is no E57 file|is shorter than its header states. Copy it again"):
        read_points(tmp_path / "a.e57")


FIELDS = points(PLACES) | {"i": integer(range(40), 0, 63)}
SCAN = (FIELDS, 40, pose((1, 0, 0, 0), (0, 0, 0)))


def patched(place, code, value):
    """Return a file with another number at a place."""
    data = bytearray(make_e57(SCAN))
    struct.pack_into(code, data, place, value)
    return bytes(data)


def described(old, new):
    """Return a file with another description."""
    assert old in make_e57(SCAN).decode("latin-1")
    return make_e57(SCAN, xml=lambda text: text.replace(old, new, 1))


def replaced(name, field):
    return make_e57((FIELDS | {name: field}, 40, ""))


SAME = make_e57(SCAN, SCAN, xml=lambda text: re.sub('fileOffset="[0-9]+"', 'fileOffset="48"', text))
LOL = (
    '<!DOCTYPE a [<!ENTITY a "lol">' + "".join(f'<!ENTITY {b} "{10 * f"&{a};"}">' for a, b in ("ab", "bc", "cd")) + "]>"
)
BROKEN = {
    "empty": (b"", "is no E57 file"),
    "magic": (patched(0, "<B", 0), "is no E57 file"),
    "version": (patched(8, "<I", 2), "is no E57 file"),
    "page": (patched(40, "<Q", 2**62), "is no E57 file"),
    "description far": (patched(24, "<Q", 2**63), "shorter than its header states"),
    "description in a checksum": (patched(24, "<Q", 1021), "nothing can begin at its byte 1021"),
    "description long": (patched(32, "<Q", 2**63), "describes itself in 9,223,372,036,854,775,808 bytes"),
    "description longer than the file": (patched(32, "<Q", 10**7), "shorter than its header states"),
    "description short": (patched(32, "<Q", 300), "its description is no XML"),
    "no XML": (described("<data3D", "<<"), "its description is no XML"),
    "entities": (described("\n<e57", f"\n{LOL}<e57"), "has a DOCTYPE, which E57 files never have"),
    "encoding": (make_e57(SCAN).replace(b"data3D", b"data\xe93", 1), "its description is no XML"),
    "no scans": (described("data3D type", "data2D type").replace(b"/data3D", b"/data2D"), "has no points"),
    "no points": (
        described("<prototype", "<x><prototype").replace(b"totype><cod", b"totype></x><cod"),
        "is broken|XML",
    ),
    "count": (described('Count="40"', 'Count="41"'), "ends after 40 of the 41 points"),
    "count large": (described('Count="40"', f'Count="{10**6}"'), "of the 1000000 points"),
    "count huge": (described('Count="40"', f'Count="{10**30}"'), "too short for the 1,0.* points that it names"),
    "count negative": (described('Count="40"', 'Count="-1"'), "a scan of -1 points"),
    "count no number": (described('Count="40"', 'Count="4e1"'), "is broken: invalid literal"),
    "count zero": (described('Count="40"', 'Count="0"'), "has no points"),
    "offset": (described('Offset="48"', 'Offset="52"'), "no points at the offset that it states"),
    "offset negative": (described('Offset="48"', 'Offset="-48"'), "nothing can begin at its byte -48"),
    "offset far": (described('Offset="48"', f'Offset="{10**30}"'), "shorter than its header states"),
    "limits": (described('minimum="0"', 'minimum="99"'), "the values of i cannot be from 99 to 63"),
    "limits huge": (described('minimum="0"', f'minimum="-{10**30}"'), "the values of i cannot be"),
    "bits": (described('minimum="0"', 'minimum="-999999"'), "of the 40 points"),
    "no x": (described("cartesianX", "cartesianU"), "has a scan without coordinates among its fields cartesianU, "),
    "type": (described('<cartesianX type="Float"', '<cartesianX type="Blob"'), "does not match its header"),
    "rotation": (described("<w>1.0</w>", "<w>0</w>"), "an invalid rotation"),
    "rotation huge": (described("<w>1.0</w>", "<w>1e200</w>"), "an invalid rotation"),
    "translation": (described("<translation><x>0.0", "<translation><x>nan"), "a scanner position is invalid"),
    "pose": (described("<translation><x>0.0", "<translation><x>a"), "is broken: could not convert"),
    "section": (patched(48, "<B", 2), "no points at the offset that it states"),
    "section long": (patched(56, "<Q", 2**63), "shorter than its header states"),
    "section short": (patched(56, "<Q", 100), "ends after .* of the 40 points"),
    "section empty": (patched(56, "<Q", 0), "no points at the offset that it states"),
    "first packet": (patched(64, "<Q", 48), "no points at the offset that it states"),
    "first packet far": (patched(64, "<Q", 2**63), "no points at the offset that it states"),
    "packet": (patched(80, "<B", 9), "packets of its points are invalid"),
    "packet long": (patched(82, "<H", 65535), "packets of its points are invalid"),
    "packet odd": (patched(82, "<H", 100), "packets of its points are invalid"),
    "packet short": (patched(82, "<H", 7), "does not match its header"),
    "packet ignored": (patched(80, "<B", 2), "ends after 0 of the 40 points"),
    "streams": (patched(84, "<H", 3), "does not match its header"),
    "streams many": (patched(84, "<H", 65535), "does not match its header"),
    "stream": (patched(86, "<H", 65535), "does not match its header"),
    "stream short": (patched(86, "<H", 16), "ends after 2 of the 40 points"),
    "scale": (replaced("cartesianX", scaled(range(40), 0, 63, np.inf)), "has no points|not finite"),
    "far": (make_e57((points(PLACES * 1e300), 40, "")), "beyond 1e.30"),
    "none": (make_e57((points(np.full((40, 3), np.nan)), 40, "")), "has no points"),
    "one place": (make_e57(({f"cartesian{a}": integer([], 5, 5) for a in "XYZ"}, 10**12, "")), "too short for the 1,0"),
    "scans of the same points": (SAME, "no points at the offset that it states"),
    "many fields": (described("<cartesianX", 9000 * '<a type="Float"/>' + "<cartesianX"), "of the 40 points"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_files_that_lie(tmp_path, what):
    """With checksums that are right."""
    data, text = BROKEN[what]
    (tmp_path / "a.e57").write_bytes(seal(make_e57((points(PLACES), 40, ""))))
    read_points(tmp_path / "a.e57")  # loads the modules of the reader, whose memory does not count
    (tmp_path / "a.e57").write_bytes(seal(data))
    tracemalloc.start()
    try:
        with pytest.raises(PointCloudError, match=text):
            read_points(tmp_path / "a.e57")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 2e6 + 50 * len(data)


@pytest.mark.parametrize("encoding", ["UTF-16", "unknown"])
def test_descriptions_are_in_one_encoding(tmp_path, encoding):
    assert_array_equal(read(tmp_path, described("UTF-8", encoding)).points, PLACES)


def test_the_file_that_broken_ones_are_made_of_is_read(tmp_path):
    assert_array_equal(read(tmp_path, make_e57(SCAN)).points, PLACES)
    assert_array_equal(read(tmp_path, make_e57(SCAN, SCAN)).points, np.concatenate([PLACES, PLACES]))
