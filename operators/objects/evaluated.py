"""What modifiers make of an object: its points after them, be they vertices, points that nodes make, or instances."""

from contextlib import contextmanager
from typing import NamedTuple

import bpy

from ...core import PointCloudError
from .attributes import own_positions, point_count
from .modifiers import add_node, is_own

POINTCLOUDS_SINCE = (4, 5)  # version of Blender in which meshes become point clouds
_KINDS = ("MESH", "POINTCLOUD")
_COMPONENTS = {  # of geometry in nodes: one's own, the other, and what turns that into one's own
    "MESH": ("Mesh", "Point Cloud", "GeometryNodePointsToVertices"),
    "POINTCLOUD": ("Point Cloud", "Mesh", "GeometryNodeMeshToPoints"),
}
_NO_INSTANCE = 2**31 - 1  # in the place of a number that tells instances apart


class ShownPoints(NamedTuple):
    """How many points modifiers show of an object."""

    vertices: int
    points: int  # of a point cloud
    instances: int  # vertices and points of all of them

    def __str__(self):
        kinds = ("vertices", self.vertices), ("points", self.points), ("points of instances", self.instances)
        return " and ".join(f"{count:,} {kind}" for kind, count in kinds if count) or "no points"


def shown_points(context, obj):
    """Count the points that an object in sight shows as it is evaluated, `ShownPoints`."""
    counts = dict.fromkeys((*_KINDS, "INSTANCE"), 0)
    for part, is_instance in _parts(context.evaluated_depsgraph_get(), obj):
        counts["INSTANCE" if is_instance else part.type] += point_count(part.data)
    return ShownPoints(*counts.values())


def _parts(depsgraph, obj):
    """What an evaluated object shows, each with whether it is an instance; not to be kept from one to the next."""
    for item in depsgraph.object_instances:
        part = item.object
        if part.type not in _KINDS:
            continue
        if not item.is_instance and part.original == obj:
            yield part, False
        elif item.is_instance and item.parent.original == obj and obj.instance_type == "NONE":
            yield part, part.original != obj or item.persistent_id[1] != _NO_INSTANCE


def evaluated_positions(context, obj):
    """Positions after shape keys, and after the modifiers if the settings ask for them; never after our own.

    Nodes may turn the points into such of a point cloud beside the mesh, as many as there were.
    """
    count = point_count(obj.data)
    with _left_out([item for item in obj.modifiers if is_own(item) or not obj.meshfree.use_modifiers]):
        depsgraph = context.evaluated_depsgraph_get()
        evaluated = obj.evaluated_get(depsgraph)
        if not evaluated.is_evaluated:
            raise PointCloudError(
                f'"{obj.name}" is disabled in viewports, so its shape keys and modifiers are not computed.'
                " Enable it in the Outliner (monitor icon)."
            )
        if obj.type == "MESH":
            positions = own_positions(evaluated.to_mesh())
            evaluated.to_mesh_clear()
        else:
            positions = own_positions(evaluated.data)
        if len(positions) != count:
            parts = (part for part, is_instance in _parts(depsgraph, obj) if not is_instance)
            found = next((own_positions(part.data) for part in parts if point_count(part.data) == count), None)
            if found is None:
                raise PointCloudError(_no_place(obj, shown_points(context, obj), len(positions)))
            positions = found
    return positions


def _no_place(obj, shown, own):
    """Say that there are more or fewer points after the modifiers than before, and what to do."""
    by_nodes = obj.type == "MESH" and (shown.points or shown.instances)
    ways = _ways(shown) if by_nodes else ["Apply these modifiers"]
    return (
        f'The modifiers of "{obj.name}" change its {point_count(obj.data)} points to {shown if by_nodes else own}, so'
        f" results cannot be written. {', or '.join(ways)}, or turn off Use Modifiers."
    )


def _ways(shown):
    """How points that nodes make can become an object's own."""
    node = "Points to Vertices" if shown.points else "Realize Instances"
    ways = ["Press Convert to Point Cloud under Points and Groups"] if bpy.app.version >= POINTCLOUDS_SINCE else []
    return [*ways, f"{'put' if ways else 'Put'} the node {node} at the end of the nodes and apply them"]


@contextmanager
def _left_out(modifiers):
    """Take modifiers out of the viewport's evaluation, and put them back."""
    shown = [modifier for modifier in modifiers if modifier.show_viewport]
    try:
        for modifier in shown:
            modifier.show_viewport = False
        yield
    finally:
        for modifier in shown:
            modifier.show_viewport = True


@contextmanager
def shown_as_own(obj, with_instances):
    """Turn points that nodes make into such of the object's own kind, by a modifier that may be applied meanwhile.

    Parameters
    ----------
    obj : bpy.types.Object
        Mesh or point cloud.
    with_instances : bool
        Whether to make instances real before.
    """
    group = _to_kind(obj.type, with_instances)
    try:
        modifier = obj.modifiers.new(group.name, "NODES")
        modifier.node_group, modifier.use_pin_to_last = group, True
        yield
    finally:
        bpy.data.node_groups.remove(group)


def _to_kind(kind, with_instances):
    """Make nodes that turn points into vertices, or those into points, and keep the others."""
    own, other, node = _COMPONENTS[kind]
    group = bpy.data.node_groups.new("Points", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    given = add_node(group, "NodeGroupInput", 0, 0).outputs[0]
    if with_instances:
        given = _through(group, "GeometryNodeRealizeInstances", 1, given)
    parts = add_node(group, "GeometryNodeSeparateComponents", 2, 0)
    group.links.new(given, parts.inputs[0])
    turned = _through(group, node, 3, parts.outputs[other])
    both = add_node(group, "GeometryNodeJoinGeometry", 4, 0)
    for part in (turned, parts.outputs[own]):  # what is linked last comes first
        group.links.new(part, both.inputs[0])
    group.links.new(both.outputs[0], add_node(group, "NodeGroupOutput", 5, 0).inputs[0])
    return group


def _through(group, kind, column, socket):
    """Add a node that takes what a socket gives; return what it gives."""
    node = add_node(group, kind, column, 0)
    group.links.new(socket, node.inputs[0])
    return node.outputs[0]
