"""Vertex groups and objects of the parts of a segmentation."""

import bpy
import numpy as np
from bpy.props import BoolProperty

from ...core import PointCloudError
from ...tools import segment
from ...tools.quantities import SEGMENT
from ..objects.attributes import read_attribute, write_attribute
from ..objects.deleting import keep_points, split_off
from ..objects.result import EIGENVALUES, check_writable
from ..registration import Registration, Row
from ..running.application import ApplicationOperator
from .declared import registration_of

GROUP = "Segment {}"  # of vertex groups and objects


class SegmentGroups:
    """What Blender adds to the tool: a vertex group of each part."""

    vertex_groups: BoolProperty(
        name="Vertex Groups",
        description="Make a vertex group of each part; of point clouds an attribute",
        default=False,
    )

    @property
    def asks(self):
        return *super().asks[:-1], "vertex_groups", "show"

    @property
    def adjustable(self):
        return "vertex_groups", "show"

    def plan(self, context, obj):
        if self.vertex_groups and obj.type == "MESH":
            _check_groups(obj)
        return super().plan(context, obj)

    def write(self, context, obj, result):
        texts = super().write(context, obj, result)
        if self.vertex_groups:
            parts = read_attribute(obj.data, SEGMENT)
            _write_groups(obj, [parts == label for label in range(int(parts.max()) + 1)])
        return texts


def _is_numbered(name):
    start = GROUP.format("")
    return name.startswith(start) and name.removeprefix(start).isdecimal()


def _write_groups(obj, members):
    """Write a group for each part, given by its points, (n,) bool, in place of earlier ones."""
    kept = obj.vertex_groups if obj.type == "MESH" else obj.data.attributes
    for name in [group.name for group in kept if _is_numbered(group.name)]:
        kept.remove(kept[name])
    for label, chosen in enumerate(members):
        if obj.type == "MESH":
            kept.new(name=GROUP.format(label)).add(np.flatnonzero(chosen).tolist(), 1.0, "REPLACE")
        else:
            write_attribute(obj.data, GROUP.format(label), chosen, "BOOLEAN")


def _check_groups(obj):
    """Refuse an object where groups of parts cannot be written."""
    locked = [group.name for group in obj.vertex_groups if _is_numbered(group.name) and group.lock_weight]
    if locked:
        raise PointCloudError(
            f'The vertex groups {", ".join(locked)} of "{obj.name}" are locked, and would be replaced. Unlock'
            " or rename them."
        )
    taken = [attribute.name for attribute in obj.data.attributes if _is_numbered(attribute.name)]
    if taken:
        raise PointCloudError(
            f'"{obj.name}" has attributes named {", ".join(taken)}, and vertex groups share their names.'
            " Rename these attributes."
        )


class MESHFREE_OT_separate_by_segment(ApplicationOperator, bpy.types.Operator):
    """Make each part an object; the largest one stays in this object"""

    bl_idname = "meshfree.separate_by_segment"
    bl_label = "Separate by Segment"

    @classmethod
    def lack(cls, context, obj):
        return "" if SEGMENT in obj.data.attributes else f'"{obj.name}" has no parts. Segment it first'

    def plan(self, context, obj):
        leaving = [other for other in context.selected_objects if other.meshfree.make_single_user]
        check_writable(obj, (), obj.meshfree.make_single_user, among=leaving)  # others would lose points
        if obj.type != "MESH" and not obj.visible_get():
            raise PointCloudError(f'"{obj.name}" is hidden. Show it, so that its points can be divided in Edit Mode.')
        labels = read_attribute(obj.data, SEGMENT)
        if labels.dtype.kind != "i" or len(np.unique(labels[labels >= 0])) < 2:
            raise PointCloudError(f'All points of "{obj.name}" are in one part. Segment it into more parts first.')
        return lambda progress: labels

    def write(self, context, obj, result):
        numbers, counts = np.unique(result[result >= 0], return_counts=True)
        numbers = np.delete(numbers, np.argmax(counts))
        obj.pop(EIGENVALUES, None)  # those of the whole
        for number in numbers:
            split_off(context, obj, f"{obj.name} {GROUP.format(number)}", result == number)
        keep_points(context, obj, ~np.isin(result, numbers))
        return [f"{obj.name}: {len(numbers) + 1} parts are objects of their own"]


TOOLS = (
    registration_of(segment.TOOL, SegmentGroups),
    Registration(MESHFREE_OT_separate_by_segment, panel=Row("Make", 2, 2), menu=Row("Object", 5, 2)),
)
