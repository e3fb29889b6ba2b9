"""How soon a real Blender window answers while it computes: ``python scripts/play.py benchmarks/window.py [POINTS]``.

Times run from the moment a program is started that presses a key, some ten milliseconds before Blender gets it, to the
moment that the text of the status bar is set, and to that of its drawing, here without a graphics card. The target for
the first text is 0.2 s, that for stopping 0.5 s, after Esc at any moment of the work. The work is begun when Blender
has drawn the points and is at rest: a key that comes while it draws waits for that, a quarter of a second here.
"""

import statistics
import sys
import time

WORKING = "len(main_window().modal_operators)"
PREPARE = """
texts, drawn, ticks = [], [], []
set_text = bpy.types.WorkSpace.status_text_set

def note_text(self, text):
    texts.append((time.monotonic(), text))
    return set_text(self, text)

def note_drawing(header, context):
    drawn.append(time.monotonic())

def note_tick():
    ticks.append(time.monotonic())
    return 0.005

def noting(since, wanted):
    noted = next((moment for moment, text in texts if moment > since and bool(text) == wanted), None)
    return noted and noted - since

def drawing(since, wanted):
    noted = noting(since, wanted)
    seen = noted and next((moment for moment in drawn if moment > since + noted), None)
    return seen and seen - since

def shown(since):  # seconds to the first drawing with a text
    return drawing(since, True)

def gone(since):  # seconds to the first drawing without one
    return drawing(since, False)

def at_rest(seconds=0.3):  # for so long Blender has drawn nothing that takes time
    moments = [moment for moment in ticks if moment > time.monotonic() - seconds]
    return len(moments) > 5 and float(np.diff(moments).max()) < 0.05

def longest_pause(since):
    return float(np.diff([moment for moment in ticks if moment > since]).max())

if not hasattr(bpy.types.WorkSpace, "noted"):
    bpy.types.WorkSpace.noted = True
    bpy.types.WorkSpace.status_text_set = note_text
    bpy.types.STATUSBAR_HT_header.append(note_drawing)
    bpy.app.timers.register(note_tick, persistent=True)
keymap = bpy.context.window_manager.keyconfigs.addon.keymaps.new(name="3D View", space_type="VIEW_3D")
keymap.keymap_items.new("meshfree.analyze", "F5", "PRESS").properties.modes = 30
keymap.keymap_items.new("meshfree.analyze", "F6", "PRESS").properties.modes = 10
view3d()[0].spaces.active.shading.type = "WIREFRAME"
"""
CLOUD = """
points = np.random.default_rng({seed}).normal(size=({count}, 3))
points /= np.linalg.norm(points, axis=1, keepdims=True)
points *= 1.0 + 0.3 * np.sin(3.0 * points[:, :1]) * np.sin(2.0 * points[:, 1:2])
mesh = bpy.data.meshes.new("Cloud")
mesh.vertices.add(len(points))
mesh.vertices.foreach_set("co", points.astype(np.float32).reshape(-1))
mesh.update()
thing = bpy.data.objects.new("Cloud", mesh)
bpy.context.scene.collection.objects.link(thing)
bpy.context.view_layer.objects.active = thing
thing.select_set(True)
bpy.ops.ed.undo_push(message="Cloud")
"""
BUILD = """
from bl_ext.user_default.meshfree_laplacian import core
began = time.monotonic()
laplacian = core.build_laplacian(points)
built = time.monotonic()
laplacian.eigenpairs(10)
built - began, time.monotonic() - began
"""


def press(gui, key):
    """Press a key and return when that began."""
    began = time.monotonic()
    gui.run("xdotool", "key", key)
    return began


def begin(gui, count, seed, key="F5"):
    """Begin an analysis of a cloud that was not seen before; return when the key was pressed."""
    gui.new_file()
    gui.python("view3d()[0].spaces.active.shading.type = 'WIREFRAME'")
    gui.python(CLOUD.format(seed=seed, count=count))
    gui.point_at_view()
    gui.wait_until("at_rest()", 60)
    return press(gui, key)


def measure(gui, count, moments=12):
    """Measure the whole of an analysis once, and Esc at some moments of it; return lists of seconds by name."""
    gui.new_file()
    gui.python(PREPARE)
    began = begin(gui, count, 0)
    starts = [gui.wait_until(f"shown({began})", 30)]
    begins = [gui.python(f"noting({began}, True)")]
    gui.wait_until(f"gone({began})", 600)
    whole = gui.python(f"gone({began})", 600)
    pauses = [gui.python(f"longest_pause({began})", 600)]
    stops, ends = [], []
    for moment in range(moments):
        began = begin(gui, count, moment + 1)
        starts.append(gui.wait_until(f"shown({began})", 30))
        begins.append(gui.python(f"noting({began}, True)"))
        time.sleep(max(0.0, began + (moment + 0.5) / moments * whole - time.monotonic()))
        escaped = press(gui, "Escape")
        stop = gui.wait_until(f"gone({escaped}) or gone({began}) and -1.0", 60)
        if stop > 0.0:  # else it was done before
            stops.append(stop)
            ends.append(gui.python(f"noting({escaped}, False)"))
    return {
        "key to first text": begins,
        "key to first text, drawn": starts,
        "Esc to stopped": ends,
        "Esc to stopped, drawn": stops,
        "longest pause": pauses,
        "whole analysis": [whole],
    }


def compare(gui, count, times=5):
    """Measure analyses with 10 modes until their colors are drawn, and what core takes alone; return as `measure`."""
    wholes, operators, both = [], [], []
    for seed in range(times):
        began = begin(gui, count, 100 + seed, "F6")
        gui.wait_until(f"gone({began})", 600)
        wholes.append(gui.python(f"gone({began})"))
        built, solved = gui.python(BUILD, 600)
        operators.append(built)
        both.append(solved)
    return {
        "key to colors, 10 modes": wholes,
        "the operator alone": operators,
        "the operator and 10 modes alone": both,
    }


def report(figures, count):
    """Print the figures as a table."""
    print(f"\n| {count:,} points, 30 modes | times | median [s] | longest [s] |\n| --- | --- | --- | --- |")
    for name, seconds in figures.items():
        print(f"| {name} | {len(seconds)} | {statistics.median(seconds):.2f} | {max(seconds):.2f} |")


if __name__ == "__main__":
    points = int(sys.argv[1]) if len(sys.argv) > 1 else 20000
    report(measure(gui, points) | compare(gui, points), points)  # noqa: F821, scripts/play.py gives the window
