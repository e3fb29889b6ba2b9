"""Import and export of point files: coordinates of any size, attributes, colors, undo, errors, and the menus."""

import types
from pathlib import Path

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.blender.clouds import add_object, attribute, everything, local_points, sphere_points
from tests.blender.conftest import part
from tests.core import e57_files

FAR = np.array([446_123.0, 4_000_456.0, 78.0])
SURVEY = np.round(50.0 * sphere_points(1000), 3) + FAR  # in metres, with millimetres
STEP = np.spacing(np.float32(100.0))  # of single precision at the size of the survey


def read_file(path):
    return part("core.files").read_points(path)


def write_file(path, points, attributes=None):
    files = part("core.files")
    files.write_points(path, files.PointTable(points, attributes or {}))


def write_text(path, points, delimiter=" ", head=""):
    np.savetxt(path, points, "%.3f", delimiter, header=head, comments="")


def write_obj(path, points):
    path.write_text("".join(f"v {x:.3f} {y:.3f} {z:.3f}\n" for x, y, z in points))


def write_las(path, points):
    """By the laspy that the extension brings."""
    import laspy

    header = laspy.LasHeader(point_format=7, version="1.4")
    header.offsets, header.scales = np.floor(points.min(axis=0)), np.full(3, 0.001)
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.intensity, las.classification = np.arange(len(points)), np.full(len(points), 6)
    las.red = np.full(len(points), 65535)
    las.write(str(path))


def write_pcd(path, points):
    """In double precision, which binary files can hold."""
    count = len(points)
    head = f"VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {count}\nHEIGHT 1\nPOINTS {count}\n"
    path.write_bytes(f"{head}DATA binary\n".encode() + points.astype("<f8").tobytes())


def write_e57(path, points):
    """In whole millimeters from where the scanner stood, about its x axis turned by half a turn."""
    low = np.floor(points.min(axis=0))
    steps = np.round((points - low) * (1000, -1000, -1000)).astype(int)
    limit = int(np.abs(steps).max())
    fields = {
        f"cartesian{axis}": e57_files.scaled(column, -limit, limit, 0.001)
        for axis, column in zip("XYZ", steps.T, strict=True)
    }
    fields["intensity"] = e57_files.integer(range(len(points)), 0, len(points))
    path.write_bytes(e57_files.seal(e57_files.make_e57((fields, len(points), e57_files.pose((0, 1, 0, 0), low)))))


def ptx_head(columns, rows, turn, place):
    """Return the lines before the points of a scan, whose axes are the rows of `turn`."""
    place = " ".join(f"{value:.0f}" for value in place)
    axes = [" ".join(f"{value:g}" for value in axis) for axis in turn]
    return [str(columns), str(rows), place, *axes, *(f"{axis} 0" for axis in axes), f"{place} 1"]


def write_ptx(path, points):
    """From a scanner whose axes are turned by a quarter, with as many rays that hit nothing."""
    low = np.floor(points.min(axis=0))
    turned = (points - low)[:, [1, 0, 2]] * (1.0, -1.0, 1.0)
    rows = [f"{x:.3f} {y:.3f} {z:.3f} 0.25\n0 0 0 0.5" for x, y, z in turned]
    path.write_text("\n".join([*ptx_head(len(points), 2, ((0, 1, 0), (-1, 0, 0), (0, 0, 1)), low), *rows]))


WRITERS = {
    "a.ply": write_file,
    "a.obj": write_obj,
    "a.xyz": write_text,
    "a.pts": lambda path, points: write_text(path, points, head=str(len(points))),
    "a.csv": lambda path, points: write_text(path, points, ",", "x,y,z"),
    "a.txt": lambda path, points: write_text(path, points, "\t"),
    "a.ptx": write_ptx,
    "a.npy": np.save,
    "a.npz": lambda path, points: np.savez(path, points=points),
    "a.pcd": write_pcd,
    "a.las": write_las,
    "a.laz": write_las,
    "a.e57": write_e57,
}


def run_import(*paths, **options):
    """Import one file, or several of one folder."""
    if len(paths) == 1:
        assert bpy.ops.meshfree.import_points(filepath=str(paths[0]), **options) == {"FINISHED"}
    else:
        names = [{"name": path.name} for path in paths]
        bpy.ops.meshfree.import_points(directory=str(paths[0].parent), files=names, **options)
    return bpy.context.object


