"""Bones of armatures, and weights of bones on meshes and point clouds."""

import bpy
import numpy as np
import pytest

from tests.blender.clouds import sphere_points
from tests.blender.conftest import part
from tests.blender.test_pointcloud import add_pointcloud


@pytest.fixture
def weights():
    return part("operators.rigging.weights")


def two_bones(deforms=(True, True)):
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for number, deform in enumerate(deforms):
        bone = armature.data.edit_bones.new(f"Bone.{number}")
        bone.head, bone.tail, bone.use_deform = (0, 0, number), (0, 0, number + 1), deform
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature


def test_bones_that_do_not_deform_are_left_out():
    found = part("operators.rigging.bones").deforming_bones(two_bones((False, True)))
    assert found.names == ["Bone.1"]
    assert np.allclose(found.heads, [[0, 0, 1]])
    assert np.allclose(found.tails, [[0, 0, 2]])


def test_an_armature_without_deforming_bones_is_refused():
    with pytest.raises(part("core").PointCloudError, match="Turn on Deform"):
        part("operators.rigging.bones").deforming_bones(two_bones((False,)))


def test_a_pose_is_how_bones_have_moved():
    armature = two_bones()
    armature.pose.bones["Bone.1"].location = (0, 0.5, 0)  # along the bone
    bpy.context.view_layer.update()
    bones, names = part("operators.rigging.bones"), ["Bone.0", "Bone.1", "Gone"]
    posed = bones.bone_matrices(armature.pose.bones, names, "matrix")
    found = posed @ np.linalg.inv(bones.bone_matrices(armature.data.bones, names, "matrix_local"))
    assert np.allclose(found[[0, 2]], np.eye(4))
    assert np.allclose(found[1, :3, :3], np.eye(3))
    assert np.allclose(found[1, :3, 3], (0, 0, 0.5))


def test_vertex_groups_come_back_as_they_were_written(weights):
    mesh = bpy.data.meshes.new("Points")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [], [])
    obj = bpy.data.objects.new("Points", mesh)
    obj.vertex_groups.new(name="Other").add([1], 0.5, "REPLACE")
    given = np.array([[0.25, 0.75], [1.0, 0.0], [0.0, 1.0]])
    for _ in range(2):  # those of the same names are replaced
        weights.write_weights(obj, ["a", "b"], given)
    assert weights.weight_names(obj) == ["Other", "a", "b"]
    assert np.allclose(weights.read_weights(obj), np.column_stack([[0.0, 0.5, 0.0], given]))


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="objects become point clouds from Blender 4.5 on")
def test_a_point_cloud_keeps_its_four_largest_weights(weights):
    obj = add_pointcloud(sphere_points(20))
    given = np.zeros((20, 5))
    given[:, 2] = 1.0
    given[0] = 0.3, 0.25, 0.2, 0.15, 0.1
    weights.write_weights(obj, list("abcde"), given)
    found = weights.read_weights(obj)
    assert weights.weight_names(obj) == list("abcde")
    assert np.allclose(found[0], np.array([0.3, 0.25, 0.2, 0.15, 0.0]) / 0.9)
    assert np.allclose(found[1:], given[1:])
    obj.data.attributes.remove(obj.data.attributes[weights.BONES])
    assert not weights.has_weights(obj)
