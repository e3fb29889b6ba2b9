"""Pictures of what follows an armature, of a scan; see scan_pictures.py."""

import tempfile
from functools import partial
from pathlib import Path

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

import scan_pictures
import studio

SPINE = {  # bones of the armadillo that belong to no side: parent, head, tail
    "hips": ("", (0.0, 0.08, -0.13), (0.0, 0.08, 0.0)),
    "chest": ("hips", (0.0, 0.08, 0.0), (0.0, 0.06, 0.15)),
    "head": ("chest", (0.0, 0.0, 0.17), (0.0, -0.08, 0.33)),
    "tail": ("hips", (0.0, 0.15, -0.17), (0.1, 0.35, -0.29)),
}
SIDES = {  # those of its right side, and of its left one
    "upper_arm": ("chest", ((-0.16, 0.06, 0.12), (-0.32, -0.05, 0.14)), ((0.16, 0.04, 0.14), (0.34, -0.1, 0.15))),
    "lower_arm": ("upper_arm", ((-0.32, -0.05, 0.14), (-0.38, -0.19, 0.3)), ((0.34, -0.1, 0.15), (0.35, -0.26, 0.25))),
    "hand": ("lower_arm", ((-0.38, -0.19, 0.3), (-0.36, -0.22, 0.4)), ((0.35, -0.26, 0.25), (0.31, -0.3, 0.36))),
    "thigh": ("hips", ((-0.1, 0.08, -0.1), (-0.22, 0.06, -0.27)), ((0.1, 0.08, -0.1), (0.22, 0.05, -0.27))),
    "shin": ("thigh", ((-0.22, 0.06, -0.27), (-0.18, 0.12, -0.46)), ((0.22, 0.05, -0.27), (0.19, 0.1, -0.46))),
    "foot": ("shin", ((-0.18, 0.12, -0.46), (-0.21, 0.0, -0.55)), ((0.19, 0.1, -0.46), (0.25, 0.0, -0.55))),
}
POSE = {  # turns about world axes, in degrees
    "hips": (0, 0, -12),
    "chest": (4, 0, 18),
    "head": (-8, 0, 16),
    "upper_arm.R": (0, -25, 0),
    "lower_arm.R": (0, 55, 0),
    "hand.R": (0, 30, 0),
    "upper_arm.L": (0, 45, -20),
    "lower_arm.L": (75, 0, 0),
    "thigh.L": (-45, 0, 0),
    "shin.L": (55, 0, 0),
    "tail": (0, 0, 50),
}
LIGHT = np.array([-0.4, -0.7, 0.6])
ORANGE = np.array([0.9, 0.45, 0.15])
SLATE = (0.1, 0.22, 0.33, 1.0)
VIEW = (0.25, -1.0, 0.12)
COARSE = 0.5  # edges of the mesh for each spacing of the points
FRAMES, WAVING = 12, 20_000  # of the loop, and splats in it


