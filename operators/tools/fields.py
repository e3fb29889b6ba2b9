"""Harmonic fields and solutions of Poisson's equation, and geodesic distances."""

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, StringProperty

from ...command import along, fields
from ...command.quantities import DISTANCE, FIELD
from ..objects.attributes import point_count, read_attribute, tag_changed, write_attribute
from ..objects.groups import chosen_weights, group_kind, has_group
from ..objects.result import length_text
from ..registration import Registration, Row
from ..running import cache
from ..running.application import ShownOperator, Tool, operator_reader
from .select import read_sources

_HOW = (
    "Select those of one end in Edit Mode and press Assign to Low, and those of the other end and press Assign to High."
)


class HarmonicField(Tool):
    """The settings and the work of `meshfree.harmonic_field`."""

    writes = (FIELD,)

    values: EnumProperty(
        name="Values",
        items=[
            ("AUTO", "All Groups", "From all of the groups below that are there"),
            ("WEIGHTS", "Weights", "The points of one group have their weights as values"),
            ("GROUPS", "Two Groups", "The points of each of two groups have one value"),
        ],
        **fields.HARMONIC["values"].keywords,
    )
    low_group: StringProperty(name="Low Group", **fields.HARMONIC["low_group"].keywords)
    high_group: StringProperty(name="High Group", **fields.HARMONIC["high_group"].keywords)
    group: StringProperty(name="Group", **fields.HARMONIC["group"].keywords)
    low: FloatProperty(name="Low Value", **fields.HARMONIC["low"].keywords)
    high: FloatProperty(name="High Value", **fields.HARMONIC["high"].keywords)
    source: StringProperty(name="Source", **fields.HARMONIC["source"].keywords)

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
        source = None
        if self.source:
            source = read_attribute(obj.data, self.source).astype(np.float64)
            fields.check_source(source, self.source, f'"{obj.name}"')
        _, operator = operator_reader(context, obj)
        low, high = self.low, self.high
        return lambda progress: fields.solved(operator(progress), shares, source, low, high, cache, progress)

    def _shares(self, obj):
        """Return the given values relative to the low (0) and the high value (1), (n,); NaN where none is given."""

        def has(name):
            return has_group(obj, name)

        least = int(self.values == "GROUPS")
        weights = {
            setting: chosen_weights(obj, getattr(self, setting), fields.title(setting), least, outside=np.nan)
            for setting in fields.giving(self, has)
        }
        count, kind = point_count(obj.data), group_kind(obj)
        return fields.given_shares(self, weights, count, kind, f'"{obj.name}"', _HOW, has)

    def write(self, context, obj, result):
        write_attribute(obj.data, FIELD, result)
        tag_changed(obj.data)
        return [fields.field_line(result, obj.name)]


class MESHFREE_OT_harmonic_field(HarmonicField, ShownOperator, bpy.types.Operator):
    """Interpolate a harmonic field between given values, or solve Poisson's equation"""

    bl_idname = "meshfree.harmonic_field"
    bl_label = "Harmonic Field"


class GeodesicDistance(Tool):
    """The settings and the work of `meshfree.geodesic_distance`."""

    writes = (DISTANCE,)
    asks = ("group", "show")

    group: StringProperty(name="Sources", **along.GEODESIC["group"].keywords)

    def plan(self, context, obj):
        sources = read_sources(obj, self.group)
        along.check_distances(sources, obj.name)
        _, operator = operator_reader(context, obj)
        return lambda progress: along.distance(operator(progress), sources, cache, progress)

    def write(self, context, obj, result):
        told = along.told_distance(result, obj.name, length_text)
        write_attribute(obj.data, DISTANCE, told.values)
        tag_changed(obj.data)
        return [*told.notices, told.line]


class MESHFREE_OT_geodesic_distance(GeodesicDistance, ShownOperator, bpy.types.Operator):
    """Geodesic distance from a group of points, or from the selected ones"""

    bl_idname = "meshfree.geodesic_distance"
    bl_label = "Geodesic Distance"


TOOLS = (
    Registration(MESHFREE_OT_harmonic_field, panel=Row("Measure", 2, 3), menu=Row("Object", 6, 2)),
    Registration(MESHFREE_OT_geodesic_distance, panel=Row("Measure", 2, 1), menu=Row("Object", 6, 1)),
)
