"""A sequence: one object that shows, at each frame of the scene, one object of a collection, by nodes alone."""

import bpy

from ..objects.modifiers import COLLECTION, SEQUENCE_TAG, add_input, add_node, is_intact, new_group, set_input

NAME = "Mesh-Free Sequence"
FIRST, STEP = "First Frame", "Frame Step"  # inputs of the nodes, beside the collection


def add_sequence(context, name: str, frames, first: int):
    """Add an object that shows other objects one after the other, which move to a collection of their own.

    Nodes choose by the frame of the scene, so that renders, undo and saved files need nothing else. They take the
    objects of the collection in the order of their names, numbers by their size.

    Parameters
    ----------
    context : bpy.types.Context
    name : str
    frames : sequence of bpy.types.Object
        In the active collection.
    first : int
        Frame of the scene at which the first is shown.

    Returns
    -------
    bpy.types.Object
    """
    collection = bpy.data.collections.new(f"{name} Frames")
    context.collection.children.link(collection)
    for obj in frames:
        for other in list(obj.users_collection):
            other.objects.unlink(obj)
        collection.objects.link(obj)
    sequence = bpy.data.objects.new(name, bpy.data.meshes.new(name))
    context.collection.objects.link(sequence)
    modifier = sequence.modifiers.new(NAME, "NODES")
    modifier.node_group = _known_group() or _new_group()
    for key, value in ((COLLECTION, collection), (FIRST, first), (STEP, 1)):
        set_input(modifier, key, value)
    for view_layer in context.scene.view_layers:
        for layer in _layers(view_layer.layer_collection):
            if layer.collection == collection:
                layer.exclude = True  # or all of its objects would be seen at once; nodes take them all the same
    return sequence


def _layers(layer):
    yield layer
    for child in layer.children:
        yield from _layers(child)


def _known_group():
    groups = [group for group in bpy.data.node_groups if SEQUENCE_TAG in group and group.library is None]
    return next(filter(is_intact, groups), None)


def _new_group():
    """Make the nodes: the object whose place among the others is the number of steps since the first frame."""
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
    ):
        group.links.new(source, target)
    since = math(1, -300, "SUBTRACT", time.outputs["Frame"], given.outputs[FIRST])
    steps = math(2, -300, "DIVIDE", since, math(1, -500, "MAXIMUM", given.outputs[STEP], 1.0))
    number = math(4, -300, "MAXIMUM", math(3, -300, "FLOOR", steps), 0.0)
    last = math(3, -500, "SUBTRACT", size.outputs["Instance Count"], 1.0)
    number = math(5, -300, "MINIMUM", number, last)
    group.links.new(math(6, -300, "COMPARE", number, place.outputs[0], 0.5), chosen.inputs["Selection"])
    return group
