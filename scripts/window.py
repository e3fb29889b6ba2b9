"""A Blender with a window, played with real keys and a real mouse.

Use it like this, in a script for `python scripts/play.py SCRIPT`, where `gui` is there already, or by hand in
`python scripts/play.py`:

    gui.new_file()                              # an empty scene
    gui.python("bpy.ops.mesh.primitive_uv_sphere_add()")
    gui.point_at_view()                         # keys go to what the mouse is on
    gui.key("g", "x", "1", "Return")
    gui.open_tab("Mesh-Free")
    gui.press("meshfree.analyze")               # a click on the button of this operator in the sidebar
    gui.wait_until("'lb_area' in bpy.context.object.data.attributes", 60)
    gui.python("attribute(bpy.context.object, 'lb_area').sum()")  # the value of the last line comes back
    gui.shot("analyzed")                        # a picture of the screen in build/gui/

Places on the screen are counted in pixels from its upper left corner. Code runs on Blender's main thread between two
events, so it waits while Blender is busy. What it changes makes no undo step: end it with `bpy.ops.ed.undo_push()`.
"""

import json
import os
import select
import shutil
import signal
import subprocess
import time
from pathlib import Path

from environments import ROOT

PICTURES = ROOT / "build" / "gui"
SIZE = (1280, 800)
START = 120  # seconds that Blender may take to start on a busy machine
DRAWING = 240  # seconds that it may take to draw, when shaders for a graphics card are compiled for the processor
NOTICES = 6  # row of the sidebar with the notices of a cloud
_DOUBLE = 0.5  # seconds: within 350 ms, Blender's default, two presses of a key are a double click
_BUTTON = 16  # pixels, less than a button is high: none is passed over
_BUTTONS = {"left": 1, "middle": 2, "right": 3, "wheel up": 4, "wheel down": 5}


class WindowError(Exception):
    """Something in the window is not as it has to be."""


