"""The legend over the view and in renders: its height, its place, when it is there, and its digits."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from tests.blender.clouds import add_group, add_object, attribute, sphere_points
from tests.blender.test_panel import draw
from tests.blender.test_seeing import add_camera
from tools.quantities import quantity


@pytest.fixture
def cloud():
    """A sphere that shows whether its points lie at a boundary."""
    obj = add_object(sphere_points())
    bpy.ops.meshfree.analyze()
    bpy.ops.meshfree.colormap(attribute="lb_boundary")
    return obj


def legend_of(overlay, obj):
    return overlay.pictures(obj, bpy.context.scene)[0]


def test_a_legend_is_as_high_as_what_it_holds(overlay, cloud):
    """Two boxes need less than six, and twelve more; room is left for none."""
    heights = {}
    for count in (2, 6, 12):
        part = cloud.data.attributes.get("part") or cloud.data.attributes.new("part", "INT", "POINT")
        part.data.foreach_set("value", (np.arange(1000) % count).astype(np.int32))
        bpy.ops.meshfree.colormap(attribute="part", color_map="CATEGORICAL")
        picture = legend_of(overlay, cloud)
        heights[count] = picture.height
        boxes = [text.y for text in picture.texts if text.part.startswith("box")]
        assert len(boxes) == count
        assert min(boxes) < 25.0
    assert heights[2] < 90.0 < heights[6] < heights[12]
    assert heights[12] - heights[6] == pytest.approx(6 / 4 * (heights[6] - heights[2]))


def test_a_legend_names_the_causes_of_doubt(core, overlay):
    """In the order of core's numbers, and in the colors of these; the histogram has room for the outer names only."""
    obj = add_object(np.random.default_rng(0).uniform(-1.0, 1.0, (1200, 3)))
    bpy.ops.meshfree.analyze()
    doubt = attribute(obj, "lb_doubt")
    assert np.count_nonzero(doubt == core.Doubt.VOLUME) > 100
    doubt[:7] = range(7)
    obj.data.attributes["lb_doubt"].data.foreach_set("value", doubt)
    bpy.ops.meshfree.colormap(attribute="lb_doubt")
    obj.meshfree.histogram = True
    legend, histogram = overlay.pictures(obj, bpy.context.scene)
    boxes = [text.text for text in legend.texts if text.part.startswith("box")]
    assert boxes == list(quantity("lb_doubt").names)
    others = {core.Doubt.NONE: "Trusted", core.Doubt.FEW: "Too Few"}
    assert boxes == [others.get(cause, cause.name.replace("_", " ").title()) for cause in core.Doubt]
    assert {"Trusted", "Left Out"} == set(boxes) & {text.text for text in histogram.texts}


@pytest.mark.parametrize(
    ("shading", "seen"),
    [
        ({"type": "MATERIAL"}, True),
        ({"type": "RENDERED"}, True),
        ({"type": "SOLID", "color_type": "VERTEX"}, True),
        ({"type": "SOLID", "color_type": "MATERIAL"}, False),
        ({"type": "WIREFRAME"}, False),
    ],
)
def test_a_legend_is_where_colors_are(overlay, cloud, shading, seen):
    assert overlay.shows_colors(cloud, SimpleNamespace(**shading)) == seen
    cloud.modifiers[0].show_viewport = False
    assert not overlay.shows_colors(cloud, SimpleNamespace(**shading))
    assert not overlay.shows_colors(add_object(sphere_points(200)), SimpleNamespace(**shading))


def test_no_colors_no_legend_but_the_eigenvalues(overlay):
    obj = add_object(sphere_points())
    bpy.ops.meshfree.spectrum(count=3)
    obj.meshfree.plot_eigenvalues = obj.meshfree.histogram = True
    assert len(overlay.pictures(obj, bpy.context.scene)) == 3
    (plot,) = overlay.pictures(obj, bpy.context.scene, colored=False)
    assert plot.texts[0].text == "Eigenvalues"


