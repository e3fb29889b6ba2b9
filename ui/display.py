"""What an object shows: its display modifier, with the size of the points, and its material."""

import bpy

from ..operators.attributes import BOUNDARY, COMPONENT, DISTANCE, MEAN_CURVATURE, read_attribute
from ..operators.modifiers import DISPLAY_TAG, get_input, is_display, set_input
from ..operators.reading import spacing
from .nodes import ATTRIBUTE, COLORS, RANGE, color_by, display_group

NAME = "Mesh-Free Display"
_TITLES = {BOUNDARY: "Rim", COMPONENT: "Connected Part"}


def find_display(obj):
    """Return the display modifier of an object, or None."""
    return next((modifier for modifier in obj.modifiers if is_display(modifier)), None)


def find_material(obj):
    """Return our material that colours an object's points; None if there is none, or one of the user's own."""
    modifier = find_display(obj)
    material = modifier and get_input(modifier, "Material")
    return material if material is not None and DISPLAY_TAG in material else None


def shown_attribute(obj) -> str:
    """Name of the attribute on show, or an empty text."""
    node = _find_node(obj, ATTRIBUTE)
    return node.attribute_name if node else ""


def range_node(obj):
    """Return the node with the bounds of the colours; None if vectors are shown as directions, or nothing is."""
    return _find_node(obj, RANGE)


def color_node(obj):
    """Return the node with the colours from low to high; None if vectors are shown as directions, or nothing is."""
    return _find_node(obj, COLORS)


def step_colors(obj) -> dict:
    """Return the colour of each whole number by its name, if each has one of its own; else nothing."""
    node = color_node(obj)
    if node is None or node.color_ramp.interpolation != "CONSTANT":
        return {}
    colors = [tuple(element.color) for element in node.color_ramp.elements]
    first = round(range_node(obj).inputs["From Min"].default_value + 0.5)
    attribute = obj.data.attributes.get(shown_attribute(obj))
    names = [str(first + index) for index in range(len(colors))]
    if attribute is not None and attribute.data_type == "BOOLEAN" and names == ["0", "1"]:
        names = ["No", "Yes"]
    return dict(zip(names, colors, strict=True))


def _find_node(obj, name):
    material = find_material(obj)
    return material and material.node_tree.nodes.get(name)


def label(name: str) -> str:
    """Title of an attribute for people: "Mode 3" for lb_eigenvector_003."""
    if name in _TITLES:
        return _TITLES[name]
    words = name.removeprefix("lb_").replace("eigenvector", "mode").split("_")
    return " ".join(word.lstrip("0").title() for word in words)


def show_attribute(obj, name: str = "", radius: float = 0.0):
    """Show an attribute as colours on the points, by the display settings of the object.

    Parameters
    ----------
    obj : bpy.types.Object
        A mesh object.
    name : str
        The attribute; empty for the one on show, or the mean curvature.
    radius : float
        Radius of the points in local lengths; 0 keeps the one in use, or takes it from the spacing of the points.

    Raises
    ------
    PointCloudError
        There is no such attribute, or it holds neither numbers nor vectors on points.
    """
    if not name:
        name = shown_attribute(obj)
        if name not in obj.data.attributes:
            name = MEAN_CURVATURE
    values = read_attribute(obj.data, name)
    if name == DISTANCE:
        values = values[values >= 0.0]  # what no source reaches does not count for the range
    modifier = find_display(obj)
    if modifier is None:
        radius = radius or 0.75 * spacing(obj.data) or 0.01
        modifier = obj.modifiers.new(NAME, "NODES")
        modifier.node_group = display_group()
    modifier.use_pin_to_last = True
    obj.modifiers.move(list(obj.modifiers).index(modifier), len(obj.modifiers) - 1)
    if radius:
        set_input(modifier, "Radius", radius)
    material = find_material(obj)
    if material is None or material.users - material.use_fake_user > 1:  # a duplicate of an object gets its own
        material = bpy.data.materials.new(f"{NAME} {obj.name}")
        material[DISPLAY_TAG] = True
        set_input(modifier, "Material", material)
    color_by(material, name, values, obj.meshfree)
    obj.update_tag()
