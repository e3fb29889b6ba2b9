"""Renew the pictures of the window in docs/pictures/: python scripts/play.py scripts/window_pictures.py [NAME ...]."""

import sys

from environments import ROOT

PICTURES = ROOT / "docs" / "pictures"
POINTS = 20000
CORAL = """
from mathutils import Euler
points = Coral().sample({count})
mesh = bpy.data.meshes.new("Coral")
mesh.vertices.add(len(points))
mesh.vertices.foreach_set("co", points.astype(np.float32).reshape(-1))
mesh.update()
thing = bpy.data.objects.new("Coral", mesh)
bpy.context.scene.collection.objects.link(thing)
bpy.context.view_layer.objects.active = thing
thing.select_set(True)
bpy.ops.ed.undo_push(message="Coral")
view = view3d()[0].spaces.active
view.region_3d.view_rotation = Euler((1.25, 0.0, 0.45)).to_quaternion()
view.region_3d.view_distance, view.region_3d.view_location = 8.0, (0.75, 0.0, 0.0)
view.shading.use_scene_world = False
"""
SPLATS = """
import importlib
from pathlib import Path
from tempfile import TemporaryDirectory
from mathutils import Euler
core = importlib.import_module("bl_ext.user_default.meshfree_laplacian.core")
ellipsoids = importlib.import_module(core.__name__ + ".splats.ellipsoids")
frames = importlib.import_module(core.__name__ + ".geometry.quadrics").frames
points = Coral().sample(8000)
laplacian = core.build_laplacian(points)
axes = ellipsoids.quaternions_of(np.moveaxis(frames(laplacian.normals)[:, :, ::-1], 0, 2))  # tangents and normal
size = np.sqrt(laplacian.areas)[:, None] * [0.6, 0.6, 0.05]
colors = 1.6 * np.sin(points @ np.array([[2.0, 1.0, 0.0], [0.0, 2.0, 1.0], [1.0, 0.0, 2.0]]))
given = core.splats.Splats(points, size, axes, np.full(len(points), 0.95), colors, np.zeros((len(points), 0, 3)))
with TemporaryDirectory() as folder:
    core.splats.write_splats(Path(folder) / "Coral.ply", given)
    bpy.ops.meshfree.import_points(filepath=str(Path(folder) / "Coral.ply"), up="Z")
view = view3d()[0].spaces.active
view.region_3d.view_rotation = Euler((1.35, 0.0, 0.3)).to_quaternion()
view.region_3d.view_distance, view.region_3d.view_location = 8.5, (0.75, 0.0, 0.0)
view.shading.type = "MATERIAL"
"""
FRONT = """
view.region_3d.view_rotation = Euler((np.pi / 2, 0.0, 0.0)).to_quaternion()
view.region_3d.view_perspective = "ORTHO"
"""
SURFACE = """
import sys
bpy.ops.meshfree.show_surface()
modifiers = next(module for name, module in sys.modules.items() if name.endswith("operators.objects.modifiers"))
modifiers.set_input(thing.modifiers[-1], "Viewport Points", 0)  # as with a graphics card
thing.meshfree.point_shape = "DISCS"
"""
WORKING = "len(main_window().modal_operators)"


def begin(gui, *panels, count=POINTS):
    """Start with the shape and with these panels open."""
    gui.open_panels(*panels)
    gui.new_file()
    gui.python((ROOT / "scripts" / "coral.py").read_text(encoding="utf-8"))
    gui.python(CORAL.format(count=count))
    gui.python(SURFACE)
    gui.open_tab()


def box(gui, low, high):
    """Select the points between two heights."""
    corners = [gui.python(f"on_screen(({x}, 0.0, {z}))") for x, z in ((-1.9, low), (1.9, high))]
    gui.point_at_view()
    gui.key("alt+a", "b")
    gui.drag(*corners)


