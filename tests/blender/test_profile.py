"""Profile: the height or an attribute along the path between two selected points, as a curve and a table."""

from xml.etree import ElementTree

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, local_points, sphere_points
from tests.blender.operators import refused
from tests.blender.test_smooth_colors import add_values


@pytest.fixture
def obj():
    """A sphere with two points selected, a right angle apart."""
    obj = add_object(sphere_points(1000))
    points = local_points(obj)
    ends = [0, int(np.abs(points @ points[0]).argmin())]
    obj.data.vertices.foreach_set("select", np.isin(np.arange(1000), ends))
    obj.location = (1.0, 2.0, 3.0)
    bpy.context.view_layer.update()
    return obj


def told(obj):
    return "\n".join(notice.text for notice in obj.meshfree.notices)


def drawn(obj):
    """Return the corners of the curve in the world, (k, 3), in their order."""
    made = bpy.data.objects[f"{obj.name} Profile"]
    bpy.context.view_layer.update()
    matrix = np.array(made.matrix_world)
    local = np.array([point.co[:3] for spline in made.data.splines for point in spline.points])
    return local @ matrix[:3, :3].T + matrix[:3, 3]


def table(obj):
    text = bpy.data.texts[f"{obj.name} Profile.csv"].as_string()
    return text.splitlines()[0], np.loadtxt(text.splitlines()[1:], delimiter=",")


def test_height_by_distance(obj):
    assert bpy.ops.meshfree.profile() == {"FINISHED"}
    places, (header, rows) = drawn(obj), table(obj)
    assert header == "distance,x,y,z,height,height_uncertainty"
    assert_allclose(rows[-1, 0], 0.5 * np.pi, atol=0.03)
    assert_allclose(np.linalg.norm(rows[:, 1:4] - [1.0, 2.0, 3.0], axis=1), 1.0, atol=5e-3)
    assert_allclose(rows[:, 4], rows[:, 3], atol=1e-9)
    assert_allclose(places[:, 0], 1.0 + rows[:, 0], atol=1e-5)
    assert_allclose(places[:, 1], 2.0, atol=1e-5)
    assert_allclose(places[:, 2], rows[:, 4], atol=1e-5)
    assert "height along Z from" in told(obj)


def test_an_attribute_in_edit_mode_along_another_axis(obj):
    points = local_points(obj)
    add_values(obj, "wide", 10.0 * points[:, 1])
    obj.select_set(True)
    bpy.ops.object.mode_set(mode="EDIT")
    assert bpy.ops.meshfree.profile(source="wide", axis="Y") == {"FINISHED"}
    assert obj.mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    header, rows = table(obj)
    assert header == "distance,x,y,z,height,height_uncertainty,wide,wide_uncertainty"
    assert_allclose(rows[:, 4], rows[:, 2], atol=1e-9)
    assert_allclose(rows[:, 6], 10.0 * (rows[:, 2] - 2.0), atol=0.2)
    assert_allclose(rows[:, 7], 10.0 * rows[:, 5], rtol=1e-3)
    assert np.mean(np.abs(rows[:, 6] - 10.0 * (rows[:, 2] - 2.0)) <= rows[:, 7]) > 0.7
    assert_allclose(drawn(obj)[:, 2], rows[:, 6], atol=1e-5)


def test_gaps_are_told(obj):
    points = local_points(obj)
    ends = np.flatnonzero([vertex.select for vertex in obj.data.vertices])
    middle = points[ends].sum(axis=0) / np.linalg.norm(points[ends].sum(axis=0))
    add_values(obj, "some", np.where(points @ middle > 0.95, np.nan, 1.0))
    assert bpy.ops.meshfree.profile(source="some") == {"FINISHED"}
    assert len(bpy.data.objects[f"{obj.name} Profile"].data.splines) == 2
    missing = np.count_nonzero(np.isnan(table(obj)[1][:, 6]))
    assert f"{missing} of " in told(obj)


