"""Points that follow an armature, with real keys: weights, one undo, and a pose."""

from tests.gui.test_follow import ARMATURES, select
from tests.gui.test_play import finish

CLOUD = """
obj = add_object(sphere_points(1500) * (0.5, 0.5, 3.0))
armature = add_armature({"lower": ((0, 0, -2.5), (0, 0, 0)), "upper": ((0, 0, 0), (0, 0, 2.5))})
choose(armature, obj)
bpy.ops.ed.undo_push(message="Armature")
before = everything(obj)
"""
GROUPS = "[group.name for group in bpy.data.objects['Cloud'].vertex_groups]"
# Across the view from the front, of the points at the top and of those at the bottom.
SHIFTS = """
cloud = bpy.data.objects["Cloud"]
mesh = cloud.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
now = np.empty((len(mesh.vertices), 3), np.float32)
mesh.vertices.foreach_get("co", now.reshape(-1))
rest = local_points(cloud)
[float(np.abs((now - rest)[rest[:, 2] * side > 1.5, 0]).mean()) for side in (1.0, -1.0)]
"""


def weighted(gui):
    """Give weights by the menu of parents, which the search finds."""
    gui.python(ARMATURES)
    gui.python(CLOUD)
    gui.search("With Mesh-Free Weights")
    gui.key("Return")
    gui.wait_until(f"{GROUPS} == ['lower', 'upper']", 60)
    finish(gui)


def test_one_undo_takes_weights_back_and_redo_brings_them(gui):
    weighted(gui)
    gui.point_at_view()
    gui.key("ctrl+z")
    gui.wait_until(f"{GROUPS} == [] and everything(bpy.data.objects['Cloud']) == before")
    gui.key("ctrl+shift+z")
    gui.wait_until(f"{GROUPS} == ['lower', 'upper'] and bpy.data.objects['Cloud'].parent.name == 'Rig'")


def test_a_bone_that_is_turned_in_pose_mode_takes_its_points_along(gui):
    weighted(gui)
    gui.point_at_view()
    gui.key("KP_1", "ctrl+Tab")
    gui.wait_until("bpy.context.mode == 'POSE'")
    select(gui, "upper")
    gui.key("r", "3", "0", "Return")
    gui.settle()
    top, bottom = gui.python(SHIFTS)
    assert top > 0.5
    assert bottom < 0.05 * top
    gui.key("ctrl+z")
    gui.settle()
    assert max(gui.python(SHIFTS)) < 1e-4


def test_the_panel_of_the_armature_dismisses_notices_of_its_points(gui):
    gui.python(ARMATURES)
    gui.python(CLOUD)
    gui.python("bpy.ops.meshfree.auto_weights(least=0.5); obj.meshfree.notices.clear()")
    gui.python("for number in range(2): obj.meshfree.notices.add().text = str(number)")
    gui.open_tab()
    x, y, width, _ = gui.region("UI")
    gui.click(x + 0.35 * width, y + gui.text_rows()[2])  # below the name of the cloud
    gui.press("meshfree.dismiss", across=0.83)
    gui.wait_until("[notice.text for notice in bpy.data.objects['Cloud'].meshfree.notices] == ['1']")
