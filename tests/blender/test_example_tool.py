"""The example tool of CONTRIBUTING.md works as an operator."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, sphere_points
from tests.blender.conftest import part
from tests.example_tool import example_tool


@pytest.fixture
def operator(installed, monkeypatch):
    kind = part("operators.tools.declared").operator_of(example_tool(part("tools.quantities"), monkeypatch))
    bpy.utils.register_class(kind)
    yield bpy.ops.meshfree.remoteness
    bpy.utils.unregister_class(kind)


def test_the_example_is_an_operator(operator, capfd):
    points = sphere_points(800) * [1.0, 0.8, 0.6]
    obj = add_object(points)
    assert operator(power=2.0) == {"FINISHED"}
    assert_allclose(attribute(obj, "lb_remoteness"), np.sum(points**2, axis=1), atol=1e-2)
    assert "Cloud: up to" in capfd.readouterr().out
    assert operator.get_rna_type().properties["power"].hard_max == 2.0
    assert operator.get_rna_type().description == "Measure how far the points are from the middle of the surface"
