"""What of an object is read: shape keys, modifiers, and never the extension's own display."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, everything, local_points, result_names, sphere_points
from tests.blender.operators import refused
from tests.results import RESULTS


def read(reading, obj):
    return reading.read_points(bpy.context, obj).points


def add_stretch(obj):
    """Add a shape key that doubles z."""
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Stretch")
    stretched = local_points(obj) * (1.0, 1.0, 2.0)
    key.points.foreach_set("co", stretched.astype(np.float32).reshape(-1))
    return key


@pytest.mark.parametrize("value", [0.0, 0.5, 1.0])
def test_shape_keys_are_read_as_seen(reading, value):
    obj = add_object(sphere_points())
    before = local_points(obj)
    add_stretch(obj).value = value
    assert_allclose(read(reading, obj), before * (1.0, 1.0, 1.0 + value), rtol=1e-6, atol=1e-7)


def test_shape_keys_are_read_with_our_display_on_the_stack(reading):
    obj = add_object(sphere_points())
    before = local_points(obj)
    key = add_stretch(obj)
    bpy.ops.meshfree.analyze()
    key.value = 1.0
    assert_allclose(read(reading, obj), before * (1.0, 1.0, 2.0), rtol=1e-6)
    assert [item.show_viewport for item in obj.modifiers] == [True]


def test_pinned_shape_key_is_read(reading):
    obj = add_object(sphere_points())
    before = local_points(obj)
    add_stretch(obj)
    obj.active_shape_key_index = 1
    obj.show_only_shape_key = True
    assert_allclose(read(reading, obj), before * (1.0, 1.0, 2.0), rtol=1e-6)


def test_shape_keys_are_kept_and_results_made(reading):
    obj = add_object(sphere_points())
    add_stretch(obj).value = 1.0
    keys = everything(obj)["keys"]
    bpy.ops.meshfree.analyze()
    assert everything(obj)["keys"] == keys
    assert result_names(obj) == RESULTS


def test_value_of_a_shape_key_changes_the_fingerprint(reading):
    obj = add_object(sphere_points())
    key = add_stretch(obj)
    before = reading.fingerprint(obj)
    key.value = 0.5
    assert reading.fingerprint(obj) != before


def test_modifiers_are_left_out_unless_asked_for(reading):
    obj = add_object(sphere_points())
    before = local_points(obj)
    modifier = obj.modifiers.new("Wide", "CAST")
    modifier.cast_type, modifier.factor, modifier.size, modifier.use_radius_as_size = "SPHERE", 1.0, 2.0, False
    modifier.radius = 0.0
    assert_allclose(read(reading, obj), before, rtol=0)
    obj.meshfree.use_modifiers = True
    assert_allclose(np.linalg.norm(read(reading, obj), axis=1), 2.0, rtol=1e-5)
    bpy.ops.meshfree.analyze()
    assert obj.meshfree.total_area == pytest.approx(16.0 * np.pi, rel=0.02)
    assert [item.name for item in obj.modifiers] == ["Wide", "Mesh-Free Display"]
    assert_allclose(np.linalg.norm(read(reading, obj), axis=1), 2.0, rtol=1e-5)
    assert all(item.show_viewport for item in obj.modifiers)


def test_modifier_that_changes_the_number_of_points_is_refused():
    obj = add_object(sphere_points())
    obj.modifiers.new("Array", "ARRAY")
    obj.meshfree.use_modifiers = True
    with refused(obj, r"change its 1000 points to 2000.*turn off Use Modifiers"):
        bpy.ops.meshfree.analyze()


def test_object_disabled_in_viewports_is_refused_where_it_matters():
    obj = add_object(sphere_points())
    add_stretch(obj)
    obj.hide_viewport = True
    with pytest.raises(RuntimeError, match="disabled in viewports"), bpy.context.temp_override(object=obj):
        bpy.ops.meshfree.analyze()


def test_normals_turn_back_as_covectors(reading):
    matrix = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 0.5], [0.3, 0.0, -2.0]])
    local = np.random.default_rng(0).normal(size=(5, 3))
    local /= np.linalg.norm(local, axis=1, keepdims=True)
    world = local @ np.linalg.inv(matrix)
    world /= np.linalg.norm(world, axis=1, keepdims=True)
    assert_allclose(reading.Reading(local, matrix).local_normals(world), local, atol=1e-12)


@pytest.mark.parametrize("count", [1, 8, 500])
def test_spacing_of_a_grid_is_its_step(reading, count):
    x, y = np.meshgrid(np.arange(count), np.arange(3 if count > 1 else 1))
    obj = add_object(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1) * 0.1)
    spacing = reading.spacing(obj.data)
    assert spacing == 0.0 if count == 1 else 0.05 < spacing < 0.2


def test_result_is_written_in_order_of_vertices(core):
    points = sphere_points()
    first = add_object(points)
    bpy.ops.meshfree.analyze()
    second = add_object(points[::-1])
    bpy.ops.meshfree.analyze()
    assert_allclose(attribute(second, "lb_area")[::-1], attribute(first, "lb_area"), rtol=1e-4)
