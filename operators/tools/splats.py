"""Tools for Gaussian splats: applying transforms, joining."""

import bpy
import numpy as np
from mathutils import Matrix

from ... import core
from ...core import PointCloudError
from ...core.files import is_coarse
from ...core.linalg import cond, inv
from ..objects.all_or_nothing import all_or_nothing
from ..objects.attributes import point_count, read_attribute, write_attribute
from ..objects.modifiers import is_deform
from ..objects.place import OFFSET, offset_of
from ..objects.positions import check_movable
from ..objects.reading import obstacle, sharing_objects
from ..objects.splat_file import (
    DIGITS,
    OWN_OFFSET,
    RAW,
    add_columns,
    keep_raw,
    own_places,
    write_places,
)
from ..objects.splats import (
    LEFT_BEHIND,
    PLACE,
    are_left_behind,
    has_splats,
    read_splats,
    write_splats,
)
from ..registration import Registration, Row
from ..running.ready import ReadyOperator, reporting

_ROUNDING = 1e-12  # of products of matrices


class SplatOperator(ReadyOperator):
    """An operator on the splats of the active object."""

    takes = staticmethod(has_splats)  # whether it works on the data of an object

    @classmethod
    def lack(cls, context, obj):
        return "" if cls.takes(obj.data) else f'"{obj.name}" holds no Gaussian splats. Import a file of splats'


class MESHFREE_OT_apply_to_splats(SplatOperator, bpy.types.Operator):
    """Apply location, rotation and scale of the object to its splats, with their sizes, rotations and harmonics"""

    bl_idname = "meshfree.apply_to_splats"
    bl_label = "Apply Transform to Splats"

    @reporting
    def execute(self, context):
        obj = context.object
        matrix = np.array(obj.matrix_basis, dtype=np.float64)
        _check_placeable(obj, matrix)
        _check_single(obj)
        if are_left_behind(obj.data):
            self.warn(f"{obj.name}: {LEFT_BEHIND}", obj)
        splats = _placed(obj, matrix)
        with all_or_nothing([obj]):
            write_splats(obj.data, splats)
            write_places(obj.data, splats.positions)
            if OWN_OFFSET in obj:  # now in the axes of the world
                del obj[OWN_OFFSET]
            children = [(child, child.matrix_world.copy()) for child in obj.children]
            obj.matrix_basis = Matrix()
            context.view_layer.update()
            for child, place in children:
                child.matrix_world = place
        self.report({"INFO"}, f"{obj.name}: its transform is applied to its {len(splats):,} splats")
        return {"FINISHED"}


class MESHFREE_OT_join_splats(SplatOperator, bpy.types.Operator):
    """Join the splats of all selected objects into the active one, with their transforms applied"""

    bl_idname = "meshfree.join_splats"
    bl_label = "Join Splats"

    @classmethod
    def lack(cls, context, obj):
        alone = "" if _others(context) else f'Select further objects of splats, to join with "{obj.name}"'
        return super().lack(context, obj) or alone

    @reporting
    def execute(self, context):
        obj, others = context.object, _others(context)
        _check_together(obj, others)
        matrix = inv(np.array(obj.matrix_world, dtype=np.float64))
        parts = [_placed(other, matrix @ _apart(other, obj) @ np.array(other.matrix_world)) for other in others]
        _check_near(obj, others, parts)
        for each in filter(lambda each: are_left_behind(each.data), (obj, *others)):
            self.warn(f"{each.name}: {LEFT_BEHIND}", obj)
        count = point_count(obj.data) + sum(map(len, parts))
        left_alone = len(context.selected_objects) - len(others) - obj.select_get()
        with all_or_nothing([obj]):
            _join(context, obj, others, parts)
            _remove(context, others)
        if left_alone:
            self.warn(f"{left_alone} selected objects have no splats and were skipped", obj)
        self.report({"INFO"}, f"{obj.name}: the splats of {len(parts) + 1} objects, {count:,} in all")
        return {"FINISHED"}


def _others(context):
    """Return the selected objects of splats that are not the active one."""
    fit = (obj for obj in context.selected_objects if obj != context.object and not obstacle(obj))
    return [obj for obj in fit if has_splats(obj.data)]


def _check_single(obj):
    """Refuse an object that shares its points with others."""
    others = sharing_objects(obj)
    if others:
        raise PointCloudError(f'"{obj.name}" shares its points with "{others[0].name}". Make it a single user first.')


