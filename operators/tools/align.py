"""Align two clouds: move the object of one so that its points lie on the surface of the other."""

import numpy as np
from bpy.props import BoolProperty
from mathutils import Matrix

from ...core import PointCloudError
from ...tools import align_points
from ..objects.place import check_movable, move_object, moves_with
from ..objects.reading import TYPES, find_object, obstacle
from .declared import registration_of
from .select import selection


def others(context):
    """Return the other selected objects that hold points."""
    return [other for other in context.selected_objects if other != context.object and other.type in TYPES]


class Motion:
    """How an object is moved onto another cloud, from where it stood when its points were read.

    The other one must not be moved meanwhile.
    """

    def __init__(self, obj, other):
        check_movable(obj)
        self._matrix = np.array(obj.matrix_world, dtype=np.float64)
        self._uid, self._place = other.session_uid, other.matrix_world.copy()

    def apply(self, obj, matrix):
        """Move the object by the matrix of an alignment, in the coordinates of the other one's points as read.

        Last of all: the next update of the scene tells others of it.
        """
        other = find_object(self._uid)
        if other is not None and other.matrix_world != self._place:
            raise PointCloudError(f'"{other.name}" was moved meanwhile. Start it again.')
        read, back = self._matrix.copy(), np.eye(4)
        shift = self._matrix[:3, 3] - np.array(self._place.translation)
        read[:3, 3] = shift
        back[:3, 3] = self._matrix[:3, 3] - shift
        move_object(obj, Matrix(back @ matrix @ read))


class Onto:
    """What Blender adds to tools that hold the active object against another one: the object may be moved onto that."""

    adjustable = ()  # a repetition would compute it again
    only_active = True
    moves = True
    _move = None  # moves the object, when all else is written

    @classmethod
    def reference_of(cls, context):
        """Return the other object; None if no single one is selected."""
        found = others(context)
        return found[0] if len(found) == 1 else None

    def plan(self, context, obj):
        planned = super().plan(context, obj)
        motion = Motion(obj, self.reference_of(context)) if self.moves else None
        return lambda progress: (*planned(progress), motion)

    def store(self, context, obj, outcome, result):
        super().store(context, obj, outcome, result)
        *_, motion = result
        if motion is not None:
            self._move = lambda: motion.apply(obj, outcome.matrix)

    def conclude(self, context, objects):
        super().conclude(context, objects)
        if self._move is not None:
            self._move()

    @classmethod
    def lack(cls, context, obj):
        other, count = cls.reference_of(context), len(others(context))
        if other is None:
            many = f"{count} others are" if count else "no other is"
            return f'"{context.object.name}" is {cls.done} one other cloud, and {many} selected. Select one'
        return obstacle(other)


class AlignObject(Onto):
    """What Blender adds to the tool: pairs of selected points to begin with."""

    bl_description = (
        "Move the active object so that its points lie on the surface of the other selected one, from nearby"
    )
    last = "from_selected", "show"
    done = "aligned with"

    from_selected: BoolProperty(
        name="From Selected Points",
        description="Begin where three to five points, selected in Edit Mode on each of both objects, meet each other",
        default=False,
    )

    def inputs(self, cloud, own):
        cloud, other, shift, pairs = super().inputs(cloud, own)
        if self.from_selected:
            first, second = _picked(cloud.obj, other.obj)
            pairs = (cloud.points + shift)[first], other.points[second]
        return cloud, other, shift, pairs

    @classmethod
    def lack(cls, context, obj):
        reason, other = super().lack(context, obj), cls.reference_of(context)
        if not reason and moves_with(other, obj):
            return f'"{other.name}" moves with "{obj.name}", its parent. Make it the active one'
        return reason


def _picked(obj, other):
    """Return the selected points of both objects, (n,) bool each."""
    chosen = [selection(each) for each in (obj, other)]
    for each, rows in zip((obj, other), chosen, strict=True):
        count = np.count_nonzero(rows)
        if not 3 <= count <= 5:
            raise PointCloudError(
                f'{count:,} points of "{each.name}" are selected. Select three to five in Edit Mode, in the same'
                f' places on "{obj.name}" and "{other.name}".'
            )
    return chosen


TOOLS = (registration_of(align_points.TOOL, AlignObject),)