def everywhere():
    """All data-blocks by name and the selection, to compare before and after."""
    blocks = {name: sorted(block.name for block in getattr(bpy.data, name)) for name in ("objects", "meshes")}
    return blocks, [obj.name for obj in bpy.context.selected_objects], bpy.context.object and bpy.context.object.name


@pytest.mark.parametrize("output", ["out.ply", "out.xyz", "out.csv"])
@pytest.mark.parametrize("name", WRITERS)
def test_millimetres_survive_import_analysis_and_export(tmp_path, name, output):
    WRITERS[name](tmp_path / name, SURVEY)
    obj = run_import(tmp_path / name)
    assert (obj.name, obj.type, obj.select_get()) == ("a", "MESH", True)
    assert list(obj["lb_offset"]) == [446_120.0, 4_000_460.0, 80.0]
    assert np.abs(local_points(obj)).max() < 150.0
    assert bpy.ops.meshfree.analyze(show=False) == {"FINISHED"}
    assert obj.meshfree.total_area == pytest.approx(4.0 * np.pi * 50.0**2, rel=0.01)
    assert bpy.ops.meshfree.export_points(filepath=str(tmp_path / output)) == {"FINISHED"}
    table = read_file(tmp_path / output)
    assert np.abs(table.points - SURVEY).max() <= STEP
    assert_allclose(table.attributes["lb_area"], attribute(obj, "lb_area"), rtol=1e-6)
    assert_array_equal(table.attributes["lb_component"], attribute(obj, "lb_component"))
    assert_allclose(table.attributes["normal"], attribute(obj, "lb_normal"), atol=1e-6)


def test_near_coordinates_stay_as_they_are(tmp_path):
    points = sphere_points().astype(np.float32)
    np.save(tmp_path / "a.npy", points)
    obj = run_import(tmp_path / "a.npy")
    assert "lb_offset" not in obj
    assert_array_equal(local_points(obj), points)
    bpy.ops.meshfree.export_points(filepath=str(tmp_path / "a.ply"))
    assert b"property float x\n" in (tmp_path / "a.ply").read_bytes()
    assert_array_equal(read_file(tmp_path / "a.ply").points, points)


def test_moved_turned_and_scaled_objects_are_exported_where_they_are(tmp_path):
    np.save(tmp_path / "a.npy", SURVEY)
    obj = run_import(tmp_path / "a.npy")
    obj.location = (1000.0, 0.0, 0.0)
    obj.rotation_euler.z = np.pi / 2.0
    obj.scale = (1.0, 1.0, 2.0)
    bpy.ops.meshfree.analyze(show=False)
    bpy.ops.meshfree.export_points(filepath=str(tmp_path / "a.ply"))
    local = local_points(obj)
    expected = local[:, [1, 0, 2]] * (-1.0, 1.0, 2.0) + (1000.0, 0.0, 0.0) + obj["lb_offset"]
    table = read_file(tmp_path / "a.ply")
    assert_allclose(table.points, expected, rtol=0.0, atol=1e-4)
    outward = (SURVEY - FAR)[:, [1, 0, 2]] * (-1.0, 1.0, 0.5)  # gradient of the ellipsoid's equation
    cosine = np.einsum("ij,ij->i", outward / np.linalg.norm(outward, axis=1)[:, None], table.attributes["normal"])
    assert np.abs(cosine).min() > 0.98


def test_shape_keys_are_exported_as_they_are_seen(tmp_path):
    obj = add_object(sphere_points())
    bpy.ops.meshfree.mode_shape(mode=1, amplitude=0.5)
    bpy.ops.meshfree.export_points(filepath=str(tmp_path / "a.ply"))
    assert_allclose(np.linalg.norm(read_file(tmp_path / "a.ply").points, axis=1), 1.5, rtol=1e-2)
    assert_allclose(np.linalg.norm(local_points(obj), axis=1), 1.0, rtol=1e-5)


