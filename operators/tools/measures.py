"""A table of measures of all parts: points, area, boundary, volume, and the mean of an attribute."""

from dataclasses import dataclass, field

import bpy
import numpy as np
from bpy.props import BoolProperty, StringProperty

from ... import core
from ...core import PointCloudError
from ..objects.attributes import read_attribute
from ..objects.parts import PartRow, keep_rows
from ..objects.quantities import SEGMENT, written_by
from ..objects.result import area_text
from ..registration import Registration, Row
from ..running.application import ApplicationOperator, Tool, operator_reader
from .mesh import volume_of

_LOST = "points are left out of the Laplacian, and not measured"


@dataclass
class _Table:
    """Measures of parts, with texts for the user."""

    rows: list = field(default_factory=list)
    notices: list = field(default_factory=list)


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
        labels, name, volume = _labels(obj), self.measured(obj), self.volume
        values = _numbers(obj, name) if name else None

        def compute(progress):
            laplacian = operator(progress)
            table = _Table()
            table.rows += _rows(laplacian, "Component", None, values, progress)
            if volume:
                _add_volumes(laplacian, table, progress)
            if labels is not None:
                table.rows += _rows(laplacian, "Segment", labels, values, progress)
            table.notices += [*_left_out(laplacian, labels, values), *laplacian.notices]
            return table

        return compute

    def measured(self, obj) -> str:
        """Return the name of the attribute whose mean is wanted, empty for none."""
        (usual,) = written_by("roughness")
        return self.source or (usual if usual in obj.data.attributes else "")

    def write(self, context, obj, result):
        keep_rows(obj, result.rows, self.measured(obj))
        components = [row for row in result.rows if row.name.startswith("Component")]
        area, off = (sum(getattr(row, name) for row in components) for name in ("area", "area_uncertainty"))
        parts = f"{len(result.rows):,} part{'s' if len(result.rows) > 1 else ''}"
        return [*result.notices, f"{obj.name}: {parts} measured, area {area_text(area)} +- {100.0 * off / area:.2g} %"]


class MESHFREE_OT_measure_parts(MeasureParts, ApplicationOperator, bpy.types.Operator):
    """Measure every component and segment: points, area, boundary, volume, and the mean of an attribute"""

    bl_idname = "meshfree.measure_parts"
    bl_label = "Measure Parts"


def _labels(obj):
    """Read the segments of an object; None without any."""
    if SEGMENT not in obj.data.attributes:
        return None
    labels = read_attribute(obj.data, SEGMENT)
    if labels.dtype.kind != "i" or labels.ndim != 1 or not (labels >= 0).any():
        raise PointCloudError(
            f'The attribute {SEGMENT} of "{obj.name}" does not hold whole numbers from zero, so it names no parts.'
            " Press Segment, or remove it."
        )
    return labels


def _numbers(obj, name):
    """Read the numbers of an attribute, (n,)."""
    values = read_attribute(obj.data, name)
    if values.ndim != 1:
        raise PointCloudError(
            f'The attribute {name} of "{obj.name}" has {values.shape[1]} numbers at each point. Choose one with a'
            " single number."
        )
    return values


def _rows(laplacian, kind, labels, values, progress):
    """Return the rows of all parts."""
    found = core.measure_parts(laplacian, labels, progress=progress)
    means = (
        core.part_means(laplacian, values, labels) if values is not None else np.full((2, len(found.labels)), np.nan)
    )
    columns = (
        found.points,
        found.areas,
        found.area_uncertainties,
        found.boundary_lengths,
        found.length_uncertainties,
    )
    numbers = zip(*(column.tolist() for column in (*columns, *means)), strict=True)
    return [
        PartRow(f"{kind} {label}", *of_part, mean=mean, root_mean_square=square)
        for label, (*of_part, mean, square) in zip(found.labels.tolist(), numbers, strict=True)
    ]


def _add_volumes(laplacian, table, progress):
    """Add the volumes of closed components to their rows, which are those of the table."""
    found = volume_of(laplacian, progress)
    closed = (found.openings == 0) & (found.volumes > 0.0)
    for number in np.flatnonzero(closed).tolist():
        table.rows[number] = table.rows[number]._replace(
            volume=float(found.volumes[number]), volume_uncertainty=float(found.uncertainties[number])
        )
    open_ones = np.count_nonzero(~closed)
    if open_ones:
        table.notices.append(
            f"{open_ones:,} of {len(closed):,} components are not closed, or have too few points, and have no volume."
            " Volume of Measure Selection closes openings."
        )


def _left_out(laplacian, labels, values):
    """Return notices of the points that do not count."""
    known, count = laplacian.component >= 0, len(laplacian.points)
    counts = {
        _LOST: np.count_nonzero(~known),
        "points are in no segment": 0 if labels is None else np.count_nonzero(known & (labels < 0)),
        "values are no numbers, and do not count for the mean": (
            0 if values is None else np.count_nonzero(known & ~np.isfinite(values))
        ),
    }
    return [f"{missing:,} of {count:,} {text}." for text, missing in counts.items() if missing]


TOOLS = (
    Registration(MESHFREE_OT_measure_parts, panel=Row("Measure", 6, 1), menu=Row("Object", 3, 5), verb=MeasureParts),
)
