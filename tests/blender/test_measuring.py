"""Measures of selected points, and paths between two of them."""

import re

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_object, grid_points, local_points, sphere_points
from tests.blender.conftest import part
from tests.blender.operators import refused


@pytest.fixture
def obj():
    return add_object(sphere_points(1000))


def choose(obj, chosen):
    obj.data.vertices.foreach_set("select", chosen)


def told(obj):
    """Return the kept texts about an object, in one."""
    return "\n".join(notice.text for notice in obj.meshfree.notices)


def figure(obj, name):
    return float(re.search(rf"{name} ([\d.]+)", told(obj)).group(1))


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_half_a_sphere(obj, mode):
    choose(obj, local_points(obj)[:, 2] > 0.0)
    obj.select_set(True)
    bpy.ops.object.mode_set(mode=mode)
    assert bpy.ops.meshfree.measure_selection(volume=True) == {"FINISHED"}
    assert obj.mode == mode
    bpy.ops.object.mode_set(mode="OBJECT")
    assert figure(obj, "Area") == pytest.approx(2.0 * np.pi, rel=0.02)
    assert figure(obj, "Boundary") == pytest.approx(2.0 * np.pi, rel=0.02)
    assert figure(obj, "Mean curvature") == pytest.approx(1.0, rel=0.02)
    assert figure(obj, "Volume") == pytest.approx(4.0 * np.pi / 3.0, rel=0.01)
    assert figure(obj, "Over the plane of its rim") == pytest.approx(2.0 * np.pi / 3.0, rel=0.04)


def test_the_status_bar_tells_the_area_and_where_the_other_figures_are(obj, capfd):
    choose(obj, local_points(obj)[:, 2] > 0.0)
    bpy.ops.meshfree.measure_selection()
    assert re.search(r"Cloud: 4\d\d points, Area 6.\d+ m² ± .* %. All .* sidebar \(N\)", capfd.readouterr().out)
    bpy.ops.meshfree.measure_parts()
    assert re.search(
        r"1 part measured, area 12.\d+ m² ± .* %. The table is in the sidebar \(N\)", capfd.readouterr().out
    )


def test_the_figures_follow_the_scale_and_the_last_selection(obj):
    choose(obj, local_points(obj)[:, 2] > 0.5)
    bpy.ops.meshfree.measure_selection()
    obj.scale = (2.0, 2.0, 2.0)
    choose(obj, local_points(obj)[:, 2] > 0.0)
    bpy.ops.meshfree.measure_selection()
    assert figure(obj, "Area") == pytest.approx(8.0 * np.pi, rel=0.02)
    assert told(obj).count("Area") == 1


def test_a_path_between_two_points(obj):
    points = local_points(obj)
    ends = [10, int((points @ points[10]).argmin())]
    choose(obj, np.isin(np.arange(len(points)), ends))
    obj.location, obj.scale = (1.0, 2.0, 3.0), (1.0, 1.0, 1.0)
    assert bpy.ops.meshfree.geodesic_path(thickness=0.01) == {"FINISHED"}
    made = bpy.data.objects[f"{obj.name} Path"]
    places = np.array([point.co[:3] for point in made.data.splines[0].points])
    np.testing.assert_allclose(places[[0, -1]], points[sorted(ends)], atol=1e-6)
    angle = np.arccos(points[ends[0]] @ points[ends[1]])
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).sum() == pytest.approx(angle, rel=2e-3)
    assert tuple(made.matrix_world.translation) == (1.0, 2.0, 3.0)
    assert made.data.bevel_depth == pytest.approx(0.01)
    assert "along the surface" in told(obj)


def test_a_path_takes_two_points(obj):
    choose(obj, np.arange(1000) < 3)
    with refused(obj, "3 points of .* are selected. Select the two"):
        bpy.ops.meshfree.geodesic_path()


def test_nothing_selected_is_said(obj):
    choose(obj, np.zeros(1000, dtype=bool))
    with refused(obj, "No points of .* are selected"):
        bpy.ops.meshfree.measure_selection()


def test_what_has_no_rim_has_no_volume_over_it(obj):
    choose(obj, np.ones(1000, dtype=bool))
    bpy.ops.meshfree.measure_selection(volume=True)
    assert "0 points at its rim" in told(obj)
    assert "Over the plane" not in told(obj)


def test_a_path_of_points_with_columns_of_their_file(obj):
    obj["lb_columns"] = '{"points": 1000, "columns": {}}'
    obj["lb_offset"] = (100.0, 0.0, 0.0)
    choose(obj, np.arange(1000) < 2)
    assert bpy.ops.meshfree.geodesic_path() == {"FINISHED"}
    assert tuple(bpy.data.objects[f"{obj.name} Path"]["lb_offset"]) == (100.0, 0.0, 0.0)