class TestSeveralFiles:
    def test_tiles_of_a_survey_stay_aligned(self, tmp_path):
        for number in range(3):
            np.save(tmp_path / f"{number}.npy", SURVEY + [100.0 * number, 0.0, 0.0])
        run_import(tmp_path / "0.npy", tmp_path / "1.npy")
        run_import(tmp_path / "2.npy")  # later, too
        objects = [bpy.data.objects[str(number)] for number in range(3)]
        assert len({tuple(obj["lb_offset"]) for obj in objects}) == 1
        for number in (1, 2):
            shift = local_points(objects[number]) - local_points(objects[0])
            assert_allclose(shift, np.tile([100.0 * number, 0.0, 0.0], (1000, 1)), atol=1e-4)
        assert bpy.context.selected_objects == [objects[2]]

    def test_far_apart_ones_do_not(self, tmp_path):
        np.save(tmp_path / "a.npy", SURVEY)
        np.save(tmp_path / "b.npy", SURVEY + 5e6)
        run_import(tmp_path / "a.npy", tmp_path / "b.npy")
        assert len(bpy.context.selected_objects) == 2
        assert np.abs(local_points(bpy.data.objects["b"])).max() < 150.0

    def test_one_broken_file_leaves_nothing(self, tmp_path):
        np.save(tmp_path / "a.npy", SURVEY)
        (tmp_path / "b.xyz").write_text("1 2 3\n4 5 x\n")
        add_object(sphere_points()).select_set(True)
        before = everywhere()
        with pytest.raises(RuntimeError, match="line 2 has 'x' where a number should be"):
            run_import(tmp_path / "a.npy", tmp_path / "b.xyz")
        assert everywhere() == before


class TestClassesAndWithheldPoints:
    @pytest.fixture
    def path(self, tmp_path):
        """A scan of ground, trees and noise, of which every tenth point is withheld."""
        import laspy

        las = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
        las.x, las.y, las.z = sphere_points().T
        las.classification, las.withheld = np.arange(1000) % 3 + 5, np.arange(1000) % 10 == 0
        las.write(str(tmp_path / "a.las"))
        return tmp_path / "a.las"

    def test_withheld_ones_are_left_out(self, path):
        assert len(run_import(path).data.vertices) == 900

    def test_or_kept_by_choice(self, path):
        obj = run_import(path, withheld=True)
        assert_array_equal(attribute(obj, "withheld"), np.arange(1000) % 10 == 0)

    def test_classes_by_choice(self, path):
        obj = run_import(path, classes="5, 7")
        assert len(obj.data.vertices) < 900
        assert set(attribute(obj, "classification")) == {5, 7}

    def test_what_is_no_class_is_told(self, path):
        with pytest.raises(RuntimeError, match="'ground' is no class of LAS"):
            run_import(path, classes="ground")
        with pytest.raises(RuntimeError, match="no points of the classes 2. Choose some of 5"):
            run_import(path, classes="2")
        assert not bpy.data.objects

    def test_feet_stay_and_come_back_or_become_meters(self, core, path, tmp_path, capfd):
        import laspy

        las = laspy.read(path)
        las.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr('PROJCS["a",UNIT["foot",0.3048]]'))
        las.x = las.x + 1e6
        las.write(str(path))
        for meters, factor, told in ((False, 1.0, "Set Unit Scale"), (True, 0.3048, "converted to meters")):
            run_import(path, meters=meters)
            assert told in capfd.readouterr().out
            bpy.ops.meshfree.export_points(filepath=str(tmp_path / "a.xyz"), attributes="NONE")
            places = core.files.read_points(tmp_path / "a.xyz").points
            assert_allclose(places, factor * las.xyz[las.withheld == 0], rtol=0.0, atol=1e-4)


