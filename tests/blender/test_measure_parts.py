"""The table of measures of parts: in the panel, in the clipboard, in files and on the command line."""

import csv
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_object, local_points, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import refused


def two_spheres():
    return np.vstack([2.0 * sphere_points(900), sphere_points(600) + (5.0, 0.0, 0.0)])


@pytest.fixture
def obj():
    return add_object(two_spheres())


def add_attribute(obj, name, values, kind):
    """Give the points an attribute."""
    key = "vector" if kind == "FLOAT_VECTOR" else "value"
    values = np.asarray(values, np.int32 if kind == "INT" else np.float32)
    obj.data.attributes.new(name, kind, "POINT").data.foreach_set(key, values.reshape(-1))


def table(obj):
    """Return the rows that are kept, by their names."""
    return {row.name: row for row in part("operators.objects.parts").kept_rows(obj)}


def within(value, uncertainty, exact):
    return abs(value - exact) < uncertainty < 0.1 * exact


def test_components_of_known_area_and_volume(obj):
    assert bpy.ops.meshfree.measure_parts() == {"FINISHED"}
    rows = table(obj)
    assert list(rows) == ["Component 0", "Component 1"]
    for row, radius, points in zip(rows.values(), (2.0, 1.0), (900, 600), strict=True):
        assert row.points == points
        assert within(row.area, row.area_uncertainty, 4.0 * np.pi * radius**2)
        assert within(row.volume, row.volume_uncertainty, 4.0 / 3.0 * np.pi * radius**3)
        assert row.boundary_length == 0.0
        assert np.isnan(row.mean)


def test_an_open_component_has_a_boundary_and_no_volume():
    points = sphere_points(1500)
    obj = add_object(points[points[:, 2] > 0.0])
    bpy.ops.meshfree.measure_parts()
    [row] = table(obj).values()
    assert abs(row.area - 2.0 * np.pi) < row.area_uncertainty
    assert abs(row.boundary_length - 2.0 * np.pi) < row.length_uncertainty
    assert np.isnan(row.volume)
    assert any("1 of 1 components are not closed" in notice.text for notice in obj.meshfree.notices)


def test_segments_and_the_mean_of_an_attribute(obj):
    points = local_points(obj)
    add_attribute(obj, "lb_segment", np.where(points[:, 2] > 0.0, 3, -1), "INT")
    add_attribute(obj, "height", points[:, 2], "FLOAT")
    bpy.ops.meshfree.measure_parts(volume=False, source="height")
    rows = table(obj)
    assert list(rows) == ["Component 0", "Component 1", "Segment 3"]
    assert within(rows["Segment 3"].area, rows["Segment 3"].area_uncertainty, 10.0 * np.pi)
    assert rows["Segment 3"].mean == pytest.approx((8.0 * 1.0 + 2.0 * 0.5) / 10.0, rel=0.02)
    assert rows["Component 0"].mean == pytest.approx(0.0, abs=0.01)
    assert rows["Component 0"].root_mean_square == pytest.approx(2.0 / np.sqrt(3.0), rel=0.01)
    assert np.isnan(rows["Component 0"].volume)
    assert any("points are in no segment" in notice.text for notice in obj.meshfree.notices)


