"""The offset of an object's coordinates from those of its file; moving, hiding and selecting objects."""

import json

import numpy as np

from ...core import PointCloudError
from ...core.linalg import inv
from .animation import moves_by_driver, moves_by_keys
from .attributes import point_count

OFFSET = "lb_offset"  # custom property of an object: coordinates in its file less those after import
COLUMNS = "lb_columns"  # custom property: how columns of its file are stored, in JSON; see operators/files

LAS = "lb_las"  # custom property: what its LAS file states besides, in JSON; see core/files/las_form.py


def copy_place(obj, other):
    """Copy offset, columns and header of the file from another object, whose attributes an object has at all points."""
    for name in (OFFSET, LAS):
        if name in other:
            obj[name] = other[name]
    if COLUMNS in other:
        obj[COLUMNS] = json.dumps({**json.loads(other[COLUMNS]), "points": point_count(obj.data)})


def offset_of(obj):
    """Return the offset from world coordinates to those of the object's file, (3,) float64."""
    return np.array(obj.get(OFFSET, (0.0, 0.0, 0.0)), dtype=np.float64)


def place_of(obj):
    """Return the offset from points as read, without the location, to those of the file, (3,) float64."""
    return np.array(obj.matrix_world.translation, dtype=np.float64) + offset_of(obj)


def known_offset(scene):
    """Return the offset of the first object of a scene that has one, to be shared where possible; or None."""
    return next((offset_of(obj) for obj in scene.objects if OFFSET in obj), None)


def check_movable(obj):
    """Refuse an object whose transform something else decides, before anything is computed."""
    causes = {
        "keyframes": moves_by_keys(obj),
        "drivers": moves_by_driver(obj),
        "constraints": any(not item.mute and item.influence > 0.0 for item in obj.constraints),
    }
    for cause, holds in causes.items():
        if holds:
            raise PointCloudError(
                f'"{obj.name}" is moved by its {cause}, which would undo the alignment. Remove them, or make the other'
                " object the active one."
            )


def move_object(obj, matrix):
    """Give an object another matrix in world space; parents and delta transforms stay as they are.

    If its channels cannot express it, where its parent is scaled unevenly, `PointCloudError` is raised.
    """
    parent = np.array(obj.matrix_world) @ inv(obj.matrix_basis)
    obj.matrix_world = matrix
    wanted, found = np.array(matrix), parent @ np.array(obj.matrix_basis)
    size = np.abs(wanted[:3, :3]).max()
    if not (
        np.allclose(found[:3, :3], wanted[:3, :3], rtol=0.0, atol=1e-4 * size)
        and np.allclose(found[:3, 3], wanted[:3, 3], rtol=1e-5, atol=1e-4 * size)
    ):
        raise PointCloudError(
            f'The rotation of "{obj.name}" would shear it, since its scale or that of its parent is uneven. Apply the'
            " scale (Ctrl A), or clear the parent."
        )


def moves_with(obj, other) -> bool:
    """Whether an object is another one, a child of it, or a child of such."""
    while obj is not None and obj != other:
        obj = obj.parent
    return obj is not None


def link_beside(made, obj):
    """Link a new object to the collections of another one."""
    for collection in obj.users_collection:
        collection.objects.link(made)


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
