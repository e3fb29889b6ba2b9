"""Harmonic fields and solutions of Poisson's equation, and geodesic distances."""

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, StringProperty

from ... import core
from ...command.quantities import DISTANCE, FIELD
from ...core import PointCloudError
from ..objects.attributes import point_count, read_attribute, tag_changed, write_attribute
from ..objects.groups import HIGH, LOW, SOURCE, VALUE, chosen_weights, group_kind, has_group, is_chosen
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ShownOperator, Tool, operator_reader
from .select import read_sources, unreached

UNREACHED = -1.0  # distance of points that no source reaches


class HarmonicField(Tool):
    """The settings and the work of `meshfree.harmonic_field`."""

    writes = (FIELD,)

    values: EnumProperty(
        name="Values",
        description="Where the given values come from",
        items=[
            ("AUTO", "All Groups", "From all of the groups below that are there"),
            ("WEIGHTS", "Weights", "The points of one group have their weights as values"),
            ("GROUPS", "Two Groups", "The points of each of two groups have one value"),
        ],
        default="AUTO",
    )
    low_group: StringProperty(
        name="Low Group", description="Vertex group of the points with the low value", default=LOW
    )
    high_group: StringProperty(
        name="High Group", description="Vertex group of the points with the high value", default=HIGH
    )
    group: StringProperty(name="Group", description="Vertex group whose weights are the values", default=VALUE)
    low: FloatProperty(name="Low Value", description="Value of the low group, or of weight 0", default=0.0)
    high: FloatProperty(name="High Value", description="Value of the high group, or of weight 1", default=1.0)
    source: StringProperty(
        name="Source",
        description="Attribute with the source f of Poisson's equation -Laplacian u = f; empty for a harmonic field",
    )

    @property
    def asks(self):
        """Names of the settings: the values come from one group, from two, or from all three."""
        ends, weights = ("low_group", "high_group"), ("group",)
        groups = {"WEIGHTS": weights, "GROUPS": ends, "AUTO": (*ends, *weights)}[self.values]
        return "values", *groups, "low", "high", "source", "show"

    @property
    def adjustable(self):
        """Names of the settings that need no new solution; with a source, values need one."""
        return ("show",) if self.source else ("low", "high", "show")

    def plan(self, context, obj):
        shares = self._shares(obj)
        fixed = np.isfinite(shares)
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

    def _shares(self, obj):
        """Return the given values relative to the low (0) and the high value (1), (n,); NaN where none is given."""
        shares, known = np.full(point_count(obj.data), np.nan), {}
        for setting, share in self._given(obj).items():
            name, title = getattr(self, setting), setting.replace("_", " ").title()
            weights = chosen_weights(obj, name, title, least=int(self.values == "GROUPS"), outside=np.nan)
            held = np.isfinite(weights) if share is None else weights > 0.0  # a value may be a weight of 0, too
            for other, there in known.items():
                both = np.count_nonzero(held & there)
                if both:
                    raise PointCloudError(f'{both} points are both in "{other}" and in "{name}". Remove them from one.')
            known[name] = held
            shares[held] = weights[held] if share is None else share
        if self.group or not self.source:
            self._check_given(obj, {name for name, held in known.items() if held.any()})
        return shares

    def _given(self, obj):
        """Return the settings whose groups give values, with the relative values, None for the weights."""
        ends, weights = {"low_group": 0.0, "high_group": 1.0}, {"group": None}
        if self.values == "GROUPS":
            return ends
        if self.values == "WEIGHTS" or self.group not in ("", VALUE):
            return weights if self.group or not self.source else {}
        every = ends | weights
        defaults = dict(zip(every, (LOW, HIGH, VALUE), strict=True))
        return {name: every[name] for name in every if is_chosen(obj, getattr(self, name), defaults[name])}

    def _check_given(self, obj, names):
        """Refuse missing values, or those of one end alone, by the names of the groups that hold points."""
        if not names and has_group(obj, self.group):
            raise PointCloudError(
                f'The {group_kind(obj)} "{self.group}" of "{obj.name}" holds no points. Assign some to it in Edit Mode.'
            )
        if not names:
            raise PointCloudError(
                f'"{obj.name}" has no points with given values. Select those of one end in Edit Mode and press Assign'
                " to Low, and those of the other end and press Assign to High."
            )
        ends = {self.low_group, self.high_group}
        if self.values == "AUTO" and len(names) == 1 and names < ends and not self.source:
            (missing,) = ends - names
            raise PointCloudError(
                f'Only the {group_kind(obj)} "{min(names)}" of "{obj.name}" gives values, so that all would be the'
                f' same. Assign points to "{missing}", too.'
            )

    def write(self, context, obj, result):
        write_attribute(obj.data, FIELD, result)
        tag_changed(obj.data)
        return [f"{obj.name}: a field from {result.min():.4g} to {result.max():.4g}"]


class MESHFREE_OT_harmonic_field(HarmonicField, ShownOperator, bpy.types.Operator):
    """Interpolate a harmonic field between given values, or solve Poisson's equation"""

    bl_idname = "meshfree.harmonic_field"
    bl_label = "Harmonic Field"


class GeodesicDistance(Tool):
    """The settings and the work of `meshfree.geodesic_distance`."""

    writes = (DISTANCE,)
    asks = ("group", "show")

    group: StringProperty(
        name="Sources",
        description="Vertex group of the sources; where there is none of that name, the points selected in Edit Mode",
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
        notices = unreached(obj, reached, f"Their distance is {UNREACHED:g}.")
        return [*notices, f"{obj.name}: distances up to {length_text(result[reached].max())}"]


class MESHFREE_OT_geodesic_distance(GeodesicDistance, ShownOperator, bpy.types.Operator):
    """Geodesic distance from a group of points, or from the selected ones"""

    bl_idname = "meshfree.geodesic_distance"
    bl_label = "Geodesic Distance"


TOOLS = (
    Registration(MESHFREE_OT_harmonic_field, panel=Row("Measure", 2, 3), menu=Row("Object", 6, 2), verb=HarmonicField),
    Registration(
        MESHFREE_OT_geodesic_distance, panel=Row("Measure", 2, 1), menu=Row("Object", 6, 1), verb=GeodesicDistance
    ),
)
