"""Sequences: an object whose nodes show one object of a collection at each frame of the scene."""

import bpy

from ...core import PointCloudError
from ..objects.attributes import write_attribute
from ..objects.modifiers import COLLECTION, SEQUENCE_TAG, add_input, add_node, is_intact, new_group, set_input

NAME = "Mesh-Free Sequence"
FIRST, STEP = "First Frame", "Frame Step"  # inputs of the nodes, beside the collection
FRAME = "frame"  # attribute of its points, one for each object: first frame of that object, less that of the sequence
_NUMBERS = "Frame Numbers"  # name of the node that reads them; missing in nodes of earlier versions
_LAST = 1_048_574  # frame of Blender


def add_sequence(context, name: str, frames, numbers):
    """Add an object that shows other objects one after the other, which move to a collection of their own.

    Nodes choose by the frame of the scene, so that renders, undo and saved files need no handler. They use the objects
    of the collection in natural order of their names; the points of the object, one for each, have their first frames.

    Parameters
    ----------
    context : bpy.types.Context
    name : str
    frames : sequence of bpy.types.Object
        In the active collection.
    numbers : sequence of int
        Ascending: the frames of the scene from which on each is shown.

    Returns
    -------
    bpy.types.Object

    Raises
    ------
    PointCloudError
        A number is beyond the last frame that Blender has.
    """
    first, last = numbers[0], numbers[-1]
    if last > _LAST:
        raise PointCloudError(
            f"The last file has the number {last}, beyond Blender's last frame {_LAST:,}. Turn off Follow Numbers."
        )
    collection = bpy.data.collections.new(f"{name} Frames")
    context.collection.children.link(collection)
    for obj in frames:
        for other in list(obj.users_collection):
            other.objects.unlink(obj)
        collection.objects.link(obj)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(numbers))
    write_attribute(mesh, FRAME, [number - first for number in numbers], "INT")
    sequence = bpy.data.objects.new(name, mesh)
    context.collection.objects.link(sequence)
    modifier = sequence.modifiers.new(NAME, "NODES")
    modifier.node_group = _known_group() or _new_group()
    for key, value in ((COLLECTION, collection), (FIRST, first), (STEP, 1)):
        set_input(modifier, key, value)
    for view_layer in context.scene.view_layers:
        for layer in _layers(view_layer.layer_collection):
            if layer.collection == collection:
                layer.exclude = True  # hides its objects; nodes use them all the same
    return sequence


def _layers(layer):
    yield layer
    for child in layer.children:
        yield from _layers(child)


def _known_group():
    groups = [group for group in bpy.data.node_groups if SEQUENCE_TAG in group and group.library is None]
    return next((group for group in groups if is_intact(group) and _NUMBERS in group.nodes), None)


def _new_group():
    """Make nodes that show the last object whose first frame, in steps, is not after that of the scene."""
    group = new_group(NAME, SEQUENCE_TAG)
    add_input(group, COLLECTION, "Collection", "Collection whose objects are shown one after the other, by name")
    add_input(
        group, FIRST, "Int", "Frame of the scene at which the first object is shown, and before"
    ).default_value = 1
    step = add_input(group, STEP, "Int", "How many frames of the scene each object is shown; the last one stays")
    step.default_value = step.min_value = 1
    given = add_node(group, "NodeGroupInput", 0, 0)
    frames = add_node(group, "GeometryNodeCollectionInfo", 1, 0)
    frames.inputs["Separate Children"].default_value = True
    time = add_node(group, "GeometryNodeInputSceneTime", 0, -300)
    numbers = add_node(group, "GeometryNodeInputNamedAttribute", 3, -700, name=_NUMBERS, data_type="INT")
    numbers.inputs["Name"].default_value = FRAME
    begun = add_node(group, "GeometryNodeAttributeStatistic", 4, -300)
    place = add_node(group, "GeometryNodeInputIndex", 5, -500)
    size = add_node(group, "GeometryNodeAttributeDomainSize", 2, -500, component="INSTANCES")
    chosen = add_node(group, "GeometryNodeSeparateGeometry", 7, 0, domain="INSTANCE")
    realized = add_node(group, "GeometryNodeRealizeInstances", 8, 0)
    result = add_node(group, "NodeGroupOutput", 9, 0)

    def math(column, y, operation, *values):
        node = add_node(group, "ShaderNodeMath", column, y, operation=operation)
        for socket, value in zip(node.inputs, values, strict=False):
            if isinstance(value, bpy.types.NodeSocket):
                group.links.new(value, socket)
            else:
                socket.default_value = value
        return node.outputs[0]

    for source, target in (
        (given.outputs[COLLECTION], frames.inputs["Collection"]),
        (frames.outputs[0], size.inputs[0]),
        (frames.outputs[0], chosen.inputs["Geometry"]),
        (chosen.outputs["Selection"], realized.inputs[0]),
        (realized.outputs[0], result.inputs[0]),
        (given.outputs["Geometry"], begun.inputs["Geometry"]),
    ):
        group.links.new(source, target)
    since = math(1, -300, "SUBTRACT", time.outputs["Frame"], given.outputs[FIRST])
    steps = math(2, -300, "DIVIDE", since, math(1, -500, "MAXIMUM", given.outputs[STEP], 1.0))
    over = math(3, -300, "ADD", math(3, -300, "FLOOR", steps), 0.5)
    group.links.new(math(4, -700, "LESS_THAN", numbers.outputs[0], over), begun.inputs["Attribute"])
    number = math(5, -300, "MAXIMUM", math(5, -300, "SUBTRACT", begun.outputs["Sum"], 1.0), 0.0)
    last = math(3, -500, "SUBTRACT", size.outputs["Instance Count"], 1.0)
    number = math(6, -300, "MINIMUM", number, last)
    group.links.new(math(6, -300, "COMPARE", number, place.outputs[0], 0.5), chosen.inputs["Selection"])
    return group
