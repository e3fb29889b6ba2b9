"""Colors that run on from one disc to the next: slopes of what is shown, iso lines of one width, and shading."""

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, sphere_points
from tests.blender.test_display import rendered

SLOPES = ".lb_slope", ".lb_slope_2", ".lb_slope_of"


@pytest.fixture
def obj():
    obj = add_object(sphere_points(2000))
    bpy.ops.meshfree.show_surface()
    add_values(obj, "height", attribute(obj, "position")[:, 2])
    return obj


def add_values(obj, name, values, kind="FLOAT"):
    layer = obj.data.attributes.get(name) or obj.data.attributes.new(name, kind, "POINT")
    key = "vector" if kind in {"FLOAT2", "FLOAT_VECTOR"} else "value"
    layer.data.foreach_set(key, np.ascontiguousarray(values, {"INT": np.int32}.get(kind, np.float32)).reshape(-1))


def show(obj, name):
    bpy.context.view_layer.objects.active = obj
    assert bpy.ops.meshfree.colormap(attribute=name) == {"FINISHED"}


def slopes(obj):
    return [name for name in SLOPES if name in obj.data.attributes]


def corners(obj):
    """Return place, value and rise at each corner that is drawn: of each disc all, one disc after the other."""
    bpy.context.view_layer.update()
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    found = []
    for name, width, key in (("position", 3, "vector"), ("lb_rise", 3, "vector")):
        layer = mesh.attributes.get(name)
        if layer is None:
            return None
        found.append(np.empty(width * len(layer.data), np.float32))
        layer.data.foreach_get(key, found[-1])
    return [values.reshape(-1, 3) for values in found]


def rise(obj):
    found = corners(obj)
    return None if found is None else found[1]


def rising(obj):
    """Return which of the discs of 2,000 points have corners with other values than their middles."""
    return np.abs(rise(obj)).reshape(2000, -1).max(axis=1) > 0.0


