"""The README's first command with a scan of the user's own, as `make demo SCAN=file.ply` runs it, in small pictures."""

import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

import package

from .clouds import sphere_points
from .conftest import part

FOLDER = Path("build", "demo")
SMALL = {"size": (480, 200), "samples": 4}
RUN = f"""
import demo
demo.PICTURE = {SMALL}
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
    for line in ("points       600", "written      build/demo/demo.png"):
        assert line in done.stdout, done.stdout + done.stderr
    written = tmp_path / FOLDER
    picture = bpy.data.images.load(str(written / "demo.png"))
    pixels = np.array(picture.pixels).reshape(picture.size[1], picture.size[0], -1)[75:125]
    colored, curved, waving = (pixels[:, place : place + 30, :3].mean(axis=(0, 1)) for place in (65, 225, 385))
    assert colored[0] > 0.5
    assert colored[1:].max() < 0.2
    assert min(np.abs(curved - colored).max(), np.abs(waving - curved).max()) > 0.2
    bpy.ops.wm.open_mainfile(filepath=str(written / "demo.blend"))
    assert "Color" in [
        node.attribute_name
        for material in bpy.data.materials
        for node in material.node_tree.nodes
        if node.name == "Attribute"
    ]


def test_a_scan_without_colors_is_made_of_clay(capfd, tmp_path, monkeypatch):
    import demo

    monkeypatch.setattr(demo, "PICTURE", SMALL)
    monkeypatch.chdir(tmp_path)
    (tmp_path / FOLDER).mkdir(parents=True)
    np.savetxt(tmp_path / "scan.xyz", sphere_points(600))
    demo.demonstrate(tmp_path / "scan.xyz", "Z")
    assert "written      build/demo/demo.png" in capfd.readouterr().out
    (modifier,) = bpy.data.objects["scan"].modifiers
    assert part("operators.objects.modifiers").get_input(modifier, "Material").name == "Clay"
