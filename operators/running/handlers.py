"""Functions that Blender calls at its events, while the extension is enabled."""

import bpy


def add_handlers(handlers):
    """Let functions be called, given by the names of their lists in `bpy.app.handlers`."""
    for event, function in handlers.items():
        getattr(bpy.app.handlers, event).append(function)


def remove_handlers(handlers):
    """Let them be called no more."""
    for event, function in handlers.items():
        getattr(bpy.app.handlers, event).remove(function)
