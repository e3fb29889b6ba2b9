"""Weights transferred as a user does it: from a rigged object to others, groups, locks, mixing, and what is refused."""

import bpy
import numpy as np
import pytest

from tests.blender.armatures import add_armature, weights_of
from tests.blender.clouds import add_group, add_object, attribute, everything, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import refused
from tests.blender.splats import add_splats
from tests.blender.test_panel import draw
from tests.blender.test_pointcloud import add_pointcloud

BONES = {"lower": ((0, 0, -0.8), (0, 0, 0)), "upper": ((0, 0, 0), (0, 0, 0.8))}


def height(points):
    """Weights of two bones along z, (n, 2), which sum to one."""
    upper = np.clip(0.5 + 0.6 * np.asarray(points)[:, 2], 0.0, 1.0)
    return np.column_stack([1.0 - upper, upper])


def positions(obj):
    return attribute(obj, "position").astype(np.float64)


def choose(active, *others):
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj == active or obj in others)
    bpy.context.view_layer.objects.active = active


@pytest.fixture
def pair():
    """A rigged sphere, the active object, and another sample of it."""
    armature = add_armature(BONES)
    source = add_object(sphere_points(900), "Source")
    part("operators.rigging.weights").write_weights(source, list(BONES), height(positions(source)))
    source.parent = armature
    target = add_object(sphere_points(500, seed=5), "Target")
    choose(source, target)
    return source, target


def names_of(obj):
    return [group.name for group in obj.vertex_groups]


def test_weights_come_over(pair, capfd):
    source, target = pair
    before = everything(source)
    assert bpy.ops.meshfree.transfer_weights() == {"FINISHED"}
    assert names_of(target) == list(BONES)
    found = weights_of(target)
    assert np.abs(found - height(positions(target))).max() < 0.02
    assert np.abs(found.sum(axis=1) - 1.0).max() < 1e-6
    assert (target.parent, list(target.modifiers)) == (None, [])
    assert (attribute(target, "lb_transfer") == 1).mean() > 0.98
    now = everything(source)
    assert {key for key in now if now[key] != before[key]} <= {"blocks", "settings"}
    assert "take weights of 2 groups from Source, within" in capfd.readouterr().out


def test_objects_are_taken_where_they_stand(pair):
    source, target = pair
    source.parent.location = 3.0, 2.0, 1.0
    source.parent.rotation_euler = 0.3, 0.2, 0.1
    bpy.context.view_layer.update()
    target.matrix_world = source.matrix_world
    target.scale = 1.02, 1.02, 1.02
    bpy.ops.meshfree.transfer_weights()
    assert np.abs(weights_of(target) - height(positions(target))).max() < 0.03


def test_what_is_far_is_filled_in(pair):
    """The lower half of the target is pulled out of the source."""
    _, target = pair
    points = positions(target)
    points[points[:, 2] < 0.0, 2] *= 2.0
    target.data.attributes["position"].data.foreach_set("vector", points.astype(np.float32).reshape(-1))
    bpy.ops.meshfree.transfer_weights(distance=0.1)
    state = attribute(target, "lb_transfer")
    assert (state[points[:, 2] > 0.1] == 1).mean() > 0.95
    assert (state[points[:, 2] < -1.5] == 0).all()
    found = weights_of(target)
    assert np.abs(found.sum(axis=1) - 1.0).max() < 1e-6
    assert (found[points[:, 2] < -1.5, 0] > 0.85).all()


def test_parts_that_are_far_are_told_of(pair, capfd):
    source, _ = pair
    both = add_object(np.concatenate([sphere_points(400), sphere_points(400) + [9.0, 0.0, 0.0]]), "Both")
    choose(source, both)
    bpy.ops.meshfree.transfer_weights()
    assert (attribute(both, "lb_transfer")[400:] == 2).all()
    assert "none is near the source: 400" in capfd.readouterr().out


