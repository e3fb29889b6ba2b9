"""Objects that were deleted: properties of this extension that refer to them do not keep them alive.

Blender counts such a property as a user, and leaves an object with users in the file when it is deleted, out of sight,
still at work in modifiers.
"""

from collections import Counter

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ..objects.handlers import add_handlers, remove_handlers
from ..objects.reading import TYPES
from .binding import bound_objects, forget_bound
from .nodes import is_baked
from .pose import POSE, State, write_displacement

LEGEND_OF = "meshfree_legend_of"  # custom property of the collection of a legend: the object whose colors it explains
_soon = set()  # what is due in the background


def _references() -> Counter:
    """Count the properties of this extension that refer to each object."""
    found = Counter(collection.get(LEGEND_OF) for collection in bpy.data.collections)
    for obj in bpy.data.objects:
        if obj.type in TYPES:
            kept = obj.meshfree
            found.update([kept.compared_with, kept.deform.armature, *(item.empty for item in kept.deform.handle_items)])
    del found[None]
    return found


def remove_deleted():
    """Remove the objects that nothing uses but properties of this extension; what followed their bones is at rest."""
    gone = {obj for obj, count in _references().items() if obj.users <= count and obj.library is None}
    if gone:
        bpy.data.batch_remove(gone)
        forget_bound()
    for obj in bound_objects():
        deform, moved = obj.meshfree.deform, len(obj.data.get(POSE, ())) > 1
        if len(deform.bone_items) and deform.armature is None and moved and not is_baked(obj) and obj.data.is_editable:
            write_displacement(obj, np.zeros((deform.point_count, 3)), np.zeros(0), State.SETTLED, {})


@persistent
def _on_update(_scene, depsgraph):
    """Look for deleted objects soon after collections have changed, since other handlers still see them now."""
    if depsgraph.id_type_updated("COLLECTION"):
        if bpy.app.background:
            _soon.add(remove_deleted)
        elif not bpy.app.timers.is_registered(remove_deleted):
            bpy.app.timers.register(remove_deleted, first_interval=0.0)


@persistent
def _on_next(*_):
    """Do in the background, where there are no timers, what is due."""
    while _soon:
        _soon.pop()()


@persistent
def _on_file(*_):
    remove_deleted()


_HANDLERS = {
    "depsgraph_update_post": _on_update,
    "depsgraph_update_pre": _on_next,
    "render_init": _on_next,
    "save_pre": _on_next,
    "load_post": _on_file,
}


def attach():
    """Look for deleted objects, also those of files of earlier versions."""
    add_handlers(_HANDLERS)


def detach():
    """Stop that."""
    remove_handlers(_HANDLERS)
    _soon.clear()
    if bpy.app.timers.is_registered(remove_deleted):
        bpy.app.timers.unregister(remove_deleted)
