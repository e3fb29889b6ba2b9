"""Objects of Gaussian splats joined as they are seen: by Join Splats and Export Splats; what Blender's Join leaves."""

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix

from tests import splat_files
from tests.blender.clouds import everything
from tests.blender.conftest import part
from tests.blender.splats import add_splats, bar_splats, splats_of
from tests.blender.test_splat_files import exported, far_columns, imported
from tests.blender.test_splats import close, turned

PLACED = Matrix.Translation((5, 0, 1)) @ Euler((0.4, 0.9, -0.3)).to_matrix().to_4x4() @ Matrix.Scale(2.0, 4)
FIRST = Matrix.Translation((-1, 2, 0)) @ Euler((0.0, 0.3, 0.5)).to_matrix().to_4x4()
MESSAGE = "rotated or scaled without their ellipsoids"


def seen(splats, matrix):
    matrix = np.array(matrix)
    return turned(splats, matrix[:3, :3], matrix[:3, 3])


def select(*objects):
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]
    bpy.context.view_layer.update()


def pair(core, matrix=PLACED, degrees=(3, 3)):
    """Two objects of splats, the second one placed by a matrix, both selected, the first one active."""
    splats = [bar_splats(core, degree) for degree in degrees]
    objects = [add_splats(each, name) for each, name in zip(splats, ("First", "Second"), strict=True)]
    objects[1].matrix_world = matrix
    select(*objects)
    return *objects, *splats


def some_of(splats, rows):
    names = "positions", "scales", "rotations", "opacities", "colors", "harmonics"
    return splats.__class__(**{name: getattr(splats, name)[rows] for name in names})


