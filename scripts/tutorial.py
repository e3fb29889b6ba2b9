"""docs/tutorial.md, played in a window word by word, for its test and its pictures; rig_tutorial.py plays another one.

Every step quotes its instructions. Instructions that are not played are an error, as are steps that the tutorial does
not describe; so no key has to be guessed.
"""

import re

from environments import ROOT
from window import WindowError

SAMPLE = ROOT / "docs" / "coral.ply"
CORAL = "bpy.data.objects['coral']"
HANDLE = "bpy.data.objects['coral Handle']"
WORKING = "len(main_window().modal_operators)"
SHOWN = """
import sys
display = next(module for name, module in sys.modules.items() if name.endswith("ui.display"))
display.shown_attribute(bpy.context.object)
"""
MOVED = f"np.linalg.norm(attribute({CORAL}, 'lb_displacement'), axis=1).max()"
_FILE, _NEW, _GENERAL = (46, 14), (70, 38), (300, 37)  # a button of the top bar, and those that it opens
_DROP = f"""
import os
area, region, _ = view3d()
with bpy.context.temp_override(window=main_window(), area=area, region=region):
    bpy.ops.wm.drop_import_file("INVOKE_DEFAULT", directory=os.environ["HOME"], files=[{{"name": "{SAMPLE.name}"}}])
"""
_ORDERS = re.compile(  # words for what is to be done
    r"\b(press|click|choose|open|switch|drag a|set|delete|move the mouse|start|look at)\b", re.IGNORECASE
)
_MEMBERS = f"""
def members(name):
    index = {CORAL}.vertex_groups[name].index
    return [vertex.index for vertex in {CORAL}.data.vertices if any(item.group == index for item in vertex.groups)]
"""


class Reader:
    """Reads the steps of the tutorial in their order.

    Parameters
    ----------
    text : str
        The tutorial.
    """

    def __init__(self, text):
        lines = text.partition("\n## Go on")[0].splitlines()
        self._text = " ".join(" ".join(line for line in lines if not line.startswith(("#", "!["))).split())
        self._place = 0

    def __call__(self, words):
        """Go on to the instruction that is played next."""
        place = self._text.find(words, self._place)
        if place < 0:
            raise WindowError(f"The tutorial does not say {words!r} after {self._text[: self._place][-80:]!r}")
        self._pass(place)
        self._place = place + len(words)

    def end(self):
        """Find nothing more to do."""
        self._pass(len(self._text))

    def _pass(self, place):
        passed = self._text[self._place : place]
        if _ORDERS.search(passed):
            raise WindowError(f"Nobody plays what the tutorial says: {passed!r}")


def import_sample(gui, quote, keep):
    """Step 1: the points in a new file, and the tab."""
    quote("Start with a new file (*File > New > General*)")
    for place in (_FILE, _NEW, _GENERAL):
        gui.click(*place)
    gui.wait_until("bool(bpy.context.window_manager.windows) and 'Cube' in bpy.data.objects")
    gui.python("bpy.context.scene.eevee.taa_samples = 1")  # drawn without a graphics card
    quote("delete the cube: click it")
    gui.click(*gui.python("on_screen((0.0, 0.0, 0.0))"))
    quote("press Delete")
    gui.key("Delete")
    gui.wait_until("'Cube' not in bpy.data.objects")
    quote("Drag `coral.ply` from your file manager into the 3D view")
    gui.point_at_view()
    gui.python(_DROP)
    gui.settle()
    quote("click *Import Points* in the menu")
    gui.key("p")  # the letter that is underlined there
    gui.wait_until(f"'coral' in bpy.data.objects and {CORAL}.select_get() and not {WORKING}", 60)
    gui.wait_until(f"'lb_disc' in {CORAL}.data.attributes")
    quote("Move the mouse over the 3D view")
    gui.point_at_view()
    quote("press N")
    gui.key("n")
    gui.wait_until("view3d()[2].width > 50")
    quote("click the tab *Mesh-Free*")
    gui.open_tab()
    quote("*coral: 10,000 points*")
    gui.wait_until(f"len({CORAL}.data.vertices) == 10000")
    gui.point_at_view()
    keep("import")


