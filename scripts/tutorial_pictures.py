"""Play docs/tutorial.md in the window and renew its sample and its pictures.

Use it by `python scripts/play.py scripts/tutorial_pictures.py`. It writes docs/coral.ply and
docs/pictures/tutorial_*.png.
"""

from environments import ROOT

DOCS = ROOT / "docs"
POINTS = 10000
SAMPLE = """
mesh = bpy.data.meshes.new("Coral")
points = Coral().sample({count}).astype(np.float32)
mesh.vertices.add(len(points))
mesh.vertices.foreach_set("co", points.reshape(-1))
obj = bpy.data.objects.new("Coral", mesh)
bpy.context.scene.collection.objects.link(obj)
bpy.context.view_layer.objects.active = obj
bpy.ops.meshfree.export_points(filepath={path!r}, attributes="NONE")
"""
BROWSER = "next((area for area in main_window().screen.areas if area.type == 'FILE_BROWSER'), None)"
CHOOSE = """
params = {browser}.spaces.active.params
params.directory, params.filename = bpy.app.tempdir.encode(), "coral.ply"
"""
WORKING = "len(main_window().modal_operators)"
CORAL = "bpy.data.objects['coral']"
HANDLE = "bpy.data.objects['coral Handle']"
MOVED = f"np.linalg.norm(attribute({CORAL}, 'lb_displacement'), axis=1).max()"
RENDERING = """
from mathutils import Euler
scene = bpy.context.scene
scene.render.engine, scene.cycles.samples = "CYCLES", 32
scene.cycles.use_denoising = False  # Debian's Blender cannot
scene.render.resolution_x, scene.render.resolution_y = 960, 600
bpy.context.preferences.view.render_display_type = "AREA"
view = view3d()[0].spaces.active.region_3d
view.view_perspective, view.view_distance = "PERSP", 1.8 * view.view_distance
view.view_rotation = Euler((1.25, 0.0, 0.3)).to_quaternion()
rendered = []
bpy.app.handlers.render_complete.append(lambda *_: rendered.append(True))
"""


def keep(gui, name, crop=None):
    """Keep a picture for the tutorial."""
    path = DOCS / "pictures" / f"tutorial_{name}.png"
    gui.pack(gui.shot(path.stem, crop), path)
    print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1e3:.0f} kB", flush=True)


def write_sample(gui):
    """Write the points that the tutorial begins with."""
    gui.new_file()
    path = gui.python("bpy.app.tempdir + 'coral.ply'")
    gui.python((ROOT / "scripts" / "coral.py").read_text(encoding="utf-8"))
    gui.python(SAMPLE.format(count=POINTS, path=path))
    (DOCS / "coral.ply").write_bytes(gui.place.root.joinpath(path.lstrip("/")).read_bytes())


def import_sample(gui):
    """Step 1: the points in a new file, and the tab."""
    gui.open_panels("MESHFREE_PT_points", "MESHFREE_PT_deform", "MESHFREE_PT_display")
    gui.new_file()
    gui.python("bpy.ops.wm.read_homefile(use_factory_startup=True)")
    gui.python("bpy.context.scene.eevee.taa_samples = 1")
    gui.python("bpy.context.preferences.view.filebrowser_display_type = 'SCREEN'")
    gui.settle()
    gui.point_at_view()
    gui.key("Delete")  # the cube
    gui.wait_until("'Cube' not in bpy.data.objects")
    gui.search("Import Points")
    gui.wait_until(f"{BROWSER} is not None")
    gui.settle()
    gui.python(CHOOSE.format(browser=BROWSER))
    gui.settle()
    gui.key("Return")
    gui.wait_until("'coral' in bpy.data.objects")
    gui.open_tab()
    keep(gui, "import")


def analyze(gui):
    """Step 2: colors."""
    gui.press("meshfree.analyze")
    gui.wait_until(f"'lb_area' in {CORAL}.data.attributes and not {WORKING}", 120)
    gui.point_at_view()
    keep(gui, "colors")


