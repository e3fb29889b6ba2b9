"""Light, camera and picture for point clouds, in Blender's module: for the demonstration and the manual."""

import contextlib
import importlib
import math
import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

import animation
import package

MODULE = "bl_ext.user_default.meshfree_laplacian"
LEGEND_WIDTH = 0.38  # of the picture's height
VIEW = (0.45, -1.0, 0.35)  # direction towards the camera
LENS, FAR_LENS = 50.0, 250.0  # focal length, mm; objects in a row are seen from the same side by the latter
TOUCHING = 1.6  # radius of dots that make a closed surface, in units of their spacing
CLOSED = 2.0  # without any gap, which would show as dark holes in clay
SIZE, WIDE, SMALL = (640, 400), (800, 360), (320, 240)  # of pictures of the manual, in pixels
LOOP_SAMPLES = 6  # rays per pixel of the pictures of a loop, whose colors are few
DELAY = 120  # milliseconds from one picture of a loop to the next
SAMPLES = 64  # rays per pixel of these
LEVELS = 52  # of each color in pictures of many objects: the background stays gray
CLAY = (0.62, 0.58, 0.52, 1.0)
HANDLES, ANCHORS = (0.8, 0.05, 0.02, 1.0), (0.03, 0.12, 0.4, 1.0)
MARKS = 1.1 * CLOSED  # radius of their points


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


def set_up(scene, obj, size=(1280, 800), samples=16, view=VIEW, legend=True):
    """Set up a scene for pictures of objects: Cycles on the processor, colours as in the legend, a light surrounding.

    Parameters
    ----------
    scene : bpy.types.Scene
    obj : bpy.types.Object or list of them
        Mesh objects of any size and place.
    size : tuple of 2 int
        Width and height of the pictures in pixels.
    samples : int
        Rays per pixel.
    view : sequence of 3 floats
        Direction from the objects towards the camera.
    legend : bool
        Leave room for a legend.
    """
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0  # objects shed none of their colour on each other
    scene.cycles.transparent_max_bounces = 128  # splats lie behind each other
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.image_settings.compression = 100
    scene.render.dither_intensity = 0.0  # noise that does not compress
    scene.render.image_settings.color_mode = "RGB"
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
    objects = obj if isinstance(obj, list) else [obj]
    scene.camera.data.lens = LENS if len(objects) == 1 else FAR_LENS
    points = np.concatenate([world_points(one) for one in objects])
    rotation = aim(scene, points, view, room=LEGEND_WIDTH if legend else 0.0)
    sun.matrix_world = (rotation @ Euler((-0.6, -0.6, 0.0)).to_matrix()).to_4x4()  # behind the camera's left shoulder
    bpy.context.view_layer.update()


def make_object(points, name):
    """Add an object of loose vertices, (n, 3), and make it active."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", points.astype(np.float32).reshape(-1))
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj
    return obj


def color(obj, colors):
    """Give the points of an object colors of sRGB, (n, 3) uint8."""
    layer = obj.data.color_attributes.new("Color", "BYTE_COLOR", "POINT")
    layer.data.foreach_set("color_srgb", np.insert(colors / 255.0, 3, 1.0, axis=1).astype(np.float32).reshape(-1))


def world_points(obj):
    """Points of an object in the world, (n, 3)."""
    positions = obj.data.attributes["position"].data
    points = np.empty(3 * len(positions), np.float32)
    positions.foreach_get("vector", points)
    matrix = np.array(obj.matrix_world, np.float64)
    return points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def picture_axes(view):
    """Return the directions to the right, upwards and away from the camera, for a direction towards the camera."""
    forward = -Vector(view).normalized()
    right = forward.cross(Vector((0.0, 0.0, 1.0))).normalized()
    return right, right.cross(forward), forward


def line_up(objects, view=VIEW, gap=0.2):
    """Move objects into a row from left to right in the picture, with gaps in shares of the first one's width."""
    right = picture_axes(view)[0]
    end = width = 0.0
    for index, obj in enumerate(objects):
        along = world_points(obj) @ np.array(right)
        width = width or np.ptp(along)
        if index:
            obj.location += float(end + gap * width - along.min()) * right
        bpy.context.view_layer.update()
        end = (world_points(obj) @ np.array(right)).max()


