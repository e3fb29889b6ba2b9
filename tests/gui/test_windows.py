"""Bound objects and long work in several windows, while it renders, and right after a file was opened."""

import pytest

from tests.gui.test_play import ANALYZED, MOVED, UNCHANGED, WORKING, add_sphere, finish, start

WINDOWS = "bpy.context.window_manager.windows"
HEARING = f"[[operator.bl_idname for operator in window.modal_operators] for window in {WINDOWS}]"
BOUND = """
obj = bpy.data.objects["Cloud"]
for name, sign in (("Handle", 1.0), ("Anchor", -1.0)):
    add_group(obj, name, sign * local_points(obj)[:, 2] > 0.8)
bpy.ops.meshfree.deform_bind()
handle = bpy.data.objects["Cloud Handle"]
bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
"""
ANIMATED = """
for frame, height in ((1, 0.0), (6, 0.5), (12, -0.3)):
    handle.location.z = 0.9 + height
    handle.keyframe_insert("location", frame=frame)
bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 12
bpy.context.scene.frame_set(1)
bpy.ops.ed.undo_push(message="Animated")
"""
# What a render has seen of the points at each frame.
LOOKING = """
seen, finished = {}, []

def places(depsgraph):
    mesh = bpy.data.objects["Cloud"].evaluated_get(depsgraph).data
    found = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", found.reshape(-1))
    return found

class Look(bpy.types.RenderEngine):
    bl_idname, bl_label = "LOOK", "Look"

    def update(self, data, depsgraph):
        seen[depsgraph.scene.frame_current] = places(depsgraph)

    def render(self, depsgraph):
        pass

bpy.utils.register_class(Look)
scene = bpy.context.scene
scene.render.engine, scene.render.filepath = "LOOK", bpy.app.tempdir + "look"
scene.render.resolution_x = scene.render.resolution_y = 8
scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
scene.collection.objects.link(scene.camera)
bpy.context.preferences.view.render_display_type = "NONE"
bpy.app.handlers.render_complete.append(lambda *_: finished.append(True))
"""
SHOWN = """
shown = {}
for frame in range(1, 13):
    bpy.context.scene.frame_set(frame)
    shown[frame] = places(bpy.context.evaluated_depsgraph_get())
bpy.context.scene.frame_set(1)
max(np.ptp([points[:, 2].max() for points in shown.values()]), 0.0)
"""
ROOT = "sys.modules[next(name for name in sys.modules if name.endswith('meshfree_laplacian'))].__package__"
PART = f"""
import importlib, os, sys

def part(name):
    return importlib.import_module({ROOT} + "." + name)

live, job = part("operators.deform.live"), part("operators.running.job")
"""
EXACT = "bpy.data.objects['Cloud'].data['lb_pose'][0] == 1"
RESTING = "all(followed.thread is None for followed in live._followed.values())"
BINDING = "job.running() is not None and job.running().label == 'Bind'"


@pytest.fixture
def bound(gui):
    """Points that are bound, with the handle as the active object, in the only window."""
    add_sphere(gui)
    gui.python(PART + BOUND)
    yield gui
    if len(gui.python(HEARING)) == 2:
        gui.close_second()


@pytest.fixture
def opened(gui):
    """An animated file right after it was opened, whose factors take some seconds."""
    gui.python(PART + "path = bpy.app.tempdir + 'opened.blend'")
    if not gui.python("os.path.exists(path)"):  # else a test before has made it
        add_sphere(gui, 12000, 0.005)
        gui.python(BOUND + ANIMATED)
        gui.python("bpy.ops.wm.save_as_mainfile(filepath=path)")
        gui.new_file()
    gui.python("bpy.ops.wm.open_mainfile(filepath=path)")
    gui.wait_until(f"bpy.data.filepath and bool({WINDOWS})")
    gui.settle()
    gui.point_at_view()
    return gui


class TestDrag:
    """A handle that is dragged, with a rest in which the exact result is begun to be prepared."""

    def test_esc_ends_the_drag(self, gui):
        add_sphere(gui, 20000)  # too many to be solved for at each move
        gui.python(PART)
        gui.python("view3d()[0].spaces.active.shading.type = 'WIREFRAME'")
        gui.open_tab()
        gui.press("meshfree.deform_bind", across=0.75)
        gui.wait_until("bpy.context.object.name == 'Cloud Handle'", 90)
        finish(gui)
        place = gui.python("[list(row) for row in bpy.context.object.matrix_world]")
        gui.point_at_view()
        gui.key("g")
        x, y = gui.view_center()
        gui.move(x + 60, y - 60)
        gui.wait_until(f"{MOVED} > 0.05")
        gui.wait_until(BINDING)
        gui.key("Escape")
        assert gui.python(WORKING) == []
        assert gui.python("[list(row) for row in bpy.context.object.matrix_world]") == place
        gui.wait_until(f"{MOVED} == 0.0")
        gui.wait_until(RESTING)
        assert gui.python(MOVED) == 0.0


