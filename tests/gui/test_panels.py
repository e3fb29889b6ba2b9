"""The sidebar, what is drawn over the view, and the Info log."""

import numpy as np
import pytest

from tests.gui import test_play
from tests.gui.test_play import ANALYZED, UNCHANGED, WORKING, finish, shading

NEIGHBORS = "bpy.context.object.meshfree.neighbors"
SIDEBAR = "view3d()[0].spaces.active.show_region_ui"
PRESET_FILES = """
import os
folders = bpy.utils.preset_paths("meshfree_laplacian")
sorted(name for folder in folders for name in os.listdir(folder) if name.endswith(".py"))
"""
COLORED = """
shading = view3d()[0].spaces.active.shading
shading.type, shading.color_type = "SOLID", "VERTEX"  # quick to draw, and as good as colored for the legend
"""
INFO_LOG = """
area = next(area for area in main_window().screen.areas if area.type == "PROPERTIES")
area.type = "INFO"
with bpy.context.temp_override(window=main_window(), area=area, region=area.regions[-1]):
    bpy.ops.info.select_all(action="SELECT")
    bpy.ops.info.report_copy()
area.type = "PROPERTIES"
bpy.context.window_manager.clipboard.splitlines()
"""


def add_sphere(gui, count=1000, noise=0.0):
    shading(gui, "WIREFRAME")
    test_play.add_sphere(gui, count, noise)
    gui.settle()


def corner(gui):
    """Where the legend is drawn: the lower right corner of the view beside the sidebar."""
    x, y, width, height = gui.region()
    right = gui.region("UI")[0] if gui.python(SIDEBAR) else x + width
    return right - 170, y + height - 260, 160, 250


def colors(pixels):
    return np.count_nonzero(np.ptp(pixels.astype(int), axis=2) > 60)


@pytest.fixture
def opened(gui, request):
    """A cloud, and the tab with one more panel open."""
    gui.open_panels(request.param)
    gui.new_file()
    add_sphere(gui)
    gui.open_tab()
    if request.param == "MESHFREE_PT_settings":  # the last ones
        gui.scroll(60)
    yield gui
    gui.open_panels()


def red(pixels):
    return np.count_nonzero((pixels[:, :, 0] > 150) & (pixels[:, :, 1:].max(axis=2) < 90))


class TestPresets:
    """Settings by the menu of presets and the buttons beside it."""

    @pytest.mark.parametrize("opened", ["MESHFREE_PT_settings"], indirect=True)
    def test_apply_save_and_remove(self, opened):
        gui = opened
        usual = gui.python(NEIGHBORS)

        def menu():
            """Open the menu of presets, which moves as settings come and go."""
            gui.click(gui.region("UI")[0] + 60, gui.find_button("meshfree.add_preset()", across=0.76)[1])

        menu()
        gui.key("p")  # Paper
        gui.wait_until("bpy.context.object.meshfree.laplacian == 'PAPER'")
        menu()
        gui.key("d")  # Default
        gui.wait_until("bpy.context.object.meshfree.laplacian == 'DEFAULT'")

        gui.python(f"{NEIGHBORS} = {usual + 7}")
        plus, y = gui.find_button("meshfree.add_preset()", across=0.76)
        gui.click(plus, y)
        gui.click(plus - 60, y)  # the field for the name, which comes up under the mouse
        gui.type("Mine")
        gui.shot("preset_dialog")
        gui.key("Return", "Return")  # of the name, of the dialog
        gui.wait_for(lambda: gui.python(PRESET_FILES) == ["Mine.py"], "the preset is a file")

        gui.python(f"{NEIGHBORS} = {usual}")
        menu()
        gui.shot("preset_menu")
        gui.key("m")
        gui.wait_until(f"{NEIGHBORS} == {usual + 7}")

        gui.press("meshfree.add_preset(remove_active=True", across=0.84)
        gui.wait_for(lambda: gui.python(PRESET_FILES) == [], "the file of the preset is gone")


class TestView:
    """What is drawn over the view."""

    def test_local_view(self, gui):
        add_sphere(gui)
        gui.python("other = add_object(sphere_points(300) + (3.0, 0.0, 0.0), 'Other')")
        gui.python("bpy.context.view_layer.objects.active = bpy.data.objects['Cloud']")
        gui.python("bpy.ops.meshfree.spectrum(count=5)")
        settings = "bpy.data.objects['Cloud'].meshfree"
        gui.python(COLORED)
        gui.python(f"{settings}.histogram = {settings}.plot_eigenvalues = False")
        gui.python(f"{settings}.legend_place = 1.0, 0.02")  # else it makes room for the points

        def drawn():
            return colors(gui.pixels(corner(gui)))

        gui.wait_for(lambda: drawn() > 1000, "the legend is drawn")
        shown = drawn()
        gui.point_at_view()
        gui.key("KP_Divide")
        gui.wait_until("view3d()[0].spaces.active.local_view is not None")
        gui.wait_for(lambda: drawn() == pytest.approx(shown, rel=0.1), "the legend is drawn as before")
        gui.python("view3d()[0].spaces.active.overlay.show_overlays = False")
        gui.wait_for(lambda: drawn() < 100, "no legend is drawn")
        gui.python("view3d()[0].spaces.active.overlay.show_overlays = True")
        gui.key("KP_Divide")
        gui.wait_until("view3d()[0].spaces.active.local_view is None")
        gui.wait_for(lambda: drawn() == pytest.approx(shown, rel=0.1), "the legend is drawn as before")

    def test_the_legend_is_dragged_by_the_mouse_and_there_where_colors_are(self, gui):
        add_sphere(gui)
        gui.python("bpy.ops.meshfree.analyze(); bpy.ops.ed.undo_push(message='Analyzed')")
        gui.python(COLORED)
        place = "list(bpy.data.objects['Cloud'].meshfree.legend_place)"

        def drawn():
            return colors(gui.pixels(corner(gui)))

        gui.wait_for(lambda: drawn() > 1000, "the legend is drawn")
        x, y, _, height = corner(gui)
        gui.shot("legend_in_its_corner")
        gui.drag((x + 80, y + height - 60), (x - 320, y - 200))
        gui.wait_until(f"{place}[0] < 0.7")
        gui.wait_for(lambda: drawn() < 100, "the legend has left its corner")
        assert gui.python(f"{place}[1]") > 0.3
        gui.shot("legend_dragged")
        gui.key("ctrl+z")
        gui.wait_until(f"{place} == [1.0, 0.0]")
        gui.wait_for(lambda: drawn() > 1000, "undo brings it back")
        shading(gui, "WIREFRAME")
        gui.wait_for(lambda: drawn() < 100, "no legend without colors")

    def test_the_active_object_outside_of_the_local_view(self, gui):
        add_sphere(gui)
        gui.python("other = add_object(sphere_points(300) + (3.0, 0.0, 0.0), 'Other')")
        gui.python("bpy.context.view_layer.objects.active = bpy.data.objects['Cloud']")
        gui.python("bpy.ops.meshfree.analyze()")
        gui.python("bpy.data.objects['Cloud'].select_set(False); other.select_set(True)")
        gui.point_at_view()
        gui.key("KP_Divide")
        gui.wait_until("view3d()[0].spaces.active.local_view is not None")
        gui.settle()  # no error in Python is seen, says the fixture
        gui.key("KP_Divide")
        gui.wait_until("view3d()[0].spaces.active.local_view is None")


