"""Play docs/rig_a_scan.md in the window and renew its pictures.

Use it by `python scripts/play.py scripts/rig_tutorial_pictures.py`. It writes docs/pictures/rig_*.png.
"""

import rig_tutorial
from environments import ROOT

PICTURES = ROOT / "docs" / "pictures"
SHOWN = "bones", "posed"


def keeper(gui):
    """Return what keeps the pictures of the screen."""

    def keep(name):
        if name in SHOWN:
            target = PICTURES / f"rig_{name}.png"
            gui.pack(gui.shot(f"rig_{name}"), target)
            print(f"{target.relative_to(ROOT)}: {target.stat().st_size / 1e3:.0f} kB", flush=True)

    return keep


if __name__ == "__main__":
    rig_tutorial.play(gui, keeper(gui))  # noqa: F821, scripts/play.py gives the window