def drag(gui, quote, keep):
    """Step 2: bent by the mouse, and back."""
    quote("Press *Bend*")
    gui.press("meshfree.deform_bind(", across=0.75)  # in the right column
    gui.wait_until(f"bpy.context.object.name == 'coral Handle' and not {WORKING}", 240)
    quote("press G, move the mouse, and click")
    x, y = gui.view_center()
    gui.point_at_view()
    gui.key("g")
    for step in range(1, 6):
        gui.move(x + 30 * step, y - 20 * step)
    gui.click(x + 150, y - 100)
    gui.wait_until(f"{MOVED} > 0.3 and not {WORKING}", 240)
    gui.settle()
    keep("dragged")
    quote("Press Ctrl+Z twice")
    gui.key("ctrl+z", "ctrl+z")
    gui.wait_until(f"'coral Handle' not in bpy.data.objects and bpy.context.object == {CORAL}")


def analyze(gui, quote, keep):
    """Step 3: colors."""
    quote("Press *Analyze Points*")
    gui.press("meshfree.analyze")
    gui.wait_until(f"'lb_area' in {CORAL}.data.attributes and not {WORKING}", 240)
    quote(f"{gui.python(f'{CORAL}.meshfree.total_area'):.1f} m²")
    gui.point_at_view()
    keep("colors")
    for words, name in (("Click the list under *Show* and choose", "Area"), ("again", "Mean Curvature")):
        quote(words)
        show(gui, name)


def show(gui, name):
    """Choose a result in the list under Show, left of the arrows and of the button for a new range."""
    x, y = gui.find_button("meshfree.colormap()", across=0.83)
    gui.click(x - 0.5 * gui.region("UI")[2], y)
    gui.type(name)
    gui.key("Return")
    gui.wait_for(lambda: gui.python(SHOWN) == f"lb_{name.lower().replace(' ', '_')}", f"{name} is shown", 60)


def choose(gui, quote, keep):
    """Step 4: groups."""
    gui.python(_MEMBERS)
    quote("over the view, press Numpad 1")
    gui.point_at_view()
    gui.key("KP_1")
    quote("and Tab")
    gui.key("Tab")
    gui.wait_until(f"{CORAL}.mode == 'EDIT'")
    quote("Open *Move*")
    gui.open_panel(".meshfree.deform.handles")
    quote("Then open *Points* under *Show*")
    gui.open_panel(".meshfree.show_groups")
    quote("switch on *Group Colors*")
    gui.press(".meshfree.show_groups", across=0.6)
    gui.wait_until(f"{CORAL}.meshfree.show_groups")
    quote("press B")
    gui.point_at_view()
    gui.key("b")
    quote("drag a box around the right half of the points")
    _box(gui, (0.2, -2.2), (2.2, 2.2))
    quote("Press *Assign to Anchors*")
    _find(gui, gui.press, "meshfree.group_from_selection(role='ANCHOR'")
    quote("press Alt+A")
    gui.point_at_view()
    gui.key("alt+a")
    quote("then B")
    gui.key("b")
    quote("drag a box around the tip of the arm at the lower left")
    _box(gui, (-2.2, -1.3), (-1.3, 0.0))
    quote("Press *Assign to Handles*")
    _find(gui, gui.press, "meshfree.group_from_selection(role='HANDLE'")
    gui.point_at_view()
    keep("groups")
    quote("Switch *Group Colors* off again")
    _find(gui, lambda button: gui.press(button, across=0.6), ".meshfree.show_groups")
    gui.wait_until(f"not {CORAL}.meshfree.show_groups")
    quote("press Tab")
    gui.point_at_view()
    gui.key("Tab")
    gui.wait_until(f"{CORAL}.mode == 'OBJECT'")


def _box(gui, *corners):
    """Drag a box between two corners, each x and z."""
    gui.drag(*(gui.python(f"on_screen(({x}, 0.0, {z}))") for x, z in corners))


def _find(gui, press, button):
    """Press a button of the panel, or open a panel there, wherever one has to scroll to."""
    for steps in (0, 60, -120, 12, 12, 12, 12, 12):  # here, at the end, and from the top
        gui.scroll(steps)
        try:
            return press(button)
        except WindowError as error:
            unseen = error
    raise unseen