class TestColumns:
    def test_become_attributes(self, tmp_path):
        rows = np.column_stack([sphere_points(), np.arange(1000), np.tile([255, 0, 51], (1000, 1)), sphere_points()])
        np.savetxt(tmp_path / "a.csv", rows, "%.9g", ",", header="x,y,z,heat,r,g,b,nx,ny,nz", comments="")
        obj = run_import(tmp_path / "a.csv")
        assert_array_equal(attribute(obj, "heat"), np.arange(1000))
        assert_allclose(attribute(obj, "normal"), sphere_points(), rtol=1e-6)
        colors = np.empty(4000, np.float32)
        obj.data.color_attributes.active_color.data.foreach_get("color_srgb", colors)
        assert_allclose(colors[:4], [1.0, 0.0, 0.2, 1.0], atol=1e-3)
        bpy.ops.meshfree.export_points(filepath=str(tmp_path / "b.ply"))
        table = read_file(tmp_path / "b.ply")
        assert_allclose(table.colors, np.tile([1.0, 0.0, 0.2, 1.0], (1000, 1)), atol=1e-3)
        assert_allclose(table.attributes["normal"], sphere_points(), rtol=1e-5, atol=1e-6)

    def test_by_choice(self, tmp_path):
        (tmp_path / "a.csv").write_text("x,y,z,heat,r,g,b\n" + "1,2,3,4,5,6,7\n" * 9)
        obj = run_import(tmp_path / "a.csv", attributes=False)
        assert not obj.data.color_attributes
        assert "heat" not in obj.data.attributes
        obj = run_import(tmp_path / "a.csv")
        for choice, names in (("ALL", {"heat"}), ("RESULTS", set()), ("NONE", set())):
            bpy.ops.meshfree.export_points(filepath=str(tmp_path / "b.csv"), attributes=choice, colors=False)
            table = read_file(tmp_path / "b.csv")
            assert set(table.attributes) == names
            assert table.colors is None

    def test_by_the_names_that_are_given(self, tmp_path):
        (tmp_path / "a.xyz").write_text("1 2 3 4 255 0 51 9\n" * 9)
        obj = run_import(tmp_path / "a.xyz", columns="heat y x z r g b -")
        assert local_points(obj)[0].tolist() == [3.0, 2.0, 4.0]
        assert attribute(obj, "heat").tolist() == [1.0] * 9
        assert obj.data.color_attributes.active_color.data[0].color_srgb[2] == pytest.approx(0.2, abs=1e-3)
        again = run_import(tmp_path / "a.xyz", columns="z y x ...")
        assert local_points(again)[0].tolist() == [3.0, 2.0, 1.0]
        assert not again.data.color_attributes

    @pytest.mark.parametrize(
        ("name", "columns", "text"),
        [
            ("a.xyz", "x y z", "3 columns are named, but its first point has 4"),
            ("a.xyz", "x y z r g", "5 columns are named, but its first point has 4"),
            ("a.xyz", "x y heat -", "do not name z"),
            ("a.xyz", "x y z X", "name x more than once"),
            ("a.npy", "x y z", "names its columns itself. Give Columns only with .xyz"),
        ],
    )
    def test_wrong_names_leave_nothing(self, tmp_path, name, columns, text):
        (tmp_path / "a.xyz").write_text("1 2 3 4\n" * 9)
        np.save(tmp_path / "a.npy", SURVEY)
        before = everywhere()
        with pytest.raises(RuntimeError, match=text):
            bpy.ops.meshfree.import_points(filepath=str(tmp_path / name), columns=columns)
        assert everywhere() == before

    def test_are_asked_for_where_text_is_chosen(self):
        importing = part("operators.files.importing")
        asks = importing.MESHFREE_OT_import_points.asks.fget
        chosen = types.SimpleNamespace(sequence=False)
        for names, text in (
            (["a.xyz"], 1),
            (["b.CSV"], 1),
            ([""], 1),
            (["a.ply", "b.txt"], 1),
            (["a.ply"], 0),
            (["a.ptx"], 0),
        ):
            chosen.chosen = lambda names=names: [Path(name) for name in names]
            assert ("columns" in asks(chosen)) == text

    def test_results_come_back_as_results(self, tmp_path):
        obj = add_object(sphere_points())
        bpy.ops.meshfree.analyze(modes=2, show=False)
        kinds = {layer.name: layer.data_type for layer in obj.data.attributes if layer.name.startswith("lb_")}
        for name in ("a.ply", "a.csv"):
            bpy.context.view_layer.objects.active = obj
            bpy.ops.meshfree.export_points(filepath=str(tmp_path / name), attributes="RESULTS")
            again = run_import(tmp_path / name, surface=False)
            found = {layer.name: layer.data_type for layer in again.data.attributes if layer.name.startswith("lb_")}
            assert found == {key: kind for key, kind in kinds.items() if key != "lb_normal"}
            assert_allclose(attribute(again, "lb_eigenvector_002"), attribute(obj, "lb_eigenvector_002"), rtol=1e-6)
            assert bpy.ops.meshfree.colormap(attribute="lb_boundary") == {"FINISHED"}

    def test_numbers_named_like_vectors(self, tmp_path):
        (tmp_path / "a.csv").write_text("x,y,z,lb_normal,normal\n" + "1,2,3,4,5\n" * 9)
        obj = run_import(tmp_path / "a.csv")
        assert attribute(obj, "lb_normal").tolist() == [4.0] * 9
        bpy.ops.meshfree.export_points(filepath=str(tmp_path / "b.ply"))
        table = read_file(tmp_path / "b.ply")
        assert {name: values[0] for name, values in table.attributes.items()} == {"lb_normal": 4.0, "normal": 5.0}

    def test_names_that_blender_keeps_for_itself(self, tmp_path):
        columns = ["id", "material_index", "position", "n" * 80]
        write_file(tmp_path / "a.ply", sphere_points(), {name: np.arange(1000.0) for name in columns})
        names = {layer.name for layer in run_import(tmp_path / "a.ply").data.attributes}
        assert {"file_position", "n" * 60} <= names
        for name in ("id", "material_index"):  # from Blender 5 on they are free
            assert {name, f"file_{name}"} & names


