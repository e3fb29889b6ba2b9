"""The modifiers that show a deformation, with or without the extension: of the handles now, or as it was baked."""

import bpy

from ..objects.attributes import DISPLACEMENT, REST
from ..objects.modifiers import DEFORM_TAG, add_input, add_node, is_deform, is_display, is_intact, new_group, set_input

NAME = "Mesh-Free Deform"
_LIVE, _BAKED = "live", "baked"  # what the custom property of the node groups says


def find_deform(obj):
    """Return the modifier of an object that shows its deformation, or None."""
    return next((modifier for modifier in obj.modifiers if is_deform(modifier)), None)


def is_baked(obj) -> bool:
    """Whether an object shows a baked animation, which no handle changes."""
    modifier = find_deform(obj)
    return modifier is not None and modifier.node_group[DEFORM_TAG] == _BAKED


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
    modifier.node_group = _group(_LIVE) or _live_group()


def show_baked(modifier, cache, first: int, frames: int):
    """Let a modifier show a baked animation.

    Parameters
    ----------
    modifier : bpy.types.NodesModifier
    cache : bpy.types.Object
        Its attributes "0", "1" and so on hold the displacements of all points from the first frame on.
    first, frames : int
        The first frame, and how many there are.
    """
    modifier.node_group = _group(_BAKED) or _baked_group()
    for name, value in (("Cache", cache), ("First Frame", first), ("Frames", frames)):
        set_input(modifier, name, value)


def _group(kind):
    """Return the node group that all deformations of a kind share, or None."""
    known = [item for item in bpy.data.node_groups if item.get(DEFORM_TAG) == kind and item.library is None]
    return next((item for item in known if is_intact(item)), None)


def _live_group():
    group, given = _new(NAME, _LIVE)
    displacement = add_node(group, "GeometryNodeInputNamedAttribute", 0, -200, data_type="FLOAT_VECTOR")
    displacement.inputs["Name"].default_value = DISPLACEMENT
    _place(group, given.outputs["Geometry"], given.outputs["Strength"], displacement.outputs["Attribute"])
    return group


def _baked_group():
    group, given = _new(f"{NAME} Baked", _BAKED)
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
    mixed = add_node(group, "ShaderNodeMix", 9, -200, data_type="VECTOR")
    # Its sockets have one name for each kind of data.
    factor, *ends = [item for item in mixed.inputs if item.enabled]
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
        (share.outputs[0], factor),
        (_sample(group, cached, whole, 100), ends[0]),
        (_sample(group, cached, after, -400), ends[1]),
    ):
        group.links.new(source, target)
    displacement = next(item for item in mixed.outputs if item.enabled)
    kept = add_node(group, "GeometryNodeStoreNamedAttribute", 9, 0, data_type="FLOAT_VECTOR")
    kept.inputs["Name"].default_value = DISPLACEMENT
    value = next(item for item in kept.inputs if item.name == "Value" and item.enabled)
    group.links.new(given.outputs["Geometry"], kept.inputs["Geometry"])
    group.links.new(displacement, value)
    _place(group, kept.outputs["Geometry"], given.outputs["Strength"], displacement)
    return group


def _sample(group, cached, frame, y):
    """Add nodes that look up the displacements of a frame, whose number names the attribute; return their socket."""
    name = add_node(group, "FunctionNodeValueToString", 6, y)
    stored = add_node(group, "GeometryNodeInputNamedAttribute", 7, y, data_type="FLOAT_VECTOR")
    index = add_node(group, "GeometryNodeInputIndex", 7, y - 150)
    sample = add_node(group, "GeometryNodeSampleIndex", 8, y, data_type="FLOAT_VECTOR", domain="POINT")
    value = next(item for item in sample.inputs if item.name == "Value" and item.enabled)
    for source, target in (
        (frame.outputs[0], name.inputs["Value"]),
        (name.outputs["String"], stored.inputs["Name"]),
        (cached.outputs["Geometry"], sample.inputs["Geometry"]),
        (stored.outputs["Attribute"], value),
        (index.outputs[0], sample.inputs["Index"]),
    ):
        group.links.new(source, target)
    return next(item for item in sample.outputs if item.enabled)


def _new(name, kind):
    """Add a node group with its strength; return it and the node of what it is given."""
    group = new_group(name, DEFORM_TAG)
    group[DEFORM_TAG] = kind
    strength = add_input(group, "Strength", "Float", "Share of the deformation that is shown")
    strength.subtype = "FACTOR"
    strength.default_value, strength.min_value, strength.max_value = 1.0, 0.0, 1.0
    return group, add_node(group, "NodeGroupInput", 0, 0)


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
