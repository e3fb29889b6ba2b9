"""Smooth Weights: in all modes, on groups of all kinds, and on point clouds."""

from math import erf

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.blender.armatures import add_armature, weights_of
from tests.blender.clouds import add_group, add_object, differences, everything, grid_points
from tests.blender.conftest import part
from tests.blender.operators import refused
from tests.blender.splats import add_splats, bar_splats
from tests.blender.test_pointcloud import add_pointcloud

COLUMNS, ROWS = 48, 20
POINTS, _ = grid_points(COLUMNS, ROWS, jitter=0.0)
FLAT = np.arange(COLUMNS * ROWS).reshape(ROWS, COLUMNS)
X = POINTS[:, 0] - 2.35
LENGTH = 0.6


def step(x):
    """A step at zero after heat has flown over the length."""
    return 0.5 + 0.5 * np.vectorize(erf)(x / LENGTH)


SOFT = step(X)


def strip(faces=(), bones=("left", "right")):
    """A flat strip whose halves follow one of two bones each."""
    obj = add_object(POINTS, faces=faces)
    add_group(obj, "mask", X > 1.0)
    for name, members in zip(bones, (X < 0.0, X > 0.0), strict=True):
        add_group(obj, name, members)
    obj.select_set(True)
    return obj


def rigged(obj):
    armature = add_armature(
        {name: ((0.0, 0.0, 0.1 * k), (1.0, 0.0, 0.1 * k)) for k, name in enumerate(("left", "right"))}
    )
    obj.modifiers.new("Armature", "ARMATURE").object = armature
    bpy.context.view_layer.objects.active = obj
    return obj


@pytest.fixture
def obj():
    return rigged(strip())


def select(obj, chosen):
    obj.data.vertices.foreach_set("select", chosen)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT", "WEIGHT_PAINT"])
def test_a_step_becomes_that_of_heat_in_every_mode(obj, mode):
    bpy.ops.object.mode_set(mode=mode)
    assert bpy.ops.meshfree.smooth_weights(length=LENGTH, least=0.0) == {"FINISHED"}
    assert obj.mode == mode
    bpy.ops.object.mode_set(mode="OBJECT")
    assert [group.name for group in obj.vertex_groups] == ["mask", "left", "right"]
    weights = weights_of(obj)
    assert_allclose(weights[:, 2], SOFT, atol=0.015)
    assert_allclose(weights[:, 1:].sum(axis=1), 1.0, atol=2e-6)
    assert_array_equal(weights[:, 0], X > 1.0)  # no bone is called so


def test_lengths_are_those_of_the_world(obj):
    obj.scale = (10.0, 10.0, 10.0)
    bpy.ops.meshfree.smooth_weights(length=10.0 * LENGTH, least=0.0)
    assert_allclose(weights_of(obj)[:, 2], SOFT, atol=0.015)


def test_only_selected_points_change(obj):
    chosen = np.abs(X) < 0.5
    select(obj, chosen)
    bpy.ops.meshfree.smooth_weights(length=LENGTH, points="SELECTED")
    weights = weights_of(obj)[:, 2]
    assert_array_equal(weights[~chosen], X[~chosen] > 0.0)
    assert np.abs(weights[chosen] - (X[chosen] > 0.0)).max() > 0.3


def test_only_points_of_a_group_change(obj):
    add_group(obj, "here", X < 0.5)
    bpy.ops.meshfree.smooth_weights(length=LENGTH, group="here")
    weights = weights_of(obj)[:, 2]
    assert_array_equal(weights[X >= 0.5], 1.0)
    assert weights[(X < 0.0) & (X > -0.2)].min() > 0.1


def test_locked_groups_stay_and_are_told(obj):
    third = obj.vertex_groups.new(name="third")
    for row, group in enumerate(obj.vertex_groups):
        if row:
            group.add(range(len(POINTS)), 0.0, "REPLACE")
    third.add(range(len(POINTS)), 0.25, "REPLACE")
    obj.vertex_groups["left"].add(np.flatnonzero(X < 0.0).tolist(), 0.75, "REPLACE")
    obj.vertex_groups["right"].add(np.flatnonzero(X > 0.0).tolist(), 0.75, "REPLACE")
    third.lock_weight = True
    obj.modifiers[0].object = None
    obj.vertex_groups.remove(obj.vertex_groups["mask"])
    bpy.ops.meshfree.smooth_weights(length=LENGTH, least=0.0)
    weights = weights_of(obj)
    assert_array_equal(weights[:, 2], 0.25)
    assert_allclose(weights[:, 1], 0.75 * SOFT, atol=0.012)
    assert [notice.text for notice in obj.meshfree.notices] == ["Locked vertex groups, left as they are: third."]


def test_the_active_group_alone_and_the_others_make_room(obj):
    obj.vertex_groups.active = obj.vertex_groups["right"]
    bpy.ops.meshfree.smooth_weights(groups="ACTIVE", length=LENGTH, least=0.0)
    weights = weights_of(obj)
    assert_allclose(weights[X < 0.0, 2], SOFT[X < 0.0], atol=0.015)
    assert_allclose(weights[:, 1:].sum(axis=1), 1.0, atol=2e-6)