class TestPlanes:
    """The planes over which the volume under selected points is measured."""

    @pytest.fixture
    def cap(self, obj):
        choose(obj, local_points(obj)[:, 2] > 0.0)
        obj.location = (0.0, 0.0, 3.0)
        bpy.context.view_layer.update()
        return obj

    def net(self, obj, over):
        bpy.ops.meshfree.measure_selection(volume=True)
        return float(re.search(rf"Over {over} .* the difference (-?[\d.]+) ", told(obj)).group(1))

    def test_a_height(self, cap):
        cap.meshfree.volume_over, cap.meshfree.volume_height = "LEVEL", 2.0
        assert self.net(cap, "the height 2 m") == pytest.approx(5.0 * np.pi / 3.0, rel=0.02)

    def test_an_object_from_either_side(self, cap):
        empty = bpy.data.objects.new("Ground", None)
        empty.location = (5.0, 0.0, 2.0)
        bpy.context.scene.collection.objects.link(empty)
        cap.meshfree.volume_over, cap.meshfree.volume_plane = "OBJECT", empty.name
        assert self.net(cap, '"Ground"') == pytest.approx(5.0 * np.pi / 3.0, rel=0.02)
        empty.rotation_euler = (np.pi, 0.0, 0.0)
        bpy.context.view_layer.update()
        assert self.net(cap, '"Ground"') == pytest.approx(-5.0 * np.pi / 3.0, rel=0.02)

    def test_points_of_another_object_where_it_stands(self, cap):
        ground, _ = grid_points()
        other = add_object(ground - np.mean(ground, axis=0), "Before")
        other.location, other.scale = (0.0, 0.0, 2.0), (1.0, 1.5, 1.0)
        bpy.context.view_layer.objects.active = cap
        cap.meshfree.volume_over, cap.meshfree.volume_plane = "POINTS", other.name
        assert self.net(cap, '"Before"') == pytest.approx(5.0 * np.pi / 3.0, rel=0.02)
        other.location.z = 9.0
        assert self.net(cap, '"Before"') == pytest.approx(-16.0 * np.pi / 3.0, rel=0.02)
        other.location.x = 50.0
        bpy.ops.meshfree.measure_selection(volume=True)
        assert "has the other surface above or below it" in told(cap)
        cap.meshfree.volume_plane = cap.name
        with refused(cap, "Volumes are measured over the points of another object"):
            bpy.ops.meshfree.measure_selection(volume=True)

    def test_no_object_is_refused(self, cap):
        cap.meshfree.volume_over, cap.meshfree.volume_plane = "OBJECT", "Nobody"
        with refused(cap, 'There is no object "Nobody"'):
            bpy.ops.meshfree.measure_selection(volume=True)
        assert bpy.ops.meshfree.measure_selection() == {"FINISHED"}


