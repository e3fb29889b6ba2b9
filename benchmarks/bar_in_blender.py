"""Blender's Laplacian Deform modifier on a mesh, run by a Python that has bpy: ``python bar_in_blender.py FILE``.

The file is an npz with points (n, 3), quads (m, 4), held (k,), target (k, 3) and iterations; the modifier's result is
written beside it. Nothing but numpy and bpy is needed, so that it runs where scipy is not installed.
"""

import sys
from pathlib import Path

import bpy
import numpy as np


def deform(points, quads, held, target, iterations):
    """Bind the modifier to a mesh at rest, move the held vertices, and return where all of them go, (n, 3)."""
    mesh = bpy.data.meshes.new("bar")
    mesh.from_pydata(points.tolist(), [], quads.tolist())
    mesh.update()
    thing = bpy.data.objects.new("bar", mesh)
    bpy.context.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = thing
    thing.vertex_groups.new(name="held").add(held.tolist(), 1.0, "REPLACE")
    # A shape key comes before all modifiers, so it can move the vertices after the binding.
    thing.shape_key_add(name="Basis")
    key = thing.shape_key_add(name="moved")
    key.value = 0.0
    moved = points.copy()
    moved[held] = target
    key.data.foreach_set("co", moved.astype(np.float32).ravel())
    modifier = thing.modifiers.new("deform", "LAPLACIANDEFORM")
    modifier.vertex_group = "held"
    modifier.iterations = int(iterations)
    bpy.ops.object.laplaciandeform_bind(modifier=modifier.name)
    if not modifier.is_bind:
        raise RuntimeError("The modifier did not bind.")
    key.value = 1.0
    bpy.context.view_layer.update()
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    result = np.empty(3 * len(points), dtype=np.float32)
    evaluated.vertices.foreach_get("co", result)
    return result.reshape(-1, 3)


if __name__ == "__main__":
    path = Path(sys.argv[1])
    with np.load(path) as given:
        np.save(path.with_suffix(".npy"), deform(**given))
