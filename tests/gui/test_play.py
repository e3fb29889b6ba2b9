"""What an artist does, with real keys and a real mouse."""

import numpy as np
import pytest

from tests.results import RESULTS

ANALYZED = "'lb_area' in bpy.context.object.data.attributes"
WORKING = "[operator.bl_idname for operator in main_window().modal_operators]"
UNCHANGED = "everything(bpy.data.objects['Cloud']) == before"

HEIGHTS = """
members = {group.name: [] for group in bpy.context.object.vertex_groups}
for vertex in bpy.context.object.data.vertices:
    for item in vertex.groups:
        members[bpy.context.object.vertex_groups[item.group].name].append(vertex.co.z)
[(min(members[name]), max(members[name])) for name in ("Handle", "Anchor")]
"""
MOVED = "np.linalg.norm(attribute(bpy.data.objects['Cloud'], 'lb_displacement'), axis=1).max().round(3)"
EXACT = "bpy.context.object.rotation_euler.y > 0.5 and bpy.data.objects['Cloud'].data['lb_pose'][0] == 1"
RENDERING = """
bpy.context.view_layer.objects.active = bpy.data.objects["Cloud"]
bpy.ops.meshfree.colormap(attribute="lb_displacement", switch_shading=False)
scene = bpy.context.scene
scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 320, 240, 100
scene.view_settings.view_transform = "Standard"
scene.world = scene.world or bpy.data.worlds.new("World")
bpy.context.preferences.view.render_display_type = "AREA"
data = bpy.data.cameras.new("Camera")
data.type, data.ortho_scale = "ORTHO", 6.0
scene.camera = bpy.data.objects.new("Camera", data)
scene.collection.objects.link(scene.camera)
scene.camera.location, scene.camera.rotation_euler = (0.0, -10.0, 0.0), (np.pi / 2, 0.0, 0.0)
rendered = []
bpy.app.handlers.render_complete.append(lambda *_: rendered.append(True))
"""
COLORED_COLUMNS = """
image = bpy.data.images.load(bpy.app.tempdir + "bent.png")
pixels = np.array(image.pixels).reshape(240, 320, 4)[:, :, :3]
(np.ptp(pixels, axis=2) > 0.15).sum(axis=0)
"""


def add_sphere(gui, count=3000, noise=0.0):
    """Add a selected cloud on a sphere, as a step that one can undo to."""
    gui.python(
        f"""
points = sphere_points({count})
points *= 1.0 + {noise} * np.random.default_rng(1).standard_normal((len(points), 1))
add_object(points).select_set(True)
bpy.ops.ed.undo_push(message="Cloud")
before = everything(bpy.context.object)
"""
    )


def start(gui, name):
    """Start an operator by the search, confirm its dialog, and see it work."""
    gui.search(name)
    gui.key("Return")
    gui.wait_until(WORKING)


def finish(gui, seconds=90):
    """Wait until no operator works."""
    gui.wait_until(f"not {WORKING}", seconds)


def shading(gui, kind):
    gui.python(f"view3d()[0].spaces.active.shading.type = {kind!r}")


def colored(pixels):
    """Count the pixels that are not gray."""
    return np.count_nonzero(np.ptp(pixels.astype(int), axis=2) > 40)


class TestAnalysis:
    """From a cloud to colors and back."""

    def test_analyze(self, gui):
        add_sphere(gui)
        shading(gui, "WIREFRAME")  # without shaders to compile
        gui.open_tab()
        gui.press("meshfree.analyze")
        gui.wait_until(ANALYZED, 60)
        assert gui.python("attribute(bpy.context.object, 'lb_area').sum()") == pytest.approx(12.566, rel=5e-3)
        gui.shot("analyzed")
        gui.point_at_view()
        gui.key("ctrl+z")
        gui.wait_until(f"not {ANALYZED}")
        assert gui.python(UNCHANGED)
        gui.key("ctrl+shift+z")
        gui.wait_until(ANALYZED)
        assert gui.python("result_names(bpy.context.object)") == sorted(RESULTS)

    def test_colors_after_four_clicks(self, gui):
        add_sphere(gui)
        x, y, width, height = gui.region()
        middle = (x + 0.2 * width, y + 0.2 * height, 0.5 * width, 0.7 * height)
        gui.key("Home")
        gray = colored(gui.pixels(middle))
        gui.open_tab()  # a key and a click
        gui.press("meshfree.analyze")  # a click
        gui.wait_until(ANALYZED, 60)
        gui.settle()
        shading = "view3d()[0].spaces.active.shading"
        assert gui.python(f"{shading}.type, {shading}.color_type") == ["SOLID", "VERTEX"]  # without a graphics card
        gui.wait_for(lambda: colored(gui.pixels(middle)) > gray + 20000, "the points are colored", 240)

    def test_where_there_is_no_material_preview(self, gui):
        add_sphere(gui)
        gui.python("bpy.context.scene.render.engine = 'BLENDER_WORKBENCH'")
        gui.open_tab()
        gui.press("meshfree.analyze")
        gui.wait_until(ANALYZED, 60)
        assert gui.python("view3d()[0].spaces.active.shading.type") == "SOLID"


