"""Shapes smoothed by frequency and moved by modes: as core says, where the user asked for, undone as one step."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, grid_points, local_points, sphere_points
from tests.blender.operators import refused


def rough_sphere(count=1500, noise=0.03):
    directions = sphere_points(count)
    return directions * (1.0 + np.random.default_rng(1).normal(0.0, noise, (count, 1)))


def key_points(obj, name):
    values = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.shape_keys.key_blocks[name].points.foreach_get("co", values)
    return values.reshape(-1, 3).astype(np.float64)


def shown_points(obj):
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    values = np.empty(3 * len(obj.data.vertices), np.float32)
    evaluated.to_mesh().vertices.foreach_get("co", values)
    return values.reshape(-1, 3).astype(np.float64)


def off_sphere(points):
    return np.sqrt(np.mean((np.linalg.norm(points, axis=1) - 1.0) ** 2))


def test_the_new_shape_key_is_the_active_one():
    obj = add_object(rough_sphere())
    for name in ("Smooth", "Smooth.001"):
        bpy.ops.meshfree.smooth()
        assert obj.active_shape_key.name == name
    bpy.ops.meshfree.mode_shape()
    assert obj.active_shape_key.name == "Mode 2"


@pytest.mark.parametrize("target", ["SHAPE_KEY", "IN_PLACE"])
def test_smoothing_is_that_of_core(core, target):
    obj = add_object(rough_sphere())
    before = local_points(obj)
    assert bpy.ops.meshfree.smooth(target=target) == {"FINISHED"}
    expected = core.clean.clean_points(core.build_laplacian(before))
    if target == "IN_PLACE":
        assert_allclose(local_points(obj), expected, atol=1e-6)
        assert obj.data.shape_keys is None
    else:
        assert_allclose(key_points(obj, "Smooth"), expected, atol=1e-6)
        assert_allclose(key_points(obj, "Basis"), before, atol=1e-6)
    assert off_sphere(shown_points(obj)) < 0.4 * off_sphere(before)


@pytest.mark.parametrize("method", ["EDGES", "NOISE", "HEAT", "MODES", "DETAIL"])
def test_every_method_does_something_of_its_own(method):
    obj = add_object(rough_sphere())
    before = local_points(obj)
    assert bpy.ops.meshfree.smooth(method=method, modes=16, keep="AREA", target="IN_PLACE") == {"FINISHED"}
    after = local_points(obj)
    assert np.isfinite(after).all()
    change = off_sphere(after) / off_sphere(before)
    assert change > 1.0 if method == "DETAIL" else change < 0.6


def test_smoothing_again_goes_on_from_what_is_seen():
    obj = add_object(rough_sphere())
    bpy.ops.meshfree.smooth()
    once = shown_points(obj)
    bpy.ops.meshfree.smooth()
    assert [block.name for block in obj.data.shape_keys.key_blocks] == ["Basis", "Smooth", "Smooth.001"]
    assert obj.active_shape_key.name == "Smooth.001"  # which Edit Mode shows, and its slider is at hand
    assert off_sphere(shown_points(obj)) < off_sphere(once)


def test_a_scaled_and_turned_object():
    points = rough_sphere()
    plain, turned = add_object(points), add_object(points * [0.5, 1.0, 0.25])
    turned.scale, turned.rotation_euler = (2.0, 1.0, 4.0), (0.3, 0.2, 0.1)
    for obj in (plain, turned):
        bpy.context.view_layer.objects.active = obj
        bpy.ops.meshfree.smooth(target="IN_PLACE")
    assert_allclose(local_points(turned) / [0.5, 1.0, 0.25], local_points(plain), atol=2e-5)


def test_a_group_masks():
    obj = add_object(rough_sphere())
    before = local_points(obj)
    upper = before[:, 2] > 0.0
    add_group(obj, "Upper", upper)
    bpy.ops.meshfree.smooth(group="Upper", target="IN_PLACE")
    moved = np.linalg.norm(local_points(obj) - before, axis=1)
    assert moved[~upper].max() == 0.0
    assert np.median(moved[upper]) > 0.005


def test_several_objects_in_one_run():
    objects = [add_object(rough_sphere(), name) for name in "ABC"]
    linked = bpy.data.objects.new("D", objects[0].data)
    bpy.context.scene.collection.objects.link(linked)
    before = local_points(objects[0])
    for obj in (*objects[:2], linked):
        obj.select_set(True)
    objects[2].select_set(False)
    bpy.context.view_layer.objects.active = objects[0]
    assert bpy.ops.meshfree.smooth(target="IN_PLACE") == {"FINISHED"}
    for obj, smoothed in zip(objects, (True, True, False), strict=True):
        assert (np.abs(local_points(obj) - before).max() > 1e-3) == smoothed


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"group": "Nowhere"}, 'no vertex group named "Nowhere"'),
        ({"method": "MODES", "modes": 900}, "modes were asked for"),
        ({"wavelength": 1e6}, 'wavelength 1e.06 is longer than "Cloud" is large'),
    ],
)
def test_errors_leave_everything_as_it_was(settings, text):
    obj = add_object(rough_sphere())
    with refused(obj, text):
        bpy.ops.meshfree.smooth(**settings)


def test_an_error_in_one_object_leaves_all_others():
    good, bad = add_object(rough_sphere(), "Good"), add_object(np.eye(3), "Bad")
    for obj in (good, bad):
        obj.select_set(True)
    bpy.context.view_layer.objects.active = good
    with refused(good, "points"):
        bpy.ops.meshfree.smooth()


def test_a_boundary_that_stays_fixes_the_size():
    obj = add_object(grid_points()[0])
    with refused(obj, '"Cloud": There is a boundary.*Set Keep to Nothing, or turn off Keep Boundary'):
        bpy.ops.meshfree.smooth(keep="AREA")
    assert bpy.ops.meshfree.smooth(keep="AREA", keep_boundary=False) == {"FINISHED"}


def test_in_place_is_refused_where_shape_keys_would_hide_it():
    obj = add_object(rough_sphere())
    obj.shape_key_add(name="Basis")
    with pytest.raises(RuntimeError, match="has shape keys.*Choose Shape Key"):
        bpy.ops.meshfree.smooth(target="IN_PLACE")


def test_a_mode_moves_along_the_normals():
    obj = add_object(sphere_points(1500))
    before = local_points(obj)
    bpy.ops.meshfree.mode_shape(mode=3, amplitude=0.2, target="IN_PLACE")
    moved = local_points(obj) - before
    assert np.linalg.norm(moved, axis=1).max() == pytest.approx(0.2, rel=1e-4)
    assert np.abs(np.cross(moved, before)).max() < 0.02


def test_an_animated_mode_swings():
    obj = add_object(sphere_points(1500))
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, 49
    bpy.ops.meshfree.mode_shape(mode=2, amplitude=0.3, animate=True, period=24)
    key = obj.data.shape_keys.key_blocks["Mode 2"]
    values = []
    for frame in (1, 7, 13, 19, 25, 49):
        scene.frame_set(frame)
        values.append(key.value)
    assert_allclose(values, [1.0, 0.0, -1.0, 0.0, 1.0, 1.0], atol=1e-6)
