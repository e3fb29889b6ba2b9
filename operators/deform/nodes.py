"""The modifiers that show a deformation, with or without the extension: of the handles now, or as it was baked."""

import bpy

from ..objects.attributes import DISC, REST
from ..objects.carried import carried
from ..objects.modifiers import (
    DEFORM_TAG,
    SHAPE_TAG,
    add_input,
    add_node,
    is_deform,
    is_display,
    is_intact,
    new_group,
    set_input,
)
from ..objects.quantities import DISPLACEMENT

NAME = "Mesh-Free Deform"
VALUE = "Value"  # input of the nodes of a stored deformation
_LIVE, _BAKED = "live", "baked"  # how the custom property of the node groups begins
_KINDS = {"FLOAT_VECTOR": "VECTOR", "QUATERNION": "ROTATION"}  # of attributes, as nodes call them


def find_deform(obj):
    """Return the modifier of an object that shows its deformation, or None."""
    return next((modifier for modifier in obj.modifiers if is_deform(modifier)), None)


def is_baked(obj) -> bool:
    """Whether an object shows a baked animation, which no handle changes."""
    modifier = find_deform(obj)
    return modifier is not None and modifier.node_group[DEFORM_TAG].startswith(_BAKED)


def add_deform(obj):
    """Give an object the modifier that shows its deformation, if it has none.

    It comes before the user's modifiers, or after them if the points are taken from there; in both cases before our own
    display.
    """
    modifier = find_deform(obj)
    if modifier is None:
        modifier = obj.modifiers.new(NAME, "NODES")
        modifier.show_in_editmode = modifier.show_on_cage = True  # handles are moved in Edit Mode, too
        modifier.show_expanded = False
        others = [item for item in obj.modifiers if item != modifier]
        before = [item for item in others if not is_display(item)] if obj.meshfree.use_modifiers else []
        obj.modifiers.move(len(others), len(before))
    show_live(modifier)
    return modifier


def show_live(modifier):
    """Let a modifier show where the handles have moved the points."""
    kept = carried(modifier.id_data.data)
    kind = _kind(_LIVE, kept)
    if modifier.node_group is None or modifier.node_group.get(DEFORM_TAG) != kind:
        modifier.node_group = _group(kind) or _live_group(kind, kept)


def show_baked(modifier, cache, first: int, frames: int, kept):
    """Let a modifier show a baked animation.

    Parameters
    ----------
    modifier : bpy.types.NodesModifier
    cache : bpy.types.Object
        Its attributes "0", "1" and so on hold the displacements of all points from the first frame on, those named
        by `baked_suffix` after these what goes along.
    first, frames : int
        The first frame, and how many there are.
    kept : sequence of Carried
        What goes along.
    """
    kind = _kind(_BAKED, kept)
    modifier.node_group = _group(kind) or _baked_group(kind, kept)
    for name, value in (("Cache", cache), ("First Frame", first), ("Frames", frames)):
        set_input(modifier, name, value)


def baked_suffix(name) -> str:
    """Return what follows the number of a frame in the name of the attribute that another one is baked to."""
    return f" {name}"


def turns_discs(modifier) -> bool:
    """Whether the discs of the display go along where a modifier moves the points."""
    return modifier.node_group[DEFORM_TAG].endswith(f" {DISC}")


def _kind(begin, kept):
    """Return how the nodes for a kind of deformation are marked: by that, and by the last of what goes along."""
    return f"{begin} {kept[-1].name}" if kept else begin


def _group(kind):
    """Return the node group that all deformations of a kind share, or None."""
    known = [item for item in bpy.data.node_groups if item.get(DEFORM_TAG) == kind and item.library is None]
    return next((item for item in known if is_intact(item)), None)


def _live_group(kind, kept):
    group, given = _new(NAME, kind)
    displacement = add_node(group, "GeometryNodeInputNamedAttribute", 0, -200, data_type="FLOAT_VECTOR")
    displacement.inputs["Name"].default_value = DISPLACEMENT
    strength, geometry = given.outputs["Strength"], given.outputs["Geometry"]
    for number, (target, moved, data_type) in enumerate(kept, 1):
        y = -400 * number
        stored = _attribute(group, moved, data_type, 7, y)
        at_rest = _attribute(group, target, data_type, 7, y - 150)
        ends = at_rest.outputs["Attribute"], stored.outputs["Attribute"]
        value = _choose(group, stored.outputs["Exists"], *ends, data_type, 8, y)
        geometry = _replace(group, geometry, target, data_type, value, strength, y)
    _place(group, geometry, strength, displacement.outputs["Attribute"])
    return group


