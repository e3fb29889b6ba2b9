"""The icon and the featured picture of the extension's page on Blender's platform, rendered by pictures.py."""

import math

import bpy
from mathutils import Matrix

import animation
import demo
import studio
from coral import spread_directions

ICON, FEATURED = (256, 256), (1920, 1080)  # pixels
VIEW = (0.5, -1.0, 0.6)  # direction towards the camera of the icon
BEADS, BEAD = 600, 0.8  # points of the icon, few enough to be seen as such, and their radius in units of their spacing
AMPLITUDE = 0.45  # of its radius
SHOWN, DOT = 2500, 0.42  # the same for the points of the other picture
MODE = 20
LINES, GAP = 15, 0.12
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


def featured(path):
    """From points to the curvature of their surface and to a mode of it, under the name of the extension."""
    points = demo.Coral().sample(demo.POINTS)
    kept = studio.part("core").clean.thin_out(points, count=SHOWN)
    raw, curved, waving = (
        studio.make_object(part, name)
        for part, name in ((points[kept], "Points"), (points, "Curvature"), (points, "Mode"))
    )
    dots = studio.add_display(raw, DOT * studio.part("operators.objects.reading").spacing(raw.data))
    studio.part("operators.objects.modifiers").set_input(dots, "Material", studio.paint("Points", studio.CLAY))
    studio.activate(curved)
    bpy.ops.meshfree.analyze()
    studio.show(curved, "lb_mean_curvature")
    studio.activate(waving)
    bpy.ops.meshfree.spectrum(count=MODE)
    waving.meshfree.iso_lines = LINES
    studio.show(waving, f"lb_eigenvector_{MODE:03}")
    objects = [raw, curved, waving]
    studio.line_up(objects, gap=GAP)
    scene = bpy.context.scene
    studio.set_up(scene, objects, FEATURED, studio.SAMPLES, legend=False)
    write(scene, TITLE, 0.11, 0.36)
    write(scene, TAGLINE, 0.042, -0.42)
    studio.render(scene, path)
    animation.write_still(path, studio.pixels(path), COLORS)


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


PICTURES = {"icon": icon, "featured": featured}
