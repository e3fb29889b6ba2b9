"""The tab is calm: it fits the screen, results move nothing in it, and its buttons do what they say."""

import numpy as np
import pytest

from tests.gui.test_play import ANALYZED, WORKING, add_sphere, finish, shading
from window import NOTICES

# A scan with all that an analysis has something to tell of: noise, duplicates, strays, and a void.
SCAN = """
rng = np.random.default_rng(0)
points = sphere_points(3000) * (1.0, 1.0, 0.7)
points += 0.01 * rng.standard_normal(points.shape)
points = np.concatenate([points[np.hypot(points[:, 0], points[:, 2] - 0.6) > 0.12], points[:40], [[0.0, 0.0, 3.0]]])
add_object(points).select_set(True)
bpy.ops.ed.undo_push(message="Scan")
"""
TOLD = "[(told.tool, told.level, told.text) for told in bpy.context.object.meshfree.notices]"
RED = (
    """
space = bpy.context.preferences.themes[0].view_3d.space
kept = [tuple(getattr(space.panelcolors, name)) for name in ("header", "back", "sub_back")]
for name in ("header", "back", "sub_back"):
    setattr(space.panelcolors, name, (1.0, 0.0, 0.0, 1.0))
""",
    """
for name, color in zip(("header", "back", "sub_back"), kept):
    setattr(space.panelcolors, name, color)
""",
)
SEEN = """
import sys
told = next(module for name, module in sys.modules.items() if name.endswith("ui.notices"))
told.notices(bpy.context.object)
"""
JOB = """
import sys
job = next(module for name, module in sys.modules.items() if name.endswith("running.job")).running()
job and job.progress
"""
SHOWN = """
import sys
display = next(module for name, module in sys.modules.items() if name.endswith("ui.display"))
display.shown_attribute(bpy.context.object)
"""


@pytest.fixture
def tab(gui, request):
    """The tab as it comes up, or with all closed."""
    closed = getattr(request, "param", False)
    gui.open_panels(*(() if closed else ("MESHFREE_PT_display", "MESHFREE_PT_statistics")))
    gui.new_file()
    gui.python("overlay = view3d()[0].spaces.active.overlay; overlay.show_axis_x = overlay.show_axis_y = False")
    gui.python("overlay.show_floor = False")  # which are seen through the sidebar
    yield gui
    gui.open_panels()


def height(gui):
    """Pixels from the first to the last row of the panels, by a color that nothing else has."""
    gui.python(RED[0])
    x, y, width, tall = gui.region("UI")
    column = gui.pixels((x, y, width, tall))[:, 12]
    gui.python(RED[1])
    rows = np.flatnonzero((column[:, 0] > 200) & (column[:, 1:].max(axis=1) < 60))
    return int(np.ptp(rows)) + 1


class TestHeight:
    """How much of the screen the tab takes."""

    @pytest.mark.parametrize("tab", [True], indirect=True)
    def test_with_all_panels_closed_it_fits_the_screen(self, tab):
        add_sphere(tab, 500)
        shading(tab, "WIREFRAME")
        tab.python("bpy.ops.meshfree.analyze(); bpy.ops.ed.undo_push(message='Analyzed')")
        tab.open_tab()
        tab.shot("tab_closed")
        assert 250 < height(tab) <= 657

    def test_it_opens_with_few_rows(self, tab):
        add_sphere(tab, 500)
        shading(tab, "WIREFRAME")
        tab.open_tab()
        tab.shot("tab_opened")
        assert 10 < len(tab.text_rows()) <= 20
        assert height(tab) <= 657

    def test_results_take_one_line_and_move_nothing(self, tab):
        tab.python(SCAN)
        shading(tab, "WIREFRAME")
        tab.open_tab()
        before = tab.text_rows()
        tab.press("meshfree.analyze")
        tab.wait_until(WORKING)
        tab.point_at_view()
        tab.wait_until(ANALYZED, 90)
        finish(tab)
        told = tab.python(TOLD)
        assert len(told) >= 3
        assert {level for _, level, _ in told} == {"NOTICE"}  # without a triangle
        after = tab.text_rows()
        tab.shot("tab_analyzed")
        moved = [row for row in before if min(abs(row - other) for other in after) > 4]  # icons are higher than words
        assert moved == []
        quick, line, show = before[NOTICES - 1 : NOTICES + 2]
        assert show - quick - 26 <= 30  # the line of the notices, whose neighbors are 26 and 28 pixels apart
        assert abs(line - 0.5 * (quick + show)) < 4

        folded = height(tab)
        tab.unfold_notices()
        tab.shot("notices_unfolded")
        assert height(tab) > folded + 40  # down to the end of the sidebar
        tab.unfold_notices()
        assert height(tab) == folded


