"""The extension's own modifiers: node groups that a custom property marks, and the inputs of their modifiers."""

import bpy

from ...core import PointCloudError

DISPLAY_TAG = "meshfree_display"  # custom property that marks the nodes and materials of our own display
DEFORM_TAG = "meshfree_deform"  # the same of our own deformation
SHAPE_TAG = "meshfree_shape"  # the same of a deformation that is stored, where there are no shape keys
MOTION_TAG = "meshfree_motion"  # the same of what displaces points by a motion
SEQUENCE_TAG = "meshfree_sequence"  # the same of what shows one object a frame
COLLECTION = "Frames"  # input of that: the collection
_INPUTS = "meshfree_inputs"  # custom property of the nodes: identifiers of the inputs by the names that we gave them
_OF_WINDOW = {"is_active", "use_pin_to_last"}  # what of a modifier changes nothing


def is_display(modifier) -> bool:
    """Whether a modifier is the extension's own display."""
    return _is_tagged(modifier, DISPLAY_TAG)


def is_deform(modifier) -> bool:
    """Whether a modifier is the extension's own deformation."""
    return _is_tagged(modifier, DEFORM_TAG)


def is_motion(modifier) -> bool:
    """Whether a modifier displaces points by a motion on the surface."""
    return _is_tagged(modifier, MOTION_TAG)


def is_sequence(modifier) -> bool:
    """Whether a modifier shows one object of a collection at each frame."""
    return _is_tagged(modifier, SEQUENCE_TAG)


def is_own(modifier) -> bool:
    """Whether a modifier is the extension's own: what operators read comes before all of these."""
    return is_display(modifier) or is_deform(modifier) or is_motion(modifier)


def _is_tagged(modifier, tag):
    group = modifier.node_group if modifier.type == "NODES" else None
    return group is not None and tag in group and is_intact(group)


def is_intact(group) -> bool:
    """Whether nodes of ours still have all their inputs, whatever these are called now."""
    return set(group.get(_INPUTS, {}).values()) <= _inputs(group).keys()


def has_input(group, name: str) -> bool:
    """Whether nodes of ours have an input, which those that an earlier version made may lack."""
    return name in group.get(_INPUTS, {})


def _inputs(group):
    """Names of the inputs of a node group by their identifiers."""
    items = [item for item in group.interface.items_tree if item.item_type == "SOCKET" and item.in_out == "INPUT"]
    return {item.identifier: item.name for item in items}


def new_group(name: str, tag: str, inputs=()):
    """Add an empty node group for a modifier, marked as ours, with geometry going in and out, and return it.

    Of each other input `inputs` has its name, by which it is found again should somebody rename it, its kind, its
    tooltip, and where it differs from other inputs a dict of properties of its socket.
    """
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    group[tag] = True
    group.is_modifier = True
    new_socket, identifiers = group.interface.new_socket, {}
    new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    for label, kind, description, *properties in inputs:
        socket = new_socket(label, in_out="INPUT", socket_type=f"NodeSocket{kind}", description=description)
        identifiers[label] = socket.identifier
        for key, value in dict(*properties).items():
            setattr(socket, key, value)
    group[_INPUTS] = identifiers
    return group


def get_input(modifier, name: str):
    """Value of an input of a modifier of ours."""
    return _read(*input_property(modifier, name))


def set_input(modifier, name: str, value):
    """Set an input of a modifier of ours."""
    _write(*input_property(modifier, name), value)


def inputs_of(modifier) -> dict:
    """Read the values of all inputs of a modifier of ours, by their identifiers."""
    return {identifier: _read(*_input(modifier, identifier)) for identifier in _inputs(modifier.node_group)}


def put_inputs(modifier, values):
    """Set those inputs of a modifier of ours that have other values than these, by their identifiers."""
    for identifier, value in values.items():
        place = _input(modifier, identifier)
        if _read(*place) != value:
            _write(*place, value)


def _read(data, path):
    if path != "value":
        return data.get(path[2:-2])
    return getattr(data, path, None)  # geometry has none


def _write(data, path, value):
    if path == "value":
        data.value = value
    else:
        data[path[2:-2]] = value


def input_property(modifier, name: str):
    """Return data and property path of an input of a modifier of ours, as panels draw them.

    If somebody has removed it, `PointCloudError` is raised.
    """
    group = modifier.node_group
    named = _inputs(group)
    identifier = group.get(_INPUTS, {}).get(name)
    if identifier is None:  # of nodes that an earlier version made
        identifier = next((key for key, label in named.items() if label == name), None)
    if identifier not in named:
        raise PointCloudError(
            f'The nodes "{group.name}" have no input "{name}" any more. Undo that, or delete these nodes and'
            " use again the button that added them."
        )
    return _input(modifier, identifier)


def _input(modifier, identifier):
    if hasattr(modifier, "properties"):  # Blender 5.2 on
        return getattr(modifier.properties.inputs, identifier), "value"
    return modifier, f'["{identifier}"]'


def modifier_settings(modifier) -> dict:
    """Read the settings of a modifier that change what it does, in a form that can be compared as text.

    Of other data, such as an object, a texture or nodes, it is known which ones they are, not what is in them.
    """
    settings = {}
    for item in modifier.bl_rna.properties:
        name = item.identifier
        hidden = name in _OF_WINDOW or (name.startswith("show_") and name != "show_viewport")
        if not (item.is_readonly or hidden or item.type == "COLLECTION"):
            settings[name] = _plain(getattr(modifier, name))
    if modifier.type == "NODES" and modifier.node_group is not None:
        for identifier in _inputs(modifier.node_group):
            settings[identifier] = _plain(_read(*_input(modifier, identifier)))
    return settings


def _plain(value):
    if isinstance(value, bpy.types.ID):
        return value.name_full
    return tuple(map(_plain, value)) if hasattr(value, "__len__") and not isinstance(value, str | set) else value