def working(gui):
    """An analysis that runs."""
    begin(gui, "MESHFREE_PT_display", count=60000)
    gui.press("meshfree.analyze")
    gui.wait_until(WORKING)
    gui.point_at_view()


def analyzed(gui):
    """The points in colors."""
    begin(gui, "MESHFREE_PT_display", "MESHFREE_PT_statistics")
    gui.python("bpy.ops.meshfree.spectrum(count=10)")
    gui.python("bpy.ops.meshfree.colormap(attribute='lb_eigenvector_008')")
    gui.python("bpy.context.object.select_set(False)")
    gui.point_at_view()


def seeing(gui):
    """All that is drawn over the view."""
    begin(gui)
    gui.python("bpy.ops.meshfree.spectrum(count=30)")
    gui.python("bpy.context.object.meshfree.histogram = bpy.context.object.meshfree.plot_eigenvalues = True")
    gui.python("bpy.ops.meshfree.colormap(attribute='lb_eigenvector_020')")
    gui.python("bpy.context.object.select_set(False)")
    gui.python("view3d()[0].spaces.active.region_3d.view_location = (0.0, 0.0, -1.3)")
    gui.point_at_view()
    gui.key("n")  # what is drawn needs the width
    gui.wait_until("view3d()[2].width < 2")


def groups(gui):
    """Points chosen in Edit Mode, for the groups that the panel makes."""
    begin(gui, "MESHFREE_PT_select", "MESHFREE_PT_deform", count=6000)
    gui.python(FRONT)
    gui.point_at_view()
    gui.key("Tab")
    box(gui, -2.0, -1.0)
    gui.press("meshfree.group_from_selection(role='ANCHOR'")
    box(gui, 1.1, 2.0)
    gui.press("meshfree.group_from_selection(role='HANDLE'")
    gui.python("bpy.context.object.meshfree.show_groups = True")
    gui.python("view.shading.type = 'MATERIAL'")
    gui.point_at_view()


def deform(gui):
    """A handle while it is moved."""
    begin(gui, "MESHFREE_PT_deform", count=6000)
    gui.python(FRONT)
    gui.point_at_view()
    gui.key("Tab")
    box(gui, -2.0, -1.0)
    gui.search("Mesh-Free Anchor")
    box(gui, 1.1, 2.0)
    gui.search("Mesh-Free Handle")
    gui.key("Tab")
    gui.search("Mesh-Free Bind")
    gui.wait_until("'Coral Handle' in bpy.data.objects", 60)
    gui.python("bpy.data.objects['Coral Handle'].location.x += 0.7")
    gui.python("bpy.data.objects['Coral Handle'].rotation_euler.y = 0.7")
    gui.python("thing.meshfree.show_groups = True")
    gui.python("view.shading.type = 'MATERIAL'")
    gui.python("thing.select_set(False)")
    gui.point_at_view()


def splats(gui):
    """Gaussian splats while their handle is moved."""
    gui.open_panels("MESHFREE_PT_deform")
    gui.new_file()
    gui.python((ROOT / "scripts" / "coral.py").read_text(encoding="utf-8"))
    gui.python(SPLATS)
    gui.open_tab()
    gui.press("meshfree.deform_bind(at_once=True", across=0.75)
    gui.wait_until("any(obj.type == 'EMPTY' for obj in bpy.data.objects)", 120)
    gui.python("bpy.context.object.location.x += 0.9")
    gui.python("bpy.context.object.rotation_euler.y = 0.7")
    gui.settle()


TAKES = (working, analyzed, seeing, groups, deform, splats)


def main(gui, names):
    """Take the pictures of these names, or all."""
    for take in TAKES:
        if not names or take.__name__ in names:
            take(gui)
            path = PICTURES / f"window_{take.__name__}.png"
            gui.pack(gui.shot(path.stem), path)
            print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main(gui, sys.argv[1:])  # noqa: F821, scripts/play.py gives the window