class TestJoin:
    @pytest.mark.parametrize("matrix", [PLACED, PLACED @ Matrix.Diagonal((1.0, -2.0, 0.5, 1.0)), Matrix()])
    @pytest.mark.parametrize("first", [Matrix(), FIRST])
    def test_joined_splats_are_as_they_were_seen(self, core, matrix, first):
        one, _, splats, _ = pair(core, matrix)
        one.matrix_world = first
        bpy.context.view_layer.update()
        assert bpy.ops.meshfree.join_splats() == {"FINISHED"}
        assert list(bpy.data.objects) == [one]
        found = splats_of(core, one.data)
        close(some_of(found, slice(len(splats))), splats)
        close(some_of(found, slice(len(splats), None)), seen(seen(splats, matrix), first.inverted()))

    @pytest.mark.parametrize("degrees", [(0, 3), (2, 1), (4, 0)])
    def test_missing_harmonics_are_zeros(self, core, degrees):
        one, _, splats, others = pair(core, degrees=degrees)
        assert bpy.ops.meshfree.join_splats() == {"FINISHED"}
        count = max(splats.harmonics.shape[1], others.harmonics.shape[1])
        found = splats_of(core, one.data).harmonics
        wanted = [splats.harmonics, seen(others, PLACED).harmonics]
        wanted = [np.pad(each, ((0, 0), (0, count - each.shape[1]), (0, 0))) for each in wanted]
        np.testing.assert_allclose(found, np.concatenate(wanted), atol=1e-5)

    def test_other_attributes_and_children_stay(self, core):
        one, other, splats, _ = pair(core)
        child = bpy.data.objects.new("Child", None)
        bpy.context.scene.collection.objects.link(child)
        child.parent = other
        bpy.context.view_layer.update()
        place = child.matrix_world.copy()
        layer = other.data.attributes.new("mine", "FLOAT", "POINT")
        layer.data.foreach_set("value", np.arange(len(splats), dtype=np.float32))
        assert bpy.ops.meshfree.join_splats() == {"FINISHED"}
        values = [item.value for item in one.data.attributes["mine"].data]
        np.testing.assert_array_equal(values, np.concatenate([np.zeros(len(splats)), np.arange(len(splats))]))
        bpy.context.view_layer.update()
        np.testing.assert_allclose(np.array(child.matrix_world), np.array(place), atol=1e-6)

    def test_objects_that_share_their_splats(self, core):
        one = add_splats(bar_splats(core), "First")
        shared = add_splats(bar_splats(core), "Second")
        copies = [shared, shared.copy()]
        bpy.context.scene.collection.objects.link(copies[1])
        copies[1].matrix_world = PLACED
        select(one, *copies)
        assert bpy.ops.meshfree.join_splats() == {"FINISHED"}
        found = splats_of(core, one.data)
        close(some_of(found, slice(-960, None)), seen(bar_splats(core), PLACED))
        assert len(found) == 3 * 960
        assert (bpy.data.pointclouds if one.type == "POINTCLOUD" else bpy.data.meshes).keys() == [one.data.name]

    def test_what_is_no_splats_is_left_alone(self, core, capfd):
        one, *_ = pair(core)
        empty = bpy.data.objects.new("Empty", None)
        bpy.context.scene.collection.objects.link(empty)
        empty.select_set(True)
        assert bpy.ops.meshfree.join_splats() == {"FINISHED"}
        assert set(bpy.data.objects) == {one, empty}
        assert "1 selected objects have no splats" in capfd.readouterr().out

    def test_what_cannot_be_joined_is_refused(self, core):
        one, other, *_ = pair(core)
        other.scale.x = 0.0
        bpy.context.view_layer.update()
        before = [everything(each) for each in (one, other)]
        with pytest.raises(RuntimeError, match='"Second" is scaled to nothing along an axis'):
            bpy.ops.meshfree.join_splats()
        assert [everything(each) for each in (one, other)] == before

    def test_bound_ones_are_refused(self, core):
        one, other, *_ = pair(core)
        select(other)
        assert bpy.ops.meshfree.deform_bind(at_once=True) == {"FINISHED"}
        select(one, other)
        with pytest.raises(RuntimeError, match='"Second" is bound. Unbind it first'):
            bpy.ops.meshfree.join_splats()

    def test_one_object_alone_has_nothing_to_join(self, core):
        one, *_ = pair(core)
        select(one)
        assert not bpy.ops.meshfree.join_splats.poll()

    def test_files_joined_are_written_with_all_their_columns(self, core, tmp_path):
        first, second = splat_files.some_columns(50, 0), splat_files.some_columns(40, 3, seed=6)
        second["confidence"] = np.arange(40, dtype=np.float32)
        first["filter_3D"] = np.ones(50, np.float32)
        splat_files.write_ply(tmp_path / "one.ply", first)
        splat_files.write_ply(tmp_path / "two.ply", second)
        one, other = imported(tmp_path / "one.ply"), imported(tmp_path / "two.ply")
        select(one, other)
        assert bpy.ops.meshfree.join_splats() == {"FINISHED"}
        found = exported(core, tmp_path / "both.ply").file.columns
        for name, values in first.items():
            np.testing.assert_array_equal(found[name][:50], values)
        for name in (*splat_files.PROPERTIES, "confidence", *(f"f_rest_{number}" for number in range(9))):
            np.testing.assert_array_equal(found[name][50:], second[name])
        np.testing.assert_array_equal(found["confidence"][:50], 0.0)

    @pytest.mark.parametrize("ups", [("Z", "Z"), ("-Y", "Z"), ("Z", "-Y")])
    def test_georeferenced_ones_keep_their_place_in_the_world(self, core, tmp_path, ups):
        columns = [far_columns(50), far_columns(40, seed=6)]
        objects = []
        for name, each, up in zip(("one", "two"), columns, ups, strict=True):
            splat_files.write_ply(tmp_path / f"{name}.ply", each)
            objects.append(imported(tmp_path / f"{name}.ply", up=up))
        if ups[0] != ups[1]:  # in the axes of the world they are far apart
            with pytest.raises(RuntimeError, match='"two" is too far from "one"'):
                select(*objects), bpy.ops.meshfree.join_splats()
            return
        select(*objects)
        assert bpy.ops.meshfree.join_splats() == {"FINISHED"}
        found = exported(core, tmp_path / "both.ply").positions
        wanted = np.concatenate([np.stack([each[axis] for axis in "xyz"], axis=1) for each in columns])
        np.testing.assert_array_equal(found, wanted)

    def test_the_offset_of_others_is_taken_up(self, core, tmp_path):
        splat_files.write_ply(tmp_path / "far.ply", far_columns(50))
        other, one = imported(tmp_path / "far.ply"), add_splats(bar_splats(core), "Near")
        offset = np.array(other["lb_offset"])
        select(one, other)
        assert bpy.ops.meshfree.join_splats() == {"FINISHED"}
        np.testing.assert_array_equal(one["lb_offset"], offset)
        found = exported(core, tmp_path / "both.ply").positions
        np.testing.assert_allclose(found[:960] - offset, bar_splats(core).positions, atol=1e-6)
        wanted = far_columns(50)
        np.testing.assert_array_equal(found[960:], np.stack([wanted[axis] for axis in "xyz"], axis=1))