def test_up_axis(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z,nx,ny,nz\n" + "1,2,3,0,1,0\n" * 9)
    assert_allclose(local_points(run_import(tmp_path / "a.csv"))[0], [1.0, 2.0, 3.0])
    obj = run_import(tmp_path / "a.csv", up="Y")
    assert_allclose(local_points(obj)[0], [1.0, -3.0, 2.0])
    assert_allclose(attribute(obj, "normal")[0], [0.0, 0.0, 1.0])


def selected_points(obj):
    """Which points an object has selected, as the tools of the extension and Edit Mode take them."""
    return part("operators.tools.select").selection(obj)


@pytest.mark.parametrize("kind", ["MESH", "POINTCLOUD"] if bpy.app.version >= (4, 5, 0) else ["MESH"])
@pytest.mark.parametrize("name", WRITERS)
def test_an_import_selects_the_objects_and_none_of_their_points(tmp_path, name, kind):
    WRITERS[name](tmp_path / name, SURVEY)
    obj = run_import(tmp_path / name, kind=kind)
    assert bpy.context.selected_objects == [obj]
    assert not selected_points(obj).any()
    if kind == "MESH":
        bpy.ops.object.mode_set(mode="EDIT")
        assert obj.data.total_vert_sel == 0
        bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.skipif(bpy.app.version < (4, 5, 0), reason="Blender makes point clouds of meshes from 4.5 on")
def test_point_cloud_objects(tmp_path):
    np.save(tmp_path / "a.npy", SURVEY)
    np.save(tmp_path / "b.npy", SURVEY + 10.0)
    obj = run_import(tmp_path / "a.npy", tmp_path / "b.npy", kind="POINTCLOUD")
    assert [other.type for other in bpy.data.objects] == ["POINTCLOUD", "POINTCLOUD"]
    assert len(obj.data.points) == 1000
    assert list(obj["lb_offset"]) == [446_120.0, 4_000_460.0, 80.0]
    assert not bpy.data.meshes


def test_undo_takes_an_import_back(tmp_path):
    np.save(tmp_path / "a.npy", SURVEY)
    add_object(sphere_points())
    bpy.ops.ed.undo_push(message="Before")
    before = everywhere()
    bpy.ops.meshfree.import_points("EXEC_DEFAULT", True, filepath=str(tmp_path / "a.npy"))
    assert "a" in bpy.data.objects
    bpy.ops.ed.undo()
    assert everywhere() == before


def test_a_place_relative_to_the_open_file(tmp_path):
    write_text(tmp_path / "a.xyz", SURVEY)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    assert bpy.ops.meshfree.import_points(filepath="//a.xyz") == {"FINISHED"}
    assert bpy.ops.meshfree.import_points(directory="//", files=[{"name": "a.xyz"}]) == {"FINISHED"}


def test_import_needs_object_mode(tmp_path):
    add_object(sphere_points())
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="Switch to Object Mode first"):
        bpy.ops.meshfree.import_points(filepath=str(tmp_path / "a.npy"))
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("name", ["scan.las", "scan.laz"])
def test_laser_scans_are_imported(extension, tmp_path, name):
    import laspy  # that of the extension

    las = laspy.create(point_format=2, file_version="1.2")
    las.header.scales, las.header.offsets = np.full(3, 0.001), np.array([446_000.0, 4_000_000.0, 0.0])
    points = sphere_points(300) + las.header.offsets
    las.x, las.y, las.z = points.T
    las.classification = np.arange(300) % 5
    las.red = np.full(300, 65535)
    las.write(str(tmp_path / name))
    assert bpy.ops.meshfree.import_points(filepath=str(tmp_path / name)) == {"FINISHED"}
    obj = bpy.context.object
    assert_allclose(local_points(obj) + np.array(obj["lb_offset"]), points, rtol=0.0, atol=1e-3)
    assert_array_equal(attribute(obj, "classification"), np.arange(300) % 5)
    assert {"intensity", "return_number", "Color"} <= {*obj.data.attributes.keys()}


