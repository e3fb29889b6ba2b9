"""Weights from Selection: a group that falls off along the surface from points, or blends between two ends."""

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, StringProperty

from ... import core
from ...core import PointCloudError
from ...tools.groups import LOW, unreached
from ...tools.quantities import WEIGHT
from ..objects.attributes import tag_changed, write_attribute
from ..objects.groups import check_assignable, chosen_members, group_weights, has_group, put_group
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running.application import ShownOperator, Tool, operator_reader
from ..tools.select import groups_changed, selected
from .painting import WeightOperator

_SHARE = 0.25  # of the diagonal of the points: the default radius


class WeightsFromSelection(Tool):
    """The settings and the work of `meshfree.weights_from_selection`."""

    writes = (WEIGHT,)
    adjustable = ("falloff", "radius", "action", "factor", "show")
    at_zero = {"radius": "Automatic"}

    method: EnumProperty(
        name="Method",
        description="How weights fall off",
        items=[
            ("DISTANCE", "Distance", "By the distance along the surface from the points, down to 0 at the radius"),
            ("BETWEEN", "Between Two Ends", "The smoothest blend from 1 at the points to 0 at those of another group"),
        ],
        default="DISTANCE",
    )
    group: StringProperty(
        name="From Group", description="Vertex group of the points with weight 1; empty for the selected points"
    )
    zero_group: StringProperty(
        name="To Group", description="Vertex group of the points with weight 0, the other end", default=LOW
    )
    radius: FloatProperty(
        name="Radius",
        description="Distance along the surface at which weights reach 0; 0 for a quarter of the object's size",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
    )
    falloff: EnumProperty(
        name="Falloff",
        description="Shape of the falloff, as in proportional editing",
        items=[
            ("SMOOTH", "Smooth", "Smooth falloff", "SMOOTHCURVE", 0),
            ("SPHERE", "Sphere", "Spherical falloff", "SPHERECURVE", 1),
            ("ROOT", "Root", "Root falloff", "ROOTCURVE", 2),
            ("INVERSE_SQUARE", "Inverse Square", "Inverse square falloff", "INVERSESQUARECURVE", 3),
            ("SHARP", "Sharp", "Sharp falloff", "SHARPCURVE", 4),
            ("LINEAR", "Linear", "Linear falloff", "LINCURVE", 5),
            ("CONSTANT", "Constant", "No falloff up to the radius", "NOCURVE", 6),
        ],
        default="SMOOTH",
    )
    name: StringProperty(name="Name", description="Vertex group that is written", default="Falloff", maxlen=63)
    action: EnumProperty(
        name="Action",
        description="What is done with the weights that the group has",
        items=[
            ("REPLACE", "Replace", "The new weights take their place"),
            ("ADD", "Add", "The new weights are added to them, up to 1"),
            ("MIX", "Mix", "Both are mixed by the factor"),
        ],
        default="REPLACE",
    )
    factor: FloatProperty(
        name="Factor",
        description="Share of the new weights in the mixture",
        default=0.5,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )

    @property
    def asks(self):
        """Names of the settings that the method and the action take."""
        shape = ("radius", "falloff") if self.method == "DISTANCE" else ("zero_group",)
        factor = ("factor",) if self.action == "MIX" else ()
        return "method", "group", *shape, "name", "action", *factor, "show"

    def plan(self, context, obj):
        if not self.name:
            raise PointCloudError("The group has no name. Give it one.")
        check_assignable(obj, self.name, must_exist=False)
        ones = chosen_members(obj, self.group, "From Group") if self.group else selected(obj)
        old = group_weights(obj, self.name) if has_group(obj, self.name) else np.zeros(len(ones))
        reading, operator = operator_reader(context, obj)
        find = self._blend(obj, ones) if self.method == "BETWEEN" else self._distance(ones, reading)
        action, factor = self.action, {"REPLACE": 1.0, "MIX": self.factor, "ADD": 1.0}[self.action]

        def compute(progress):
            weights, reached, told = find(operator(progress), progress)
            before = old if action != "REPLACE" else 0.0
            mixed = before + weights if action == "ADD" else before + factor * (weights - before)
            return np.clip(mixed, 0.0, 1.0), reached, told

        return compute

    def _distance(self, ones, reading):
        """Return a function that finds weights by distance, which points are reached, and a text."""
        radius = self.radius or _SHARE * float(np.linalg.norm(np.ptp(reading.points, axis=0)))
        shape, told = self.falloff.lower(), f"within {length_text(radius)}"

        def find(laplacian, progress):
            work = lambda: core.distance.geodesic_distance(laplacian, ones, progress=progress)  # noqa: E731
            distance = laplacian.kept.result("weights by distance", work, ones)
            return core.distance.falloff(distance, radius, shape), np.isfinite(distance), told

        return find

    def _blend(self, obj, ones):
        """Return a function that finds the smoothest weights between two ends, which are reached, and a text."""
        zeros = chosen_members(obj, self.zero_group, "To Group")
        both = np.count_nonzero(ones & zeros)
        if both:
            raise PointCloudError(
                f'{both:,} points of "{obj.name}" are at both ends. Remove them from "{self.zero_group}", or select'
                " others."
            )
        fixed, given = ones | zeros, ones[ones | zeros].astype(np.float64)

        def find(laplacian, progress):
            work = lambda: core.distance.harmonic_field(laplacian, fixed, given, progress=progress)  # noqa: E731
            field = laplacian.kept.result("weights between", work, fixed, given)
            known = np.unique(laplacian.component[fixed])
            reached = np.isin(laplacian.component, known) & ((laplacian.component >= 0) | fixed)
            return np.where(reached, np.clip(field, 0.0, 1.0), 0.0), reached, "between two ends"

        return find

    def write(self, context, obj, result):
        weights, reached, told = result
        if obj.type == "MESH":
            put_group(obj, self.name, weights)
            obj.vertex_groups.active = obj.vertex_groups[self.name]
        else:
            write_attribute(obj.data, self.name, weights, "FLOAT")
        write_attribute(obj.data, WEIGHT, weights)
        tag_changed(obj.data)
        groups_changed(obj)
        some = np.count_nonzero(weights > 0.0)
        line = f'{obj.name}: {some:,} of {len(weights):,} points are in "{self.name}", {told}'
        return [*unreached(reached, "Their weight is 0."), line]


class MESHFREE_OT_weights_from_selection(WeightsFromSelection, WeightOperator, ShownOperator, bpy.types.Operator):
    """Make a vertex group whose weights fall off along the surface from the selected points"""

    bl_idname = "meshfree.weights_from_selection"
    bl_label = "Weights from Selection"


TOOLS = (Registration(MESHFREE_OT_weights_from_selection, panel=Row("Rig", 2, 2), menu=Row("Points", 3, 1)),)
