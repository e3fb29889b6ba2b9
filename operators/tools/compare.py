"""Two objects compared, one of which may be moved onto the other before and hidden at the end."""

import bpy
from bpy.props import BoolProperty

from ...tools import compare
from ..objects.place import activate, hide
from .align import Onto, others
from .declared import registration_of


class CompareObjects(Onto):
    """What Blender adds to the tool: what the object was compared with is kept, and hidden."""

    last = adjustable = "show", "hide_reference"
    done = "compared with"

    hide_reference: BoolProperty(
        name="Hide Reference",
        description="Hide the other cloud, which covers the colors, in views and renders",
        default=True,
    )

    @property
    def moves(self):
        """Whether the object is moved."""
        return self.align_first

    @classmethod
    def reference_of(cls, context):
        """Return the other cloud: the selected one, else that of the last comparison; None without one."""
        return super().reference_of(context) if others(context) else _compared(context)

    def write(self, context, obj, result):
        texts = super().write(context, obj, result)
        found, _, own, *_ = result
        obj.meshfree.compared_with = bpy.data.objects.get(found.other)
        obj.meshfree.compared_within = own.greatest
        obj.meshfree.compared_nearest = own.distance == "NEAREST"
        return texts

    def conclude(self, context, objects):
        """Hide the reference, which covers the colors."""
        if self.hide_reference:
            hide(objects[0].meshfree.compared_with)
        super().conclude(context, objects)


class CompareActive(CompareObjects):
    """The object that is compared is the active one."""

    bl_description = "Measure the distance of the active object's points from the surface of the other selected one"


class Swapped(CompareObjects):
    """The active object becomes the reference."""

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
            return "The active object was not compared yet. Press Compare Points under Two Scans"
        return super().obstacle(context)

    def conclude(self, context, objects):
        """Make the former reference the active object too."""
        super().conclude(context, objects)
        hide(objects[0], False)
        activate(context, objects[0])


class _Swap(compare.Compare):
    """The same tool, for what was compared before."""

    name, label, help = "compare_swap", "Swap Comparison", "Exchange the compared objects"
    panel, menu = None, compare.Compare.menu._replace(place=5)
    shows = True


def _compared(context):
    """Return the object that the active one was compared with, if it still exists, or None."""
    other = context.object and context.object.meshfree.compared_with
    return other if other is not None and other.name in context.view_layer.objects else None


TOOLS = registration_of(compare.TOOL, CompareActive), registration_of(_Swap(), Swapped)