class TestNotices:
    """A notice goes when what it asks for is done."""

    def test_stale_results(self, tab):
        add_sphere(tab, 500)
        shading(tab, "WIREFRAME")
        tab.python("bpy.ops.meshfree.analyze(); bpy.ops.ed.undo_push(message='Analyzed')")
        tab.open_tab()
        assert tab.python(SEEN) == []
        tab.point_at_view()
        tab.key("s", "2", "Return")
        tab.wait_for(lambda: tab.python(SEEN)[0][1], "there is something to do")
        tab.unfold_notices()
        tab.shot("stale")
        tab.press("meshfree.analyze")
        tab.wait_for(lambda: not any(acts for _, acts, _ in tab.python(SEEN)), "the notice is gone", 60)


class TestButtons:
    """Buttons do what they say, and what the search does."""

    def test_the_search_analyzes_as_the_button_does(self, tab):
        found = []
        for by_search in (False, True):
            tab.new_file()
            add_sphere(tab, 500)
            shading(tab, "WIREFRAME")
            tab.open_tab()
            if by_search:
                tab.search("Analyze Points")
            else:
                tab.press("meshfree.analyze")
            tab.wait_until(ANALYZED, 60)
            finish(tab)
            found.append(tab.python("result_names(bpy.context.object), bpy.context.object.meshfree.total_area"))
        assert found[0] == found[1]

    def test_clean_deletes_strays(self, tab):
        tab.python(SCAN)
        shading(tab, "WIREFRAME")
        tab.open_tab()
        count = "len(bpy.context.object.data.vertices)"
        before = tab.python(count)
        tab.press("meshfree.stray_points")
        tab.wait_until(f"{count} < {before}", 60)
        finish(tab)
        assert tab.python("max(vertex.co.length for vertex in bpy.context.object.data.vertices)") < 1.5
        tab.point_at_view()
        tab.key("ctrl+z")
        tab.wait_until(f"{count} == {before}")

    def test_curvature_shows_the_mean_curvature_whatever_was_on_show(self, tab):
        add_sphere(tab, 500)
        shading(tab, "WIREFRAME")
        tab.python("bpy.ops.meshfree.analyze(attribute='lb_area'); bpy.ops.ed.undo_push(message='Area')")
        assert tab.python(SHOWN) == "lb_area"
        tab.open_tab()
        tab.press("meshfree.analyze(at_once=True")
        tab.wait_for(lambda: tab.python(SHOWN) == "lb_mean_curvature", "the mean curvature is shown", 60)

    def test_a_result_is_chosen_in_the_list(self, tab):
        add_sphere(tab, 500)
        shading(tab, "WIREFRAME")
        tab.python("bpy.ops.meshfree.analyze(); bpy.ops.ed.undo_push(message='Analyzed')")
        tab.open_tab()
        x, y = tab.find_button("meshfree.colormap()", across=0.83)
        tab.click(x - 0.5 * tab.region("UI")[2], y)
        tab.shot("results")
        tab.type("Gauss")
        tab.key("Return")
        tab.wait_for(lambda: tab.python(SHOWN) == "lb_gaussian_curvature", "the Gaussian curvature is shown", 60)

    def test_progress_tells_the_time_left(self, tab):
        add_sphere(tab, 30000, 0.005)
        shading(tab, "WIREFRAME")
        tab.open_tab()
        tab.press("meshfree.analyze")
        tab.wait_for(lambda: "left" in (tab.python(JOB) or ""), "the time left is told", 90)
        tab.shot("time_left")
        tab.key("Escape")
        finish(tab, 20)


class TestDialogs:
    """Dialogs are as wide as they are, wherever they come from."""

    def test_without_sources_there_is_no_ok(self, gui):
        add_sphere(gui, 500)
        shading(gui, "WIREFRAME")
        gui.key("Tab", "alt+a", "Tab")
        gui.point_at_view()
        gui.python(
            """
with bpy.context.temp_override(window=main_window()):  # without a region
    bpy.ops.meshfree.geodesic_distance("INVOKE_DEFAULT")
None
"""
        )
        gui.settle()
        gui.shot("dialog_without_sources")
        gui.key("Return")
        gui.settle()
        assert gui.python("'lb_distance' not in bpy.context.object.data.attributes")
