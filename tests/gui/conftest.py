"""The tests play in a real Blender window, with the extension installed: `make test-gui`.

Every test starts from an empty file, so each can run alone; those of a file share one window. Not all do: Debian's
Blender, 4.3 with Python 3.13, has crashed in sessions of dozens of tests, where its own wrapper of a depsgraph was no
longer there.
"""

from pathlib import Path

import pytest

import gui_blender
import package
from window import Window

CLOUDS = (Path(__file__).parents[1] / "blender" / "clouds.py").read_text(encoding="utf-8")  # run inside Blender

# Most of the time would go by with smooth edges and lines, drawn again and again without a graphics card.
PLAIN = """
system = bpy.context.preferences.system
system.viewport_aa = "OFF"
system.use_overlay_smooth_wire = system.use_edit_mode_smooth_wire = False
"""


@pytest.fixture(scope="session")
def place():
    """Where a Blender with a window is."""
    try:
        return gui_blender.find()
    except gui_blender.LeftOutError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def archive():
    """Zip of this machine's platform."""
    path = package.archive(package.this_platform())
    assert path.exists(), f"{path.name} is missing in dist/, `make build` makes it"
    return path


@pytest.fixture(scope="module")
def window(place, archive):
    """One Blender for all tests of a file."""
    with Window(place, archive) as window:
        yield window


@pytest.fixture
def gui(window, request):
    """Give the window with an empty file; keep a picture of the end, and let no error in Python pass unseen."""
    if not window.running:  # it went down in the test before
        window.close()
        window.open()
    window.python(PLAIN)
    window.new_file()
    window.python("view3d()[0].spaces.active.overlay.show_floor = False")
    window.python(CLOUDS)
    known = len(window.complaints)
    yield window
    if window.running:
        window.shot(request.node.name.removeprefix("test_"))
    assert window.complaints[known:] == []
