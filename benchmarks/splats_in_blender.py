"""How long Blender takes with Gaussian splats of degree 3: ``python splats_in_blender.py ZIP [splats]``.

For a Python that has bpy. Installs the extension's zip into a folder of its own. Writes a file of random splats there,
imports it and exports it again. Then lets splats on a sphere follow a handle, drawn as ellipsoids: the median from the
move of an empty to the evaluated object, and the time of the settled result.
"""

import importlib
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from follow_in_blender import MODULE, bpy, drag  # chooses the folder before it imports bpy

SPLATS = 2_000_000
FOLLOWED = 20_000, 100_000


def random_splats(core, positions, size):
    """Return splats of a size and of random colors at some places."""
    rng, count = np.random.default_rng(0), len(positions)
    return core.splats.Splats(
        positions=positions,
        scales=size * np.exp(0.3 * rng.standard_normal((count, 3))),
        rotations=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        opacities=rng.uniform(0.1, 0.9, count),
        colors=rng.standard_normal((count, 3)),
        harmonics=0.1 * rng.standard_normal((count, 15, 3)),
    )


def in_and_out(core, folder, count):
    """Print the seconds of an import and an export, and whether all bytes are the same."""
    given, written = folder / "given.ply", folder / "written.ply"
    core.splats.write_splats(given, random_splats(core, np.random.default_rng(1).standard_normal((count, 3)), 0.01))
    began = time.perf_counter()
    bpy.ops.meshfree.import_points(filepath=str(given))
    between = time.perf_counter()
    bpy.ops.meshfree.export_splats(filepath=str(written))
    ended = time.perf_counter()
    same = given.read_bytes() == written.read_bytes()
    megabytes = given.stat().st_size / 1e6
    print(
        f"{count:,} splats, {megabytes:.0f} MB: import {between - began:.1f} s, export {ended - between:.1f} s, {same=}"
    )


def follow(core, folder, count):
    """Print how long splats on a sphere take to follow a handle."""
    z = 1.0 - (np.arange(count) + 0.5) / (0.5 * count)
    ring = np.sqrt(1.0 - z**2) * np.exp(2.39996j * np.arange(count))
    path = folder / "ball.ply"
    core.splats.write_splats(path, random_splats(core, np.column_stack([ring.real, ring.imag, z]), count**-0.5))
    bpy.ops.meshfree.import_points(filepath=str(path), up="Z")
    obj = bpy.context.object
    for name, members in (("Handle", z > 0.8), ("Anchor", z < -0.8)):
        if obj.type == "MESH":
            obj.vertex_groups.new(name=name).add(np.flatnonzero(members).tolist(), 1.0, "REPLACE")
        else:
            obj.data.attributes.new(name, "FLOAT", "POINT").data.foreach_set("value", members.astype(np.float32))
    bpy.ops.meshfree.deform_bind()
    *quick, settled, _ = drag(obj)
    quick = np.median(quick)
    print(f"{count:,} splats follow a handle in {1e3 * quick:.0f} ms, settled in {1e3 * settled:.0f} ms")
    bpy.data.objects.remove(obj)


def main(archive, count):
    """Print the seconds."""
    with tempfile.TemporaryDirectory() as folder:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
        core = importlib.import_module(f"{MODULE}.core")
        in_and_out(core, Path(folder), count)
        bpy.data.objects.remove(bpy.context.object)
        for few in FOLLOWED:
            follow(core, Path(folder), few)
        bpy.ops.preferences.addon_disable(module=MODULE)  # Blender does not exit well with its classes


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else SPLATS)
