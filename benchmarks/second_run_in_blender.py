"""How quick a second run is that asks for nothing new: ``python second_run_in_blender.py ZIP [points]``.

For a Python that has bpy. Installs the extension's zip into a folder of its own, runs every operator on a generated
cloud, takes the run back as Adjust Last Operation does, and runs it again with other settings of what is only shown.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

POINTS = 35_000
RUNS = (
    ("analyze", {"modes": 30}, {"modes": 30, "write_limit": 10}),
    ("spectrum", {"count": 30}, {"count": 20}),
    ("smooth", {}, {"strength": 0.5}),
    ("smooth", {"method": "MODES", "modes": 100}, {"method": "MODES", "modes": 80, "strength": 0.5}),
    ("smooth", {"keep": "AREA", "method": "HEAT"}, {"keep": "AREA", "method": "HEAT", "target": "IN_PLACE"}),
    ("mode_shape", {}, {"mode": 9, "phase": 1.0}),
    ("segment", {}, {"vertex_groups": True}),
    ("signature", {}, {"kind": "WAVE"}),
    ("harmonic_field", {}, {"high": 5.0}),
    ("geodesic_distance", {}, {"show": False}),
)


def bumpy_sphere(np, count):
    """Return random points on a closed surface without a symmetry, (count, 3) float32."""
    points = np.random.default_rng(0).standard_normal((count, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return (points * (1.0 + 0.2 * np.sin(3.0 * points[:, [1]] + 1.0)) * (1.0, 1.3, 1.7)).astype(np.float32)


def main(archive, count):
    """Print the seconds of both runs of every operator, and how long the undo between them took."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["BLENDER_USER_RESOURCES"] = folder  # before bpy
        import bpy
        import numpy as np

        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
        mesh = bpy.data.meshes.new("Cloud")
        mesh.vertices.add(count)
        points = bumpy_sphere(np, count)
        mesh.vertices.foreach_set("co", points.reshape(-1))
        obj = bpy.data.objects.new("Cloud", mesh)
        bpy.context.scene.collection.objects.link(obj)
        bpy.context.view_layer.objects.active = obj
        for name, members in (("Value", range(0, count, 100)), ("Source", range(3))):
            obj.vertex_groups.new(name=name).add(list(members), 0.5, "REPLACE")
        obj.vertex_groups["Value"].add([0], 1.0, "REPLACE")
        bpy.ops.ed.undo_push(message="Start")
        lines = [f"| operator, {count:,} points | first run [s] | second run [s] |", "| --- | --- | --- |"]
        for name, first, second in RUNS:
            operator, seconds = getattr(bpy.ops.meshfree, name), []
            for settings in (first, second):
                began = time.perf_counter()
                operator("EXEC_DEFAULT", True, **settings)
                seconds.append(time.perf_counter() - began)
                bpy.ops.ed.undo()
            lines.append(f"| {name} {first or ''} | {seconds[0]:.2f} | {seconds[1]:.3f} |")
        bpy.ops.preferences.addon_disable(module="bl_ext.user_default.meshfree_laplacian")
        print("\n".join(lines))


if __name__ == "__main__":
    main(str(Path(sys.argv[1]).resolve()), int(sys.argv[2]) if len(sys.argv) > 2 else POINTS)
