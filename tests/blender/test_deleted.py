"""Objects that are deleted go, whatever of this extension refers to them."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, sphere_points
from tests.blender.conftest import part
from tests.blender.test_follow import add_arm, bound, cloud, pose, rest, select, shown, weights_along


def is_gone(name):
    """Whether nothing uses an object, which is not saved then."""
    return name not in bpy.data.objects or not bpy.data.objects[name].users


def delete(obj):
    """Delete an object as the user does, and end the step of undo."""
    select(obj)
    bpy.ops.object.delete("EXEC_DEFAULT", True)
    bpy.context.view_layer.update()


def rigged(kind):
    """Bend an object by bones: splats, or vertices with discs."""
    armature = add_arm(1.0, 1.0, 1.0)
    if kind == "SPLATS":
        obj = cloud()
    else:
        obj = add_object(np.random.default_rng(3).uniform((-0.5, -0.5, 0.0), (0.5, 0.5, 3.0), (300, 3)))
        bpy.ops.meshfree.show_surface()
    if kind == "POINTCLOUD":
        bpy.ops.meshfree.convert()
    bound(obj, armature, weights_along(rest(obj), (1.0, 2.0, 3.0)))
    pose(armature, "Bone.1")
    bpy.ops.ed.undo_push(message="Pose")
    return obj, armature


def kinds():
    return ["SPLATS", "MESH", "POINTCLOUD"] if bpy.app.version >= (4, 5) else ["SPLATS", "MESH"]


@pytest.mark.any_blender
@pytest.mark.parametrize("kind", kinds())
def test_what_followed_an_armature_is_at_rest_when_it_is_deleted_and_follows_again_after_undo(kind):
    obj, armature = rigged(kind)
    name, bent = obj.name, shown(obj) if kind == "SPLATS" else attribute(obj, "lb_moved_disc")
    delete(armature)
    assert is_gone("Arm")
    assert "lb_moved_disc" not in obj.data.attributes
    assert "The armature was deleted" in part("operators.deform.binding").stale_reason(obj)
    if kind == "SPLATS":
        assert np.abs(bent - rest(obj)).max() > 0.1
        assert_allclose(shown(obj), rest(obj), atol=1e-6)
    bpy.ops.ed.undo()
    obj = bpy.data.objects[name]
    assert obj.meshfree.deform.armature == bpy.data.objects["Arm"]
    assert part("operators.deform.binding").stale_reason(obj) == ""
    assert all(item.object == bpy.data.objects["Arm"] for item in obj.modifiers if item.type == "ARMATURE")
    assert_allclose(shown(obj) if kind == "SPLATS" else attribute(obj, "lb_moved_disc"), bent, atol=1e-6)
    bpy.ops.ed.redo()
    bpy.context.view_layer.update()
    assert is_gone("Arm")
    assert "lb_moved_disc" not in bpy.data.objects[name].data.attributes


@pytest.mark.parametrize("keep", [lambda obj: setattr(obj, "use_fake_user", True), lambda obj: shelve(obj)])
def test_an_armature_that_something_else_keeps_stays(keep):
    _, armature = rigged("SPLATS")
    keep(armature)
    delete(armature)
    assert bpy.data.objects["Arm"].users


def shelve(obj):
    """Link an object to a collection in no scene, which has a user."""
    collection = bpy.data.collections.new("Shelf")
    collection.use_fake_user = True
    collection.objects.link(obj)


def test_an_empty_that_moved_handles_goes():
    obj = add_object(sphere_points(400))
    add_group(obj, "Handle", attribute(obj, "position")[:, 2] > 0.9)
    add_group(obj, "Anchor", attribute(obj, "position")[:, 2] < -0.5)
    bpy.ops.meshfree.deform_bind()
    bpy.ops.ed.undo_push(message="Bind")
    delete(bpy.data.objects["Cloud Handle"])
    assert is_gone("Cloud Handle")
    assert "empty of Handle was deleted" in part("operators.deform.binding").stale_reason(obj)
    bpy.ops.ed.undo()
    assert part("operators.deform.binding").stale_reason(bpy.data.objects["Cloud"]) == ""


def test_what_an_object_was_compared_with_goes():
    obj = add_object(sphere_points(600, seed=1), "First")
    other = add_object(1.01 * sphere_points(600), "Other")
    select(other, obj)
    bpy.ops.meshfree.compare(hide_reference=False)
    assert obj.meshfree.compared_with == other
    delete(other)
    assert is_gone("Other")
    assert obj.meshfree.compared_with is None
