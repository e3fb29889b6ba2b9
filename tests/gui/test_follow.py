"""Splats and point clouds that follow an armature, with real keys: bound, posed, given up, undone, and played."""

from pathlib import Path

import pytest

from tests.gui.test_play import finish

ARMATURES = (Path(__file__).parents[1] / "blender" / "armatures.py").read_text(encoding="utf-8")  # run inside Blender
SPLATS = (Path(__file__).parents[1] / "blender" / "splats.py").read_text(encoding="utf-8")
# A bar with two bones along z as splats, and the same points as a point cloud where Blender makes one of a mesh.
BAR = """
import sys
root = next(name for name in bpy.context.preferences.addons.keys() if name.endswith(".meshfree_laplacian"))
weights = __import__(root + ".operators.rigging.weights", fromlist=["weights"])
splats = {}
exec(SPLATS, splats)  # whose names are not those of clouds.py
bar = splats["bar_splats"](sys.modules[root + ".core"], degree=1)
height = float(bar.positions[:, 2].max())
armature = add_armature({"lower": ((0, 0, 0), (0, 0, height / 2)), "upper": ((0, 0, height / 2), (0, 0, height))})
objects = [splats["add_splats"](bar, "Splats")]
if bpy.app.version >= (4, 5):
    add_object(bar.positions, "Points")
    for other in bpy.context.view_layer.objects:
        other.select_set(other.name == "Points")
    bpy.ops.object.convert(target="POINTCLOUD")
    objects.append(bpy.context.object)
names = [obj.name for obj in objects]
share = np.clip((bar.positions[:, 2] - 0.3 * height) / (0.4 * height), 0.0, 1.0)
for obj in objects:
    weights.write_weights(obj, ["lower", "upper"], np.column_stack([1.0 - share, share]))
choose(armature, *objects)
bpy.ops.ed.undo_push(message="Bar")
"""
# Of each object: how far points of the upper end, and of the lower one, are from rest, in the mean.
SHIFTS = """
depsgraph = bpy.context.evaluated_depsgraph_get()
rest = bar.positions
found = []
for name in names:
    now = attribute(bpy.data.objects[name].evaluated_get(depsgraph), "position")
    away = np.linalg.norm(now - rest, axis=1)
    found.append([float(away[rest[:, 2] > 0.8 * height].mean()), float(away[rest[:, 2] < 0.2 * height].mean())])
found
"""
BOUND = "all(bpy.data.objects[name].meshfree.deform.is_bound for name in names)"
FAR, STILL = 1.0, 1e-5  # mean ways of points, of a bar that is more than ten long


@pytest.fixture
def bound(gui):
    """The window in Pose Mode, with the upper bone selected."""
    for code in (ARMATURES, f"SPLATS = {SPLATS!r}", BAR):
        gui.python(code)
    gui.search("Bind to Armature")
    gui.wait_until(BOUND, 60)
    finish(gui)
    gui.point_at_view()
    gui.key("KP_1", "ctrl+Tab")
    gui.wait_until("bpy.context.mode == 'POSE'")
    select(gui, "upper")
    return gui


def select(gui, name):
    """Select a bone alone, as a click on it does."""
    gui.key("alt+a")
    gui.python(f"bones = bpy.context.object.data.bones; bones.active = bones[{name!r}]")
    if gui.python("hasattr(bpy.context.object.pose.bones[0], 'select')"):  # Blender 5.0 on
        gui.python(f"bpy.context.object.pose.bones[{name!r}].select = True")
    else:
        gui.python(f"bpy.context.object.data.bones[{name!r}].select = True")
    gui.python("bpy.ops.ed.undo_push(message='Select')")
    gui.point_at_view()


def shifts(gui):
    """Return how far the upper ends of all objects are from rest, and how far the lower ones."""
    gui.settle()
    return zip(*gui.python(SHIFTS), strict=True)


def test_points_follow_a_bone_while_it_is_turned_and_go_back(bound):
    bound.key("r", "6", "0")  # still on its way
    upper, lower = shifts(bound)
    assert min(upper) > FAR
    assert max(lower) < STILL
    bound.shot("follow_on_its_way")
    bound.key("Escape")
    upper, lower = shifts(bound)
    assert max(upper) < STILL
    assert max(lower) < STILL


def test_one_undo_takes_a_pose_back_and_redo_brings_it(bound):
    bound.key("r", "6", "0", "Return")
    upper, _ = shifts(bound)
    assert min(upper) > FAR
    bound.key("ctrl+z")
    assert all(max(ends) < STILL for ends in shifts(bound))
    assert bound.python(BOUND)
    bound.key("ctrl+shift+z")
    again, _ = shifts(bound)
    assert again == pytest.approx(upper, abs=STILL)


def test_a_bone_that_is_moved_takes_all_points_of_its_children_along(bound):
    select(bound, "lower")
    bound.key("g", "x", "2", "Return")
    for ends in shifts(bound):
        assert ends == pytest.approx([2.0] * len(ends), abs=STILL)
    bound.key("ctrl+z")
    assert all(max(ends) < STILL for ends in shifts(bound))


def test_keyframes_are_played(bound):
    bound.key("i")
    bound.python("bpy.context.scene.frame_set(20)")
    bound.key("r", "6", "0", "Return", "i")
    bound.python("bpy.context.scene.frame_set(1)")
    assert all(max(ends) < STILL for ends in shifts(bound))
    bound.python("played = []")
    bound.python("bpy.app.handlers.frame_change_post.append(lambda scene, *_: played.append(scene.frame_current))")
    bound.point_at_view()
    bound.key("space")
    bound.wait_until("bpy.context.scene.frame_current >= 15", 120)
    bound.key("space")
    bound.wait_until("not main_window().screen.is_animation_playing")
    upper, lower = shifts(bound)
    assert min(upper) > FAR / 2
    assert max(lower) < STILL
    assert bound.python("len(set(played))") > 2
    bound.python("bpy.app.handlers.frame_change_post.pop() and None")
