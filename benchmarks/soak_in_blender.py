"""Whether memory stays flat over many cycles of analysis, smoothing and undo.

    python benchmarks/soak_in_blender.py ZIP [cycles [points]]

For a Python that has bpy, on Linux. Installs the extension's zip into a folder of its own. The points of each cycle are
others than before, so that nothing is known of them. What is kept of earlier ones has little room here, and undo few
steps, so that both are full soon: memory counts from then on.

Two numbers tell of it: what the process takes of the machine, and what programs in it hold of that. The first one goes
up and down by a tenth, more in one run than in another, since the C library keeps freed memory in pieces for later:
of 20,000 points 0.18 GB are held after every cycle, and 0.82 to 0.93 GB taken, 0.65 after `malloc_trim`. A leak is what
makes the second one grow. MALLOC_MMAP_THRESHOLD_=131072 in the environment lets the C library give large pieces back:
0.44 GB are taken then, from the fifth cycle on.
"""

import ctypes
import importlib
import os
import sys
import tempfile
from pathlib import Path

CYCLES, POINTS = 500, 20_000
_FULL, _ROOM, _STEPS = 20, 100 << 20, 8  # cycles, bytes and steps of undo


def resident() -> float:
    """Memory that this process takes, in MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


class _Pieces(ctypes.Structure):
    """What `mallinfo2` of the GNU C library, 2.33 or later, tells."""

    _names = ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks", "keepcost")
    _fields_ = [(name, ctypes.c_size_t) for name in _names]


def held() -> float:
    """Memory that was asked for and not given back, in MB."""
    count = ctypes.CDLL("libc.so.6").mallinfo2
    count.restype = _Pieces
    pieces = count()
    return (pieces.uordblks + pieces.hblkhd) / 1e6


def main(archive, cycles, count):
    """Run the cycles, and print how memory went."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["BLENDER_USER_RESOURCES"] = folder  # before bpy
        import bpy
        import numpy as np

        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
        (name,) = (name for name in bpy.context.preferences.addons.keys() if name.endswith("meshfree_laplacian"))
        importlib.import_module(f"{name}.operators.running.cache").LIMIT = _ROOM
        bpy.context.preferences.edit.undo_steps = _STEPS
        mesh = bpy.data.meshes.new("Cloud")
        mesh.vertices.add(count)
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("Cloud", mesh))
        rng, used = np.random.default_rng(0), {"taken": [], "held": []}
        for cycle in range(cycles):
            obj = bpy.data.objects["Cloud"]
            bpy.context.view_layer.objects.active = obj
            points = rng.standard_normal((count, 3))
            points /= np.linalg.norm(points, axis=1)[:, None]
            obj.data.attributes["position"].data.foreach_set("vector", points.astype(np.float32).reshape(-1))
            obj.data.update()
            bpy.ops.ed.undo_push(message="Points")
            for name in ("analyze", "smooth"):
                assert getattr(bpy.ops.meshfree, name)("EXEC_DEFAULT", True) == {"FINISHED"}
            for _ in range(2):
                bpy.ops.ed.undo()
            used["taken"].append(resident())
            used["held"].append(held())
            if cycle % 10 == 9:
                now = ", ".join(f"{sizes[-1]:.0f} MB {kind}" for kind, sizes in used.items())
                print(f"{cycle + 1} cycles: {now}", file=sys.stderr, flush=True)
        print(f"{cycles} cycles, {count:,} points")
        for kind, sizes in used.items():
            flat = np.array(sizes[_FULL:])
            tenth = max(1, len(flat) // 10)
            first, last = np.median(flat[:tenth]), np.median(flat[-tenth:])
            growth = 100.0 * (last / first - 1.0)
            print(
                f"{kind}: {first:.0f} MB at first, {last:.0f} at last, {flat.max():.0f} at most, growth {growth:+.1f} %"
            )


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[2:]]
    main(sys.argv[1], *(numbers + [CYCLES, POINTS][len(numbers) :]))
