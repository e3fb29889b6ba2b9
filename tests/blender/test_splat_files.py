"""Files of Gaussian splats of other kinds, and such far from the origin, as objects and back."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from tests import splat_files
from tests.blender.clouds import attribute, everything
from tests.blender.conftest import part
from tests.blender.operators import refused
from tests.blender.splats import read
from tests.blender.test_command import run  # noqa: F401

FAR = np.array([437251.0, 5412893.0, 310.0])


def far_columns(count=200, kind="<f8", **settings):
    columns = splat_files.some_columns(count, **settings)
    return columns | {axis: (FAR["xyz".index(axis)] + columns[axis]).astype(kind) for axis in "xyz"}


def imported(path, **settings):
    assert bpy.ops.meshfree.import_points(filepath=str(path), **settings) == {"FINISHED"}
    return bpy.context.object


def exported(core, path, **settings):
    assert bpy.ops.meshfree.export_splats(filepath=str(path), **settings) == {"FINISHED"}
    return core.splats.read_splats(path)


KINDS = {"a.splat": splat_files.make_splat, "a.spz": splat_files.make_spz, "a.ply": splat_files.make_packed}


@pytest.mark.parametrize("name", KINDS)
def test_other_kinds_become_splats_and_are_written_as_ply(core, tmp_path, name):
    (tmp_path / name).write_bytes(KINDS[name](splat_files.some_columns(300)))
    wanted = core.splats.read_splats(tmp_path / name)
    obj = imported(tmp_path / name)
    np.testing.assert_array_equal(read(obj.data, "scale"), wanted.scales.astype(np.float32))
    found = exported(core, tmp_path / "back.ply")
    for name in ("positions", "scales", "rotations", "opacities", "colors"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))


@pytest.mark.parametrize("missing", [("scale_2",), ("f_dc_0", "f_dc_1", "f_dc_2")])
def test_what_was_guessed_is_told(core, tmp_path, capfd, missing):
    columns = {name: values for name, values in splat_files.some_columns(50).items() if name not in missing}
    splat_files.write_ply(tmp_path / "a.ply", columns)
    imported(tmp_path / "a.ply")
    assert "a.ply: no " in capfd.readouterr().out
    assert len(exported(core, tmp_path / "back.ply")) == 50


def test_what_seems_to_be_splats_but_is_not_is_told(tmp_path, capfd):
    columns = {name: values for name, values in splat_files.some_columns(50).items() if not name.startswith("scale")}
    splat_files.write_ply(tmp_path / "a.ply", columns)
    obj = imported(tmp_path / "a.ply")
    assert "radiance:base" not in obj.data.attributes
    assert "looks like Gaussian splats, but has no scale_0, scale_1, scale_2" in capfd.readouterr().out


def test_splats_that_are_not_finite_are_left_out_and_told(tmp_path, capfd):
    columns = splat_files.some_columns(50)
    columns["x"][:3] = np.nan
    splat_files.write_ply(tmp_path / "a.ply", columns)
    obj = imported(tmp_path / "a.ply")
    assert len(read(obj.data, "position")) == 47
    assert "left out 3 splats" in capfd.readouterr().out


def test_the_command_line_takes_them_as_splats(core, run, tmp_path):  # noqa: F811
    (tmp_path / "a.spz").write_bytes(splat_files.make_spz(splat_files.some_columns(300, 3)))
    code, [line] = run("splat-info", tmp_path / "a.spz")
    assert (code, line["splats"], line["degree"]) == (0, 300, 1)
    code, [line] = run("geodesic-distance", tmp_path / "a.spz", "--at", "0,0,0", "--out", tmp_path / "out.ply")
    assert code == 0, line
    assert "lb_distance" in core.splats.read_splats(tmp_path / "out.ply").file.columns


class TestFarAway:
    @pytest.mark.parametrize("up", ["Z", "Y", "-Y"])
    @pytest.mark.parametrize("kind", ["<f8", "<f4"])
    def test_untouched_splats_come_back_bit_for_bit(self, tmp_path, core, up, kind):
        splat_files.write_ply(tmp_path / "far.ply", far_columns(kind=kind, harmonics=3))
        obj = imported(tmp_path / "far.ply", up=up)
        assert np.abs(read(obj.data, "position")).max() < 10.0
        exported(core, tmp_path / "back.ply")
        assert (tmp_path / "back.ply").read_bytes() == (tmp_path / "far.ply").read_bytes()

    @pytest.mark.parametrize("up", ["Z", "Y", "-Y"])
    def test_the_offset_is_that_of_the_world(self, tmp_path, core, up):
        columns = far_columns()
        splat_files.write_ply(tmp_path / "far.ply", columns)
        imported(tmp_path / "far.ply", up=up)
        assert bpy.ops.meshfree.export_points(filepath=str(tmp_path / "points.csv"), attributes="NONE") == {"FINISHED"}
        found = np.loadtxt(tmp_path / "points.csv", delimiter=",", skiprows=1, usecols=(0, 1, 2))
        x, y, z = (columns[axis] for axis in "xyz")
        wanted = {"Z": (x, y, z), "Y": (x, -z, y), "-Y": (x, z, -y)}[up]
        np.testing.assert_allclose(found, np.stack(wanted, axis=1), atol=1e-5)

    @pytest.mark.parametrize("up", ["Z", "-Y"])
    def test_an_applied_transform_keeps_the_place_in_the_world(self, tmp_path, core, up):
        columns = far_columns()
        splat_files.write_ply(tmp_path / "far.ply", columns)
        imported(tmp_path / "far.ply", up=up).location.x = 100.0
        assert bpy.ops.meshfree.apply_to_splats() == {"FINISHED"}
        x, y, z = (columns[axis] for axis in "xyz")
        wanted = np.stack((x + 100.0, y, z) if up == "Z" else (x + 100.0, z, -y), axis=1)
        np.testing.assert_allclose(exported(core, tmp_path / "back.ply").positions, wanted, atol=2e-5)

    def test_files_share_the_offset_of_those_before(self, tmp_path, core):
        splat_files.write_ply(tmp_path / "one.ply", far_columns())
        other = far_columns(seed=6)
        other["x"] = other["x"] + 40.0
        splat_files.write_ply(tmp_path / "two.ply", other)
        (tmp_path / "points.csv").write_text("x,y,z\n437251.5,5412893.5,310\n437252,5412893,311\n437253,5412894,311\n")
        offsets = [tuple(imported(tmp_path / name)["lb_offset"]) for name in ("one.ply", "two.ply", "points.csv")]
        assert offsets[0] == offsets[1] == offsets[2]

    def test_a_few_floaters_far_away_shift_nothing(self, tmp_path, core):
        columns = splat_files.some_columns()
        columns["x"][:3] = 4e5
        splat_files.write_ply(tmp_path / "a.ply", columns)
        obj = imported(tmp_path / "a.ply")
        assert "lb_offset" not in obj
        np.testing.assert_array_equal(read(obj.data, "position")[:, 0], columns["x"])

    def test_the_shift_is_told(self, tmp_path, capfd):
        splat_files.write_ply(tmp_path / "far.ply", far_columns())
        imported(tmp_path / "far.ply")
        told = capfd.readouterr().out
        assert "200 Gaussian splats with harmonics of degree 0" in told
        assert "far is shifted by (-4372" in told

    def test_digits_of_places_that_were_scaled_are_forgotten(self, tmp_path, core):
        splat_files.write_ply(tmp_path / "far.ply", far_columns())
        obj = imported(tmp_path / "far.ply")
        offset, places = np.array(obj["lb_offset"]), 1e-6 * read(obj.data, "position")
        obj.data.attributes["position"].data.foreach_set("vector", places.ravel())
        found = exported(core, tmp_path / "back.ply").positions
        np.testing.assert_allclose(found - offset, places, atol=2e-9)


class TestFilter:
    def test_it_is_carried_and_grows_with_the_splats(self, tmp_path, core):
        columns = splat_files.some_columns()
        columns["filter_3D"] = np.random.default_rng(1).random(300).astype(np.float32)
        splat_files.write_ply(tmp_path / "a.ply", columns)
        obj = imported(tmp_path / "a.ply")
        found = exported(core, tmp_path / "back.ply").file.columns["filter_3D"]
        np.testing.assert_array_equal(found, columns["filter_3D"])
        obj.matrix_world = Matrix.Rotation(0.7, 4, "X") @ Matrix.Diagonal((2.0, 3.0, 4.5, 1.0))
        bpy.context.view_layer.update()
        bpy.ops.meshfree.apply_to_splats()
        np.testing.assert_allclose(read_values(obj.data, "filter_3D"), 3.0 * columns["filter_3D"], rtol=1e-5)
        found = exported(core, tmp_path / "back.ply").file.columns["filter_3D"]
        np.testing.assert_allclose(found, 3.0 * columns["filter_3D"], rtol=1e-5)


def read_values(data, name):
    values = np.empty(len(data.attributes[name].data), np.float32)
    data.attributes[name].data.foreach_get("value", values)
    return values


class TestImportedByBlender:
    """Files that Blender's own importer has read: points with numbers, until one click."""

    @pytest.fixture(params=[0, 3, 8, 15])
    def files(self, request, tmp_path):
        """A file as trainers write it, as both importers know it: our object, and Blender's, the active one."""
        columns = splat_files.some_columns(60, harmonics=request.param)
        normals = {name: np.random.default_rng(2).standard_normal(60).astype(np.float32) for name in ("nx", "ny", "nz")}
        columns = {**{axis: columns[axis] for axis in "xyz"}, **normals, **columns}
        splat_files.write_ply(tmp_path / "a.ply", columns)
        ours = imported(tmp_path / "a.ply")
        assert bpy.ops.wm.ply_import(filepath=str(tmp_path / "a.ply")) == {"FINISHED"}
        return tmp_path, ours, bpy.context.object

    def test_they_become_what_import_points_makes_of_them(self, files):
        folder, ours, obj = files
        obj.location, obj.rotation_euler = (1.0, 2.0, 3.0), (0.3, 0.2, 0.1)
        bpy.context.view_layer.update()
        matrix = obj.matrix_world.copy()
        assert bpy.ops.meshfree.show_splats() == {"FINISHED"}
        assert (obj.type, obj.matrix_world, bpy.context.object) == (ours.type, matrix, obj)
        bpy.ops.meshfree.export_splats(filepath=str(folder / "moved.ply"))
        assert attributes_of(obj.data) == attributes_of(ours.data)
        assert obj["lb_splat_format"] == ours["lb_splat_format"]
        assert drawn_by(obj) == drawn_by(ours)
        obj.matrix_world = Matrix()
        bpy.ops.meshfree.export_splats(filepath=str(folder / "b.ply"))
        assert (folder / "b.ply").read_bytes() == (folder / "a.ply").read_bytes()
        assert [mesh for mesh in bpy.data.meshes if obj.type != "MESH" and mesh.users == 0] == []

    def test_one_undo_takes_it_back(self, files):
        *_, obj = files
        before, name = everything(obj), obj.name
        bpy.ops.ed.undo_push(message="Before")
        assert bpy.ops.meshfree.show_splats("EXEC_DEFAULT", True) == {"FINISHED"}
        bpy.ops.ed.undo()
        assert everything(bpy.data.objects[name]) == before

    @staticmethod
    def by_blender(folder, columns):
        splat_files.write_ply(folder / "b.ply", columns)
        bpy.ops.wm.ply_import(filepath=str(folder / "b.ply"))
        return bpy.context.object

    def test_those_that_are_not_finite_are_left_out(self, tmp_path):
        """Blender reads 0 for what is not finite; others do not."""
        columns = splat_files.some_columns(50)
        obj = self.by_blender(tmp_path, columns)
        obj.data.attributes["opacity"].data.foreach_set("value", np.where(np.arange(50) < 3, np.nan, 0.0))
        bpy.ops.meshfree.show_splats()
        np.testing.assert_array_equal(read(obj.data, "position"), np.stack([columns[k][3:] for k in "xyz"], axis=1))
        np.testing.assert_allclose(read(obj.data, "scale")[:, 0], np.exp(columns["scale_0"][3:]), rtol=1e-6)
        assert "left out 3 splats" in obj.meshfree.notices[0].text

    def test_colors_that_blender_has_read(self, tmp_path, core):
        columns = {name: values for name, values in splat_files.some_columns(50).items() if not name.startswith("f_")}
        bytes_ = np.random.default_rng(1).integers(0, 256, (3, 50)).astype(np.uint8)
        obj = self.by_blender(tmp_path, columns | dict(zip(("red", "green", "blue"), bytes_, strict=True)))
        bpy.ops.meshfree.show_splats()
        wanted = core.splats.read_splats(tmp_path / "b.ply")
        np.testing.assert_array_equal(read(obj.data, "radiance:base")[:, :3], wanted.colors.astype(np.float32))

    def test_results_and_groups_stay(self, tmp_path):
        obj = self.by_blender(tmp_path, splat_files.some_columns(50))
        obj.data.attributes.new("lb_field", "FLOAT", "POINT").data.foreach_set("value", np.arange(50.0))
        obj.vertex_groups.new(name="Handle").add(range(5), 1.0, "REPLACE")
        bpy.ops.meshfree.show_splats()
        np.testing.assert_array_equal(attribute(obj, "lb_field"), np.arange(50))
        assert part("operators.objects.groups").group_weights(obj, "Handle").sum() == 5.0

    def test_what_would_be_lost_is_refused(self, tmp_path):
        obj = self.by_blender(tmp_path, splat_files.some_columns(50))
        other = obj.copy()
        bpy.context.scene.collection.objects.link(other)
        with refused(obj, "shares its mesh.*Make Single User"):
            bpy.ops.meshfree.show_splats()
        obj.meshfree.make_single_user = True
        obj.modifiers.new("Bend", "SIMPLE_DEFORM")
        with refused(obj, "has modifiers .Bend.. Apply or remove"):
            bpy.ops.meshfree.show_splats()
        obj.modifiers.clear()
        before = attributes_of(other.data)
        bpy.ops.meshfree.show_splats()
        assert attributes_of(other.data) == before

    def test_plain_points_are_no_splats(self, tmp_path):
        columns = {name: values for name, values in splat_files.some_columns(50).items() if name[:4] != "rot_"}
        obj = self.by_blender(tmp_path, {name: columns[name] for name in (*"xyz", "scale_0", "scale_2", "opacity")})
        with refused(obj, "holds no Gaussian splats"):
            bpy.ops.meshfree.show_splats()


def attributes_of(data):
    """Types and values of all attributes but the selection of points, which differ between importers."""
    return {
        item.name: (item.data_type, item.domain, list(map(tuple_of, item.data)))
        for item in data.attributes
        if not item.name.startswith((".sel", ".edge", ".corner", "sharp"))
    }


def tuple_of(item):
    value = next(getattr(item, key) for key in ("vector", "color", "value") if hasattr(item, key))
    return value if isinstance(value, (bool, int, float)) else tuple(value)


def drawn_by(obj):
    """What the display of an object is given, but for the material, of which we compare the nodes."""
    (modifier,) = obj.modifiers
    inputs = part("operators.objects.modifiers").inputs_of(modifier)
    material = next(value for value in inputs.values() if isinstance(value, bpy.types.Material))
    plain = {name: value for name, value in inputs.items() if value != material}
    return modifier.node_group, plain, material["meshfree_kind"]