def bend(gui, quote, keep):
    """Step 5: bind, move and rotate."""
    quote("Press *Bind* under *Bend*")
    _find(gui, gui.press, "meshfree.deform_bind")
    gui.wait_until("'coral Handle' in bpy.data.objects", 240)
    gui.wait_until(f"not {WORKING}")
    quote("Click it to select it")
    gui.click(*gui.python(f"on_screen({HANDLE}.matrix_world.translation)"))
    gui.wait_until("bpy.context.object.name == 'coral Handle'")
    quote("Press G, Z and 1, and Return")
    gui.key("g", "z", "1", "Return")
    gui.wait_until(f"{MOVED} > 0.9")
    quote("Press R, Y and 60, and Return")
    gui.key("r", "y", "6", "0", "Return")
    gui.wait_until(f"{CORAL}.data['lb_pose'][0] == 1.0", 60)
    gui.settle()
    keep("bent")


def color(gui, quote, keep):
    """Step 6: how far the points went, and what the bent shape is like."""
    quote("Click the coral")
    gui.click(*gui.python("on_screen((0.0, 0.0, 0.3))"))
    gui.wait_until("bpy.context.object.name == 'coral'")
    quote("choose *Displacement* in the list under *Show*")
    _find(gui, lambda name: show(gui, name), "Displacement")
    gui.point_at_view()
    keep("display")
    quote("Press *Apply* under *Bend*")
    _find(gui, gui.press, "meshfree.deform_apply")
    gui.wait_until(f"{MOVED} == 0.0")
    quote("then *Analyze Points* at the top")
    _find(gui, gui.press, "meshfree.analyze")
    gui.wait_until(WORKING)
    gui.wait_until(f"not {WORKING}", 240)
    quote("and choose *Mean Curvature* in that list")
    _find(gui, lambda name: show(gui, name), "Mean Curvature")


def render(gui, quote, keep):
    """Step 7: a picture by the camera."""
    gui.python("rendered = []; bpy.app.handlers.render_complete.append(lambda *_: rendered.append(True))")
    quote("Look at the coral from where you like, with room around it")
    x, y = gui.view_center()
    gui.drag((x, y), (x + 60, y - 20), button="middle")
    gui.click(x, y, "wheel down", 4)
    quote("press Ctrl+Alt+Numpad 0")
    gui.key("ctrl+alt+KP_0")
    gui.wait_until("view3d()[0].spaces.active.region_3d.view_perspective == 'CAMERA'")
    quote("Under *Show* open *Legend*")
    _find(gui, gui.open_panel, ".meshfree.legend")
    quote("set *Standard* right there")
    _find(gui, lambda button: _choose_standard(gui, button), ".view_settings.view_transform")
    quote("Press *Legend in Renders*")
    _find(gui, gui.press, "meshfree.legend")
    quote("then F12")
    gui.point_at_view()
    gui.key("F12")
    gui.wait_until("rendered", 240)
    keep("result")


def _choose_standard(gui, setting):
    """Go through the entries of the list that the mouse is on, by its wheel and Ctrl, to *Standard*."""
    gui.find_button(setting, across=0.7)  # which leaves the mouse there
    for _ in range(6):
        if gui.python("bpy.context.scene.view_settings.view_transform") == "Standard":
            return
        gui.run("xdotool", "keydown", "ctrl", "click", "4", "keyup", "ctrl")
        gui.settle()
    raise RuntimeError("The list has no entry Standard")


STEPS = (import_sample, drag, analyze, choose, bend, color, render)


def play(gui, keep, page="tutorial.md", steps=STEPS):
    """Play all steps of a page; `keep` gets the name of each picture that it has."""
    # Those that are open before anybody opens or closes some.
    gui.open_panels("MESHFREE_PT_display", "MESHFREE_PT_statistics", "MESHFREE_PT_select")
    gui.new_file()
    (gui.folder / SAMPLE.name).write_bytes(SAMPLE.read_bytes())
    quote = Reader((ROOT / "docs" / page).read_text(encoding="utf-8"))
    for step in steps:
        step(gui, quote, keep)
    quote.end()
