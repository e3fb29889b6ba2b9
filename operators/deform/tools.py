"""Deform objects by handles: bind once, then move the handles; apply the result, or reset it."""

from dataclasses import replace

import bpy
import numpy as np
from bpy.props import BoolProperty
from mathutils import Vector

from ... import core
from ...core import PointCloudError
from ...tools.groups import ANCHOR, HANDLE
from ..objects.all_or_nothing import all_or_nothing
from ..objects.attributes import (
    REST,
    point_count,
    read_attribute,
    write_attribute,
    write_own_positions,
)
from ..objects.carried import carried, shown_moved, write_discs
from ..objects.groups import assign, check_assignable, group_weights, handle_names, has_group
from ..objects.handlers import notify
from ..objects.modifiers import get_input
from ..objects.place import activate, link_beside
from ..objects.positions import add_key, check_movable
from ..objects.reading import read_points, shape_keys
from ..objects.result import length_text
from ..objects.splats import has_splats, shown_splats, write_splats
from ..registration import Registration, Row
from ..running.application import ApplicationOperator
from ..running.job import busy
from ..running.ready import ReadyOperator, reporting
from ..tools.select import SelectionOperator, groups_changed, selected
from . import live
from .binding import WRITES, forget, is_bound, stale_reason
from .follower import Follower
from .handle_kind import Handles, keyed_empties, record, renew
from .handles import constrain, copied_from, edited_rows, handled_object, plan_binding, read_constraints
from .kinds import kind_of
from .nodes import add_deform, add_shape, find_deform, is_baked, show_live, stored_name
from .pose import POSE, State, is_there, relative_matrix, write_displacement


class MESHFREE_OT_handle_add(SelectionOperator, bpy.types.Operator):
    """Make the selected points another handle: a group of its own, for which Bind adds an empty"""

    bl_idname = "meshfree.handle_add"
    bl_label = "Add Handle"

    surface = False

    def prepare(self, context, obj):
        chosen = selected(obj)
        base = obj.meshfree.deform.handles or HANDLE
        names = [base, *(f"{base}.{number:03d}" for number in range(1, 1000))]
        name = next(name for name in names if not has_group(obj, name))
        others = handle_names(obj)
        check_assignable(obj, name, must_exist=False)
        for other in others:
            check_assignable(obj, other, must_exist=True)

        def change():
            for other in others:  # a point has one handle
                assign(obj, other, chosen, "REMOVE", 1.0)
            assign(obj, name, chosen, "REPLACE", 1.0)
            groups_changed(obj)
            return f'{np.count_nonzero(chosen):,} points are in the group "{name}"'

        return change


class HandledOperator(ReadyOperator):
    """An operator on the active object, or on the one that the active empty moves."""

    @classmethod
    def subject(cls, context):
        return handled_object(context.object, context.scene)


