"""The binding of an object to what its points follow, kept in the file, and whether it is valid.

The points at rest are the attribute `lb_rest`, in local space. What they follow is in `Object.meshfree.deform`, and
read by its kind.
"""

from uuid import uuid4

import bmesh
import bpy
import numpy as np

from ...tools.quantities import DISPLACEMENT
from ..objects.attributes import (
    REST,
    in_edit_mesh,
    point_count,
    read_attribute,
    remove_attributes,
    write_attribute,
)
from ..objects.carried import moved_names
from ..objects.handlers import notify
from ..objects.reading import TYPES, fingerprint, sharing_objects
from .kinds import kind_of
from .nodes import find_deform, is_baked
from .pose import POSE, is_there

WRITES = DISPLACEMENT, REST
_bound = b"", ()  # session_uids of all objects at the last search, and the indices of the bound ones


def forget_bound():
    """Search for bound objects again at the next use."""
    global _bound
    _bound = b"", ()


def bound_objects(scene=None) -> list:
    """Find all bound objects, or those of a scene.

    Objects are searched only if they differ from those at the last call, since this is called at each mouse move: a
    search of 5,000 objects takes 9 ms.
    """
    global _bound
    objects = bpy.data.objects
    uids = np.empty(len(objects), np.int32)
    objects.foreach_get("session_uid", uids)
    known, places = _bound
    if uids.tobytes() != known:  # in the order of their names
        places = [place for place, obj in enumerate(objects) if obj.type in TYPES and is_bound(obj)]
        _bound = uids.tobytes(), places
    found = [objects[place] for place in places]
    return found if scene is None else [obj for obj in found if is_there(obj, scene)]


def is_bound(obj) -> bool:
    """Whether an object is bound, stale or not."""
    return obj is not None and obj.meshfree.deform.is_bound


def stale_reason(obj, glance=False, trusting=False) -> str:
    """Return why a bound object no longer follows, and what to do; empty if it does.

    A glance is quick enough for a panel; see `fingerprint`. A trusting one is quick enough for a drag: it uses the last
    count of groups.
    """
    settings, kind = obj.meshfree.deform, kind_of(obj)
    count = len(bmesh.from_edit_mesh(obj.data).verts) if in_edit_mesh(obj) else point_count(obj.data)
    if is_baked(obj):
        return f"Its animation is baked. Delete the bake to let it follow the {kind.followed} again"
    original = kind.copied_from(obj)
    if original is not None:
        return kind.copy_reason(obj, original)
    if count != settings.point_count:
        return f"It had {settings.point_count:,} points and has {count:,} now. Bind again"
    gone = kind.gone(obj)
    if gone:
        return gone
    if find_deform(obj) is None:
        return 'The modifier "Mesh-Free Deform" or an input of its nodes was removed. Bind again'
    others = [
        other.name for other in sharing_objects(obj) if is_bound(other) and kind_of(other).copied_from(other) != obj
    ]
    if others:
        return f'It shares its mesh with "{others[0]}", which is bound, too. Make it a single user'
    if in_edit_mesh(obj):  # groups and positions can only be checked outside
        return ""
    if any(obj.data.attributes.get(name) is None for name in WRITES):
        return f"The attributes {WRITES[0]} and {WRITES[1]} were removed. Bind again"
    counted = kind.changed(obj, glance, trusting)
    if counted is None:
        return ""
    changed, left_out = counted
    if changed:
        return changed
    known = fingerprint(obj, glance, left_out=left_out)
    if known and settings.fingerprint != known:
        return "The points at rest were moved. Bind again"
    return ""


def read_rest(obj):
    """Read the points at rest in local space, (n, 3) float32."""
    if not in_edit_mesh(obj):
        return read_attribute(obj.data, REST)
    edited = bmesh.from_edit_mesh(obj.data)
    layer = edited.verts.layers.float_vector[REST]
    return np.array([vertex[layer][:] for vertex in edited.verts], np.float32)


def record(obj, kind: str, rest, matrix, groups: str, left_out=()):
    """Write what all kinds of bindings keep in the file.

    Points at rest, (n, 3) float32, are in local space, from which the matrix, (3, 3), leads to world lengths. `groups`
    is a checksum of the groups or weights that were bound; points in `left_out` may be moved, see `renew`.
    """
    settings = obj.meshfree.deform
    write_attribute(obj.data, REST, rest)
    settings.kind = kind
    settings.matrix = np.reshape(matrix, -1)
    settings.groups_used = groups
    settings.point_count = len(rest)
    settings.is_bound = True
    renew(obj, left_out)


def renew(obj, left_out=()):
    """Take the present points of a bound object, which `lb_rest` holds, as those at rest; some of them do not count."""
    settings = obj.meshfree.deform
    settings.fingerprint = fingerprint(obj, left_out=left_out)
    settings.binding_id = uuid4().hex


def forget(obj):
    """Remove the binding of an object from the file."""
    settings = obj.meshfree.deform
    settings.is_bound = False
    settings.handle_items.clear()
    settings.bone_items.clear()
    settings.armature = None
    remove_attributes(obj.data, *WRITES, *moved_names(obj.data))
    obj.data.pop(POSE, None)
    modifier = find_deform(obj)
    if modifier is not None:
        obj.modifiers.remove(modifier)
        notify("shape_changed", obj)
