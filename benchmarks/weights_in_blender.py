"""Blender's own Automatic Weights of a mesh, run by a Python that has bpy: ``python weights_in_blender.py FILE``.

The file is an npz with vertices (n, 3), faces (m, 3), and heads and tails (b, 3) of the bones; the weights, (n, b), are
written beside it. Nothing but numpy and bpy is needed, so that it runs where scipy is not installed.
"""

import sys
from pathlib import Path

import bpy
import numpy as np


def weights(vertices, faces, heads, tails):
    """Bind a mesh to an armature, and return the weights of its vertices, (n, b)."""
    mesh = bpy.data.meshes.new("body")
    mesh.from_pydata(vertices.tolist(), [], faces.tolist())
    body = bpy.data.objects.new("body", mesh)
    rig = bpy.data.objects.new("rig", bpy.data.armatures.new("rig"))
    for thing in (body, rig):
        bpy.context.collection.objects.link(thing)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for number, (head, tail) in enumerate(zip(heads.tolist(), tails.tolist(), strict=True)):
        bone = rig.data.edit_bones.new(f"{number:03d}")
        bone.head, bone.tail = head, tail
    bpy.ops.object.mode_set(mode="OBJECT")
    body.select_set(True)
    rig.select_set(True)
    bpy.ops.object.parent_set(type="ARMATURE_AUTO")
    result = np.zeros((len(vertices), len(heads)))
    names = [int(group.name) for group in body.vertex_groups]
    for vertex in body.data.vertices:
        for item in vertex.groups:
            result[vertex.index, names[item.group]] = item.weight
    return result


if __name__ == "__main__":
    path = Path(sys.argv[1])
    with np.load(path) as given:
        np.save(path.with_suffix(".npy"), weights(**given))