class Window:
    """A screen of its own, and Blender with the extension on it.

    Parameters
    ----------
    place : gui_blender.Place
        Where Blender runs.
    archive : pathlib.Path, optional
        The zip of the extension to install.
    pictures : pathlib.Path, optional
        Folder of the pictures.
    """

    def __init__(self, place, archive=None, pictures=PICTURES):
        self.place, self.archive, self.pictures = place, archive, pictures
        self._screen = self._blender = None
        self._pressed = {}  # when each key was
        self.open()

    def open(self):
        """Open the screen, install the extension and start Blender."""
        self.folder = self.place.make_folder()  # files here are seen from both sides
        self.log = self.folder / "blender.log"
        self._variables = {
            "HOME": str(self.place.inside(self.folder)),
            "TMPDIR": str(self.place.inside(self.folder)),
            "BLENDER_USER_RESOURCES": str(self.place.inside(self.folder / "resources")),
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "MESA_SHADER_CACHE_DIR": str(self.place.cache),  # what is compiled once serves later sessions too
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONNOUSERSITE": "1",
        }
        try:
            self._open_screen()
            if self.archive is not None:
                self._install(self.archive)
            self._start()
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.close()

    # Starting and ending

    def _open_screen(self):
        """Start a screen that nobody sees, on the first free number."""
        size = f"{SIZE[0]}x{SIZE[1]}x24"
        command = ["Xvfb", "-displayfd", "1", "-screen", "0", size, "-nolisten", "tcp", "-ac"]
        command += ["-terminate"]  # with Blender, which ends with this program, however that ends
        with (self.folder / "screen.log").open("w") as log:
            self._screen = self._popen(command, stdout=subprocess.PIPE, stderr=log)
        if not select.select([self._screen.stdout], [], [], START)[0]:
            raise WindowError("The screen does not start")
        number = self._screen.stdout.readline().strip().decode()
        if not number:
            raise WindowError(f"The screen does not start: {(self.folder / 'screen.log').read_text()}")
        self._variables["DISPLAY"] = f":{number}"

    def _popen(self, words, **options):
        command = self.place.command(words, **self._variables)
        return subprocess.Popen(command, start_new_session=True, **options)

    def run(self, *words, seconds=60):
        """Run a program beside Blender, on the same screen, and return what it prints."""
        command = self.place.command(words, **self._variables)
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=seconds)
        if done.returncode or (words[0] == "xdotool" and done.stderr):  # it goes on after names that are no keys
            raise WindowError(f"{words[0]} failed: {(done.stderr or done.stdout).decode()[-2000:]}")
        return done.stdout

    def run_blender(self, *arguments, seconds=300):
        """Run another Blender without a window and with the same extensions; return what it prints."""
        return self.run(self.place.blender, "--background", *arguments, seconds=seconds).decode()

    def _install(self, archive):
        shutil.copy(archive, self.folder)
        zip_inside = self.place.inside(self.folder / archive.name)
        words = ("--command", "extension", "install-file", "-r", "user_default", "--enable", zip_inside)
        self.run(self.place.blender, *words, seconds=300)
        (self.folder / archive.name).unlink()

    def _start(self):
        driver = Path(shutil.copy(Path(__file__).with_name("window_driver.py"), self.folder))
        requests_read, self._requests = os.pipe()
        self._answers, answers_write = os.pipe()
        self._buffer = b""
        self._variables["MESHFREE_PIPES"] = f"{requests_read} {answers_write}"
        arguments = ["--window-geometry", "0", "0", *map(str, SIZE), "--python", self.place.inside(driver)]
        with self.log.open("a") as log:
            self._blender = self._popen(
                [self.place.blender, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                pass_fds=(requests_read, answers_write),
            )
        os.close(requests_read)
        os.close(answers_write)
        self.python("bpy.context.preferences.view.show_splash = False", START)
        self.python("bpy.context.preferences.view.smooth_view = 0")
        self.key("Escape")  # the splash screen, if it was faster

    def close(self):
        """End all, and remove the folder."""
        if self._blender is not None:
            _end(self._blender)
            os.close(self._requests)
            os.close(self._answers)
            self._blender = None
        if self._screen is not None:
            _end(self._screen)
            self._screen.stdout.close()
            self._screen = None
        shutil.rmtree(self.folder, ignore_errors=True)

    @property
    def running(self):
        """Whether Blender is there."""
        return self._blender is not None and self._blender.poll() is None

    @property
    def complaints(self):
        """Lines of Blender's output about errors in Python that nobody asked for."""
        return [line for line in self.log.read_text(errors="replace").splitlines() if line.startswith("Traceback")]

    # Asking Blender

    def python(self, code, seconds=DRAWING):
        """Run code in Blender and return the value of its last line, as JSON can carry it."""
        os.write(self._requests, json.dumps(code).encode() + b"\n")
        until = time.monotonic() + seconds
        while b"\n" not in self._buffer:
            left = until - time.monotonic()
            if left <= 0 or not select.select([self._answers], [], [], left)[0]:
                raise WindowError(f"Blender gives no answer for {seconds} s to: {code}")
            received = os.read(self._answers, 1 << 20)
            if not received:
                raise WindowError(f"Blender has ended:\n{self._last_words()}")
            self._buffer += received
        line, self._buffer = self._buffer.split(b"\n", 1)
        answer = json.loads(line)
        if "error" in answer:
            raise WindowError(answer["error"])
        return answer["value"]

    def _last_words(self):
        """Read the end of Blender's output, and where it crashed."""
        self._blender.wait(DRAWING)  # it writes that down first
        texts = [self.log.read_text(errors="replace")[-3000:]]
        return "\n".join(texts + [path.read_text(errors="replace") for path in self.folder.glob("*.crash.txt")])

    def settle(self):
        """Let Blender see the keys and moves that were sent, and draw, which takes long when shaders are compiled."""
        for _ in range(3):
            self.python("None", DRAWING)

    def wait_until(self, expression, seconds=30):
        """Ask until an expression is true in Blender, and return its value."""
        return self.wait_for(lambda: self.python(expression), expression, seconds)

    def wait_for(self, condition, meaning, seconds=30):
        """Ask until a function without arguments, about the screen for instance, returns what is true; return that."""
        until = time.monotonic() + seconds
        while not (value := condition()):
            if time.monotonic() > until:
                self.shot("waited_in_vain")
                raise WindowError(f"Not true within {seconds} s: {meaning}")
            time.sleep(0.02)
        return value

    # Keys and mouse

    def _xdotool(self, *words):
        self.run("xdotool", *words)
        self.settle()

    def key(self, *names):
        """Press keys one after the other, by the names of X: "g", "Return", "Escape", "ctrl+z", "KP_1".

        A key that was pressed just before waits: Blender would take both for a double click, which A knows.
        """
        keys = [name.rpartition("+")[2] for name in names]
        time.sleep(max(self._pressed.get(keys[0], 0.0) + _DOUBLE - time.monotonic(), 0.0))
        self._xdotool("key", "--delay", "30", *names)
        self._pressed |= dict.fromkeys(keys, time.monotonic())

    def type(self, text):
        """Type a text."""
        self._xdotool("type", "--delay", "10", text)

    def move(self, x, y):
        """Move the mouse."""
        self._xdotool("mousemove", str(round(x)), str(round(y)))

    def click(self, x, y, button="left", times=1):
        """Click at a place, or turn the wheel there by some steps."""
        self.move(x, y)
        self._xdotool("click", "--repeat", str(times), "--delay", "20", str(_BUTTONS[button]))

    def drag(self, start, *places, button="left", steps=4):
        """Drag from one place to another, or along several."""
        self.move(*start)
        self._xdotool("mousedown", str(_BUTTONS[button]))
        for end in places:
            for step in range(1, steps + 1):
                self.move(*(a + (b - a) * step / steps for a, b in zip(start, end, strict=True)))
            start = end
        self._xdotool("mouseup", str(_BUTTONS[button]))

    # The 3D view and its sidebar

    def region(self, region="WINDOW", area="VIEW_3D"):
        """Place of a region on the screen: x and y of its upper left corner, width, height."""
        found = [item["regions"] for item in self.python("areas()") if item["type"] == area]
        if not found or region not in found[0]:
            raise WindowError(f"There is no {region} region in the {area} area")
        return found[0][region]

    def view_center(self):
        """Middle of what is free of the 3D view."""
        x, y, width, height = self.region()
        return x + width * 0.4, y + height * 0.5

    def point_at_view(self):
        """Put the mouse on the 3D view, which then gets the keys."""
        self.move(*self.view_center())

    def open_second(self):
        """Open another window with the 3D view alone, by *Window > New Window*, on the right half of the screen."""
        known = self._windows()
        self.search("New Window")
        self.wait_until("len(bpy.context.window_manager.windows) == 2")
        self.settle()
        half = str(SIZE[0] // 2)
        for window in self._windows():  # there is no window manager that would place them
            place = ("0", "0") if window in known else (half, "0")
            self._xdotool("windowmove", window, *place, "windowsize", window, half, str(SIZE[1]))
        self.wait_until(f"all(window.width == {half} for window in bpy.context.window_manager.windows)")
        self.point_at_first()

    def point_at_first(self):
        """Put the mouse on the view of the first of two windows, which then gets the keys."""
        self._xdotool("windowfocus", self._windows()[0])
        self.point_at_view()

    def point_at_second(self):
        """Put the mouse on the second window, which then gets the keys."""
        self._xdotool("windowfocus", self._windows()[-1])
        self.move(0.7 * SIZE[0], 0.5 * SIZE[1])

    def close_second(self):
        """Close the second window, as a click on its cross does, and let the first have the screen."""
        self.python(
            "with bpy.context.temp_override(window=main_window().id_data.windows[1]): bpy.ops.wm.window_close()"
        )
        self.wait_until("len(bpy.context.window_manager.windows) == 1")
        self.resize(*SIZE)
        self.point_at_view()

    def resize(self, width, height):
        """Give Blender's only window a size, and the keys."""
        (window,) = self._windows()
        self._xdotool("windowsize", window, str(width), str(height), "windowfocus", window)
        self.wait_until(f"(main_window().width, main_window().height) == ({width}, {height})")

    def _windows(self):
        """Numbers of Blender's windows on the screen, the latest last."""
        return sorted(self.run("xdotool", "search", "--onlyvisible", "--class", "Blender").decode().split(), key=int)

    def new_file(self):
        """Start from an empty scene, with one big 3D view."""
        self.python("bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)")
        self.python("bpy.context.scene.eevee.taa_samples = 1")  # drawn without a graphics card
        self.wait_until("bool(bpy.context.window_manager.windows)")
        self.settle()
        self.point_at_view()

    def open_tab(self, name="Mesh-Free"):
        """Open a tab of the sidebar by the N key, if the sidebar is closed, and by clicks until it is the right one."""
        self.point_at_view()
        if not self.python("view3d()[0].spaces.active.show_region_ui"):
            self.key("n")
            self.wait_until("view3d()[2].width > 50")
        x, top, width, height = self.region("UI")
        for y in range(top + 15, top + height, 25):
            if self.python("view3d()[2].active_panel_category") == name:
                return
            self.click(x + width - 10, y)
        raise WindowError(f"The sidebar has no tab {name}")

    def open_panels(self, *names):
        """Let these panels of the extension, such as "MESHFREE_PT_deform", be open in the next file, and no others."""
        self.python(f"open_panels({set(names)!r})")

    def search(self, text):
        """Carry out an operator by the F3 search."""
        self.point_at_view()
        self.key("F3")
        self.type(text)
        self.key("Return")

    def find_button(self, operator, region="UI", across=0.35):
        """Find the button of an operator, such as "meshfree.analyze", and leave the mouse on it.

        It is looked for from top to bottom at that share of the way from left to right. Of several buttons of an
        operator one is found by its settings: "meshfree.group_from_selection(role='ANCHOR'". A setting is found by its
        path, after a dot: ".meshfree.show_groups".
        """
        x, top, width, height = self.region(region)
        seen = []
        for y in range(top + 8, top + height, _BUTTON):
            self.move(x + width * across, y)
            found = self.python(f"button_under_mouse({region!r})")
            if found.startswith(_written(operator)):
                return x + width * across, y
            seen += [found] if found and found not in seen else []
        raise WindowError(f"No button of {operator} is seen, only {seen}")

    def open_panel(self, first):
        """Open a closed panel of the sidebar by a click on its title; it is known by its first button or setting."""
        x, top, width, _ = self.region("UI")
        for row in self.text_rows(50)[1:]:  # of the arrows before titles, but for that of all
            y = top + row
            self.move(x + 0.35 * width, y)
            if self.python("button_under_mouse()"):
                continue
            for _ in range(2):  # another panel is closed again
                self.click(x + 0.35 * width, y)
                for below in (22, 31, 57, 80):  # a line of text, or the title of a panel within, may come first
                    self.move(x + 0.65 * width, y + below)
                    if self.python("button_under_mouse()").startswith(_written(first)):
                        return
        raise WindowError(f"No panel begins with {first}")

    def text_rows(self, width=None):
        """Find the texts in the sidebar, or in its first pixels: how far their middles are below its upper edge."""
        import numpy as np

        self.point_at_view()
        x, y, whole, height = self.region("UI")
        bright = (self.pixels((x, y, width or whole - 30, height)).max(axis=2) > 125).sum(axis=1) > 1
        edges = np.flatnonzero(np.diff(np.concatenate([[False], bright, [False]]).astype(int))).reshape(-1, 2)
        return [int(edge.mean()) for edge in edges if np.ptp(edge) > 4]

    def scroll(self, steps):
        """Turn the mouse wheel over the sidebar, downwards if above zero."""
        x, y, width, height = self.region("UI")
        if steps:
            self.click(x + 0.4 * width, y + 0.5 * height, "wheel down" if steps > 0 else "wheel up", abs(steps))

    def unfold_notices(self):
        """Open or close the list of notices, the line above the first panel."""
        x, y, width, _ = self.region("UI")
        self.click(x + 0.35 * width, y + self.text_rows()[NOTICES])
        self.point_at_view()
        self.settle()

    def press(self, operator, region="UI", across=0.35):
        """Click on the button of an operator in the sidebar."""
        self.click(*self.find_button(operator, region, across))

    # Pictures

    def pack(self, picture, target, colors=256):
        """Write a picture with few colors, as small as documents want it."""
        copy = self.folder / picture.name
        shutil.copy(picture, copy)
        words = ("convert", self.place.inside(copy), "+dither", "-colors", str(colors), "png8:-")
        target.write_bytes(self.run(*words))

    def shot(self, name, crop=None):
        """Keep a picture of the screen; crop is x, y, width, height."""
        self.settle()
        self.pictures.mkdir(parents=True, exist_ok=True)
        path = self.pictures / f"{name}.png"
        path.write_bytes(self._grab("png", crop))
        return path

    def pixels(self, crop=None):
        """Read the colors on the screen, (height, width, 3) from 0 to 255; crop is x, y, width, height."""
        import numpy as np

        self.settle()
        kind, size, depth, data = self._grab("ppm", crop).split(b"\n", 3)
        width, height = map(int, size.split())
        if (kind, depth) != (b"P6", b"255"):
            raise WindowError("The picture is none of 8 bits")
        return np.frombuffer(data, np.uint8).reshape(height, width, 3)

    def _grab(self, kind, crop):
        options = ["-crop", "{2}x{3}+{0}+{1}".format(*map(round, crop)), "+repage"] if crop else []
        return self.run("import", "-window", "root", *options, "-depth", "8", f"{kind}:-")


def _written(button):
    """Return how what `button_under_mouse` says of a button begins."""
    if button.startswith("."):
        return button[1:]
    return f"bpy.ops.{button}" if "(" in button else f"bpy.ops.{button}("


def _end(process):
    """End a program that was started here, and what it started."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGTERM)
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
