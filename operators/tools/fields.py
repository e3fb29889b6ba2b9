"""Fields between given values, and distances along the surface."""

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, StringProperty

from ... import core
from ...core import PointCloudError
from ..objects.attributes import DISTANCE, FIELD, point_count, read_attribute, tag_changed, write_attribute
from ..objects.groups import SOURCE, VALUE, chosen_members, chosen_weights, group_kind
from ..objects.result import length_text
from ..running import cache
from ..running.application import ShownOperator, Tool, operator_reader
from .select import read_sources

UNREACHED = -1.0  # distance of points that no source reaches


class HarmonicField(Tool):
    """The settings and the work of `meshfree.harmonic_field`."""

    writes = (FIELD,)

    values: EnumProperty(
        name="Values",
        description="Where the given values come from",
        items=[
            ("WEIGHTS", "Weights", "The points of one group have their weights as values"),
            ("GROUPS", "Two Groups", "The points of each of two groups have one value"),
        ],
        default="WEIGHTS",
    )
    group: StringProperty(name="Group", description="Vertex group whose weights are the values", default=VALUE)
    low_group: StringProperty(name="Low Group", description="Vertex group of the points with the low value")
    high_group: StringProperty(name="High Group", description="Vertex group of the points with the high value")
    low: FloatProperty(name="Low Value", description="Value of the low group, or of weight 0", default=0.0)
    high: FloatProperty(name="High Value", description="Value of the high group, or of weight 1", default=1.0)
    source: StringProperty(
        name="Source",
        description="Attribute with the source f of Poisson's equation -Laplacian u = f; empty for a harmonic field",
    )

    @property
    def asks(self):
        """Names of the settings: the values come from one group, or from two."""
        groups = ("group",) if self.values == "WEIGHTS" else ("low_group", "high_group")
        return "values", *groups, "low", "high", "source", "show"

    @property
    def adjustable(self):
        """Names of the settings that need no new solution: with a source, the given values do."""
        return ("show",) if self.source else ("low", "high", "show")

    def plan(self, context, obj):
        if self.values == "GROUPS":
            low = chosen_members(obj, self.low_group, "Low Group")
            high = chosen_members(obj, self.high_group, "High Group")
            both = np.count_nonzero(low & high)
            if both:
                raise PointCloudError(
                    f'{both} points are both in "{self.low_group}" and in "{self.high_group}". Remove them from one.'
                )
            fixed, shares = low | high, high.astype(np.float64)
        elif self.group or not self.source:
            shares = chosen_weights(obj, self.group, "Group", least=0, outside=np.nan)
            fixed = np.isfinite(shares)  # with weight 0 too
            if not fixed.any():
                raise PointCloudError(
                    f'The {group_kind(obj)} "{self.group}" of "{obj.name}" holds no points. Assign some to'
                    " it in Edit Mode."
                )
        else:
            shares = np.zeros(point_count(obj.data))
            fixed = np.zeros(len(shares), dtype=bool)
        source = None
        if self.source:
            source = read_attribute(obj.data, self.source).astype(np.float64)
            if source.ndim > 1:
                raise PointCloudError(
                    f'The attribute "{self.source}" of "{obj.name}" holds vectors. Choose one with a number'
                    " for each point as the source."
                )
        _, operator = operator_reader(context, obj)
        low, high = self.low, self.high

        def compute(progress):
            laplacian, given = operator(progress), shares[fixed]
            if source is None:  # between 0 and 1, so that both values can change without solving again
                field = cache.result(
                    laplacian,
                    "harmonic",
                    fixed,
                    given,
                    compute=lambda: core.harmonic_field(laplacian, fixed, given, progress=progress),
                )
                return low + (high - low) * field
            values = low + (high - low) * given
            return cache.result(
                laplacian,
                "poisson",
                source,
                fixed,
                values,
                compute=lambda: core.solve_poisson(laplacian, source, fixed, values, progress=progress),
            )

        return compute

    def write(self, context, obj, result):
        write_attribute(obj.data, FIELD, result)
        tag_changed(obj.data)
        return [f"{obj.name}: a field from {result.min():.4g} to {result.max():.4g}"]


class MESHFREE_OT_harmonic_field(HarmonicField, ShownOperator, bpy.types.Operator):
    """Fill in a smooth field between points with given values, or solve Poisson's equation"""

    bl_idname = "meshfree.harmonic_field"
    bl_label = "Harmonic Field"


class GeodesicDistance(Tool):
    """The settings and the work of `meshfree.geodesic_distance`."""

    writes = (DISTANCE,)
    asks = ("group", "show")

    group: StringProperty(
        name="Sources",
        description="Vertex group with the points to measure from; where there is none of that name, the points"
        " selected in Edit Mode",
        default=SOURCE,
    )

    def plan(self, context, obj):
        sources = read_sources(obj, self.group)
        if sources.all():
            raise PointCloudError(
                f'All points of "{obj.name}" are sources, so that all distances are 0. Select fewer of them in'
                " Edit Mode, or choose a smaller group."
            )
        _, operator = operator_reader(context, obj)

        def compute(progress):
            laplacian = operator(progress)
            return cache.result(
                laplacian,
                "distance",
                sources,
                compute=lambda: cache.geodesics(laplacian, progress).distance(sources, progress=progress),
            )

        return compute

    def write(self, context, obj, result):
        reached = np.isfinite(result)
        write_attribute(obj.data, DISTANCE, np.where(reached, result, UNREACHED))
        tag_changed(obj.data)
        missed, line = np.count_nonzero(~reached), f"{obj.name}: distances up to {length_text(result[reached].max())}"
        far = f"{missed:,} points of {obj.name} are reached by no source. Their distance is {UNREACHED:g}."
        return [far, line] if missed else [line]


class MESHFREE_OT_geodesic_distance(GeodesicDistance, ShownOperator, bpy.types.Operator):
    """Measure the distance along the surface from a group of points, or from the selected ones"""

    bl_idname = "meshfree.geodesic_distance"
    bl_label = "Geodesic Distance"


CLASSES = (MESHFREE_OT_harmonic_field, MESHFREE_OT_geodesic_distance)