def box(gui, *corners):
    """Select the points between two corners, each x and z."""
    corners = [gui.python(f"on_screen(({x}, 0.0, {z}))") for x, z in corners]
    gui.point_at_view()
    gui.key("alt+a", "b")
    gui.drag(*corners)


def choose(gui):
    """Step 3: groups."""
    gui.point_at_view()
    gui.key("KP_1", "Tab")
    gui.wait_until(f"{CORAL}.mode == 'EDIT'")
    gui.python("view3d()[0].spaces.active.region_3d.view_location = (0.9, 0.0, 0.0)")
    box(gui, (0.2, -1.7), (1.9, 1.6))
    gui.press("meshfree.group_from_selection(role='ANCHOR'")
    box(gui, (-2.0, -1.3), (-1.3, 0.0))
    gui.press("meshfree.group_from_selection(role='HANDLE'")
    gui.python(f"{CORAL}.meshfree.show_groups = True")
    gui.point_at_view()
    keep(gui, "groups")
    gui.key("Tab")
    gui.wait_until(f"{CORAL}.mode == 'OBJECT'")
    gui.python(f"{CORAL}.meshfree.show_groups = False")


def scroll(gui, steps):
    """Scroll the sidebar down."""
    x, y, width, height = gui.region("UI")
    for _ in range(abs(steps)):
        gui.click(x + 0.4 * width, y + 0.5 * height, "wheel down" if steps > 0 else "wheel up")


def bend(gui):
    """Step 4: bind, move and turn."""
    scroll(gui, 12)
    gui.press("meshfree.deform_bind")
    gui.wait_until("'coral Handle' in bpy.data.objects", 120)
    gui.wait_until(f"not {WORKING}")
    gui.click(*gui.python(f"on_screen({HANDLE}.matrix_world.translation)"))
    gui.wait_until("bpy.context.object.name == 'coral Handle'")
    gui.point_at_view()
    gui.key("g", "z", "1", "Return")
    gui.wait_until(f"{MOVED} > 0.9")
    gui.key("r", "y", "6", "0", "Return")
    gui.wait_until(f"{CORAL}.data['lb_pose'][0] == 1.0")
    gui.settle()
    keep(gui, "bent")


def color(gui):
    """Step 5: how far the points went, and what the bent shape is like."""
    gui.click(*gui.python("on_screen((0.0, 0.0, 0.3))"))
    gui.wait_until("bpy.context.object.name == 'coral'")
    scroll(gui, 40)
    gui.press('meshfree.colormap(attribute="lb_displacement"')
    gui.point_at_view()
    keep(gui, "display")
    scroll(gui, -15)
    gui.press("meshfree.deform_apply")
    gui.wait_until(f"{MOVED} == 0.0")
    scroll(gui, -40)
    gui.press("meshfree.analyze")
    gui.wait_until(WORKING)
    gui.wait_until(f"not {WORKING}", 120)
    scroll(gui, 40)
    scroll(gui, -3)  # back to the names of results, above the end
    gui.press('meshfree.colormap(attribute="lb_mean_curvature"')


def render(gui):
    """Step 6: a picture by the camera."""
    gui.python(RENDERING)
    gui.point_at_view()
    gui.key("ctrl+alt+KP_0")
    gui.python("bpy.context.scene.view_settings.view_transform = 'Standard'")
    scroll(gui, 40)
    gui.press("meshfree.legend")
    gui.point_at_view()
    gui.key("F12")
    gui.wait_until("rendered", 240)
    gui.python("bpy.data.images['Render Result'].save_render(bpy.app.tempdir + 'result.png')")
    path = gui.place.root / gui.python("bpy.app.tempdir + 'result.png'").lstrip("/")
    target = DOCS / "pictures" / "tutorial_result.png"
    gui.pack(path, target)
    print(f"{target.relative_to(ROOT)}: {target.stat().st_size / 1e3:.0f} kB", flush=True)


def main(gui):
    """Play all steps."""
    for step in (write_sample, import_sample, analyze, choose, bend, color, render):
        step(gui)


if __name__ == "__main__":
    main(gui)  # noqa: F821, scripts/play.py gives the window
