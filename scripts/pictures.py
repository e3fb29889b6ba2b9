"""Render the pictures of the manual into docs/pictures/, in Blender's module. Started by in_blender.py."""

import bpy

import demo
import package
import studio

OUTPUT = package.ROOT / "docs" / "pictures"
SHOWN = {
    "area": "lb_area",
    "normal": "lb_normal",
    "curvature": "lb_mean_curvature",
    "gaussian": "lb_gaussian_curvature",
    "mode": "lb_eigenvector_020",
}
CUT = 0.45  # height at which the shape is cut open for the picture of a rim


def take(obj, shown):
    """Render attributes of an object, by the names of their pictures."""
    for name, attribute in shown.items():
        path = OUTPUT / f"{name}.png"
        with studio.silence():
            studio.picture(bpy.context.scene, obj, attribute, path)
        print(f"written  {path.relative_to(package.ROOT)}", flush=True)


def main():
    """Show each result on the demonstration's shape, and the rim on a part of it."""
    OUTPUT.mkdir(parents=True, exist_ok=True)
    points = demo.Coral().sample(demo.POINTS)
    with studio.extension():
        with studio.silence():
            whole = demo.make_object(points)
            bpy.ops.meshfree.spectrum(count=20, show=False)
            studio.set_up(bpy.context.scene, whole, size=(640, 400), samples=64)
        take(whole, SHOWN)
        with studio.silence():
            whole.hide_render = True
            part = demo.make_object(points[points[:, 2] < CUT])
            bpy.ops.meshfree.analyze(show=False)
        take(part, {"rim": "lb_boundary"})


if __name__ == "__main__":
    main()
