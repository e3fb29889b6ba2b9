"""The README's first command with a scan of the user's own, as `make demo SCAN=file.ply` runs it."""

import os
import subprocess
import sys

import bpy
import numpy as np
import pytest

import package

from .clouds import sphere_points

SCAN = package.ROOT / "build" / "demo" / "scan.png"


def demonstrate(tmp_path, columns, **header):
    """Run the demonstration with points, (n, 3 or more), and return what it prints."""
    np.savetxt(tmp_path / "scan.xyz", columns, **header)
    (tmp_path / "user").mkdir()
    done = subprocess.run(
        [sys.executable, str(package.ROOT / "scripts" / "demo.py"), str(tmp_path / "scan.xyz"), "--up", "Z"],
        env={**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user")},
        cwd=package.ROOT,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert "points       600" in done.stdout, done.stdout + done.stderr
    assert "written      build/demo/demo.png" in done.stdout, done.stdout + done.stderr
    return done.stdout


@pytest.mark.usefixtures("installed")
def test_the_demonstration_analyzes_and_renders_a_scan(tmp_path):
    assert "scan.png" not in demonstrate(tmp_path, sphere_points(600))
    assert not SCAN.exists()


@pytest.mark.usefixtures("installed")
def test_the_demonstration_shows_a_scan_in_its_colors(tmp_path):
    columns = np.hstack([sphere_points(600), np.tile([255, 0, 0], (600, 1))])
    assert "written      build/demo/scan.png" in demonstrate(tmp_path, columns, header="x y z red green blue")
    picture = bpy.data.images.load(str(SCAN))
    pixels = np.array(picture.pixels).reshape(picture.size[1], picture.size[0], -1)
    red, green, blue = pixels[300:500, 540:740, :3].mean(axis=(0, 1))
    assert red > 0.5
    assert max(green, blue) < 0.2
    bpy.ops.wm.open_mainfile(filepath=str(SCAN.with_name("demo.blend")))
    assert "Color" in [
        node.attribute_name
        for material in bpy.data.materials
        for node in material.node_tree.nodes
        if node.name == "Attribute"
    ]
