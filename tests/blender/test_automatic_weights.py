"""Automatic Weights: what is left on objects, beside what Blender's own leaves, and what happens to odd ones."""

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from numpy.testing import assert_allclose

from tests.blender.armatures import add_armature, choose, weights_of
from tests.blender.clouds import add_object, everything
from tests.blender.conftest import part
from tests.blender.operators import refused
from tests.blender.test_pointcloud import add_pointcloud

BONES = {"lower": ((0.0, 0.0, -2.5), (0.0, 0.0, 0.0)), "upper": ((0.0, 0.0, 0.0), (0.0, 0.0, 2.5))}


def rod(faces=True):
    """A closed cylinder of height 6, by its vertices and faces."""
    around, rings = 16, np.linspace(-3.0, 3.0, 25)
    angle = 2.0 * np.pi * np.arange(around) / around
    points = np.concatenate([np.column_stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), 0 * angle + z]) for z in rings])
    points = np.vstack([points, [0, 0, -3.0], [0, 0, 3.0]])
    first, last = np.arange(around), len(points) - 2 - around + np.arange(around)
    quads = [
        (row * around + a, row * around + b, (row + 1) * around + b, (row + 1) * around + a)
        for row in range(len(rings) - 1)
        for a, b in zip(range(around), np.roll(np.arange(around), -1).tolist(), strict=True)
    ]
    ends = [(len(points) - 2, b, a) for a, b in zip(first.tolist(), np.roll(first, -1).tolist(), strict=True)]
    ends += [(len(points) - 1, a, b) for a, b in zip(last.tolist(), np.roll(last, -1).tolist(), strict=True)]
    return add_object(points, "Rod", quads + ends if faces else ())


def rigged(make=rod, **settings):
    obj, armature = make(), add_armature(BONES)
    choose(armature, obj)
    assert bpy.ops.meshfree.auto_weights(**settings) == {"FINISHED"}
    return obj, armature


def left_on(obj):
    """What a rigged object is like beside its weights."""
    return {
        "groups": [(group.name, group.lock_weight) for group in obj.vertex_groups],
        "active": obj.vertex_groups.active.name,
        "modifiers": [
            (
                item.name,
                {
                    each.identifier: getattr(item, each.identifier)
                    for each in item.bl_rna.properties
                    if each.type in {"BOOLEAN", "STRING", "INT"}
                },
            )
            for item in obj.modifiers
        ],
        "follows": [item.object for item in obj.modifiers if item.type == "ARMATURE"],
        "parent": (obj.parent, obj.parent_type),
        "selected": (obj.select_get(), obj.parent.select_get(), bpy.context.object),
    }


def test_it_leaves_what_blender_leaves():
    found = []
    for own in (True, False):
        obj, armature = rod(), add_armature({**BONES, "aside": ((0.0, 0.2, 0.0), (0.0, 0.2, 0.1))})
        armature.data.bones["aside"].use_deform = False
        obj.location, obj.scale, obj.rotation_euler = (1.0, 2.0, 3.0), (0.5, 0.6, 0.7), (0.2, 0.3, 0.4)
        armature.location, armature.scale, armature.rotation_euler = obj.location, (0.5, 0.5, 0.5), obj.rotation_euler
        obj.vertex_groups.new(name="Other")
        obj.vertex_groups.new(name="upper").add([0, 1], 0.5, "REPLACE")
        obj.modifiers.new("Subdivision", "SUBSURF")
        bpy.context.view_layer.update()
        choose(armature, obj)
        before = obj.matrix_world.copy(), obj.matrix_basis.copy()
        if own:
            bpy.ops.meshfree.auto_weights(least=0.0)
        else:
            bpy.ops.object.parent_set(type="ARMATURE_AUTO")
        bpy.context.view_layer.update()
        assert_allclose(obj.matrix_world, before[0], atol=1e-6)
        assert obj.matrix_basis == before[1]
        left = left_on(obj)
        assert left.pop("follows") == [armature]
        parent, kind = left.pop("parent")
        assert (parent, kind) == (armature, "OBJECT")
        assert left.pop("selected") == (True, True, armature)
        found.append((left, weights_of(obj), np.array(obj.matrix_parent_inverse)))
    (ours, weights, inverse), (blenders, its_weights, its_inverse) = found
    assert ours == blenders
    assert_allclose(inverse, its_inverse, atol=1e-6)
    assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    assert np.abs(weights - its_weights).mean() < 0.02


