"""Handlers of events, Blender's and our own, while the extension is enabled."""

import bpy

# Our own events, with their arguments and the module that adds a handler in its `attach`:
_OWN = {
    "colors_changed": [],  # (obj) by a setting: ui/show.py
    "size_changed": [],  # (obj) of its points, by a setting: ui/show.py
    "shape_changed": [],  # (obj) of its points, dots or discs: ui/show.py
    "groups_changed": [],  # (obj) what they hold, or whether they are colored: ui/show.py
    "surface_found": [],  # (obj) whose discs are to be shown: ui/show.py
    "colors_found": [],  # (objects) to be shown in their own colors, by one material: ui/show.py
    "splats_found": [],  # (obj) whose splats are to be shown: ui/show.py
    "result_written": [],  # (obj, name of the attribute to show, empty for the one on show): ui/show.py
    "strays_gone": [],  # (obj) that showed them: ui/show.py
    "mesh_made": [],  # (obj, the new object of its mesh, to be shown like it): ui/show.py
    "frame_shown": [],  # (obj) of a motion: ui/show.py
    "sequence_written": [],  # (objects, name of the attribute to show in one range): ui/show.py
    "views_changed": [],  # () what is drawn over them: ui/show.py
    "panels_changed": [],  # () what they show of running work: ui/show.py
    "measuring_changed": [],  # () the plane of volumes: operators/tools/measure_live.py
    "deform_changed": [],  # (obj) by a setting: operators/deform/live.py
    "weights_changed": [],  # (obj) of bones: operators/rigging/follow.py
    "bound_changed": [],  # () which objects are bound: operators/deform/live.py
}


def notify(event: str, *arguments):
    """Call the handlers of an event of our own."""
    for function in _OWN[event]:
        function(*arguments)


def telling(event: str):
    """Return the update function of a setting that calls the handlers of an event with its object."""
    return lambda settings, context: notify(event, settings.id_data)


def add_handlers(handlers):
    """Add functions as handlers of events, by the names in `bpy.app.handlers` or above."""
    for event, function in handlers.items():
        _handlers_of(event).append(function)


def remove_handlers(handlers):
    """Remove functions that were handlers of events."""
    for event, function in handlers.items():
        _handlers_of(event).remove(function)


def _handlers_of(event):
    return _OWN[event] if event in _OWN else getattr(bpy.app.handlers, event)
