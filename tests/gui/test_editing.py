"""A cloud in Edit Mode: seen in its colors, selected points in Blender's, and only what is seen selected."""

import numpy as np
import pytest

from tests.gui.test_measures import CHOSEN, EDITING, opened  # noqa: F401
from tests.gui.test_play import finish

COUNT = 20_000  # so many that Blender's dots cover all of them
SCAN = f"""
points = sphere_points({COUNT})
obj = add_object(points)
obj.select_set(True)
colors = np.tile(np.float32([0.05, 0.6, 0.1, 1.0]), ({COUNT}, 1))
obj.data.color_attributes.new("Color", "FLOAT_COLOR", "POINT").data.foreach_set("color", colors.reshape(-1))
bpy.ops.meshfree.show_surface()
view3d()[0].spaces.active.shading.type = "SOLID"
bpy.ops.ed.undo_push(message="Scan")
"""
# What of Blender's own might be changed to dim its dots.
PREFERENCES = """
theme, overlay = bpy.context.preferences.themes[0].view_3d, view3d()[0].spaces.active.overlay
mode = bpy.context.tool_settings.mesh_select_mode
[theme.vertex_size, *theme.vertex, *theme.vertex_select, overlay.show_overlays, *mode]
"""
PLACES = "[list(point.co) for point in bmesh.from_edit_mesh(bpy.context.object.data).verts if point.select]"


@pytest.fixture
def scan(gui):
    """A green sphere, seen from the front in Edit Mode, nothing selected."""
    gui.python(f"import bmesh\n{SCAN}")
    before = gui.python(PREFERENCES)
    gui.key("KP_1", "Home", "Tab")
    gui.wait_until(EDITING)
    gui.key("alt+a")
    yield gui
    assert gui.python(PREFERENCES) == before


def shares(gui, left=-0.5, right=0.5):
    """Shares of the pixels of the sphere between two places from left to right: green, orange, black."""
    (x, top), (end, bottom) = (
        gui.python(f"on_screen(({place}, 0.0, {z}))") for place, z in ((left, 0.5), (right, -0.5))
    )
    red, green, blue = gui.pixels((x, top, end - x, bottom - top)).astype(int).transpose(2, 0, 1)
    return (
        np.mean(green > 60 + np.maximum(red, blue)),
        np.mean((red > green + 60) & (green > blue + 30)),
        np.mean(np.maximum(np.maximum(red, green), blue) < 20),
    )


def test_points_have_their_colors_and_selected_ones_that_of_selections(scan):
    scan.wait_for(lambda: shares(scan)[0] > 0.95, "the scan is green")
    assert shares(scan)[2] < 0.01
    scan.shot("edit_mode_scan")
    left, right = (scan.python(f"on_screen(({x}, 0.0, {z}))") for x, z in ((-0.9, 0.7), (0.0, -0.7)))
    scan.key("b")
    scan.drag(left, right)
    scan.wait_for(lambda: shares(scan, -0.5, -0.1)[1] > 0.9, "the left is orange")
    assert shares(scan, 0.1, 0.5)[0] > 0.95
    scan.shot("edit_mode_selected")
    scan.key("ctrl+z")
    scan.wait_for(lambda: shares(scan)[0] > 0.95, "the scan is green again")
    scan.key("a")
    scan.wait_for(lambda: shares(scan)[1] > 0.95, "the scan is orange")
    scan.key("h")
    scan.wait_for(lambda: max(shares(scan)) < 0.05, "nothing is there")
    scan.key("alt+h", "alt+a")
    scan.wait_for(lambda: shares(scan)[0] > 0.95, "all is there again")
    scan.key("a", "g", "z", "3", "Return")
    scan.wait_for(lambda: max(shares(scan)) < 0.05, "all has moved away")


def test_xray_shows_the_dots_of_blender(scan):
    scan.key("alt+z")
    scan.wait_for(lambda: shares(scan)[2] > 0.2 and shares(scan)[0] == 0.0, "there are black dots alone")
    scan.key("alt+z")
    scan.wait_for(lambda: shares(scan)[0] > 0.95, "the scan is green")


def test_only_what_is_seen_stays_selected(scan):
    scan.key("alt+z")
    corners = [scan.python(f"on_screen(({x}, 0.0, {z}))") for x, z in ((-0.4, 0.4), (0.4, -0.4))]
    scan.key("b")
    scan.drag(*corners)
    through = scan.python(CHOSEN)
    scan.key("alt+z")
    scan.search("Select on Surface")
    scan.wait_for(lambda: scan.python(CHOSEN) < through, "points behind are not selected")
    finish(scan)
    assert scan.python(CHOSEN) == pytest.approx(through / 2, rel=0.05)
    assert max(place[1] for place in scan.python(PLACES)) < 0.0
    assert scan.python(EDITING)


@pytest.mark.parametrize("opened", [("MESHFREE_PT_select",)], indirect=True)
def test_clipped_to_a_box(opened):  # noqa: F811
    gui = opened
    gui.python(f"import bmesh\n{SCAN}")
    gui.key("KP_1", "Home", "Tab")
    gui.wait_until(EDITING)
    gui.key("alt+a")
    gui.open_tab()
    gui.press("view3d.clip_border")
    corners = [gui.python(f"on_screen(({x}, 0.0, {z}))") for x, z in ((-0.9, 0.6), (0.0, -0.6))]
    gui.drag(*corners)
    gui.wait_for(lambda: max(shares(gui, 0.1, 0.4)) < 0.05, "the right is cut off")
    assert shares(gui, -0.5, -0.1)[0] > 0.95
    gui.shot("edit_mode_clipped")
    ends = [gui.python(f"on_screen(({x}, 0.0, {z}))") for x, z in ((-0.95, 0.3), (0.6, -0.3))]
    gui.point_at_view()
    gui.key("b")
    gui.drag(*ends)
    gui.wait_for(lambda: gui.python(CHOSEN) > 100, "points are selected")
    assert max(place[0] for place in gui.python(PLACES)) < 0.01
    gui.press("view3d.clip_border")
    gui.wait_for(lambda: shares(gui, 0.1, 0.4)[0] > 0.9, "all is there again")
