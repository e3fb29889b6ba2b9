"""Cleaning, measuring, aligning and motion, with real keys and a real mouse, and the undo of each."""

import numpy as np
import pytest

from tests.gui.test_play import UNCHANGED, WORKING, add_sphere, finish, shading

EDITING = "bpy.context.object.mode == 'EDIT'"
FIGURES = """
import sys
live = next(module for name, module in sys.modules.items() if name.endswith("tools.measure_live"))
known = live.followed(bpy.context.object)
known and {figure.title: list(figure.values) for figure in known.figures}
"""
CHOSEN = """
import bmesh
sum(point.select for point in bmesh.from_edit_mesh(bpy.context.object.data).verts)
"""
STRAYS = """
points = np.concatenate([sphere_points(1500), sphere_points(12, seed=1) * np.linspace(1.4, 2.0, 12)[:, None]])
add_object(points).select_set(True)
bpy.ops.ed.undo_push(message="Cloud")
before = everything(bpy.context.object)
"""
COUNT = "len(bpy.data.objects['Cloud'].data.vertices)"
TOLD = "[notice.text for notice in bpy.data.objects['Cloud'].meshfree.notices]"
SAME_CLOUD = "all(everything(bpy.data.objects['Cloud'])[key] == before[key] for key in ('attributes', 'settings'))"
TWO_CLOUDS = """
fixed = sphere_points(1500) * (1.0, 0.7, 0.5)
target = add_object(fixed, "Target")
cloud = add_object(sphere_points(1200, seed=1) * (1.0, 0.7, 0.5))
cloud.rotation_euler, cloud.location = (0.08, -0.05, 0.1), (0.05, 0.02, -0.03)
for obj in (cloud, target):
    obj.select_set(True)
bpy.context.view_layer.update()
bpy.ops.ed.undo_push(message="Clouds")
before, place = everything(cloud), [list(row) for row in cloud.matrix_world]
"""
OFF = "np.abs(np.array(bpy.data.objects['Cloud'].matrix_world) - np.eye(4)).max()"
HEAT = "attribute(bpy.data.objects['Cloud'], 'lb_motion')"


@pytest.fixture
def opened(gui, request):
    """The window with more panels open in the next file."""
    gui.open_panels(*request.param)
    gui.new_file()
    yield gui
    gui.open_panels()


def box(gui, low, high):
    """Select the points between two heights by Box Select, from the front."""
    corners = [gui.python(f"on_screen(({x}, 0.0, {z}))") for x, z in ((-1.2, low), (1.2, high))]
    gui.point_at_view()
    gui.key("alt+a", "b")
    gui.drag(*corners)


def circle(gui, *places):
    """Select the points along a line by a wide Circle Select, from the front."""
    start, end = (gui.python(f"on_screen(({x}, 0.0, {z}))") for x, z in places)
    gui.point_at_view()
    gui.key("alt+a", "c", *["KP_Add"] * 10)
    gui.drag(start, end)
    gui.key("Return")


def lasso(gui, *places):
    """Select the points within a polygon by Lasso Select, from the front."""
    corners = [gui.python(f"on_screen(({x}, 0.0, {z}))") for x, z in places]
    gui.point_at_view()
    gui.key("alt+a")
    gui.run("xdotool", "keydown", "ctrl")
    gui.drag(*corners, button="right")
    gui.run("xdotool", "keyup", "ctrl")
    gui.settle()


def edit(gui):
    """Look from the front, in Edit Mode."""
    shading(gui, "WIREFRAME")
    gui.key("KP_1", "Home", "Tab")
    gui.wait_until(EDITING)


def run(gui, name, done, seconds=90):
    """Carry out a tool by the search, and confirm its dialog."""
    gui.search(name)
    gui.key("Return")
    gui.wait_until(done, seconds)
    finish(gui)
    gui.settle()


def undo(gui, done):
    """Undo what has made an expression true."""
    gui.point_at_view()
    gui.key("ctrl+z")
    gui.wait_until(f"not ({done})")