@pytest.mark.parametrize(
    ("name", "data", "text"),
    [
        ("missing.ply", None, "There is no file"),
        ("a.laz", b"LASF", "is no LAS file: it does not begin with the header of one. Export it again"),
        ("a.e57", b"ASTM-E57", "is no E57 file: it does not begin with the header of one. Export it again"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\n", "line 5: '' is not valid"),
        ("a.xyz", b"", "there are none"),
        ("a.csv", b"x,y,z\n", "there are none"),
        ("a.pts", b"5\n1 2 3\n", "announces 5 points, but 1 lines follow"),
        ("a.obj", b"v 1 2 nan\n", "all 1 have no valid coordinates"),
    ],
)
def test_broken_files_leave_nothing(tmp_path, name, data, text):
    if data is not None:
        (tmp_path / name).write_bytes(data)
    add_object(sphere_points()).select_set(True)
    before = everywhere()
    with pytest.raises(RuntimeError, match=text):
        bpy.ops.meshfree.import_points(filepath=str(tmp_path / name))
    assert everywhere() == before


class TestExport:
    def test_changes_nothing(self, tmp_path):
        obj = add_object(sphere_points())
        bpy.ops.meshfree.analyze(modes=3, show=False)
        before = everything(obj)
        bpy.ops.meshfree.export_points(filepath=str(tmp_path / "a.ply"))
        bpy.ops.meshfree.export_operator(filepath=str(tmp_path / "a.npz"))
        bpy.ops.meshfree.export_eigenvalues(filepath=str(tmp_path / "a.csv"))
        assert everything(obj) == before
        assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "a.npz", "a.ply"]

    def test_unknown_ending(self, tmp_path):
        add_object(sphere_points())
        with pytest.raises(RuntimeError, match="Give it one of .ply, .xyz, .csv"):
            bpy.ops.meshfree.export_points(filepath=str(tmp_path / "a.stl"))

    @pytest.mark.parametrize("scale", [(0.0, 1.0, 1.0), (-1.0, 1.0, 1.0)])
    def test_any_scale(self, tmp_path, scale):
        obj = add_object(sphere_points())
        bpy.ops.meshfree.analyze(show=False)
        obj.scale = scale
        bpy.ops.meshfree.export_points(filepath=str(tmp_path / "a.ply"))
        table = read_file(tmp_path / "a.ply")
        assert_allclose(table.points, local_points(obj) * scale, atol=1e-6)
        outward = sphere_points() * scale if scale[0] else np.sign(sphere_points()) * (1.0, 0.0, 0.0)
        clear = np.abs(sphere_points()[:, 0]) > 0.1  # elsewhere the normal of a flat object is anybody's guess
        assert np.einsum("ij,ij->i", table.attributes["normal"], outward)[clear].min() > 0.9

    def test_a_folder_that_is_a_file(self, tmp_path):
        add_object(sphere_points())
        (tmp_path / "a").write_text("")
        with pytest.raises(RuntimeError, match="Error: .*a"):
            bpy.ops.meshfree.export_points(filepath=str(tmp_path / "a" / "b.ply"))

    def test_operator_and_spectrum_for_researchers(self, core, tmp_path):
        from scipy.sparse import load_npz  # bundled with the extension

        np.save(tmp_path / "a.npy", SURVEY)
        obj = run_import(tmp_path / "a.npy")
        bpy.ops.meshfree.spectrum(count=5, show=False)
        bpy.ops.meshfree.export_operator(filepath=str(tmp_path / "a.npz"))
        stiffness = load_npz(tmp_path / "a.npz")
        arrays = np.load(tmp_path / "a.npz")
        assert np.abs(arrays["points"] - SURVEY).max() <= STEP
        assert_allclose(arrays["areas"], attribute(obj, "lb_area"), rtol=1e-6)
        assert_array_equal(arrays["eigenvalues"], obj["lb_eigenvalues"])
        laplacian = core.build_laplacian(local_points(obj))
        assert abs(stiffness - laplacian.stiffness).max() <= 1e-9 * abs(stiffness).max()
        vectors = arrays["eigenvectors"]
        assert vectors.shape == (1000, 5)
        quotients = np.einsum("ij,ij->j", vectors, stiffness @ vectors)  # raw eigenvalues, for unit modes
        assert_allclose(vectors.T @ (arrays["areas"][:, None] * vectors), np.eye(5), atol=1e-9)
        assert_allclose(quotients[1:], arrays["eigenvalues"][1:], rtol=0.2)

    def test_points_of_no_place(self, tmp_path):
        points = sphere_points(20)
        points[3, 0], points[5] = np.inf, np.nan
        add_object(points)
        assert bpy.ops.meshfree.export_points(filepath=str(tmp_path / "a.xyz")) == {"FINISHED"}
        assert np.isfinite(np.loadtxt(tmp_path / "a.xyz")).all(axis=1).sum() == 18

    def test_operator_without_modes(self, tmp_path):
        add_object(sphere_points())
        bpy.ops.meshfree.export_operator(filepath=str(tmp_path / "a.npz"))
        arrays = np.load(tmp_path / "a.npz")
        assert arrays["eigenvalues"].shape == (0,)
        assert arrays["eigenvectors"].shape == (1000, 0)

    def test_eigenvalues(self, tmp_path):
        obj = add_object(sphere_points())
        with pytest.raises(RuntimeError, match="Press Compute Modes first"):
            bpy.ops.meshfree.export_eigenvalues(filepath=str(tmp_path / "a.csv"))
        obj["lb_eigenvalues"] = "mine"
        with pytest.raises(RuntimeError, match="Press Compute Modes first"):
            bpy.ops.meshfree.export_eigenvalues(filepath=str(tmp_path / "a.csv"))
        bpy.ops.meshfree.spectrum(count=4, show=False)
        bpy.ops.meshfree.export_eigenvalues(filepath=str(tmp_path / "a.csv"))
        lines = (tmp_path / "a.csv").read_text().splitlines()
        assert lines[0] == "mode,eigenvalue"
        assert [line.split(",")[0] for line in lines[1:]] == ["1", "2", "3", "4"]
        assert [float(line.split(",")[1]) for line in lines[1:]] == list(obj["lb_eigenvalues"])