def aim(scene, points, view, margin=0.05, room=LEGEND_WIDTH):
    """Put the camera where it sees all points as large as the picture allows, left of the legend.

    Parameters
    ----------
    scene : bpy.types.Scene
    points : ndarray, (n, 3)
        What to see, in the world; a few far from the others are left out.
    view : sequence of 3 floats
        Direction from the points towards the camera; the world's z axis points upwards in the picture.
    margin : float
        Free border as a share of the picture's height.
    room : float
        For the legend, as a share of the picture's height.

    Returns
    -------
    mathutils.Matrix
        The camera's rotation.
    """
    right, upward, forward = picture_axes(view)
    axes = np.array([right, upward, forward])
    x, y, depth = axes @ part("core").geometry.without_far(points).T

    camera = scene.camera
    data = camera.data
    width, height = scene.render.resolution_x, scene.render.resolution_y
    slope = math.tan(data.angle / 2) * height / max(width, height)  # of the upper edge of the view
    vertical = slope * (1 - 2 * margin)
    leftmost = slope * (width / height - 2 * margin)
    rightmost = leftmost - 2 * slope * room
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


def show(obj, attribute, radius=0.0):
    """Show an attribute of an object as colours on its surface, or on dots of a radius in units of their spacing."""
    activate(obj)
    if radius:
        obj.meshfree.point_shape = "DOTS"
    elif part("operators.objects.attributes").DISC not in obj.data.attributes:
        bpy.ops.meshfree.show_surface()
    bpy.ops.meshfree.colormap(attribute=attribute, radius=radius * part("operators.objects.reading").spacing(obj.data))


def show_shape(obj, normals="", like=None):
    """Show an object as if made of clay, its points as large as those of another one.

    An attribute of normals makes the shading smooth.
    """
    modifier = add_display(obj, CLOSED * part("operators.objects.reading").spacing((like or obj).data))
    part("operators.objects.modifiers").set_input(modifier, "Material", paint("Clay", CLAY, normals))


def mark(points, color, radius):
    """Add points of one colour to the scene, (n, 3), such as the handles of a deformation."""
    obj = make_object(points, "Marks")
    part("operators.objects.modifiers").set_input(add_display(obj, radius), "Material", paint("Mark", color))
    return obj


def add_display(obj, radius):
    """Make an object's vertices round points of this radius, and return the modifier."""
    modifier = part("ui.display").find_display(obj) or obj.modifiers.new("Points", "NODES")
    modifier.node_group = part("ui.nodes").display_group()
    part("operators.objects.modifiers").set_input(modifier, "Radius", radius)
    return modifier


def paint(name, color, normals=""):
    """Return a matt material of one colour, lit by an attribute of normals, if given, on the side that is seen."""
    material = bpy.data.materials.new(name)
    tree = part("ui.materials").new_tree(material)
    normal = None
    if normals:
        turned = tree.node(
            "ShaderNodeVectorTransform",
            tree.node("ShaderNodeAttribute", attribute_name=normals).outputs["Vector"],
            vector_type="NORMAL",
            convert_from="OBJECT",
            convert_to="WORLD",
        )
        away = tree.vector("SCALE", tree.node("ShaderNodeNewGeometry").outputs["Incoming"], -1.0)
        normal = tree.vector("FACEFORWARD", turned, away, turned)
    tree.output("ShaderNodeOutputMaterial", tree.node("ShaderNodeBsdfDiffuse", color, Normal=normal))
    return material


def picture(scene, obj, attribute, path):
    """Render an attribute of an object with its legend into a PNG file."""
    show(obj, attribute)
    part("ui.legend").make_legend(scene, obj, scene.camera)
    render(scene, path)


def render(scene, path):
    """Render the scene as it is into a PNG file."""
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def single(obj, attribute, path, view=VIEW):
    """Render an attribute of one object into a picture of the manual."""
    scene = bpy.context.scene
    activate(obj)
    set_up(scene, obj, SIZE, SAMPLES, view)
    picture(scene, obj, attribute, path)


def row(objects, path, legend, view=VIEW, size=WIDE):
    """Render objects side by side as they are shown, with the legend of one of them, or none."""
    line_up(objects, view)
    take(path, legend, view, size)


def grid(rows, path, view=VIEW, size=WIDE, gap=0.15):
    """Render rows of objects as they are shown, in cells of one size with gaps in shares of it, without a legend."""
    axes = np.array(picture_axes(view)[:2])
    spans = [[world_points(obj) @ axes.T for obj in objects] for objects in rows]
    cell = (1.0 + gap) * np.max([np.ptp(span, axis=0) for line in spans for span in line], axis=0)
    for i, objects in enumerate(rows):
        for j, obj in enumerate(objects):
            middle = 0.5 * (spans[i][j].min(axis=0) + spans[i][j].max(axis=0))
            obj.location += Vector((cell * (j, -i) - middle) @ axes)
    bpy.context.view_layer.update()
    take(path, None, view, size)
    _thin(path)