def armature():
    """Add an armature for the armadillo."""
    bones = {name: (parent, np.array(head), np.array(tail)) for name, (parent, head, tail) in SPINE.items()}
    for name, (parent, *sides) in SIDES.items():
        for letter, (head, tail) in zip("RL", sides, strict=True):
            above = parent if parent in SPINE else f"{parent}.{letter}"
            bones[f"{name}.{letter}"] = above, np.array(head), np.array(tail)
    obj = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(obj)
    studio.activate(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    for name, (parent, head, tail) in bones.items():
        bone = obj.data.edit_bones.new(name)
        bone.head, bone.tail, bone.parent = head, tail, obj.data.edit_bones.get(parent)
    bpy.ops.object.mode_set(mode="OBJECT")
    return obj


def as_splats(points, laplacian):
    """Add splats in place of points: their discs, with the light of one lamp as colors."""
    core = studio.part("core")
    kept = laplacian.component >= 0
    points, normals, radii = points[kept], laplacian.normals[kept], laplacian.disc_radii[kept]
    side = np.cross(normals, np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]]))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    frames = np.stack([side, np.cross(normals, side), normals], axis=2)
    shade = 0.3 + 0.7 * np.maximum(normals @ (LIGHT / np.linalg.norm(LIGHT)), 0.0)
    splats = core.splats.Splats(
        positions=points,
        scales=radii[:, None] * [1.3, 1.3, 0.05],
        rotations=core.splats.ellipsoids.quaternions_of(np.moveaxis(frames, 0, 2)),
        opacities=np.full(len(points), 0.95),
        colors=(shade[:, None] * ORANGE - 0.5) / 0.2821,
        harmonics=np.zeros((len(points), 0, 3)),
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "armadillo.ply"
        core.splats.write_splats(path, splats)
        bpy.ops.meshfree.import_points(filepath=str(path), up="Z")
    return bpy.context.object


def select(*objects):
    """Select objects, the last one active."""
    for other in bpy.context.view_layer.objects:
        other.select_set(other in objects)
    studio.activate(objects[-1])


def rigged(*objects):
    """Let objects follow an armature for the armadillo; return it."""
    rig = armature()
    select(*objects, rig)
    bpy.ops.meshfree.auto_weights(at_once=True)
    for obj in objects:
        obj.meshfree.deform.preserve_volume = True
    return rig


def as_mesh(scan):
    """Add a mesh of a scan, with a quarter of its points, and leave the scan to be seen."""
    studio.activate(scan)
    bpy.ops.meshfree.mesh_surface(detail=COARSE)
    mesh = bpy.context.object
    scan.hide_set(False)
    scan.hide_render = False
    mesh.data.materials.clear()
    mesh.data.materials.append(studio.paint("Slate", SLATE))
    return mesh


def transferred(mesh, source, rig):
    """Let a mesh follow an armature by the weights of other points."""
    select(mesh, source)
    bpy.ops.meshfree.transfer_weights(show=False)
    select(mesh, rig)
    bpy.ops.object.parent_set(type="ARMATURE")
    mesh.modifiers["Armature"].use_deform_preserve_volume = True


def bind_armature(path):
    """The armadillo at rest, and in the pose of an armature: as a point cloud, as splats, and as a mesh."""
    core = studio.part("core")
    rest, obj = scan_pictures.scan("armadillo", copies=2)
    mesh = as_mesh(rest)
    for each in (rest, obj):
        select(each)
        bpy.ops.meshfree.analyze(show=False)
        studio.show(each, "lb_mean_curvature")
    bpy.ops.meshfree.convert()
    obj = bpy.context.object
    points = studio.world_points(obj)
    splats = as_splats(points, core.build_laplacian(points))
    rig = rigged(obj, splats)
    transferred(mesh, obj, rig)
    for name, angles in POSE.items():
        turn(rig, name, angles)
    for each in (obj, splats, mesh):
        select(each)
        if each is mesh:
            bpy.ops.object.modifier_apply(modifier="Armature")
        else:
            bpy.ops.meshfree.deform_update()
            bpy.ops.meshfree.deform_apply()
        place = each.matrix_world.copy()
        each.parent = None
        each.matrix_world = place
    bpy.data.objects.remove(rig)
    bpy.context.view_layer.update()
    studio.row([rest, obj, splats, mesh], path, legend=None, view=VIEW, size=(1000, 300))


def rig_wave(path):
    """The armadillo as splats, which waves by the bones of an arm."""
    core = studio.part("core")
    (scan,) = scan_pictures.scan("armadillo")
    points = studio.world_points(scan)
    points = points[core.clean.thin_out(points, count=WAVING)]
    splats = as_splats(points, core.build_laplacian(points))
    bpy.data.objects.remove(scan)
    rig = rigged(splats)

    def wave(share):
        for bone in rig.pose.bones:
            bone.matrix_basis = Matrix()
        bpy.context.view_layer.update()
        swing = np.sin(2.0 * np.pi * share)
        for name, angles in {
            "chest": (0, 3 * swing, 0),
            "upper_arm.R": (0, 15, 0),
            "lower_arm.R": (0, 30 * swing, 0),
        }.items():
            turn(rig, name, angles)
        turn(rig, "hand.R", (0, 25 * np.sin(2.0 * np.pi * (share - 0.1)), 0))
        turn(rig, "head", (0, 0, 12 + 4 * swing))
        studio.activate(splats)
        bpy.ops.meshfree.deform_update()

    studio.loop(splats, (partial(wave, share) for share in np.arange(FRAMES) / FRAMES), path, VIEW)


def turn(rig, name, angles):
    """Turn a bone in a pose about its head, by angles about the axes of the world, in degrees."""
    bone = rig.pose.bones[name]
    place = Matrix.Translation(Vector(bone.head))
    turned = Euler(np.radians(angles)).to_matrix().to_4x4()
    bone.matrix = place @ turned @ place.inverted() @ bone.matrix
    bpy.context.view_layer.update()


PICTURES = {"bind_armature": bind_armature, "rig_wave": rig_wave}