class TestTwoWindows:
    """What is done in one window is seen in the other, and ends with neither."""

    def test_a_handle_that_is_moved_in_the_other_window(self, bound):
        bound.python("handle.select_set(True); bpy.context.view_layer.objects.active = handle")
        bound.python("bpy.data.objects['Cloud'].select_set(False)")
        bound.open_second()
        bound.point_at_second()
        bound.key("g", "z", "1")
        bound.wait_until(f"{MOVED} > 0.9")
        bound.shot("two_windows")
        bound.key("Return")
        bound.wait_until(f"{MOVED} == 1.0")
        bound.wait_until(RESTING)
        bound.point_at_first()
        bound.key("g", "z", "1", "Return")
        bound.wait_until(f"{MOVED} == 2.0")
        bound.close_second()
        bound.key("ctrl+z")
        bound.wait_until(f"{MOVED} == 1.0")
        bound.key("g", "z", "minus", "1", "Return")
        bound.wait_until(f"{MOVED} == 0.0")

    @pytest.mark.parametrize("order", ["opened before", "opened while it works"])
    def test_escape_in_the_other_window(self, gui, order):
        add_sphere(gui, 60000, 0.005)  # which takes longer than a window to open
        if order == "opened before":
            gui.open_second()
            start(gui, "Smooth Points")
        else:
            start(gui, "Smooth Points")
            gui.open_second()
        gui.wait_until(f"any('MESHFREE_OT_smooth' in names for names in {HEARING})")
        gui.shot("work_in_two_windows")
        gui.point_at_second()
        gui.key("Escape")
        finish(gui, 5)
        gui.wait_until(f"not any({HEARING})", 5)
        assert gui.python(UNCHANGED)
        gui.close_second()

    def test_closing_the_window_where_it_began(self, gui):
        add_sphere(gui, 20000, 0.005)
        gui.open_second()
        gui.point_at_second()
        gui.key("F3")
        gui.type("Analyze Points")
        gui.key("Return")
        gui.wait_until(f"'MESHFREE_OT_analyze' in {HEARING}[1]")
        gui.close_second()
        gui.wait_until(f"not any({HEARING})", 5)
        assert not gui.python(ANALYZED)
        assert gui.python(UNCHANGED)


class TestRender:
    """A render from the window shows the frames of the 3D view."""

    def test_animation(self, bound):
        bound.python(ANIMATED + LOOKING)
        assert bound.python(SHOWN) > 0.5
        bound.key("ctrl+F12")
        bound.wait_until("finished", 90)
        assert bound.python("sorted(seen)") == list(range(1, 13))
        assert bound.python("max(np.abs(seen[frame] - shown[frame]).max() for frame in shown)") < 1e-5

    def test_right_after_opening(self, opened):
        opened.python(LOOKING)
        opened.python("bpy.context.scene.frame_end = 3")
        opened.key("ctrl+F12")
        opened.wait_until("finished", 120)
        opened.python(SHOWN)
        assert opened.python("sorted(seen)") == [1, 2, 3]
        assert opened.python("max(np.abs(seen[frame] - shown[frame]).max() for frame in seen)") < 1e-5

    def test_a_picture_while_it_binds(self, opened):
        opened.python(LOOKING)
        opened.key("shift+Right")  # to the last frame
        opened.wait_until(BINDING)
        opened.key("F12")
        opened.wait_until("finished", 120)
        assert opened.python("seen[12][:, 2].max()") == pytest.approx(0.7, abs=0.05)
        opened.wait_until(RESTING, 60)
        opened.move(300, 300)  # Blender's own operator ends with the next event after the render
        finish(opened)
        assert opened.python("np.abs(places(bpy.context.evaluated_depsgraph_get()) - seen[12]).max()") < 1e-5


