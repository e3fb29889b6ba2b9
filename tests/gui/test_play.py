"""What an artist does, with real keys and a real mouse."""

import pytest

RESULTS = "result_names(bpy.context.object)"
ANALYZED = "'lb_area' in bpy.context.object.data.attributes"
WORKING = "[operator.bl_idname for operator in main_window().modal_operators]"


def add_sphere(gui, count=3000, noise=0.0):
    """Add a selected cloud on a sphere, as a step that can be undone to."""
    gui.python(
        f"""
points = sphere_points({count})
points *= 1.0 + {noise} * np.random.default_rng(1).standard_normal((len(points), 1))
add_object(points).select_set(True)
bpy.ops.ed.undo_push(message="Cloud")
before = everything(bpy.context.object)
"""
    )


def run(gui, name):
    """Start an operator by the search, and confirm its dialog."""
    gui.search(name)
    gui.key("Return")


def shading(gui, kind):
    gui.python(f"view3d()[0].spaces.active.shading.type = {kind!r}")


class TestAnalysis:
    """From a cloud to colors and back."""

    def test_analyze_by_the_button(self, gui):
        add_sphere(gui)
        shading(gui, "WIREFRAME")  # without shaders to compile
        gui.open_tab()
        gui.press("meshfree.analyze")
        gui.wait_until(ANALYZED, 60)
        assert gui.python("attribute(bpy.context.object, 'lb_area').sum()") == pytest.approx(12.566, rel=5e-3)
        gui.shot("analyzed")
        gui.point_at_view()
        gui.key("ctrl+z")
        gui.wait_until(f"not {ANALYZED}")
        assert gui.python("everything(bpy.context.object) == before")
        gui.key("ctrl+shift+z")
        gui.wait_until(ANALYZED)
        assert gui.python(RESULTS) == gui.python("RESULTS") + gui.python(
            "[f'lb_eigenvector_{index:03}' for index in range(1, 11)]"
        )


class TestJobs:
    """Work that goes on while the window stays alive."""

    def test_escape_leaves_the_object_as_it_was(self, gui):
        add_sphere(gui, 20000, 0.005)
        run(gui, "Smooth Points")
        gui.wait_until(WORKING)
        gui.shot("working")
        gui.key("Escape")
        gui.wait_until(f"not {WORKING}", 10)
        assert gui.python("everything(bpy.context.object) == before")
