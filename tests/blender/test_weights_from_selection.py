"""Weights from Selection: groups that fall off along the surface, or blend between two ends."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.blender.armatures import weights_of
from tests.blender.clouds import (
    add_group,
    add_object,
    attribute,
    differences,
    everything,
    grid_points,
    local_points,
    sphere_points,
)
from tests.blender.conftest import part
from tests.blender.operators import refused
from tests.blender.test_pointcloud import add_pointcloud

SHAPES = {  # of what is left of the radius
    "SMOOTH": lambda left: left**2 * (3.0 - 2.0 * left),
    "SPHERE": lambda left: np.sqrt(left * (2.0 - left)),
    "ROOT": np.sqrt,
    "INVERSE_SQUARE": lambda left: left * (2.0 - left),
    "SHARP": lambda left: left**2,
    "LINEAR": lambda left: left,
    "CONSTANT": lambda left: 1.0 * (left > 0.0),
}


@pytest.fixture
def ball():
    """A sphere with its uppermost point selected."""
    obj = add_object(sphere_points(1500))
    z = local_points(obj)[:, 2]
    select(obj, z == z.max())
    obj.select_set(True)
    return obj


@pytest.fixture
def strip():
    points, _ = grid_points(60, 20, jitter=0.0)
    obj = add_object(points)
    select(obj, points[:, 0] < 0.05)
    return obj


def select(obj, chosen):
    obj.data.vertices.foreach_set("select", chosen)


def group(obj, name="Falloff"):
    return weights_of(obj)[:, obj.vertex_groups[name].index]


def angle(obj):
    points = local_points(obj)
    return np.arccos(np.clip(points @ points[points[:, 2].argmax()], -1.0, 1.0))


@pytest.mark.parametrize("shape", SHAPES)
def test_falloff_by_the_angle_on_a_sphere(ball, shape):
    bpy.ops.meshfree.weights_from_selection(radius=2.0, falloff=shape)
    away, expected = angle(ball), SHAPES[shape](np.maximum(1.0 - angle(ball) / 2.0, 0.0))
    clear = np.abs(away - 2.0) > 0.06  # a root is steep at its end
    assert_allclose(group(ball)[clear], expected[clear], atol=0.02)
    assert ball.vertex_groups.active.name == "Falloff"
    assert part("ui.display").shown_attribute(ball) == "lb_weight"
    assert_allclose(attribute(ball, "lb_weight"), group(ball), atol=1e-6)


def test_the_blend_between_two_ends_of_a_strip_is_linear(strip):
    x = local_points(strip)[:, 0]
    add_group(strip, "Low", x > 5.85)
    bpy.ops.meshfree.weights_from_selection(method="BETWEEN", name="Blend")
    assert_allclose(group(strip, "Blend"), 1.0 - x / 5.9, atol=0.01)


def test_between_two_groups(strip):
    x = local_points(strip)[:, 0]
    add_group(strip, "Head", x > 5.85)
    add_group(strip, "Foot", x < 0.05)
    select(strip, np.zeros(len(x), dtype=bool))
    bpy.ops.meshfree.weights_from_selection(method="BETWEEN", group="Head", zero_group="Foot")
    assert_allclose(group(strip), x / 5.9, atol=0.01)


@pytest.mark.parametrize("mode", ["EDIT", "WEIGHT_PAINT"])
def test_in_other_modes(ball, mode):
    if mode == "EDIT":
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_mode(type="VERT")
    else:
        bpy.ops.object.mode_set(mode=mode)
    bpy.ops.meshfree.weights_from_selection(radius=1.0, falloff="LINEAR")
    assert ball.mode == mode
    bpy.ops.object.mode_set(mode="OBJECT")
    assert_allclose(group(ball), np.maximum(1.0 - angle(ball), 0.0), atol=0.02)


def test_lengths_are_those_of_the_world(ball):
    ball.scale = (3.0, 3.0, 3.0)
    bpy.ops.meshfree.weights_from_selection(radius=3.0, falloff="LINEAR")
    assert_allclose(group(ball), np.maximum(1.0 - angle(ball), 0.0), atol=0.02)


@pytest.mark.parametrize(
    ("action", "expected"),
    [
        ("REPLACE", lambda old, new: new),
        ("ADD", lambda old, new: np.minimum(old + new, 1.0)),
        ("MIX", lambda old, new: 0.75 * old + 0.25 * new),
    ],
)
def test_what_is_done_with_a_group_that_is_there(ball, action, expected):
    old = 0.5 * (local_points(ball)[:, 2] > -0.5)
    add_group(ball, "Before", range(3))
    add_group(ball, "Falloff", old > 0.0, weight=0.5)
    add_group(ball, "After", range(3))
    bpy.ops.meshfree.weights_from_selection(radius=2.0, falloff="LINEAR", action=action, factor=0.25)
    new = np.maximum(1.0 - angle(ball) / 2.0, 0.0)
    assert_allclose(group(ball), expected(old, new), atol=0.02)
    assert [item.name for item in ball.vertex_groups] == ["Before", "Falloff", "After"]


@pytest.mark.skipif(bpy.app.version < (4, 5, 0), reason="Blender makes no Point Cloud objects before 4.5")
def test_a_point_cloud():
    points = sphere_points(1500)
    obj = add_pointcloud(points)
    top = points[:, 2] == points[:, 2].max()
    obj.data.attributes.new("Top", "BOOLEAN", "POINT").data.foreach_set("value", top)
    bpy.ops.meshfree.weights_from_selection(group="Top", radius=2.0, falloff="LINEAR", name="Soft")
    expected = np.maximum(1.0 - np.arccos(np.clip(points @ points[top][0], -1.0, 1.0)) / 2.0, 0.0)
    assert_allclose(attribute(obj, "Soft"), expected, atol=0.02)


def test_what_no_selected_point_reaches_is_told():
    points = sphere_points(900)
    obj = add_object(np.concatenate([points, points[:300] + [5.0, 0.0, 0.0]]))
    select(obj, np.arange(1200) == 0)
    bpy.ops.meshfree.weights_from_selection(radius=50.0)
    assert_array_equal(group(obj)[900:], 0.0)
    assert [notice.text for notice in obj.meshfree.notices] == [
        "300 points are reached by no source. Their weight is 0."
    ]


def test_undo_takes_it_back(ball):
    bpy.ops.ed.undo_push(message="Made")
    before = everything(ball)
    bpy.ops.meshfree.weights_from_selection()
    bpy.ops.ed.undo_push(message="Weights from Selection")
    assert differences({0: everything(ball)}, {0: before})
    bpy.ops.ed.undo()
    assert not differences({0: everything(bpy.data.objects["Cloud"])}, {0: before})


class TestRefused:
    def test_nothing_selected(self, ball):
        select(ball, np.zeros(1500, dtype=bool))
        with refused(ball, "are selected. Select some"):
            bpy.ops.meshfree.weights_from_selection()

    def test_no_name(self, ball):
        with refused(ball, "The group has no name"):
            bpy.ops.meshfree.weights_from_selection(name="")

    def test_a_locked_group(self, ball):
        add_group(ball, "Falloff", [0]).lock_weight = True
        with refused(ball, 'The vertex group "Falloff" of "Cloud" is locked'):
            bpy.ops.meshfree.weights_from_selection()

    def test_an_attribute_of_that_name(self, ball):
        ball.data.attributes.new("Falloff", "FLOAT", "POINT")
        with refused(ball, 'has an attribute named "Falloff"'):
            bpy.ops.meshfree.weights_from_selection()

    def test_no_other_end(self, ball):
        with refused(ball, 'no vertex group named "Low". Choose another To Group'):
            bpy.ops.meshfree.weights_from_selection(method="BETWEEN")

    def test_points_at_both_ends(self, ball):
        add_group(ball, "Low", range(1500))
        with refused(ball, '1 points of "Cloud" are at both ends'):
            bpy.ops.meshfree.weights_from_selection(method="BETWEEN")
