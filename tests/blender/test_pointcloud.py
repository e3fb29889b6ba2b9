"""PointCloud objects: the same results as on meshes, attributes as groups, points moved in place."""

import bpy
import numpy as np
import pytest

from tests.blender.clouds import attribute, everything, local_points, result_names
from tests.blender.test_application import SETTINGS, add_ready, run, wave
from tests.blender.test_display import display_points
from tests.blender.test_smooth import rough_sphere

pytestmark = pytest.mark.skipif(bpy.app.version < (4, 5), reason="objects become point clouds from Blender 4.5 on")

MOVING = ("smooth", "mode_shape", "minimal_surface")


def add_pointcloud(points, name="Points"):
    """Add an active, selected point cloud with attributes for all groups that operators take."""
    obj = add_ready(points, name)
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    groups = {
        group.name: [any(item.group == group.index for item in vertex.groups) for vertex in obj.data.vertices]
        for group in obj.vertex_groups
    }
    obj.vertex_groups.clear()
    assert bpy.ops.object.convert(target="POINTCLOUD") == {"FINISHED"}
    obj = bpy.context.object
    assert obj.type == "POINTCLOUD"
    for group, members in groups.items():
        add_truth(obj, group, members)
    add_truth(obj, ".selection", np.arange(len(points)) < 20)
    return obj


def add_truth(obj, name, values):
    layer = obj.data.attributes.get(name) or obj.data.attributes.new(name, "BOOLEAN", "POINT")
    layer.data.foreach_set("value", np.asarray(values, dtype=bool))


def as_mesh(points, name="Mesh"):
    obj = add_ready(points, name)
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    return obj


@pytest.mark.parametrize("name", ["analyze", "segment", "signature", "harmonic_field", "geodesic_distance"])
def test_attributes_are_those_of_the_same_points_as_a_mesh(name):
    settings = {**SETTINGS, "analyze": {"modes": 5}}[name]
    mesh = as_mesh(wave())
    assert run(name, **settings) == {"FINISHED"}
    cloud = add_pointcloud(wave())
    assert run(name, **settings) == {"FINISHED"}
    assert result_names(cloud) == result_names(mesh)
    for result in result_names(mesh):
        np.testing.assert_array_equal(attribute(cloud, result), attribute(mesh, result))
    if name == "segment":
        for label in range(3):
            np.testing.assert_array_equal(attribute(cloud, f"Segment {label}"), attribute(cloud, "lb_segment") == label)


@pytest.mark.parametrize("name", MOVING)
def test_points_are_moved_in_place(name):
    mesh = as_mesh(wave())
    assert run(name, **SETTINGS[name], target="IN_PLACE") == {"FINISHED"}
    cloud = add_pointcloud(wave())
    assert run(name, **SETTINGS[name]) == {"FINISHED"}  # with the default, a shape key
    assert np.abs(local_points(cloud) - wave()).max() > 1e-4
    np.testing.assert_array_equal(local_points(cloud), local_points(mesh))


@pytest.mark.parametrize("name", ["analyze", "segment", "separate_by_segment", "smooth", "geodesic_distance"])
def test_one_undo_step(name):
    cloud = add_pointcloud(wave())
    before = everything(cloud), local_points(cloud)
    bpy.ops.ed.undo_push(message="Before")
    assert run(name, "EXEC_DEFAULT", True, **SETTINGS.get(name, {})) == {"FINISHED"}
    bpy.ops.ed.undo()
    cloud = bpy.data.objects["Points"]
    assert (everything(cloud), local_points(cloud).tolist()) == (before[0], before[1].tolist())


