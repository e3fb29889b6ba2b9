"""Analyze a point cloud in Blender's module, print the results, and render them. Started by in_blender.py."""

import argparse
import math
import sys
from pathlib import Path
from time import perf_counter

import bpy

import studio
from coral import Coral

OUTPUT = Path("build", "demo")  # in the present folder, which in_blender.py lets be the tree
MODES = 30
SHOWN = 20
POINTS = 20_000
PICTURE = {"size": (1600, 620), "samples": 32}
LINES = 15  # of equal values of the mode


def load_scan(path, up):
    """Open a scan, and put it upright."""
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.meshfree.import_points(filepath=str(path))
    obj = bpy.context.object
    if up == "Y":
        obj.rotation_mode = "XYZ"
        obj.rotation_euler.x += math.pi / 2.0
    bpy.context.view_layer.update()
    return obj


def timed(name, operator, **options):
    """Run an operator on the active object and print how long each of its stages took."""
    began = perf_counter()
    with studio.silence():
        operator(**options)
    seconds = perf_counter() - began
    stages = bpy.context.object.meshfree.stages
    parts = ", ".join(f"{stage.name.lower()} {stage.seconds:.2f}" for stage in stages)
    print(f"{name:13}{seconds:.2f} s ({parts})", flush=True)


def demonstrate(scan, up):
    """Analyze the points, print the results, and write a .blend file and a picture."""
    shape = Coral()
    with studio.silence():
        obj = painted(shape) if scan is None else load_scan(scan, up)
    print(f"points       {len(obj.data.vertices):,}", flush=True)
    timed("analyze", bpy.ops.meshfree.analyze)
    timed("spectrum", bpy.ops.meshfree.spectrum, count=MODES, show=False)
    area = obj.meshfree.total_area
    exact = f" (exact: {shape.area():.6g})" if scan is None else ""
    print(f"total area   {area:.6g}{exact}")
    print(f"trusted area {obj.meshfree.trusted_area:.6g}")
    values = obj["lb_eigenvalues"]
    print(f"eigenvalues  {', '.join(f'{value:.4g}' for value in values[:8])}, ...")

    began = perf_counter()
    blend, picture = (OUTPUT.absolute() / name for name in ("demo.blend", "demo.png"))
    with studio.silence():
        take(obj, picture)
        bpy.ops.wm.save_as_mainfile(filepath=str(blend), compress=True)
    print(f"picture      {perf_counter() - began:.2f} s, as it is, mean curvature, and mode {SHOWN}")
    for path in (blend, picture):
        print(f"written      {path.relative_to(Path.cwd())}")


def painted(shape):
    """Add an object of points of a shape, in its colors."""
    points = shape.sample(POINTS)
    obj = studio.make_object(points, "Coral")
    studio.color(obj, shape.paint(points))
    return obj


def take(obj, path):
    """Render an object in its own colors, or as if made of clay, beside its mean curvature and a mode."""
    objects = [obj]
    for name in ("Curvature", "Mode"):
        objects.append(obj.copy())
        objects[-1].name, objects[-1].data = name, obj.data.copy()
        bpy.context.scene.collection.objects.link(objects[-1])
    _, curved, waving = objects
    colors = studio.part("operators.objects.colors").own_colors(obj.data)
    if colors:
        studio.show(obj, colors)
    else:
        studio.show_shape(obj, normals="lb_normal")
    studio.show(curved, "lb_mean_curvature")
    waving.meshfree.iso_lines = LINES
    studio.show(waving, f"lb_eigenvector_{SHOWN:03}")
    studio.line_up(objects, gap=0.1)
    studio.set_up(bpy.context.scene, objects, **PICTURE, legend=False)
    studio.render(bpy.context.scene, path)


def main():
    """Run the demonstration in the installed extension."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scan", nargs="?", type=Path, help="point cloud to analyze; without it, a shape made here")
    parser.add_argument("--up", choices="YZ", default="Y", help="axis of the scan that points upwards (default: Y)")
    arguments = parser.parse_args()
    if arguments.scan is not None and not arguments.scan.is_file():
        sys.exit(f"There is no file {arguments.scan}")
    OUTPUT.mkdir(parents=True, exist_ok=True)
    with studio.extension():
        demonstrate(arguments.scan, arguments.up)


if __name__ == "__main__":
    main()
