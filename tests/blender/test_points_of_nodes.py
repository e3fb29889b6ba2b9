"""Points that Geometry Nodes make beside or instead of a mesh: converted, and taken by Use Modifiers."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, everything, local_points, sphere_points

CONVERTS = pytest.mark.skipif(bpy.app.version < (4, 5), reason="objects become point clouds from Blender 4.5 on")
OWN = 400  # vertices of the object
STEP = 0.5  # from its vertices to the points that its nodes make


def add_nodes(obj, *parts):
    """Give an object nodes that show some of: its "vertices", "points" at them, "cubes" at these, or "nothing"."""
    group = bpy.data.node_groups.new("Points", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")

    def add(kind, *inputs):
        node = group.nodes.new(kind)
        for socket, given in zip(node.inputs, inputs, strict=False):
            group.links.new(given, socket)
        return node.outputs[0] if node.outputs else None

    mesh = add("NodeGroupInput")
    move = group.nodes.new("GeometryNodeTransform")
    move.inputs["Translation"].default_value = (0.0, 0.0, STEP)
    group.links.new(add("GeometryNodeMeshToPoints", mesh), move.inputs[0])
    points = move.outputs[0]
    place = group.nodes.new("GeometryNodeInstanceOnPoints")
    group.links.new(points, place.inputs["Points"])
    group.links.new(add("GeometryNodeMeshCube"), place.inputs["Instance"])
    shown = {"vertices": mesh, "points": points, "cubes": place.outputs[0]}
    both = group.nodes.new("GeometryNodeJoinGeometry")
    for part in reversed(parts):
        if part in shown:
            group.links.new(shown[part], both.inputs[0])
    add("NodeGroupOutput", both.outputs[0])
    obj.modifiers.new("Points", "NODES").node_group = group
    bpy.context.view_layer.update()


@pytest.fixture
def obj():
    obj = add_object(sphere_points(OWN))
    obj.location, obj.rotation_euler = (1.0, 2.0, 3.0), (0.3, 0.2, 0.1)
    bpy.context.view_layer.update()
    layer = obj.data.attributes.new("height", "FLOAT", "POINT")
    layer.data.foreach_set("value", local_points(obj)[:, 2].copy())
    return obj


def told(capfd):
    return next(line for line in capfd.readouterr().out.splitlines() if "now" in line)


@CONVERTS
class TestConverting:
    def test_points_take_the_place_of_the_mesh(self, obj, capfd):
        points, matrix = local_points(obj), obj.matrix_world.copy()
        add_nodes(obj, "points")
        assert bpy.ops.meshfree.convert() == {"FINISHED"}
        obj = bpy.context.object
        assert obj.type == "POINTCLOUD"
        assert_allclose(local_points(obj), points + (0.0, 0.0, STEP), atol=1e-6)
        assert_allclose(attribute(obj, "height"), points[:, 2], atol=1e-6)
        assert obj.matrix_world == matrix
        assert list(obj.modifiers) == []
        assert [
            group.name for group in bpy.data.node_groups if group.users == 0 and group.name.startswith("Points.")
        ] == []
        assert told(capfd).endswith("400 points are a pointcloud now: 400 points")
        bpy.ops.meshfree.analyze()
        assert obj.meshfree.total_area == pytest.approx(4.0 * np.pi, rel=0.03)

    def test_vertices_beside_points_are_kept(self, obj, capfd):
        points = local_points(obj)
        add_nodes(obj, "vertices", "points")
        bpy.ops.meshfree.convert()
        found = local_points(bpy.context.object)
        assert_allclose(found, np.concatenate([points, points + (0.0, 0.0, STEP)]), atol=1e-6)
        assert told(capfd).endswith("800 points are a pointcloud now: 400 vertices and 400 points")

    @pytest.mark.parametrize("own", ["vertices", "points"])
    def test_instances_at_points_are_left_out(self, obj, own, capfd):
        add_nodes(obj, own, "cubes")
        bpy.ops.meshfree.convert()
        assert len(bpy.context.object.data.points) == OWN
        assert "3,200 points of instances are left out" in told(capfd)

    def test_instances_alone_are_made_real(self, obj, capfd):
        points = local_points(obj)
        add_nodes(obj, "cubes")
        bpy.ops.meshfree.convert()
        found = local_points(bpy.context.object).reshape(OWN, 8, 3)
        assert_allclose(found.mean(axis=1), points + (0.0, 0.0, STEP), atol=1e-5)
        assert_allclose(np.abs(found - found.mean(axis=1, keepdims=True)), 0.5, atol=1e-5)
        assert told(capfd).endswith("3,200 points of instances")

    def test_the_display_is_not_taken_for_them(self, obj):
        bpy.ops.meshfree.analyze()
        add_nodes(obj, "points")
        bpy.ops.meshfree.convert()
        assert len(bpy.context.object.data.points) == OWN

    def test_an_object_that_shows_no_points_stays_as_it_is(self, obj):
        add_nodes(obj, "nothing")
        before = everything(obj)
        with pytest.raises(RuntimeError, match='"Cloud" show no points. Remove or change them'):
            bpy.ops.meshfree.convert()
        assert everything(bpy.context.object) == before

    def test_vertices_that_nodes_of_a_point_cloud_make_become_a_mesh(self, obj):
        points = local_points(obj)
        bpy.ops.meshfree.convert()
        obj, group = bpy.context.object, bpy.data.node_groups.new("Mesh", "GeometryNodeTree")
        for direction in ("INPUT", "OUTPUT"):
            group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
        kinds = "NodeGroupInput", "GeometryNodePointsToVertices", "NodeGroupOutput"
        given, turn, result = (group.nodes.new(kind) for kind in kinds)
        group.links.new(given.outputs[0], turn.inputs[0])
        group.links.new(turn.outputs[0], result.inputs[0])
        obj.modifiers.new("Mesh", "NODES").node_group = group
        bpy.ops.meshfree.convert(target="MESH")
        assert bpy.context.object.type == "MESH"
        assert_allclose(local_points(bpy.context.object), points, atol=1e-6)

    def test_one_undo_step(self, obj):
        add_nodes(obj, "points")
        name, before = obj.name, everything(obj)
        bpy.ops.ed.undo_push(message="Before")
        bpy.ops.meshfree.convert("EXEC_DEFAULT", True)
        bpy.ops.ed.undo()
        assert everything(bpy.data.objects[name]) == before


class TestUseModifiers:
    def test_as_many_points_as_vertices_are_taken(self, extension, obj):
        points = local_points(obj)
        add_nodes(obj, "points")
        obj.meshfree.use_modifiers = True
        reading = extension.operators.objects.reading.read_points(bpy.context, obj)
        assert_allclose(reading.local(reading.points), points + (0.0, 0.0, STEP), atol=1e-6)
        assert bpy.ops.meshfree.analyze() == {"FINISHED"}
        assert obj.meshfree.total_area == pytest.approx(4.0 * np.pi, rel=0.03)
        assert len(attribute(obj, "lb_area")) == OWN

    @pytest.mark.parametrize(
        ("parts", "reason"),
        [
            (("points", "points"), "to 800 points, for.* node Points to Vertices at the end of the nodes and apply"),
            (("cubes",), "to 3,200 points of instances, for.* node Realize Instances at the end of the nodes"),
            (("nothing",), "to 0, for which it holds no data. Apply these modifiers, or turn off Use Modifiers"),
        ],
    )
    def test_more_or_fewer_have_no_place_for_results(self, obj, parts, reason):
        add_nodes(obj, *parts)
        if parts == ("points", "points"):
            add_doubling(obj)
        obj.meshfree.use_modifiers = True
        before = everything(obj)
        with pytest.raises(RuntimeError, match=f'The modifiers of "Cloud" change its 400 points {reason}') as raised:
            bpy.ops.meshfree.analyze()
        assert everything(obj) == before
        offered = bpy.app.version >= (4, 5) and "nothing" not in parts
        assert ("Press Convert to Point Cloud" in str(raised.value)) == offered


def test_an_object_without_vertices_of_its_own_is_told_what_to_do():
    add_nodes(add_object(np.empty((0, 3))), "points")
    with pytest.raises(
        RuntimeError, match="no vertices but those that its nodes make. Put the node Points to Vertices"
    ):
        bpy.ops.meshfree.analyze()


def add_doubling(obj):
    """Let an object show twice the points that it shows."""
    group = bpy.data.node_groups.new("Twice", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    given, both = group.nodes.new("NodeGroupInput"), group.nodes.new("GeometryNodeJoinGeometry")
    for _ in range(2):
        move = group.nodes.new("GeometryNodeTransform")
        group.links.new(given.outputs[0], move.inputs[0])
        group.links.new(move.outputs[0], both.inputs[0])
    group.links.new(both.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    obj.modifiers.new("Twice", "NODES").node_group = group
    bpy.context.view_layer.update()
