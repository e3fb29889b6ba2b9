"""Pictures of the manual about transfers."""

import bpy
import numpy as np

import demo
import studio
from coral import spread_directions
from rig_pictures import ARMS, TOWARD, armature, show_weights

GROWTH = 0.25  # of the arm that is shown, on the shape that takes its weights
DISTANCE = 0.03
COARSE = 3000


def transfer_weights(path):
    """The weights of an arm, what a shape whose arm is longer takes of them, and its weights."""
    source = studio.make_object(demo.Coral().sample(demo.POINTS), "Source")
    bone = armature(studio.world_points(source))
    source.select_set(True)
    bpy.ops.meshfree.auto_weights()
    source.modifiers.remove(source.modifiers["Armature"])
    directions, points = spread_directions(ARMS), demo.Coral().sample(demo.POINTS, seed=5)
    arm = directions[(directions @ TOWARD).argmax()]
    points *= 1.0 + GROWTH * np.exp(8.0 * (points @ arm / np.linalg.norm(points, axis=1) - 1.0))[:, None]
    preview, target = (studio.make_object(points, name) for name in ("Preview", "Target"))
    for obj in (preview, target, source):
        studio.activate(obj)
        obj.select_set(True)
    for obj in (preview, target):
        obj.select_set(True)
    bpy.ops.meshfree.transfer_weights(distance=DISTANCE)
    for obj in (source, target):
        show_weights(obj, bone)
    studio.show(preview, "lb_transfer")
    studio.row((source, preview, target), path, legend=source)


def transfer_attributes(path):
    """Parts of a coarse cloud, and of a fine one that has taken them."""
    coarse, fine = (
        studio.make_object(demo.Coral().sample(count, seed=seed), "Cloud")
        for count, seed in ((COARSE, 2), (demo.POINTS, 0))
    )
    parts = (studio.world_points(coarse) @ spread_directions(ARMS).T).argmax(axis=1)
    coarse.data.attributes.new("Part", "INT", "POINT").data.foreach_set("value", parts.astype(np.int32))
    studio.activate(coarse)
    for obj in (coarse, fine):
        obj.select_set(True)
    bpy.ops.meshfree.transfer_attributes()
    for obj in (coarse, fine):
        studio.show(obj, "Part")
    studio.row((coarse, fine), path, legend=fine)


PICTURES = {"transfer_weights": transfer_weights, "transfer_attributes": transfer_attributes}