class TestMenus:
    class Menu:
        """Stands in for a menu that is drawn."""

        def __init__(self):
            self.layout, self.entries = self, []

        def operator(self, idname, text):
            self.entries.append((idname, text))

    def test_entries(self, extension):
        for name, idnames in (
            ("import", ["import_points", "import_tiles"]),
            (
                "export",
                [
                    "export_points",
                    "export_splats",
                    "export_operator",
                    "export_eigenvalues",
                    "export_measures",
                    "export_profile",
                ],
            ),
        ):
            drawn = getattr(bpy.types, f"TOPBAR_MT_file_{name}")._dyn_ui_initialize()
            (draw,) = [function for function in drawn if function.__module__.startswith(extension.__name__)]
            menu = self.Menu()
            draw(menu, bpy.context)
            assert [idname for idname, _ in menu.entries] == [f"meshfree.{idname}" for idname in idnames]
            for idname, text in menu.entries:
                assert "(." in text
                getattr(bpy.ops.meshfree, idname.removeprefix("meshfree.")).get_rna_type()

    def test_dropped_files_do_not_fight_with_those_of_blender(self):
        handlers = {name: getattr(bpy.types, name) for name in dir(bpy.types) if "_FH_" in name}
        ours = handlers.pop("MESHFREE_FH_points")
        assert ours.bl_import_operator == "meshfree.import_points"
        extensions = set(ours.bl_file_extensions.split(";"))
        assert extensions == {
            ".ply",
            ".xyz",
            ".pts",
            ".ptx",
            ".csv",
            ".txt",
            ".asc",
            ".grd",
            ".npy",
            ".npz",
            ".pcd",
            ".las",
            ".laz",
            ".e57",
            ".splat",
            ".spz",
        }
        tiles = handlers.pop("MESHFREE_FH_tiles")  # Blender asks where two know a kind of file
        assert (tiles.bl_import_operator, tiles.bl_file_extensions) == ("meshfree.import_tiles", ".las;.laz")
        assert tiles.bl_label != ours.bl_label
        theirs = {extension for handler in handlers.values() for extension in handler.bl_file_extensions.split(";")}
        assert not extensions & (theirs | {".obj"})  # its own importer of PLY is none of these types


@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_what_laser_scanners_measure_becomes_attributes(tmp_path, name):
    write_las(tmp_path / name, SURVEY)
    obj = run_import(tmp_path / name)
    assert_array_equal(attribute(obj, "intensity"), np.arange(len(SURVEY)))
    assert_array_equal(attribute(obj, "classification"), np.full(len(SURVEY), 6))
    assert_array_equal(attribute(obj, "return_number"), np.zeros(len(SURVEY)))
    assert obj.data.color_attributes["Color"].data[0].color_srgb[:] == pytest.approx((1.0, 0.0, 0.0, 1.0), abs=0.01)


