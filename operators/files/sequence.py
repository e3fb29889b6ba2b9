"""Sequences: an object whose nodes show one object of a collection at each frame of the scene."""

import bpy

from ...core import PointCloudError
from ..objects.attributes import write_attribute
from ..objects.modifiers import COLLECTION, SEQUENCE_TAG, is_intact, new_group, set_input
from ..objects.node_trees import TreeBuilder

NAME = "Mesh-Free Sequence"
FIRST, STEP = "First Frame", "Frame Step"  # inputs of the nodes, beside the collection
FRAME = "frame"  # attribute of its points, one for each object: first frame of that object, less that of the sequence
_NUMBERS = "Frame Numbers"  # name of the node that reads them; missing in nodes of earlier versions
_LAST = 1_048_574  # frame of Blender
_INPUTS = (  # of the nodes
    (COLLECTION, "Collection", "Collection whose objects are shown one after the other, by name"),
    (FIRST, "Int", "Frame of the scene at which the first object is shown, and before", {"default_value": 1}),
    (
        STEP,
        "Int",
        "How many frames of the scene each object is shown; the last one stays",
        {"default_value": 1, "min_value": 1},
    ),
)


def add_sequence(context, name: str, frames, numbers):
    """Return a new object that shows other objects one after the other, which move to a collection of their own.

    Nodes choose by the frame of the scene, so that renders, undo and saved files need no handler. They use the objects
    of the collection in natural order of their names; the points of the object, one for each, have their first frames.
    The numbers, ascending, are the frames of the scene from which on each is shown; one beyond the last frame that
    Blender has raises `PointCloudError`.
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
    group = new_group(NAME, SEQUENCE_TAG, _INPUTS)
    tree = TreeBuilder(group)
    given = tree.node("NodeGroupInput").outputs
    frames = tree.node("GeometryNodeCollectionInfo", given[COLLECTION], True)
    size = tree.node("GeometryNodeAttributeDomainSize", frames, component="INSTANCES")
    since = tree.math("SUBTRACT", tree.node("GeometryNodeInputSceneTime").outputs["Frame"], given[FIRST])
    steps = tree.math("FLOOR", tree.math("DIVIDE", since, tree.math("MAXIMUM", given[STEP], 1.0)))
    numbers = tree.node("GeometryNodeInputNamedAttribute", FRAME, name=_NUMBERS, data_type="INT")
    over = tree.math("LESS_THAN", numbers, tree.math("ADD", steps, 0.5))
    begun = tree.node("GeometryNodeAttributeStatistic", given["Geometry"], Attribute=over).outputs["Sum"]
    number = tree.math("MAXIMUM", tree.math("SUBTRACT", begun, 1.0), 0.0)
    number = tree.math("MINIMUM", number, tree.math("SUBTRACT", size, 1.0))
    now = tree.math("COMPARE", number, tree.node("GeometryNodeInputIndex"), 0.5)
    chosen = tree.node("GeometryNodeSeparateGeometry", frames, now, domain="INSTANCE")
    tree.output("NodeGroupOutput", tree.node("GeometryNodeRealizeInstances", chosen))
    return group