def test_separated_parts_keep_their_points_and_attributes():
    points = rough_sphere(1000)
    cloud = add_pointcloud(points)
    labels = np.digitize(points[:, 0], [-0.2, 0.7])
    cloud.data.attributes["lb_segment"].data.foreach_set("value", labels.astype(np.int32))
    other = add_pointcloud(points[:100], "Bystander")
    cloud.select_set(True)
    other.select_set(False)
    bpy.context.view_layer.objects.active = cloud
    assert bpy.ops.meshfree.separate_by_segment() == {"FINISHED"}
    assert bpy.context.object == cloud
    assert cloud.mode == "OBJECT"
    largest = np.argmax(np.bincount(labels))
    kept = {cloud.name: largest}
    kept |= {f"Points Segment {label}": label for label in range(3) if label != largest}
    for name, label in kept.items():
        part = bpy.data.objects[name]
        assert part.type == "POINTCLOUD"
        np.testing.assert_allclose(local_points(part), points[labels == label], atol=1e-6)
        assert (attribute(part, "lb_segment") == label).all()
    assert len(other.data.points) == 100


def test_a_hidden_one_is_not_separated():
    cloud = add_pointcloud(rough_sphere(1000))
    cloud.hide_set(True)
    bpy.context.view_layer.objects.active = cloud
    with pytest.raises(RuntimeError, match='"Points" is hidden'):
        bpy.ops.meshfree.separate_by_segment()


def test_an_error_leaves_it_as_it_was():
    cloud = add_pointcloud(np.full((200, 3), 1.0))
    before = everything(cloud)
    for name in ("analyze", "smooth", "segment"):
        with pytest.raises(RuntimeError, match="The 200 points lie 1 from the origin but span only 0"):
            run(name)
        assert everything(cloud) == before


def test_what_needs_shape_keys_says_so():
    add_pointcloud(rough_sphere(1000))
    with pytest.raises(RuntimeError, match='"Points" is a Point Cloud, which has no shape keys'):
        bpy.ops.meshfree.mode_shape(animate=True)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_selected_points_become_an_attribute(mode):
    cloud = add_pointcloud(rough_sphere(1000))
    bpy.ops.object.mode_set(mode=mode)
    first = np.arange(1000) < 20
    assert bpy.ops.meshfree.group_from_selection(role="ANCHOR", name="Mine") == {"FINISHED"}
    assert cloud.mode == mode
    assert cloud.data.attributes["Mine"].data_type == "BOOLEAN"
    np.testing.assert_array_equal(attribute(cloud, "Mine"), first)
    add_truth(cloud, ".selection", np.arange(1000) < 10)
    bpy.ops.meshfree.group_from_selection(role="ANCHOR", name="Mine", action="REMOVE")
    np.testing.assert_array_equal(attribute(cloud, "Mine"), first & (np.arange(1000) >= 10))
    bpy.ops.meshfree.group_from_selection(role="ANCHOR", name="Mine", action="ADD", weight=0.5)
    assert cloud.data.attributes["Mine"].data_type == "FLOAT"
    np.testing.assert_array_equal(attribute(cloud, "Mine"), np.select([np.arange(1000) < 10, first], [0.5, 1.0], 0.0))
    bpy.ops.meshfree.group_from_selection(role="ANCHOR", name="Mine")
    np.testing.assert_array_equal(attribute(cloud, "Mine"), np.arange(1000) < 10)


def test_other_attributes_are_never_overwritten_by_groups():
    cloud = add_pointcloud(rough_sphere(1000))
    cloud.data.attributes.new("Taken", "FLOAT_VECTOR", "POINT")
    with pytest.raises(RuntimeError, match='attribute named "Taken", and it holds no weights'):
        bpy.ops.meshfree.group_from_selection(name="Taken")
    with pytest.raises(RuntimeError, match='no attribute named "None" to remove'):
        bpy.ops.meshfree.group_from_selection(name="None", action="REMOVE")


def test_selecting():
    cloud = add_pointcloud(rough_sphere(1000))
    points = local_points(cloud)
    bpy.ops.meshfree.select_front(direction=(0.0, 0.0, -1.0))
    front = attribute(cloud, ".selection")
    assert front.any()
    assert (points[front, 2] > -0.2).all()
    assert not front[20:].any()
    add_truth(cloud, ".selection", np.arange(1000) < 1)
    bpy.ops.meshfree.select_grow(distance=0.5)
    grown = attribute(cloud, ".selection")
    assert grown[0]
    near = np.linalg.norm(points - points[0], axis=1)
    assert grown[near < 0.35].all()
    assert not grown[near > 0.55].any()
    bpy.ops.meshfree.select_component()
    assert attribute(cloud, ".selection").all()


