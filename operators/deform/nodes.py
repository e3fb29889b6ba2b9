"""The modifiers that show a deformation, with or without the extension: of the handles now, or as it was baked."""

import bpy

from ...tools.quantities import DISPLACEMENT
from ..objects.attributes import DISC, REST
from ..objects.carried import carried
from ..objects.modifiers import DEFORM_TAG, SHAPE_TAG, is_deform, is_display, is_intact, new_group, set_input
from ..objects.node_trees import TreeBuilder

NAME = "Mesh-Free Deform"
VALUE = "Value"  # input of the nodes of a stored deformation
_LIVE, _BAKED = "live", "baked"  # how the custom property of the node groups begins
_KINDS = {"FLOAT_VECTOR": "VECTOR", "QUATERNION": "ROTATION"}  # of attributes, as nodes call them
_SHARE = {"subtype": "FACTOR", "default_value": 1.0, "min_value": 0.0, "max_value": 1.0}  # of an input from 0 to 1
_STRENGTH = "Strength", "Float", "Share of the deformation that is shown", _SHARE


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
    """Let a modifier show a baked animation of so many frames, from the first one on.

    Attributes "0", "1" and so on of the cache, an object, hold the displacements of all points, those named by
    `baked_suffix` after these what goes along, `kept`.
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
    group, tree, given = _new(NAME, kind, (_STRENGTH,))
    geometry = given["Geometry"]
    for target, moved, data_type in kept:
        stored = tree.attribute(moved, data_type)
        value = tree.switch(_KINDS[data_type], stored.outputs["Exists"], tree.attribute(target, data_type), stored)
        geometry = _replace(tree, geometry, target, data_type, value, given["Strength"])
    _place(tree, geometry, given["Strength"], tree.attribute(DISPLACEMENT))
    return group


def _baked_group(kind, kept):
    names = (("Cache", "Object"), ("First Frame", "Int"), ("Frames", "Int"))
    inputs = [_STRENGTH, *((name, socket, f"{name} of the baked animation") for name, socket in names)]
    group, tree, given = _new(f"{NAME} Baked", kind, inputs)
    cached = tree.node("GeometryNodeObjectInfo", given["Cache"], transform_space="ORIGINAL").outputs["Geometry"]
    elapsed = tree.math("SUBTRACT", tree.node("GeometryNodeInputSceneTime").outputs["Frame"], given["First Frame"])
    last = tree.math("SUBTRACT", given["Frames"], 1.0)
    frame = tree.math("MINIMUM", tree.math("MAXIMUM", elapsed, 0.0), last)
    whole, share, after = (tree.math(operation, frame) for operation in ("FLOOR", "FRACT", "CEIL"))

    def now(suffix, data_type):
        """Add nodes for what is baked, between two frames; return the last one."""
        ends = (_sample(tree, cached, number, suffix, data_type) for number in (whole, after))
        return _mix(tree, share, *ends, data_type)

    displacement = now("", "FLOAT_VECTOR")
    geometry = tree.store(given["Geometry"], DISPLACEMENT, displacement)
    for target, _, data_type in kept:
        value = now(baked_suffix(target), data_type)
        geometry = _replace(tree, geometry, target, data_type, value, given["Strength"])
    _place(tree, geometry, given["Strength"], displacement)
    return group


def _sample(tree, cached, frame, suffix, data_type):
    """Add nodes that look up an attribute that the number of a frame, and a suffix, name; return the last one."""
    ending = tree.node("FunctionNodeInputString", string=suffix)
    number = tree.node("FunctionNodeValueToString", frame)
    name = tree.node("GeometryNodeStringJoin", Strings=[ending, number])  # the last one linked comes first
    index = tree.node("GeometryNodeInputIndex")
    stored = tree.attribute(name, data_type)
    return tree.node("GeometryNodeSampleIndex", cached, stored, index, data_type=data_type, domain="POINT")


def _replace(tree, geometry, target, data_type, value, strength):
    """Add nodes that mix an attribute with what takes its place; return the geometry."""
    mixed = _mix(tree, strength, tree.attribute(target, data_type), value, data_type)
    # In full it is taken as it is: the mix of Blender 5.2 leaves out turns of less than about 1e-4.
    full = tree.node("FunctionNodeCompare", strength, 1.0, data_type="FLOAT", operation="GREATER_EQUAL")
    return tree.store(geometry, target, tree.switch(_KINDS[data_type], full, mixed, value), data_type)


def _mix(tree, share, first, second, data_type):
    """Add a node that mixes two values of a type; return it."""
    return tree.node("ShaderNodeMix", share, first, second, data_type=_KINDS[data_type])


def add_shape(obj, name, kept):
    """Give an object a modifier that shows a stored deformation by its value, as a shape key does, which is 0 at first.

    The name is that of the attribute with the displacements; by `stored_name` of those with what goes along, `kept`.
    """
    share = (VALUE, "Float", "Share of the stored deformation that is shown", {**_SHARE, "default_value": 0.0})
    group = new_group(name, SHAPE_TAG, (share,))
    tree = TreeBuilder(group)
    given = tree.node("NodeGroupInput").outputs
    value, geometry = given[VALUE], given["Geometry"]
    for item in kept:
        stored = tree.attribute(stored_name(name, item.name), item.data_type)
        geometry = _replace(tree, geometry, item.name, item.data_type, stored, value)
    scaled = tree.vector("SCALE", tree.attribute(name), value)
    tree.output("NodeGroupOutput", tree.node("GeometryNodeSetPosition", geometry, Offset=scaled))
    modifier = obj.modifiers.new(name, "NODES")
    modifier.node_group = group
    modifier.show_expanded = False
    obj.modifiers.move(len(obj.modifiers) - 1, 0)  # shape keys come before modifiers, too


def stored_name(name, carried_name) -> str:
    """Return the name of the attribute that holds what goes along with a stored deformation."""
    return f"{name} {carried_name}"


def _new(name, kind, inputs):
    """Add a node group; return it, its builder and the sockets of what it is given."""
    group = new_group(name, DEFORM_TAG, inputs)
    group[DEFORM_TAG] = kind
    tree = TreeBuilder(group)
    return group, tree, tree.node("NodeGroupInput").outputs


def _place(tree, geometry, strength, displacement):
    """Add nodes that put the points to their places at rest and their displacements, and end the group.

    Points that are not displaced are where they are in the data: handles of Edit Mode on their way, and shape keys.
    """
    rest = tree.attribute(REST)
    moved = tree.math("MULTIPLY", tree.vector("LENGTH", displacement), rest.outputs["Exists"])
    place = tree.vector("ADD", rest, tree.vector("SCALE", displacement, strength))
    tree.output("NodeGroupOutput", tree.node("GeometryNodeSetPosition", geometry, moved, place))