def test_each_corner_holds_the_value_of_its_place(obj):
    show(obj, "height")
    places, rises = corners(obj)
    flat = np.repeat(attribute(obj, "height"), len(places) // 2000)
    shown = flat + rises[:, 0]
    assert np.abs(flat - places[:, 2]).max() > 0.05
    off = np.abs(shown - places[:, 2])  # corners lie below the tangent plane of the sphere by a quarter of the radius
    assert np.median(off) < 0.02
    assert_allclose(np.median(rises[:, 1]), np.median(np.sqrt(1.0 - attribute(obj, "height") ** 2)), atol=0.01)
    assert (rises[:, 2] == 1.0).all()


def test_both_texture_coordinates_rise(obj):
    add_values(obj, "lb_uv", attribute(obj, "position")[:, :2], "FLOAT2")
    show(obj, "lb_uv")
    places, rises = corners(obj)
    wanted = places[:, :2] - np.repeat(attribute(obj, "position")[:, :2], len(places) // 2000, axis=0)
    assert np.median(np.abs(rises[:, :2] - wanted)) < 0.3 * np.median(np.abs(wanted))
    assert not rises[:, 2].any()


@pytest.mark.parametrize(("part", "axis"), [("LENGTH", None), ("X", 0), ("Y", 1), ("Z", 2)])
def test_of_vectors_what_is_shown_rises(obj, part, axis):
    vectors = 2.0 + attribute(obj, "position")
    add_values(obj, "vector", vectors, "FLOAT_VECTOR")
    obj.meshfree.component = part
    show(obj, "vector")
    number = np.linalg.norm(vectors, axis=1) if axis is None else vectors[:, axis]
    add_values(obj, "number", number)
    found = attribute(obj, SLOPES[0])
    show(obj, "number")
    assert_allclose(found, attribute(obj, SLOPES[0]), atol=1e-4)
    assert np.abs(found).max() > 0.5


@pytest.mark.parametrize(
    "way", ["a label", "truth", "directions", "stepped map", "turned off", "dots"], ids=lambda way: way
)
def test_what_has_no_slope_stays_flat(obj, way):
    show(obj, "height")
    assert rise(obj) is not None
    values = np.arange(2000) % 5
    if way == "a label":
        add_values(obj, "lb_segment", values, "INT")
        show(obj, "lb_segment")
    elif way == "truth":
        obj.data.attributes.new("lb_boundary", "BOOLEAN", "POINT")
        show(obj, "lb_boundary")
    elif way == "directions":
        add_values(obj, "lb_normal", attribute(obj, "position"), "FLOAT_VECTOR")
        show(obj, "lb_normal")
    elif way == "stepped map":
        obj.meshfree.color_map = "CATEGORICAL"
    elif way == "turned off":
        obj.meshfree.smooth = False
    else:
        obj.meshfree.point_shape = "DOTS"
    assert rise(obj) is None
    assert slopes(obj) == ([SLOPES[0], SLOPES[2]] if way == "dots" else [])


def test_points_that_no_source_reaches_spoil_no_others(obj):
    height = attribute(obj, "position")[:, 2]
    add_values(obj, "lb_distance", np.where(height > 0.5, -1.0, height + 1.0))
    show(obj, "lb_distance")
    found = attribute(obj, SLOPES[0])
    assert not found[height > 0.5].any()
    steep = np.linalg.norm(found[height < 0.5], axis=1)
    assert np.abs(steep - np.sqrt(1.0 - height[height < 0.5] ** 2)).max() < 0.3


@pytest.mark.parametrize("kind", ["FLOAT", "FLOAT2", "FLOAT_VECTOR"])
def test_of_values_that_changed_since_no_slopes_are_drawn(obj, kind):
    places = attribute(obj, "position") + [0.1, 0.2, 0.3]
    width = {"FLOAT": 1, "FLOAT2": 2, "FLOAT_VECTOR": 3}[kind]
    obj.meshfree.component = "Y"
    add_values(obj, "values", places[:, :width], kind)
    show(obj, "values")
    assert rising(obj).mean() > 0.99
    changed = places[:, 0] > 0.0
    places[changed] *= 1.01
    add_values(obj, "values", places[:, :width], kind)
    obj.data.update()
    assert (rising(obj) == ~changed).mean() > 0.99
    show(obj, "values")
    assert rising(obj).mean() > 0.99


def test_slopes_follow_the_values_and_the_points(obj):
    show(obj, "height")
    before = attribute(obj, SLOPES[0])
    add_values(obj, "height", 2.0 * attribute(obj, "height"))
    show(obj, "height")
    assert_allclose(attribute(obj, SLOPES[0]), 2.0 * before, atol=1e-4)
    obj.data.attributes["position"].data.foreach_set("vector", 2.0 * attribute(obj, "position").reshape(-1))
    show(obj, "height")
    assert_allclose(attribute(obj, SLOPES[0]), before, atol=1e-3)


def test_settings_of_colors_compute_no_slopes_anew(core, obj, monkeypatch):
    show(obj, "height")
    monkeypatch.setattr(core.measure.Slopes, "of", None)
    obj.meshfree.reverse, obj.meshfree.iso_lines, obj.meshfree.shaded = True, 7, 1.0
    assert rise(obj) is not None


def test_slopes_are_no_results(obj, tmp_path):
    show(obj, "height")
    bpy.ops.meshfree.export_points(filepath=str(tmp_path / "points.csv"))
    header = (tmp_path / "points.csv").read_text().splitlines()[0]
    assert "height" in header
    assert "slope" not in header


def test_of_objects_that_share_a_mesh_each_shows_its_own(obj):
    other = bpy.data.objects.new("Other", obj.data)
    bpy.context.scene.collection.objects.link(other)
    add_values(obj, "double", 2.0 * attribute(obj, "height"))
    show(obj, "height")
    show(other, "height")
    assert rise(obj) is not None
    assert rise(other) is not None
    show(other, "double")
    assert rise(obj) is None  # flat, for the slopes are those of the other one
    assert rise(other) is not None
    show(obj, "height")
    assert rise(obj) is not None
    assert rise(other) is None


def test_they_stay_flat_while_handles_move_the_points_and_come_back(obj):
    show(obj, "height")
    add = obj.vertex_groups.new(name="Handle")
    add.add(np.flatnonzero(attribute(obj, "height") > 0.9).tolist(), 1.0, "REPLACE")
    obj.vertex_groups.new(name="Anchor").add(np.flatnonzero(attribute(obj, "height") < -0.9).tolist(), 1.0, "REPLACE")
    bpy.ops.meshfree.deform_bind()
    assert rise(obj) is None
    bpy.ops.meshfree.deform_unbind()
    show(obj, "height")
    assert rise(obj) is not None


def test_what_is_changed_in_edit_mode_is_smooth_again_after_it(obj):
    add_values(obj, "vector", attribute(obj, "position"), "FLOAT_VECTOR")
    obj.meshfree.component = "X"
    show(obj, "vector")
    bpy.ops.object.mode_set(mode="EDIT")
    obj.meshfree.reverse = True
    assert obj.meshfree.slopes_of.startswith("X vector ")
    obj.meshfree.component = "Y"
    assert obj.meshfree.slopes_of == ""
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    assert obj.meshfree.slopes_of.startswith("Y vector ")
    assert rise(obj) is not None


@pytest.mark.parametrize("count", [500, 4000])
def test_iso_lines_are_as_wide_as_the_object_asks_however_many_points_there_are(tmp_path, count):
    rng = np.random.default_rng(3)
    flat = np.column_stack([rng.uniform(-1.5, 1.5, (count, 2)), np.zeros(count)])
    obj = add_object(flat)
    bpy.ops.meshfree.show_surface()
    add_values(obj, "along", flat[:, 0])
    obj.meshfree.range_mode, obj.meshfree.range_low, obj.meshfree.range_high = "LOCKED", -1.0, 1.0
    obj.meshfree.iso_lines = 4
    show(obj, "along")
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.scene.collection.objects.link(camera)
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 0.2, (0.25, 0.1, 5.0)
    bpy.context.scene.camera = camera
    dark = rendered(tmp_path / "lines.png").reshape(64, 64, 3).max(axis=2) < 0.4
    assert dark.sum(axis=1) == pytest.approx(64 * 3.0 / 250.0 / 0.2, abs=2.0)


def test_the_share_of_light_is_a_setting(obj, tmp_path):
    show(obj, "height")
    obj.meshfree.color_map, obj.meshfree.shaded = "VIRIDIS", 0.0
    add_values(obj, "same", np.full(2000, 3.0))
    show(obj, "same")
    flat = rendered(tmp_path / "flat.png")
    assert flat.std(axis=0).max() < 0.02
    obj.meshfree.shaded = 1.0
    dark = rendered(tmp_path / "dark.png")
    assert dark.max() < 0.01  # there is no light
    obj.meshfree.shaded = 0.5
    formed = rendered(tmp_path / "formed.png")
    assert 0.5 * flat.max() < formed.max() <= flat.max() + 0.02
    assert formed.std(axis=0).max() > 0.08
    light = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    light.rotation_euler = (0.8, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(light)
    assert_allclose(rendered(tmp_path / "same.png"), formed, atol=0.02)  # whatever the lights
    obj.meshfree.shaded = 1.0
    lit = rendered(tmp_path / "lit.png")
    assert lit.std(axis=0).max() > 0.1


def test_the_light_beside_the_camera_comes_from_the_upper_left(tmp_path):
    obj = add_object(sphere_points(6000))
    add_values(obj, "same", np.full(6000, 3.0))
    bpy.ops.meshfree.show_surface()
    show(obj, "same")
    obj.rotation_euler = 0.3, 2.0, 1.0  # whichever way it is turned
    levels = []
    for obj.meshfree.shaded in (0.0, 0.5):
        rendered(tmp_path / "sphere.png")
        pixels = np.array(bpy.data.images.load(str(tmp_path / "sphere.png")).pixels).reshape(64, 64, 4)
        levels.append(
            np.where(pixels[:, :, 1] <= 0.04045, pixels[:, :, 1] / 12.92, ((pixels[:, :, 1] + 0.055) / 1.055) ** 2.4)
        )
        bpy.data.images.remove(bpy.data.images["sphere.png"])
    place = (np.arange(64) + 0.5) / 16.0 - 2.0
    x, y = np.meshgrid(place, place)
    inside = np.hypot(x, y) < 0.9
    toward = -0.36 * x + 0.36 * y + 0.86 * np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))
    expected = 0.08 + 0.92 * (0.5 + 0.5 * toward) ** 3
    assert_allclose(levels[1][inside] / levels[0][inside], expected[inside], atol=0.08)


def test_displays_of_an_earlier_version_become_smooth_and_keep_what_was_set(modifiers, obj):
    show(obj, "height")
    modifier = obj.modifiers["Mesh-Free Display"]
    group, later = modifier.node_group, ("Smooth", "Solid Colors")
    for item in [item for item in group.interface.items_tree if item.name in later]:
        group.interface.remove(item)
    group["meshfree_inputs"] = {name: key for name, key in group["meshfree_inputs"].items() if name not in later}
    modifiers.set_input(modifier, "Stroke Length", 2.5)
    assert rise(obj) is None
    show(obj, "height")
    assert modifier.node_group != group
    assert rise(obj) is not None
    assert modifiers.get_input(modifier, "Stroke Length") == 2.5
