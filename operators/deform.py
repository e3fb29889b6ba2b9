"""Deform objects by handles: bind once, then update for every move."""

from dataclasses import dataclass, replace

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.props import BoolProperty, FloatProperty, IntProperty, StringProperty
from mathutils import Vector

from ..core import Deformer, PointCloudError
from .application import ApplicationOperator, operator_reader
from .attributes import DISPLACEMENT, own_positions, point_count, write_attribute
from .groups import ANCHOR, HANDLE, chosen_weights, is_chosen, search_group
from .positions import check_movable, fill_key, target_property, write_positions
from .reading import Reading, key_positions
from .result import length_text


@dataclass
class Binding:
    """What an object was bound with.

    Attributes
    ----------
    deformer : Deformer
    reading : Reading
        The points at rest.
    target : str
        Where the deformed points go.
    key : str
        Name of the shape key that holds them, if they go to one.
    controller : int or None
        The session_uid of the empty that moves the handles; without one they are moved in Edit Mode.
    start : ndarray, (4, 4), or None
        Matrix of the controller when it was bound, in the object's space.
    """

    deformer: Deformer
    reading: Reading
    target: str
    key: str = ""
    controller: int | None = None
    start: np.ndarray | None = None


_bindings = {}  # by the object's session_uid, which undo does not change


def binding(obj):
    """Return the binding of an object, or None."""
    bound = _bindings.get(obj.session_uid)
    return bound if bound is not None and len(bound.reading.points) == point_count(obj.data) else None


def attach():
    """Forget the bindings of a file when another one is opened."""
    bpy.app.handlers.load_post.append(_forget)


def detach():
    """Give the memory back, and leave no handler behind."""
    bpy.app.handlers.load_post.remove(_forget)
    _bindings.clear()


@persistent
def _forget(*_):
    _bindings.clear()


def _find(uid):
    """Find an object by its session_uid, which neither undo nor another name changes; None if it is gone."""
    return next((obj for obj in bpy.data.objects if obj.session_uid == uid), None)


class MESHFREE_OT_deform_bind(ApplicationOperator, bpy.types.Operator):
    """Prepare the deformation: the points of one group are moved, those of another stay, and all others follow"""

    bl_idname = "meshfree.deform_bind"
    bl_label = "Bind"
    only_active = True
    writes = (DISPLACEMENT,)

    handles: StringProperty(name="Handles", description="Vertex group with the points that are moved", default=HANDLE)
    anchors: StringProperty(
        name="Anchors", description="Vertex group with the points that stay; may be missing", default=ANCHOR
    )
    rotation_aware: BoolProperty(
        name="Turn Details", description="Let details turn with the surface, as bending asks for", default=True
    )
    soft: BoolProperty(name="Soft", description="Let handles and anchors give way to a smoother surface", default=False)
    weight: FloatProperty(
        name="Weight",
        description="How strongly soft handles and anchors are pulled, in units of the surface's own resistance; the"
        " weights of their groups multiply it",
        default=1.0,
        min=0.0,
        soft_max=100.0,
    )
    controller: BoolProperty(
        name="Add Controller",
        description="Add an empty that moves, turns and scales the handles; without it they are moved in Edit Mode",
        default=True,
    )
    target: target_property()

    def plan(self, context, obj):
        check_movable(obj, self.target)
        handles = chosen_weights(obj, self.handles, "Handles")
        anchors = np.zeros_like(handles)
        if is_chosen(obj, self.anchors, ANCHOR):
            anchors = chosen_weights(obj, self.anchors, "Anchors")
        moved, kept = np.flatnonzero(handles), np.flatnonzero(anchors)
        weights = self.weight * np.concatenate([handles[moved], anchors[kept]]) if self.soft else None
        reading, operator = operator_reader(context, obj)
        aware = self.rotation_aware

        def compute(progress):
            laplacian = operator(progress)
            return reading, Deformer(laplacian, moved, kept, aware, weights, progress=progress)

        return compute

    def write(self, context, obj, result):
        reading, deformer = result
        bound = Binding(deformer, reading, self.target)
        self.warn(deformer.notices)
        if self.target == "SHAPE_KEY":
            key = write_positions(obj, reading, reading.points, self.target, "Deform")
            bound.key = key.name
            obj.active_shape_key_index = obj.data.shape_keys.key_blocks.find(key.name)
        if self.controller:
            empty = _add_controller(context, obj, reading, deformer.handles)
            bound.controller, bound.start = empty.session_uid, _in_space_of(obj, empty)
        for uid in _bindings.keys() - {other.session_uid for other in bpy.data.objects}:
            del _bindings[uid]  # of objects that were deleted
        _bindings[obj.session_uid] = bound
        write_attribute(obj.data, DISPLACEMENT, np.zeros(len(reading.points)))
        way = f'Move "{empty.name}"' if self.controller else "Move the handles in Edit Mode"
        counts = f"{len(deformer.handles):,} handles and {len(deformer.anchors):,} anchors"
        return f"{obj.name}: {counts} are bound. {way}, then update"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        for name in ("handles", "anchors"):
            search_group(layout, self, name, context.object)
        for name in ("rotation_aware", "soft"):
            layout.prop(self, name)
        row = layout.row()
        row.active = self.soft
        row.prop(self, "weight")
        for name in ("controller", "target"):
            layout.prop(self, name)