class MESHFREE_OT_deform_bind(HandledOperator, ApplicationOperator, bpy.types.Operator):
    """Prepare the deformation: points of some groups are moved, those of another stay, and all others follow"""

    bl_idname = "meshfree.deform_bind"
    bl_label = "Bind"
    only_active = True
    writes = WRITES

    @classmethod
    def description(cls, context, properties):
        """Return the tooltip of the button in the panel; empty for that of the class."""
        if not properties.at_once:
            return ""
        return (
            "Make the upper end of the surface a handle and the other one an anchor, unless there are handles, and bind"
        )

    def plan(self, context, obj):
        settings = obj.meshfree.deform
        if is_bound(obj) and settings.kind != Handles.name:
            followed = kind_of(obj).followed
            raise PointCloudError(f'"{obj.name}" follows the {followed} of an armature. Apply or unbind it first.')
        if self.at_once and settings.handles and not handle_names(obj):
            return _plan_ends(context, obj)
        constraints = read_constraints(obj)
        reading = read_points(context, obj)
        rest = reading.local(reading.points).astype(np.float32)
        items = settings.handle_items
        kept = {item.name: item for item in items if item.has_empty and is_there(item.empty)}
        by_empty = [settings.add_empties or name in kept for name in constraints.names]
        edited = constraints.moved[~np.array(by_empty)[constraints.owner]]
        if len(edited) and (shape_keys(obj) is not None or obj.meshfree.use_modifiers):
            raise PointCloudError(
                f'Moving the {len(edited)} handles of "{obj.name}" in Edit Mode requires a mesh without shape keys and'
                " used modifiers. Turn on Add Empties."
            )
        if is_bound(obj) and settings.point_count == len(rest) and obj.data.attributes.get(REST) is not None:
            rest[edited] = read_attribute(obj.data, REST)[edited]  # they have been moved since
        binding = plan_binding(obj, rest, reading.matrix, constraints)
        return lambda progress: (Follower(binding, progress), by_empty, False)

    def write(self, context, obj, result):
        follower, by_empty, chosen = result
        binding = follower.binding
        rest, constraints = binding.rest, binding.constraints
        if chosen:
            _assign_ends(obj, constraints)
        items = obj.meshfree.deform.handle_items
        kept = {item.name: (item.empty, tuple(item.rest)) for item in items if item.has_empty and is_there(item.empty)}
        if copied_from(obj) is not None:
            kept = {name: (_copy_empty(obj, empty), rest) for name, (empty, rest) in kept.items()}
        empties = []
        for index, name in enumerate(constraints.names):
            moved_by = kept.get(name)
            if by_empty[index] and moved_by is None:
                rows = constraints.moved[constraints.owner == index]
                empty = _add_empty(context, obj, name, rest, rows)
                moved_by = empty, relative_matrix(obj, empty)
            empties.append(moved_by)
        record(obj, rest, binding.matrix, constraints, empties)
        add_deform(obj)
        notify("shape_changed", obj)
        # Blender crashes when it draws what handlers change during a render.
        context.scene.render.use_lock_interface = True
        live.keep(obj, follower)
        obj.data.pop(POSE, None)
        write_displacement(obj, np.zeros_like(rest), np.zeros(0), State.PREPARING, {})
        live.update(obj, wanted=State.SETTLED if bpy.app.background else State.PREPARING)
        moved, stay = len(constraints.moved), len(constraints.kept)
        press = "Press G or R to move" if self.at_once else "Move"
        advice = f'{press} "{empties[0][0].name}"' if empties[0] else "Move the handles in Edit Mode"
        return [*follower.notices, f"{obj.name}: {moved:,} handles and {stay:,} anchors are bound. {advice}"]

    def conclude(self, context, objects):
        item = objects[0].meshfree.deform.handle_items[0]
        if self.at_once and item.has_empty and item.empty.name in context.view_layer.objects:
            activate(context, item.empty)


def _plan_ends(context, obj):
    """Read an object without handles; return a plan that chooses them and binds it.

    The upper end of the surface becomes the handle, the other one the anchor. If there are anchors already, the end
    farther from them becomes the handle.
    """
    settings, reading = obj.meshfree.deform, read_points(context, obj)
    name, anchors = settings.handles, settings.anchors or ANCHOR
    check_assignable(obj, name, must_exist=False)
    held = group_weights(obj, anchors) if has_group(obj, anchors) else np.zeros(len(reading.points))
    if not held.any():
        check_assignable(obj, anchors, must_exist=False)

    def choose(laplacian, progress):
        progress("Ends", 0.0)
        points, kept = laplacian.points, held > 0.0
        ends = core.distance.opposite_ends(laplacian)
        if kept.any():
            center = points[kept].mean(axis=0)
            ends = sorted(ends, key=lambda rows: np.linalg.norm(points[rows].mean(axis=0) - center))
        else:
            ends = sorted(ends, key=lambda rows: points[rows, 2].mean())
        weights = np.zeros(len(points))
        weights[ends[1]] = 1.0
        stay = held if kept.any() else np.isin(np.arange(len(points)), ends[0]).astype(np.float64)
        return constrain([name], np.where(stay > 0.0, 0.0, weights)[None], stay)

    binding = plan_binding(obj, reading.local(reading.points).astype(np.float32), reading.matrix)

    def compute(progress):
        found = choose(binding.laplacian(progress), progress)
        return Follower(replace(binding, constraints=found), progress), [True], True

    return compute


def _assign_ends(obj, constraints):
    """Add the groups of handles and anchors that `_plan_ends` has chosen, where they are missing."""
    if handle_names(obj):  # while it was computed
        raise PointCloudError(f'"{obj.name}" has handles by now. Press Bend again to take these.')
    settings, every = obj.meshfree.deform, np.arange(point_count(obj.data))
    settings.anchors = settings.anchors or ANCHOR
    assign(obj, constraints.names[0], np.isin(every, constraints.moved), "REPLACE", 1.0)
    if not has_group(obj, settings.anchors) or not group_weights(obj, settings.anchors).any():
        assign(obj, settings.anchors, np.isin(every, constraints.kept), "REPLACE", 1.0)
    groups_changed(obj)


