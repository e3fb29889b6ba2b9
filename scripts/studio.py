"""Light, camera and picture for point clouds, in Blender's module: for the demonstration and the manual."""

import contextlib
import importlib
import math
import os
import sys

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

import package

MODULE = "bl_ext.user_default.meshfree_laplacian"
LEGEND_WIDTH = 0.38  # of the picture's height


@contextlib.contextmanager
def extension():
    """Install the built extension, and disable it at the end: Blender does not exit well with its classes."""
    archive = package.archive(package.this_platform())
    with silence():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.extensions.package_install_files(filepath=str(archive), repo="user_default", enable_on_install=True)
    try:
        yield
    except (RuntimeError, part("core").PointCloudError) as error:  # RuntimeError is what operators report
        sys.exit(str(error).strip())
    finally:
        bpy.ops.preferences.addon_disable(module=MODULE)


@contextlib.contextmanager
def silence():
    """Keep what Blender itself writes to the standard output out of it."""
    sys.stdout.flush()
    kept = os.dup(1)
    with open(os.devnull, "wb") as nothing:
        os.dup2(nothing.fileno(), 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)


def part(name):
    """Return a module of the installed extension, such as "ui.legend"."""
    return importlib.import_module(f"{MODULE}.{name}")


def set_up(scene, obj, size=(1280, 800), samples=16, view=(0.45, -1.0, 0.35)):
    """Set up a scene for pictures of an object: Cycles on the processor, colours as in the legend, a light surrounding.

    Parameters
    ----------
    scene : bpy.types.Scene
    obj : bpy.types.Object
        A mesh object of any size and place.
    size : tuple of 2 int
        Width and height of the pictures in pixels.
    samples : int
        Rays per pixel.
    view : sequence of 3 floats
        Direction from the object towards the camera.
    """
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples
    scene.cycles.use_denoising = False
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.image_settings.compression = 100
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    world = bpy.data.worlds.new("Studio")
    if world.node_tree is None:
        world.use_nodes = True
    tree = world.node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.98, 0.99, 1.0, 1.0)
    rays = tree.nodes.new("ShaderNodeLightPath")
    strength = tree.nodes.new("ShaderNodeMath")  # less as light than as what the camera sees
    strength.operation = "MULTIPLY_ADD"
    strength.inputs[1].default_value, strength.inputs[2].default_value = 0.25, 0.6
    tree.links.new(rays.outputs["Is Camera Ray"], strength.inputs[0])
    tree.links.new(strength.outputs[0], background.inputs["Strength"])
    scene.world = world

    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy = 1.3
    sun.data.angle = 0.3
    scene.collection.objects.link(sun)
    rotation = aim(scene, world_points(obj), view)
    sun.matrix_world = (rotation @ Euler((-0.6, -0.6, 0.0)).to_matrix()).to_4x4()  # behind the camera's left shoulder
    bpy.context.view_layer.update()


def world_points(obj):
    """Vertices of a mesh object in the world, (n, 3)."""
    points = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.attributes["position"].data.foreach_get("vector", points)
    matrix = np.array(obj.matrix_world, np.float64)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def aim(scene, points, view, margin=0.05):
    """Put the camera where it sees all points as large as the picture allows, left of the legend.

    Parameters
    ----------
    scene : bpy.types.Scene
    points : ndarray, (n, 3)
        What to see, in the world.
    view : sequence of 3 floats
        Direction from the points towards the camera; the world's z axis points upwards in the picture.
    margin : float
        Free border as a share of the picture's height.

    Returns
    -------
    mathutils.Matrix
        The camera's rotation.
    """
    forward = -Vector(view).normalized()
    right = forward.cross(Vector((0.0, 0.0, 1.0))).normalized()
    upward = right.cross(forward)
    axes = np.array([right, upward, forward])
    x, y, depth = axes @ points.T

    camera = scene.camera
    data = camera.data
    width, height = scene.render.resolution_x, scene.render.resolution_y
    slope = math.tan(data.angle / 2) * height / max(width, height)  # of the upper edge of the view
    vertical = slope * (1 - 2 * margin)
    leftmost = slope * (width / height - 2 * margin)
    rightmost = leftmost - 2 * slope * LEGEND_WIDTH
    # A camera at (cx, cy, -distance) sees a point if x - cx <= rightmost (depth + distance), and so on for each edge.
    east, west = (x - rightmost * depth).max(), (-x - leftmost * depth).max()
    north, south = (y - vertical * depth).max(), (-y - vertical * depth).max()
    distance = max((east + west) / (rightmost + leftmost), (north + south) / (2 * vertical))
    middle = 0.5 * (east - rightmost * distance - west + leftmost * distance), 0.5 * (north - south)

    rotation = Matrix((right, upward, -forward)).transposed()
    place = axes.T @ [*middle, -distance]
    camera.matrix_world = Matrix.Translation(place) @ rotation.to_4x4()
    data.clip_start = 0.01 * (distance + depth.min())
    data.clip_end = 100.0 * (distance + depth.max())
    return rotation


def picture(scene, obj, attribute, path):
    """Render an attribute of an object with its legend into a PNG file."""
    radius = 1.4 * part("operators.reading").spacing(obj.data)  # points that touch: a closed surface
    bpy.ops.meshfree.colormap(attribute=attribute, radius=radius)
    part("ui.legend").make_legend(scene, obj, scene.camera)
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
