"""Colors of results in viewports in Solid, which know no materials: what the display gives to the color attribute."""

import bpy
import numpy as np
import pytest

from tests.blender.clouds import CORNERS, add_object, attribute, sphere_points
from tests.blender.conftest import part

SOLID = ".lb_color"


def drawn(obj):
    """What viewports draw of an object."""
    return obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data


def colors_drawn(obj, name):
    """Colors of the corners that viewports draw, and their places."""
    mesh = drawn(obj)
    layer = mesh.color_attributes[name]
    colors, places = np.empty((len(layer.data), 4), np.float32), np.empty((len(mesh.vertices), 3), np.float32)
    layer.data.foreach_get("color", colors.reshape(-1))
    mesh.vertices.foreach_get("co", places.reshape(-1))
    return colors, places


@pytest.fixture
def shown():
    """A sphere whose height is on show, as discs."""
    points = sphere_points(1500)
    obj = add_object(points)
    bpy.ops.meshfree.show_surface()
    obj.data.attributes.new("height", "FLOAT", "POINT").data.foreach_set("value", points[:, 2].astype(np.float32))
    return obj


def show(obj, **settings):
    for name, value in {"range_mode": "LOCKED", "range_low": -1.0, "range_high": 1.0, **settings}.items():
        setattr(obj.meshfree, name, value)
    bpy.ops.meshfree.colormap(attribute="height")


def ramp(values, name="VIRIDIS"):
    colors = np.array(part("ui.colormaps").colors(name))
    place = np.clip(0.5 * values + 0.5, 0.0, 1.0) * (len(colors) - 1)
    return np.stack([np.interp(place, range(len(colors)), column) for column in colors.T], axis=1)


def test_discs_have_the_colors_of_the_map_all_over(shown):
    show(shown, color_map="VIRIDIS")
    colors, places = colors_drawn(shown, SOLID)
    assert drawn(shown).color_attributes.active_color_name == SOLID
    near = np.abs(places[:, 2]) < 0.9  # there the height is nearly linear
    off = np.abs(colors - ramp(places[:, 2]))[near]
    assert np.percentile(off, 99) < 0.06
    shown.meshfree.smooth = False
    flat = np.abs(colors_drawn(shown, SOLID)[0] - ramp(places[:, 2]))[near]
    assert np.percentile(flat, 99) > 2.0 * np.percentile(off, 99)


def test_colors_of_the_points_own_stay_and_come_back(shown):
    layer = shown.data.color_attributes.new("Photo", "BYTE_COLOR", "POINT")
    layer.data.foreach_set("color", np.tile([1.0, 0.0, 0.0, 1.0], 1500))
    shown.data.color_attributes.active_color_name = "Photo"
    show(shown, color_map="VIRIDIS", smooth=False)
    colors, _ = colors_drawn(shown, "Photo")
    wanted = ramp(attribute(shown, "height").astype(float))
    assert np.abs(colors.reshape(1500, -1, 4)[:, 0] - wanted).max() < 1e-5
    assert shown.data.color_attributes.active_color_name == "Photo"
    bpy.ops.meshfree.colormap(attribute="Photo")
    np.testing.assert_allclose(colors_drawn(shown, "Photo")[0], np.tile([1.0, 0.0, 0.0, 1.0], (len(colors), 1)))
    assert SOLID not in shown.data.attributes


def test_colors_that_change_in_edit_mode_are_there_after_it(shown):
    show(shown, color_map="VIRIDIS")
    bpy.ops.object.mode_set(mode="EDIT")
    shown.meshfree.color_map = "COOL_WARM"
    shown.meshfree.show_groups = True
    shown.meshfree.show_groups = False
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    colors, places = colors_drawn(shown, SOLID)
    off = np.abs(colors - ramp(places[:, 2], "COOL_WARM"))[np.abs(places[:, 2]) < 0.9]
    assert np.percentile(off, 99) < 0.06


@pytest.mark.parametrize("settings", [{"iso_lines": 5}, {"outside": "HIDE"}], ids=str)
def test_what_solid_cannot_show_is_left_to_materials(shown, settings):
    show(shown, **settings)
    assert not part("ui.display").is_in_solid(shown)


@pytest.mark.parametrize("editor", ["VIEW_3D", "PROPERTIES"])
def test_what_solid_cannot_show_is_seen_wherever_it_is_chosen(shown, editor):
    show(shown)
    window = bpy.context.window_manager.windows[0]
    areas = {area.type: area for area in window.screen.areas}
    shading = areas["VIEW_3D"].spaces.active.shading
    shading.type = "SOLID"
    with bpy.context.temp_override(window=window, area=areas[editor]):
        shown.meshfree.iso_lines = 5
    assert shading.type == "MATERIAL"
    assert SOLID not in shown.data.attributes


def test_labels_and_directions_have_colors_of_their_own(shown):
    labels = np.arange(1500, dtype=np.int32) % 8 - 1
    shown.data.attributes.new("label", "INT", "POINT").data.foreach_set("value", labels)
    bpy.ops.meshfree.colormap(attribute="label")
    found = attribute_colors(shown)
    assert len({tuple(color) for color in found.round(4).tolist()}) == 8
    vectors = shown.data.attributes.new("way", "FLOAT_VECTOR", "POINT")
    vectors.data.foreach_set("vector", sphere_points(1500).astype(np.float32).reshape(-1))
    bpy.ops.meshfree.colormap(attribute="way")
    np.testing.assert_allclose(attribute_colors(shown)[:, 0], (0.5 * sphere_points(1500)[:, 0] + 0.5) ** 2.2, atol=1e-4)


def attribute_colors(obj):
    colors = np.empty((1500, 4), np.float32)
    obj.data.attributes[SOLID].data.foreach_get("color", colors.reshape(-1))
    return colors


def test_solid_shades_a_disc_by_the_normal_of_its_point(shown):
    mesh = drawn(shown)
    normals = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("normal", normals.reshape(-1))
    discs = attribute(shown, "lb_disc")
    wanted = discs / np.linalg.norm(discs, axis=1, keepdims=True)
    np.testing.assert_allclose(normals.reshape(1500, -1, 3), np.repeat(wanted[:, None], CORNERS, axis=1), atol=2e-3)