def _add_empty(context, obj, name, rest, rows):
    """Add an empty at the center of a group of handles, as a child of the object."""
    points = rest[rows].astype(np.float64)
    empty = bpy.data.objects.new(f"{obj.name} {name}", None)
    empty.empty_display_type = "SPHERE"
    empty.empty_display_size = max(
        0.5 * np.linalg.norm(np.ptp(points, axis=0)), 0.03 * np.linalg.norm(np.ptp(rest, axis=0))
    )
    empty.parent = obj
    empty.location = Vector(points.mean(axis=0))
    link_beside(empty, obj)
    context.view_layer.update()
    return empty


def _copy_empty(obj, empty):
    """Copy an empty, with its animation, for a copied object."""
    copy = empty.copy()
    copy.parent = obj
    link_beside(copy, obj)
    return copy


class BoundOperator(HandledOperator):
    """An operator on a bound object."""

    works_stale = False  # whether the binding may be stale

    @classmethod
    def lack(cls, context, obj):
        return busy() or not_bound(obj)

    @reporting
    def execute(self, context):
        obj = self.subject(context)
        if not self.works_stale:
            check_fresh(obj)
            context.view_layer.update()
            live.update(obj)  # settles a quick result
        with all_or_nothing([obj, *kind_of(obj).written(obj)]):
            line = self.change(context, obj)
        self.report({"INFO"}, line)
        return {"FINISHED"}


def not_bound(obj) -> str:
    """Return that an object is not bound, and what to do; empty if it is."""
    return "" if is_bound(obj) else f'"{obj.name}" is not bound. Bind it to its handles first'


def check_fresh(obj):
    """Refuse a bound object that no longer follows."""
    reason = stale_reason(obj)
    if reason:
        raise PointCloudError(f'"{obj.name}" is not up to date. {reason}.')


class MESHFREE_OT_deform_update(HandledOperator, ApplicationOperator, bpy.types.Operator):
    """Compute the full deformation for the present handles, as happens automatically when they are moved"""

    bl_idname = "meshfree.deform_update"
    bl_label = "Update"
    only_active = True
    writes = WRITES

    @classmethod
    def lack(cls, context, obj):
        return not_bound(obj)

    def plan(self, context, obj):
        check_fresh(obj)
        pose = kind_of(obj).read_pose(obj)
        compute = live.plan_settled(obj, pose)
        return lambda progress: (pose, *compute(progress))

    def write(self, context, obj, result):
        pose, follower, moved = result
        live.keep(obj, follower)
        live.write(obj, follower, moved, pose)
        distance = np.linalg.norm(moved.displacement @ np.reshape(obj.meshfree.deform.matrix, (3, 3)).T, axis=1)
        notices = [] if moved.converged else ["The rotations had not converged. Raise Steps."]
        return [*notices, f"{obj.name}: moved at most by {length_text(distance.max())}"]


class MESHFREE_OT_deform_apply(BoundOperator, bpy.types.Operator):
    """Apply the deformation to the points, as the new rest shape"""

    bl_idname = "meshfree.deform_apply"
    bl_label = "Apply"

    keep_keyframes: BoolProperty(
        name="Keep Keyframes",
        description="Keep the keyframes of the handles, which deform the applied shape again from the next frame on",
        default=False,
    )

    @classmethod
    def lack(cls, context, obj):
        return super().lack(context, obj) or kind_of(obj).held(obj)

    def invoke(self, context, event):
        """Ask, where keyframes would be lost."""
        if bpy.app.background or not keyed_empties(self.subject(context)):
            return self.execute(context)
        return context.window_manager.invoke_props_dialog(self)

    def change(self, context, obj):
        check_movable(obj, "IN_PLACE")
        take = kind_of(obj).plan_rest(context, obj, self)
        positions = (read_attribute(obj.data, REST) + shown_displacement(obj)).astype(np.float32)
        if has_splats(obj.data):
            write_splats(obj.data, shown_splats(obj))
        else:
            write_own_positions(obj.data, positions)
            for values in shown_moved(obj, get_input(find_deform(obj), "Strength")).values():
                write_discs(obj, values)
        return take(positions)