def test_without_a_selection_all_points_count_as_selected_as_in_blender():
    cloud = add_pointcloud(rough_sphere(1000))
    for name in (".selection", "Source"):
        cloud.data.attributes.remove(cloud.data.attributes[name])
    with pytest.raises(RuntimeError, match="All points of .* are sources"):
        bpy.ops.meshfree.geodesic_distance()


def test_a_missing_group_is_told():
    cloud = add_pointcloud(rough_sphere(1000))
    with pytest.raises(RuntimeError, match='"Points" has no attribute of truth values or numbers .* "Nothing"'):
        bpy.ops.meshfree.smooth(group="Nothing")
    add_truth(cloud, "Nothing", np.zeros(1000, dtype=bool))
    with pytest.raises(RuntimeError, match='attribute "Nothing" gives 0 of 1000 points'):
        bpy.ops.meshfree.smooth(group="Nothing")


def test_weights_of_a_converted_vertex_group_are_kept():
    obj = as_mesh(wave())
    cloud = add_pointcloud(wave())
    layer = cloud.data.attributes.new("Mask", "FLOAT", "POINT")
    weights = np.linspace(0.0, 1.0, len(wave())).astype(np.float32)
    layer.data.foreach_set("value", weights)
    group = obj.vertex_groups.new(name="Mask")
    for index, weight in enumerate(weights):
        group.add([index], float(weight), "REPLACE")
    bpy.ops.meshfree.smooth(group="Mask")
    obj.select_set(True)
    cloud.select_set(False)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.meshfree.smooth(group="Mask", target="IN_PLACE")
    np.testing.assert_array_equal(local_points(cloud), local_points(obj))
    assert np.abs(local_points(cloud) - wave()).max() > 1e-4


def test_results_go_stale_when_points_move(result):
    cloud = add_pointcloud(rough_sphere(1000))
    cloud.meshfree.boundary_group = ""
    bpy.ops.meshfree.analyze()
    assert cloud.meshfree.point_count == 1000
    assert not result.is_stale(cloud)
    cloud.data.points[0].co.x += 0.1
    assert result.is_stale(cloud)


def test_points_after_modifiers():
    cloud = add_pointcloud(rough_sphere(1000))
    group = bpy.data.node_groups.new("Stretch", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    nodes = [group.nodes.new(kind) for kind in ("NodeGroupInput", "GeometryNodeTransform", "NodeGroupOutput")]
    nodes[1].inputs["Scale"].default_value = (2.0, 2.0, 2.0)
    group.links.new(nodes[0].outputs[0], nodes[1].inputs[0])
    group.links.new(nodes[1].outputs[0], nodes[2].inputs[0])
    cloud.modifiers.new("Stretch", "NODES").node_group = group
    bpy.ops.meshfree.analyze()
    area = cloud.meshfree.total_area
    cloud.meshfree.use_modifiers = True
    bpy.ops.meshfree.analyze()
    assert cloud.meshfree.total_area == pytest.approx(4.0 * area, rel=1e-4)
    with pytest.raises(RuntimeError, match="after its modifiers"):
        bpy.ops.meshfree.smooth()


def test_it_shows_colors():
    cloud = add_pointcloud(rough_sphere(1000))
    cloud.meshfree.point_shape = "DOTS"
    bpy.ops.meshfree.analyze()
    ((count, names, radii, materials),) = display_points(cloud)
    assert count == 1000
    assert "lb_mean_curvature" in names
    spacing = np.sqrt(cloud.meshfree.total_area / 1000)
    assert (0.3 * spacing < radii).all()
    assert (radii < 1.5 * spacing).all()
    assert [material.name for material in materials] == [f"Mesh-Free Display {cloud.name}"]
