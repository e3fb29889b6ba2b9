"""Orientation of the normals, for this and all later analyses."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from bpy.props import StringProperty

from ...command.analysis import WRITE_LIMIT
from ...tools import orient_normals
from ...tools.quantities import AREA, NORMAL, ORIENTATION
from ..objects.attributes import read_attribute
from ..objects.result import length_writer, write_result
from ..running.application import operator_reader
from .analyze import plan_analysis
from .declared import ObjectCloud, registration_of


class Analyzed:
    """What Blender adds to the tool: results of an analysis with the side, of a subset of the points if need be."""

    asks = ("method", "viewpoint", "source", "holds", "flip", "show")

    viewpoint: StringProperty(
        name="Viewpoint", description="Object that saw the points, for Viewpoint; empty for the scene's camera"
    )

    def plan(self, context, obj):
        (reading, operator), tool, own = operator_reader(context, obj), self.tool, self.own()
        inputs = viewpoint, told = tool.inputs(ObjectCloud(context, obj, self, reading, operator), own)
        length, told = length_writer(), [f"{obj.name}: {text}" for text in told]

        def orient(measured, progress):
            laplacian, normals, areas = measured.built.laplacian, measured.measures[NORMAL], measured.measures[AREA]
            seen = SimpleNamespace(points=reading.points, normals=normals, areas=areas)
            work = lambda: tool.compute(seen, inputs, own, progress)  # noqa: E731
            found = laplacian.kept.result(tool.name, work, tool.key(own), viewpoint, reading.points)
            return tool.finish(found, seen, own, length).values[ORIENTATION]

        analyze = plan_analysis(context, obj, orient=orient)

        def compute(progress):
            result = analyze(progress)
            return replace(result, notices=[*told, *result.notices])

        return compute

    def write(self, context, obj, result):
        earlier = read_attribute(obj.data, NORMAL) if NORMAL in obj.data.attributes else None
        write_result(obj, result, WRITE_LIMIT, oriented=True)
        return [*result.notices, _reversed_line(earlier, result.local_normals, obj.name)]


def _reversed_line(before, after, name) -> str:
    """Return how many normals are reversed as a text; `before` may be None."""
    if before is None:
        return f"{name}: normals oriented"
    count = int(np.count_nonzero(np.einsum("ij,ij->i", before, after) < 0.0))
    return f"{name}: {count:,} of {len(after):,} normals reversed"


TOOLS = (registration_of(orient_normals.TOOL, Analyzed),)