class MESHFREE_OT_deform_to_shape_key(BoundOperator, bpy.types.Operator):
    """Store the deformation as a shape key of value zero, or as a modifier like one, and reset the handles"""

    bl_idname = "meshfree.deform_to_shape_key"
    bl_label = "To Shape Key"

    @classmethod
    def lack(cls, context, obj):
        return super().lack(context, obj) or kind_of(obj).held(obj)

    def change(self, context, obj):
        if obj.type != "MESH" or has_splats(obj.data):  # shape keys hold positions only
            return self._store(context, obj)
        check_movable(obj, "SHAPE_KEY")
        constraints = read_constraints(obj)
        if edited_rows(obj, constraints).any():
            raise PointCloudError(
                f'Handles of "{obj.name}" are moved in Edit Mode, which a mesh with shape keys does not allow.'
                " Turn on Add Empties and bind again."
            )
        key = add_key(obj, "Deform", shown_displacement(obj))
        kind_of(obj).put_back(context, obj)
        known = live.find(obj)
        renew(obj, constraints)
        if known is not None:
            live.keep(obj, known)
        return f'{obj.name}: the deformation is the shape key "{key.name}"'

    def _store(self, context, obj):
        """Store the deformation as attributes, shown by a modifier."""
        data, name = obj.data, _free_name(obj, "Deform")
        moved = shown_moved(obj, get_input(find_deform(obj), "Strength"))
        kept = [item for item in carried(data) if item.moved in moved]
        write_attribute(data, name, shown_displacement(obj), "FLOAT_VECTOR")
        for item in kept:
            write_attribute(data, stored_name(name, item.name), moved[item.moved], item.data_type)
        kind_of(obj).put_back(context, obj)
        add_shape(obj, name, kept)
        return f'{obj.name}: the deformation is the modifier "{name}", shown by its Value'


def _free_name(obj, name):
    """Return a name, numbered if necessary, that no attribute, vertex group or modifier of an object has."""
    taken = {item.name for items in (obj.data.attributes, obj.vertex_groups, obj.modifiers) for item in items}
    names = [name, *(f"{name}.{number:03d}" for number in range(1, len(taken) + 2))]
    return next(each for each in names if each not in taken)


class MESHFREE_OT_deform_reset(BoundOperator, bpy.types.Operator):
    """Reset the handles to where they were bound, and all points to rest"""

    bl_idname = "meshfree.deform_reset"
    bl_label = "Reset"
    works_stale = True

    @classmethod
    def lack(cls, context, obj):
        return super().lack(context, obj) or kind_of(obj).kept(obj)

    def change(self, context, obj):
        kind_of(obj).put_back(context, obj)
        return f"{obj.name}: handles and points are at rest"


class MESHFREE_OT_deform_unbind(BoundOperator, bpy.types.Operator):
    """Remove the binding: points return to rest, and the modifier and its attributes are removed"""

    bl_idname = "meshfree.deform_unbind"
    bl_label = "Unbind"
    works_stale = True

    delete_empties: BoolProperty(
        name="Delete Empties", description="Delete the empties that moved the handles", default=True
    )

    def change(self, context, obj):
        others = [other for other in bpy.data.objects if other != obj]  # including copies, which may be bound again
        used = {item.empty for other in others for item in other.meshfree.deform.handle_items}
        empties = [item.empty for item in obj.meshfree.deform.handle_items if is_there(item.empty)]
        kind_of(obj).put_back(context, obj)
        if is_baked(obj):
            delete_bake(obj)
        forget(obj)
        if self.delete_empties:
            for empty in empties:
                if empty.type == "EMPTY" and empty not in used:
                    bpy.data.objects.remove(empty)
        return f"{obj.name}: is no longer bound"


def shown_displacement(obj):
    """Read the displacements in local space as the modifier shows them, (n, 3)."""
    return read_attribute(obj.data, WRITES[0]) * get_input(find_deform(obj), "Strength")


def delete_bake(obj):
    """Remove the bake of an object, so that it follows its handles again."""
    modifier = find_deform(obj)
    cache = get_input(modifier, "Cache")
    show_live(modifier)
    if cache is not None and not cache.users:  # a copy of the object may show it, too
        bpy.data.meshes.remove(cache.data)  # and the object that shows it


TOOLS = (
    Registration(MESHFREE_OT_handle_add),
    Registration(MESHFREE_OT_deform_bind, menu=Row("Object", 8, 1), quick=Row("Object", 1, 4, "Bend")),
    Registration(MESHFREE_OT_deform_update, panel=Row("Bend", 1, 1), menu=Row("Object", 8, 2)),
    Registration(MESHFREE_OT_deform_apply, panel=Row("Bend", 1, 3), menu=Row("Object", 8, 4)),
    Registration(MESHFREE_OT_deform_to_shape_key, panel=Row("Bend", 1, 4), menu=Row("Object", 8, 5)),
    Registration(MESHFREE_OT_deform_reset, panel=Row("Bend", 1, 2), menu=Row("Object", 8, 3)),
    Registration(MESHFREE_OT_deform_unbind, panel=Row("Bend", 1, 7), menu=Row("Object", 8, 6)),
)
