"""Dialogs and file browsers: closing one changes nothing, and OK does what it says."""

import pytest

from tests.gui.test_play import UNCHANGED, WORKING

KEYS = "bpy.context.object.data.shape_keys and bpy.context.object.data.shape_keys.key_blocks.keys()"
CLOUD = """
points, outermost = grid_points(40, 30)
cloud = add_object(points)
cloud.select_set(True)
cloud.meshfree.neighbors = 20  # fine enough for a hundred modes
add_group(cloud, "Fixed", outermost)
add_group(cloud, "Source", [0])
for column, value in ((0, 0.1), (39, 0.9)):
    group = cloud.vertex_groups.get("Value") or cloud.vertex_groups.new(name="Value")
    group.add(np.flatnonzero(np.arange(len(points)) % 40 == column).tolist(), value, "REPLACE")
view3d()[0].spaces.active.shading.type = "WIREFRAME"
bpy.ops.ed.undo_push(message="Cloud")
before = everything(cloud)
"""
# By what the search finds: what there is after OK, and not before.
DIALOGS = {
    "Smooth Points": f"{KEYS} == ['Basis', 'Smooth']",
    "Mesh-Free Deform by Mode": f"len({KEYS} or ()) == 2",
    "Mesh-Free Segment": "'lb_segment' in bpy.context.object.data.attributes",
    "Mesh-Free Signatures": "len(result_names(bpy.context.object)) > 0",
    "Geodesic Distance": "'lb_distance' in bpy.context.object.data.attributes",
    "Harmonic Field": "'lb_field' in bpy.context.object.data.attributes",
    "Mesh-Free Minimal Surface": f"len({KEYS} or ()) == 2",
}
BROWSING = "any(area.type == 'FILE_BROWSER' for area in main_window().screen.areas)"
# By what the search finds: the ending of the file.
EXPORTS = {"Export Points": ".ply", "Export Laplacian": ".npz", "Export Eigenvalues": ".csv"}


@pytest.fixture
def cloud(gui):
    """A flat cloud with groups, for which every dialog has what it takes."""
    gui.python(CLOUD)
    gui.settle()
    return gui


@pytest.fixture
def browsing(cloud):
    """The same in a folder of its own; file browsers open in the window, where the keys go."""
    cloud.python(
        """
import os
folder = os.path.join(bpy.app.tempdir, "browsed")
os.makedirs(folder, exist_ok=True)
for name in os.listdir(folder):
    os.remove(os.path.join(folder, name))
bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
bpy.ops.meshfree.spectrum(count=3)
bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "browsed.blend"))
before = everything(bpy.context.object)
"""
    )
    yield cloud
    cloud.python("bpy.context.preferences.view.filebrowser_display_type = 'WINDOW'")


def browse(gui, name):
    """Open a file browser by the search, with the mouse on its files."""
    gui.search(name)
    gui.wait_until(BROWSING)
    x, y, width, height = gui.region("WINDOW", "FILE_BROWSER")
    gui.move(x + 0.5 * width, y + 0.8 * height)


class TestDialogs:
    """What asks before it works."""

    def test_a_click_outside(self, cloud):
        cloud.search("Smooth Points")
        x, y, width, height = cloud.region()
        cloud.click(x + 0.05 * width, y + 0.95 * height)
        cloud.wait_until(f"not {WORKING}")
        assert cloud.python(UNCHANGED)
        cloud.key("Escape")
        assert cloud.python(UNCHANGED)

    @pytest.mark.parametrize(("name", "done"), DIALOGS.items(), ids=DIALOGS.keys())
    def test_closing_and_ok(self, cloud, name, done):
        closed = cloud.pixels(cloud.region())
        cloud.search(name)
        cloud.wait_for(
            lambda: (closed != cloud.pixels(cloud.region())).any(axis=2).sum() > 5000, "the dialog is on the screen"
        )
        cloud.key("Escape")
        cloud.point_at_view()
        cloud.wait_until(f"not {WORKING}")
        assert cloud.python(UNCHANGED)
        assert not cloud.python(f"bool({done})")
        cloud.search(name)
        cloud.key("Return")
        cloud.wait_until(f"bool({done})", 60)
        cloud.wait_until(f"not {WORKING}")
        cloud.point_at_view()
        cloud.key("ctrl+z")
        cloud.wait_until(f"not ({done})")
        assert cloud.python(UNCHANGED)


class TestFileBrowsers:
    """Import and export by keys alone."""

    @pytest.mark.parametrize(("name", "suffix"), EXPORTS.items())
    def test_export(self, browsing, name, suffix):
        file = f"os.path.join(folder, 'Cloud{suffix}')"
        browse(browsing, name)
        browsing.shot(f"browser_{suffix[1:]}")
        browsing.key("Escape")
        browsing.wait_until(f"not {BROWSING}")
        assert browsing.python("os.listdir(folder)") == ["browsed.blend"]
        browse(browsing, name)
        browsing.key("Return")
        browsing.wait_until(f"os.path.isfile({file}) and os.path.getsize({file})", 60)
        browsing.wait_until(f"not {WORKING}")
        assert browsing.python("sorted(os.listdir(folder))") == sorted(["browsed.blend", f"Cloud{suffix}"])
        assert browsing.python("everything(bpy.context.object) == before")

    def test_import(self, browsing):
        browsing.python("bpy.ops.meshfree.export_points(filepath=os.path.join(folder, 'Scan.ply'))")
        for key in ("Escape", "Return"):
            browse(browsing, "Import Points")
            browsing.python(
                "files = next(area for area in main_window().screen.areas if area.type == 'FILE_BROWSER')\n"
                "files.spaces.active.params.directory = folder.encode()"
            )
            browsing.wait_until("files.spaces.active.params.directory.rstrip(b'/') == folder.encode()")
            browsing.settle()
            browsing.key("a")  # the one file that it lists
            browsing.shot("browser_import")
            browsing.key(key)
            browsing.wait_until(f"not {BROWSING}")
            if key == "Escape":
                assert browsing.python("everything(bpy.context.object) == before")
        browsing.wait_until("bpy.context.object.name == 'Scan'", 60)
        browsing.wait_until(f"not {WORKING}")
        found = browsing.python("attribute(bpy.context.object, 'position')")
        assert found == browsing.python("attribute(bpy.data.objects['Cloud'], 'position')")
        assert browsing.python("everything(bpy.data.objects['Cloud'])['attributes'] == before['attributes']")
