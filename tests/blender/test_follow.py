"""Point clouds and splats that follow the bones of an armature."""

from dataclasses import replace
from math import pi

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, sphere_points
from tests.blender.conftest import part
from tests.blender.splats import add_splats, bar_splats

needs_clouds = pytest.mark.skipif(bpy.app.version < (4, 5), reason="objects become point clouds from Blender 4.5 on")
BEND = Matrix.Rotation(0.5 * pi, 4, "X")


def add_arm(*lengths, name="Arm"):
    """Add an armature with bones along z, each the parent of the next one."""
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    height, before = 0.0, None
    for number, length in enumerate(lengths):
        bone = armature.data.edit_bones.new(f"Bone.{number}")
        bone.head, bone.tail, bone.parent = (0, 0, height), (0, 0, height + length), before
        height, before = height + length, bone
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature


def pose(armature, *names, matrix=BEND):
    """Turn bones from rest, as R does."""
    for name in names:
        armature.pose.bones[name].matrix_basis = matrix
    bpy.context.view_layer.update()


def weights_along(points, ends):
    """Weights of bones that end at these heights, which blend linearly from center to center."""
    heights = points[:, 2]
    centers = np.concatenate([[0.5 * ends[0]], 0.5 * (np.add(ends[1:], ends[:-1]))])
    return np.stack([np.interp(heights, centers, np.eye(len(ends))[number]) for number in range(len(ends))], axis=1)


def select(*objects):
    """Select objects, the last one active."""
    for other in bpy.context.view_layer.objects:
        other.select_set(other in objects)
    bpy.context.view_layer.objects.active = objects[-1]


def bound(obj, armature, weights, names=None):
    """Give an object weights, and bind it."""
    names = names or [bone.name for bone in armature.data.bones]
    part("operators.rigging.weights").write_weights(obj, names, weights)
    select(obj, armature)
    assert bpy.ops.meshfree.bind_armature() == {"FINISHED"}
    select(obj)
    return obj


def cloud(count=300):
    """Points in a box around the bones, as a point cloud, or of splats where Blender makes none."""
    points = np.random.default_rng(3).uniform((-0.5, -0.5, 0.0), (0.5, 0.5, 3.0), (count, 3))
    size = np.full((count, 3), 0.05, np.float32) * (1.0, 0.6, 0.3)
    rng = np.random.default_rng(5)
    rotations = rng.standard_normal((count, 4))
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    return add_splats(
        part("core").Splats(
            points.astype(np.float32),
            size.astype(np.float32),
            rotations.astype(np.float32),
            np.full(count, 0.7, np.float32),
            rng.standard_normal((count, 3)).astype(np.float32),
            0.2 * rng.standard_normal((count, 8, 3)).astype(np.float32),
        )
    )


def rest(obj):
    return attribute(obj, "position").astype(np.float64)


_KEYS = {"FLOAT_VECTOR": ("vector", 3), "QUATERNION": ("value", 4)}


def shown(obj, name="position"):
    """What an object shows of an attribute, in its own space, as float64."""
    layer = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.attributes[name]
    key, size = _KEYS[layer.data_type]
    values = np.empty(size * len(layer.data), np.float32)
    layer.data.foreach_get(key, values)
    return values.reshape(-1, size).astype(np.float64)


@pytest.fixture
def rigged():
    armature = add_arm(1.0, 1.0, 1.0)
    obj = cloud()
    return bound(obj, armature, weights_along(rest(obj), (1.0, 2.0, 3.0))), armature


def by_blender(obj, armature, weights, preserve=False, names=None):
    """Where Blender's own Armature modifier moves vertices at the same places."""
    other = add_object(rest(obj), "Mesh")
    other.parent, other.matrix_parent_inverse, other.matrix_basis = (
        obj.parent,
        obj.matrix_parent_inverse,
        obj.matrix_basis,
    )
    for name, column in zip(names or [bone.name for bone in armature.data.bones], weights.T, strict=True):
        group = other.vertex_groups.new(name=name)
        for index in np.flatnonzero(column):
            group.add([int(index)], float(column[index]), "REPLACE")
    modifier = other.modifiers.new("Armature", "ARMATURE")
    modifier.object, modifier.use_deform_preserve_volume = armature, preserve
    bpy.context.view_layer.update()
    points = shown(other)
    bpy.data.objects.remove(other)
    return points


class TestPlaces:
    @pytest.mark.parametrize("preserve", [False, True])
    @pytest.mark.parametrize("scale", [1.0, (1.3, 0.8, 1.1)])
    def test_as_blenders_own_modifier(self, rigged, preserve, scale):
        obj, armature = rigged
        armature.location, armature.rotation_euler, armature.scale = (1, 2, 3), (0.3, 0.5, -0.2), (1.2, 0.9, 1.0)
        obj.location, obj.rotation_euler = (0.1, -0.2, 0.1), (0.1, 0.0, 0.2)
        obj.meshfree.deform.preserve_volume = preserve
        pose(armature, "Bone.1", "Bone.2", matrix=BEND @ Matrix.Diagonal((*np.broadcast_to(scale, 3), 1.0)))
        bpy.ops.meshfree.deform_update()
        expected = by_blender(obj, armature, part("operators.rigging.weights").read_weights(obj), preserve)
        assert np.abs(expected - rest(obj)).max() > 0.5
        assert_allclose(shown(obj), expected, atol=5e-6)