class TestOpenedFile:
    """The first jump to another frame binds beside the window."""

    def test_a_jump(self, opened):
        opened.python(LOOKING)
        opened.open_tab()
        opened.point_at_view()
        opened.key("shift+Right")
        opened.wait_until(BINDING)
        opened.shot("binding")
        assert opened.python("live.state(bpy.data.objects['Cloud'])[0].name == 'PREPARING'")
        assert opened.python(MOVED) < 0.01
        opened.wait_until(f"{MOVED} > 0.25", 60)
        assert opened.python(MOVED) == pytest.approx(0.3, abs=0.01)
        opened.wait_until(f"{RESTING} and not {WORKING}")
        assert opened.python("job.running() is None")

    def test_escape(self, opened):
        opened.key("shift+Right")
        opened.wait_until(BINDING)
        opened.key("Escape")
        opened.wait_until("job.running() is None", 5)
        finish(opened, 5)
        assert opened.python(MOVED) < 0.01
        assert "Press Update" in opened.python("live.state(bpy.data.objects['Cloud'])[1]")
        opened.search("Mesh-Free Update")
        opened.wait_until(f"{MOVED} > 0.25", 60)
        assert opened.python("live.state(bpy.data.objects['Cloud'])[1]") == ""


class TestApply:
    """Apply asks before keyframes of handles are lost."""

    PRESS = """
area, region, _ = view3d()
with bpy.context.temp_override(window=main_window(), area=area, region=region):
    bpy.ops.meshfree.deform_apply("INVOKE_DEFAULT")
"""
    SAME = "everything(bpy.data.objects['Cloud']) == pose and handle.animation_data is not None"

    def test_esc_and_return(self, bound):
        bound.python(ANIMATED)
        bound.python("bpy.context.scene.frame_set(6)")
        bound.wait_until(f"{RESTING} and {EXACT} and {MOVED} > 0.4")
        bound.python("bpy.ops.ed.undo_push(message='Pose'); pose = everything(bpy.data.objects['Cloud'])")
        bound.point_at_view()
        bound.python(self.PRESS)
        bound.settle()
        bound.shot("apply_asks")
        bound.key("Escape")
        assert bound.python(self.SAME)
        bound.point_at_view()
        bound.python(self.PRESS)
        bound.key("Return")
        bound.wait_until("handle.animation_data is None")
        assert bound.python(MOVED) == 0.0
        bound.key("Right")  # the next frame
        bound.wait_until("bpy.context.scene.frame_current == 7")
        assert bound.python(MOVED) == 0.0


class TestBake:
    """A bake works beside the window as other work does."""

    @pytest.fixture
    def baking(self, bound):
        bound.python(ANIMATED)
        bound.python("bpy.context.scene.frame_end = 2000")
        bound.python("bpy.context.scene.frame_set(4)")
        bound.python("handle.location.x = 0.25")  # without a keyframe
        bound.python("bpy.context.view_layer.update()")
        bound.wait_until(f"{RESTING} and {EXACT} and {MOVED} > 0.2")
        bound.settle()
        bound.python("before, place = everything(bpy.data.objects['Cloud']), list(handle.matrix_basis)")
        bound.python("bent = attribute(bpy.data.objects['Cloud'], 'lb_displacement')")
        start(bound, "Mesh-Free Bake")
        bound.wait_until("bpy.context.scene.frame_current > 15")
        return bound

    def same(self, gui):
        assert gui.python("bpy.context.scene.frame_current") == 4
        assert gui.python("list(handle.matrix_basis) == place")
        assert gui.python("(attribute(bpy.data.objects['Cloud'], 'lb_displacement') == bent).all()")
        assert gui.python(UNCHANGED)

    def test_escape(self, baking):
        baking.shot("baking")
        baking.key("Escape")
        finish(baking, 5)
        self.same(baking)
        baking.settle()
        self.same(baking)  # nothing follows later

    def test_undo(self, baking):
        baking.key("ctrl+z")
        finish(baking, 5)
        baking.wait_until("job.running() is None")
        assert baking.python("bpy.context.scene.frame_current") == 4
        assert not baking.python("'Cloud Bake' in bpy.data.objects")

    def test_a_handle_that_is_moved_meanwhile(self, baking):
        baking.python("handle.location.y = 0.5")
        finish(baking, 5)
        assert not baking.python("'Cloud Bake' in bpy.data.objects")

    def test_to_the_end(self, bound):
        bound.python(ANIMATED + LOOKING + SHOWN)
        start(bound, "Mesh-Free Bake")
        finish(bound)
        assert bound.python("'Cloud Bake' in bpy.data.objects")
        bound.python("seen = shown")
        bound.python(SHOWN)
        assert bound.python("max(np.abs(seen[frame] - shown[frame]).max() for frame in shown)") < 1e-5
        bound.point_at_view()
        bound.key("ctrl+z")
        bound.wait_until("'Cloud Bake' not in bpy.data.objects")
