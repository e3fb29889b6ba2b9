"""Where an object's points were in the file that they come from, and whether the object is seen where it is."""

import json

import numpy as np

from .attributes import point_count

OFFSET = "lb_offset"  # custom property of an object: what its coordinates in the file were before import, less now
COLUMNS = "lb_columns"  # another one: what numbers of its attributes were in the file, in JSON; see operators/files


def copy_place(obj, other):
    """Let an object tell the same about its file as another one whose attributes it has, for all of its points."""
    if OFFSET in other:
        obj[OFFSET] = other[OFFSET]
    if COLUMNS in other:
        obj[COLUMNS] = json.dumps({**json.loads(other[COLUMNS]), "points": point_count(obj.data)})


def offset_of(obj):
    """Return what is added to an object's coordinates in the world to get those of its file, (3,) float64."""
    return np.array(obj.get(OFFSET, (0.0, 0.0, 0.0)), dtype=np.float64)


def place_of(obj):
    """Return what is added to points with the object's scale and rotation to get those of its file, (3,) float64."""
    return np.array(obj.matrix_world.translation, dtype=np.float64) + offset_of(obj)


def known_offset(scene):
    """Return the offset of the first object of a scene that has one, which others share if they can; or None."""
    return next((offset_of(obj) for obj in scene.objects if OFFSET in obj), None)


def hide(obj, hidden=True):
    """Hide an object in views and in renders, or show it."""
    obj.hide_set(hidden)
    obj.hide_render = hidden


def activate(context, *objects):
    """Select objects and no others; the first one becomes active."""
    for other in context.selected_objects:
        other.select_set(False)
    for obj in objects:
        obj.select_set(True)
    context.view_layer.objects.active = objects[0]