def test_a_mask_is_smoothed_by_itself_and_fills_nothing(obj):
    obj.vertex_groups.active = obj.vertex_groups["mask"]
    bones = weights_of(obj)[:, 1:]
    bpy.ops.meshfree.smooth_weights(groups="ACTIVE", length=LENGTH, least=0.0)
    weights = weights_of(obj)
    assert_allclose(weights[:, 0], step(X - 1.0), atol=0.05)
    assert_array_equal(weights[:, 1:], bones)


def test_empty_points_are_filled_and_told(obj):
    empty = np.flatnonzero(X < -1.8).tolist()
    obj.vertex_groups["left"].remove(empty)
    bpy.ops.meshfree.smooth_weights(smooth=False)
    assert_allclose(weights_of(obj)[empty, 1], 1.0, atol=1e-6)
    assert f"filled from around: {len(empty)}" in obj.meshfree.notices[0].text


def test_few_influences(obj):
    bpy.ops.meshfree.smooth_weights(length=LENGTH, influences=1)
    assert_array_equal(weights_of(obj)[:, 1:], np.column_stack([X < 0.0, X > 0.0]))


@pytest.mark.parametrize("across", [False, True])
def test_loose_parts_that_touch(across):
    quads = [
        (FLAT[r, c], FLAT[r, c + 1], FLAT[r + 1, c + 1], FLAT[r + 1, c])
        for r in range(ROWS - 1)
        for c in range(COLUMNS - 1)
        if c != COLUMNS // 2 - 1
    ]
    obj = rigged(strip([tuple(map(int, quad)) for quad in quads]))
    bpy.ops.meshfree.smooth_weights(length=LENGTH, least=0.0, across=across)
    assert_allclose(weights_of(obj)[:, 2], SOFT if across else X > 0.0, atol=0.015)


@pytest.mark.skipif(bpy.app.version < (4, 5, 0), reason="Blender makes no Point Cloud objects before 4.5")
def test_a_point_cloud():
    obj = add_pointcloud(POINTS)
    table = part("operators.rigging.weights")
    table.write_weights(obj, ["left", "right"], np.column_stack([X < 0.0, X > 0.0]).astype(float))
    bpy.ops.meshfree.smooth_weights(length=LENGTH, least=0.0)
    assert_allclose(table.read_weights(obj)[:, 1], SOFT, atol=0.015)
    with refused(obj, "no active group"):
        bpy.ops.meshfree.smooth_weights(groups="ACTIVE")


def test_splats_of_a_mesh(core):
    """They are no point cloud before Blender 4.5, and their weights are a table there, too."""
    rest = bar_splats(core)
    obj, height = add_splats(rest, as_mesh=True), rest.positions[:, 2] - np.median(rest.positions[:, 2])
    add_group(obj, "Handle", height > 0.0)
    table = part("operators.rigging.weights")
    table.write_weights(obj, ["left", "right"], np.column_stack([height < 0.0, height > 0.0]).astype(float))
    assert bpy.ops.meshfree.smooth_weights(length=LENGTH, least=0.0) == {"FINISHED"}
    assert_allclose(table.read_weights(obj)[:, 1], step(height), atol=0.03)
    with refused(obj, "no active group"):
        bpy.ops.meshfree.smooth_weights(groups="ACTIVE")


def test_undo_takes_it_back(obj):
    bpy.ops.ed.undo_push(message="Made")
    before = everything(obj)
    bpy.ops.meshfree.smooth_weights()
    bpy.ops.ed.undo_push(message="Smooth Weights")
    assert differences({0: everything(obj)}, {0: before})
    bpy.ops.ed.undo()
    assert not differences({0: everything(bpy.data.objects["Cloud"])}, {0: before})


def test_it_is_one_click_in_modes_with_a_selection(obj):
    choose = part("operators.rigging.painting").in_selecting_mode
    found = [choose(obj)]
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    found.append(choose(obj))
    obj.data.use_paint_mask_vertex = True
    found.append(choose(obj))
    bpy.ops.object.mode_set(mode="EDIT")
    found.append(choose(obj))
    bpy.ops.object.mode_set(mode="OBJECT")
    assert found == [False, False, True, True]


class TestRefused:
    def test_no_weights(self):
        obj = add_object(POINTS)
        with refused(obj, "no weights to smooth. Run Automatic Weights"):
            bpy.ops.meshfree.smooth_weights()

    def test_all_locked(self, obj):
        for group in obj.vertex_groups:
            group.lock_weight = True
        with refused(obj, "locked or empty. Unlock some"):
            bpy.ops.meshfree.smooth_weights()

    def test_the_active_one_locked(self, obj):
        obj.vertex_groups.active.lock_weight = True
        with refused(obj, "is locked. Unlock it first"):
            bpy.ops.meshfree.smooth_weights(groups="ACTIVE")

    def test_no_selected_point(self, obj):
        select(obj, np.zeros(len(POINTS), dtype=bool))
        with refused(obj, "are selected. Select some"):
            bpy.ops.meshfree.smooth_weights(points="SELECTED")

    def test_no_selected_point_in_the_group(self, obj):
        select(obj, X < 0.0)
        with refused(obj, 'No selected point of "Cloud" is in "mask"'):
            bpy.ops.meshfree.smooth_weights(points="SELECTED", group="mask")

    def test_an_unknown_group(self, obj):
        with refused(obj, 'no vertex group named "nobody". Choose another Within Group'):
            bpy.ops.meshfree.smooth_weights(group="nobody")