class TestCleaning:
    """Stray points, and fewer points."""

    @pytest.mark.parametrize("opened", [("MESHFREE_PT_clean",)], indirect=True)
    def test_strays_are_shown_selected_and_deleted(self, opened):
        gui = opened
        gui.python(STRAYS)
        shading(gui, "WIREFRAME")
        gui.open_tab()
        gui.press("meshfree.stray_points()")
        gui.wait_until("'lb_stray' in bpy.context.object.data.attributes", 90)
        finish(gui)
        gui.settle()
        found = gui.python("int((attribute(bpy.context.object, 'lb_stray') > 0).sum())")
        assert 12 <= found <= 15
        gui.press("meshfree.stray_points(action='SELECT'")
        chosen = "sum(point.select for point in bpy.context.object.data.vertices)"
        gui.wait_until(f"{chosen} == {found}")
        finish(gui)
        gui.shot("strays")
        gui.press("meshfree.stray_points(action='DELETE'", across=0.75)
        gui.wait_until(f"{COUNT} == {1512 - found}")
        finish(gui)
        gui.settle()
        undo(gui, f"{COUNT} < 1512")
        gui.key("ctrl+z", "ctrl+z")
        gui.wait_until(UNCHANGED)

    def test_thin_out(self, gui):
        add_sphere(gui, 1500)
        shading(gui, "WIREFRAME")
        run(gui, "Mesh-Free Thin Out", f"{COUNT} < 1000")
        assert gui.python(COUNT) > 200
        undo(gui, f"{COUNT} < 1500")
        assert gui.python(UNCHANGED)


class TestMeasures:
    """Figures of selected points and of parts, and curves on the surface."""

    @pytest.mark.parametrize("opened", [("MESHFREE_PT_measure",)], indirect=True)
    def test_figures_follow_box_circle_lasso_and_undo(self, opened):
        gui = opened
        add_sphere(gui, 1500)
        edit(gui)
        box(gui, 0.5, 1.1)
        gui.open_tab()
        gui.press("meshfree.measure_live")
        gui.wait_for(lambda: "Volume" in (gui.python(FIGURES) or ()), "the figures are there", 90)
        cap = gui.python(FIGURES)
        assert cap["Volume"][0] == pytest.approx(4.0 * np.pi / 3.0, rel=0.01)
        assert cap["Area"][0] == pytest.approx(np.pi, rel=0.05)
        box(gui, 0.0, 1.1)
        gui.wait_for(lambda: gui.python(FIGURES).get("Area", [0.0])[0] > 5.0, "they are of the half")
        half = gui.python(FIGURES)
        assert half["Area"][0] == pytest.approx(2.0 * np.pi, rel=0.03)
        assert half["Above the Plane"][0] == pytest.approx(2.0 * np.pi / 3.0, rel=0.08)
        gui.settle()
        gui.shot("measure_live")
        gui.point_at_view()
        gui.key("ctrl+z", "ctrl+z")  # the box, and the deselection before it
        gui.wait_for(lambda: gui.python(FIGURES) == cap, "they are of the cap again")
        gui.key("alt+a")
        gui.wait_for(lambda: gui.python(FIGURES) == {}, "there are none")
        for draw, places in (
            (circle, [(-0.5, 0.0), (0.5, 0.0)]),
            (lasso, [(-0.9, 0.0), (-0.9, 1.1), (0.9, 1.1), (0.9, 0.0)]),
        ):
            draw(gui, *places)
            area = 4.0 * np.pi * gui.python(CHOSEN) / 1500
            assert 0.5 < area < 7.0
            # There may be figures of what was selected before the stroke ended.
            gui.wait_for(
                lambda area=area: gui.python(FIGURES).get("Area", [0.0])[0] == pytest.approx(area, rel=0.15),
                "they are of what is selected",
            )
            gui.key("alt+a")
            gui.wait_for(lambda: gui.python(FIGURES) == {}, "there are none")
        gui.key("Tab")
        gui.wait_for(lambda: gui.python(FIGURES) is None, "they are gone")
        assert gui.python("everything(bpy.context.object)['settings'] == before['settings']")

    def test_measure_selection(self, gui):
        add_sphere(gui, 1500)
        edit(gui)
        box(gui, 0.0, 1.1)
        gui.search("Measure Selection")
        gui.wait_until(f"bool({TOLD})", 90)
        finish(gui)
        assert gui.python(EDITING)
        area = gui.python(f"float({TOLD}[0].split('Area ')[1].split(' ')[0])")
        assert area == pytest.approx(2.0 * np.pi, rel=0.03)
        gui.settle()
        undo(gui, f"bool({TOLD})")

    @pytest.mark.parametrize("opened", [("MESHFREE_PT_measure",)], indirect=True)
    def test_measure_parts(self, opened):
        gui = opened
        add_sphere(gui, 1500)
        shading(gui, "WIREFRAME")
        run(gui, "Measure Parts", "len(bpy.context.object.meshfree.parts) == 1")
        (volume,) = gui.python("[part.volume for part in bpy.context.object.meshfree.parts]")
        assert volume == pytest.approx(4.0 * np.pi / 3.0, rel=0.01)
        gui.open_tab()
        gui.shot("measure_parts")
        undo(gui, "len(bpy.context.object.meshfree.parts)")
        assert gui.python(UNCHANGED)

    def test_a_path_between_two_clicked_points(self, gui):
        add_sphere(gui, 1500)
        edit(gui)
        gui.key("alt+a")
        ends = gui.python(
            "[int(((points - place) ** 2).sum(axis=1).argmin()) for place in ((-0.6, -0.8, 0), (0.6, -0.8, 0))]"
        )
        for number, end in enumerate(ends):
            gui.python("view3d()[0].spaces.active.shading.show_xray_wireframe = False")
            x, y = gui.python(f"on_screen(points[{end}])")
            gui.move(x, y)
            if number:
                gui.run("xdotool", "keydown", "shift")
            gui.click(x, y)
            if number:
                gui.run("xdotool", "keyup", "shift")
            gui.settle()
        assert gui.python(CHOSEN) == 2
        gui.search("Geodesic Path")
        gui.wait_until("'Cloud Path' in bpy.data.objects", 90)
        finish(gui)
        gui.settle()
        gui.shot("path")
        undo(gui, "'Cloud Path' in bpy.data.objects")
        gui.key("Tab")
        gui.wait_until(f"not {EDITING}")
        assert gui.python(TOLD) == []

    def test_cross_section(self, gui):
        add_sphere(gui, 1500)
        shading(gui, "WIREFRAME")
        made = "'Cloud Section' in bpy.data.objects"
        run(gui, "Cross Section", made)
        assert any("enclosed area" in text for text in gui.python(TOLD))
        undo(gui, made)
        assert gui.python(UNCHANGED)