class TestLive:
    """Measures that follow the selection in Edit Mode."""

    @pytest.fixture
    def live(self, obj):
        choose(obj, local_points(obj)[:, 2] > 0.0)
        bpy.ops.object.mode_set(mode="EDIT")
        assert bpy.ops.meshfree.measure_live() == {"FINISHED"}
        yield obj
        part("operators.tools.measure_live").stop()

    def shown(self, obj):
        """Return the figures and notices that the panel shows, None if it shows none."""
        known = part("operators.tools.measure_live").followed(obj)
        return known and ({figure.title: figure.values for figure in known.figures}, known.notices)

    def pick(self, obj, chosen):
        """Select points in Edit Mode, as Blender's tools do."""
        import bmesh  # there once bpy is

        edited = bmesh.from_edit_mesh(obj.data)
        for point, wanted in zip(edited.verts, chosen.tolist(), strict=True):
            point.select = wanted
        bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)
        bpy.context.view_layer.update()

    def test_the_figures_follow_the_selection(self, live):
        points = np.array([point.co for point in live.data.vertices])
        figures, notices = self.shown(live)
        assert figures["Area"][0] == pytest.approx(2.0 * np.pi, rel=0.02)
        assert figures["Above the Plane"][0] == pytest.approx(2.0 * np.pi / 3.0, rel=0.04)
        self.pick(live, points[:, 2] > 0.5)
        figures, notices = self.shown(live)
        assert figures["Area"][0] == pytest.approx(np.pi, rel=0.02)
        assert figures["Boundary"][0] == pytest.approx(np.pi * np.sqrt(3.0), rel=0.02)
        assert figures["Mean Curvature"][0] == pytest.approx(1.0, rel=0.02)
        bpy.ops.mesh.select_all(action="DESELECT")
        assert self.shown(live) == ({}, ["No points are selected"])
        bpy.ops.mesh.select_all(action="SELECT")
        figures, notices = self.shown(live)
        assert figures["Area"][0] == pytest.approx(4.0 * np.pi, rel=0.02)
        assert "Above the Plane" not in figures
        assert "at its rim" in notices[0]

    def test_the_volume_of_a_closed_surface_is_measured_once(self, live, monkeypatch):
        figures, _ = self.shown(live)
        assert figures["Volume"][0] == pytest.approx(4.0 * np.pi / 3.0, rel=0.01)
        again = []
        monkeypatch.setattr(part("core.measure.volume"), "_volume", lambda *_: again.append(_))
        bpy.ops.mesh.select_all(action="INVERT")
        assert self.shown(live)[0]["Volume"] == figures["Volume"]
        assert list(self.shown(live)[0])[-1] == "Volume"
        assert again == []

    def test_why_there_is_no_volume_of_the_surface_is_told_beside_the_other_figures(self, cache, obj, monkeypatch):
        def refuse(*_):
            raise part("core").PointCloudError("There is no mesh")

        module = part("operators.tools.measure_live")
        monkeypatch.setattr(part("core.measure.volume"), "_volume", refuse)
        choose(obj, local_points(obj)[:, 2] > 0.0)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.meshfree.measure_live()
        figures, notices = self.shown(obj)
        module.stop()
        assert "Area" in figures
        assert "Volume" not in figures
        assert "not measured: There is no mesh" in notices[-1]

    def test_an_open_surface_has_no_volume_of_its_own(self):
        obj = add_object(sphere_points(1000)[sphere_points(1000)[:, 2] < 0.6])
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.meshfree.measure_live()
        figures, _ = self.shown(obj)
        part("operators.tools.measure_live").stop()
        assert "Area" in figures
        assert "Volume" not in figures

    def test_the_same_selection_is_not_measured_again(self, live, monkeypatch):
        module = part("operators.tools.measure_live")
        calls = []
        monkeypatch.setattr(module, "measured", lambda *_: calls.append(_))
        live.update_tag()
        bpy.context.view_layer.update()
        bpy.ops.ed.undo_push(message="Nothing")
        assert calls == []
        bpy.ops.mesh.select_all(action="INVERT")
        assert len(calls) == 1

    def test_nothing_is_written(self, live):
        bpy.ops.mesh.select_all(action="INVERT")
        bpy.ops.object.mode_set(mode="OBJECT")
        assert not len(live.meshfree.notices)
        assert [name for name in live.data.attributes.keys() if name.startswith("lb_")] == []

    def test_another_plane_is_measured_from_at_once(self, live):
        live.meshfree.volume_height = -1.0
        live.meshfree.volume_over = "LEVEL"
        assert self.shown(live)[0]["Above the Plane"][0] == pytest.approx(5.0 * np.pi / 3.0, rel=0.02)
        live.meshfree.volume_over = "OBJECT"
        assert 'There is no object ""' in self.shown(live)[1][0]

    def test_so_are_points_of_another_object(self, live):
        points, _ = grid_points()
        mesh = bpy.data.meshes.new("Before")
        mesh.from_pydata((points - np.mean(points, axis=0) - [0.0, 0.0, 1.0]).tolist(), [], [])
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("Before", mesh))
        live.meshfree.volume_plane = "Before"
        live.meshfree.volume_over = "POINTS"
        assert self.shown(live)[0]["Above the Plane"][0] == pytest.approx(5.0 * np.pi / 3.0, rel=0.02)

    def test_points_that_are_moved_are_not_measured(self, live):
        bpy.ops.transform.translate(value=(0.0, 0.0, 1.0))
        bpy.context.view_layer.update()
        figures, notices = self.shown(live)
        assert figures == {}
        assert "were changed" in notices[0]
        bpy.ops.transform.translate(value=(0.0, 0.0, -1.0))
        bpy.context.view_layer.update()
        bpy.ops.mesh.delete(type="VERT")
        assert "were changed" in self.shown(live)[1][0]

    def test_a_change_of_settings_is_told(self, live):
        live.meshfree.bandwidth_factor = 1.2
        bpy.ops.mesh.select_all(action="INVERT")
        assert "were changed" in self.shown(live)[1][0]

    @pytest.mark.parametrize(
        "end",
        [
            lambda: bpy.ops.meshfree.measure_live(),
            lambda: bpy.ops.object.mode_set(mode="OBJECT"),
            lambda: bpy.ops.wm.read_homefile(use_empty=True),
        ],
        ids=["off", "mode", "file"],
    )
    def test_it_ends(self, live, end):
        name = live.name
        end()
        assert self.shown(bpy.data.objects.get(name)) is None

    def test_it_needs_edit_mode(self, obj):
        assert not bpy.ops.meshfree.measure_live.poll()

    def test_figures_have_the_digits_of_their_uncertainty(self, installed):
        figure = part("operators.tools.measuring").Figure
        text, scene = part("ui.measures").figure_text, bpy.context.scene.unit_settings
        assert text(figure("Area", (1.23456,), 0.013, 2), scene) == "1.235 ± 0.013 m²"
        assert text(figure("Below the Plane", (1e-5,), 0.16, 3), scene) == "0.00 ± 0.16 m³"
        assert text(figure("Size", (0.1, 0.02, 0.03), 0.0, 1), scene) == "10 x 2 x 3 cm"
        assert text(figure("Mean Curvature", (-0.5,), 0.0, -1), scene) == "-0.5 1/m"
