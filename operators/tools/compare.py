"""Compare two clouds: signed distances of the points of one from the surface of the other."""

from types import SimpleNamespace
from typing import NamedTuple

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty

from ...command.alignment import doubts
from ...command.comparison import COMPARE, Compared, Sided, compared, line
from ...command.naming import naming
from ...tools.quantities import COMPARED, DEVIATION
from ..objects.attributes import tag_changed, write_attribute
from ..objects.place import activate, hide
from ..objects.reading import obstacle
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running.application import ShownOperator, Tool, operator_reader
from .align import ADVICE, Motion, others


class _Result(NamedTuple):
    """What was measured, from which other cloud, and how the object is moved onto it or None."""

    compared: Compared
    other: str
    motion: Motion | None


class Compare(Tool):
    """The settings and the work of `meshfree.compare`."""

    _move = None  # moves the object, when all else is written
    writes = (DEVIATION, COMPARED)
    asks = ("align_first", "distance", "greatest", "show", "hide_reference")
    at_zero = {"greatest": "Any"}

    align_first: BoolProperty(
        name="Align First",
        **COMPARE["align_first"].keywords,
    )
    distance: EnumProperty(
        name="Distance",
        items=(
            ("NORMAL", "Along Normal", "Along the normal of each point: positive on the outer side, negative within"),
            ("NEAREST", "Nearest", "To the nearest place of the other surface, without a sign"),
        ),
        **COMPARE["distance"].keywords,
    )
    greatest: FloatProperty(
        name="Greatest Distance",
        subtype="DISTANCE",
        **COMPARE["greatest"].keywords,
    )
    hide_reference: BoolProperty(
        name="Hide Reference",
        description="Hide the other cloud, which covers the colors, in views and renders",
        default=True,
    )

    def plan(self, context, obj):
        reading, operator = operator_reader(context, obj)
        name, other, other_operator, shift, target = self.other(context, obj)
        names, motion = (obj.name, name), Motion(obj, shift, target) if self.align_first else None
        settings = SimpleNamespace(distance=self.distance, greatest=self.greatest, align_first=self.align_first)

        def compute(progress):
            found = compared(
                reading.points + shift,
                lambda progress: Sided(operator(progress), reading.orientation),
                lambda progress: Sided(other_operator(progress), other.orientation),
                settings,
                names,
                ADVICE,
                progress,
            )
            return _Result(found, name, motion)

        return compute

    def other(self, context, obj):
        """Return name, reading and operator function of the other cloud, the offset between points, and its object."""
        other = self.reference_of(context)
        with naming(other.name):
            reading, operator = operator_reader(context, other)
        # Points are read without the location of their objects.
        shift = np.array(obj.matrix_world.translation) - np.array(other.matrix_world.translation)
        return other.name, reading, operator, shift, other

    @classmethod
    def reference_of(cls, context):
        """Return the other cloud: the selected one, else that of the last comparison; None without one."""
        selected = others(context)
        if len(selected) == 1:
            return selected[0]
        return None if selected else _compared(context)

    def write(self, context, obj, result):
        (found, aligned, notices), name, motion = result
        told, self._move = [], lambda: None
        if aligned is not None:
            self._move = lambda: motion.apply(obj, aligned.matrix)
            told = [f"{obj.name} was moved: {aligned.overlap:.0%} of its points lie on {name}.", *doubts(aligned)]
        obj.meshfree.compared_with = bpy.data.objects.get(name)  # None for a file
        obj.meshfree.compared_within = self.greatest
        obj.meshfree.compared_nearest = self.distance == "NEAREST"
        write_attribute(obj.data, DEVIATION, found.distance)
        write_attribute(obj.data, COMPARED, found.known)
        tag_changed(obj.data)
        return [*told, *notices, line(found, obj.name, name, length_text)]


class CompareOperator(Compare, ShownOperator):
    """The base of operators that compare."""

    adjustable = ("show", "hide_reference")
    only_active = keeps_line = True

    @classmethod
    def obstacle(cls, context):
        reason = super().obstacle(context)
        if reason:
            return reason
        other = cls.reference_of(context)
        if other is None:
            count = len(others(context))
            many = f"{count} others are" if count else "no other is"
            return f'"{context.object.name}" is compared with one other cloud, and {many} selected. Select one'
        return obstacle(other)

    def conclude(self, context, objects):
        """Hide the reference, which covers the colors."""
        super().conclude(context, objects)
        if self.hide_reference:
            hide(objects[0].meshfree.compared_with)
        self._move()


class MESHFREE_OT_compare(CompareOperator, bpy.types.Operator):
    """Measure the distance of the active object's points from the surface of the other selected one"""

    bl_idname = "meshfree.compare"
    bl_label = "Compare Points"


class MESHFREE_OT_compare_swap(CompareOperator, bpy.types.Operator):
    """Exchange the compared objects"""

    bl_idname = "meshfree.compare_swap"
    bl_label = "Swap Comparison"
    asks = ()

    @classmethod
    def subject(cls, context):
        return _compared(context)

    @classmethod
    def reference_of(cls, context):
        return context.object

    @classmethod
    def obstacle(cls, context):
        if cls.subject(context) is None:
            return "The active object was not compared yet. Press Compare Points under Measure"
        return super().obstacle(context)

    def conclude(self, context, objects):
        """Make the former reference the active object too."""
        super().conclude(context, objects)
        hide(objects[0], False)
        activate(context, objects[0])


def _compared(context):
    """Return the object that the active one was compared with, if it still exists, or None."""
    other = context.object and context.object.meshfree.compared_with
    return other if other is not None and other.name in context.view_layer.objects else None


TOOLS = (
    Registration(MESHFREE_OT_compare, panel=Row("Measure", 5, 2), menu=Row("Object", 2, 4)),
    Registration(MESHFREE_OT_compare_swap, menu=Row("Object", 2, 5)),
)
