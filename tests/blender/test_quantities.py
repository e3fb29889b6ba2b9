"""The table of results against what the tools leave: types, bounds, and how numbers grow with lengths."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, sphere_points
from tests.results import RESULTS
from tools.quantities import QUANTITIES, quantity, rows_of

CALLS = {  # of tools that need arguments, or write more in several calls
    "signed_distance": ({"curve": "Line"},),
    "simulate": ({"keep": "MODES", "modes": 8},),
    "spectrum": ({"count": 3},),
    "transfer_weights": ({"reverse": True},),
    "signature": ({"kind": "HEAT", "modes": 20}, {"kind": "WAVE", "modes": 20}),
}


def add_scene(size, tool):
    """Add a dented ellipsoid with what tools ask for: groups, a curve, and a larger one where two are needed."""
    points = size * sphere_points(400) * [1.0, 0.8, 0.6]
    points[::20] *= 0.98
    if tool in ("align_points", "compare", "transfer_weights"):
        plan = add_object((1.1 if tool == "compare" else 1.02) * points, "Plan")
        plan.select_set(True)
        add_group(plan, "Bone", [0])
    line = bpy.data.curves.new("Line", "CURVE")
    line.splines.new("POLY").points.add(1)
    line.splines[0].points.foreach_set("co", [*points[0], 1.0, *points[1], 1.0])
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Line", line))
    obj = add_object(points)
    for name, members in {"Handle": [0], "Source": [0], "Low": [0], "High": [1]}.items():
        add_group(obj, name, members)
    obj.select_set(True)
    return obj


def left(tool, size):
    """What a tool leaves on a cloud of some size: types and values, by the rows of the table."""
    obj = add_scene(size, tool)
    for arguments in CALLS.get(tool, ({},)):
        assert getattr(bpy.ops.meshfree, tool)(**arguments) == {"FINISHED"}
    names = {row: f"{row.attribute}{'002' * row.numbered}" for row in rows_of(tool)}
    return {row: (obj.data.attributes[name].data_type, attribute(obj, name)) for row, name in names.items()}


@pytest.mark.parametrize("tool", dict.fromkeys(row.tool for row in QUANTITIES))
def test_tools_leave_what_the_table_says(tool):
    found = left(tool, 1.0)
    bpy.ops.wm.read_homefile(use_empty=True)
    large = left(tool, 2.0)
    for row, (data_type, values) in found.items():
        assert data_type == row.data_type
        assert np.isfinite(values).all()
        if row.bounds is not None:
            assert row.bounds[0] <= values.min() <= values.max() <= row.bounds[1]
        if data_type == "FLOAT":
            most = np.abs(values).max()
            assert most > 0.0
            assert_allclose(large[row][1], 2.0**row.power * values, rtol=1e-3, atol=1e-4 * 2.0**row.power * most)


def test_buttons_say_what_results_are(extension):
    tooltip = extension.ui.colormap.MESHFREE_OT_colormap.description
    for name in RESULTS:
        assert tooltip(bpy.context, SimpleNamespace(attribute=name)) == quantity(name).tooltip
    assert tooltip(bpy.context, SimpleNamespace(attribute="")) == ""  # which leaves that of the operator
