"""PLY files dropped onto the view: by one click they look like what they are, scans in their colors, or splats."""

import pytest

from tests.gui.test_own_colors import SHADING, red_share
from tests.gui.test_tasks import DROP

DROP_PLY = DROP.replace("Egg.xyz", "Egg.ply")
THERE = "'Egg' in bpy.data.objects and not len(main_window().modal_operators)"
# A red egg, as a scan with colors, and as splats that touch.
FILES = {
    "scan": """
colors = np.tile(np.uint8([255, 0, 0]), (2000, 1))
rows = [*zip(map(tuple, sphere_points(2000)), map(tuple, colors))]
kinds = ["float x", "float y", "float z", "uchar red", "uchar green", "uchar blue"]
data = np.array([(*place, *color) for place, color in rows], "<f4, <f4, <f4, u1, u1, u1")
""",
    "splats": """
splat = [1.7, -1.7, -1.7, 4.0, -3.0, -3.0, -3.0, 1.0, 0.0, 0.0, 0.0]
names = "f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3"
kinds = [f"float {name}" for name in f"x y z {names}".split()]
data = np.hstack([sphere_points(2000), np.tile(splat, (2000, 1))]).astype("<f4")
""",
}
WRITE = """
import os
head = ["ply", "format binary_little_endian 1.0", "element vertex 2000", *(f"property {kind}" for kind in kinds)]
with open(os.path.join(bpy.app.tempdir, "Egg.ply"), "wb") as file:
    file.write("\\n".join([*head, "end_header", ""]).encode() + data.tobytes())
"""


@pytest.fixture(params=FILES)
def dropped(gui, request):
    """The menu that is open after a file was dropped onto a view in Solid."""
    gui.python(FILES[request.param])
    gui.python(WRITE)
    gui.python(f"{SHADING} = 'SOLID'")
    gui.python(DROP_PLY)
    gui.settle()
    gui.shot(f"dropped_{request.param}")
    return request.param


def test_points_of_the_menu_is_all(gui, dropped):
    gui.key("p")  # of Import Points, whose letter is underlined
    gui.wait_until(THERE, 60)
    gui.wait_for(lambda: red_share(gui) > 0.9, "it is red")
    gui.shot(f"dropped_{dropped}_seen")
    for kind in ("MATERIAL", "VERTEX") if dropped == "splats" else ():
        gui.python(f"{SHADING} = 'SOLID'; view3d()[0].spaces.active.shading.color_type = {kind!r}")
        gui.wait_for(lambda: red_share(gui) > 0.9, "it is red in Solid")


def test_what_blender_has_imported_is_shown_by_the_first_button(gui, dropped):
    gui.key("i")  # of Import PLY
    gui.settle()
    gui.shot(f"dropped_{dropped}_blender")
    gui.key("Return")
    gui.wait_until(THERE, 60)
    gui.open_tab()
    gui.point_at_view()
    gui.key("Home")
    gui.shot(f"dropped_{dropped}_by_blender")
    gui.press("meshfree.show_splats" if dropped == "splats" else "meshfree.show_surface")
    gui.wait_until("bpy.data.objects['Egg'].modifiers.keys() == ['Mesh-Free Display']", 60)
    gui.point_at_view()
    gui.wait_for(lambda: red_share(gui) > 0.9, "it is red")
    gui.shot(f"dropped_{dropped}_shown")
    gui.key("ctrl+z")
    gui.wait_until("not bpy.data.objects['Egg'].modifiers")
    assert gui.python("len(bpy.data.objects['Egg'].data.vertices)") == 2000
