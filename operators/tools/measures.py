"""A table of measures of all parts: points, area, boundary, volume, and the mean of an attribute."""

from typing import NamedTuple

import bpy
from bpy.props import BoolProperty, StringProperty

from ...command.measures import check_labels, check_numbers, measured_line, part_table
from ...tools.quantities import SEGMENT, written_by
from ..objects.attributes import read_attribute
from ..objects.parts import keep_rows
from ..objects.result import area_text
from ..registration import Registration, Row
from ..running.application import ApplicationOperator, Tool, operator_reader


class _Table(NamedTuple):
    """Measures of parts, with texts for the user."""

    rows: list
    notices: list


class MeasureParts(Tool):
    """The settings and the work of `meshfree.measure_parts`."""

    asks = ("volume", "source")

    volume: BoolProperty(
        name="Volume", description="Measure the volume within closed components, too. It takes longer", default=True
    )
    source: StringProperty(
        name="Attribute",
        description="Numbers at the points whose mean is wanted; empty for the roughness, if there is one",
    )

    def plan(self, context, obj):
        _, operator = operator_reader(context, obj)
        labels, name, volume = labels_of(obj), self.measured(obj), self.volume
        values = _numbers(obj, name) if name else None

        def compute(progress):
            return _Table(*part_table(operator(progress), labels, values, volume, progress))

        return compute

    def measured(self, obj) -> str:
        """Return the name of the attribute whose mean is wanted, empty for none."""
        (usual,) = written_by("roughness")
        return self.source or (usual if usual in obj.data.attributes else "")

    def write(self, context, obj, result):
        keep_rows(obj, result.rows, self.measured(obj))
        return [*result.notices, measured_line(result.rows, obj.name, area_text)]


class MESHFREE_OT_measure_parts(MeasureParts, ApplicationOperator, bpy.types.Operator):
    """Measure every component and segment: points, area, boundary, volume, and the mean of an attribute"""

    bl_idname = "meshfree.measure_parts"
    bl_label = "Measure Parts"


def labels_of(obj):
    """Read the segments of an object; None without any."""
    if SEGMENT not in obj.data.attributes:
        return None
    labels = read_attribute(obj.data, SEGMENT)
    check_labels(labels, SEGMENT, f'"{obj.name}"')
    return labels


def _numbers(obj, name):
    """Read the numbers of an attribute, (n,)."""
    values = read_attribute(obj.data, name)
    check_numbers(values, name, f'"{obj.name}"')
    return values


TOOLS = (Registration(MESHFREE_OT_measure_parts, panel=Row("Measure", 6, 1), menu=Row("Object", 3, 5)),)
