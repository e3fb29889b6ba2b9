"""Render the pictures of the manual into docs/pictures/, in Blender's module. Started by in_blender.py."""

import bpy

import demo
import package
import studio

OUTPUT = package.ROOT / "docs" / "pictures"
SHOWN = {"area": "lb_area", "normal": "lb_normal", "curvature": "lb_mean_curvature", "mode": "lb_eigenvector_020"}


def main():
    """Show each result on the demonstration's shape."""
    OUTPUT.mkdir(parents=True, exist_ok=True)
    with studio.extension():
        with studio.silence():
            obj = demo.make_object(demo.Coral())
            bpy.ops.meshfree.spectrum(count=20, show=False)
            studio.set_up(bpy.context.scene, obj, size=(640, 400), samples=64)
        for name, attribute in SHOWN.items():
            path = OUTPUT / f"{name}.png"
            with studio.silence():
                studio.picture(bpy.context.scene, obj, attribute, path)
            print(f"written  {path.relative_to(package.ROOT)}", flush=True)


if __name__ == "__main__":
    main()
