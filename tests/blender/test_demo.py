"""The README's first command with a scan of the user's own, as `make demo SCAN=file.ply` runs it, in small pictures."""

import functools
import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

import package

from .clouds import sphere_points

FOLDER = Path("build", "demo")
SMALL = {"size": (320, 200), "samples": 4}
RUN = f"""
import functools, studio
studio.set_up = functools.partial(studio.set_up, **{SMALL})
import demo
demo.main()
"""


@pytest.mark.usefixtures("installed")
def test_the_demonstration_shows_a_scan_in_its_colors(tmp_path):
    columns = np.hstack([sphere_points(600), np.tile([255, 0, 0], (600, 1))])
    np.savetxt(tmp_path / "scan.xyz", columns, header="x y z red green blue")
    (tmp_path / "user").mkdir()
    done = subprocess.run(
        [sys.executable, "-c", RUN, str(tmp_path / "scan.xyz"), "--up", "Z"],
        env={
            **os.environ,
            "BLENDER_USER_RESOURCES": str(tmp_path / "user"),
            "PYTHONPATH": str(package.ROOT / "scripts"),
        },
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=240,
    )
    for line in ("points       600", "written      build/demo/demo.png", "written      build/demo/scan.png"):
        assert line in done.stdout, done.stdout + done.stderr
    written = tmp_path / FOLDER
    picture = bpy.data.images.load(str(written / "scan.png"))
    pixels = np.array(picture.pixels).reshape(picture.size[1], picture.size[0], -1)
    red, green, blue = pixels[75:125, 135:185, :3].mean(axis=(0, 1))
    assert red > 0.5
    assert max(green, blue) < 0.2
    bpy.ops.wm.open_mainfile(filepath=str(written / "demo.blend"))
    assert "Color" in [
        node.attribute_name
        for material in bpy.data.materials
        for node in material.node_tree.nodes
        if node.name == "Attribute"
    ]


def test_of_a_scan_without_colors_there_is_one_picture(capfd, tmp_path, monkeypatch):
    import demo
    import studio

    monkeypatch.setattr(studio, "set_up", functools.partial(studio.set_up, **SMALL))
    monkeypatch.chdir(tmp_path)
    photograph = tmp_path / FOLDER / "scan.png"
    photograph.parent.mkdir(parents=True)
    photograph.touch()  # of a run before
    np.savetxt(tmp_path / "scan.xyz", sphere_points(600))
    demo.demonstrate(tmp_path / "scan.xyz", "Z")
    told = capfd.readouterr().out
    assert "written      build/demo/demo.png" in told
    assert "scan.png" not in told
    assert not photograph.exists()
