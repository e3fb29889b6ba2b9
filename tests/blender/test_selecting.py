"""Selecting points and assigning them to groups, in Edit Mode and in Object Mode."""

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_object, local_points, sphere_points


@pytest.fixture
def obj():
    obj = add_object(np.concatenate([sphere_points(900), 0.5 * sphere_points(300, 1) + [4.0, 0.0, 0.0]]))
    choose(obj, lambda points: points[:, 2] > 0.95)
    return obj


def choose(obj, condition):
    obj.data.vertices.foreach_set("select", condition(local_points(obj)))


def selected(obj):
    values = np.empty(len(obj.data.vertices), dtype=bool)
    obj.data.vertices.foreach_get("select", values)
    return values


def in_group(obj, name):
    index = obj.vertex_groups[name].index
    return np.array([any(item.group == index for item in vertex.groups) for vertex in obj.data.vertices])


@pytest.fixture(params=["OBJECT", "EDIT"])
def mode(request, obj):
    if request.param == "EDIT":
        obj.select_set(True)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_mode(type="VERT")
    yield request.param
    assert obj.mode == request.param
    bpy.ops.object.mode_set(mode="OBJECT")


def test_a_group_from_the_selection(obj, mode):
    bpy.ops.meshfree.group_from_selection(role="ANCHOR")
    if mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")
    assert (in_group(obj, "Anchor") == (local_points(obj)[:, 2] > 0.95)).all()
    bpy.ops.object.mode_set(mode=mode)


def test_growing(obj, mode):
    bpy.ops.meshfree.select_grow(distance=0.5)
    bpy.ops.object.mode_set(mode="OBJECT")
    points = local_points(obj)
    angle = np.arccos(np.clip(points[:, 2], -1.0, 1.0)) - np.arccos(0.95)
    near = (points[:, 0] < 2.0) & (angle < 0.25)
    far = (points[:, 0] > 2.0) | (angle > 0.55)
    assert selected(obj)[near].all()
    assert not selected(obj)[far].any()
    bpy.ops.object.mode_set(mode=mode)


def test_the_connected_part(obj, mode):
    bpy.ops.meshfree.select_component()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert (selected(obj) == (local_points(obj)[:, 0] < 2.0)).all()
    bpy.ops.object.mode_set(mode=mode)


def test_front_only(obj):
    choose(obj, lambda points: np.abs(points[:, 0]) < 0.2)
    bpy.ops.meshfree.select_front(direction=(0.0, 0.0, -1.0))
    points = local_points(obj)
    sure = np.abs(points[:, 2]) > 0.2
    assert (selected(obj) == (np.abs(points[:, 0]) < 0.2) & (points[:, 2] > 0.0))[sure].all()


def test_front_only_without_a_view_says_so(obj):
    with pytest.raises(RuntimeError, match="no 3D viewport.*Give a viewing direction"):
        bpy.ops.meshfree.select_front()


@pytest.mark.parametrize(("action", "count"), [("REPLACE", "new"), ("ADD", "both"), ("REMOVE", "rest")])
def test_what_the_group_held_before(obj, action, count):
    bpy.ops.meshfree.group_from_selection(role="SOURCE")
    old = selected(obj)
    choose(obj, lambda points: points[:, 2] > 0.98)
    new = selected(obj) | (local_points(obj)[:, 2] < -0.98)
    obj.data.vertices.foreach_set("select", new)
    bpy.ops.meshfree.group_from_selection(role="SOURCE", action=action, weight=0.5)
    expected = {"new": new, "both": old | new, "rest": old & ~new}[count]
    assert (in_group(obj, "Source") == expected).all()


def test_nothing_selected(obj):
    obj.data.vertices.foreach_set("select", np.zeros(1200, dtype=bool))
    with pytest.raises(RuntimeError, match="No points.*are selected"):
        bpy.ops.meshfree.group_from_selection(role="HANDLE")
    assert len(obj.vertex_groups) == 0


def test_an_attribute_of_that_name(obj):
    obj.data.attributes.new("Handle", "FLOAT", "POINT")
    with pytest.raises(RuntimeError, match='attribute named "Handle".*share'):
        bpy.ops.meshfree.group_from_selection(role="HANDLE")