def test_sheets_that_are_hardly_told_apart_are_told_of(pair, capfd):
    """Two shells around each other, 1.2 spacings apart, as a source and as a target; single shells are not."""
    source, _ = pair
    bpy.ops.meshfree.transfer_weights()
    assert "Sheets of" not in capfd.readouterr().out
    shells = np.concatenate([sphere_points(900), 1.14 * sphere_points(900, 1)])
    both = add_object(shells, "Shells")
    choose(source, both)
    bpy.ops.meshfree.transfer_weights()
    told = capfd.readouterr().out
    assert "Sheets of Shells are as close to each other as its points are, at" in told
    assert "Sheets of Source" not in told
    choose(both, source)
    bpy.ops.meshfree.transfer_weights(preview=True)
    assert "Sheets of Shells" in capfd.readouterr().out


def test_preview_writes_colors_alone(pair, extension):
    _, target = pair
    assert bpy.ops.meshfree.transfer_weights(preview=True) == {"FINISHED"}
    assert names_of(target) == []
    assert (attribute(target, "lb_transfer") == 1).mean() > 0.98
    assert extension.ui.display.shown_attribute(target) == "lb_transfer"
    choose(target)
    assert any("would take weights of 2 groups" in text for text in [" ".join(draw())])


def test_from_several_to_the_active_one(pair):
    source, _ = pair
    other = add_object(sphere_points(900, seed=2) + [5.0, 0.0, 0.0], "Other")
    add_group(other, "third", np.arange(900))
    both = add_object(np.concatenate([sphere_points(500, 7), sphere_points(500, 8) + [5.0, 0.0, 0.0]]), "Both")
    choose(both, source, other)
    bpy.ops.meshfree.transfer_weights(reverse=True)
    assert names_of(both) == ["lower", "upper", "third"]
    found = weights_of(both)
    assert np.abs(found[:500, :2] - height(positions(both)[:500])).max() < 0.03
    assert np.array_equal(found[500:], np.tile([0.0, 0.0, 1.0], (500, 1)))
    assert not found[:500, 2].any()


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"groups": "ALL"}, ["lower", "upper", "Wind"]),
        ({"groups": "DEFORM"}, ["lower", "upper"]),
        ({"groups": "ACTIVE"}, ["Wind"]),
        ({"groups": "NAMES", "pattern": "?*er"}, ["lower", "upper"]),
    ],
)
def test_groups(pair, settings, expected):
    source, target = pair
    add_group(source, "Wind", np.arange(300), 0.5)
    source.vertex_groups.active = source.vertex_groups["Wind"]
    bpy.ops.meshfree.transfer_weights(**settings)
    assert names_of(target) == expected


def test_groups_that_are_no_bones_count_in_no_sum(pair):
    """Wind blows at one side, and half of the points follow no bone."""
    source, target = pair
    side, upper = positions(source)[:, 0] > 0.0, positions(source)[:, 2] > 0.0
    add_group(source, "Wind", side, 1.0)
    for name in BONES:
        source.vertex_groups[name].remove(np.flatnonzero(~upper).tolist())
    bpy.ops.meshfree.transfer_weights()
    found, points = weights_of(target), positions(target)
    assert np.abs(found[:, :2].sum(axis=1) - 1.0).max() < 1e-6
    state = attribute(target, "lb_transfer")
    assert (state[points[:, 2] > 0.3] == 1).mean() > 0.95
    assert (state[points[:, 2] < 0.0] == 0).all()
    assert (found[(points[:, 2] > 0.2) & (points[:, 0] > 0.3), 2] > 0.9).all()
    assert (found[(points[:, 2] > 0.2) & (points[:, 0] < -0.3), 2] < 0.1).all()