def _check_placeable(obj, matrix):
    """Refuse an object whose splats cannot be moved by a matrix, (4, 4), before anything is computed."""
    check_movable(obj, "IN_PLACE")
    if any(map(is_deform, obj.modifiers)):
        raise PointCloudError(f'"{obj.name}" is bound. Unbind it first.')
    if not cond(matrix[:3, :3]) < 1e6:
        raise PointCloudError(
            f'"{obj.name}" is scaled to nothing along an axis. Give it a scale above zero along each axis.'
        )


def _check_together(obj, others):
    """Refuse objects that cannot become one."""
    _check_single(obj)
    bpy.context.view_layer.update()  # a script may have moved them a line ago
    for each in (obj, *others):
        _check_placeable(each, np.array(each.matrix_world, dtype=np.float64))
        if each.type != obj.type:
            raise PointCloudError(
                f'"{each.name}" and "{obj.name}" are not of one kind. Convert one of them with Object > Convert.'
            )


def _apart(other, obj):
    """Return the difference of the import offsets of two objects as a matrix."""
    matrix = np.eye(4)
    if OFFSET in other and OFFSET in obj:
        matrix[:3, 3] = offset_of(other) - offset_of(obj)
    return matrix


def _check_near(obj, others, parts):
    """Refuse splats that are too far apart for one object."""
    for other, part in zip(others, parts, strict=True):
        if (_apart(other, obj) != np.eye(4)).any() and is_coarse(part.positions):
            raise PointCloudError(
                f'"{other.name}" is too far from "{obj.name}" for one object. Select both and use Export Splats, which'
                " writes them to one file."
            )


def _placed(obj, matrix):
    """Return the splats of an object transformed by a matrix, (4, 4), from local space."""
    splats, places = read_splats(obj.data), own_places(obj.data)
    matrix = np.where(np.abs(matrix - np.eye(4)) < _ROUNDING, np.eye(4), matrix)  # keeps splats exact without rotation
    maps = np.broadcast_to(matrix[:3, :3], (len(splats), 3, 3))
    return splats.deformed(places @ matrix[:3, :3].T + matrix[:3, 3], maps)


def _join(context, obj, others, parts):
    """Join splats, already in an object's local space, into it, with all other attributes of their objects."""
    copies = [_copied(obj, other, part) for other, part in zip(others, parts, strict=True)]
    everyone = [obj, *copies]
    _keep_places(obj.data, own_places(obj.data))
    if any(name in each.data.attributes for each in everyone for name in RAW):
        for each in everyone:
            keep_raw(each.data, core.splats.encoded(read_splats(each.data, with_harmonics=False), {}))
    add_columns(obj, others)
    georeferenced = next((each for each in (obj, *others) if OFFSET in each), obj)
    if OFFSET not in obj and georeferenced != obj:
        obj[OFFSET] = offset_of(georeferenced).tolist()
    taken = [copy.data for copy in copies]
    context.view_layer.update()
    with context.temp_override(active_object=obj, selected_objects=everyone, selected_editable_objects=everyone):
        bpy.ops.object.join()
    bpy.data.batch_remove(taken)  # left without users by Blender
    # Join has transformed positions, which were right already, in single precision.
    write_places(obj.data, read_attribute(obj.data, PLACE).astype(np.float64) + read_attribute(obj.data, DIGITS))


def _copied(obj, other, part):
    """Return a copy of an object with the transform of another one, in whose local space its splats are."""
    copy = other.copy()
    copy.data = other.data.copy()
    copy.parent = None
    copy.constraints.clear()
    copy.matrix_world = obj.matrix_world
    obj.users_collection[0].objects.link(copy)
    write_splats(copy.data, part)
    _keep_places(copy.data, part.positions)
    return copy


def _keep_places(data, places):
    """Write positions in double precision, (n, 3), as attributes that transforms leave alone."""
    single = places.astype(np.float32)
    write_attribute(data, PLACE, single, "FLOAT_VECTOR")
    write_attribute(data, DIGITS, places - single, "FLOAT_VECTOR")


def _remove(context, objects):
    """Remove objects with their data; children stay where they are."""
    children = [(child, child.matrix_world.copy()) for obj in objects for child in obj.children]
    blocks = {obj.data for obj in objects if set(sharing_objects(obj)) <= set(objects)}
    for child, place in children:
        child.parent = None
        child.matrix_world = place
    bpy.data.batch_remove([*objects, *blocks])
    context.view_layer.update()


TOOLS = (
    Registration(MESHFREE_OT_apply_to_splats, panel=Row("Splats", 1, 3), menu=Row("Object", 10, 1)),
    Registration(MESHFREE_OT_join_splats, panel=Row("Splats", 1, 4), menu=Row("Object", 10, 2)),
)
