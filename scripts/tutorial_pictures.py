"""Play docs/tutorial.md in the window and renew its sample and its pictures.

Use it by `python scripts/play.py scripts/tutorial_pictures.py`. It writes docs/coral.ply and
docs/pictures/tutorial_*.png.
"""

import tutorial
from environments import ROOT

PICTURES = ROOT / "docs" / "pictures"
POINTS = 10000
SAMPLE = """
mesh = bpy.data.meshes.new("Coral")
points = Coral().sample({count}).astype(np.float32)
colors = np.insert(Coral().paint(points) / 255.0, 3, 1.0, axis=1).astype(np.float32)
mesh.vertices.add(len(points))
mesh.vertices.foreach_set("co", points.reshape(-1))
mesh.color_attributes.new("Color", "BYTE_COLOR", "POINT").data.foreach_set("color_srgb", colors.reshape(-1))
obj = bpy.data.objects.new("Coral", mesh)
bpy.context.scene.collection.objects.link(obj)
bpy.context.view_layer.objects.active = obj
bpy.ops.meshfree.export_points(filepath={path!r}, attributes="NONE")
"""
RENDERING = """
scene = bpy.context.scene
scene.render.engine, scene.cycles.samples = "CYCLES", 32
scene.cycles.use_denoising = False  # Debian's Blender cannot
scene.render.resolution_x, scene.render.resolution_y = 960, 600
bpy.context.preferences.view.render_display_type = "AREA"
bpy.ops.ed.undo_push()
"""
RENDERED = "bpy.data.images['Render Result'].save_render(bpy.app.tempdir + 'result.png')"


def write_sample(gui):
    """Write the points that the tutorial begins with."""
    gui.new_file()
    path = gui.python("bpy.app.tempdir + 'coral.ply'")
    gui.python((ROOT / "scripts" / "coral.py").read_text(encoding="utf-8"))
    gui.python(SAMPLE.format(count=POINTS, path=path))
    tutorial.SAMPLE.write_bytes(gui.place.root.joinpath(path.lstrip("/")).read_bytes())


def keeper(gui):
    """Return what keeps the pictures: of the screen, and at last what was rendered."""

    def keep(name):
        if name == "import":  # the new file has its own settings
            gui.python(RENDERING)
        picture = gui.shot(f"tutorial_{name}")
        if name == "result":
            gui.python(RENDERED)
            picture = gui.place.root / gui.python("bpy.app.tempdir + 'result.png'").lstrip("/")
        target = PICTURES / f"tutorial_{name}.png"
        gui.pack(picture, target)
        print(f"{target.relative_to(ROOT)}: {target.stat().st_size / 1e3:.0f} kB", flush=True)

    return keep


if __name__ == "__main__":
    write_sample(gui)  # noqa: F821, scripts/play.py gives the window
    tutorial.play(gui, keeper(gui))  # noqa: F821
