"""The node trees that make values visible: round points for vertices, and colours for values."""

import bpy
import numpy as np

from ..operators.attributes import DISPLACEMENT
from ..operators.modifiers import DISPLAY_TAG, add_node, new_group
from . import colormaps

ATTRIBUTE, RANGE, COLORS = "Attribute", "Range", "Colors"  # nodes of the material that are read again
_LINE, _DARK = 0.2, (0.02, 0.02, 0.02, 1.0)  # share of a step that a line takes, and its color
_GAMMA = 2.2  # makes the steps of direction colours even to the eye


def display_group():
    """Return the node group that all displays share: round points where there are no faces, and the material."""
    for group in bpy.data.node_groups:
        if DISPLAY_TAG in group and group.library is None:
            return group
    group = new_group("Mesh-Free Display", DISPLAY_TAG)
    new_socket = group.interface.new_socket
    radius = new_socket("Radius", in_out="INPUT", socket_type="NodeSocketFloat", description="Size of the points")
    radius.subtype = "DISTANCE"
    radius.default_value = 0.01
    radius.min_value = 0.0
    new_socket("Material", in_out="INPUT", socket_type="NodeSocketMaterial", description="Colors of the points")

    given = add_node(group, "NodeGroupInput", 0, 0)
    neighbors = add_node(group, "GeometryNodeInputMeshVertexNeighbors", 0, -200)
    loose = add_node(group, "FunctionNodeCompare", 1, -200, data_type="INT", operation="EQUAL")
    parts = add_node(group, "GeometryNodeSeparateComponents", 1, 0)
    points = add_node(group, "GeometryNodeMeshToPoints", 2, -100)
    given_points = add_node(group, "GeometryNodeSetPointRadius", 2, -300)
    faces = add_node(group, "GeometryNodeDeleteGeometry", 2, 100)  # loose vertices would be drawn over the points
    joined = add_node(group, "GeometryNodeJoinGeometry", 3, 0)
    colored = add_node(group, "GeometryNodeSetMaterial", 4, 0)
    result = add_node(group, "NodeGroupOutput", 5, 0)
    compared = next(socket for socket in loose.inputs if socket.name == "A" and socket.type == "INT")
    for source, target in (
        (neighbors.outputs["Face Count"], compared),
        (loose.outputs["Result"], points.inputs["Selection"]),
        (given.outputs["Geometry"], parts.inputs["Geometry"]),
        (parts.outputs["Mesh"], points.inputs["Mesh"]),
        (parts.outputs["Point Cloud"], given_points.inputs["Points"]),
        (given.outputs["Radius"], given_points.inputs["Radius"]),
        (given_points.outputs["Points"], joined.inputs["Geometry"]),
        (given.outputs["Radius"], points.inputs["Radius"]),
        (points.outputs["Points"], joined.inputs["Geometry"]),
        (loose.outputs["Result"], faces.inputs["Selection"]),
        (parts.outputs["Mesh"], faces.inputs["Geometry"]),
        (faces.outputs["Geometry"], joined.inputs["Geometry"]),
        (joined.outputs["Geometry"], colored.inputs["Geometry"]),
        (given.outputs["Material"], colored.inputs["Material"]),
        (colored.outputs["Geometry"], result.inputs["Geometry"]),
    ):
        group.links.new(source, target)
    return group


def color_by(material, name, values, settings):
    """Rebuild a material so that it shows an attribute."""
    tree = new_tree(material)
    attribute = add_node(tree, "ShaderNodeAttribute", 0, 0, name=ATTRIBUTE, attribute_name=name)
    if values.ndim == 1:
        color = _number_color(tree, attribute.outputs["Fac"], values, settings)
    elif _component(name, settings) == "DIRECTION":
        color = _direction_color(tree, attribute.outputs["Vector"])
    elif _component(name, settings) == "LENGTH":
        length = add_node(tree, "ShaderNodeVectorMath", 1, 0, operation="LENGTH")
        tree.links.new(attribute.outputs["Vector"], length.inputs[0])
        color = _number_color(tree, length.outputs["Value"], np.linalg.norm(values, axis=1), settings)
    else:
        separate = add_node(tree, "ShaderNodeSeparateXYZ", 1, 0)
        tree.links.new(attribute.outputs["Vector"], separate.inputs[0])
        number = separate.outputs[settings.component]
        color = _number_color(tree, number, values[:, "XYZ".index(settings.component)], settings)

    # Mostly emission, so that colours read as in the legend; some diffuse light, so that shapes show.
    diffuse = add_node(tree, "ShaderNodeBsdfDiffuse", 4, 100)
    emission = add_node(tree, "ShaderNodeEmission", 4, -100)
    mixed = add_node(tree, "ShaderNodeMixShader", 5, 0)
    mixed.inputs[0].default_value = 0.6
    output = add_node(tree, "ShaderNodeOutputMaterial", 6, 0)
    tree.links.new(color, diffuse.inputs["Color"])
    tree.links.new(color, emission.inputs["Color"])
    tree.links.new(diffuse.outputs[0], mixed.inputs[1])
    tree.links.new(emission.outputs[0], mixed.inputs[2])
    tree.links.new(mixed.outputs[0], output.inputs["Surface"])