def test_a_group_of_some_points_is_not_spread(pair):
    source, target = pair
    source.parent = None
    source.vertex_groups.clear()
    add_group(source, "Pinned", positions(source)[:, 2] > 0.0)
    bpy.ops.meshfree.transfer_weights()
    pinned, far = weights_of(target)[:, 0], np.abs(positions(target)[:, 2]) > 0.2
    assert np.array_equal(pinned[far] > 0.5, positions(target)[far, 2] > 0.0)
    assert pinned[far].min() < 0.1


def test_locked_groups_stay_and_are_told(pair, capfd):
    _, target = pair
    add_group(target, "lower", np.arange(500), 0.25).lock_weight = True
    bpy.ops.meshfree.transfer_weights()
    found = weights_of(target)
    assert (found[:, 0] == 0.25).all()
    assert np.allclose(found[height(positions(target))[:, 1] > 0.05, 1], 0.75, atol=1e-6)
    assert "Locked vertex groups, left as they are: lower" in capfd.readouterr().out
    target.vertex_groups["upper"].lock_weight = True
    with refused(target, "All groups.*locked: lower, upper. Unlock some"):
        bpy.ops.meshfree.transfer_weights()


def test_weights_before_do_not_matter_unless_mixed(pair):
    _, target = pair
    old = height(-positions(target))
    part("operators.rigging.weights").write_weights(target, list(BONES), old)
    bpy.ops.meshfree.transfer_weights()
    new = weights_of(target)
    assert np.abs(new - height(positions(target))).max() < 0.02
    part("operators.rigging.weights").write_weights(target, list(BONES), old)
    bpy.ops.meshfree.transfer_weights(mix=0.5)
    assert np.abs(weights_of(target) - 0.5 * (old + new)).max() < 1e-5


@pytest.mark.parametrize("replace", [True, False])
def test_other_bones_are_emptied_or_stay(pair, replace, capfd):
    """A bone that the armature has and the source has no group of; groups that are no bones stay in any case."""
    source, target = pair
    bpy.context.view_layer.objects.active = source.parent
    bpy.ops.object.mode_set(mode="EDIT")
    tail = source.parent.data.edit_bones.new("tail")
    tail.head, tail.tail = (0, 0, 1), (0, 0, 2)
    bpy.ops.object.mode_set(mode="OBJECT")
    target.parent = source.parent
    for name, weight in {"tail": 0.25, "Anchor": 1.0}.items():
        add_group(target, name, np.arange(500), weight)
    choose(source, target)
    bpy.ops.meshfree.transfer_weights(replace=replace)
    found = weights_of(target)
    assert (found[:, names_of(target).index("Anchor")] == 1.0).all()
    bones = found[:, [names_of(target).index(name) for name in ("tail", *BONES)]]
    assert np.abs(bones.sum(axis=1) - 1.0).max() < 1e-6
    assert (bones[:, 0] == (0.0 if replace else 0.25)).all()
    assert ("emptied by Replace: tail" in capfd.readouterr().out) == replace


def test_other_bones_give_way_to_a_single_group(pair):
    source, target = pair
    source.vertex_groups.active = source.vertex_groups["upper"]
    target.parent = source.parent
    add_group(target, "lower", np.arange(500), 1.0)
    bpy.ops.meshfree.transfer_weights(groups="ACTIVE")
    assert np.abs(weights_of(target) - height(positions(target))).max() < 0.02


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="objects become point clouds from Blender 4.5 on")
def test_to_a_point_cloud_and_back(pair):
    source, target = pair
    weights = part("operators.rigging.weights")
    cloud = add_pointcloud(sphere_points(600, seed=9))
    choose(source, cloud)
    bpy.ops.meshfree.transfer_weights()
    assert weights.weight_names(cloud) == list(BONES)
    assert np.abs(weights.read_weights(cloud) - height(positions(cloud))).max() < 0.02
    choose(cloud, target)
    bpy.ops.meshfree.transfer_weights(groups="DEFORM")
    assert np.abs(weights_of(target) - height(positions(target))).max() < 0.04


