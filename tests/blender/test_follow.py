"""Point clouds and splats that follow the bones of an armature."""

import os
import subprocess
import sys
import textwrap
from math import pi

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute
from tests.blender.conftest import part
from tests.blender.splats import add_splats
from tests.blender.test_panel import Layout, draw

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
        part("core").splats.Splats(
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

    def test_points_of_one_bone_are_moved_as_it_is(self, rigged):
        obj, armature = rigged
        pose(armature, "Bone.0")
        turn = np.array(
            armature.pose.bones["Bone.0"].matrix @ armature.data.bones["Bone.0"].matrix_local.inverted(), np.float64
        )
        expected = rest(obj) @ turn[:3, :3].T + turn[:3, 3]
        assert_allclose(shown(obj), expected, atol=1e-5)

    def test_an_object_beside_its_armature_is_deformed_about_the_bones(self, rigged):
        obj, armature = rigged
        pose(armature, "Bone.1")
        obj.parent = None
        obj.location = (0.4, 0.0, 0.0)
        armature.location = (0.0, 0.0, -0.5)
        bpy.context.view_layer.update()
        expected = by_blender(obj, armature, part("operators.rigging.weights").read_weights(obj))
        assert_allclose(shown(obj), expected, atol=5e-6)

    def test_envelopes_multiply_weights_as_blenders_own(self, rigged):
        obj, armature = rigged
        bone = armature.data.bones["Bone.2"]
        bone.use_envelope_multiply, bone.head_radius, bone.tail_radius, bone.envelope_distance = True, 0.2, 0.3, 0.4
        pose(armature, "Bone.1", "Bone.2")
        weights = part("operators.rigging.weights").read_weights(obj)
        with_envelope = by_blender(obj, armature, weights)
        assert_allclose(shown(obj), with_envelope, atol=5e-6)
        bone.use_envelope_multiply = False
        bpy.context.view_layer.update()
        without = by_blender(obj, armature, weights)
        assert np.abs(without - with_envelope).max() > 0.01
        assert_allclose(shown(obj), without, atol=5e-6)

    def test_bones_that_do_not_deform_are_left_out(self, rigged):
        obj, armature = rigged
        armature.data.bones["Bone.1"].use_deform = False
        pose(armature, "Bone.1", "Bone.2")
        expected = by_blender(obj, armature, part("operators.rigging.weights").read_weights(obj))
        assert_allclose(shown(obj), expected, atol=5e-6)

    def test_strength_and_preserve_volume(self, rigged, modifiers):
        obj, armature = rigged
        pose(armature, "Bone.1", "Bone.2")
        linear = shown(obj)
        obj.meshfree.deform.preserve_volume = True
        bpy.ops.meshfree.deform_update()
        screws = shown(obj)
        assert np.abs(screws - linear).max() > 0.02
        modifier = obj.modifiers["Mesh-Free Deform"]
        modifiers.set_input(modifier, "Strength", 0.5)
        modifier.id_data.update_tag()
        bpy.context.view_layer.update()
        assert_allclose(shown(obj), 0.5 * (screws + rest(obj)), atol=1e-5)


def covariances(obj):
    """R S^2 R^T of the splats that an object shows."""
    turns = part("core").splats.ellipsoids.matrices_of(shown(obj, "rotation"))
    axes = turns * shown(obj, "scale").T
    return np.einsum("abn,cbn->nac", axes, axes)


def is_settled(obj):
    return bool(obj.data["lb_pose"][0])


class TestSplats:
    def test_a_rigid_pose_carries_ellipsoids_and_harmonics(self, rigged, core):
        """Only the root is turned and shifted: places, covariances and harmonics are those of the whole, turned."""
        obj, armature = rigged
        before, was = covariances(obj), part("operators.objects.splats").read_splats(obj.data)
        pose(armature, "Bone.0", matrix=Matrix.Translation((0.3, -0.2, 0.5)) @ Matrix.Rotation(0.7, 4, (1, 2, 3)))
        bone = armature.pose.bones["Bone.0"]
        turn = np.array(bone.matrix @ bone.bone.matrix_local.inverted(), np.float64)
        linear = turn[:3, :3]
        assert is_settled(obj)
        assert_allclose(shown(obj), rest(obj) @ linear.T + turn[:3, 3], atol=1e-6)
        assert_allclose(covariances(obj), linear @ before @ linear.T, atol=1e-6 * before.max())
        expected = core.splats.harmonics.rotated(was.harmonics.astype(np.float64), np.tile(linear, (len(before), 1, 1)))
        for number in range(8):
            assert_allclose(shown(obj, f"radiance:sh_{number}"), expected[:, number], atol=1e-6)

    def test_a_bend_stretches_them_by_the_blend(self, rigged, core):
        obj, armature = rigged
        before = covariances(obj)
        pose(armature, "Bone.1", "Bone.2", matrix=BEND @ Matrix.Diagonal((1.2, 0.7, 1.0, 1.0)))
        changes = [
            np.array(bone.matrix @ bone.bone.matrix_local.inverted(), np.float64) for bone in armature.pose.bones
        ]
        weights = part("operators.rigging.weights").read_weights(obj)
        points, gradients = core.rig.skin(rest(obj), weights, changes, gradients=True)
        assert_allclose(shown(obj), points, atol=1e-5)
        assert_allclose(covariances(obj), gradients @ before @ gradients.transpose(0, 2, 1), atol=1e-5 * before.max())

    def test_harmonics_wait_while_bones_are_dragged(self, rigged, live, monkeypatch):
        obj, armature = rigged
        monkeypatch.setattr(live, "_soon", lambda: part("operators.deform.pose").State.QUICK)
        pose(armature, "Bone.0")
        assert not is_settled(obj)
        assert "lb_splat_scale" in obj.data.attributes
        assert "lb_splat_sh_0" not in obj.data.attributes
        live.update(obj)
        assert is_settled(obj)
        assert "lb_splat_sh_0" in obj.data.attributes


class TestLive:
    """Whatever moves the bones, the points follow."""

    def test_constraints(self, rigged):
        obj, armature = rigged
        target = bpy.data.objects.new("Target", None)
        bpy.context.scene.collection.objects.link(target)
        constraint = armature.pose.bones["Bone.1"].constraints.new("COPY_ROTATION")
        constraint.target = target
        bpy.context.view_layer.update()
        before = shown(obj)
        target.rotation_euler.x = 1.0
        bpy.context.view_layer.update()
        weights = part("operators.rigging.weights").read_weights(obj)
        assert np.abs(shown(obj) - before).max() > 0.1
        assert_allclose(shown(obj), by_blender(obj, armature, weights), atol=5e-6)

    def test_actions_and_frames(self, rigged):
        obj, armature = rigged
        animate(armature)
        weights = part("operators.rigging.weights").read_weights(obj)
        for frame in (1, 3, 2, 5):
            bpy.context.scene.frame_set(frame)
            assert_allclose(shown(obj), by_blender(obj, armature, weights), atol=5e-6)
        assert np.abs(shown(obj) - rest(obj)).max() > 0.5

    def test_rest_position(self, rigged):
        obj, armature = rigged
        pose(armature, "Bone.0")
        armature.data.pose_position = "REST"
        bpy.context.view_layer.update()
        assert_allclose(shown(obj), rest(obj), atol=1e-6)

    def test_a_render_shows_the_frame(self, rigged):
        obj, armature = rigged
        animate(armature)
        scene = bpy.context.scene
        scene.render.engine, scene.cycles.samples, scene.cycles.device = "CYCLES", 1, "CPU"
        scene.render.resolution_x = scene.render.resolution_y = 8
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.collection.objects.link(scene.camera)
        seen = []
        handler = lambda *_: seen.append(attribute(obj, "lb_displacement"))  # noqa: E731
        bpy.app.handlers.render_post.append(handler)
        try:
            scene.frame_start, scene.frame_end = 2, 3
            scene.render.filepath = f"{bpy.app.tempdir}follow"
            bpy.ops.render.render(animation=True)
        finally:
            bpy.app.handlers.render_post.remove(handler)
        for frame, found in zip((2, 3), seen, strict=True):
            scene.frame_set(frame)
            assert_allclose(found, attribute(obj, "lb_displacement"), atol=1e-6)
        assert np.abs(seen[1] - seen[0]).max() > 0.05

    def test_undo_and_redo(self, rigged):
        obj, armature = rigged
        name = obj.name
        bpy.ops.ed.undo_push(message="Bound")
        pose(armature, "Bone.0")
        posed = shown(obj)
        bpy.ops.ed.undo_push(message="Posed")
        bpy.ops.ed.undo()
        assert_allclose(shown(bpy.data.objects[name]), rest(bpy.data.objects[name]), atol=1e-6)
        bpy.ops.ed.redo()
        assert_allclose(shown(bpy.data.objects[name]), posed, atol=1e-6)

    def test_a_copy_follows_the_same_bones(self, rigged, binding):
        obj, armature = rigged
        select(obj)
        bpy.ops.object.duplicate()
        copy = bpy.context.object
        pose(armature, "Bone.1")
        assert [binding.stale_reason(each) for each in (obj, copy)] == ["", ""]
        assert copy.data != obj.data
        assert_allclose(shown(copy), shown(obj), atol=1e-6)


def animate(armature):
    """Let a bone turn over frames 1 to 5."""
    bone = armature.pose.bones["Bone.1"]
    bone.rotation_mode = "XYZ"
    for frame, angle in ((1, 0.0), (5, 1.2)):
        bone.rotation_euler.x = angle
        bone.keyframe_insert("rotation_euler", frame=frame)
    bpy.context.view_layer.update()


def stale(obj):
    return part("operators.deform.binding").stale_reason(obj)


class TestBinding:
    """What a binding needs, and what ends it."""

    def test_the_object_stays_where_it_is_as_a_child(self):
        armature, obj = add_arm(1.0, 1.0), cloud(50)
        armature.location, obj.location = (1, 2, 3), (0, 0, 0.5)
        bpy.context.view_layer.update()
        before = obj.matrix_world.copy()
        bound(obj, armature, weights_along(rest(obj), (1.0, 2.0)))
        bpy.context.view_layer.update()
        assert obj.parent == armature
        assert_allclose(obj.matrix_world, before, atol=1e-6)
        assert_allclose(shown(obj), rest(obj), atol=1e-6)
        assert bpy.context.scene.render.use_lock_interface

    @pytest.mark.parametrize(
        ("change", "text"),
        [
            (lambda obj, arm: bpy.data.objects.remove(arm), "armature was deleted"),
            (lambda obj, arm: setattr(arm.data.bones["Bone.1"], "name", "Elbow"), "renamed or deleted: Bone.1"),
            (lambda obj, arm: edit_bone(arm, "Bone.1", lambda bone: setattr(bone, "roll", 0.4)), "rest pose"),
            (lambda obj, arm: edit_bone(arm, "Bone.2", arm.data.edit_bones.remove), "renamed or deleted: Bone.2"),
            (lambda obj, arm: shift(obj), "points at rest were moved"),
            (lambda obj, arm: obj.data.attributes.remove(obj.data.attributes["lb_bones"]), "weights of the bones"),
            (lambda obj, arm: scale_weights(obj), "weights of the bones"),
            (lambda obj, arm: obj.modifiers.remove(obj.modifiers["Mesh-Free Deform"]), "was removed"),
        ],
    )
    def test_what_ends_it_is_told(self, rigged, change, text):
        obj, armature = rigged
        assert stale(obj) == ""
        name = obj.name
        change(obj, armature)
        bpy.context.view_layer.update()
        obj = bpy.data.objects[name]
        assert text in stale(obj)
        assert "ind again" in stale(obj)

    def test_a_renamed_bone_is_followed_on_when_bound_again(self, rigged, capfd):
        obj, armature = rigged
        armature.data.bones["Bone.1"].name = "Elbow"
        select(obj)
        assert bpy.ops.meshfree.bind_armature() == {"FINISHED"}
        assert '"Bone.1" is called "Elbow" now' in capfd.readouterr().out
        pose(armature, "Elbow")
        weights = part("operators.rigging.weights").read_weights(obj)
        names = ["Bone.0", "Elbow", "Bone.2"]
        assert_allclose(shown(obj), by_blender(obj, armature, weights, names=names), atol=5e-6)

    def test_a_deleted_bone_leaves_its_points_to_the_others(self, rigged, capfd):
        obj, armature = rigged
        edit_bone(armature, "Bone.2", lambda bone: armature.data.edit_bones.remove(bone))
        select(obj)
        assert bpy.ops.meshfree.bind_armature() == {"FINISHED"}
        told = capfd.readouterr().out
        assert "has no bones Bone.2" in told
        assert "follow no bone, and stay" in told
        pose(armature, "Bone.1")
        weights = part("operators.rigging.weights").read_weights(obj)
        names = ["Bone.0", "Bone.1", "Bone.2"]
        assert_allclose(shown(obj), by_blender(obj, armature, weights, names=names), atol=5e-6)

    def test_a_rest_pose_that_changed_is_taken_when_bound_again(self, rigged):
        obj, armature = rigged
        edit_bone(armature, "Bone.1", lambda bone: setattr(bone, "roll", 0.4))
        select(obj)
        assert bpy.ops.meshfree.bind_armature() == {"FINISHED"}
        pose(armature, "Bone.1")
        weights = part("operators.rigging.weights").read_weights(obj)
        assert_allclose(shown(obj), by_blender(obj, armature, weights), atol=5e-6)

    def test_weights_that_the_extension_changes_are_followed_at_once(self, rigged):
        obj, armature = rigged
        pose(armature, "Bone.1")
        names = [bone.name for bone in armature.data.bones]
        part("operators.rigging.weights").write_weights(obj, names, np.tile([0.0, 0.5, 0.5], (len(rest(obj)), 1)))
        part("operators.deform.live").update(obj)
        assert stale(obj) == ""
        weights = part("operators.rigging.weights").read_weights(obj)
        assert_allclose(shown(obj), by_blender(obj, armature, weights), atol=5e-6)

    @pytest.mark.parametrize(
        ("prepare", "text"),
        [
            (lambda obj, arm: obj.data.attributes.remove(obj.data.attributes["lb_bones"]), "has no weights of bones"),
            (lambda obj, arm: [setattr(bone, "name", f"Other{bone.name}") for bone in arm.data.bones], "of no bone of"),
            (lambda obj, arm: setattr(arm, "parent", obj), "moves with"),
        ],
    )
    def test_what_cannot_be_bound(self, prepare, text):
        armature, obj = add_arm(1.0, 1.0), cloud(50)
        part("operators.rigging.weights").write_weights(obj, ["Bone.0", "Bone.1"], np.tile(0.5, (50, 2)))
        prepare(obj, armature)
        select(obj, armature)
        with pytest.raises(RuntimeError, match=text):
            bpy.ops.meshfree.bind_armature()
        assert not obj.meshfree.deform.is_bound

    def test_without_an_armature_or_points(self):
        obj = cloud(50)
        select(obj)
        with pytest.raises(RuntimeError, match="No armature is chosen"):
            bpy.ops.meshfree.bind_armature()
        armature = add_arm(1.0)
        select(armature)
        with pytest.raises(RuntimeError, match="selected alone"):
            bpy.ops.meshfree.bind_armature()

    def test_bendy_bones_are_told(self, capfd):
        armature, obj = add_arm(1.0, 1.0), cloud(50)
        armature.data.bones["Bone.1"].bbone_segments = 4
        bound(obj, armature, np.tile(0.5, (50, 2)))
        assert "Bendy bones, followed as straight ones: Bone.1" in capfd.readouterr().out

    def test_one_undo_takes_it_back(self):
        armature, obj = add_arm(1.0, 1.0), cloud(50)
        part("operators.rigging.weights").write_weights(obj, ["Bone.0", "Bone.1"], np.tile(0.5, (50, 2)))
        select(obj, armature)
        bpy.ops.ed.undo_push(message="Weights")
        name = obj.name
        bpy.ops.meshfree.bind_armature()
        bpy.ops.ed.undo_push(message="Bind")
        bpy.ops.ed.undo()
        obj = bpy.data.objects[name]
        assert not obj.meshfree.deform.is_bound
        assert obj.parent is None
        assert not obj.modifiers


def edit_bone(armature, name, change):
    """Change a bone in Edit Mode."""
    select(armature)
    bpy.ops.object.mode_set(mode="EDIT")
    change(armature.data.edit_bones[name])
    bpy.ops.object.mode_set(mode="OBJECT")


def shift(obj):
    points = attribute(obj, "position") + np.float32(0.1)
    obj.data.attributes["position"].data.foreach_set("vector", points.ravel())


def scale_weights(obj):
    """Change the attribute of the weights, as nodes or scripts do."""
    layer = obj.data.attributes["lb_bone_weights"]
    values = np.empty(4 * len(layer.data), np.float32)
    layer.data.foreach_get("color", values)
    layer.data.foreach_set("color", values[::-1].copy())


class TestTakingOver:
    """Bake, Apply, To Shape Key and Unbind, as of handles."""

    def test_bake(self, rigged, modifiers):
        obj, armature = rigged
        animate(armature)
        expected = {}
        for frame in (1, 3, 5):
            bpy.context.scene.frame_set(frame)
            expected[frame] = shown(obj), covariances(obj)
        bpy.context.scene.frame_set(2)
        armature.pose.bones["Bone.0"].location.x = 0.1  # has no keyframe
        select(obj)
        assert bpy.ops.meshfree.deform_bake(first=1, last=5) == {"FINISHED"}
        assert bpy.context.scene.frame_current == 2
        assert armature.pose.bones["Bone.0"].location.x == pytest.approx(0.1)
        armature.pose.bones["Bone.0"].location.x = 5.0
        shifted = np.array([0.1, 0.0, 0.0])
        for frame, (points, shapes) in expected.items():
            bpy.context.scene.frame_set(frame)
            assert_allclose(shown(obj), points + shifted, atol=1e-5)
            assert_allclose(covariances(obj), shapes, atol=1e-5 * shapes.max())
        assert "Delete the bake to let it follow the bones again" in stale(obj)
        assert bpy.ops.meshfree.deform_free() == {"FINISHED"}
        assert stale(obj) == ""

    def test_apply(self, rigged):
        obj, armature = rigged
        pose(armature, "Bone.1")
        points, shapes = shown(obj), covariances(obj)
        assert bpy.ops.meshfree.deform_apply() == {"FINISHED"}
        assert not obj.meshfree.deform.is_bound
        assert "Mesh-Free Deform" not in obj.modifiers
        assert_allclose(rest(obj), points, atol=1e-6)
        assert_allclose(covariances(obj), shapes, atol=1e-5 * shapes.max())
        pose(armature, "Bone.0")
        assert_allclose(shown(obj), points, atol=1e-6)

    def test_to_shape_key(self, rigged, modifiers):
        obj, armature = rigged
        pose(armature, "Bone.1")
        points = shown(obj)
        assert bpy.ops.meshfree.deform_to_shape_key() == {"FINISHED"}
        assert stale(obj) == ""
        assert_allclose(shown(obj), points, atol=1e-6)
        pose(armature, "Bone.1", matrix=Matrix())
        modifiers.set_input(obj.modifiers["Deform"], "Value", 1.0)
        obj.update_tag()
        assert_allclose(shown(obj), points, atol=1e-5)

    def test_unbind(self, rigged):
        obj, armature = rigged
        pose(armature, "Bone.1")
        assert bpy.ops.meshfree.deform_unbind() == {"FINISHED"}
        assert_allclose(shown(obj), rest(obj), atol=1e-7)
        assert {name for name in obj.data.attributes.keys() if name.startswith("lb_")} == {
            "lb_bones",
            "lb_bone_weights",
        }

    def test_the_pose_is_the_armatures(self, rigged):
        obj, armature = rigged
        pose(armature, "Bone.1")
        select(obj)
        with pytest.raises(RuntimeError, match="Clear Transform"):
            bpy.ops.meshfree.deform_reset()
        with pytest.raises(RuntimeError, match="follows the bones"):
            bpy.ops.meshfree.deform_bind()


class TestMeshes:
    """Blender's own modifier moves vertices; the discs of the display turn along."""

    @pytest.fixture
    def mesh(self):
        armature = add_arm(1.0, 1.0, 1.0)
        angle, height = (each.ravel() for each in np.meshgrid(np.arange(24) * pi / 12, np.linspace(0.0, 3.0, 24)))
        points = np.column_stack([0.4 * np.cos(angle), 0.4 * np.sin(angle), height])
        obj = add_object(points, "Tube")
        bpy.ops.meshfree.show_surface()
        bound(obj, armature, weights_along(rest(obj), (1.0, 2.0, 3.0)))
        return obj, armature

    def test_discs_turn_along(self, mesh, core):
        obj, armature = mesh
        discs = attribute(obj, "lb_disc").astype(np.float64)
        pose(armature, "Bone.1")
        changes = [np.array(bone.matrix @ bone.bone.matrix_local.inverted()) for bone in armature.pose.bones]
        weights = part("operators.rigging.weights").read_weights(obj)
        points, gradients = core.rig.skin(rest(obj), weights, changes, gradients=True)
        assert not attribute(obj, "lb_displacement").any()
        turned = part("operators.objects.carried").moved_discs(discs, gradients)
        assert_allclose(attribute(obj, "lb_moved_disc"), turned, atol=1e-6)
        display = next(item for item in obj.modifiers if item.name == "Mesh-Free Display")
        display.show_viewport = False
        bpy.context.view_layer.update()
        assert_allclose(shown(obj), points, atol=5e-6)
        assert_allclose(shown(obj, "lb_disc"), attribute(obj, "lb_moved_disc"), atol=1e-6)

    def test_preserve_volume_is_that_of_the_modifier(self, mesh):
        obj, armature = mesh
        pose(armature, "Bone.1")
        linear = attribute(obj, "lb_moved_disc")
        obj.modifiers["Armature"].use_deform_preserve_volume = True
        bpy.context.view_layer.update()
        assert np.abs(attribute(obj, "lb_moved_disc") - linear).max() > 0.01

    @pytest.mark.parametrize(
        "paint",
        [
            lambda groups: groups["Bone.1"].add(range(24), 0.7, "REPLACE"),
            lambda groups: groups["Bone.1"].remove(range(300)),
            lambda groups: groups.remove(groups["Bone.1"]),
        ],
    )
    def test_painted_weights_are_told_and_taken_when_bound_again(self, mesh, paint, counting):
        obj, armature = mesh
        assert stale(obj) == ""
        paint(obj.vertex_groups)
        counting.renew_counts(obj)  # as happens within some seconds
        assert "The weights of the bones changed. Bind again" in stale(obj)
        select(obj)
        assert "Bind Again" in texts(obj)
        assert bpy.ops.meshfree.bind_armature() == {"FINISHED"}
        assert stale(obj) == ""
        pose(armature, "Bone.1")
        assert np.abs(attribute(obj, "lb_moved_disc") - attribute(obj, "lb_disc")).max() > 0.01

    def test_other_groups_are_none_of_its_weights(self, mesh, counting):
        obj, _ = mesh
        obj.vertex_groups.new(name="Wind").add(range(99), 1.0, "REPLACE")
        counting.renew_counts(obj)
        assert stale(obj) == ""

    def test_weights_that_the_extension_changes_are_followed_at_once(self, mesh, core):
        obj, armature = mesh
        names = [bone.name for bone in armature.data.bones]
        pose(armature, "Bone.1")
        part("operators.rigging.weights").write_weights(obj, names, np.tile([0.0, 0.0, 1.0], (len(rest(obj)), 1)))
        part("operators.deform.live").update(obj)
        assert stale(obj) == ""
        bone = armature.pose.bones["Bone.2"]
        turn = np.array(bone.matrix @ bone.bone.matrix_local.inverted(), np.float64)[:3, :3]
        assert_allclose(attribute(obj, "lb_moved_disc"), attribute(obj, "lb_disc") @ turn.T, atol=1e-5)

    def test_the_modifier_is_to_be_applied_instead(self, mesh):
        obj, _ = mesh
        for tool in (bpy.ops.meshfree.deform_apply, bpy.ops.meshfree.deform_to_shape_key):
            with pytest.raises(RuntimeError, match="Apply that"):
                tool()
        assert bpy.ops.meshfree.deform_unbind() == {"FINISHED"}
        assert next(item.type for item in obj.modifiers) == "ARMATURE"


def texts(obj):
    """What the panel of rigs says of an object."""
    layout = Layout()
    part("ui.follow").draw_follow(layout, bpy.context, obj)
    return layout.texts


class TestPanel:
    def test_what_it_shows(self, rigged):
        obj, armature = rigged
        lines = texts(obj)
        assert "Follows Arm" in lines
        assert "Bound: follows its bones" in lines
        assert "preserve_volume" in lines
        assert "Bind Again" in lines
        assert {"Bake", "Apply", "To Shape Key", "Unbind"} <= set(lines)
        assert "Reset" not in lines
        assert "Followed by Splats" in texts(armature)
        armature.data.bones["Bone.1"].name = "Elbow"
        assert any("renamed or deleted: Bone.1" in line for line in texts(obj))
        assert any("see Rig" in line for line in draw())

    def test_before_binding(self):
        obj = cloud(50)
        assert texts(obj) == []
        part("operators.rigging.weights").write_weights(obj, ["Bone.0"], np.ones((50, 1)))
        assert texts(obj) == ["Bind to Armature"]


class TestFiles:
    """Saved files go on with the extension, and show the last or the baked state without."""

    SHOWN = """
        import os, sys
        import bpy, numpy as np
        if {enabled}:
            bpy.ops.preferences.addon_enable(module="bl_ext.user_default.meshfree_laplacian")
        bpy.ops.wm.open_mainfile(filepath={path!r})
        found = []
        for frame in (4, 1, 3):
            if {frames}:
                bpy.context.scene.frame_set(frame)
            data = bpy.data.objects["Splats"].evaluated_get(bpy.context.evaluated_depsgraph_get()).data
            values = np.empty(3 * len(data.attributes["position"].data), np.float32)
            data.attributes["position"].data.foreach_get("vector", values)
            found.append(values.reshape(-1, 3))
        np.save({path!r} + ".npy", found)
        os._exit(0)
    """

    def opened(self, path, installed, enabled, frames=True):
        """What another Blender shows at frames 4, 1 and 3."""
        script = textwrap.dedent(self.SHOWN).format(enabled=enabled, frames=frames, path=str(path))
        folder = installed if enabled else path.parent / "nobody"
        environment = os.environ | {"BLENDER_USER_RESOURCES": str(folder)}
        done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, timeout=240)
        assert done.returncode == 0, done.stderr
        return np.load(f"{path}.npy")

    def test_with_and_without_the_extension(self, rigged, tmp_path, installed):
        obj, armature = rigged
        animate(armature)
        expected = []
        for frame in (4, 1, 3):
            bpy.context.scene.frame_set(frame)
            expected.append(shown(obj))
        path = tmp_path / "follow.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        assert_allclose(self.opened(path, installed, True), expected, atol=1e-5)
        assert_allclose(self.opened(path, installed, False, frames=False)[0], expected[-1], atol=1e-5)
        select(obj)
        assert bpy.ops.meshfree.deform_bake(first=1, last=5, harmonics=False) == {"FINISHED"}
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        assert_allclose(self.opened(path, installed, False), expected, atol=1e-5)
