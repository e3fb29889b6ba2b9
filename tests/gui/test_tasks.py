"""What one gesture does: a file dropped onto the view, a task of the panel, a point picked, a result adjusted."""

import pytest

from tests.gui.test_play import UNCHANGED, WORKING, add_sphere, colored, finish, shading

EGG = """
import os
egg = sphere_points(3000) * (1.0, 0.8, 1.5)
scan = os.path.join(bpy.app.tempdir, "Egg.xyz")
np.savetxt(scan, egg)
"""
# What Blender calls when a file is let go over an area.
DROP = """
area, region, _ = view3d()
with bpy.context.temp_override(window=main_window(), area=area, region=region):
    bpy.ops.wm.drop_import_file("INVOKE_DEFAULT", directory=bpy.app.tempdir, files=[{"name": "Egg.xyz"}])
"""
IMPORTED = "'Egg' in bpy.data.objects"
# By the operator of a button: what there is afterwards, and not before.
TASKS = {
    "segment": "'lb_segment' in bpy.data.objects['Cloud'].data.attributes",
    "analyze(at_once=True": "'lb_mean_curvature' in bpy.data.objects['Cloud'].data.attributes",
    "deform_bind": "bpy.context.object.name == 'Cloud Handle'",
}
# By what the search finds: the attribute, and what it is at a point where the surface faces the viewer.
PICKED = [("Unwrap Around Point", "lb_uv", [0.5, 0.5]), ("Extend Direction", "lb_direction", [0.0, 0.0, -1.0])]
SELECTED = """
import bmesh
[vertex.index for vertex in bmesh.from_edit_mesh(bpy.context.object.data).verts if vertex.select]
"""
LAST = "bpy.context.window_manager.operators[-1]"


def drop(gui):
    """Drop a file onto the view, and confirm."""
    gui.python(EGG)
    gui.point_at_view()
    gui.python(DROP)
    gui.settle()
    gui.shot("dropped")


LASERS = """
import laspy
for number, name in enumerate(("a.laz", "b.laz")):
    las = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
    las.xyz = sphere_points(2000)[number::2]
    las.write(os.path.join(bpy.app.tempdir, name))
"""


class TestDrop:
    """A file that is dropped onto the view; the drop itself is the call that Blender makes of it."""

    def test_laser_scans_become_one_object_by_choice(self, gui):
        gui.python(f"import os\n{LASERS}")
        gui.point_at_view()
        gui.python(DROP.replace('{"name": "Egg.xyz"}', '{"name": "a.laz"}, {"name": "b.laz"}'))
        gui.settle()
        gui.key("t")  # of Import Tiles in the menu, whose letter is underlined there
        gui.settle()
        gui.shot("tiles")
        gui.key("Return")
        gui.wait_until("'Tiles' in bpy.data.objects", 60)
        assert gui.python("[len(obj.data.vertices) for obj in bpy.data.objects]") == [2000]

    def test_closing(self, gui):
        drop(gui)
        gui.key("Escape")
        gui.settle()
        assert gui.python("bpy.data.objects.keys()") == []

    def test_four_clicks_from_an_empty_scene_to_a_colored_scan(self, gui):
        x, y, width, height = gui.region()
        middle = (x + 0.2 * width, y + 0.2 * height, 0.4 * width, 0.7 * height)
        gray = colored(gui.pixels(middle))
        drop(gui)  # 1
        gui.key("Return")  # 2, a click on OK
        gui.wait_until(IMPORTED, 60)
        finish(gui)
        assert gui.python("'lb_disc' in bpy.context.object.data.attributes")
        gui.open_tab()  # 3, after N
        gui.press("meshfree.analyze")  # 4
        gui.wait_until("'lb_area' in bpy.context.object.data.attributes", 90)
        gui.wait_for(lambda: colored(gui.pixels(middle)) > gray + 20000, "the points are colored", 240)


class TestTiles:
    """Several files as one object: the dialog, its end, and Esc while they are read."""

    @pytest.fixture
    def asked(self, gui, request):
        """Write two tiles of so many points, and open the dialog."""
        gui.python(
            f"""
import os
names = ["tile_1.npy", "tile_2.npy"]
for index, name in enumerate(names):
    np.save(os.path.join(bpy.app.tempdir, name), np.random.default_rng(index).uniform(size=({request.param}, 3)))
area, region, _ = view3d()
with bpy.context.temp_override(window=main_window(), area=area, region=region):
    files = {{"filepath": os.path.join(bpy.app.tempdir, names[0]), "directory": bpy.app.tempdir}}
    bpy.ops.meshfree.import_tiles("INVOKE_DEFAULT", files=[{{"name": name}} for name in names], count=1000, **files)
"""
        )
        gui.settle()
        gui.shot("tiles")
        return gui

    @pytest.mark.parametrize("asked", [20_000], indirect=True)
    def test_confirmed(self, asked):
        asked.key("Return")
        asked.wait_until("'tile' in bpy.data.objects", 60)
        finish(asked)
        assert 900 <= asked.python("len(bpy.data.objects['tile'].data.vertices)") <= 1000
        asked.point_at_view()
        asked.key("ctrl+z")
        asked.wait_until("'tile' not in bpy.data.objects")

    @pytest.mark.parametrize("asked", [3_000_000], indirect=True)
    def test_escape(self, asked):
        asked.key("Return")
        asked.wait_until(WORKING)
        asked.point_at_view()
        asked.key("Escape")
        finish(asked, 10)
        assert asked.python("bpy.data.objects.keys()") == []


