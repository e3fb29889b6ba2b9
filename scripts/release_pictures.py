"""The first picture of the README; icon and featured picture of the page on Blender's platform: by pictures.py."""

import math

import bpy
from mathutils import Matrix

import animation
import studio
from coral import Coral, spread_directions

ICON, FIRST, FEATURED = (256, 256), (1200, 460), (1920, 1080)  # pixels
VIEW = (0.5, -1.0, 0.6)  # direction towards the camera of the icon
BEADS, BEAD = 600, 0.8  # points of the icon, few enough to be seen as such, and their radius in units of their spacing
AMPLITUDE = 0.45  # of its radius
POINTS, GAP = 40_000, 0.1
SHAPE = {"arms": 15, "height": 1.4, "sharpness": 15.0}
TIP, BENT, STAYS = (1.0, 0.3, 0.2), 0.45, -0.2  # the arm that is bent, by what within this of its tip, and what stays
LIT = 0.7  # so that the form of the surface shows beside its colors
COLORS = 255
INK = (0.03, 0.035, 0.045, 1.0)
TITLE = "Mesh-Free Laplacian"
TAGLINE = "Geometry processing on point clouds, without a mesh"


def icon(path):
    """A sphere of beads that waves by the spherical harmonic of the cube, on nothing: a shape that reads when small."""
    points = spread_directions(BEADS)
    wave = (points**4).sum(axis=1) - 0.6
    wave /= wave.max()
    points *= 1.0 + AMPLITUDE * wave[:, None]
    obj = studio.make_object(points, "Beads")
    studio.part("operators.objects.attributes").write_attribute(obj.data, "Wave", wave)
    obj.meshfree.color_map = "VIRIDIS"
    studio.show(obj, "Wave", BEAD)
    scene = bpy.context.scene
    studio.set_up(scene, obj, ICON, studio.SAMPLES, VIEW, legend=False)
    whole = (1.0 + BEAD * studio.part("operators.objects.reading").spacing(obj.data)) * points
    studio.aim(scene, whole, VIEW, margin=0.01, room=0.0)
    scene.render.film_transparent = True
    scene.render.image_settings.color_mode = "RGBA"
    studio.render(scene, path)


def show_wow(size):
    """Set up a scene with a coral, of our own making as if scanned, in its colors, by its curvature, and bent."""
    points, colors = Coral(**SHAPE).scan(POINTS)
    colored, curved, bent = objects = [studio.make_object(points, name) for name in ("Colors", "Curvature", "Bend")]
    for obj in objects:
        studio.color(obj, colors)
    studio.show(colored, "Color")
    studio.activate(curved)
    bpy.ops.meshfree.analyze()
    studio.show(curved, "lb_mean_curvature")
    studio.group(bent, studio.tip(bent, TIP), "HANDLE", grown=BENT)
    studio.group(bent, points[:, 2] < STAYS, "ANCHOR")
    studio.deform(bent, move=(-0.5, -0.2, 1.2), rotate=(0.0, -1.2, 0.0))
    bpy.ops.meshfree.deform_apply()
    bpy.ops.meshfree.deform_unbind()
    studio.show(bent, "Color")
    for obj in objects:
        obj.meshfree.shaded = LIT
    studio.line_up(objects, gap=GAP)
    studio.set_up(bpy.context.scene, objects, size, studio.SAMPLES, legend=False)


def render(path):
    """Render the scene in few colors."""
    studio.render(bpy.context.scene, path)
    animation.write_still(path, studio.pixels(path), COLORS)


def first(path):
    """What the README begins with."""
    show_wow(FIRST)
    render(path)


def featured(path):
    """The same under the name of the extension."""
    show_wow(FEATURED)
    write(bpy.context.scene, TITLE, 0.11, 0.36)
    write(bpy.context.scene, TAGLINE, 0.042, -0.42)
    render(path)


def write(scene, text, size, place):
    """Write a line in the middle of the picture, its size and height over the middle in shares of the picture's."""
    camera, width, height = scene.camera, *FEATURED
    depth = 2.0 * camera.data.clip_start
    unit = 2.0 * depth * math.tan(camera.data.angle / 2.0) * height / width
    line = bpy.data.objects.new(text, bpy.data.curves.new(text, "FONT"))
    line.data.body, line.data.size = text, size * unit
    line.data.align_x = line.data.align_y = "CENTER"
    line.data.materials.append(studio.paint("Ink", INK))
    line.visible_shadow = False
    line.matrix_world = camera.matrix_world @ Matrix.Translation((0.0, place * unit, -depth))
    scene.collection.objects.link(line)


PICTURES = {"icon": icon, "first": first, "featured": featured}