def test_the_legend_stays_while_a_handle_is_active(overlay, cloud, monkeypatch):
    points = sphere_points()
    add_group(cloud, "Handle", points[:, 2] > 0.8)
    add_group(cloud, "Anchor", points[:, 2] < -0.8)
    bpy.ops.meshfree.deform_bind()
    empty = cloud.meshfree.deform.handle_items[0].empty
    space = SimpleNamespace(overlay=SimpleNamespace(show_overlays=True))
    other = bpy.data.objects.new("Other", None)
    bpy.context.scene.collection.objects.link(other)
    for active, found in ((empty, cloud), (cloud, cloud)):
        context = SimpleNamespace(object=active, scene=bpy.context.scene, space_data=space)
        assert overlay.drawn_object(context) == found
    assert not overlay.pictures(
        overlay.drawn_object(SimpleNamespace(object=other, scene=bpy.context.scene, space_data=space)),
        bpy.context.scene,
    )


def test_places_are_shares_of_the_room(overlay):
    placed = overlay.Placed((10.0, 20.0, 510.0, 420.0), (100.0, 200.0))
    assert placed.corner((1.0, 0.0)) == (410.0, 20.0)
    assert placed.corner((0.0, 1.0)) == (10.0, 220.0)
    assert placed.shares((210.0, 120.0)) == [0.5, 0.5]
    assert placed.shares((-50.0, 900.0)) == [0.0, 1.0]
    narrow = overlay.Placed((10.0, 20.0, 60.0, 420.0), (100.0, 200.0))
    assert narrow.corner(narrow.shares((10.0, 20.0))) == (10.0, 20.0)


def legend_texts():
    return [block for block in bpy.data.curves if "Mesh-Free Legend" in block.name]


def test_digits_in_renders_are_those_of_the_interface(cloud, tmp_path):
    add_camera()
    bpy.ops.meshfree.legend()
    fonts = {curve.font for curve in legend_texts()}
    (font,) = fonts
    assert font.filepath != "<builtin>"
    assert font.packed_file is not None  # so that other machines have it
    bpy.ops.meshfree.colormap(attribute="lb_area")
    assert {curve.font for curve in legend_texts()} == {font}
    own = bpy.data.fonts.load(font.filepath)
    own.name = "Own"
    legend_texts()[0].font = own  # somebody's choice stays
    bpy.ops.meshfree.colormap(attribute="lb_mean_curvature")
    assert own in {curve.font for curve in legend_texts()}
    bpy.ops.meshfree.legend(show=False)
    assert "Own" in bpy.data.fonts
    assert not [name for name in bpy.data.fonts.keys() if name.startswith("Inter")]


def test_the_panel_speaks_of_the_legend_only_where_colors_are(cloud):
    bpy.context.scene.view_settings.view_transform = "AgX"
    assert "Colors differ from the legend:" in draw()
    obj = add_object(sphere_points(200))
    bpy.ops.meshfree.show_surface()
    assert obj.modifiers
    assert not {"Colors differ from the legend:", "legend", "histogram", "Legend in Renders"} & set(draw())


def shown_bounds(obj):
    return obj.meshfree.range_low, obj.meshfree.range_high


def test_the_range_of_distances_begins_at_zero(cloud):
    add_group(cloud, "Source", [0])
    bpy.ops.meshfree.geodesic_distance()
    low, high = shown_bounds(cloud)
    assert low == 0.0
    assert 2.5 < high < 3.3
    cloud.meshfree.range_mode = "PERCENTILE"
    assert cloud.meshfree.range_low > 0.0
    cloud.meshfree.range_mode = "AUTO"
    bpy.ops.meshfree.colormap(attribute="lb_area")
    assert cloud.meshfree.range_low > 0.0


@pytest.mark.parametrize("color_map", ["AUTO", "COOL_WARM", "MAGMA"])
def test_nothing_but_zeros_is_said_to_be_that(overlay, cloud, color_map):
    cloud.data.attributes.new("nothing", "FLOAT", "POINT")
    cloud.meshfree.histogram = True
    bpy.ops.meshfree.colormap(attribute="nothing", color_map=color_map)
    legend, histogram = overlay.pictures(cloud, bpy.context.scene)
    assert [text.text for text in legend.texts] == ["Nothing", "All Zero"]
    assert "All Zero" in [text.text for text in histogram.texts]
    assert shown_bounds(cloud) == (0.0, 0.0)
    assert "All values are zero" in draw()
    assert "range_low" not in draw()
    cloud.data.attributes["nothing"].data[0].value = 2.0
    bpy.ops.meshfree.colormap()
    assert "All values are zero" not in draw()
    assert "All Zero" not in [text.text for text in legend_of(overlay, cloud).texts]
