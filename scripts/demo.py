"""Analyze a point cloud in Blender's module, print the results, and render them. Started by in_blender.py."""

import argparse
import math
import sys
from pathlib import Path
from time import perf_counter

import bpy
import numpy as np

import package
import studio

OUTPUT = package.ROOT / "build" / "demo"
MODES = 30
SHOWN = 20
POINTS = 20_000
GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))


def spread_directions(count):
    """Spread directions evenly along a spiral, (count, 3)."""
    index = np.arange(count) + 0.5
    height = 1.0 - 2.0 * index / count
    width = np.sqrt(1.0 - height**2)
    return np.stack([width * np.cos(GOLDEN_ANGLE * index), width * np.sin(GOLDEN_ANGLE * index), height], axis=1)


class Coral:
    """A closed surface with arms: the distance from its centre is a sum of smooth bumps about some directions."""

    def __init__(self, arms=9, height=1.25, sharpness=9.0):
        self._arms = spread_directions(arms)
        self._heights = height * (1.0 + 0.35 * np.cos(2.0 * GOLDEN_ANGLE * (np.arange(arms) + 0.5) + 1.0))
        self._sharpness = sharpness

    def radii(self, directions):
        """Distance of the surface from the centre, and surface area per solid angle, by direction."""
        bumps = self._heights * np.exp(self._sharpness * (directions @ self._arms.T - 1.0))
        radii = 0.7 + bumps.sum(axis=1)
        along = (bumps @ self._arms) * self._sharpness
        along -= (along * directions).sum(axis=1, keepdims=True) * directions
        return radii, radii * np.sqrt(radii**2 + (along**2).sum(axis=1))

    def area(self, count=400_000):
        """Area of the surface, by a sum over directions that are spread evenly."""
        return 4.0 * math.pi * self.radii(spread_directions(count))[1].mean()

    def sample(self, count, seed=2):
        """Draw points at random, evenly over the area."""
        random = np.random.default_rng(seed)
        directions = random.normal(size=(40 * count, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        radii, densities = self.radii(directions)
        kept = np.flatnonzero(random.random(len(radii)) * densities.max() < densities)[:count]
        return radii[kept, None] * directions[kept]


def load_scan(path, up):
    """Open a scan as the command line does, and put it upright."""
    obj, _ = studio.part("operators.files").load(path)
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
        obj = studio.make_object(shape.sample(POINTS), "Coral") if scan is None else load_scan(scan, up)
    print(f"points       {len(obj.data.vertices):,}", flush=True)
    timed("analyze", bpy.ops.meshfree.analyze, show=False)
    timed("spectrum", bpy.ops.meshfree.spectrum, count=MODES, show=False)
    area = obj.meshfree.total_area
    exact = f" (exact: {shape.area():.6g})" if scan is None else ""
    print(f"total area   {area:.6g}{exact}")
    values = obj["lb_eigenvalues"]
    print(f"eigenvalues  {', '.join(f'{value:.4g}' for value in values[:8])}, ...")

    began = perf_counter()
    blend, picture = OUTPUT / "demo.blend", OUTPUT / "demo.png"
    with studio.silence():
        studio.set_up(bpy.context.scene, obj)
        studio.picture(bpy.context.scene, obj, f"lb_eigenvector_{SHOWN:03}", picture)
        bpy.ops.wm.save_as_mainfile(filepath=str(blend), compress=True)
    print(f"picture      {perf_counter() - began:.2f} s, mode {SHOWN}")
    for path in (blend, picture):
        print(f"written      {path.relative_to(package.ROOT)}")


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
