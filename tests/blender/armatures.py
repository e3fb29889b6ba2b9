"""Armatures for the tests of Blender."""

import bpy
import numpy as np


def add_armature(bones, name="Rig"):
    """Add an active armature with these bones: by name (head, tail), each a child of the one before if they touch."""
    armature = bpy.data.objects.new(name, bpy.data.armatures.new(name))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    last = None
    for title, (head, tail) in bones.items():
        bone = armature.data.edit_bones.new(title)
        bone.head, bone.tail = head, tail
        if last is not None and np.allclose(last.tail, head):
            bone.parent, bone.use_connect = last, True
        last = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature


def weights_of(obj):
    """Weights of vertices in all groups, (n, b), by the groups in their order."""
    weights = np.zeros((len(obj.data.vertices), len(obj.vertex_groups)))
    for vertex in obj.data.vertices:
        for item in vertex.groups:
            weights[vertex.index, item.group] = item.weight
    return weights


def choose(armature, *objects):
    """Select objects and an armature, which becomes active."""
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects or obj == armature)
    bpy.context.view_layer.objects.active = armature
