"""Along the surface: cells around points, texture coordinates, directions carried to all points."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from tests.blender.clouds import add_group, add_object, attribute, grid_points, local_points, sphere_points
from tests.blender.operators import refused

NAMES = {"nearest_source": "lb_cell", "unwrap": "lb_uv", "extend_direction": "lb_direction"}


def run(name, **settings):
    return getattr(bpy.ops.meshfree, name)(**settings)


@pytest.fixture
def strip():
    return add_object(grid_points(columns=60, rows=20, step=0.1)[0])


@pytest.fixture
def two():
    """Two spheres with a source on the first one."""
    obj = add_object(np.concatenate([sphere_points(900), sphere_points(300, 1) * 0.5 + [4.0, 0.0, 0.0]]))
    add_group(obj, "Source", [0])
    return obj


def nearest(obj, *place):
    return int(np.argmin(np.linalg.norm(local_points(obj) - place, axis=1)))


@pytest.mark.parametrize("name", NAMES)
def test_the_result_is_shown(strip, extension, name):
    add_group(strip, "Source", [nearest(strip, 3.0, 1.0, 0.0)])
    settings = {"direction": (0.0, 1.0, 0.0)} if name == "extend_direction" else {}
    assert run(name, **settings) == {"FINISHED"}
    assert extension.ui.display.shown_attribute(strip) == NAMES[name]
    scale = extension.ui.scale.shown_scale(strip, bpy.context.scene)
    assert scale.title == {"nearest_source": "Cell", "unwrap": "UV", "extend_direction": "Direction"}[name]
    assert len(scale.boxes or scale.colors) == {"nearest_source": 1, "unwrap": 2, "extend_direction": 6}[name]


@pytest.mark.parametrize("name", NAMES)
def test_neither_group_nor_selection(strip, name):
    strip.data.vertices.foreach_set("select", np.zeros(1200, dtype=bool))
    with refused(strip, "No points.*are selected"):
        run(name)


@pytest.mark.parametrize("name", NAMES)
def test_points_that_nothing_reaches(two, name):
    assert run(name) == {"FINISHED"}
    found = attribute(two, NAMES[name])
    assert (found[900:] == {"nearest_source": -1, "unwrap": -1.0, "extend_direction": 0.0}[name]).all()
    assert (np.abs(found[:900]).max(axis=-1) >= 0.0).all()
    assert np.isfinite(found).all()


def test_cells_of_selected_points(strip):
    sources = [nearest(strip, 0.5, 1.0, 0.0), nearest(strip, 5.5, 1.0, 0.0)]
    strip.data.vertices.foreach_set("select", np.isin(np.arange(1200), sources))
    run("nearest_source")
    x, expected = local_points(strip)[:, 0], np.argsort(np.argsort(sources))
    clear = np.abs(x - 3.0) > 0.2
    assert_array_equal(attribute(strip, "lb_cell")[clear], np.where(x < 3.0, *expected)[clear])


class TestUnwrap:
    def test_the_middle_and_the_border_of_the_texture(self, strip):
        middle = nearest(strip, 3.0, 1.0, 0.0)
        add_group(strip, "Source", [middle])
        strip.scale = 2.0, 2.0, 2.0
        bpy.context.view_layer.update()
        run("unwrap", radius=1.0)
        found, offset = attribute(strip, "lb_uv"), local_points(strip) - local_points(strip)[middle]
        assert_allclose(found[middle], 0.5)
        assert_allclose(np.linalg.norm(found - 0.5, axis=1), np.linalg.norm(offset, axis=1), atol=0.03)
        run("unwrap")
        assert np.linalg.norm(attribute(strip, "lb_uv") - 0.5, axis=1).max() == pytest.approx(0.5)

    def test_the_angle_turns_it(self, strip):
        add_group(strip, "Source", [nearest(strip, 3.0, 1.0, 0.0)])
        run("unwrap")
        before = attribute(strip, "lb_uv") - 0.5
        run("unwrap", angle=np.pi / 2.0)
        assert_allclose(attribute(strip, "lb_uv") - 0.5, np.column_stack([-before[:, 1], before[:, 0]]), atol=1e-6)

    def test_of_several_points_it_takes_the_one_in_the_middle(self, strip):
        x, y, _ = local_points(strip).T
        strip.data.vertices.foreach_set("select", np.hypot(x - 2.0, y - 1.0) < 0.35)
        run("unwrap")
        middle = np.argmin(np.linalg.norm(attribute(strip, "lb_uv") - 0.5, axis=1))
        assert_allclose(local_points(strip)[middle, :2], [2.0, 1.0], atol=0.15)

    def test_what_is_kept_in_edit_mode_and_in_exports(self, strip, tmp_path):
        add_group(strip, "Source", [nearest(strip, 3.0, 1.0, 0.0)])
        run("unwrap")
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.object.mode_set(mode="OBJECT")
        path = tmp_path / "points.csv"
        assert bpy.ops.meshfree.export_points(filepath=str(path)) == {"FINISHED"}
        assert "lb_uv" in path.read_text(encoding="utf-8").splitlines()[0]


class TestExtendDirection:
    def test_on_a_flat_strip_it_is_the_same_everywhere(self, strip):
        add_group(strip, "Source", [nearest(strip, 0.0, 1.0, 0.0)])
        run("extend_direction", direction=(3.0, 4.0, 9.0))
        assert_allclose(attribute(strip, "lb_direction"), np.tile([0.6, 0.8, 0.0], (1200, 1)), atol=1e-5)

    def test_along_the_axes_of_the_world(self, strip):
        add_group(strip, "Source", [0])
        strip.rotation_euler.z = np.pi / 2.0
        strip.scale = 3.0, 3.0, 3.0
        bpy.context.view_layer.update()
        run("extend_direction", direction=(0.0, 1.0, 0.0))
        assert_allclose(attribute(strip, "lb_direction"), np.tile([1.0, 0.0, 0.0], (1200, 1)), atol=1e-5)

    def test_a_direction_out_of_the_surface(self, strip):
        add_group(strip, "Source", [0])
        with refused(strip, "are zero or normal to the surface"):
            run("extend_direction")


def add_curve(places, cyclic=False, kind="POLY"):
    data = bpy.data.curves.new("Line", "CURVE")
    data.dimensions = "3D"
    spline = data.splines.new(kind)
    spline.points.add(len(places) - 1)
    spline.points.foreach_set("co", np.column_stack([places, np.ones(len(places))]).ravel())
    spline.use_cyclic_u = cyclic
    curve = bpy.data.objects.new("Line", data)
    bpy.context.scene.collection.objects.link(curve)
    return curve


class TestSignedDistance:
    def test_beside_a_straight_line(self, strip):
        strip.location = 5.0, 0.0, 2.0
        strip.scale = 2.0, 2.0, 2.0
        curve = add_curve([[0.0, 2.0, 0.0], [12.0, 2.0, 0.0]])
        curve.location = 5.0, 0.0, 2.0
        bpy.context.view_layer.update()
        assert run("signed_distance", curve="Line") == {"FINISHED"}
        found, height = attribute(strip, "lb_signed_distance"), 2.0 * local_points(strip)[:, 1] - 2.0
        up = attribute(strip, "lb_disc")[0, 2]
        line = 2.0 * local_points(strip)[int(np.argmin(np.abs(found)))][1] - 2.0  # the nearest row of points
        # Points are up to 0.04 off their rows, that of the nearest point and those that the path runs through.
        assert_allclose(found * np.sign(up), height - line, atol=0.08)

    def test_around_the_equator(self):
        obj = add_object(sphere_points(3000))
        turn = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
        add_curve(np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1), cyclic=True)
        run("signed_distance", curve="Line")
        assert_allclose(attribute(obj, "lb_signed_distance"), np.arcsin(local_points(obj)[:, 2]), atol=0.06)

    @pytest.mark.parametrize(
        ("make", "text"),
        [
            (lambda: None, 'There is no curve "Line"'),
            (lambda: add_object(sphere_points(), "Line"), 'There is no curve "Line"'),
            (lambda: add_curve([[0.0, 0.0, 0.0]] * 3), "at one point of the cloud"),
            (lambda: setattr(add_curve([[0, 0, 0], [1, 1, 0]]).data, "bevel_depth", 0.1), "or a bevel"),
            (lambda: add_curve([[0, 0, 0], [1, 1, 0]]).data.splines.new("POLY"), "2 splines"),
        ],
    )
    def test_what_is_no_line_on_the_surface(self, strip, make, text):
        make()
        bpy.context.view_layer.objects.active = strip
        strip.select_set(True)
        bpy.context.view_layer.update()
        with refused(strip, text):
            run("signed_distance", curve="Line")

    def test_other_components_are_told(self, two, capfd):
        turn = np.linspace(0.0, 2.0 * np.pi, 20, endpoint=False)
        add_curve(np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1), cyclic=True)
        assert run("signed_distance", curve="Line") == {"FINISHED"}
        assert (attribute(two, "lb_signed_distance")[900:] == 0.0).all()
        assert "Cloud: 300 points are reached by no source" in capfd.readouterr().out


def test_a_radius_that_is_no_number_is_refused():
    obj = add_object(sphere_points(300))
    with refused(obj, "radius of the texture is not a number"):
        bpy.ops.meshfree.unwrap(radius=float("nan"))