def tell(obj):
    return " ".join(notice.text for notice in obj.meshfree.notices)


def test_points_without_faces_and_with_them_have_the_same_weights():
    obj, _ = rigged()
    points, _ = rigged(lambda: rod(faces=False))
    assert_allclose(weights_of(points), weights_of(obj), atol=1e-6)
    obj.parent.pose.bones["upper"].scale = (1.0, 2.0, 1.0)  # along the bone
    depsgraph = bpy.context.evaluated_depsgraph_get()
    moved = np.array([vertex.co for vertex in obj.evaluated_get(depsgraph).data.vertices])
    rest = np.array([vertex.co for vertex in obj.data.vertices])
    assert_allclose(moved - rest, weights_of(obj)[:, [1]] * rest * [0.0, 0.0, 1.0], atol=1e-5)


@pytest.mark.parametrize("scale", [(0.01, 0.01, 0.01), (-1.0, 1.0, 1.0), (100.0, 100.0, 100.0)])
def test_scales_of_object_and_armature_count_together(scale):
    expected = weights_of(rigged()[0])
    obj, armature = rod(), add_armature(BONES)
    obj.data.transform(Matrix.Diagonal((*scale, 1.0)).inverted())
    for each, size in ((obj, scale), (armature, (1.0, 1.0, 1.0))):
        each.scale, each.location, each.rotation_euler = size, (5.0, 2.0, 1.0), (0.4, 0.5, 0.6)
    choose(armature, obj)
    bpy.ops.meshfree.auto_weights()
    assert_allclose(weights_of(obj), expected, atol=2e-3)


def test_groups_keep_their_places_and_locked_ones_their_weights():
    free = weights_of(rigged()[0])
    obj, armature = rod(), add_armature(BONES)
    obj.vertex_groups.new(name="upper").add(range(len(obj.data.vertices)), 0.25, "REPLACE")
    obj.vertex_groups.new(name="Other").add([3], 0.5, "REPLACE")
    obj.vertex_groups["upper"].lock_weight = True
    choose(armature, obj)
    bpy.ops.meshfree.auto_weights()
    assert [group.name for group in obj.vertex_groups] == ["upper", "Other", "lower"]
    found = weights_of(obj)
    assert_allclose(found[:, 0], 0.25)
    assert_allclose(found[:, 2], 0.75 * (free[:, 0] > 0.0), atol=1e-6)
    assert found[3, 1] == 0.5
    assert "upper" in tell(obj)


def test_many_objects_at_once_and_again():
    objects = [rod(), rod(faces=False)]
    objects[1].location.x = 3.0
    armature = add_armature({**BONES, "beside": ((3.0, 0.0, -2.5), (3.0, 0.0, 2.5))})
    choose(armature, *objects)
    for _ in range(2):
        bpy.ops.meshfree.auto_weights()
        for obj in objects:
            assert obj.parent == armature
            assert [item.object for item in obj.modifiers] == [armature]
            assert [group.name for group in obj.vertex_groups] == ["lower", "upper", "beside"]
    assert weights_of(objects[0])[:, 2].max() == 0.0
    assert_allclose(weights_of(objects[1])[:, 2], 1.0, atol=1e-6)
    assert "Bones that no point follows: beside." in tell(objects[0])
    assert "Bones that no point follows: lower, upper." in tell(objects[1])


@pytest.mark.parametrize("kind", ["object", "bone", "constraint"])
def test_nothing_moves_if_there_was_another_parent(kind):
    obj, armature = rod(), add_armature(BONES)
    other = add_armature({"Other": ((0, 0, 0), (0, 0, 1))}, "Other")
    other.matrix_world = Matrix.LocRotScale((1.0, 2.0, 3.0), None, (1.0, 1.0, 2.0)) @ Matrix.Rotation(0.5, 4, "X")
    obj.parent, obj.location, obj.delta_location = other, (0.1, 0.2, 0.3), (0.1, 0.0, 0.0)
    if kind == "bone":
        obj.parent_type, obj.parent_bone = "BONE", "Other"
    elif kind == "constraint":
        limit = obj.constraints.new("LIMIT_LOCATION")
        limit.use_max_x, limit.max_x = True, 0.5
    bpy.context.view_layer.update()
    before, basis = np.array(obj.matrix_world), obj.matrix_basis.copy()
    armature.matrix_world = Matrix.Translation(obj.matrix_world.translation)
    choose(armature, obj)
    bpy.ops.meshfree.auto_weights()
    bpy.context.view_layer.update()
    assert (obj.parent, obj.parent_type) == (armature, "OBJECT")
    assert_allclose(obj.matrix_world, before, atol=1e-5)
    assert obj.matrix_basis == basis
    armature.location.z += 1.0
    bpy.context.view_layer.update()
    assert obj.matrix_world.translation.z == pytest.approx(before[2, 3] + 1.0, abs=1e-5)


