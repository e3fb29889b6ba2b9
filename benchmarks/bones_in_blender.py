"""How long points and splats take to follow an armature in Blender: ``python bones_in_blender.py ZIP [splats.ply]``.

For a Python that has bpy. Installs the extension's zip into a folder of its own. Lets 100,000 points, and splats of a
file, follow 60 bones, four a point: the median of the processor's time from the change of a pose to the evaluated
object, which other work on the machine does not lengthen.
"""

import importlib
import sys
import time

import numpy as np
from follow_in_blender import MODULE, bpy  # chooses the folder before it imports bpy

POINTS, BONES, POSES = 100_000, 60, 9


def add_armature(low, high):
    """Add an armature of a chain of bones along the longest side of a box."""
    armature = bpy.data.objects.new("Arm", bpy.data.armatures.new("Arm"))
    bpy.context.scene.collection.objects.link(armature)
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    axis, parent = int(np.argmax(high - low)), None
    for number in range(BONES):
        ends = np.tile(0.5 * (low + high), (2, 1))
        ends[:, axis] = low[axis] + (high - low)[axis] * (number + np.arange(2)) / BONES
        bone = armature.data.edit_bones.new(f"Bone.{number}")
        bone.head, bone.tail, bone.parent = *ends, parent
        parent = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    return armature, axis


def bind(obj):
    """Bind an object to such an armature, and return that."""
    places = np.empty(3 * len(obj.data.attributes["position"].data), np.float32)
    obj.data.attributes["position"].data.foreach_get("vector", places)
    places = places.reshape(-1, 3).astype(np.float64)
    low, high = places.min(axis=0), places.max(axis=0)
    armature, axis = add_armature(low, high)
    share = (places[:, axis] - low[axis]) / (high - low)[axis] * BONES - 0.5
    weights = np.exp(-((share[:, None] - np.arange(BONES)) ** 2))
    weights /= weights.sum(axis=1, keepdims=True)
    importlib.import_module(f"{MODULE}.operators.rigging.weights").write_weights(
        obj, [bone.name for bone in armature.data.bones], weights
    )
    for other in bpy.context.view_layer.objects:
        other.select_set(other in (obj, armature))
    bpy.ops.meshfree.bind_armature()
    return armature


def pose(obj, armature):
    """Print the processor's time of a change of the pose, by both ways of blending."""
    live = importlib.import_module(f"{MODULE}.operators.deform.live")
    soon, quick = live._soon, importlib.import_module(f"{MODULE}.operators.deform.pose").State.QUICK
    for name, wanted in (("as dragged", lambda: quick), ("settled", soon)):
        live._soon = wanted
        for preserve in (False, True):
            obj.meshfree.deform.preserve_volume = preserve
            seconds = []
            for number in range(POSES):
                for bone in armature.pose.bones:
                    bone.rotation_quaternion = (1.0, 0.002 * (1 + number), 0.0, 0.0)
                began = time.process_time()
                bpy.context.view_layer.update()
                seconds.append(time.process_time() - began)
            blending = "dual quaternions" if preserve else "matrices"
            print(f"{obj.name}: {name}, {blending}: {1e3 * np.median(seconds):.0f} ms")
    live._soon = soon


def main(archive, path):
    """Print the times."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
    mesh = bpy.data.meshes.new("Points")
    mesh.vertices.add(POINTS)
    places = np.random.default_rng(0).uniform((0, 0, 0), (1, 1, 5), (POINTS, 3)).astype(np.float32)
    mesh.attributes["position"].data.foreach_set("vector", places.ravel())
    obj = bpy.data.objects.new("Points", mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    bpy.ops.object.convert(target="POINTCLOUD")
    obj = bpy.context.object
    pose(obj, bind(obj))
    if path:
        bpy.data.objects.remove(obj)
        bpy.ops.meshfree.import_points(filepath=path)
        obj = bpy.context.object
        print(f"{len(obj.data.attributes['position'].data):,} splats")
        pose(obj, bind(obj))
    bpy.ops.preferences.addon_disable(module=MODULE)  # Blender does not exit well with its classes


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else "")