@pytest.mark.parametrize("kind", [0, 3, 6, 8, 10])
def test_laser_scans_are_exported_as_they_were_imported(extension, tmp_path, kind):
    import laspy  # that of the extension

    from tests.core.las_files import check_same, write_all

    given = write_all(tmp_path / "a.las", kind, full=255)
    run_import(tmp_path / "a.las")
    assert bpy.ops.meshfree.export_points(filepath=str(tmp_path / "b.laz")) == {"FINISHED"}
    check_same(laspy.read(tmp_path / "b.laz"), given)
    bpy.ops.meshfree.import_tiles(filepath=str(tmp_path / "a.las"))
    assert bpy.ops.meshfree.export_points(filepath=str(tmp_path / "c.las")) == {"FINISHED"}
    check_same(laspy.read(tmp_path / "c.las"), given)


class TestPlacesOfScanners:
    PLACES = (
        (446_100.0, 4_000_500.0, 80.0),
        (446_100.0, 4_000_460.0, 200.0),
    )  # inside and above the surveyed ellipsoid

    def write(self, path):
        """Write the survey as seen by two scanners."""
        parts = np.array_split(SURVEY, 2)
        scans = [
            (e57_files.points(part - place), len(part), e57_files.pose((1, 0, 0, 0), place))
            for part, place in zip(parts, self.PLACES, strict=True)
        ]
        path.write_bytes(e57_files.seal(e57_files.make_e57(*scans)))
        return np.repeat(self.PLACES, [len(part) for part in parts], axis=0)

    def test_they_move_with_the_points(self, tmp_path):
        places = self.write(tmp_path / "a.e57")
        obj = run_import(tmp_path / "a.e57")
        assert_array_equal(attribute(obj, "scan"), places[:, 2] == 200.0)
        assert_allclose(local_points(obj) + np.array(obj["lb_offset"]), SURVEY, rtol=0.0, atol=STEP)
        assert_allclose(attribute(obj, "scanner"), places - obj["lb_offset"], rtol=0.0, atol=STEP)

    def test_they_are_turned_upright_with_the_points(self, tmp_path):
        places = self.write(tmp_path / "a.e57")[:, [0, 2, 1]] * (1.0, -1.0, 1.0)
        obj = run_import(tmp_path / "a.e57", up="Y")
        assert_allclose(attribute(obj, "scanner"), places - obj["lb_offset"], rtol=0.0, atol=STEP)

    def test_they_are_exported_where_they_are(self, tmp_path):
        places = self.write(tmp_path / "a.e57")
        obj = run_import(tmp_path / "a.e57")
        obj.location.x = 1000.0
        obj.rotation_euler.z = np.pi / 2.0
        bpy.context.view_layer.update()
        bpy.ops.meshfree.export_points(filepath=str(tmp_path / "a.ply"))
        expected = (places - obj["lb_offset"])[:, [1, 0, 2]] * (-1.0, 1.0, 1.0) + (1000.0, 0.0, 0.0) + obj["lb_offset"]
        assert_allclose(read_file(tmp_path / "a.ply").attributes["scanner"], expected, rtol=0.0, atol=1e-3)

    @pytest.mark.parametrize("name", ["a.e57", "a.ptx"])
    def test_normals_are_oriented_by_them(self, tmp_path, name):
        """Half of a plane is seen from above, the other half from below."""
        x, y = (values.ravel() for values in np.meshgrid(np.arange(40.0), np.arange(20.0)))
        scans, lines = [], []
        for side, place in ((0.0, (20.0, 10.0, 50.0)), (100.0, (120.0, 10.0, -50.0))):
            points = np.stack([x + side, y, np.zeros(x.size)], axis=1) - place
            scans.append((e57_files.points(points), x.size, e57_files.pose((1, 0, 0, 0), place)))
            lines += [*ptx_head(x.size, 1, np.eye(3), place), *("{:g} {:g} {:g} 0".format(*point) for point in points)]
        if name == "a.ptx":
            (tmp_path / name).write_text("\n".join(lines))
        else:
            (tmp_path / name).write_bytes(e57_files.seal(e57_files.make_e57(*scans)))
        obj = run_import(tmp_path / name)
        bpy.ops.meshfree.orient_normals(method="ATTRIBUTE", source="scanner", holds="POSITIONS")
        assert_allclose(attribute(obj, "lb_normal")[:, 2], np.repeat([1.0, -1.0], x.size), atol=1e-3)


def test_values_beyond_single_precision(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z,heat,lb_component\n1,2,3,1e300,nan\n4,5,6,nan,1\n7,8,10,1,2\n")
    heat = attribute(run_import(tmp_path / "a.csv"), "heat")
    assert_array_equal(heat, np.array([np.inf, np.nan, 1.0], np.float32))
