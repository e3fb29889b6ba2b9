"""Whether memory stays flat over many cycles of analysis, smoothing and undo.

    python benchmarks/soak_in_blender.py ZIP [cycles [points]]

For a Python that has bpy, on Linux. Installs the extension's zip into a folder of its own. The points of each cycle are
others than before, so that nothing is known of them. What is kept of earlier ones has little room here, and undo few
steps, so that both are full soon: memory counts from then on.
"""

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
        rng, used = np.random.default_rng(0), []
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
            used.append(resident())
            if cycle % 10 == 9:
                print(f"{cycle + 1} cycles: {used[-1]:.0f} MB", file=sys.stderr, flush=True)
        flat = np.array(used[_FULL:])
        tenth = max(1, len(flat) // 10)
        first, last = np.median(flat[:tenth]), np.median(flat[-tenth:])
        print(
            f"{cycles} cycles, {count:,} points: {first:.0f} MB at first, {last:.0f} at last, {flat.max():.0f} at most"
        )
        print(f"growth {100.0 * (last / first - 1.0):+.1f} %")


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[2:]]
    main(sys.argv[1], *(numbers + [CYCLES, POINTS][len(numbers) :]))