class TestExport:
    def test_several_objects_become_one_file_in_world_space(self, core, tmp_path):
        one, _, splats, _ = pair(core)
        one.matrix_world = FIRST
        bpy.context.view_layer.update()
        found = exported(core, tmp_path / "both.ply")
        close(some_of(found, slice(len(splats))), seen(splats, FIRST))
        close(some_of(found, slice(len(splats), None)), seen(splats, PLACED))

    def test_the_active_one_alone_where_that_is_chosen(self, core, tmp_path):
        _, _, splats, _ = pair(core)
        assert len(exported(core, tmp_path / "one.ply", all_selected=False)) == len(splats)

    def test_far_away_in_double_precision_with_filters(self, core, tmp_path):
        first, second = far_columns(50), far_columns(40, seed=6)
        second["filter_3D"] = np.full(40, 0.5, np.float32)
        splat_files.write_ply(tmp_path / "one.ply", first)
        splat_files.write_ply(tmp_path / "two.ply", second)
        one, other = imported(tmp_path / "one.ply"), imported(tmp_path / "two.ply")
        other.scale = (2.0, 2.0, 2.0)
        select(one, other)
        found = exported(core, tmp_path / "both.ply")
        wanted = np.stack([first[axis] for axis in "xyz"], axis=1)
        np.testing.assert_allclose(found.positions[:50], wanted, atol=1e-9)
        offset = np.array(other["lb_offset"])
        wanted = offset + 2.0 * (np.stack([second[axis] for axis in "xyz"], axis=1) - offset)
        np.testing.assert_allclose(found.positions[50:], wanted, atol=1e-6)
        np.testing.assert_allclose(found.file.columns["filter_3D"], np.repeat([0.0, 1.0], [50, 40]), rtol=1e-6)


def two_files(core, tmp_path):
    for name, seed in (("one", 5), ("two", 6)):
        splat_files.write_ply(tmp_path / f"{name}.ply", splat_files.some_columns(300, seed=seed))
    return [imported(tmp_path / f"{name}.ply") for name in ("one", "two")]


def bar_files(core, tmp_path):
    """Regular ones, of which many stand above each other."""
    core.splats.write_splats(tmp_path / "bar.ply", bar_splats(core))
    return [imported(tmp_path / "bar.ply") for _ in range(2)]


class TestBlendersOwnJoin:
    @pytest.fixture
    def told(self, tmp_path, capfd):
        splats = part("operators.objects.splats")

        def told():
            obj = bpy.context.object
            found = splats.are_left_behind(obj.data)
            assert splats.are_left_behind(obj.data, glance=True) == found
            capfd.readouterr()
            assert bpy.ops.meshfree.export_splats(filepath=str(tmp_path / "out.ply")) == {"FINISHED"}
            assert (MESSAGE in capfd.readouterr().out) == found
            return found

        return told

    @pytest.mark.parametrize("make", [two_files, bar_files])
    @pytest.mark.parametrize("turn", [(0.4, 0.9, -0.3), (0.0, 0.0, 1.5), (0.02, 0.0, 0.0)])
    def test_turned_ones_are_told(self, core, tmp_path, told, make, turn):
        one, other = make(core, tmp_path)
        other.rotation_euler = turn
        select(one, other)
        assert bpy.ops.object.join() == {"FINISHED"}
        assert told()

    def test_scaled_ones_are_told(self, core, tmp_path, told):
        one, other = two_files(core, tmp_path)
        other.scale = (1.1, 1.1, 1.1)
        select(one, other)
        bpy.ops.object.join()
        assert told()

    def test_ones_that_were_only_moved_are_right(self, core, tmp_path, told):
        one, other = two_files(core, tmp_path)
        other.location = (12.0, 0.3, -100.0)
        select(one, other)
        bpy.ops.object.join()
        assert not told()

    def test_ones_turned_by_our_own_tools_are_right(self, core, tmp_path, told):
        one, other = two_files(core, tmp_path)
        select(other)
        other.rotation_euler, other.scale = (1.0, 2.0, 3.0), (2.0, 1.0, 1.0)
        bpy.context.view_layer.update()
        assert bpy.ops.meshfree.apply_to_splats() == {"FINISHED"}
        select(one, other)
        bpy.ops.object.join()
        assert not told()

    def test_join_splats_leaves_nothing_to_tell(self, core, tmp_path, told):
        one, other = two_files(core, tmp_path)
        other.rotation_euler = (1.0, 2.0, 3.0)
        select(one, other)
        assert bpy.ops.meshfree.join_splats() == {"FINISHED"}
        assert not told()

    def test_a_deformation_leaves_nothing_to_tell(self, core, tmp_path, told):
        core.splats.write_splats(tmp_path / "bar.ply", bar_splats(core))
        imported(tmp_path / "bar.ply")
        assert bpy.ops.meshfree.smooth(target="IN_PLACE") == {"FINISHED"}
        assert not told()

    def test_what_was_wrong_stays_told_after_our_tools(self, core, tmp_path, told):
        one, other = two_files(core, tmp_path)
        other.rotation_euler = (1.0, 2.0, 3.0)
        select(one, other)
        bpy.ops.object.join()
        one.scale = (2.0, 2.0, 2.0)
        bpy.context.view_layer.update()
        bpy.ops.meshfree.apply_to_splats()
        assert told()
