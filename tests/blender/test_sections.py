"""Cross Section: the curves in which an object's plane cuts the surface, beside the points, measured."""

import json
import re

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, everything, sphere_points
from tests.blender.operators import refused
from tests.blender.test_command import run  # noqa: F401


@pytest.fixture
def obj():
    return add_object(sphere_points(1000))


def plane(location=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0)):
    """Add an empty."""
    empty = bpy.data.objects.new("Plane", None)
    empty.location, empty.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(empty)
    return empty


def told(obj):
    return [notice.text for notice in obj.meshfree.notices]


def figures(obj):
    """Return length and enclosed area, as they are told."""
    return [float(found) for found in re.search(r"([\d.]+) m long, enclosed area ([\d.]+) m", told(obj)[-1]).groups()]


def corners(made):
    """Return the corners of a curve object in the world, (k, 3)."""
    matrix = np.array(made.matrix_world)
    local = np.array([point.co[:3] for spline in made.data.splines for point in spline.points])
    return local @ matrix[:3, :3].T + matrix[:3, 3]


def test_an_empty_cuts_a_circle(obj):
    obj.location, obj.rotation_euler, obj.scale = (1.0, 2.0, 3.0), (0.3, 0.4, 0.5), (2.0, 2.0, 2.0)
    empty = plane((1.0, 3.0, 3.0), (np.pi / 2.0, 0.0, 0.0))  # across Y, one above the middle
    before = everything(obj)
    assert bpy.ops.meshfree.cross_section(plane=empty.name, thickness=0.01) == {"FINISHED"}
    made = bpy.data.objects[f"{obj.name} Section"]
    (spline,) = made.data.splines
    assert spline.use_cyclic_u
    assert made.data.bevel_depth == pytest.approx(0.01)
    places = corners(made)
    assert_allclose(places[:, 1], 3.0, atol=1e-5)
    assert_allclose(np.linalg.norm(places - [1.0, 2.0, 3.0], axis=1), 2.0, atol=4e-3)
    assert_allclose(figures(obj), [2.0 * np.pi * np.sqrt(3.0), 3.0 * np.pi], rtol=5e-3)
    assert everything(obj)["attributes"] == before["attributes"]
    assert bpy.context.object == obj


def test_without_an_object_it_is_the_horizontal_plane_through_the_middle(obj):
    assert bpy.ops.meshfree.cross_section() == {"FINISHED"}
    assert_allclose(corners(bpy.data.objects[f"{obj.name} Section"])[:, 2], 0.0, atol=0.01)
    assert "horizontal plane through its middle" in told(obj)[0]
    bpy.ops.meshfree.cross_section(plane=plane().name)
    assert len(told(obj)) == 1


def test_objects_that_share_a_mesh_may_be_cut(obj):
    other = obj.copy()
    other.scale = (3.0, 3.0, 3.0)
    bpy.context.scene.collection.objects.link(other)
    assert bpy.ops.meshfree.cross_section() == {"FINISHED"}
    assert other.data == obj.data


def test_a_plane_beside_the_surface_or_none_is_refused(obj):
    empty = plane((0.0, 0.0, 5.0))
    with refused(obj, "passes beside the surface"):
        bpy.ops.meshfree.cross_section(plane=empty.name)
    empty.scale = (0.0, 1.0, 1.0)
    with refused(obj, "scaled to nothing along X or Y"):
        bpy.ops.meshfree.cross_section(plane=empty.name)
    with refused(obj, 'There is no object "Nobody"'):
        bpy.ops.meshfree.cross_section(plane="Nobody")


class TestVerb:
    def write(self, path, points):
        np.savetxt(path, points, "%.15g", ",", header="x,y,z", comments="")
        return path

    def test_curves_leave_in_the_coordinates_of_the_file(self, run, tmp_path):  # noqa: F811
        far = np.array([400_000.0, 5_000_000.0, 100.0])
        path = self.write(tmp_path / "a.csv", sphere_points(1000) + far)
        given = ("--plane", "400000,5000000.5,100", "--normal", "0,2,0", "--curves", "--out", tmp_path / "out.csv")
        code, [line] = run("section", path, *given)
        assert code == 0, line
        assert (line["curves"], line["open_curves"]) == (1, 0)
        assert line["length"] == pytest.approx(np.pi * np.sqrt(3.0), rel=5e-3)
        assert line["enclosed_area"] == pytest.approx(0.75 * np.pi, rel=5e-3)
        assert (tmp_path / "out_curves.csv").read_text().startswith("curve,closed,x,y,z\n1,1,")
        rows = np.loadtxt(tmp_path / "out_curves.csv", delimiter=",", skiprows=1)
        assert_allclose(rows[:, 3], 5_000_000.5, rtol=0.0, atol=1e-6)
        assert_allclose(np.linalg.norm(rows[:, 2:] - far, axis=1), 1.0, atol=3e-3)

    def test_a_table_has_a_row_for_each_curve(self, run, tmp_path):  # noqa: F811
        both = np.concatenate([sphere_points(1000), 0.6 * sphere_points(800)])
        both = np.concatenate([both, sphere_points(1000)[sphere_points(1000)[:, 1] > 0.0] + [4.0, 0.0, 0.0]])
        path = self.write(tmp_path / "a.csv", both)
        code, [line] = run("section", path, "--plane", "0,0,0", "--out", tmp_path / "out.json")
        assert code == 0, line
        rows = json.loads((tmp_path / "out.json").read_text())
        assert [row["curve"] for row in rows] == [1, 2, 3]
        kinds = {(row["closed"], row["hole"]): row for row in rows}
        assert kinds[1, 0]["length"] == pytest.approx(2.0 * np.pi, rel=5e-3)
        assert kinds[1, 1]["enclosed_area"] == pytest.approx(0.36 * np.pi, rel=1e-2)
        assert kinds[0, 0]["enclosed_area"] == 0.0
        assert kinds[0, 0]["length"] == pytest.approx(np.pi, rel=0.05)
        assert run("section", path, "--plane", "0,0,0", "--out", tmp_path / "out.csv")[0] == 0
        table = (tmp_path / "out.csv").read_text().splitlines()
        assert table[0] == "curve,length,enclosed_area,closed,hole"
        assert [line.split(",")[-2:] for line in table[1:]] == [[str(row["closed"]), str(row["hole"])] for row in rows]

    def test_files_beside_the_output_need_one_and_replace_no_input(self, run, tmp_path):  # noqa: F811
        path = self.write(tmp_path / "a_curves.csv", sphere_points(1000))
        assert run("section", path, "--curves")[0] == 2
        before = path.read_bytes()
        code, [line] = run("section", path, "--curves", "--out", tmp_path / "a.csv")
        assert code == 1
        assert "overwrite its input" in line["error"]
        assert path.read_bytes() == before

    def test_without_a_plane_it_is_said(self, run, tmp_path):  # noqa: F811
        path = self.write(tmp_path / "a.csv", sphere_points(1000))
        code, [line] = run("section", path, "--normal", "1,0,0", "--out", tmp_path / "a.blend")
        assert code == 0, line
        assert any("no --plane is given" in notice for notice in line["notices"])
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
        assert_allclose(corners(bpy.data.objects["a Section"])[:, 0], 0.0, atol=0.01)

    def test_an_object_has_a_normal_of_its_own(self, run, tmp_path):  # noqa: F811
        path = self.write(tmp_path / "a.csv", sphere_points(1000))
        assert run("section", path, "--plane", "Empty", "--normal", "1,0,0")[0] == 2