class TestJobs:
    """Work that goes on while the window stays alive, and what ends it."""

    @pytest.fixture
    def job(self, gui, request):
        add_sphere(gui, 40_000, 0.005)
        gui.python("bpy.ops.wm.save_as_mainfile(filepath=bpy.app.tempdir + 'job.blend')")
        start(gui, getattr(request, "param", "Analyze Points"))
        return gui

    @pytest.mark.parametrize("job", ["Analyze Points", "Smooth Points"], indirect=True)
    def test_escape(self, job):
        job.shot("working")
        job.key("Escape")
        finish(job, 5)
        assert job.python(UNCHANGED)

    def test_keys_of_what_runs_beside_it(self, job):
        """The first Esc ends the drag that began meanwhile, the second one the work."""
        place = job.python("list(bpy.context.object.location)")
        job.point_at_view()
        job.key("g")
        x, y = job.view_center()
        job.move(x + 90, y + 40)
        assert job.python("list(bpy.context.object.location)") != place
        job.key("Escape")
        assert job.python("list(bpy.context.object.location)") == place
        assert job.python(WORKING) == ["MESHFREE_OT_analyze"]
        job.key("Escape")
        finish(job, 5)
        assert job.python(UNCHANGED)

    def test_undo_takes_back_what_was_before(self, job):
        job.key("ctrl+z")
        finish(job, 5)
        assert job.python("bpy.data.objects.keys()") == []
        job.key("ctrl+shift+z")
        job.wait_until("bpy.data.objects.keys() == ['Cloud']")
        assert job.python(UNCHANGED)

    def test_delete(self, job):
        job.key("Delete")
        finish(job, 5)
        assert job.python("bpy.data.objects.keys()") == []

    def test_new_file(self, job):
        job.key("ctrl+n", "Return")
        job.wait_until("not bpy.data.filepath")
        finish(job, 5)
        assert job.python("bpy.data.objects.keys()") == ["Camera", "Cube", "Light"]

    @pytest.mark.parametrize("name", ["Smooth Points", "Export Points"])
    def test_closing_the_dialog(self, gui, name):
        add_sphere(gui, 500)
        gui.search(name)
        gui.key("Escape")  # no error in Python is seen, says the fixture
        gui.wait_until(f"not {WORKING}")
        assert gui.python(UNCHANGED)

    def test_orbit_while_it_works(self, gui):
        add_sphere(gui, 8000)
        start(gui, "Smooth Points")
        view = "[list(row) for row in view3d()[0].spaces.active.region_3d.view_matrix]"
        before = gui.python(view)
        x, y = gui.view_center()
        gui.drag((x, y), (x + 100, y + 30), button="middle")
        gui.wait_for(lambda: gui.python(view) != before, "the view has turned")
        finish(gui)
        assert gui.python("bpy.context.object.data.shape_keys.key_blocks.keys()") == ["Basis", "Smooth"]


class TestDeformation:
    """From points to a bent cloud in a picture."""

    def box(self, gui, low, high):
        """Select the points between two heights by Box Select."""
        corners = [gui.python(f"on_screen(({x}, 0.0, {z}))") for x, z in ((-1.2, low), (1.2, high))]
        gui.point_at_view()
        gui.key("alt+a", "b")
        gui.drag(*corners)

    def test_bind_move_update_save_and_render(self, gui):
        add_sphere(gui)
        gui.key("KP_1", "Home", "Tab")
        gui.wait_until("bpy.context.object.mode == 'EDIT'")
        self.box(gui, 0.8, 1.1)
        gui.shot("selected")
        gui.search("Mesh-Free Handle")
        self.box(gui, -1.1, -0.8)
        gui.search("Mesh-Free Anchor")
        gui.key("Tab")
        gui.wait_until("bpy.context.object.mode == 'OBJECT'")
        [(low, high), (lowest, highest)] = gui.python(HEIGHTS)
        assert (low, high) == pytest.approx((0.8, 1.0), abs=0.02)
        assert (lowest, highest) == pytest.approx((-1.0, -0.8), abs=0.02)

        gui.search("Mesh-Free Bind")
        gui.wait_until("'Cloud Handle' in bpy.data.objects", 60)
        finish(gui)
        gui.click(*gui.python("on_screen(bpy.data.objects['Cloud Handle'].matrix_world.translation)"))
        gui.wait_until("bpy.context.object.name == 'Cloud Handle'")
        gui.key("g", "x", "1")
        gui.wait_until(f"{MOVED} > 0.9")
        gui.shot("handle_on_its_way")
        gui.key("Return")
        finish(gui)
        gui.wait_until(f"{MOVED} > 0.9")
        assert gui.python(MOVED) == pytest.approx(1.0, abs=0.02)
        gui.key("ctrl+z")
        gui.wait_until(f"{MOVED} == 0.0")
        gui.key("ctrl+shift+z")
        gui.wait_until(f"{MOVED} > 0.9")

        gui.python("bpy.ops.wm.save_as_mainfile(filepath=bpy.app.tempdir + 'bent.blend')")
        gui.key("r", "y", "3", "0", "Return")
        bent = "attribute(bpy.data.objects['Cloud'], 'lb_displacement').round(3)"
        gui.wait_until(EXACT)
        gui.key("ctrl+s")
        gui.wait_until("not bpy.data.is_dirty")
        gui.python(f"saved = {bent}")
        gui.new_file()
        gui.key("ctrl+shift+o", "Return")
        gui.wait_until("bpy.data.filepath.endswith('bent.blend')")
        gui.settle()
        gui.shot("opened_again")
        assert gui.python(f"(saved == {bent}).all()")
        gui.click(*gui.python("on_screen(bpy.data.objects['Cloud Handle'].matrix_world.translation)"))
        gui.key("g", "x", "1", "Return")
        gui.wait_until(f"{MOVED} > 1.8", 60)

        gui.python(RENDERING)
        gui.settle()
        gui.point_at_view()
        gui.key("F12")
        gui.wait_until("rendered", 90)
        gui.shot("rendered")
        gui.python("bpy.data.images['Render Result'].save_render(bpy.app.tempdir + 'bent.png')")
        columns = gui.python(COLORED_COLUMNS)
        assert sum(columns) > 2000
        assert np.average(np.arange(320), weights=columns) > 180  # to the right, where the handle went