def test_what_has_no_profile_is_refused(obj):
    obj.data.attributes.new("label", "INT", "POINT")
    with refused(obj, "no attribute nothing"):
        bpy.ops.meshfree.profile(source="nothing")
    with refused(obj, "is not one number"):
        bpy.ops.meshfree.profile(source="label")
    obj.data.vertices.foreach_set("select", np.arange(1000) < 3)
    with refused(obj, "3 points of .* are selected"):
        bpy.ops.meshfree.profile()


def test_an_attribute_without_values_leaves_nothing(obj):
    add_values(obj, "none", np.full(1000, np.nan))
    with pytest.raises(RuntimeError, match="has no values along the path"):
        bpy.ops.meshfree.profile(source="none")
    assert len(bpy.data.objects) == 1
    assert not bpy.data.texts


def drawing(text):
    """Return texts and lines, (k, 2) each, of an SVG picture."""
    root = ElementTree.fromstring(text)
    space = "{http://www.w3.org/2000/svg}"
    lines = [
        np.array([pair.split(",") for pair in line.get("points").split()], float)
        for line in root.iter(f"{space}polyline")
    ]
    return [one.text for one in root.iter(f"{space}text")], lines


def test_the_last_one_is_exported_as_a_table_and_as_a_picture(obj, tmp_path):
    with refused(obj, "has no profile"):
        bpy.ops.meshfree.export_profile(filepath=str(tmp_path / "a.csv"))
    bpy.ops.meshfree.profile()
    assert bpy.ops.meshfree.export_profile(filepath=str(tmp_path / "a.csv")) == {"FINISHED"}
    assert (tmp_path / "a.csv").read_text() == bpy.data.texts[f"{obj.name} Profile.csv"].as_string()
    bpy.ops.meshfree.export_profile(filepath=str(tmp_path / "a.svg"))
    texts, (line,) = drawing((tmp_path / "a.svg").read_text())
    assert {"Distance (m)", "Height (m)"} <= set(texts)
    rows = table(obj)[1]
    assert_allclose((line[:, 0] - line[0, 0]) / np.ptp(line[:, 0]), rows[:, 0] / rows[-1, 0], atol=1e-3)
    heights = (rows[:, 4] - rows[:, 4].min()) / np.ptp(rows[:, 4])
    assert_allclose((line[:, 1].max() - line[:, 1]) / np.ptp(line[:, 1]), heights, atol=2e-3)
    with refused(obj, "is written as .csv or .svg"):
        bpy.ops.meshfree.export_profile(filepath=str(tmp_path / "a.png"))


def test_a_picture_has_gaps_units_and_any_name(obj, tmp_path):
    add_values(obj, "a<b & c", np.where(local_points(obj)[:, 0] > 0.1, np.nan, 1.0))
    bpy.context.scene.unit_settings.length_unit = "MILLIMETERS"
    points = local_points(obj)
    ends = [int(points[:, 0].argmin()), int(points[:, 0].argmax())]
    obj.data.vertices.foreach_set("select", np.isin(np.arange(1000), ends))
    bpy.ops.meshfree.profile(source="a<b & c")
    bpy.ops.meshfree.export_profile(filepath=str(tmp_path / "a.svg"))
    texts, lines = drawing((tmp_path / "a.svg").read_text())
    assert {"Distance (mm)", "a<b & c"} <= set(texts)
    assert "3,000" in texts
    assert len(lines) == 1


def test_a_changed_table_is_told(obj, tmp_path):
    bpy.ops.meshfree.profile()
    obj.meshfree.profile.from_string("no,table\nat,all")
    with refused(obj, "not as it was written"):
        bpy.ops.meshfree.export_profile(filepath=str(tmp_path / "a.svg"))
    bpy.data.texts.remove(obj.meshfree.profile)
    with refused(obj, "has no profile"):
        bpy.ops.meshfree.export_profile(filepath=str(tmp_path / "a.svg"))
