"""Functions that are called at events, Blender's and our own, while the extension is enabled."""

import bpy

# Our own: what objects and tools tell, whoever shows it or follows it. With what, and who listens in its `attach`:
_OWN = {
    "colors_changed": [],  # (obj) by a setting: ui/show.py
    "size_changed": [],  # (obj) of its points, by a setting: ui/show.py
    "shape_changed": [],  # (obj) of its points, dots or discs: ui/show.py
    "groups_changed": [],  # (obj) what they hold, or whether they are colored: ui/show.py
    "surface_found": [],  # (obj) of its discs, which are to be shown: ui/show.py
    "colors_found": [],  # (objects) which are to be shown in colors of their own, by one material: ui/show.py
    "splats_found": [],  # (obj) whose splats are to be shown: ui/show.py
    "result_written": [],  # (obj, name of the attribute to show, empty for the one on show): ui/show.py
    "mesh_made": [],  # (obj, the new object of its mesh, which is to be shown like it): ui/show.py
    "sequence_written": [],  # (objects, name of the attribute to show in one range): ui/show.py
    "views_changed": [],  # () what is drawn over them: ui/show.py
    "panels_changed": [],  # () what they tell of work that goes on: ui/show.py
    "deform_changed": [],  # (obj) by a setting: operators/deform/live.py
    "bound_changed": [],  # () which objects are bound: operators/deform/live.py
}


def tell(event: str, *arguments):
    """Call all that listen to an event of our own."""
    for function in _OWN[event]:
        function(*arguments)


def add_handlers(handlers):
    """Let functions be called at events, given by the names of these, as in `bpy.app.handlers` or above."""
    for event, function in handlers.items():
        _listening(event).append(function)


def remove_handlers(handlers):
    """Let them be called no more."""
    for event, function in handlers.items():
        _listening(event).remove(function)


def _listening(event):
    return _OWN[event] if event in _OWN else getattr(bpy.app.handlers, event)