class TestAligning:
    """One cloud onto another."""

    def test_align_points(self, gui):
        gui.python(TWO_CLOUDS)
        shading(gui, "WIREFRAME")
        assert gui.python(OFF) > 0.05
        run(gui, "Align Points", f"{OFF} < 0.02")
        assert gui.python("'lb_residual' in bpy.data.objects['Cloud'].data.attributes")
        undo(gui, f"{OFF} < 0.02")
        assert gui.python("[list(row) for row in bpy.data.objects['Cloud'].matrix_world] == place")
        assert gui.python(SAME_CLOUD)


class TestMotion:
    """What runs along the surface is played."""

    def test_heat_is_played(self, gui):
        add_sphere(gui, 1500)
        gui.python("add_group(bpy.context.object, 'Source', points[:, 2] > 0.9)")
        gui.python("bpy.context.scene.frame_end = 12")
        gui.python("bpy.ops.wm.save_as_mainfile(filepath=bpy.app.tempdir + 'heat.blend')")
        gui.python("bpy.ops.ed.undo_push(message='Sources'); before = everything(bpy.context.object)")
        shading(gui, "WIREFRAME")
        moving = "bool(bpy.context.object.meshfree.motion_file)"
        run(gui, "Simulate Along Surface", moving)
        gui.python("bpy.context.scene.frame_set(1)")
        first = gui.python(f"float({HEAT}.max())")
        gui.point_at_view()
        gui.key("space")
        gui.wait_until("main_window().screen.is_animation_playing")
        gui.wait_until("bpy.context.scene.frame_current > 6", 60)
        gui.key("space")
        gui.wait_until("not main_window().screen.is_animation_playing")
        assert gui.python(f"float({HEAT}.max())") < 0.9 * first
        gui.shot("heat")
        undo(gui, moving)
        assert gui.python(f"not {WORKING}")
