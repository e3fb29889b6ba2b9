"""Align two clouds: move the object of one so that its points lie on the surface of the other."""

import bpy
import numpy as np
from bpy.props import BoolProperty, FloatProperty
from mathutils import Matrix

from ... import core
from ...command.alignment import ALIGN, check_found, doubts, middle
from ...command.naming import naming
from ...core import PointCloudError
from ...tools.quantities import RESIDUAL
from ..objects.attributes import tag_changed, write_attribute
from ..objects.place import check_movable, move_object, moves_with
from ..objects.reading import TYPES, find_object, obstacle, read_points
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running.application import ShownOperator, Tool
from .select import selection


def others(context):
    """Return the other selected objects that hold points."""
    return [other for other in context.selected_objects if other != context.object and other.type in TYPES]


class Motion:
    """How an object is moved onto another cloud, from where it stood when its points were read.

    Parameters
    ----------
    obj : bpy.types.Object
    shift : ndarray, (3,)
        From points as read of the object to those of the other cloud.
    other : bpy.types.Object, optional
        Of the other cloud, which must not be moved meanwhile; None for a file.
    """

    def __init__(self, obj, shift, other=None):
        check_movable(obj)
        self._matrix, self._shift = np.array(obj.matrix_world, dtype=np.float64), shift
        self._other = other and (other.session_uid, other.matrix_world.copy())

    def apply(self, obj, matrix):
        """Move the object by the matrix of an alignment of its points as read, shifted.

        Last of all: the next update of the scene tells others of it.
        """
        uid, place = self._other or (None, None)
        other = find_object(uid)
        if other is not None and other.matrix_world != place:
            raise PointCloudError(f'"{other.name}" was moved meanwhile. Start it again.')
        read, back = self._matrix.copy(), np.eye(4)
        read[:3, 3] = self._shift
        back[:3, 3] = self._matrix[:3, 3] - self._shift
        move_object(obj, Matrix(back @ matrix @ read))


ADVICE = "In Blender: move it by hand, or align it From Selected Points, three to five on each."


class Align(Tool):
    """The settings and the work of `meshfree.align_points`."""

    _move = None  # moves the object, when all else is written
    writes = (RESIDUAL,)
    asks = ("overlap", "scale", "from_selected", "show")

    overlap: FloatProperty(
        name="Overlap",
        subtype="FACTOR",
        **ALIGN["overlap"].keywords,
    )
    scale: BoolProperty(name="Scale", **ALIGN["scale"].keywords)
    from_selected: BoolProperty(
        name="From Selected Points",
        description="Begin where three to five points, selected in Edit Mode on each of both objects, meet each other",
        default=False,
    )

    def plan(self, context, obj):
        reading = read_points(context, obj)
        name, target, shift, other = self.other(context, obj)
        motion, own_name = Motion(obj, shift, other), obj.name
        pairs = self.picked(obj, other, reading.points + shift, target) if self.from_selected else None
        settings = {"overlap": self.overlap, "scale": self.scale, "pairs": pairs}

        def compute(progress):
            found = core.measure.align(reading.points + shift, target, **settings, progress=progress)
            check_found(found, own_name, name, ADVICE)
            return found, motion, name

        return compute

    def other(self, context, obj):
        """Return name and points of the other cloud, the offset between points as read, and its object."""
        (other,) = others(context)
        with naming(other.name):
            points = read_points(context, other).points
        shift = np.array(obj.matrix_world.translation) - np.array(other.matrix_world.translation)
        return other.name, points, shift, other

    @staticmethod
    def picked(obj, other, points, target):
        """Return the places of the selected points of both clouds."""
        chosen = [selection(each) for each in (obj, other)]
        for each, rows in zip((obj, other), chosen, strict=True):
            count = np.count_nonzero(rows)
            if not 3 <= count <= 5:
                raise PointCloudError(
                    f'{count:,} points of "{each.name}" are selected. Select three to five in Edit Mode, in the same'
                    f' places on "{obj.name}" and "{other.name}".'
                )
        return points[chosen[0]], target[chosen[1]]

    def write(self, context, obj, result):
        found, motion, name = result
        self._move = lambda: motion.apply(obj, found.matrix)
        write_attribute(obj.data, RESIDUAL, found.residual)
        tag_changed(obj.data)
        half = length_text(middle(found))
        size = f", scaled by {np.cbrt(np.linalg.det(found.matrix[:3, :3])):.4g}" if self.scale else ""
        line = f"{obj.name}: {found.overlap:.0%} of the points lie on {name}, half of them within {half}{size}"
        return [*doubts(found), line]


class MESHFREE_OT_align_points(Align, ShownOperator, bpy.types.Operator):
    """Move the active object so that its points lie on the surface of the other selected one, from nearby"""

    bl_idname = "meshfree.align_points"
    bl_label = "Align Points"
    adjustable = ()  # a repetition would compute it again
    only_active = keeps_line = True

    def conclude(self, context, objects):
        super().conclude(context, objects)
        self._move()

    @classmethod
    def obstacle(cls, context):
        reason = super().obstacle(context)
        if reason:
            return reason
        found = others(context)
        if len(found) != 1:
            many = f"{len(found)} others are" if found else "no other is"
            return f'"{context.object.name}" is aligned with one other cloud, and {many} selected. Select one'
        (other,) = found
        if moves_with(other, context.object):
            return f'"{other.name}" moves with "{context.object.name}", its parent. Make it the active one'
        return obstacle(other)


TOOLS = (Registration(MESHFREE_OT_align_points, panel=Row("Measure", 5, 1), menu=Row("Object", 2, 3)),)
