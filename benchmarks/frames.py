"""Frames a second of the 3D view: ``python scripts/play.py --no-build benchmarks/frames.py [SPLATS.ply [POINTS ...]]``.

While the view is turned by three degrees a frame, as orbiting with the mouse does, and while a handle of bound splats
is moved. The view alone is drawn, not the rest of the window. The empty view tells what the machine can do at all, and
the seconds of the processors a frame, of all threads, what others on the machine do not change.
"""

import sys
from pathlib import Path

from window import SIZE

COUNTS = 5_000, 20_000, 35_000, 80_000
SMALL = 640, 400  # another size of the window
LEAST, MOST = 8, 100  # frames
SECONDS = 4.0  # for that long at least
PREPARE = f"""
import sys
from mathutils import Quaternion

def part(name):
    return next(module for key, module in sys.modules.items() if key.endswith("meshfree_laplacian." + name))

def turn():
    view = view3d()[0].spaces.active.region_3d
    view.view_rotation = Quaternion((0.0, 0.0, 1.0), np.radians(3.0)) @ view.view_rotation

def move():
    thing.meshfree.deform.handle_items[0].empty.location.z += step
    bpy.context.view_layer.update()

def frames(change):  # a second, and seconds of the processors each
    area, region, _ = view3d()
    with bpy.context.temp_override(window=main_window(), area=area, region=region):
        for count in range(3):  # what is compiled, sent and sorted once
            change()
            bpy.ops.wm.redraw_timer(type="DRAW_SWAP", iterations=1)
        began, used, count = time.perf_counter(), time.process_time(), 0
        while count < {LEAST} or count < {MOST} and time.perf_counter() - began < {SECONDS}:
            change()
            bpy.ops.wm.redraw_timer(type="DRAW_SWAP", iterations=1)
            count += 1
        return count / (time.perf_counter() - began), (time.process_time() - used) / count

def look(shading):
    view = view3d()[0].spaces.active
    view.shading.type = shading
    view.region_3d.view_rotation = Quaternion((0.8, 0.5, 0.17, 0.3))
    area, region, _ = view3d()
    with bpy.context.temp_override(window=main_window(), area=area, region=region):
        bpy.ops.view3d.view_all()
"""
CLOUD = """
points = np.random.default_rng(0).normal(size=({count}, 3))
points /= np.linalg.norm(points, axis=1, keepdims=True)
points *= 1.0 + 0.3 * np.sin(3.0 * points[:, :1]) * np.sin(2.0 * points[:, 1:2])
mesh = bpy.data.meshes.new("Cloud")
mesh.vertices.add(len(points))
mesh.vertices.foreach_set("co", points.astype(np.float32).reshape(-1))
height = mesh.attributes.new("Height", "FLOAT", "POINT").data
height.foreach_set("value", np.ascontiguousarray(points[:, 2], dtype=np.float32))
thing = bpy.data.objects.new("Cloud", mesh)
bpy.context.scene.collection.objects.link(thing)
bpy.context.view_layer.objects.active = thing
thing.select_set(True)
bpy.ops.meshfree.show_surface()
bpy.ops.meshfree.colormap(attribute="Height")
part("operators.objects.modifiers").set_input(thing.modifiers[-1], "Viewport Points", 0)
thing.update_tag()
"""


def row(gui, name, change="turn"):
    """Measure and print a row of the table."""
    rate, seconds = gui.python(f"frames({change})", 600)
    print(f"| {name} | {rate:.1f} | {1e3 * seconds:.0f} |", flush=True)


def orbit(gui, counts, size):
    """Print the frames a second of an empty view and of points, in a window of some size."""
    gui.resize(*size)
    width, height = gui.region()[2:]
    print(f"| *View of {width} x {height} pixels* | | |", flush=True)
    for shading in ("SOLID", "MATERIAL"):
        gui.new_file()
        gui.python(f"look({shading!r})")
        row(gui, f"nothing, {shading}")
        for count in counts:
            gui.new_file()
            gui.python(CLOUD.format(count=count), 600)
            gui.python(f"look({shading!r})")
            for shape in ("DOTS", "DISCS"):
                gui.python(f"thing.meshfree.point_shape = {shape!r}")
                gui.settle()
                row(gui, f"{count:,} {shape}, {shading}")


def splats(gui, path):
    """Print those of splats, turned and bent."""
    copy = gui.folder / "splats.ply"
    copy.write_bytes(Path(path).read_bytes())
    gui.new_file()
    gui.python(f"bpy.ops.meshfree.import_points(filepath={str(gui.place.inside(copy))!r}, up='-Y')", 600)
    number = gui.python("thing = bpy.context.object\nlen(thing.data.attributes['position'].data)")
    for shading in ("SOLID", "MATERIAL"):
        gui.python(f"look({shading!r})")
        gui.settle()
        gui.shot(f"splats_{shading}")
        row(gui, f"{number:,} splats, {shading}")
    gui.python("bpy.ops.meshfree.deform_bind(at_once=True)", 900)
    gui.python("step = 0.002 * max(thing.dimensions)")
    for shading in ("SOLID", "MATERIAL"):
        gui.python(f"look({shading!r})")
        gui.settle()
        row(gui, f"{number:,} splats bound and moved, {shading}", "move")
        gui.shot(f"splats_moved_{shading}")


def main(gui, path="", *counts):
    """Print all."""
    print("| drawn | frames a second | ms of the processors each |\n| --- | --- | --- |")
    gui.new_file()
    gui.python(PREPARE)
    counts = [int(count) for count in counts] or COUNTS
    for size in (SMALL, SIZE):
        orbit(gui, counts, size)
    if path:
        splats(gui, path)


if __name__ == "__main__":
    main(gui, *sys.argv[1:])  # noqa: F821, scripts/play.py gives the window
