"""A scan with colors is seen in them right after it is dropped onto the view, whatever the view's shading."""

import numpy as np
import pytest

from tests.gui.test_tasks import DROP, IMPORTED

SCAN = """
import os
scan = os.path.join(bpy.app.tempdir, "Egg.xyz")
rows = np.hstack([{size} * sphere_points({count}), np.tile([255, 0, 0], ({count}, 1))])
np.savetxt(scan, rows, header="x y z red green blue")
"""
SHADING = "view3d()[0].spaces.active.shading.type"


def red_share(gui):
    """Share of the middle of the view that is red."""
    x, y = gui.view_center()
    pixels = gui.pixels((x - 40, y - 40, 80, 80)).astype(int)
    return np.mean(pixels[:, :, 0] > 100 + pixels[:, :, 1:].max(axis=2))


@pytest.mark.parametrize(
    ("count", "size", "shading"),
    [(3000, 1.0, "SOLID"), (12000, 1.0, "MATERIAL"), (3000, 2000.0, "SOLID")],
    ids=["discs", "dots", "kilometers"],
)
def test_a_red_scan_is_red(gui, count, size, shading):
    """Of 12,000 points dots are drawn where there is no graphics card, and Solid cannot color these.

    A view of Blender's own settings ends at a kilometer.
    """
    gui.python(SCAN.format(count=count, size=size))
    gui.python(f"{SHADING} = 'SOLID'")
    gui.python(DROP)
    gui.key("Return")
    gui.wait_until(IMPORTED)
    assert gui.python(SHADING) == shading
    gui.wait_for(lambda: red_share(gui) > 0.9, "the scan is red")
    gui.python(f"{SHADING} = 'MATERIAL'")
    gui.wait_for(lambda: red_share(gui) > 0.9, "the scan is red in Material Preview")