class TestGroupColors:
    """Group Colors in Edit Mode."""

    @pytest.mark.parametrize("opened", ["MESHFREE_PT_deform"], indirect=True)
    def test_undo_leaves_them_as_they_were(self, opened):
        shown = "bpy.context.object.meshfree.show_groups and len(bpy.context.object.modifiers)"
        groups = "bpy.context.object.vertex_groups.keys()"
        opened.point_at_view()
        opened.key("Tab", "alt+a")
        opened.wait_until("bpy.context.object.mode == 'EDIT'")
        opened.python("bpy.context.object.meshfree.show_groups = True")
        opened.point_at_view()
        opened.key("a")
        opened.press("meshfree.group_from_selection(role='ANCHOR'")
        opened.wait_until(f"{groups} == ['Anchor']")
        opened.point_at_view()
        for _ in range(3):
            opened.key("ctrl+z")
            assert opened.python(shown) == 1
        assert opened.python(groups) == []
        for _ in range(3):
            opened.key("ctrl+shift+z")
            assert opened.python(shown) == 1
        assert opened.python(groups) == ["Anchor"]


class TestSidebar:
    """The tab and its buttons."""

    def test_hide_and_show_while_it_works(self, gui):
        add_sphere(gui, 60_000, 0.005)  # work for longer than the keys take
        gui.open_tab()
        gui.press("meshfree.analyze")
        gui.wait_until(WORKING)
        gui.point_at_view()
        for shown in (False, True, False, True):
            gui.key("n")
            gui.wait_until(f"{SIDEBAR} == {shown}")
        assert gui.python(f"bool({WORKING})")
        gui.shot("sidebar_while_it_works")
        gui.key("Escape")
        finish(gui, 10)
        assert gui.python(UNCHANGED)

    @pytest.mark.parametrize("opened", ["MESHFREE_PT_make"], indirect=True)
    def test_a_gray_button_says_why(self, opened):
        gui = opened
        x, y = gui.find_button("meshfree.separate_by_segment")
        around = (x - 60, y - 30, 230, 160)  # without the view and its red axis
        assert red(gui.pixels(around)) == 0
        gui.move(x + 3, y + 1)
        # As Blender writes why a button is disabled, some time after the mouse came to rest.
        gui.wait_for(lambda: red(gui.pixels(around)) > 100, "red words in a tooltip")
        assert not gui.python("bpy.ops.meshfree.separate_by_segment.poll()")

    def test_a_notice_stays_until_it_is_dismissed(self, gui):
        add_sphere(gui, 500)
        gui.python("bpy.context.object.data.vertices[0].co = (0.0, 0.0, 9.0)")
        gui.python("bpy.ops.ed.undo_push(message='One far away')")
        gui.open_tab()
        gui.press("meshfree.analyze")
        gui.wait_until(ANALYZED, 60)
        finish(gui)
        notices = "[told.text for told in bpy.context.object.meshfree.notices]"
        told = gui.python(notices)
        assert told
        gui.unfold_notices()
        gui.shot("notices")
        gui.press("meshfree.dismiss", across=0.83)
        gui.wait_until(f"len({notices}) == {len(told) - 1}")
        gui.point_at_view()
        gui.key("ctrl+z")
        gui.wait_until(f"{notices} == {told!r}")

    def test_the_info_log_has_the_words_of_scripts(self, gui):
        add_sphere(gui, 500)
        gui.open_tab()
        gui.press("meshfree.analyze")
        gui.wait_until(ANALYZED, 60)
        finish(gui)
        gui.settle()
        assert gui.python("bpy.context.window_manager.operators[-1].name") == "Analyze Points"
        lines = gui.python(INFO_LOG)
        called = [line for line in lines if line.startswith("bpy.ops.meshfree.analyze(")]
        assert called
        assert any(line.startswith("Cloud: ") and "500 points" in line for line in lines)
        gui.python("bpy.ops.ed.undo()")
        gui.python(f"name = bpy.context.object.name\n{called[-1]}")  # a line of the log is a script
        assert gui.python(ANALYZED)
