"""Segmentation into parts, objects of the parts, and heat and wave kernel signatures."""

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, IntProperty

from ...command import segmenting
from ...command.quantities import SEGMENT
from ...core import PointCloudError
from ..objects.attributes import read_attribute, remove_numbered, tag_changed, write_attribute
from ..objects.deleting import keep_points
from ..objects.result import EIGENVALUES, check_writable
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ApplicationOperator, ShownOperator, Tool, operator_reader

GROUP = "Segment {}"  # of vertex groups and objects


class Segment(Tool):
    """The settings and the work of `meshfree.segment`."""

    writes = (SEGMENT,)
    adjustable = ("vertex_groups", "show")

    method: EnumProperty(
        name="Method",
        items=[
            ("PARTS", "Parts", "As many connected parts as requested, divided where the shape is narrow"),
            ("NODAL", "Signs of a Mode", "Connected regions in which a vibration mode keeps its sign"),
        ],
        **segmenting.SEGMENT["method"].keywords,
    )
    parts: IntProperty(name="Parts", soft_max=50, **segmenting.SEGMENT["parts"].keywords)
    mode: IntProperty(name="Mode", soft_max=100, **segmenting.SEGMENT["mode"].keywords)
    vertex_groups: BoolProperty(
        name="Vertex Groups",
        description="Make a vertex group of each part; of point clouds an attribute",
        default=False,
    )

    @property
    def asks(self):
        """Names of the settings that the method takes."""
        return "method", "mode" if self.method == "NODAL" else "parts", "vertex_groups", "show"

    def plan(self, context, obj):
        if self.vertex_groups and obj.type == "MESH":
            _check_groups(obj)
        _, operator = operator_reader(context, obj)
        given = self.method, self.parts, self.mode
        return lambda progress: segmenting.segmented(operator(progress), *given, cache, progress)

    def write(self, context, obj, result):
        write_attribute(obj.data, SEGMENT, result)
        if self.vertex_groups:
            _write_groups(obj, [result == label for label in range(int(result.max()) + 1)])
        tag_changed(obj.data)
        return [segmenting.parts_line(result, obj.name)]


class MESHFREE_OT_segment(Segment, ShownOperator, bpy.types.Operator):
    """Divide the points into parts, such as the limbs of a figure, or where a vibration mode has one sign"""

    bl_idname = "meshfree.segment"
    bl_label = "Segment"


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
    def obstacle(cls, context):
        reason = super().obstacle(context)
        if reason or SEGMENT in context.object.data.attributes:
            return reason
        return f'"{context.object.name}" has no parts. Segment it first'

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
            part = obj.copy()
            part.name = f"{obj.name} {GROUP.format(number)}"
            part.data = obj.data.copy()
            part.data.name = part.name
            for collection in obj.users_collection:
                collection.objects.link(part)
            keep_points(context, part, result == number)
        keep_points(context, obj, ~np.isin(result, numbers))
        return [f"{obj.name}: {len(numbers) + 1} parts are objects of their own"]


class Signature(Tool):
    """The settings and the work of `meshfree.signature`."""

    asks = ("kind", "count", "modes", "show")
    adjustable = ("kind", "count", "show")

    kind: EnumProperty(
        name="Kind",
        items=[
            ("HEAT", "Heat", "Heat that is left after some time: high on tips and thin parts"),
            ("WAVE", "Wave", "Waves of one energy: sharper, also for small features"),
        ],
        **segmenting.SIGNATURE["kind"].keywords,
    )
    count: IntProperty(name="Scales", soft_max=50, **segmenting.SIGNATURE["count"].keywords)
    modes: IntProperty(name="Modes", soft_max=300, **segmenting.SIGNATURE["modes"].keywords)

    @property
    def writes(self):
        """Names of the attributes."""
        return segmenting.signature_names(self.kind, self.count)

    def plan(self, context, obj):
        _, operator = operator_reader(context, obj)
        given = self.kind, self.count, self.modes
        return lambda progress: segmenting.signatures(operator(progress), *given, cache, progress)

    def write(self, context, obj, result):
        remove_numbered(obj.data, segmenting.signature_prefix(self.kind), beyond=self.count)
        for name, values in zip(self.writes, result.T, strict=True):
            write_attribute(obj.data, name, values)
        tag_changed(obj.data)
        return [segmenting.signature_line(self.count, obj.name)]


class MESHFREE_OT_signature(Signature, ShownOperator, bpy.types.Operator):
    """Compute heat or wave kernel signatures, which are unchanged by bending"""

    bl_idname = "meshfree.signature"
    bl_label = "Signatures"


TOOLS = (
    Registration(
        MESHFREE_OT_segment,
        panel=Row("Segment", 1, 1),
        menu=Row("Object", 5, 1),
        quick=Row("Object", 1, 2, "Segment"),
    ),
    Registration(MESHFREE_OT_separate_by_segment, panel=Row("Segment", 1, 2), menu=Row("Object", 5, 2)),
    Registration(MESHFREE_OT_signature, panel=Row("Measure", 4, 1), menu=Row("Object", 5, 3)),
)