def _add_controller(context, obj, reading, handles):
    """Add an empty in the middle of the handles."""
    points = reading.points
    empty = bpy.data.objects.new(f"{obj.name} Handle", None)
    empty.empty_display_type = "SPHERE"
    empty.empty_display_size = max(
        np.linalg.norm(np.ptp(points[handles], axis=0)), 0.05 * np.linalg.norm(np.ptp(points, axis=0))
    )
    empty.location = Vector(points[handles].mean(axis=0)) + obj.matrix_world.translation
    for collection in obj.users_collection:
        collection.objects.link(empty)
    context.view_layer.update()
    return empty


class MESHFREE_OT_deform_update(ApplicationOperator, bpy.types.Operator):
    """Let all points follow the handles to where they are now"""

    bl_idname = "meshfree.deform_update"
    bl_label = "Update"
    only_active = True
    writes = (DISPLACEMENT,)

    steps: IntProperty(
        name="Steps",
        description="Most steps in which the turns of details are found; it stops when nothing moves any more",
        default=30,
        min=1,
        soft_max=100,
    )

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        if binding(context.object) is None:
            name = context.object.name
            cls.poll_message_set(
                f'"{name}" is not bound, or has got or lost points since. Bind it to its handles first'
            )
            return False
        return True

    def plan(self, context, obj):
        bound = binding(obj)
        check_movable(obj, bound.target)
        if bound.key and (obj.data.shape_keys is None or bound.key not in obj.data.shape_keys.key_blocks):
            raise PointCloudError(f'The shape key "{bound.key}" of "{obj.name}" is gone. Bind the object again.')
        goal = _handle_goal(obj, bound)
        steps = self.steps
        return lambda progress: (bound, bound.deformer.solve(goal, steps=steps, progress=progress))

    def write(self, context, obj, result):
        bound, points = result
        if bound.key:
            fill_key(obj, obj.data.shape_keys.key_blocks[bound.key], points - bound.reading.points, bound.reading)
        else:
            now = replace(bound.reading, points=bound.reading.placed(own_positions(obj.data)))
            write_positions(obj, now, points, bound.target, "")
        distance = np.linalg.norm(points - bound.reading.points, axis=1)
        write_attribute(obj.data, DISPLACEMENT, distance)
        if not bound.deformer.converged:
            self.warn(["The turns of details were still changing. Update again with more Steps."])
        return f"{obj.name}: moved at most by {length_text(distance.max())}"


def _handle_goal(obj, bound):
    """Return where the handles are to be: where the controller took them, or where they are in the mesh, (h, 3)."""
    handles, reading = bound.deformer.handles, bound.reading
    if bound.controller is not None:
        empty = _find(bound.controller)
        if empty is None:
            raise PointCloudError(f'The controller of "{obj.name}" is gone. Bind the object again.')
        change = _in_space_of(obj, empty) @ np.linalg.inv(bound.start)
        local = reading.local(reading.points[handles])
        return reading.placed(local @ change[:3, :3].T + change[:3, 3])
    if not bound.key:
        return reading.placed(own_positions(obj.data)[handles])
    # By what the key does, not by what is seen, which other keys and the key's value change too.
    keys = obj.data.shape_keys
    moved = key_positions(keys.key_blocks[bound.key]) - key_positions(keys.reference_key)
    return reading.points[handles] + reading.placed(moved[handles])


def _in_space_of(obj, empty):
    """Return the matrix of an empty in the space of an object, (4, 4) float64."""
    matrix = np.array(obj.matrix_world, dtype=np.float64)
    if not np.linalg.cond(matrix[:3, :3]) < 1e6:
        raise PointCloudError(
            f'"{obj.name}" is scaled to nothing along an axis. Give it a scale above zero along each axis.'
        )
    return np.linalg.inv(matrix) @ np.array(empty.matrix_world, dtype=np.float64)


CLASSES = (MESHFREE_OT_deform_bind, MESHFREE_OT_deform_update)
