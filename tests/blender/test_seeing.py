"""Settings of the display that answer at once, what is drawn over the view, and selecting by what is seen."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.blender.clouds import add_object, attribute, everything, sphere_points
from tests.blender.conftest import part
from tests.blender.test_display import bounds, dark_share

DISPLAY_SETTINGS = {
    "color_map": "MAGMA",
    "reverse": True,
    "range_mode": "DATA",
    "coverage": 80.0,
    "range_low": 3.0,
    "range_high": 4.0,
    "outside": "GRAY",
    "iso_lines": 7,
    "component": "Z",
    "point_size": 1.5,
    "legend": False,
    "histogram": True,
    "plot_eigenvalues": True,
    "compare_weyl": False,
}


@pytest.fixture
def obj():
    obj = add_object(sphere_points() * (1.0, 1.3, 1.7))
    bpy.ops.meshfree.analyze(modes=4)
    return obj


def add_values(obj, name, values, kind="FLOAT"):
    layer = obj.data.attributes.new(name, kind, "POINT")
    layer.data.foreach_set("value", np.asarray(values, {"FLOAT": np.float32, "INT": np.int32}[kind]))


def ramp(display, obj):
    return [tuple(element.color) for element in display.color_node(obj).color_ramp.elements]


@pytest.mark.parametrize("name", ["VIRIDIS", "MAGMA", "COOL_WARM", "CYCLIC"])
def test_maps_by_name_change_the_colors_at_once(colormaps, display, obj, name):
    bpy.ops.meshfree.colormap(attribute="lb_area")
    for reverse in (False, True):
        obj.meshfree.color_map, obj.meshfree.reverse = name, reverse
        assert np.allclose(ramp(display, obj), colormaps.colors(name, reverse), atol=1e-6)
        places = [element.position for element in display.color_node(obj).color_ramp.elements]
        assert np.allclose(places, np.linspace(0.0, 1.0, len(places)))


def test_changes_are_edits_of_values_and_compute_nothing(display, obj, monkeypatch):
    monkeypatch.setattr(part("operators.running.cache"), "build", None)
    monkeypatch.setattr(part("core").LaplaceBeltrami, "eigenpairs", None)
    material = display.find_material(obj)
    before = {node.name: node.as_pointer() for node in material.node_tree.nodes}
    for name, value in DISPLAY_SETTINGS.items():
        setattr(obj.meshfree, name, value)
    assert display.find_material(obj) == material
    assert {node.name: node.as_pointer() for node in material.node_tree.nodes} == before


def test_settings_before_there_is_a_display_only_wait_for_it(display):
    obj = add_object(sphere_points())
    blocks = len(bpy.data.materials), len(bpy.data.node_groups), len(obj.modifiers)
    for name, value in DISPLAY_SETTINGS.items():
        setattr(obj.meshfree, name, value)
    assert (len(bpy.data.materials), len(bpy.data.node_groups), len(obj.modifiers)) == blocks
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.colormap(attribute="lb_area")
    assert bounds(display, obj) == pytest.approx((attribute(obj, "lb_area").min(), attribute(obj, "lb_area").max()))
    for empty in (bpy.data.objects.new("Empty", None), bpy.data.objects.new("Light", bpy.data.lights.new("L", "SUN"))):
        for name, value in DISPLAY_SETTINGS.items():
            setattr(empty.meshfree, name, value)


def test_settings_survive_an_attribute_that_is_gone(display, obj):
    obj.data.attributes.remove(obj.data.attributes["lb_mean_curvature"])
    before = bounds(display, obj)
    obj.meshfree.color_map = "MAGMA"
    obj.meshfree.coverage = 60.0
    assert bounds(display, obj) == before


def test_ranges_of_an_object(display, obj):
    values = attribute(obj, "lb_eigenvector_002").astype(float)
    bpy.ops.meshfree.colormap(attribute="lb_eigenvector_002")
    kept = obj.meshfree
    kept.color_map, kept.coverage = "VIRIDIS", 80.0
    for mode, expected in (
        ("AUTO", np.percentile(values, (10.0, 90.0))),
        ("DATA", (values.min(), values.max())),
        ("PERCENTILE", np.percentile(values, (10.0, 90.0))),
        ("SYMMETRIC", np.abs(np.percentile(values, (10.0, 90.0))).max() * np.array([-1.0, 1.0])),
    ):
        kept.range_mode = mode
        assert bounds(display, obj) == pytest.approx(tuple(expected), rel=1e-5)
        assert (kept.range_low, kept.range_high) == pytest.approx(tuple(expected), rel=1e-5)


def test_locked_range_stays_for_other_attributes_and_can_be_edited(display, obj):
    bpy.ops.meshfree.colormap(attribute="lb_eigenvector_002")
    before = bounds(display, obj)
    obj.meshfree.range_mode = "LOCKED"
    for name in ("lb_eigenvector_003", "lb_area", "lb_eigenvector_004"):
        bpy.ops.meshfree.colormap(attribute=name)
        assert bounds(display, obj) == before
    obj.meshfree.range_low, obj.meshfree.range_high = -0.25, 2.5
    assert bounds(display, obj) == (-0.25, 2.5)
    obj.data.vertices[0].co *= 1.01
    bpy.ops.meshfree.analyze()
    assert bounds(display, obj) == (-0.25, 2.5)
    obj.meshfree.range_mode = "DATA"
    assert bounds(display, obj) != (-0.25, 2.5)


def test_settings_answer_in_edit_mode(display, modifiers, obj):
    bpy.ops.meshfree.colormap(attribute="lb_area")
    obj.meshfree.range_mode = "DATA"
    before, radius = bounds(display, obj), modifiers.get_input(display.find_display(obj), "Radius")
    bpy.ops.object.mode_set(mode="EDIT")
    obj.meshfree.range_mode = "PERCENTILE"
    low, high = bounds(display, obj)
    assert before[0] < low < high < before[1]
    for name in ("lb_boundary", "lb_component", "lb_normal"):  # of other types
        values = part("operators.objects.attributes").read_attribute(obj.data, name)
        bpy.ops.object.mode_set(mode="OBJECT")
        assert (values == attribute(obj, name)).all()
        assert values.dtype == attribute(obj, name).dtype
        bpy.ops.object.mode_set(mode="EDIT")
    obj.meshfree.point_size = 2.0 * obj.meshfree.point_size
    assert modifiers.get_input(display.find_display(obj), "Radius") == pytest.approx(2.0 * radius)
    bpy.ops.object.mode_set(mode="OBJECT")


def test_categories_repeat(display, obj):
    colors = part("ui.colormaps").colors("CATEGORICAL")
    numbers = np.arange(1000) % 20 - 1
    add_values(obj, "part", numbers, "INT")
    bpy.ops.meshfree.colormap(attribute="part", color_map="CATEGORICAL")
    found = display.step_colors(obj)
    assert list(found) == [str(number) for number in range(-1, 19)]
    assert np.allclose(found["-1"], colors[0], atol=1e-6)
    for number in range(19):
        assert np.allclose(found[str(number)], colors[1 + number % 7], atol=1e-6)


@pytest.mark.parametrize("number", [-1, 0, 6, 7, 18])
def test_categories_are_rendered_in_their_colors(display, number, tmp_path):
    obj = add_object(sphere_points())
    add_values(obj, "part", np.where(np.arange(1000) > 0, number, 18), "INT")
    bpy.ops.meshfree.colormap(attribute="part", color_map="CATEGORICAL", radius=0.1)
    seen = median_color(tmp_path / "part.png")
    expected = np.array(display.step_colors(obj)[str(number)][:3])
    others = [np.array(color[:3]) for color in part("ui.colormaps").colors("CATEGORICAL")]
    distances = [np.linalg.norm(direction(seen) - direction(color)) for color in others]
    assert np.allclose(others[int(np.argmin(distances))], expected, atol=1e-6)


def direction(color):
    """Hue and saturation of a colour, free of its brightness."""
    return color / np.linalg.norm(color)


def median_color(path):
    """Render what there is, seen from above, and return its median colour, linear."""
    dark_share(path)
    image = bpy.data.images.load(str(path))
    pixels = np.array(image.pixels).reshape(-1, 4)
    values = np.median(pixels[pixels[:, 3] == 1.0][:, :3], axis=0)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def covered_share(path):
    dark_share(path)
    return np.mean(np.array(bpy.data.images.load(str(path)).pixels).reshape(-1, 4)[:, 3] > 0.5)


def test_points_out_of_range_are_gray_or_hidden(display, obj, tmp_path):
    add_values(obj, "height", attribute(obj, "position")[:, 1])
    bpy.ops.meshfree.colormap(attribute="height", radius=0.1, color_map="VIRIDIS")
    obj.meshfree.range_low, obj.meshfree.range_high = 0.0, 5.0
    obj.meshfree.range_mode = "LOCKED"
    whole = covered_share(tmp_path / "clamp.png")
    blue = median_color(tmp_path / "blue.png")  # half of it has the color of the lower end, the rest is near it
    assert blue[2] > 2.0 * blue[1]
    obj.meshfree.outside = "GRAY"
    assert covered_share(tmp_path / "gray.png") == whole
    pixels = np.array(bpy.data.images.load(str(tmp_path / "gray.png")).pixels).reshape(64, 64, 4)
    below = pixels[:30][pixels[:30, :, 3] == 1.0][:, :3]
    assert np.median(np.ptp(below, axis=1)) < 0.02
    above = pixels[40:][pixels[40:, :, 3] == 1.0][:, :3]
    assert np.median(np.ptp(above, axis=1)) > 0.1
    obj.meshfree.outside = "HIDE"
    bpy.context.scene.cycles.transparent_max_bounces = 64  # Cycles paints what lies behind more hidden points black
    assert 0.35 * whole < covered_share(tmp_path / "hidden.png") < 0.65 * whole


def test_colormap_takes_settings_and_keeps_them(display, obj):
    bpy.ops.meshfree.colormap(attribute="lb_area", color_map="MAGMA", reverse=True, range_mode="DATA")
    kept = obj.meshfree
    assert (kept.color_map, kept.reverse, kept.range_mode) == ("MAGMA", True, "DATA")
    assert bounds(display, obj) == pytest.approx((attribute(obj, "lb_area").min(), attribute(obj, "lb_area").max()))
    bpy.ops.meshfree.colormap(attribute="lb_eigenvector_002")
    assert (kept.color_map, kept.reverse, kept.range_mode) == ("MAGMA", True, "DATA")


@pytest.mark.parametrize(("part", "index"), [("X", 0), ("Y", 1), ("Z", 2), ("LENGTH", None)])
def test_numbers_of_vectors(display, obj, tmp_path, part, index):
    vectors = np.tile(np.float32([3.0, 0.0, -4.0]), (1000, 1))
    obj.data.attributes.new("way", "FLOAT_VECTOR", "POINT").data.foreach_set("vector", vectors.reshape(-1))
    bpy.ops.meshfree.colormap(attribute="way", color_map="COOL_WARM", radius=0.1)
    assert display.range_node(obj) is None  # directions
    assert display.shown_values(obj) is None
    obj.meshfree.range_low, obj.meshfree.range_high = -5.0, 5.0
    obj.meshfree.range_mode = "LOCKED"
    obj.meshfree.component = part
    number = 5.0 if index is None else vectors[0, index]
    assert (display.shown_values(obj) == number).all()
    (red, _, blue) = median_color(tmp_path / "way.png")
    assert np.sign(red - blue) == np.sign(number) or (number == 0.0 and abs(red - blue) < 0.1)


def test_displacements_are_shown_by_their_length(display, obj):
    obj.data.attributes.new("lb_displacement", "FLOAT_VECTOR", "POINT")
    bpy.ops.meshfree.colormap(attribute="lb_displacement")
    assert display.range_node(obj) is not None
    obj.meshfree.component = "DIRECTION"
    assert display.range_node(obj) is None


def test_setting_of_a_duplicate_changes_only_its_own_colors(display, obj):
    other = obj.copy()
    other.data = obj.data.copy()
    bpy.context.scene.collection.objects.link(other)
    before = ramp(display, obj)
    other.meshfree.color_map = "MAGMA"
    assert ramp(display, obj) == before
    assert ramp(display, other) != before


def radius(display, modifiers, obj):
    return modifiers.get_input(display.find_display(obj), "Radius")


def test_point_size_follows_the_spacing_unless_set_by_hand(display, modifiers, obj):
    first = radius(display, modifiers, obj)
    assert first == pytest.approx(1.1 * obj.meshfree.spacing)
    obj.data.vertices.foreach_set("co", 3.0 * attribute(obj, "position").reshape(-1))
    bpy.ops.meshfree.analyze()
    assert radius(display, modifiers, obj) == pytest.approx(3.0 * first, rel=1e-3)
    obj.meshfree.point_size = 2.2
    assert radius(display, modifiers, obj) == pytest.approx(6.0 * first, rel=1e-3)
    modifiers.set_input(display.find_display(obj), "Radius", 0.321)
    obj.data.vertices.foreach_set("co", 2.0 * attribute(obj, "position").reshape(-1))
    bpy.ops.meshfree.analyze()
    assert radius(display, modifiers, obj) == pytest.approx(0.321)
    obj.meshfree.point_size = 1.1
    assert radius(display, modifiers, obj) == pytest.approx(6.0 * first, rel=1e-3)


def texts(picture):
    return [text.text for text in picture.texts]


@pytest.mark.parametrize(
    ("name", "title"),
    [("lb_area", "Area"), ("lb_normal", "Normal"), ("lb_boundary", "Boundary"), ("lb_component", "Component")],
)
def test_pictures_stay_on_their_plates(overlay, obj, name, title):
    obj.meshfree.histogram = obj.meshfree.plot_eigenvalues = True
    bpy.ops.meshfree.colormap(attribute=name)
    found = overlay.pictures(obj, bpy.context.scene)
    assert len(found) == (2 if name == "lb_normal" else 3)
    assert texts(found[0])[0] == title
    for picture in found:
        places = np.array(picture.places)
        assert len(places) == len(picture.colors) > 6
        assert (places >= 0.0).all()
        assert (places <= (picture.width, picture.height)).all()
        for text in picture.texts:
            assert 0.0 <= text.x <= picture.width
            assert 5.0 <= text.y <= picture.height - 5.0


def test_legend_says_name_unit_and_round_numbers_inside_the_range(display, obj):
    scale = part("ui.scale")
    bpy.ops.meshfree.colormap(attribute="lb_mean_curvature")
    found = scale.shown_scale(obj, bpy.context.scene)
    assert (found.title, found.unit) == ("Mean Curvature", "1/m")
    low, high = bounds(display, obj)
    for share, text in found.ticks:
        assert 0.0 <= share <= 1.0
        assert float(text) == pytest.approx(low + share * (high - low), abs=1e-6)
    assert len(found.ticks) >= 3
    bpy.context.scene.unit_settings.system = "NONE"
    assert scale.shown_scale(obj, bpy.context.scene).unit == ""
    assert scale.shown_scale(add_object(sphere_points()), bpy.context.scene) is None


def test_pictures_are_drawn_by_choice(overlay, obj):
    scene, kept = bpy.context.scene, obj.meshfree
    assert len(overlay.pictures(obj, scene)) == 1
    kept.legend = False
    assert overlay.pictures(obj, scene) == []
    kept.plot_eigenvalues = True
    (plot,) = overlay.pictures(obj, scene)
    assert {"Eigenvalues", "1/m²", "Mode k", "4 π k / Area"} <= set(texts(plot))
    kept.compare_weyl = False
    (plain,) = overlay.pictures(obj, scene)
    assert "4 π k / Area" not in texts(plain)
    kept.histogram = True
    obj.data.attributes.remove(obj.data.attributes["lb_mean_curvature"])
    assert len(overlay.pictures(obj, scene)) == 1
    assert overlay.pictures(add_object(sphere_points()), scene) == []


def test_histogram_is_counted_again_when_values_or_range_change(overlay, obj):
    obj.meshfree.legend, obj.meshfree.histogram = False, True
    bpy.ops.meshfree.colormap(attribute="lb_area")

    def drawn():
        (picture,) = overlay.pictures(obj, bpy.context.scene)
        return picture.places

    first = drawn()
    assert drawn() == first
    obj.meshfree.coverage = 60.0
    second = drawn()
    assert second != first
    for index in range(100):
        obj.data.attributes["lb_area"].data[index].value = obj.meshfree.range_low
    assert drawn() != second


def test_pictures_of_many_parts_name_the_first_ones(overlay, obj):
    add_values(obj, "part", np.arange(1000) % 40, "INT")
    obj.meshfree.histogram = True
    bpy.ops.meshfree.colormap(attribute="part", color_map="CATEGORICAL")
    legend, histogram = overlay.pictures(obj, bpy.context.scene)
    assert texts(legend)[1:] == [*map(str, range(11)), "29 more"]
    assert len(legend.places) == 6 * (1 + 11)  # the plate, and a box for each that is named
    assert {"0", "39"} <= set(texts(histogram))


def test_pictures_are_arranged_from_the_right_without_overlap(overlay):
    sizes = [(100, 50), (200, 60), (300, 50)]
    assert overlay.arrange(sizes, 0, 0, 1000, 500) == [(900, 0), (700, 0), (400, 0)]
    assert overlay.arrange(sizes, 0, 10, 550, 500) == [(450, 10), (250, 10), (250, 70)]
    assert overlay.arrange(sizes, 0, 10, 550, 500, indent=30) == [(450, 10), (250, 10), (220, 70)]
    assert overlay.arrange(sizes, 0, 0, 250, 500) == [(150, 0), (50, 50), None]
    assert overlay.arrange(sizes, 0, 0, 80, 500) == [None, None, None]


def test_a_legend_goes_where_it_covers_nothing_and_stays_there(overlay):
    corners, size = [(900, 0), (0, 0), (0, 400)], (100, 100)
    right, both = np.array([[950.0, 50.0], [500.0, 300.0], [np.nan, np.nan]]), np.array([[950.0, 50.0], [50.0, 50.0]])
    assert overlay.least_covering(corners, size, right[1:], 0) == 0
    assert overlay.least_covering(corners, size, right, 0) == 1
    assert overlay.least_covering(corners, size, right[1:], 1) == 1
    assert overlay.least_covering(corners, size, both, 0) == overlay.least_covering(corners, size, both, 1) == 2
    assert overlay.least_covering(corners[:2], size, both, 0) == 0
    assert overlay.least_covering(corners[:2], size, both, 2) == 1


def test_a_legend_is_as_wide_as_its_texts(overlay, obj):
    """They end a little before the edge of its plate, whatever is shown."""
    for name in ("lb_mean_curvature", "lb_area", "lb_boundary"):
        bpy.ops.meshfree.colormap(attribute=name)
        picture = overlay.pictures(obj, bpy.context.scene)[0]
        width = part("ui.canvas").text_width
        ends = [text.x + width(text.text) for text in picture.texts]
        assert picture.width - 24.0 < max(ends) <= picture.width - 5.0
        lines = sorted(text.y for text in picture.texts if "tick" in text.part)
        assert not lines or np.diff(lines).min() > 11.0


def region(kind, alignment, x, y, width, height):
    return SimpleNamespace(type=kind, alignment=alignment, x=x, y=y, width=width, height=height)


def test_regions_over_the_view_are_left_free(overlay):
    window = region("WINDOW", "NONE", 10, 20, 800, 600)
    area = SimpleNamespace(
        regions=[
            window,
            region("UI", "RIGHT", 560, 20, 250, 600),
            region("TOOLS", "LEFT", 10, 20, 60, 600),
            region("HEADER", "TOP", 10, 594, 800, 26),
            region("HUD", "FLOAT", 20, 30, 200, 100),
            region("ASSET_SHELF", "BOTTOM", 10, 20, 800, 1),
            region("UI", "RIGHT", 2000, 20, 250, 600),
        ]
    )
    assert overlay._free_room(area, window) == (210, 0, 550, 574)


def test_nothing_is_drawn_in_background_mode(overlay):
    assert bpy.app.background
    assert overlay._handlers == []
    overlay.attach()
    assert overlay._handlers == []


def add_camera():
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.location.z = 5.0
    return camera


def legend_texts():
    parts = [item for item in bpy.data.objects if item.type == "FONT"]
    return [part.data.body for part in sorted(parts, key=lambda part: -part.location.y)]


def test_legend_in_renders_follows_the_colors(obj):
    camera = add_camera()
    bpy.ops.meshfree.legend()
    assert legend_texts()[:2] == ["Mean Curvature", "1/m"]
    before = legend_texts()
    obj.meshfree.coverage = 50.0
    assert legend_texts() != before
    bpy.ops.meshfree.colormap(attribute="lb_eigenvector_002")
    assert legend_texts()[0] == "Mode 2"
    assert all(item.parent == camera for item in bpy.data.objects if item.type == "FONT")
    count = len(bpy.data.objects)
    obj.meshfree.reverse = True
    assert len(bpy.data.objects) == count
    bpy.ops.meshfree.legend(show=False)
    assert legend_texts() == []
    assert "Mesh-Free Legend" not in bpy.data.collections
    obj.meshfree.reverse = False
    assert legend_texts() == []


def test_legend_of_another_object_stays(obj):
    add_camera()
    bpy.ops.meshfree.legend()
    before = legend_texts()
    other = add_object(sphere_points(seed=1), "Other")
    bpy.ops.meshfree.analyze()
    other.meshfree.coverage = 50.0
    assert legend_texts() == before


def test_legend_says_what_is_missing(obj):
    before = everything(obj)
    with pytest.raises(RuntimeError, match="no camera"):
        bpy.ops.meshfree.legend()
    add_camera()
    with pytest.raises(RuntimeError, match="no legend"):
        bpy.ops.meshfree.legend(show=False)
    bpy.data.cameras.remove(bpy.context.scene.camera.data)  # with the object
    assert everything(obj) == before
    add_camera()
    add_object(sphere_points(), "Plain")
    with pytest.raises(RuntimeError, match="shows no colors yet"):
        bpy.ops.meshfree.legend()


def test_legend_outlives_its_camera(obj):
    camera = add_camera()
    bpy.ops.meshfree.legend()
    bpy.data.objects.remove(camera)
    obj.meshfree.coverage = 60.0  # nothing to put the legend in front of


def title_of(legend):
    return next(part for part in legend.objects if part.type == "FONT" and part["meshfree_legend_part"] == "title")


def test_legend_is_written_anew_on_the_same_objects(legends, obj):
    add_camera()
    bpy.ops.meshfree.legend()
    legend = legends.find_legend(bpy.context.scene, obj)
    before = {part: part.data for part in legend.objects}
    texts = legend_texts()
    obj.meshfree.range_mode = "LOCKED"
    obj.meshfree.range_low, obj.meshfree.range_high = 3.0 * obj.meshfree.range_low, 3.0 * obj.meshfree.range_high
    assert legend_texts() != texts
    after = {part: part.data for part in legend.objects}
    assert sum(before.get(part) == data for part, data in after.items()) == min(len(before), len(after))
    bpy.ops.meshfree.colormap(attribute="lb_boundary")
    assert legend_texts() == ["Boundary", "No", "Yes"] or legend_texts() == ["Boundary", "Yes", "No"]
    assert len(bpy.data.curves) == 3


def test_legend_is_found_by_its_mark(legends, obj):
    add_camera()
    scene = bpy.context.scene
    foreign = bpy.data.collections.new("Mesh-Free Legend")  # somebody's own
    scene.collection.children.link(foreign)
    bpy.ops.meshfree.legend()
    legend = legends.find_legend(scene, obj)
    assert legend != foreign
    legend.name = "My Colors"
    foreign.children.link(legend)  # below another one
    scene.collection.children.unlink(legend)
    before = legend_texts()
    obj.meshfree.coverage = 50.0
    assert legend_texts() != before
    bpy.ops.meshfree.legend(show=False)
    assert bpy.data.collections.keys() == ["Mesh-Free Legend"]
    assert legend_texts() == []


@pytest.mark.parametrize("typed", [False, True])
def test_legend_keeps_the_title_that_somebody_wrote(legends, obj, typed):
    add_camera()
    bpy.ops.meshfree.legend(title="" if typed else "Bend of the Hull")
    legend = legends.find_legend(bpy.context.scene, obj)
    if typed:
        title_of(legend).data.body = "Bend of the Hull"
    obj.meshfree.reverse = True
    bpy.ops.meshfree.colormap(attribute="lb_area")
    assert legend_texts()[:2] == ["Bend of the Hull", "cm²"]
    bpy.ops.meshfree.legend()
    assert legend_texts()[0] == "Area"
    bpy.ops.meshfree.colormap(attribute="lb_eigenvector_002")
    assert legend_texts()[0] == "Mode 2"


def test_two_scenes_have_a_legend_each(legends, obj):
    first, camera = bpy.context.scene, add_camera()
    bpy.ops.meshfree.legend(title="First")
    second = bpy.data.scenes.new("Second")
    other = bpy.data.objects.new("Camera", camera.data)
    for item in (obj, other):
        second.collection.objects.link(item)
    assert legends.find_legend(second, obj) is None
    legends.make_legend(second, obj, other)
    legend, its = (legends.find_legend(scene, obj) for scene in (first, second))
    assert legend != its
    bpy.ops.meshfree.colormap(attribute="lb_area")
    assert [title_of(item).data.body for item in (legend, its)] == ["First", "Area"]
    assert [{part.parent for part in item.objects} for item in (legend, its)] == [{camera}, {other}]
    bpy.ops.meshfree.legend(show=False)
    assert legends.find_legend(first, obj) is None
    assert legends.find_legend(second, obj) == its
    bpy.data.scenes.remove(second)


@pytest.mark.parametrize("kind", ["LINK_COPY", "FULL_COPY"])
def test_legend_in_a_copy_of_the_scene(legends, obj, kind):
    first, camera = bpy.context.scene, add_camera()
    bpy.ops.meshfree.legend()
    legend = legends.find_legend(first, obj)
    bpy.ops.scene.new(type=kind)
    second = bpy.context.scene
    assert second != first
    copy = obj if kind == "LINK_COPY" else bpy.context.object
    its = legends.find_legend(second, copy)
    assert (copy == obj, its == legend) == ((True, True) if kind == "LINK_COPY" else (False, False))
    legends.make_legend(second, copy, second.camera, "Second")
    its = legends.find_legend(second, copy)
    assert its != legend
    assert [title_of(item).data.body for item in (legend, its)] == ["Mean Curvature", "Second"]
    assert legends.find_legend(first, obj) == legend
    assert {part.parent for part in legend.objects} == {camera}
    legends.remove_legend(second, its)
    assert legends.find_legend(second, copy) is None
    assert len(legend.objects) > 4
    assert title_of(legend).data.body == "Mean Curvature"
    bpy.data.scenes.remove(second)


def test_taking_a_legend_away_from_a_linked_copy_leaves_the_other(legends, obj):
    first = bpy.context.scene
    add_camera()
    bpy.ops.meshfree.legend()
    bpy.ops.scene.new(type="LINK_COPY")
    bpy.ops.meshfree.legend(show=False)
    assert legends.find_legend(bpy.context.scene, obj) is None
    assert legends.find_legend(first, obj) is not None
    bpy.data.scenes.remove(bpy.context.scene)


def test_legend_whose_objects_are_deleted(legends, obj):
    add_camera()
    scene = bpy.context.scene
    bpy.ops.meshfree.legend()
    legend = legends.find_legend(scene, obj)
    count = len(legend.objects)
    bpy.data.objects.remove(title_of(legend))
    obj.meshfree.coverage = 97.0
    assert title_of(legend).data.body == "Mean Curvature"
    assert len(legend.objects) >= count - 2
    bpy.data.batch_remove(list(legend.objects))
    assert legends.find_legend(scene, obj) is None
    obj.meshfree.coverage = 98.0  # it does not come back by itself
    assert list(legend.objects) == []
    bpy.ops.meshfree.legend()
    assert legends.find_legend(scene, obj) == legend
    assert len(legend.objects) == count
    bpy.data.collections.remove(legend)
    obj.meshfree.coverage = 97.0
    assert legends.find_legend(scene, obj) is None


def test_legend_of_a_deleted_object(legends, obj):
    add_camera()
    bpy.ops.meshfree.legend()
    bpy.data.objects.remove(obj)
    other = add_object(sphere_points(seed=1), "Other")
    bpy.ops.meshfree.analyze()
    assert legends.find_legend(bpy.context.scene, other) is None
    bpy.ops.meshfree.colormap(attribute="lb_area")
    bpy.ops.meshfree.legend()
    assert len(bpy.data.collections) == 1
    assert legend_texts()[0] == "Area"


def test_copies_of_legend_objects_stay_as_they_are(legends, obj):
    add_camera()
    bpy.ops.meshfree.legend()
    title = title_of(legends.find_legend(bpy.context.scene, obj))
    copy = title.copy()
    bpy.context.scene.collection.objects.link(copy)
    bpy.ops.meshfree.colormap(attribute="lb_area")
    assert (title.data.body, copy.data.body) == ("Area", "Mean Curvature")


def selection(obj):
    chosen = np.empty(len(obj.data.vertices), bool)
    obj.data.vertices.foreach_get("select", chosen)
    return chosen


def set_selection(obj, chosen):
    obj.data.vertices.foreach_set("select", np.ascontiguousarray(chosen, bool))


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_select_by_range(obj, mode):
    bpy.ops.meshfree.colormap(attribute="lb_area")
    values = attribute(obj, "lb_area")
    low, high = (float(value) for value in np.percentile(values, (20.0, 50.0)).astype(np.float32))
    inside = (values >= np.float32(low)) & (values <= np.float32(high))
    set_selection(obj, np.arange(1000) < 10)

    def select(**options):
        bpy.ops.object.mode_set(mode=mode)
        bpy.ops.meshfree.select_by_range(**options)
        assert obj.mode == mode
        bpy.ops.object.mode_set(mode="OBJECT")
        return selection(obj)

    assert (select(low=low, high=high) == inside).all()
    assert (select(low=low, high=high, invert=True) == ~inside).all()
    set_selection(obj, np.arange(1000) < 10)
    assert (select(low=low, high=high, extend=True) == (inside | (np.arange(1000) < 10))).all()


def test_select_by_range_takes_that_of_the_colors(display, obj):
    bpy.ops.meshfree.colormap(attribute="lb_area", coverage=60.0)
    bpy.ops.meshfree.select_by_range()
    low, high = bounds(display, obj)
    values = attribute(obj, "lb_area")
    assert (selection(obj) == ((values >= np.float32(low)) & (values <= np.float32(high)))).all()
    assert np.mean(selection(obj)) == pytest.approx(0.6, abs=0.01)
    obj.meshfree.component = "X"
    bpy.ops.meshfree.colormap(attribute="lb_normal")
    bpy.ops.meshfree.select_by_range(low=0.0, high=1.0)
    assert (selection(obj) == (attribute(obj, "lb_normal")[:, 0] >= 0.0)).all()


def test_select_by_range_says_what_is_wrong(obj):
    set_selection(obj, np.arange(1000) < 10)
    bpy.ops.meshfree.colormap(attribute="lb_normal")
    before = everything(obj), selection(obj).tolist()
    with pytest.raises(RuntimeError, match="shows no numbers as colors"):
        bpy.ops.meshfree.select_by_range()
    assert (everything(obj), selection(obj).tolist()) == before
    bpy.ops.meshfree.colormap(attribute="lb_area")
    before = everything(obj), selection(obj).tolist()
    with pytest.raises(RuntimeError, match="No value of Area lies from 5 to 6"):
        bpy.ops.meshfree.select_by_range(low=5.0, high=6.0)
    assert (everything(obj), selection(obj).tolist()) == before
    add_object(sphere_points(), "Plain")
    with pytest.raises(RuntimeError, match="shows no numbers as colors"):
        bpy.ops.meshfree.select_by_range()


@pytest.mark.parametrize("preset", ["DEFAULT", "PAPER", "CLEAN", "NOISY"])
def test_presets_are_options_of_core(options, core, preset):
    obj = add_object(sphere_points())
    obj.meshfree.neighbors, obj.meshfree.regularization = 33, 0.5
    bpy.ops.meshfree.apply_preset(preset=preset)
    assert options.laplacian_options(obj.meshfree) == options.PRESETS[preset]
    assert obj.meshfree.regularization == pytest.approx(core.PaperOptions().regularization)


def test_own_presets_are_files_in_the_users_folder(extension, installed, capfd):
    obj = add_object(sphere_points())
    obj.meshfree.neighbors, obj.meshfree.projection, obj.meshfree.sheets = 44, "OFF", False
    bpy.ops.meshfree.add_preset(name="My Scanner")
    path = installed / "scripts" / "presets" / "meshfree_laplacian" / "My_Scanner.py"
    assert path.exists()
    bpy.ops.meshfree.apply_preset(preset="DEFAULT")
    assert obj.meshfree.neighbors == 100
    older = "bpy.context.object.meshfree.curvature_correction = True\nbpy.context.object.meshfree.normals = 'QUADRIC'\n"
    path.write_text(path.read_text() + older)
    bpy.ops.meshfree.apply_preset(filepath=str(path))
    assert (obj.meshfree.neighbors, obj.meshfree.projection, obj.meshfree.sheets) == (44, "OFF", False)
    assert "settings or values that no longer exist: normals, curvature_correction" in capfd.readouterr().out
    assert bpy.types.MESHFREE_MT_presets.bl_label == "My Scanner"
    bpy.ops.meshfree.add_preset(remove_active=True)
    assert not path.exists()


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="objects become point clouds from Blender 4.5 on")
def test_point_clouds_are_seen_as_meshes_are(display, modifiers, overlay):
    obj = add_object(sphere_points())
    obj.select_set(True)
    bpy.ops.object.convert(target="POINTCLOUD")
    obj = bpy.context.object
    assert obj.type == "POINTCLOUD"
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.colormap(attribute="lb_area", color_map="MAGMA", range_mode="DATA")
    values = attribute(obj, "lb_area")
    assert bounds(display, obj) == pytest.approx((values.min(), values.max()))
    before = radius(display, modifiers, obj)
    obj.meshfree.point_size *= 2.0
    assert radius(display, modifiers, obj) == pytest.approx(2.0 * before)
    obj.meshfree.histogram = True
    assert len(overlay.pictures(obj, bpy.context.scene)) == 2
    middle = float(np.median(values))
    bpy.ops.meshfree.select_by_range(low=middle, high=1.0)
    assert (attribute(obj, ".selection") == (values >= np.float32(middle))).all()


@pytest.mark.parametrize("name", ["Attribute", "Range", "Colors"])
def test_nodes_that_somebody_deletes(display, overlay, obj, name):
    nodes = display.find_material(obj).node_tree.nodes
    nodes.remove(nodes[name])
    obj.meshfree.histogram = True
    overlay.pictures(obj, bpy.context.scene)
    obj.meshfree.reverse = True
    bpy.ops.meshfree.colormap(attribute="lb_area")
    assert display.shown_attribute(obj) == "lb_area"
    assert len(overlay.pictures(obj, bpy.context.scene)) == 2


def test_an_attribute_of_classes_takes_them(extension):
    obj = add_object(sphere_points(50))
    classes = np.resize([1, 2, 6, 9, 26], 50)
    obj.data.attributes.new("classification", "INT", "POINT").data.foreach_set("value", classes.astype(np.int32))
    bpy.ops.meshfree.colormap(attribute="classification")
    steps = extension.ui.display.step_colors(obj)
    shown = [steps[str(number)][:3] for number in (1, 2, 6, 9, 26)]
    brown, blue = shown[1], shown[3]
    assert brown[0] > brown[1] > brown[2]
    assert blue[2] > max(blue[:2])
    assert len(set(shown)) == 5
    assert_allclose(shown, np.array(part("ui.colormaps").colors("LIDAR"))[1:, :3][[1, 2, 6, 9, 26]], atol=1e-6)


def test_the_frame_leaves_strays_out(extension):
    shell = 3.0 * sphere_points(2600)
    obj = add_object(np.concatenate([shell, 100.0 * sphere_points(25)]) + (7.0, 0.0, 0.0))
    obj.select_set(True)
    area = next(area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D")
    extension.operators.files.importer._frame_selected(bpy.context)
    view = area.spaces.active.region_3d
    assert_allclose(view.view_location, [7.0, 0.0, 0.0], atol=0.1)
    assert 3.0 < view.view_distance < 60.0
    assert area.spaces.active.clip_end > 2.0 * view.view_distance