def test_the_modifier_comes_before_our_own():
    obj, armature = rod(faces=False), add_armature(BONES)
    choose(obj, obj)
    bpy.ops.meshfree.show_surface()
    choose(armature, obj)
    bpy.ops.meshfree.auto_weights()
    assert [item.type for item in obj.modifiers] == ["ARMATURE", "NODES", "NODES"]


def test_the_armature_is_chosen_by_selection_or_by_what_the_object_follows():
    obj, armature = rigged()
    choose(obj, obj, armature)
    assert bpy.ops.meshfree.auto_weights() == {"FINISHED"}
    choose(obj, obj)
    assert bpy.ops.meshfree.auto_weights() == {"FINISHED"}
    second = add_armature(BONES, "Second")
    choose(second, obj, armature)
    assert bpy.ops.meshfree.auto_weights() == {"FINISHED"}
    assert obj.parent == second
    assert [item.object for item in obj.modifiers] == [armature, second]
    assert armature.name in tell(obj)


def test_what_cannot_be_is_refused():
    obj, armature = rod(), add_armature(BONES)
    choose(obj, obj)
    with refused(obj, "No armature is chosen"):
        bpy.ops.meshfree.auto_weights()
    choose(armature)
    with refused(obj, "is selected alone"):
        bpy.ops.meshfree.auto_weights()
    choose(armature, obj)
    armature.parent = obj
    with refused(obj, "moves with .Rod., its parent"):
        bpy.ops.meshfree.auto_weights()
    armature.parent = None
    armature.location.x = 30.0
    with refused(obj, "The bones are 29.* away from the points.*same place and scale"):
        bpy.ops.meshfree.auto_weights()
    armature.location.x, armature.scale.y = 0.0, 0.0
    with refused(obj, ".Rig. is scaled to nothing"):
        bpy.ops.meshfree.auto_weights()
    armature.scale.y = 1.0
    obj.data.attributes.new("upper", "FLOAT", "POINT")
    with refused(obj, "attributes named upper"):
        bpy.ops.meshfree.auto_weights()
    obj.data.attributes.remove(obj.data.attributes["upper"])
    for bone in armature.data.bones:
        bone.use_deform = False
    with refused(obj, "Turn on Deform"):
        bpy.ops.meshfree.auto_weights()


def test_points_after_a_pose_are_refused():
    obj, _ = rigged()
    obj.meshfree.use_modifiers = True
    with refused(obj, "Turn off Use Modifiers"):
        bpy.ops.meshfree.auto_weights()


def test_users_of_one_mesh_follow_together_unless_they_lie_elsewhere():
    obj, armature = rod(), add_armature(BONES)
    other = obj.copy()
    bpy.context.scene.collection.objects.link(other)
    choose(armature, obj, other)
    assert bpy.ops.meshfree.auto_weights() == {"FINISHED"}
    assert all(each.parent == armature and each.modifiers[0].object == armature for each in (obj, other))
    other.location.x = 1.0
    with refused(obj, "lies elsewhere.*Make Single User"):
        bpy.ops.meshfree.auto_weights()
    other.meshfree.make_single_user = obj.meshfree.make_single_user = True
    assert bpy.ops.meshfree.auto_weights() == {"FINISHED"}
    assert obj.data != other.data


def test_bones_of_another_scale_or_outside_are_told():
    obj, armature = rod(), add_armature(BONES)
    armature.scale = (0.01, 0.01, 0.01)
    choose(armature, obj)
    bpy.ops.meshfree.auto_weights()
    assert "See whether both are of one scale" in tell(obj)
    obj, armature = rod(), add_armature(BONES)
    armature.location.x = 2.0
    choose(armature, obj)
    bpy.ops.meshfree.auto_weights()
    assert "No point sees a bone" in tell(obj)
    assert_allclose(weights_of(obj).sum(axis=1), 1.0, atol=1e-6)


