"""Options of the command line for properties of Blender."""

from ...command.settings import Setting

_UNITS = ("LENGTH", "AREA")


def as_setting(item) -> Setting:
    """Return a property of Blender as a setting of the command line, within the bounds to which Blender would clamp."""
    name, description = item.identifier, item.description
    if item.type == "ENUM":
        return Setting(name, description, item.default, choices=tuple(item.enum_items.keys()))
    if item.type in {"BOOLEAN", "STRING"}:
        return Setting(name, description, item.default)
    if item.is_array:
        return Setting(name, description, tuple(item.default_array), form="X,Y,Z")
    if item.unit == "ROTATION":
        return Setting(name, description, item.default, item.hard_min, item.hard_max, form="DEGREES")
    form = item.unit if item.unit in _UNITS else ""
    return Setting(name, description, item.default, item.hard_min, item.hard_max, form=form)