def test_scale_and_undo(obj):
    obj.scale = (2.0, 2.0, 2.0)
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.meshfree.measure_parts(volume=False)
    bpy.ops.ed.undo_push(message="after")
    assert table(obj)["Component 0"].area == pytest.approx(64.0 * np.pi, rel=0.01)
    outdated = part("operators.objects.parts").are_outdated
    assert not outdated(obj)
    obj.scale = (1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    assert outdated(obj)
    bpy.ops.ed.undo()
    assert len(bpy.context.object.meshfree.parts) == 0


def test_the_roughness_is_taken_where_there_is_one(obj):
    bpy.ops.meshfree.roughness()
    bpy.ops.meshfree.measure_parts(volume=False)
    assert obj.meshfree.part_attribute == "lb_roughness"
    assert table(obj)["Component 0"].root_mean_square >= 0.0


@pytest.mark.parametrize(
    ("name", "values", "kind", "text"),
    [
        ("lb_segment", np.zeros(1500), "FLOAT", "does not hold whole numbers from zero"),
        ("lb_segment", np.full(1500, -1), "INT", "does not hold whole numbers from zero"),
        ("height", np.zeros((1500, 3)), "FLOAT_VECTOR", "has 3 numbers at each point"),
    ],
)
def test_attributes_of_another_kind_are_refused(obj, name, values, kind, text):
    add_attribute(obj, name, values, kind)
    with refused(obj, text):
        bpy.ops.meshfree.measure_parts(source="height" if name == "height" else "")


def test_an_attribute_that_is_missing_is_refused(obj):
    with refused(obj, "has no attribute nothing"):
        bpy.ops.meshfree.measure_parts(source="nothing")


@pytest.mark.parametrize(
    ("value", "uncertainty", "texts"),
    [
        (12.56637, 0.0321, ("12.57", "0.04")),
        (12.56637, 0.0121, ("12.566", "0.013")),
        (12.56637, 2.9, ("13", "3")),
        (12345.6, 230.0, ("12300", "300")),
        (0.000123456, 0.0000021, ("0.000123", "0.000003")),
        (1.0, 0.2, ("1.0", "0.2")),
        (12.56637, 0.0, ("12.57", "0")),
        (4.18879, 1e-9, ("4.188790", "0.000001")),
        (0.0, 0.5, ("0.0", "0.5")),
    ],
)
def test_numbers_have_the_digits_that_their_uncertainty_leaves(value, uncertainty, texts):
    assert part("ui.measures").rounded(value, uncertainty) == texts


def test_the_table_in_the_clipboard(obj):
    settings = bpy.context.scene.unit_settings
    settings.system, settings.scale_length, settings.length_unit = "METRIC", 0.001, "MILLIMETERS"
    bpy.ops.meshfree.measure_parts()
    titles, *lines = part("ui.measures").as_text(obj, settings).splitlines()
    assert titles.split("\t") == ["Part", "Points", "Area (mm²)", "±", "Volume (mm³)", "±"]
    name, points, area, off, volume, doubt = lines[0].split("\t")
    assert (name, points) == ("Component 0", "900")
    assert within(float(area), float(off), 16.0 * np.pi)
    assert within(float(volume), float(doubt), 32.0 / 3.0 * np.pi)
    assert len(area.partition(".")[2]) == len(off.partition(".")[2])
    bpy.ops.meshfree.copy_measures()


@pytest.mark.parametrize("name", ["copy_measures", "export_measures"])
def test_without_measures_nothing_is_copied_or_exported(obj, name):
    with pytest.raises(RuntimeError, match="has no measures. Press Measure Parts first"):
        getattr(bpy.ops.meshfree, name)()


def test_the_table_in_a_file(obj, tmp_path):
    bpy.ops.meshfree.measure_parts()
    bpy.ops.meshfree.export_measures(filepath=str(tmp_path / "a.csv"))
    rows = list(csv.DictReader((tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["name"] for row in rows] == ["Component 0", "Component 1"]
    assert float(rows[0]["area"]) == obj.meshfree.parts[0].area
    assert rows[0]["mean"] == ""


def test_the_panel_draws_the_table(obj):
    bpy.ops.meshfree.measure_parts()
    drawn = []
    layout = SimpleNamespace(label=lambda text="", icon="NONE": drawn.append(text))
    layout.column = layout.row = lambda align=False: layout
    layout.operator = lambda name, text="": drawn.append(name)
    part("ui.measures").draw_measures(layout, bpy.context)
    assert "Component 0: 900 points" in drawn
    assert any("±" in text for text in drawn)
    assert drawn[-2:] == ["meshfree.copy_measures", "meshfree.export_measures"]
