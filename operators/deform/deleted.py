"""Objects that were deleted: properties of this extension that refer to them do not keep them alive.

Blender counts such a property as a user, and leaves an object with users in the file when it is deleted, out of sight,
still at work in modifiers. Here it is let go of after the step of undo has ended, which so does not bring references
back where nothing else of their owner has changed: what was let go of is remembered.
"""

from collections import Counter

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ..objects.handlers import add_handlers, remove_handlers
from ..objects.reading import TYPES, find_object
from .binding import bound_objects
from .nodes import is_baked
from .pose import POSE, State, write_displacement

_left = set()  # owner's and target's session_uid, and the path of the property, of what was let go of


def _references(obj):
    """Yield the properties of this extension of an object that refer to objects, by their paths, and these."""
    kept, deform = obj.meshfree, obj.meshfree.deform
    yield "meshfree.compared_with", kept.compared_with
    yield "meshfree.deform.armature", deform.armature
    for number, item in enumerate(deform.handle_items):
        yield f"meshfree.deform.handle_items[{number}].empty", item.empty


def let_go():
    """Let go of objects that nothing uses but properties of this extension; what followed their bones is at rest."""
    found = [(obj, *each) for obj in bpy.data.objects if obj.type in TYPES for each in _references(obj) if each[1]]
    counted = Counter(target for _, _, target in found)
    gone = {target for target, count in counted.items() if target.users <= count and target.library is None}
    for obj in bpy.data.objects if gone else ():
        for item in obj.modifiers:
            if item.type == "ARMATURE":
                found.append((obj, f'modifiers["{bpy.utils.escape_identifier(item.name)}"].object', item.object))
    for owner, path, target in found:
        if target in gone:
            _left.add((owner.session_uid, target.session_uid, path))
            _refer(owner, path, None)
    for obj in bound_objects():
        deform, moved = obj.meshfree.deform, len(obj.data.get(POSE, ())) > 1
        if len(deform.bone_items) and deform.armature is None and moved and not is_baked(obj) and obj.data.is_editable:
            write_displacement(obj, np.zeros((deform.point_count, 3)), np.zeros(0), State.SETTLED, {})


def _refer(owner, path, target):
    """Let a property of an object refer to another object, or to none."""
    holder, _, name = path.rpartition(".")
    setattr(owner.path_resolve(holder), name, target)


@persistent
def _on_update(_scene, depsgraph):
    """Look for deleted objects when collections have changed."""
    if depsgraph.id_type_updated("COLLECTION"):
        let_go()


@persistent
def _on_undo(*_):
    """Refer to objects again that are back."""
    for owner_uid, target_uid, path in [*_left]:
        owner, target = find_object(owner_uid), find_object(target_uid)
        if owner is not None and target is not None and target.users_collection:
            _left.discard((owner_uid, target_uid, path))
            _refer(owner, path, target)


@persistent
def _on_file(*_):
    _left.clear()
    let_go()


_HANDLERS = {"depsgraph_update_post": _on_update, "undo_post": _on_undo, "redo_post": _on_undo, "load_post": _on_file}


def attach():
    """Look for deleted objects, also those of files of earlier versions."""
    add_handlers(_HANDLERS)


def detach():
    """Stop that."""
    remove_handlers(_HANDLERS)
    _left.clear()