def test_to_splats_of_a_mesh_and_back(pair, core):
    """Their vertex groups are no weights of bones, nor locked ones of such names."""
    source, target = pair
    weights, points = part("operators.rigging.weights"), sphere_points(600, seed=9).astype(np.float32)
    one, three = np.ones(len(points), np.float32), np.full((len(points), 3), 0.05, np.float32)
    turns = np.tile(np.float32([1.0, 0.0, 0.0, 0.0]), (len(points), 1))
    empty = np.zeros((len(points), 0, 3), np.float32)
    cloud = add_splats(core.splats.Splats(points, three, turns, one, three, empty), as_mesh=True)
    add_group(cloud, "upper", np.arange(9))
    cloud.vertex_groups["upper"].lock_weight = True
    choose(source, cloud)
    assert bpy.ops.meshfree.transfer_weights() == {"FINISHED"}
    assert weights.weight_names(cloud) == list(BONES)
    assert np.abs(weights.read_weights(cloud) - height(positions(cloud))).max() < 0.02
    choose(cloud, target)
    with refused(target, "no active vertex group"):
        bpy.ops.meshfree.transfer_weights(groups="ACTIVE")
    bpy.ops.meshfree.transfer_weights(groups="DEFORM")
    assert np.abs(weights_of(target) - height(positions(target))).max() < 0.04


def test_one_undo_step(pair):
    before = everything(pair[1])
    bpy.ops.ed.undo_push(message="Before")
    assert bpy.ops.meshfree.transfer_weights("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.ops.ed.undo()
    assert everything(bpy.data.objects["Target"]) == before


class TestRefused:
    def test_nothing_else_is_selected(self, pair):
        choose(pair[0])
        assert "Select the objects that take values" in bpy.types.MESHFREE_OT_transfer_weights.obstacle(bpy.context)

    def test_nothing_has_weights(self, pair):
        choose(pair[1], add_object(sphere_points(300), "Bare"))
        assert "No selected object has weights" in bpy.types.MESHFREE_OT_transfer_weights.obstacle(bpy.context)

    def test_the_active_object_has_none(self, pair):
        source, target = pair
        choose(target, source)
        with refused(source, '"Target" has no weights to transfer.*Reverse Transfer'):
            bpy.ops.meshfree.transfer_weights()

    def test_a_mesh_that_both_share(self, pair):
        source, _ = pair
        twin = source.copy()
        bpy.context.scene.collection.objects.link(twin)
        choose(source, twin)
        with refused(source, "No selected object can take values"):
            bpy.ops.meshfree.transfer_weights()

    def test_too_far(self, pair):
        _, target = pair
        target.location.x = 9.0
        bpy.context.view_layer.update()
        with refused(target, 'No point of "Target" lies within'):
            bpy.ops.meshfree.transfer_weights()

    def test_modifiers_of_the_source_that_change_its_points(self, pair):
        source, target = pair
        mask = source.modifiers.new("Mask", "MASK")
        mask.vertex_group = "lower"
        bpy.ops.meshfree.transfer_weights()  # as modifiers are not used, its own vertices count
        target.vertex_groups.clear()
        source.meshfree.use_modifiers = True
        with refused(target, 'modifiers of "Source" change its 900 points to .* or turn off Use Modifiers'):
            bpy.ops.meshfree.transfer_weights()

    def test_attributes_of_these_names(self, pair):
        _, target = pair
        target.data.attributes.new("upper", "FLOAT", "POINT")
        with refused(target, "attributes named upper.*Rename"):
            bpy.ops.meshfree.transfer_weights()

    @pytest.mark.parametrize(
        ("settings", "text"),
        [({"groups": "NAMES", "pattern": "x"}, 'match "x"'), ({"groups": "DEFORM"}, "deforming bones of an armature")],
    )
    def test_no_such_groups(self, pair, settings, text):
        source, target = pair
        source.parent = None
        with refused(target, text):
            bpy.ops.meshfree.transfer_weights(**settings)