def _baked_group(kind, kept):
    group, given = _new(f"{NAME} Baked", kind)
    for name, kind in (("Cache", "Object"), ("First Frame", "Int"), ("Frames", "Int")):
        add_input(group, name, kind, f"{name} of the baked animation")
    time = add_node(group, "GeometryNodeInputSceneTime", 0, -300)
    elapsed = add_node(group, "ShaderNodeMath", 1, -300, operation="SUBTRACT")
    last = add_node(group, "ShaderNodeMath", 1, -500, operation="SUBTRACT")
    last.inputs[1].default_value = 1.0
    early = add_node(group, "ShaderNodeMath", 2, -300, operation="MAXIMUM")
    early.inputs[1].default_value = 0.0
    inside = add_node(group, "ShaderNodeMath", 3, -300, operation="MINIMUM")
    whole = add_node(group, "ShaderNodeMath", 4, -300, operation="FLOOR")
    share = add_node(group, "ShaderNodeMath", 4, -100, operation="FRACT")
    after = add_node(group, "ShaderNodeMath", 5, -400, operation="CEIL")
    cached = add_node(group, "GeometryNodeObjectInfo", 5, 100, transform_space="ORIGINAL")
    for source, target in (
        (time.outputs["Frame"], elapsed.inputs[0]),
        (given.outputs["First Frame"], elapsed.inputs[1]),
        (given.outputs["Frames"], last.inputs[0]),
        (elapsed.outputs[0], early.inputs[0]),
        (early.outputs[0], inside.inputs[0]),
        (last.outputs[0], inside.inputs[1]),
        (inside.outputs[0], whole.inputs[0]),
        (inside.outputs[0], share.inputs[0]),
        (inside.outputs[0], after.inputs[0]),
        (given.outputs["Cache"], cached.inputs["Object"]),
    ):
        group.links.new(source, target)

    def now(suffix, data_type, y):
        """Add nodes for what is baked, between two frames; return their socket."""
        frames = [_sample(group, cached, frame, y - 400 * index, suffix, data_type) for index, frame in ends]
        return _mix(group, share.outputs[0], frames, data_type, y)

    ends = list(enumerate((whole, after)))
    displacement, strength = now("", "FLOAT_VECTOR", 100), given.outputs["Strength"]
    geometry = _store(group, given.outputs["Geometry"], DISPLACEMENT, "FLOAT_VECTOR", displacement, 0)
    for number, (target, _, data_type) in enumerate(kept, 1):
        y = -900 * number
        value = now(baked_suffix(target), data_type, y)
        geometry = _replace(group, geometry, target, data_type, value, strength, y)
    _place(group, geometry, strength, displacement)
    return group


def _sample(group, cached, frame, y, suffix, data_type):
    """Add nodes that look up an attribute that the number of a frame, and a suffix, name; return their socket."""
    number = add_node(group, "FunctionNodeValueToString", 6, y)
    name = add_node(group, "GeometryNodeStringJoin", 6, y - 150)
    ending = add_node(group, "FunctionNodeInputString", 5, y - 150, string=suffix)
    stored = add_node(group, "GeometryNodeInputNamedAttribute", 7, y, data_type=data_type)
    index = add_node(group, "GeometryNodeInputIndex", 7, y - 150)
    sample = add_node(group, "GeometryNodeSampleIndex", 8, y, data_type=data_type, domain="POINT")
    for source, target in (
        (frame.outputs[0], number.inputs["Value"]),
        (ending.outputs["String"], name.inputs["Strings"]),  # the last one linked comes first
        (number.outputs["String"], name.inputs["Strings"]),
        (name.outputs["String"], stored.inputs["Name"]),
        (cached.outputs["Geometry"], sample.inputs["Geometry"]),
        (stored.outputs["Attribute"], _value(sample)),
        (index.outputs[0], sample.inputs["Index"]),
    ):
        group.links.new(source, target)
    return _output(sample)


def _attribute(group, name, data_type, column, y):
    """Add a node that reads an attribute; return it."""
    node = add_node(group, "GeometryNodeInputNamedAttribute", column, y, data_type=data_type)
    node.inputs["Name"].default_value = name
    return node


def _replace(group, geometry, target, data_type, value, strength, y):
    """Add nodes that mix an attribute with what takes its place; return the geometry."""
    before = _attribute(group, target, data_type, 9, y - 150).outputs["Attribute"]
    mixed = _mix(group, strength, (before, value), data_type, y)
    # In full it is taken as it is: the mix of Blender 5.2 leaves out turns of less than about 1e-4.
    full = add_node(group, "FunctionNodeCompare", 10, y - 150, data_type="FLOAT", operation="GREATER_EQUAL")
    full.inputs["B"].default_value = 1.0
    group.links.new(strength, full.inputs["A"])
    chosen = _choose(group, full.outputs["Result"], mixed, value, data_type, 11, y)
    return _store(group, geometry, target, data_type, chosen, y)


def _choose(group, switch, off, on, data_type, column, y):
    """Add a node that chooses one of two values of a type; return its socket."""
    node = add_node(group, "GeometryNodeSwitch", column, y, input_type=_KINDS[data_type])
    for source, name in ((switch, "Switch"), (off, "False"), (on, "True")):
        group.links.new(source, node.inputs[name])
    return node.outputs["Output"]


