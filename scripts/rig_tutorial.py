"""docs/rig_a_scan.md, played in a window word by word, for its test and its pictures."""

import tutorial
from tutorial import CORAL, WORKING


def add_bones(gui, quote, keep):
    """Step 2: two bones in an arm."""
    quote("Press Numpad 1")
    gui.key("KP_1")
    quote("Press Shift+A, type `arm`, and press Return")
    gui.key("shift+a")
    gui.type("arm")
    gui.key("Return")
    gui.wait_until("bpy.context.object.type == 'ARMATURE'")
    quote("Press Tab for Edit Mode")
    gui.key("Tab")
    gui.wait_until("bpy.context.mode == 'EDIT_ARMATURE'")
    quote("Press Alt+Z")
    gui.key("alt+z")
    for words, keys in (
        ("Press G, X, -0.8 and Return", "gx-0.8"),
        ("then G, Z, -1.4 and Return", "gz-1.4"),
        ("Press E, X, -1 and Return", "ex-1"),
        ("then G, Z, -0.5 and Return", "gz-0.5"),
    ):
        quote(words)
        gui.type(keys)
        gui.key("Return")
    keep("bones")
    quote("Press Tab for Object Mode")
    gui.key("Tab")
    gui.wait_until("bpy.context.mode == 'OBJECT'")


def weigh(gui, quote, keep):
    """Step 3: weights."""
    quote("Click the coral")
    _click_coral(gui)
    quote("Ctrl-click *Armature* in the Outliner")
    _outliner(gui, "Armature", "ctrl")
    gui.wait_until(f"bpy.context.object.type == 'ARMATURE' and {CORAL}.select_get()")
    quote("Open *Move*")
    gui.open_panel("meshfree.auto_weights")

    quote("press *Automatic Weights...*")
    gui.press("meshfree.auto_weights")
    quote("then Return")
    gui.key("Return")
    gui.wait_until(f"{CORAL}.parent is not None and not {WORKING}", 240)
    quote("Click the coral in the view again")
    _click_coral(gui)


def pose(gui, quote, keep):
    """Step 4: the arm bends."""
    quote("Click *Armature* in the Outliner")
    _outliner(gui, "Armature")
    gui.wait_until("bpy.context.object.type == 'ARMATURE'")
    quote("press Ctrl+Tab for Pose Mode")
    gui.point_at_view()
    gui.key("ctrl+Tab")
    gui.wait_until("bpy.context.mode == 'POSE'")
    quote("click the outer bone")
    gui.click(*gui.python("on_screen((-1.3, 0.0, -0.65))"))
    gui.wait_until("[bone.name for bone in bpy.context.selected_pose_bones] == ['Bone.001']")
    quote("Press R, Y and 60, and Return")
    _bend(gui)
    keep("posed")


def animate(gui, quote, keep):
    """Step 5: two keyframes."""
    quote("Press Alt+R")
    gui.key("alt+r")
    quote("and I for a keyframe")
    gui.key("i")
    quote("Press Shift+Right Arrow")
    gui.key("shift+Right")
    gui.wait_until("bpy.context.scene.frame_current == 250")
    quote("R, Y and 60, and Return")
    _bend(gui)
    quote("and press I again")
    gui.key("i")
    quote("Shift+Left Arrow")
    gui.key("shift+Left")
    gui.wait_until("bpy.context.scene.frame_current == 1")
    quote("Space plays")
    gui.key("space")
    gui.wait_until("bpy.context.scene.frame_current > 3", 120)
    gui.key("space")
    keep("played")


def _click_coral(gui):
    gui.click(*gui.python("on_screen((0.8, 0.0, 0.3))"))
    gui.wait_until(f"bpy.context.object == {CORAL}")


def _bend(gui):
    gui.type("ry60")
    gui.key("Return")
    gui.wait_until("abs(bpy.context.object.pose.bones['Bone.001'].matrix_basis.to_euler()[2]) > 0.5")


def _outliner(gui, name, *held):
    """Click the row of an object in the Outliner, with some keys held."""
    x, y, width, _ = gui.region("WINDOW", "OUTLINER")
    for key in held:
        gui.run("xdotool", "keydown", key)
    try:
        for row in range(round(y) + 10, round(y) + 130, 20):
            gui.click(x + 0.45 * width, row)
            if gui.python(f"bpy.context.object and bpy.context.object.name == {name!r}"):
                return
    finally:
        for key in held:
            gui.run("xdotool", "keyup", key)
        gui.settle()
    raise RuntimeError(f"The Outliner has no row {name}")


STEPS = (tutorial.import_sample, add_bones, weigh, pose, animate)


def play(gui, keep):
    """Play all steps; `keep` gets the name of each picture that the tutorial has."""
    tutorial.play(gui, keep, "rig_a_scan.md", STEPS)
