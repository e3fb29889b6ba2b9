"""Whole numbers, times and degrees keep their digits on the way from a file through Blender to a file."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from tests.blender.clouds import add_object, attribute, sphere_points
from tests.blender.conftest import part
from tests.core import e57_files

COUNT = 400
RANDOM = np.random.default_rng(0)
PLACES = sphere_points(COUNT).astype(np.float32)
COLUMNS = {
    "instance": (16_777_217 + np.arange(COUNT)).astype(np.uint32),
    "wide": (3_000_000_017 + np.arange(COUNT)).astype(np.uint32),
    "timestamp": 1.7e9 + 1e-4 * np.arange(COUNT),
    "gps": np.round(300_000.0 + 3600.0 * RANDOM.random(COUNT), 6),
    "label": np.arange(COUNT, dtype=np.uint8) % 9,
}
HASH = RANDOM.integers(0, 2**63 - 1, COUNT)


def files():
    return part("core.files")


def write_ply(path, columns):
    kinds = {"u4": "uint", "f8": "double", "u1": "uchar", "i8": "int64"}
    rows = np.empty(
        COUNT, [*((axis, "<f4") for axis in "xyz"), *((name, item.dtype) for name, item in columns.items())]
    )
    lines = [f"property float {axis}" for axis in "xyz"]
    lines += [f"property {kinds[values.dtype.str[1:]]} {name}" for name, values in columns.items()]
    for name, values in (*zip("xyz", PLACES.T, strict=True), *columns.items()):
        rows[name] = values
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {COUNT}", *lines, "end_header\n"]
    path.write_bytes("\n".join(head).encode() + rows.tobytes())


def write_csv(path, columns):
    every = [*PLACES.T.astype(float), *columns.values()]
    lines = [",".join(repr(value) for value in row) for row in zip(*(item.tolist() for item in every), strict=True)]
    path.write_text("\n".join([",".join([*"xyz", *columns]), *lines, ""]))


def write_pcd(path, columns):
    every = dict(zip("xyz", PLACES.T, strict=True)) | columns
    rows = np.empty(COUNT, [(name, values.dtype) for name, values in every.items()])
    for name, values in every.items():
        rows[name] = values
    head = {
        "FIELDS": every,
        "SIZE": [values.dtype.itemsize for values in every.values()],
        "TYPE": [values.dtype.kind.upper() for values in every.values()],
        "COUNT": [1] * len(every),
    }
    text = "".join(f"{key} {' '.join(map(str, words))}\n" for key, words in head.items())
    path.write_bytes(f"{text}WIDTH {COUNT}\nHEIGHT 1\nDATA binary\n".encode() + rows.tobytes())


def write_las(path, columns):
    import laspy

    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = np.full(3, 1e-6)
    for name, values in columns.items():
        header.add_extra_dim(laspy.ExtraBytesParams(name, values.dtype))
    las = laspy.LasData(header)
    las.x, las.y, las.z = PLACES.T.astype(float)
    for name, values in columns.items():
        las[name] = values
    las.write(str(path))


def write_e57(path, columns):
    fields = {f"cartesian{axis}": e57_files.real(values) for axis, values in zip("XYZ", PLACES.T, strict=True)}
    for name, values in columns.items():
        if values.dtype.kind == "f":
            fields[name] = e57_files.real(values)
        else:
            fields[name] = e57_files.integer(values.tolist(), int(values.min()), int(values.max()))
    path.write_bytes(e57_files.seal(e57_files.make_e57((fields, COUNT, ""))))


WRITERS = {"ply": write_ply, "csv": write_csv, "pcd": write_pcd, "las": write_las, "e57": write_e57}


def run_import(path, **options):
    assert bpy.ops.meshfree.import_points(filepath=str(path), surface=False, **options) == {"FINISHED"}
    return bpy.context.object


def exported(path, **options):
    assert bpy.ops.meshfree.export_points(filepath=str(path), **options) == {"FINISHED"}
    return files().read_points(path)


@pytest.mark.parametrize("output", ["ply", "csv"])
@pytest.mark.parametrize("kind", WRITERS)
def test_columns_are_written_as_they_came(tmp_path, kind, output):
    WRITERS[kind](tmp_path / f"in.{kind}", COLUMNS)
    obj = run_import(tmp_path / f"in.{kind}")
    for name in ("instance", "wide", "timestamp", "gps"):
        assert len(np.unique(attribute(obj, name))) == COUNT
    assert_array_equal(attribute(obj, "instance"), COLUMNS["instance"])
    table = exported(tmp_path / f"out.{output}")
    for name, values in COLUMNS.items():
        assert_array_equal(table.attributes[name], values)
    assert table.attributes.keys() - {"intensity", "classification", "return_number"} == COLUMNS.keys()


def test_types_of_a_ply_are_those_that_hold_the_numbers(tmp_path):
    write_ply(tmp_path / "in.ply", COLUMNS)
    run_import(tmp_path / "in.ply")
    exported(tmp_path / "out.ply")
    head = (tmp_path / "out.ply").read_bytes().split(b"end_header")[0]
    for line in (b"int instance", b"uint wide", b"double timestamp", b"double gps"):
        assert b"property " + line + b"\n" in head


@pytest.mark.parametrize("kind", WRITERS)
def test_whole_numbers_of_64_bits(tmp_path, kind):
    WRITERS[kind](tmp_path / f"in.{kind}", {"hash": HASH})
    obj = run_import(tmp_path / f"in.{kind}")
    assert {obj.data.attributes[name].data_type for name in ("hash", "hash_high")} == {"INT"}
    table = exported(tmp_path / "out.csv")
    assert [int(value) for value in table.attributes["hash"]] == HASH.tolist()
    assert "hash_high" not in table.attributes
    table = exported(tmp_path / "out.ply")
    whole = table.attributes["hash"].astype(np.int64) + (table.attributes["hash_high"].astype(np.int64) << 32)
    assert_array_equal(whole, HASH)


def test_what_is_kept_otherwise_is_told(tmp_path, capfd):
    write_ply(tmp_path / "in.ply", {**COLUMNS, "hash": HASH})
    run_import(tmp_path / "in.ply")
    told = capfd.readouterr().out
    assert "wide has more digits than Blender keeps and is stored less 3,000,000,000; exports write it" in told
    assert "timestamp has more digits than Blender keeps and is stored less 1,700,000,000.02" in told
    assert "in two parts, hash and hash_high" in told
    assert "in two parts, gps and gps_rest less 30" in told
    assert "instance" not in told
    exported(tmp_path / "out.ply")
    assert "PLY has no type for hash: it is hash + 4294967296 hash_high" in capfd.readouterr().out


def test_names_and_numbers_that_blender_cannot_keep_are_told(tmp_path, capfd):
    rows = ["1,2,3,7,8,9,-1.7976931348623157e308", "4,5,6,7,8,9,2"]
    (tmp_path / "in.csv").write_text("\n".join(["x,y,z,.hidden,position,plain,none", *rows]))
    obj = run_import(tmp_path / "in.csv")
    told = capfd.readouterr().out
    assert "stored .hidden as file_.hidden, position as file_position" in told
    assert "numbers too large for Blender are infinite: 1 of none" in told
    assert "plain" not in told
    assert attribute(obj, "file_.hidden").tolist() == [7.0, 7.0]
    assert "file_.hidden" in exported(tmp_path / "out.csv").attributes


def test_tiles_can_be_joined(tmp_path, capfd):
    times = COLUMNS["timestamp"]
    write_ply(tmp_path / "a.ply", {"timestamp": times})
    write_ply(tmp_path / "b.ply", {"timestamp": times + 0.5})
    objects = [run_import(tmp_path / name) for name in ("a.ply", "b.ply")]
    for obj in objects:
        obj.select_set(True)
    bpy.ops.object.join()
    assert len(bpy.data.objects) == 1
    table = exported(tmp_path / "out.ply")
    found = np.sort(table.attributes["timestamp"])
    assert np.abs(found - np.sort(np.concatenate([times, times + 0.5]))).max() < 1e-6
    assert "has more points than were imported: timestamp may be off" in capfd.readouterr().out


def test_point_clouds_and_copies_remember(tmp_path):
    write_ply(tmp_path / "in.ply", COLUMNS)
    options = {"kind": "POINTCLOUD"} if bpy.app.version >= (4, 5) else {}
    obj = run_import(tmp_path / "in.ply", **options)
    copy = obj.copy()
    bpy.context.collection.objects.link(copy)
    bpy.context.view_layer.objects.active = copy
    assert_array_equal(exported(tmp_path / "out.ply").attributes["timestamp"], COLUMNS["timestamp"])


def test_the_surface_of_the_points_has_their_times(tmp_path, capfd):
    write_ply(tmp_path / "in.ply", {"timestamp": COLUMNS["timestamp"]})
    run_import(tmp_path / "in.ply")
    bpy.ops.meshfree.mesh_surface()
    times = exported(tmp_path / "out.ply").attributes["timestamp"]
    assert COLUMNS["timestamp"].min() - 0.05 < times.min() < times.max() < COLUMNS["timestamp"].max() + 0.05
    assert "may be off" not in capfd.readouterr().out


def test_what_only_draws_points_is_not_exported(tmp_path):
    add_object(sphere_points())
    bpy.ops.meshfree.analyze()
    assert "lb_disc" in bpy.context.object.data.attributes
    assert "lb_disc" not in exported(tmp_path / "a.ply").attributes
    assert "lb_area" in exported(tmp_path / "b.csv", attributes="RESULTS").attributes


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 0, 2]])
def test_degrees(tmp_path, capfd, order):
    share = RANDOM.random((500, 3))
    places = (np.array([-94.683, 31.037, 39.0]) + share * [0.0228, 0.0106, 39.0])[:, order]
    np.savetxt(tmp_path / "degrees.xyz", places, fmt="%.9f")
    obj = run_import(tmp_path / "degrees.xyz")
    assert "x and y look like degrees" in capfd.readouterr().out
    assert obj["lb_offset"][2] == 0.0
    assert np.abs(exported(tmp_path / "back.ply").points - places)[:, :2].max() < 1e-8


def test_names_beyond_ascii_are_told(tmp_path, capfd):
    (tmp_path / "a.csv").write_text("x;y;z;Höhe\n" + "".join(f"{n};{n % 3};{n % 5};{n}\n" for n in range(20)))
    run_import(tmp_path / "a.csv")
    assert_array_equal(exported(tmp_path / "out.ply").attributes["Hoehe"], np.arange(20))
    assert "wrote Höhe as Hoehe" in capfd.readouterr().out
