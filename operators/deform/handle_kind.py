"""The kind of bindings to handles: their pose, whether they are there, and what becomes of them."""

import zlib
from functools import partial

import numpy as np
from mathutils import Matrix

from ...core.linalg import inv
from ..objects.animation import moves_by_keys, stop_moving
from ..objects.attributes import REST, own_positions, point_count, positions_now, read_attribute, write_own_positions
from ..objects.carried import carries
from ..objects.counting import all_members
from ..objects.groups import handle_names
from . import binding, kinds
from .binding import WRITES, bound_objects
from .follower import Follower
from .handles import (
    HandlePose,
    copied_from,
    edited_rows,
    groups_checksum,
    moved_by_empties,
    read_binding,
    read_constraints,
    settings_text,
)
from .pose import is_there, relative_matrix, write_rest


class Handles:
    """The kind of bindings to handles; see `Kind`."""

    name = "HANDLES"
    followed = "handles"
    at_once = False

    def key(self, obj):
        settings = obj.meshfree.deform
        softness = settings.weight if settings.soft else 0.0
        return settings.binding_id, (settings.rotation_aware, settings.soft, softness)

    def read_pose(self, obj, depsgraph=None):
        settings = obj.meshfree.deform
        moved_by = [item for item in settings.handle_items if item.has_empty and is_there(item.empty)]
        changes = {item.name: _empty_change(obj, item, depsgraph) for item in moved_by}
        edited = positions_now(obj) if any(not item.has_empty for item in settings.handle_items) else None
        key = self.key(obj)
        asked = (key[1], settings.steps, *(["carried"] if carries(obj) else []))
        checksums = [zlib.crc32(repr(asked).encode()), 0 if edited is None else zlib.crc32(edited)]
        numbers = np.concatenate([checksums, *(change.ravel() for change in changes.values())])
        return HandlePose(key, numbers, changes, edited, settings.steps)

    def plan_follower(self, obj):
        return partial(Follower, read_binding(obj))

    def gone(self, obj):
        items = obj.meshfree.deform.handle_items
        gone = [item.name for item in items if item.has_empty and not is_there(item.empty)]
        if gone:
            return f"The empty of {', '.join(gone)} was deleted. Bind again to get a new one"
        if obj.meshfree.deform.settings_used != settings_text(obj):
            return "Settings changed. Bind again"
        return ""

    def changed(self, obj, glance, trusting):
        names = handle_names(obj)
        found = all_members(obj, (*names, obj.meshfree.deform.anchors), glance, trusting)
        if None in found:
            return None
        by_empty = moved_by_empties(obj)
        edited = [group.rows for name, group in zip(names, found[:-1], strict=True) if name not in by_empty]
        if obj.meshfree.deform.groups_used != groups_checksum(names, [group.weighted for group in found]):
            return "The groups of handles or anchors changed. Bind again", ()
        return "", np.concatenate(edited) if edited else np.empty(0, int)

    def copied_from(self, obj):
        return copied_from(obj)

    def copy_reason(self, obj, original):
        if original.data == obj.data:
            return f'It shares its mesh with "{original.name}", whose handles move both'
        return f'It has no handles of its own, "{original.name}" has them. Bind again to get copies of them'

    def movers(self, obj):
        items = obj.meshfree.deform.handle_items
        return {thing.session_uid: thing for thing in (*(item.empty for item in items if item.empty), obj)}

    def written(self, obj):
        return [item.empty for item in obj.meshfree.deform.handle_items if is_there(item.empty)]

    def held(self, obj):
        return ""

    def kept(self, obj):
        return ""

    def put_back(self, context, obj):
        """See `Kind`; handles of the original of a copy are not moved, and points only if their number is unchanged."""
        settings, data = obj.meshfree.deform, obj.data
        own = copied_from(obj) is None
        for item in settings.handle_items:
            if own and item.has_empty and is_there(item.empty):
                item.empty.matrix_world = obj.matrix_world @ Matrix(np.reshape(item.rest, (4, 4)).tolist())
        same = settings.point_count == point_count(data) and all(name in data.attributes for name in WRITES)
        if same and any(not item.has_empty for item in settings.handle_items):
            constraints = read_constraints(obj)
            rows = constraints.moved[edited_rows(obj, constraints)]
            positions = own_positions(data)
            positions[rows] = read_attribute(data, REST)[rows]
            write_own_positions(obj.data, positions)
        context.view_layer.update()
        if same:
            write_rest(obj)

    def plan_rest(self, context, obj, operator):
        settings, constraints, keyed = obj.meshfree.deform, read_constraints(obj), keyed_empties(obj)
        empties = [
            (item.empty, relative_matrix(obj, item.empty)) if item.has_empty else None for item in settings.handle_items
        ]

        def take(positions):
            record(obj, positions, np.reshape(settings.matrix, (3, 3)), constraints, empties)
            write_rest(obj)
            if keyed and not operator.keep_keyframes:
                for empty in keyed:
                    stop_moving(empty)
                operator.warn(_lost_keyframes(context.scene, keyed), obj)
            return f"{obj.name}: {len(positions):,} points are at rest where they are now"

        return take


def record(obj, rest, matrix, constraints, empties):
    """Write the binding of an object to the file: the first three fields of a `Binding`.

    `empties` has for each group of handles its empty and the matrix of that at rest in local space, (4, 4), or None.
    """
    settings = obj.meshfree.deform
    settings.handle_items.clear()
    for name, moved_by in zip(constraints.names, empties, strict=True):
        item = settings.handle_items.add()
        item.name, item.has_empty = name, moved_by is not None
        if moved_by is not None:
            item.empty, item.rest = moved_by[0], np.reshape(moved_by[1], -1)
    settings.settings_used = settings_text(obj)
    binding.record(obj, Handles.name, rest, matrix, constraints.checksum, _edited(obj, constraints))


def renew(obj, constraints):
    """Take the present points of an object that is bound to handles, which `lb_rest` holds, as those at rest."""
    binding.renew(obj, _edited(obj, constraints))


def _edited(obj, constraints):
    """Return the points that are moved in Edit Mode, which do not count as moved."""
    return constraints.moved[edited_rows(obj, constraints)]


def _empty_change(obj, item, depsgraph):
    """Return the transform of handles by their empty since they were bound, in local space, (4, 4)."""
    rest = np.reshape(item.rest, (4, 4)).astype(np.float64)
    return relative_matrix(obj, item.empty, depsgraph) @ inv(rest)


def keyed_empties(obj) -> list:
    """Return the empties with keyframed transforms that move this object alone: applying removes these keyframes."""
    items = [item for item in obj.meshfree.deform.handle_items if item.has_empty and is_there(item.empty)]
    others = [other for other in bound_objects() if other != obj]
    shared = {item.empty for other in others for item in other.meshfree.deform.handle_items}
    return [item.empty for item in items if item.empty not in shared and moves_by_keys(item.empty)]


def _lost_keyframes(scene, empties):
    names = ", ".join(f'"{empty.name}"' for empty in empties)
    return (
        f"The keyframes that moved {names} were removed: the shape of frame {scene.frame_current} is at rest now, and"
        " they would deform it again. Undo, and turn on Keep Keyframes, to keep them."
    )


_HANDLES = Handles()


def attach():
    """Let objects follow handles."""
    kinds.add(_HANDLES)


def detach():
    """End that."""
    kinds.remove(_HANDLES)