def _thin(path):
    """Save a picture with so many levels of each color that noise adds little to its size."""
    image = bpy.data.images.load(str(path))
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    image.pixels.foreach_set(np.rint((LEVELS - 1) * values) / (LEVELS - 1))
    image.save_render(str(path), scene=bpy.context.scene)


def take(path, legend, view=VIEW, size=WIDE):
    """Render all that is in the scene into a picture of the manual."""
    scene = bpy.context.scene
    shown = [obj for obj in scene.objects if obj.type in ("MESH", "POINTCLOUD")]
    set_up(scene, shown, size, SAMPLES, view, legend is not None)
    if legend is not None:
        part("ui.legend").make_legend(scene, legend, scene.camera)
    render(scene, path)


def loop(obj, changes, path, view=VIEW):
    """Render an object after each of some changes into an animated picture of the manual.

    Parameters
    ----------
    obj : bpy.types.Object
    changes : iterable of callable
        Functions without arguments.
    path : pathlib.Path
    view : sequence of 3 floats
        Direction from the object towards the camera.
    """
    scene, stills = bpy.context.scene, []
    set_up(scene, obj, SMALL, LOOP_SAMPLES, view, legend=False)
    with TemporaryDirectory() as folder:
        still = Path(folder) / "still.png"
        for change in changes:
            change()
            render(scene, still)
            stills.append(pixels(still))
    animation.write_loop(path, np.array(stills), DELAY)


def pixels(path):
    """Return the pixels of a picture from its top left on, (height, width, 3) uint8."""
    image = bpy.data.images.load(str(path))
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    width, height = image.size
    bpy.data.images.remove(image)
    return np.rint(255.0 * values.reshape(height, width, -1)[::-1, :, :3]).astype(np.uint8)


def set_range(obj, low, high):
    """Set the range of the colours of an object, as in the panel."""
    obj.meshfree.range_low, obj.meshfree.range_high = low, high
    obj.meshfree.range_mode = "LOCKED"


def activate(obj):
    """Make an object the active one."""
    bpy.context.view_layer.objects.active = obj


def group(obj, chosen, role, name="", grown=0.0):
    """Put points of an object, (n,) bool, and those within a distance of them, into a vertex group."""
    activate(obj)
    part("operators.tools.select").select(bpy.context, obj, chosen)
    if grown:
        bpy.ops.meshfree.select_grow(distance=grown)
    bpy.ops.meshfree.group_from_selection(role=role, name=name)


def tip(obj, direction):
    """Return which point of an object lies farthest in a direction, (n,) bool."""
    along = world_points(obj) @ np.array(direction, dtype=float)
    return np.arange(len(along)) == along.argmax()


def harmonic_field(obj, low, high):
    """Compute the harmonic field between the tips of an object that lie farthest in two directions."""
    for name, direction in (("Low", low), ("High", high)):
        group(obj, tip(obj, direction), "VALUE", name, grown=0.5)
    bpy.ops.meshfree.harmonic_field(values="GROUPS", low_group="Low", high_group="High")


def deform(obj, move, rotate=(0.0, 0.0, 0.0)):
    """Deform an object by its groups: move the empty of its handles, and rotate it by Euler angles, in world space."""
    activate(obj)
    bpy.ops.meshfree.deform_bind()
    empty = obj.meshfree.deform.handle_items[0].empty
    place = empty.matrix_world.translation.copy()
    rotated = Euler(rotate).to_matrix().to_4x4() @ Matrix.Translation(-place) @ empty.matrix_world
    empty.matrix_world = Matrix.Translation(place + Vector(move)) @ rotated
    bpy.ops.meshfree.deform_update()


def deformed_row(rest, obj, path, view=VIEW, size=(960, 340)):
    """Render an object at rest and deformed, with its handles and anchors, and deformed with its displacement."""
    displacement = part("operators.objects.attributes").read_attribute(obj.data, "lb_displacement")
    activate(obj)
    bpy.ops.meshfree.deform_apply()
    bpy.ops.meshfree.deform_unbind()
    colored = make_object(world_points(obj), "Colored")
    part("operators.objects.attributes").write_attribute(colored.data, "lb_displacement", displacement)
    colored.meshfree.coverage = 100.0
    show(colored, "lb_displacement", TOUCHING)  # like those beside it
    for shape in (rest, obj):
        activate(shape)
        bpy.ops.meshfree.analyze(show=False)
        show_shape(shape, normals="lb_normal")
    line_up([rest, obj, colored], view)
    radius = MARKS * part("operators.objects.reading").spacing(rest.data)
    for name, color in (("Handle", HANDLES), ("Anchor", ANCHORS)):
        members = part("operators.objects.groups").chosen_members(obj, name, name)
        for shape in (rest, obj):
            mark(world_points(shape)[members], color, radius)
    take(path, colored, view, size)
