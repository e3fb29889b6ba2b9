"""Pictures of the manual about armatures."""

import bpy
import numpy as np

import demo
import studio
from coral import spread_directions

ARMS = 9
TOWARD = (0.6, -0.8, 0.3)  # near the arm whose bone is shown


def armature(points):
    """Add an armature with a bone in each arm of the demonstration's shape; return the name of the bone to show."""
    directions = spread_directions(ARMS)
    along = points @ directions.T
    tips = [points[(along[:, arm] - 2.0 * _beside(points, directions[arm])).argmax()] for arm in range(ARMS)]
    obj = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(obj)
    studio.activate(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    for number, tip in enumerate(tips):
        bone = obj.data.edit_bones.new(f"Arm {number}")
        bone.head, bone.tail = 0.15 * tip, 0.85 * tip
    bpy.ops.object.mode_set(mode="OBJECT")
    return f"Arm {(directions @ TOWARD).argmax()}"


def _beside(points, direction):
    return np.linalg.norm(points - (points @ direction)[:, None] * direction, axis=1)


def auto_weights(path):
    """The weights of one bone on points, by Automatic Weights of the extension and of Blender."""
    points = demo.Coral().sample(demo.POINTS)
    objects = []
    for own in (True, False):
        obj = studio.make_object(points, "Coral")
        bone = armature(points)
        obj.select_set(True)
        if own:
            bpy.ops.meshfree.auto_weights()
        else:
            bpy.ops.object.parent_set(type="ARMATURE_AUTO")
        objects.append(obj)
        obj.modifiers.remove(obj.modifiers["Armature"])
        show_weights(obj, bone)
    studio.row(objects, path, legend=objects[0])


def show_weights(obj, bone):
    """Show the weights of a bone as colors."""
    group = obj.vertex_groups[bone].index
    held = ([item.weight for item in vertex.groups if item.group == group] for vertex in obj.data.vertices)
    obj.data.attributes.new("Weight", "FLOAT", "POINT").data.foreach_set("value", [sum(each) for each in held])
    studio.show(obj, "Weight")
    studio.set_range(obj, 0.0, 1.0)


PICTURES = {"auto_weights": auto_weights}
