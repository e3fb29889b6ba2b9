"""Settings under the names that version 0.1.0 gave them: what comes in from its files moves to the names of now.

Blender hands out a stored value only by a property of that name, so the former ones stay, hidden and mostly empty.
"""

import bpy
from bpy.app.handlers import persistent
from bpy.props import EnumProperty, IntProperty, StringProperty

from .handlers import add_handlers, remove_handlers

_NEW = {
    "rims": "boundary",
    "rim_group": "boundary_group",
    "rim_count": "boundary_count",
    "part_count": "component_count",
}


def _former(name):
    """Arguments of a property that hands on what presets and scripts give it."""
    return {
        "name": name.replace("_", " ").title(),
        "description": f"Former name of {_NEW[name]}",
        "options": {"HIDDEN"},
        "update": lambda settings, context: _move(settings, name),
    }


class FormerSettings:
    """The former names, for the settings of an object."""

    rims: EnumProperty(
        items=(("AUTO", "Automatic", "Find the boundary"), ("OFF", "Off", "A closed surface")), **_former("rims")
    )
    rim_group: StringProperty(**_former("rim_group"))
    rim_count: IntProperty(min=0, **_former("rim_count"))
    part_count: IntProperty(min=0, **_former("part_count"))


def _move(settings, name):
    """Give a value to the property that has taken the place of a former one."""
    setattr(settings, _NEW[name], getattr(settings, name))
    settings.property_unset(name)


@persistent
def adopt(*_):
    """Move what objects hold under former names, also in the texts that tell whether results still hold."""
    for obj in bpy.data.objects:
        if not obj.is_property_set("meshfree"):
            continue
        settings = obj.meshfree
        for name in filter(settings.is_property_set, _NEW):
            _move(settings, name)
        for used in (settings, settings.deform):
            if "'rims':" in used.settings_used:
                used.settings_used = used.settings_used.replace("'rims':", "'boundary':")


_EVENTS = ("load_post", "blend_import_post")  # the latter, of objects that are appended or linked, from Blender 4.3 on
_HANDLERS = {event: adopt for event in _EVENTS if hasattr(bpy.app.handlers, event)}


def attach():
    """Look at each file that is opened, and at the one that is open: Blender shows it to us once all is registered."""
    add_handlers(_HANDLERS)
    bpy.app.timers.register(adopt, first_interval=0.0)


def detach():
    """Look no more."""
    remove_handlers(_HANDLERS)
    if bpy.app.timers.is_registered(adopt):
        bpy.app.timers.unregister(adopt)
