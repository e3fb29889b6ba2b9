"""Fields between given values, and distances along the surface, as attributes that are shown at once."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_group, add_object, attribute, grid_points, local_points, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import refused


@pytest.fixture
def strip():
    points, _ = grid_points(columns=60, rows=20, step=0.1, jitter=0.0)
    return add_object(points)


@pytest.fixture
def shown():
    return part("ui.display").shown_attribute


class TestHarmonicField:
    def test_two_groups(self, strip, shown):
        x = local_points(strip)[:, 0]
        add_group(strip, "Left", x < 0.45)
        add_group(strip, "Right", x > 5.45)
        bpy.ops.meshfree.harmonic_field(values="GROUPS", low_group="Left", high_group="Right", low=-1.0, high=3.0)
        expected = -1.0 + 4.0 * np.clip((x - 0.4) / 5.1, 0.0, 1.0)
        assert_allclose(attribute(strip, "lb_field"), expected, atol=0.08)
        assert shown(strip) == "lb_field"

    def test_two_ends_in_two_clicks(self, strip):
        x = local_points(strip)[:, 0]
        for role, end in (("LOW", x < 0.45), ("HIGH", x > 5.45)):
            strip.data.vertices.foreach_set("select", end)
            bpy.ops.meshfree.group_from_selection(role=role, action="ADD")
        bpy.ops.meshfree.harmonic_field(low=2.0, high=4.0)
        assert_allclose(attribute(strip, "lb_field"), 2.0 + 2.0 * np.clip((x - 0.4) / 5.1, 0.0, 1.0), atol=0.04)

    def test_two_ends_and_a_value_between(self, strip):
        x = local_points(strip)[:, 0]
        add_group(strip, "Low", x < 0.45)
        add_group(strip, "High", x > 5.45)
        add_group(strip, "Value", (x > 2.85) & (x < 3.05), weight=0.9)
        bpy.ops.meshfree.harmonic_field()
        field = attribute(strip, "lb_field")
        assert_allclose(field[(x > 2.85) & (x < 3.05)], 0.9, atol=1e-6)
        assert (field.min(), field.max()) == (0.0, 1.0)

    def test_a_group_of_another_name_counts_alone(self, strip):
        """As scripts of earlier versions mean it."""
        x = local_points(strip)[:, 0]
        add_group(strip, "Low", x > 5.45)
        add_group(strip, "High", (x > 2.0) & (x < 3.0))
        add_group(strip, "Mine", x < 0.45, weight=0.25)
        strip.vertex_groups["Mine"].add(np.flatnonzero(x > 5.45).tolist(), 0.75, "REPLACE")
        bpy.ops.meshfree.harmonic_field(group="Mine")
        assert_allclose(attribute(strip, "lb_field"), 0.25 + 0.5 * np.clip((x - 0.4) / 5.1, 0.0, 1.0), atol=0.01)

    def test_one_end_alone(self, strip):
        add_group(strip, "High", range(50))
        with refused(strip, 'Only the vertex group "High".*Assign points to "Low", too'):
            bpy.ops.meshfree.harmonic_field()

    def test_no_values_at_all(self, strip):
        with pytest.raises(RuntimeError, match="no points with given values.*Assign to Low.*Assign to High"):
            bpy.ops.meshfree.harmonic_field()

    def test_weights_as_values_zero_included(self, strip):
        x = local_points(strip)[:, 0]
        add_group(strip, "Value", x < 0.45, weight=0.0)
        strip.vertex_groups["Value"].add(np.flatnonzero(x > 5.45).tolist(), 0.5, "REPLACE")
        bpy.ops.meshfree.harmonic_field()
        field = attribute(strip, "lb_field")
        assert field.min() == 0.0
        assert field.max() == 0.5
        assert_allclose(field, 0.5 * np.clip((x - 0.4) / 5.1, 0.0, 1.0), atol=0.01)

    def test_a_source_from_an_attribute(self):
        obj = add_object(sphere_points(1500))
        z = local_points(obj)[:, 2]
        obj.data.attributes.new("heat", "FLOAT", "POINT").data.foreach_set("value", z.astype(np.float32))
        bpy.ops.meshfree.harmonic_field(source="heat", group="")
        field = attribute(obj, "lb_field")
        assert_allclose(field - field.mean(), 0.5 * (z - z.mean()), atol=0.02)

    def test_a_boundary_held_at_zero_with_a_source(self, strip):
        x = local_points(strip)[:, 0]
        add_group(strip, "Value", (x < 0.05) | (x > 5.85), weight=0.0)
        strip.data.attributes.new("heat", "FLOAT", "POINT").data.foreach_set("value", np.ones(1200, np.float32))
        bpy.ops.meshfree.harmonic_field(source="heat")
        assert_allclose(attribute(strip, "lb_field"), 0.5 * x * (5.9 - x), atol=0.25)

    def test_a_group_without_points(self, strip):
        add_group(strip, "Value", [])
        with pytest.raises(RuntimeError, match='"Value" of "Cloud" holds no points. Assign some'):
            bpy.ops.meshfree.harmonic_field()

    def test_a_source_of_vectors(self, strip):
        strip.data.attributes.new("flow", "FLOAT_VECTOR", "POINT")
        with refused(strip, '"flow" of "Cloud" holds vectors. Choose one with a number'):
            bpy.ops.meshfree.harmonic_field(source="flow", group="")

    def test_points_in_both_groups(self, strip):
        add_group(strip, "A", range(100))
        add_group(strip, "B", range(90, 200))
        with refused(strip, '10 points are both in "A" and in "B"'):
            bpy.ops.meshfree.harmonic_field(values="GROUPS", low_group="A", high_group="B")


class TestGeodesicDistance:
    def test_from_a_group_on_a_scaled_sphere(self, shown):
        obj = add_object(sphere_points(1500))
        obj.scale = (2.0, 2.0, 2.0)
        points = local_points(obj)
        add_group(obj, "Source", [np.argmax(points[:, 2])])
        bpy.ops.meshfree.geodesic_distance()
        expected = 2.0 * np.arccos(np.clip(points @ points[np.argmax(points[:, 2])], -1.0, 1.0))
        assert np.abs(attribute(obj, "lb_distance") - expected).mean() < 0.02
        assert shown(obj) == "lb_distance"

    def test_from_the_selection(self, strip):
        x = local_points(strip)[:, 0]
        strip.data.vertices.foreach_set("select", x < 0.05)
        bpy.ops.meshfree.geodesic_distance(show=False)
        assert_allclose(attribute(strip, "lb_distance"), x - x.min(), atol=0.02)

    def test_parts_without_a_source(self, display):
        obj = add_object(np.concatenate([sphere_points(900), sphere_points(300, 1) * 0.5 + [4.0, 0.0, 0.0]]))
        add_group(obj, "Source", [0])
        bpy.ops.meshfree.geodesic_distance()
        distance = attribute(obj, "lb_distance")
        assert (distance[900:] == -1.0).all()
        assert (distance[:900] >= 0.0).all()
        assert display.range_node(obj).inputs["From Min"].default_value >= 0.0

    def test_neither_group_nor_selection(self, strip):
        strip.data.vertices.foreach_set("select", np.zeros(1200, dtype=bool))
        with pytest.raises(RuntimeError, match="No points.*are selected"):
            bpy.ops.meshfree.geodesic_distance()

    def test_all_points_as_sources(self, strip):
        strip.data.vertices.foreach_set("select", np.ones(1200, dtype=bool))
        with pytest.raises(RuntimeError, match="All points.*are sources.*Select fewer"):
            bpy.ops.meshfree.geodesic_distance()

    def test_iso_lines_are_a_setting_of_the_display(self, strip):
        strip.data.vertices.foreach_set("select", np.arange(1200) < 5)
        strip.meshfree.iso_lines = 12
        bpy.ops.meshfree.geodesic_distance()
        nodes = strip.modifiers[0].node_group and bpy.data.materials[0].node_tree.nodes
        assert nodes["Iso Lines"].inputs[1].default_value == 12.0
        [line] = [node for node in nodes if node.type == "MATH" and node.operation == "COMPARE"]
        even, share = (socket.links[0].from_node for socket in line.inputs[2].links[0].from_node.inputs[:2])
        middle, width = line.inputs[1].default_value, max(node.inputs[1].default_value for node in (even, share))
        assert (even.operation, share.operation) == ("MINIMUM", "MULTIPLY")  # of which one is 0
        assert 0.0 < middle - width < middle + width < 1.0  # none where the range is left
