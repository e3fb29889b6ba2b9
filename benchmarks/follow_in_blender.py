"""One update of a bound object in Blender, run by a Python that has bpy: ``python follow_in_blender.py FILE``.

The file is an npz with points (n, 3), handles and anchors (n,) bool, and the path of the zip of the extension. Written
beside it are the seconds of updates while a handle is dragged, (k,), after them those of settling, for the first time
and again: all from the move of an empty to the evaluated object, as a drag in the window does.
"""

import importlib
import os
import sys
import tempfile
import time
from pathlib import Path

os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="meshfree-")  # before the first import of bpy

import bpy
import numpy as np

MODULE = "bl_ext.user_default.meshfree_laplacian"
MOVES = 25


def bound_object(points, handles, anchors):
    """Add an object that is bound to an empty."""
    mesh = bpy.data.meshes.new("Cloud")
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    obj = bpy.data.objects.new("Cloud", mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    for name, members in (("Handle", handles), ("Anchor", anchors)):
        obj.vertex_groups.new(name=name).add(np.flatnonzero(members).tolist(), 1.0, "REPLACE")
    bpy.ops.meshfree.deform_bind()
    return obj


def follow(points, handles, anchors):
    """Return the seconds of each quick update, and those of two settled ones."""
    obj = bound_object(points, handles, anchors)

    def check(empty):
        moved = np.empty(3 * len(points), np.float32)
        obj.data.attributes["lb_displacement"].data.foreach_get("vector", moved)
        assert np.isclose(moved[2::3][handles], empty.matrix_local.translation.z - points[handles, 2].mean()).all()

    return drag(obj, check)


def drag(obj, check=lambda empty: None):
    """Return the seconds of quick updates of a bound object, and of two settled ones; a check follows each."""
    live = importlib.import_module(f"{MODULE}.operators.deform.live")
    empty, view_layer = obj.meshfree.deform.handle_items[0].empty, bpy.context.view_layer
    (handler,) = (each for each in bpy.app.handlers.depsgraph_update_post if each.__module__ == live.__name__)
    bpy.app.handlers.depsgraph_update_post.remove(handler)  # without a window it settles at once

    def dragged(scene, depsgraph):
        live.update_all(scene, depsgraph, live.State.QUICK)

    def measure():
        empty.location.z += 0.02
        began = time.perf_counter()
        view_layer.update()
        seconds = time.perf_counter() - began
        check(empty)
        return seconds

    bpy.app.handlers.depsgraph_update_post.append(dragged)
    quick = [measure() for _ in range(MOVES)]
    bpy.app.handlers.depsgraph_update_post.remove(dragged)
    bpy.app.handlers.depsgraph_update_post.append(handler)
    return [*quick, measure(), measure()]


if __name__ == "__main__":
    path = Path(sys.argv[1])
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with np.load(path) as given:
        archive = str(given["archive"])
        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
        np.save(path.with_suffix(".npy"), follow(given["points"], given["handles"], given["anchors"]))
    bpy.ops.preferences.addon_disable(module=MODULE)  # Blender does not exit well with its classes