class TestTasks:
    """The buttons below *Analyze Points*, which ask nothing."""

    @pytest.mark.parametrize(("task", "done"), TASKS.items(), ids=TASKS.keys())
    def test_one_click(self, gui, task, done):
        add_sphere(gui, 1500, 0.01)
        shading(gui, "WIREFRAME")
        gui.open_tab()
        assert not gui.python(done)
        gui.press(f"meshfree.{task}", across=0.35 if task.startswith("analyze") else 0.75)
        gui.wait_until(done, 90)
        finish(gui)
        gui.settle()
        gui.point_at_view()
        gui.key("ctrl+z")
        gui.wait_until(f"bpy.context.object.name == 'Cloud' and not ({done})")
        assert gui.python(UNCHANGED)


class TestSelection:
    """What is selected in Edit Mode is seen."""

    @pytest.mark.parametrize("shape", ["DISCS", "DOTS"])
    def test_selected_and_not(self, gui, shape):
        add_sphere(gui, 1500)
        gui.python(f"bpy.ops.meshfree.show_surface(); bpy.context.object.meshfree.point_shape = {shape!r}")
        gui.key("KP_1", "Home", "Tab", "a")
        gui.wait_until("bpy.context.object.mode == 'EDIT'")
        x, y, width, height = gui.region()
        middle = (x + 0.2 * width, y + 0.2 * height, 0.5 * width, 0.7 * height)

        def orange():
            red, green, blue = gui.pixels(middle).astype(int).transpose(2, 0, 1)
            return ((red > 220) & (green > 90) & (green < 190) & (blue < 90)).sum()

        gui.wait_for(lambda: orange() > 2000, "the points are orange")
        gui.key("alt+a")
        gui.wait_for(lambda: orange() < 200, "no point is orange")


class TestPicked:
    """Tools that begin at a point that one clicks."""

    def test_a_click_takes_the_point_in_front(self, gui):
        add_sphere(gui, 3000)
        gui.python("bpy.ops.meshfree.show_surface(); bpy.ops.ed.undo_push(message='Surface')")
        gui.key("KP_1", "Home", "Tab", "alt+a")
        gui.wait_until("bpy.context.object.mode == 'EDIT'")
        for x, z in ((0.0, 0.0), (0.4, 0.3), (-0.5, 0.2), (-0.2, -0.6), (0.3, -0.4)):
            gui.click(*gui.python(f"on_screen(({x}, -1.0, {z}))"))
            gui.settle()
            (picked,) = gui.python(SELECTED)
            place = gui.python(f"points[{picked}]")
            assert place[1] < -0.3
            assert abs(place[0] - x) + abs(place[2] - z) < 0.2
        # Seen through, where Blender takes the nearest on the screen.
        gui.python("view3d()[0].spaces.active.shading.type = 'SOLID'")
        gui.python("view3d()[0].spaces.active.shading.show_xray = True")
        behind = gui.python("next(i for i in np.argsort(-points[:, 1]) if np.hypot(*points[i, [0, 2]]) < 0.5)")
        gui.click(*gui.python(f"on_screen(points[{behind}])"))
        assert gui.python(SELECTED) == [behind]

    @pytest.mark.parametrize(("name", "attribute", "there"), PICKED)
    def test_a_clicked_point_is_the_source(self, gui, name, attribute, there):
        add_sphere(gui, 1500)
        shading(gui, "WIREFRAME")
        gui.key("KP_1", "Home", "Tab", "alt+a")
        gui.wait_until("bpy.context.object.mode == 'EDIT'")
        nearest = gui.python("points[:, 1].argmin()")
        gui.click(*gui.python(f"on_screen(points[{nearest}])"))
        gui.settle()
        (picked,) = gui.python(SELECTED)
        gui.shot("picked")
        gui.point_at_view()
        gui.key("Tab")
        gui.wait_until("bpy.context.object.mode == 'OBJECT'")
        gui.search(name)
        gui.key("Return")
        gui.wait_until(f"{attribute!r} in bpy.context.object.data.attributes", 90)
        finish(gui)
        assert gui.python(f"attribute(bpy.context.object, {attribute!r})[{picked}]") == pytest.approx(there, abs=0.2)


class TestAdjusting:
    """The panel *Adjust Last Operation* in the lower left corner of the view."""

    def test_flip_the_normals(self, gui):
        add_sphere(gui, 1500)
        shading(gui, "WIREFRAME")
        gui.search("Mesh-Free Orient Normals")
        gui.key("Return")
        gui.wait_until("'lb_normal' in bpy.context.object.data.attributes", 90)
        finish(gui)
        gui.settle()
        outwards = "(attribute(bpy.context.object, 'lb_normal') * points).sum(axis=1).mean()"
        assert gui.python(outwards) > 0.9
        x, y, width, height = gui.region("HUD")
        gui.click(x + 20, y + height - 18)  # its title opens it
        gui.wait_for(lambda: gui.region("HUD")[3] > height + 20, "the panel is open")
        x, y, width, height = gui.region("HUD")
        gui.shot("adjust_last_operation")
        for place in range(round(y) + 30, round(y + height), 10):
            gui.click(x + 0.45 * width, place)
            if gui.python(f"{LAST}.properties.flip"):
                break
        gui.wait_until(f"{outwards} < -0.9")
        finish(gui)
        assert gui.python(f"{LAST}.name") == "Orient Normals"
        gui.point_at_view()
        gui.key("ctrl+z")
        gui.wait_until("'lb_normal' not in bpy.context.object.data.attributes")
        assert gui.python("everything(bpy.context.object) == before")
