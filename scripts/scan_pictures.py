"""Pictures of scans, which are no part of the tree: the environment variable MESHFREE_SCANS names their folder."""

import os
from pathlib import Path

import bpy
import numpy as np

import demo
import studio

FOLDER = os.environ.get("MESHFREE_SCANS", "")


def scan(name, copies=1):
    """Open a scan, upright, in place of everything; return so many objects of it."""
    objects = [demo.load_scan(Path(FOLDER) / f"{name}.ply", "Y")]
    objects[0].select_set(False)  # as imported: operators work on all selected objects
    for _ in range(copies - 1):
        obj = objects[0].copy()
        obj.data = obj.data.copy()
        bpy.context.scene.collection.objects.link(obj)
        objects.append(obj)
    bpy.context.view_layer.update()
    return objects


def own_points(obj):
    """Vertices of an object in its own space, (n, 3)."""
    return studio.part("operators.objects.reading").own_positions(obj.data)


def figure12(path):
    """The armadillo, and what 1000, 100 and 10 modes keep of it: Figure 12 of the paper."""
    objects = scan("armadillo", copies=4)
    for obj, modes in zip(objects[1:], (1000, 100, 10), strict=True):
        studio.activate(obj)
        bpy.ops.meshfree.smooth(method="MODES", modes=modes, target="IN_PLACE")
    for obj in objects:
        studio.show_shape(obj, like=objects[0])  # ten modes leave limbs too thin for normals
    studio.row(objects, path, legend=None, view=(0.3, -1.0, 0.1), size=(1000, 340))


def armadillo(path):
    """The armadillo in parts."""
    (obj,) = scan("armadillo")
    bpy.ops.meshfree.segment(parts=7)
    studio.single(obj, "lb_segment", path, view=(0.3, -1.0, 0.1))


def figure13_planck(path):
    """A head whose crown is pulled up: Figure 13 of the paper."""
    rest, obj = scan("max-planck", copies=2)
    points = own_points(obj)
    crown = points[points[:, 1].argmax()]
    studio.group(obj, np.linalg.norm(points - crown, axis=1) < 25.0, "HANDLE")
    studio.group(obj, points[:, 1] < 0.0, "ANCHOR")
    studio.deform(obj, move=(0.0, 0.0, 80.0))
    studio.deformed_row(rest, obj, path, view=(-0.6, 1.0, 0.1), size=(760, 360))


def figure13_camel(path):
    """A head whose cheek is pushed in: Figure 13 of the paper."""
    rest, obj = scan("camelhead", copies=2)
    points = own_points(obj)
    cheek = points[np.where(np.abs(points[:, 2]) < 0.05, points[:, 0], -np.inf).argmax()]
    away = np.linalg.norm(points - cheek, axis=1)
    studio.group(obj, away < 0.05, "HANDLE")
    studio.group(obj, away > 0.3, "ANCHOR")
    studio.deform(obj, move=(-0.12, 0.0, 0.0))
    studio.deformed_row(rest, obj, path, view=(0.4, -1.0, 0.3))


def splats(path):
    """A guitar of Gaussian splats, as it was trained, and with its neck bent."""
    objects = []
    for _ in range(2):
        bpy.ops.meshfree.import_points(filepath=str(Path(FOLDER) / "splats" / "guitar.ply"), up="-Y")
        objects.append(bpy.context.object)
    rest, obj = objects
    bpy.context.view_layer.update()
    height = studio.world_points(obj)[:, 2]
    studio.group(obj, height > 3.6, "HANDLE")
    studio.group(obj, height < 1.6, "ANCHOR")
    studio.deform(obj, move=(1.0, 0.0, -0.4), rotate=(0.0, 1.0, 0.0))
    bpy.ops.meshfree.deform_apply()
    bpy.ops.meshfree.deform_unbind()
    studio.row([rest, obj], path, legend=None, view=(1.0, 0.3, 0.1), size=(700, 420))


PICTURES = {
    "splats": splats,
    "armadillo": armadillo,
    "figure12": figure12,
    "figure13_planck": figure13_planck,
    "figure13_camel": figure13_camel,
}
