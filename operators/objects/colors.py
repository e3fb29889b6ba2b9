"""How objects look without results: the colors of their points, as of a photograph, and their own material."""

import bpy

from ...command.colors import of_splats
from .attributes import SOLID, read_attribute
from .modifiers import DISPLAY_TAG, get_input, is_display
from .splats import BASE, has_splats

COLORS = "BYTE_COLOR", "FLOAT_COLOR"  # types of attributes


def is_color(data, name: str) -> bool:
    """Whether an attribute of a mesh or a point cloud holds colors of its points, and not those of a result."""
    attribute = data.attributes.get(name)
    return name != SOLID and attribute is not None and attribute.domain == "POINT" and attribute.data_type in COLORS


def own_colors(data) -> str:
    """Return the name of the attribute with the colors of points: the active one, else the first; empty without any.

    Splats have theirs in harmonics, and other numbers in attributes of these types.
    """
    names = [] if has_splats(data) else [item.name for item in data.attributes if is_color(data, item.name)]
    active = data.color_attributes.active_color_name if isinstance(data, bpy.types.Mesh) else ""
    return active if active in names else next(iter(names), "")


def splat_colors(data):
    """Return the view-independent colors of splats, linear and opaque, (n, 4)."""
    return of_splats(read_attribute(data, BASE))


def own_material(obj):
    """Return the user's material of an object, that of its first slot; None without one."""
    material = obj.material_slots[0].material if obj.material_slots else None
    return None if material is None or DISPLAY_TAG in material else material


def replaced_material(obj) -> str:
    """Return the notice that the display replaces an object's material, which goes when that is shown again."""
    name = own_material(obj).name
    return f'{obj.name}: the display replaces the material "{name}". Own Material, in the list of Show, brings it back.'


def shows_own_material(obj) -> bool:
    """Whether an object is shown in a material of the user's, without a display or by it."""
    display, material = next(filter(is_display, obj.modifiers), None), own_material(obj)
    return material is not None and (display is None or get_input(display, "Material") == material)