def _mix(group, share, ends, data_type, y):
    """Add a node that mixes two values of a type; return its socket."""
    mixed = add_node(group, "ShaderNodeMix", 10, y, data_type=_KINDS[data_type])
    # Its sockets have one name for each kind of data.
    for source, target in zip((share, *ends), (item for item in mixed.inputs if item.enabled), strict=True):
        group.links.new(source, target)
    return _output(mixed)


def _store(group, geometry, name, data_type, value, y):
    """Add a node that keeps an attribute; return the geometry."""
    kept = add_node(group, "GeometryNodeStoreNamedAttribute", 12, y, data_type=data_type)
    kept.inputs["Name"].default_value = name
    group.links.new(geometry, kept.inputs["Geometry"])
    group.links.new(value, _value(kept))
    return kept.outputs["Geometry"]


def _output(node):
    """Return the output of a node whose sockets have one name for each kind of data."""
    return next(item for item in node.outputs if item.enabled)


def _value(node):
    """Return the input for values of such a node."""
    return next(item for item in node.inputs if item.name == "Value" and item.enabled)


def add_shape(obj, name, kept):
    """Give an object a modifier that shows a stored deformation by its value, as a shape key does, which is 0 at first.

    Parameters
    ----------
    obj : bpy.types.Object
    name : str
        Of the attribute with the displacements; by `stored_name` of those with what goes along.
    kept : sequence of Carried
        What goes along.
    """
    group = new_group(name, SHAPE_TAG)
    _add_share(group, VALUE, "Share of the stored deformation that is shown").default_value = 0.0
    given = add_node(group, "NodeGroupInput", 0, 0)
    value, geometry = given.outputs[VALUE], given.outputs["Geometry"]
    for number, item in enumerate(kept, 1):
        y = -400 * number
        stored = _attribute(group, stored_name(name, item.name), item.data_type, 7, y).outputs["Attribute"]
        geometry = _replace(group, geometry, item.name, item.data_type, stored, value, y)
    scaled = add_node(group, "ShaderNodeVectorMath", 11, -200, operation="SCALE")
    placed = add_node(group, "GeometryNodeSetPosition", 13, 0)
    result = add_node(group, "NodeGroupOutput", 14, 0)
    for source, target in (
        (_attribute(group, name, "FLOAT_VECTOR", 10, -200).outputs["Attribute"], scaled.inputs[0]),
        (value, scaled.inputs["Scale"]),
        (geometry, placed.inputs["Geometry"]),
        (scaled.outputs["Vector"], placed.inputs["Offset"]),
        (placed.outputs["Geometry"], result.inputs["Geometry"]),
    ):
        group.links.new(source, target)
    modifier = obj.modifiers.new(name, "NODES")
    modifier.node_group = group
    modifier.show_expanded = False
    obj.modifiers.move(len(obj.modifiers) - 1, 0)  # shape keys come before modifiers, too


def stored_name(name, carried_name) -> str:
    """Return the name of the attribute that holds what goes along with a stored deformation."""
    return f"{name} {carried_name}"


def _new(name, kind):
    """Add a node group with its strength; return it and the node of what it is given."""
    group = new_group(name, DEFORM_TAG)
    group[DEFORM_TAG] = kind
    _add_share(group, "Strength", "Share of the deformation that is shown")
    return group, add_node(group, "NodeGroupInput", 0, 0)


def _add_share(group, name, description):
    """Add an input from 0 to 1, which is 1 at first; return its socket."""
    share = add_input(group, name, "Float", description)
    share.subtype = "FACTOR"
    share.default_value, share.min_value, share.max_value = 1.0, 0.0, 1.0
    return share


def _place(group, geometry, strength, displacement):
    """Add nodes that put the points to their places at rest and their displacements, and end the group.

    Points that are not displaced are where they are in the data: handles of Edit Mode on their way, and shape keys.
    """
    rest = add_node(group, "GeometryNodeInputNamedAttribute", 10, -400, data_type="FLOAT_VECTOR")
    rest.inputs["Name"].default_value = REST
    length = add_node(group, "ShaderNodeVectorMath", 10, -200, operation="LENGTH")
    scaled = add_node(group, "ShaderNodeVectorMath", 11, -200, operation="SCALE")
    moved = add_node(group, "ShaderNodeMath", 11, -600, operation="MULTIPLY")
    place = add_node(group, "ShaderNodeVectorMath", 12, -200, operation="ADD")
    placed = add_node(group, "GeometryNodeSetPosition", 13, 0)
    result = add_node(group, "NodeGroupOutput", 14, 0)
    for source, target in (
        (displacement, length.inputs[0]),
        (length.outputs["Value"], moved.inputs[0]),
        (rest.outputs["Exists"], moved.inputs[1]),
        (displacement, scaled.inputs[0]),
        (strength, scaled.inputs["Scale"]),
        (rest.outputs["Attribute"], place.inputs[0]),
        (scaled.outputs["Vector"], place.inputs[1]),
        (geometry, placed.inputs["Geometry"]),
        (moved.outputs[0], placed.inputs["Selection"]),
        (place.outputs["Vector"], placed.inputs["Position"]),
        (placed.outputs["Geometry"], result.inputs["Geometry"]),
    ):
        group.links.new(source, target)
