"""Attributes transferred as a user does it: numbers, vectors, labels and colors, between clouds and meshes."""

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_group, add_object, attribute, everything, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import refused
from tests.blender.test_pointcloud import add_pointcloud
from tests.blender.test_transfer_weights import choose, positions


def put(obj, name, data_type, values):
    part("operators.objects.attributes").write_attribute(obj.data, name, values, data_type)


def colors_of(obj, name):
    values = np.empty((len(obj.data.attributes[name].data), 4), np.float32)
    obj.data.attributes[name].data.foreach_get("color", values.reshape(-1))
    return values


@pytest.fixture
def pair():
    """A sphere with attributes, the active object, and another sample of it."""
    source = add_object(sphere_points(900), "Source")
    points = positions(source)
    put(source, "Height", "FLOAT", points[:, 2])
    put(source, "Out", "FLOAT_VECTOR", points)
    put(source, "Side", "BOOLEAN", points[:, 0] > 0.0)
    put(source, "Part", "INT", np.where(points[:, 2] > 0.0, 7, -3))
    put(source, "lb_field", "FLOAT", points[:, 1])
    put(source, "Color", "FLOAT_COLOR", np.column_stack([0.5 + 0.5 * points, np.ones(900)]))
    target = add_object(sphere_points(500, seed=5), "Target")
    choose(source, target)
    return source, target


def test_numbers_vectors_colors_and_labels(pair, extension):
    _, target = pair
    assert bpy.ops.meshfree.transfer_attributes() == {"FINISHED"}
    points = positions(target)
    assert np.abs(attribute(target, "Height") - points[:, 2]).max() < 0.02
    assert np.abs(attribute(target, "Out") - points).max() < 0.02
    assert np.abs(colors_of(target, "Color")[:, :3] - 0.5 - 0.5 * points).max() < 0.02
    for axis, name, values in ((0, "Side", (False, True)), (2, "Part", (-3, 7))):
        sure = np.abs(points[:, axis]) > 0.15
        found = attribute(target, name)
        assert np.array_equal(found[sure], np.where(points[:, axis] > 0.0, values[1], values[0])[sure])
        assert set(found.tolist()) == set(values)
    assert "lb_field" not in target.data.attributes
    assert extension.ui.display.shown_attribute(target) == "Height"


def test_vectors_keep_their_direction_in_space(pair):
    """A vector from the middle to the surface does, wherever both spheres are turned."""
    source, target = pair
    for turn in ((0.4, 0.3, 0.2), (0.0, 0.0, 0.0)):
        source.rotation_euler, target.rotation_euler = turn, (1.0, 0.0, 0.5)
        bpy.ops.meshfree.transfer_attributes(attributes="NAMES", pattern="Out")
        assert np.abs(attribute(target, "Out") - positions(target)).max() < 0.05  # between points up to 0.3 apart


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"attributes": "COLOR"}, {"Color"}),
        ({"attributes": "NAMES", "pattern": "*i*"}, {"Height", "Side", "lb_field"}),
        ({"attributes": "NAMES", "pattern": "lb_*"}, {"lb_field"}),
    ],
)
def test_chosen_attributes(pair, settings, expected):
    _, target = pair
    before = set(target.data.attributes.keys())
    bpy.ops.meshfree.transfer_attributes(**settings, show=False)
    assert set(target.data.attributes.keys()) - before - {"lb_transfer"} == expected


def test_colors_at_corners_of_faces(pair):
    """Vertex paint lies at corners; points take their means."""
    faces = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    cube = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    painted = add_object(cube, "Painted", faces)
    modifier = painted.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = 4
    choose(painted)
    bpy.ops.object.modifier_apply(modifier=modifier.name)
    layer = painted.data.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    owner = np.array([loop.vertex_index for loop in painted.data.loops])
    points = positions(painted)
    values = np.column_stack([(points[owner, 2] > 0.0)[:, None].repeat(3, axis=1), np.ones(len(owner))])
    layer.data.foreach_set("color", values.astype(np.float32).reshape(-1))
    scan = add_object(points[::2] * 1.01, "Scan")
    choose(painted, scan)
    bpy.ops.meshfree.transfer_attributes(attributes="COLOR")
    found, height = colors_of(scan, "Paint"), positions(scan)[:, 2]
    assert np.allclose(found[height > 0.2], 1.0, atol=0.02)
    assert np.allclose(found[height < -0.2, :3], 0.0, atol=0.02)


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="objects become point clouds from Blender 4.5 on")
def test_from_mesh_to_cloud_and_back(pair):
    source, target = pair
    cloud = add_pointcloud(sphere_points(700, seed=3))
    choose(source, cloud)
    bpy.ops.meshfree.transfer_attributes()
    assert np.abs(attribute(cloud, "Height") - positions(cloud)[:, 2]).max() < 0.02
    choose(cloud, target)
    bpy.ops.meshfree.transfer_attributes(attributes="NAMES", pattern="Height")
    assert np.abs(attribute(target, "Height") - positions(target)[:, 2]).max() < 0.03


def test_what_is_left_out_is_told(pair, capfd):
    source, target = pair
    values = np.zeros(900)
    values[0] = np.nan
    put(source, "Broken", "FLOAT", values)
    bpy.ops.meshfree.transfer_attributes()
    assert "Broken" not in target.data.attributes
    assert "not of one type in all sources: Broken" in capfd.readouterr().out


def test_preview_writes_colors_alone(pair):
    _, target = pair
    before = set(target.data.attributes.keys())
    bpy.ops.meshfree.transfer_attributes(preview=True)
    added = {name for name in target.data.attributes.keys() if not name.startswith(".")} - before
    assert "lb_transfer" in added
    assert not added & {"Height", "Out", "Side", "Part", "Color"}


def test_one_undo_step(pair):
    before = everything(pair[1])
    bpy.ops.ed.undo_push(message="Before")
    assert bpy.ops.meshfree.transfer_attributes("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.ops.ed.undo()
    assert everything(bpy.data.objects["Target"]) == before


def test_names_of_vertex_groups_are_refused(pair):
    _, target = pair
    add_group(target, "Height", [0, 1])
    with refused(target, "vertex groups named Height"):
        bpy.ops.meshfree.transfer_attributes()


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"attributes": "COLOR"}, "has no colors"),
        ({"attributes": "NAMES", "pattern": "x"}, 'match "x"'),
        ({}, "beside results"),
    ],
)
def test_nothing_to_transfer_is_refused(pair, settings, text):
    source, target = pair
    choose(target, source)
    with refused(source, text):
        bpy.ops.meshfree.transfer_attributes(**settings)