def test_few_points_follow_the_nearest_bone():
    corners = np.array([(x, y, z) for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (0.5, 0.7)])
    obj, armature = add_object(corners[:6]), add_armature(BONES)
    choose(armature, obj)
    bpy.ops.meshfree.auto_weights()
    assert_allclose(weights_of(obj), np.tile([0.0, 1.0], (6, 1)))
    assert "the nearest bone alone" in tell(obj)


def test_settings():
    bones = {f"{number}": ((0.0, 0.0, z), (0.0, 0.0, z + 0.5)) for number, z in enumerate(np.arange(-2.5, 2.5, 0.5))}
    counts = {}
    for influences in (0, 2):
        obj, armature = rod(), add_armature(bones)
        choose(armature, obj)
        bpy.ops.meshfree.auto_weights(influences=influences, least=0.0, falloff=3.0)
        counts[influences] = (weights_of(obj) > 0.0).sum(axis=1).max()
    assert counts[0] > 4
    assert counts[2] == 2
    bpy.ops.meshfree.auto_weights(least=0.2)
    found = weights_of(obj)
    assert found[found > 0.0].min() > 0.2


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="objects become point clouds from Blender 4.5 on")
def test_a_point_cloud_has_the_weights_of_the_same_vertices():
    expected = weights_of(rigged()[0])
    cloud = add_pointcloud(np.array([vertex.co for vertex in rod().data.vertices]))
    armature = add_armature(BONES)
    choose(armature, cloud)
    bpy.ops.meshfree.auto_weights()
    assert_allclose(part("operators.rigging.weights").read_weights(cloud), expected, atol=1e-5)
    assert cloud.parent == armature
    armature.pose.bones["upper"].scale = (1.0, 2.0, 1.0)  # along the bone
    bpy.context.view_layer.update()
    rest = np.array([point.co for point in cloud.data.points])
    data = cloud.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    moved = np.array([value.vector for value in data.attributes["position"].data])
    assert_allclose(moved - rest, expected[:, [1]] * rest * [0.0, 0.0, 1.0], atol=1e-5)


def test_a_failure_in_the_middle_leaves_everything(monkeypatch):
    objects = [rod(), rod(faces=False)]
    armature, other = add_armature(BONES), add_armature(BONES, "Other")
    objects[0].parent, objects[0].parent_type, objects[0].parent_bone = other, "BONE", "lower"
    objects[1].vertex_groups.new(name="upper").add([1, 2], 0.5, "REPLACE")
    choose(armature, *objects)
    bpy.context.view_layer.update()
    before = [everything(obj) for obj in objects]
    automatic = part("operators.rigging.automatic")
    bind = automatic._bind

    def fail(obj, armature):
        notices = bind(obj, armature)
        if obj == objects[1]:
            raise MemoryError("injected")
        return notices

    monkeypatch.setattr(automatic, "_bind", fail)
    with pytest.raises(RuntimeError, match="The memory is used up"):
        bpy.ops.meshfree.auto_weights()
    bpy.context.view_layer.update()
    assert [everything(obj) for obj in objects] == before


def test_one_undo_takes_it_back():
    obj, armature = rod(), add_armature(BONES)
    choose(armature, obj)
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.meshfree.auto_weights()
    bpy.ops.ed.undo_push(message="After")
    bpy.ops.ed.undo()
    obj = bpy.data.objects["Rod"]
    assert (obj.parent, len(obj.vertex_groups), len(obj.modifiers)) == (None, 0, 0)


@pytest.mark.parametrize("change", ["moved", "deleted", "renamed"])
def test_bones_that_change_meanwhile_are_told(change, monkeypatch):
    obj, armature = rod(), add_armature(BONES)
    choose(armature, obj)
    before = everything(obj)
    automatic = part("operators.rigging.automatic")
    tool = automatic.AutoWeights()
    vars(tool).update(falloff=1.0, influences=4, least=0.0, visible=True)
    monkeypatch.setattr(automatic.AutoWeights, "armature_of", lambda self, context: armature)
    result = tool.plan(bpy.context, obj)(lambda stage, fraction: None)
    if change == "moved":
        armature.location.z += 1.0
    elif change == "renamed":
        armature.data.bones["upper"].name = "top"
    else:
        bpy.data.objects.remove(armature)
    bpy.context.view_layer.update()
    with pytest.raises(part("core").PointCloudError, match="meanwhile"):
        tool.write(bpy.context, obj, result)
    assert everything(obj)["groups"] == before["groups"] == []