def _component(name, settings):
    """What of a vector attribute is shown."""
    if settings.component != "AUTO":
        return settings.component
    return "LENGTH" if name == DISPLACEMENT else "DIRECTION"


def _number_color(tree, number, values, settings):
    """Colour numbers by a map over their range."""
    color_map, low, high = colormaps.fit(values, settings.coverage, settings.color_map)
    steps = colormaps.step_colors(color_map, low, high)
    if steps:
        low, high = low - 0.5, high + 0.5
    bounds = add_node(tree, "ShaderNodeMapRange", 2, 0, name=RANGE)
    bounds.inputs["From Min"].default_value = low
    bounds.inputs["From Max"].default_value = high
    ramp = add_node(tree, "ShaderNodeValToRGB", 3, 0, name=COLORS)
    if steps:
        ramp.color_ramp.interpolation = "CONSTANT"
        _set_colors(ramp.color_ramp.elements, steps, last=len(steps))  # the last one is as wide as the others
    else:
        colors = colormaps.linear_colors(color_map)
        _set_colors(ramp.color_ramp.elements, colors, last=len(colors) - 1)
    tree.links.new(number, bounds.inputs["Value"])
    tree.links.new(bounds.outputs["Result"], ramp.inputs[0])
    if steps or not settings.iso_lines:
        return ramp.outputs["Color"]
    return _with_lines(tree, bounds.outputs["Result"], ramp.outputs["Color"], settings.iso_lines)


def _with_lines(tree, number, color, count):
    """Darken a colour in the middle of so many even steps of a number from 0 to 1, where values beyond end."""
    scaled = add_node(tree, "ShaderNodeMath", 2, -300, operation="MULTIPLY")
    scaled.inputs[1].default_value = count
    part = add_node(tree, "ShaderNodeMath", 3, -300, operation="FRACT")
    line = add_node(tree, "ShaderNodeMath", 4, -300, operation="COMPARE")
    line.inputs[1].default_value, line.inputs[2].default_value = 0.5, 0.5 * _LINE
    mixed = add_node(tree, "ShaderNodeMixRGB", 5, -300)
    mixed.inputs["Color2"].default_value = _DARK
    for source, target in (
        (number, scaled.inputs[0]),
        (scaled.outputs[0], part.inputs[0]),
        (part.outputs[0], line.inputs[0]),
        (line.outputs[0], mixed.inputs["Fac"]),
        (color, mixed.inputs["Color1"]),
    ):
        tree.links.new(source, target)
    return mixed.outputs["Color"]


def _set_colors(elements, colors, last):
    while len(elements) > len(colors):
        elements.remove(elements[-1])
    while len(elements) < len(colors):
        elements.new(1.0)
    for index, color in enumerate(colors):
        elements[index].position = index / last
        elements[index].color = color


def _direction_color(tree, vector):
    """Colour directions: red, green and blue for x, y and z, each from dark for -1 to bright for 1."""
    unit = add_node(tree, "ShaderNodeVectorMath", 1, 0, operation="NORMALIZE")
    shifted = add_node(tree, "ShaderNodeVectorMath", 2, 0, operation="MULTIPLY_ADD")
    shifted.inputs[1].default_value = shifted.inputs[2].default_value = (0.5, 0.5, 0.5)
    gamma = add_node(tree, "ShaderNodeGamma", 3, 0)
    gamma.inputs["Gamma"].default_value = _GAMMA
    tree.links.new(vector, unit.inputs[0])
    tree.links.new(unit.outputs[0], shifted.inputs[0])
    tree.links.new(shifted.outputs[0], gamma.inputs["Color"])
    return gamma.outputs["Color"]


def direction_color(direction):
    """Colour of a unit vector as linear (r, g, b, 1)."""
    return (*((0.5 * value + 0.5) ** _GAMMA for value in direction), 1.0)


def new_tree(material):
    """Return the node tree of a material, emptied."""
    if material.node_tree is None:
        material.use_nodes = True
    material.node_tree.nodes.clear()
    return material.node_tree
