"""The state of an object's display: its modifier, with the size of the points, and its material."""

import numpy as np

from ..operators.objects.attributes import point_count, read_attribute
from ..operators.objects.modifiers import DISPLAY_TAG, get_input, has_input, is_display
from ..tools.quantities import quantity
from .materials import ATTRIBUTE, COLORS, RANGE, shows_own
from .nodes import DISC_COST, DISCS, MOST, SOLID_NAME

NAME = "Mesh-Free Display"


def find_display(obj):
    """Return the display modifier of an object, or None."""
    return next((modifier for modifier in obj.modifiers if is_display(modifier)), None)


def find_material(obj):
    """Return our material that colours an object's points; None if there is none, or one of the user's own."""
    modifier = find_display(obj)
    material = modifier and get_input(modifier, "Material")
    return material if material is not None and DISPLAY_TAG in material else None


def is_colored(obj) -> bool:
    """Whether an object shows colors that its points have of their own."""
    return bool(shown_attribute(obj)) and shows_own(find_material(obj))


def is_in_solid(obj) -> bool:
    """Whether viewports in Solid can show the result that an object shows."""
    modifier = find_display(obj)
    known = modifier is not None and has_input(modifier.node_group, SOLID_NAME)
    return known and get_input(modifier, SOLID_NAME) != ""


def is_cloud(obj) -> bool:
    """Whether an object is a mesh without faces, whose points Edit Mode would show as black dots."""
    return obj.type == "MESH" and not len(obj.data.polygons)


def draws_faces(obj) -> bool:
    """Whether viewports draw faces of an object, of a mesh or of discs, rather than dots."""
    modifier = find_display(obj)
    known = modifier is not None and has_input(modifier.node_group, DISCS)
    discs = known and get_input(modifier, DISCS) and draws_discs(obj)
    return obj.type == "MESH" and bool(discs or obj.data.polygons)


def draws_discs(obj) -> bool:
    """Whether the points of an object are few enough for the viewport to draw all as discs."""
    modifier = find_display(obj)
    most = get_input(modifier, MOST) if has_input(modifier.node_group, MOST) else 0
    return not most or DISC_COST * point_count(obj.data) <= most


def shown_attribute(obj) -> str:
    """Name of the attribute on show, or an empty text."""
    node = _find_node(obj, ATTRIBUTE)
    return node.attribute_name if node else ""


def range_node(obj):
    """Return the node with the bounds of the colours; None if vectors are shown as directions, or nothing is."""
    return _find_node(obj, RANGE) if _find_node(obj, COLORS) else None  # either may have been deleted


def color_node(obj):
    """Return the node with the colours from low to high; None if vectors are shown as directions, or nothing is."""
    return _find_node(obj, COLORS) if _find_node(obj, RANGE) else None


def shown_range(obj):
    """Return the least and the greatest value in the colours' range; None where `range_node` is."""
    node = range_node(obj)
    if node is None:
        return None
    if is_stepped(obj) or shows_zeros(obj):
        return obj.meshfree.range_low, obj.meshfree.range_high
    return node.inputs["From Min"].default_value, node.inputs["From Max"].default_value


def shows_zeros(obj) -> bool:
    """Whether all numbers on show are zero, so that colours have no range."""
    settings = obj.meshfree
    if settings.range_mode == "LOCKED" or range_node(obj) is None or is_stepped(obj):
        return False
    return settings.range_low == settings.range_high == 0.0


def is_stepped(obj) -> bool:
    """Whether each whole number has a colour of its own, where numbers are shown."""
    return color_node(obj).color_ramp.interpolation == "CONSTANT"


def step_colors(obj) -> dict:
    """Return the colour of each whole number by its name, if each has one of its own; else nothing."""
    node = color_node(obj)
    if node is None or not is_stepped(obj):
        return {}
    colors = [tuple(element.color) for element in node.color_ramp.elements]
    if len(colors) == 2:
        return dict(zip(("No", "Yes"), colors, strict=True))
    first, last = (round(value) for value in shown_range(obj))
    none, *repeated = colors
    names = dict(enumerate(quantity(shown_attribute(obj)).names))
    return {
        names.get(number, str(number)): none if number < 0 else repeated[number % len(repeated)]
        for number in range(first, last + 1)
    }


def shown_values(obj):
    """Read the numbers that an object shows as colours, in the same order as its points, (n,).

    None where vectors are shown as directions, or nothing is. If the attribute on show is gone, or holds neither
    numbers nor vectors on points, `PointCloudError` is raised.
    """
    name = shown_attribute(obj)
    return numbers(read_attribute(obj.data, name), component(name, obj.meshfree)) if name else None


def component(name: str, settings) -> str:
    """Return what is shown of an attribute of vectors: "DIRECTION", "LENGTH", "X", "Y" or "Z"."""
    if settings.component != "AUTO":
        return settings.component
    return "LENGTH" if quantity(name).power else "DIRECTION"


def numbers(values, part: str):
    """Return the numbers to show of an attribute's values; None for directions and texture coordinates."""
    if values.ndim == 1:
        return values
    if is_texture(values):
        return None
    if part == "LENGTH":
        return np.linalg.norm(values, axis=1)
    return None if part == "DIRECTION" else values[:, "XYZ".index(part)]


def is_distance(name: str, values, part: str) -> bool:
    """Whether the numbers shown of an attribute are distances, or lengths of vectors."""
    return quantity(name).color_range == "positive" or (values.ndim > 1 and part == "LENGTH")


def is_texture(values) -> bool:
    """Whether an attribute's values are pairs, as texture coordinates are."""
    return values.ndim == 2 and values.shape[1] == 2


def without_unreached(name: str, values):
    """Leave out the negative numbers of unreached points, which do not count for the range."""
    return values[values >= 0.0] if quantity(name).color_range == "positive" else values


def sloping(name: str, values, part: str) -> list:
    """Return the displayed numbers that can be interpolated, (n,) each: two for texture coordinates.

    Labels, truth values and directions cannot. Unreached points have NaN.
    """
    shown = numbers(values, part)
    if values.dtype.kind != "f" or (shown is None and not is_texture(values)):
        return []
    if shown is None:
        return list(values.T)
    return [np.where(shown >= 0.0, shown, np.nan) if quantity(name).color_range == "positive" else shown]


def _find_node(obj, name):
    material = find_material(obj)
    return material and material.node_tree.nodes.get(name)


def label(name: str) -> str:
    """Return the title of an attribute, such as "Mode 3" for lb_eigenvector_003."""
    row = quantity(name)
    if not row.label:
        return " ".join(word.lstrip("0").title() for word in name.removeprefix("lb_").split("_"))
    return f"{row.label} {name.removeprefix(row.attribute).lstrip('0')}".strip()
