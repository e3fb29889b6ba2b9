"""The extension's own modifiers: node groups that a custom property marks, and the inputs of their modifiers."""

import bpy

DISPLAY_TAG = "meshfree_display"  # custom property that marks the nodes and materials of our own display
DEFORM_TAG = "meshfree_deform"  # the same of our own deformation


def is_display(modifier) -> bool:
    """Whether a modifier is the extension's own display."""
    return _is_tagged(modifier, DISPLAY_TAG)


def is_deform(modifier) -> bool:
    """Whether a modifier is the extension's own deformation."""
    return _is_tagged(modifier, DEFORM_TAG)


def is_own(modifier) -> bool:
    """Whether a modifier is the extension's own: what operators read comes before all of these."""
    return is_display(modifier) or is_deform(modifier)


def _is_tagged(modifier, tag):
    return modifier.type == "NODES" and modifier.node_group is not None and tag in modifier.node_group


def new_group(name: str, tag: str):
    """Add an empty node group for a modifier, marked as ours, with geometry going in and out."""
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    group[tag] = True
    group.is_modifier = True
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    return group


def add_node(tree, kind, column, y, **properties):
    """Add a node at a place in the editor, with properties set."""
    node = tree.nodes.new(kind)
    node.location = (200 * column, y)
    for name, value in properties.items():
        setattr(node, name, value)
    return node


def get_input(modifier, name: str):
    """Value of an input of a modifier of ours."""
    data, path = input_property(modifier, name)
    return getattr(data, path) if path == "value" else modifier[path[2:-2]]


def set_input(modifier, name: str, value):
    """Set an input of a modifier of ours."""
    data, path = input_property(modifier, name)
    if path == "value":
        data.value = value
    else:
        data[path[2:-2]] = value


def input_property(modifier, name: str):
    """Return data and property path of an input of a modifier of ours, as `layout.prop` takes them."""
    sockets = modifier.node_group.interface.items_tree
    identifier = next(item.identifier for item in sockets if item.name == name and item.in_out == "INPUT")
    if hasattr(modifier, "properties"):  # Blender 5.2 on
        return getattr(modifier.properties.inputs, identifier), "value"
    return modifier, f'["{identifier}"]'
