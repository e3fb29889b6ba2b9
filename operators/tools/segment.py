"""Segmentation into parts, objects of the parts, and heat and wave kernel signatures."""

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, IntProperty

from ... import core
from ...command.quantities import HEAT_SIGNATURE, SEGMENT, WAVE_SIGNATURE
from ...core import PointCloudError
from ..objects.attributes import read_attribute, remove_numbered, tag_changed, write_attribute
from ..objects.deleting import keep_points
from ..objects.result import EIGENVALUES, check_writable
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ApplicationOperator, ShownOperator, Tool, operator_reader
from .analyze import resolved_modes

GROUP = "Segment {}"  # of vertex groups and objects


class Segment(Tool):
    """The settings and the work of `meshfree.segment`."""

    writes = (SEGMENT,)
    adjustable = ("vertex_groups", "show")

    method: EnumProperty(
        name="Method",
        description="What makes a part",
        items=[
            ("PARTS", "Parts", "As many connected parts as requested, divided where the shape is narrow"),
            ("NODAL", "Signs of a Mode", "Connected regions in which a vibration mode keeps its sign"),
        ],
        default="PARTS",
    )
    parts: IntProperty(name="Parts", description="How many parts", default=6, min=1, soft_max=50)
    mode: IntProperty(
        name="Mode", description="Number of the mode; 1 is the constant one", default=2, min=1, soft_max=100
    )
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
        by_mode, parts, mode = self.method == "NODAL", self.parts, self.mode

        def compute(progress):
            laplacian = operator(progress)
            if by_mode:
                return cache.result(laplacian, "nodal", mode, compute=lambda: _by_mode(laplacian, mode, progress))
            return cache.result(laplacian, "parts", parts, compute=lambda: _by_shape(laplacian, parts, progress))

        return compute

    def write(self, context, obj, result):
        write_attribute(obj.data, SEGMENT, result)
        count = int(result.max()) + 1
        if self.vertex_groups:
            _write_groups(obj, [result == label for label in range(count)])
        tag_changed(obj.data)
        return [f"{obj.name}: {count} part{'s' if count > 1 else ''}"]


class MESHFREE_OT_segment(Segment, ShownOperator, bpy.types.Operator):
    """Divide the points into parts, such as the limbs of a figure, or where a vibration mode has one sign"""

    bl_idname = "meshfree.segment"
    bl_label = "Segment"


def _by_mode(laplacian, mode, progress):
    """Divide the points by the signs of a mode."""
    vector = cache.lowest_modes(laplacian, mode, progress).eigenvectors[:, mode - 1]
    progress("Regions", 0.5)
    return core.nodal_domains(vector, laplacian)


def _by_shape(laplacian, parts, progress):
    """Divide the points into parts, by kept modes if there are enough."""
    count, spectrum = core.modes_needed(laplacian, parts), None
    if cache.known_modes(laplacian) >= count:
        spectrum = resolved_modes(laplacian, count, progress)[0]
    return core.segment(laplacian, parts, spectrum=spectrum, progress=progress)


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
        description="What spreads over the surface",
        items=[
            ("HEAT", "Heat", "Heat that is left after some time: high on tips and thin parts"),
            ("WAVE", "Wave", "Waves of one energy: sharper, also for small features"),
        ],
        default="HEAT",
    )
    count: IntProperty(
        name="Scales", description="How many scales, from fine to coarse", default=8, min=1, soft_max=50, max=999
    )
    modes: IntProperty(
        name="Modes", description="How many vibration modes they are made of", default=100, min=10, soft_max=300
    )

    @property
    def writes(self):
        """Names of the attributes."""
        return [f"{self._prefix()}{number:03d}" for number in range(1, self.count + 1)]

    def _prefix(self):
        return HEAT_SIGNATURE if self.kind == "HEAT" else WAVE_SIGNATURE

    def plan(self, context, obj):
        _, operator = operator_reader(context, obj)
        signature = core.heat_kernel_signature if self.kind == "HEAT" else core.wave_kernel_signature
        count, modes = self.count, self.modes
        return lambda progress: signature(cache.lowest_modes(operator(progress), modes, progress), count=count)

    def write(self, context, obj, result):
        remove_numbered(obj.data, self._prefix(), beyond=self.count)
        for name, values in zip(self.writes, result.T, strict=True):
            write_attribute(obj.data, name, values)
        tag_changed(obj.data)
        return [f"{obj.name}: signatures at {self.count} scales"]


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
        verb=Segment,
    ),
    Registration(MESHFREE_OT_separate_by_segment, panel=Row("Segment", 1, 2), menu=Row("Object", 5, 2)),
    Registration(MESHFREE_OT_signature, panel=Row("Measure", 4, 1), menu=Row("Object", 5, 3), verb=Signature),
)
