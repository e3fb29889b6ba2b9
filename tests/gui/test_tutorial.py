"""docs/tutorial.md and docs/rig_a_scan.md, followed word by word by somebody who does nothing else."""

import numpy as np
import pytest

import rig_tutorial
import tutorial

# Small and plain, for a machine without a graphics card.
RENDERING = """
scene = bpy.context.scene
scene.eevee.taa_render_samples, scene.render.resolution_percentage = 1, 15
bpy.context.preferences.view.render_display_type = "AREA"
bpy.ops.ed.undo_push()
"""
SELECTED = """
coral = bpy.data.objects["coral"]
chosen = np.ones(len(coral.data.vertices), bool)
coral.data.vertices.foreach_get("select", chosen)
[bpy.context.object.name, coral.select_get(), chosen.sum()]
"""
PLACES = """
coral = bpy.data.objects["coral"]  # another one after undo
coral.update_from_editmode()
places = np.array([vertex.co[:] for vertex in coral.data.vertices])
"""
RENDERED = """
bpy.data.images["Render Result"].save_render(bpy.app.tempdir + "result.png")
image = bpy.data.images.load(bpy.app.tempdir + "result.png")
np.ptp(np.array(image.pixels).reshape(-1, 4)[:, :3], axis=1).max()
"""


class Seen:
    """Looks at what is there where the tutorial has a picture."""

    def __init__(self, gui):
        self.gui, self.names = gui, []

    def __call__(self, name):
        self.gui.shot(f"tutorial_{name}")
        self.names.append(name)
        looks = {"import": self.imported, "groups": self.groups, "bent": self.bent, "result": self.result}
        looks.get(name, lambda: None)()

    def imported(self):
        """The object is selected, none of its points is; what is rendered later takes little time."""
        assert self.gui.python(SELECTED) == ["coral", True, 0]
        self.gui.python(RENDERING)

    def groups(self):
        """The groups hold what the boxes were drawn around, and nothing else."""
        self.gui.python(PLACES)
        anchors = np.array(self.gui.python("places[members('Anchor'), 0]"))
        assert anchors.min() == pytest.approx(0.2, abs=0.02)
        right = self.gui.python("(places[:, 0] > 0.2).sum()")
        assert 0.8 * right < len(anchors) <= 1.01 * right  # Blender leaves out what is behind another vertex
        handles = np.array(self.gui.python("places[members('Handle')]"))
        assert (handles[:, 0].min(), handles[:, 0].max()) == pytest.approx((-2.0, -1.3), abs=0.15)
        assert 300 < len(handles) < 1500

    def bent(self):
        """The arm follows, the anchors stay."""
        self.gui.python("moved = np.linalg.norm(attribute(coral, 'lb_displacement'), axis=1)")
        assert self.gui.python("moved[members('Anchor')].max()") < 1e-3
        assert self.gui.python("moved[members('Handle')].max()") > 1.0

    def result(self):
        """The picture has the colors of the legend at least."""
        assert self.gui.python(RENDERED) > 0.3


def test_every_step_as_it_is_written(gui):
    seen = Seen(gui)
    tutorial.play(gui, seen)
    assert seen.names == ["import", "dragged", "colors", "groups", "bent", "display", "result"]
    assert gui.python("coral.data.attributes['lb_displacement'].data[0].vector[:]") == [0.0, 0.0, 0.0]


ENDS = "[end for bone in bpy.context.object.data.edit_bones for end in (*bone.head, *bone.tail)]"
BENT = """
coral = bpy.data.objects["coral"]
shown = {item.name: item.show_viewport for item in coral.modifiers}
for item in coral.modifiers:  # the display draws discs in place of the points
    item.show_viewport = item.type == "ARMATURE"
bpy.context.view_layer.update()
rest = attribute(coral, "position")
moved = np.linalg.norm(attribute(coral.evaluated_get(bpy.context.evaluated_depsgraph_get()), "position") - rest, axis=1)
for item in coral.modifiers:
    item.show_viewport = shown[item.name]
[float(moved[rest[:, 0] < -1.6].min()), float(np.median(moved[rest[:, 0] > 0.3]))]
"""


def test_every_step_of_the_rig_as_it_is_written(gui):
    names = []

    def keep(name):
        names.append(name)
        if name == "bones":
            assert gui.python(ENDS) == pytest.approx([0, 0, 0, -0.8, 0, -0.4, -0.8, 0, -0.4, -1.8, 0, -0.9], abs=1e-6)
        elif name == "posed":
            arm, rest = gui.python(BENT)
            assert arm > 0.2
            assert rest < 0.3 * arm  # two bones share all of the coral

    rig_tutorial.play(gui, keep)
    assert names == ["import", "bones", "posed", "played"]
